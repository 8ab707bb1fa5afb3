//! Bicubic Bezier patches, and the triangles that they stand for.

use glam::DVec3;

/// Finest level of a patch: 4096 cells along each side.
pub const MAX_PATCH_LEVEL: u32 = 12;

/// A bicubic Bezier patch. It stands for the triangles of a grid of points on it, which are never kept: a patch takes
/// as much memory as a few hundred numbers at any level.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BezierPatch {
    /// Control points, world space: four rows of four. The first parameter runs along a row.
    pub control: [[DVec3; 4]; 4],
    /// Each side is cut in two so often, 0 to [`MAX_PATCH_LEVEL`]. At level 8 a patch is 131 072 triangles, and off the
    /// smooth patch by about 2^-19 of how far the patch bends.
    pub level: u32,
}

/// Weights of the four control points of a curve.
type Weights = [f64; 4];

impl BezierPatch {
    /// Level that is fine enough for pictures.
    pub const DEFAULT_LEVEL: u32 = 8;

    /// Returns the patch of a uniform bicubic B-spline: the one of its middle. Patches of neighbouring windows of a net of
    /// control points join without a gap.
    pub fn from_b_spline(points: &[[DVec3; 4]; 4], level: u32) -> Self {
        // Symmetric, so that neighbours round alike.
        let curve = |[a, b, c, d]: [DVec3; 4]| {
            let first = ((a + c) + 4.0 * b) / 6.0;
            let last = ((b + d) + 4.0 * c) / 6.0;
            [first, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, last]
        };
        let rows = points.map(curve);
        let columns: [[DVec3; 4]; 4] =
            std::array::from_fn(|i| curve(std::array::from_fn(|j| rows[j][i])));
        Self {
            control: std::array::from_fn(|j| std::array::from_fn(|i| columns[i][j])),
            level,
        }
    }

    /// Returns how many cells a side has.
    pub fn cells(&self) -> u32 {
        1 << self.level
    }

    /// Returns vertex `(i, j)` of the grid, each from 0 to the number of cells (EXACTNESS.md, "Patches"). Patches that share the four
    /// control points of a side have the same vertices there, bit by bit.
    pub fn vertex(&self, i: u32, j: u32) -> DVec3 {
        let cells = f64::from(self.cells());
        let along = weights(f64::from(i) / cells);
        let across = weights(f64::from(j) / cells);
        let [a, b, c, d] = &self.control;
        let rows = [
            curve(*a, along),
            curve(*b, along),
            curve(*c, along),
            curve(*d, along),
        ];
        curve(rows, across)
    }

    /// Returns the unit normal of the smooth patch at a vertex of the grid; zero where it has none.
    pub fn normal(&self, i: u32, j: u32) -> DVec3 {
        let cells = f64::from(self.cells());
        let [_, along, across] = Net(self.control).at([f64::from(i) / cells, f64::from(j) / cells]);
        let normal = along.cross(across);
        (normal / normal.abs().max_element()).normalize_or_zero()
    }

    /// Returns the corners of a triangle of cell `(i, j)`: the first holds the corner `(i + 1, j)`, the second `(i, j + 1)`; both the
    /// diagonal between the others.
    pub fn triangle(&self, [i, j]: [u32; 2], is_second: bool) -> [DVec3; 3] {
        let (from, to) = (self.vertex(i, j), self.vertex(i + 1, j + 1));
        if is_second {
            [from, to, self.vertex(i, j + 1)]
        } else {
            [from, self.vertex(i + 1, j), to]
        }
    }

    /// Returns the triangles of the patch at a level of the caller's, row by row.
    pub fn triangles(&self, level: u32) -> impl Iterator<Item = [DVec3; 3]> {
        let coarse = Self {
            control: self.control,
            level,
        };
        let cells = coarse.cells();
        (0..cells)
            .flat_map(move |j| (0..cells).map(move |i| [i, j]))
            .flat_map(move |cell| [false, true].map(|half| coarse.triangle(cell, half)))
    }

    /// Returns all control points.
    pub fn points(&self) -> impl Iterator<Item = DVec3> {
        self.control.iter().flatten().copied()
    }
}

/// Bernstein's polynomials: symmetric, so that a side that is run through the other way has the same points.
fn weights(t: f64) -> Weights {
    let s = 1.0 - t;
    [
        (s * s) * s,
        3.0 * ((s * s) * t),
        3.0 * ((t * t) * s),
        (t * t) * t,
    ]
}

#[inline(always)]
fn curve([a, b, c, d]: [DVec3; 4], weights: Weights) -> DVec3 {
    (a * weights[0] + d * weights[3]) + (b * weights[1] + c * weights[2])
}

/// Control points of a piece of a patch, rounded: for bounds and searches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Net(pub(super) [[DVec3; 4]; 4]);

impl Net {
    /// Returns the four quarters: the low half of both parameters, then along the first, along the second, along both.
    pub(super) fn quarters(&self) -> [Self; 4] {
        let mut quarters = [*self; 4];
        let (mut low, mut high) = (self.0, self.0);
        for row in 0..4 {
            [low[row], high[row]] = halves(self.0[row]);
        }
        for (number, half) in [low, high].iter().enumerate() {
            for column in 0..4 {
                let across = [
                    half[0][column],
                    half[1][column],
                    half[2][column],
                    half[3][column],
                ];
                let [near, far] = halves(across);
                for row in 0..4 {
                    quarters[number].0[row][column] = near[row];
                    quarters[number + 2].0[row][column] = far[row];
                }
            }
        }
        quarters
    }

    /// Returns the point at two parameters from 0 to 1, and its derivatives.
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> [DVec3; 3] {
        let slope = |row: [DVec3; 4], t: f64| {
            let s = 1.0 - t;
            let [a, b, c] = [row[1] - row[0], row[2] - row[1], row[3] - row[2]];
            3.0 * (a * (s * s) + b * (2.0 * s * t) + c * (t * t))
        };
        let (along, across) = (weights(u), weights(v));
        let values = self.0.map(|row| curve(row, along));
        let slopes = self.0.map(|row| slope(row, u));
        [
            curve(values, across),
            curve(slopes, across),
            slope(values, v),
        ]
    }

    pub(super) fn points(&self) -> impl Iterator<Item = DVec3> {
        self.0.iter().flatten().copied()
    }

    /// Returns the corners: the first, along the first parameter, along the second, along both.
    pub(super) fn corners(&self) -> [DVec3; 4] {
        [self.0[0][0], self.0[0][3], self.0[3][0], self.0[3][3]]
    }

    /// Returns by how much, along each axis, any point of the piece is at most off the two triangles between its corners, which
    /// share the diagonal from the first to the last corner.
    pub(super) fn bend(&self) -> DVec3 {
        let [first, along, across, last] = self.corners();
        let mut most = DVec3::ZERO;
        for (j, row) in self.0.iter().enumerate() {
            let v = j as f64 / 3.0;
            let (from, to) = (first.lerp(across, v), along.lerp(last, v));
            for (i, &point) in row.iter().enumerate() {
                most = most.max((point - from.lerp(to, i as f64 / 3.0)).abs());
            }
        }
        // What is between the four corners bends, too.
        most + 0.25 * ((first - along) - (across - last)).abs()
    }
}

/// De Casteljau's halves of a curve.
#[inline(always)]
fn halves([a, b, c, d]: [DVec3; 4]) -> [[DVec3; 4]; 2] {
    let (ab, bc, cd) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + d));
    let (abc, bcd) = (0.5 * (ab + bc), 0.5 * (bc + cd));
    let middle = 0.5 * (abc + bcd);
    [[a, ab, abc, middle], [middle, bcd, cd, d]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bumpy(level: u32) -> BezierPatch {
        let height = |i: usize, j: usize| f64::from((7 * i as u32 + 5 * j as u32) % 4) * 0.37;
        let control = std::array::from_fn(|j| {
            std::array::from_fn(|i| DVec3::new(i as f64, j as f64 * 1.3, height(i, j)))
        });
        BezierPatch { control, level }
    }

    #[test]
    fn neighbours_share_the_vertices_of_their_side() {
        let one = bumpy(5);
        // The second patch begins where the first ends, and runs through the side the other way.
        let mut control = one.control.map(|row| row.map(|point| point + DVec3::Z));
        for (j, row) in one.control.iter().enumerate() {
            control[3 - j][0] = row[3];
        }
        let other = BezierPatch { control, level: 5 };
        for j in 0..=32 {
            assert_eq!(one.vertex(32, j), other.vertex(0, 32 - j));
        }
        assert_eq!(one.vertex(0, 0), one.control[0][0]);
        assert_eq!(one.vertex(32, 32), one.control[3][3]);
    }

    #[test]
    fn neighbouring_windows_of_a_spline_join() {
        let net: Vec<Vec<DVec3>> = (0..5)
            .map(|j| {
                let place = |i: i32| {
                    DVec3::new(f64::from(i), f64::from(j) * 0.7, f64::from(i * j % 3) * 0.3)
                };
                (0..5).map(place).collect()
            })
            .collect();
        let window = |i: usize, j: usize| {
            let points = std::array::from_fn(|y| std::array::from_fn(|x| net[j + y][i + x]));
            BezierPatch::from_b_spline(&points, 3)
        };
        for k in 0..=8 {
            assert_eq!(window(0, 0).vertex(8, k), window(1, 0).vertex(0, k));
            assert_eq!(window(0, 0).vertex(k, 8), window(0, 1).vertex(k, 0));
        }
    }

    #[test]
    fn no_point_is_farther_off_its_chords_than_it_bends() {
        let patch = bumpy(4);
        let net = Net(patch.control);
        let bend = net.bend();
        let [first, along, across, last] = [net.0[0][0], net.0[0][3], net.0[3][0], net.0[3][3]];
        let mut most = DVec3::ZERO;
        for j in 0..=16 {
            for i in 0..=16 {
                let (u, v) = (f64::from(i) / 16.0, f64::from(j) / 16.0);
                let flat = if u >= v {
                    first + (along - first) * u + (last - along) * v
                } else {
                    first + (across - first) * v + (last - across) * u
                };
                most = most.max((patch.vertex(i, j) - flat).abs());
            }
        }
        assert!(most.cmple(bend).all(), "{most} {bend}");
        assert!(most.z > 0.2 * bend.z, "{most} {bend}");
    }
}
