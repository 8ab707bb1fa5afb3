//! The scene as a light sees it, on planes of cells.
//!
//! In: a light, surfaces, starts. Out: which cells a surface may darken, which it darkens whole, from what
//! depth on; and the cell of a start. A point has six planes, the faces of a cube round it; a direction has
//! one, onto which everything is moved along the direction. Both are the same arithmetic: a point of space
//! has a place `(p, q, w)` on the plane, homogeneous, and a depth that grows away from the light.
//!
//! Invariants, for all starts that are not said to be in doubt: the exact start lies in its cell's
//! [`Region`], which is the cell inflated by the plane's margin; a surface that blocks some start of a region
//! [`Projected::may_meet`] it, and is no nearer than [`Projected::nearest`]; one that
//! [`Projected::covers`] it blocks every start of the region that is deeper, other than its own.
//!
//! Margins. Let `u` be 2^-53. A difference from a light's position is rounded once, so `p / w` is off by no
//! more than `4 u`, and by the start's own error over its distance from the light, for which 2^-26 is allowed;
//! cells are inflated by 2^-22. For directions, places are in units of the scene: with `s` its largest
//! coordinate plus its size, rounding is below `2^-50 s`, `2^-38 s` is allowed for the start, and cells are
//! inflated by `2^-36 s`. Starts in doubt are those with larger errors.

use super::plane::{
    BOX_MARGIN, DIRECTION_ERROR, DIRECTION_MARGIN, Eye, POINT_ERROR, POINT_MARGIN, ROUNDOFF,
    UNDERFLOW,
};
pub(super) use super::plane::{Plane, Region};
pub(super) use super::projected::Projected;
use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders};

/// Planes round a light, and how a start finds its own.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    pub(super) planes: Vec<Plane>,
    light: LightShape,
    /// The scene's largest coordinate plus its size.
    scale: f64,
}

/// Where a start is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Nothing can be said.
    InDoubt,
    /// Nothing lies in that direction.
    Outside,
    /// In a cell of a plane.
    Cell {
        plane: usize,
        cell: usize,
        /// The depth, and a bound on its error.
        depth: f64,
        depth_error: f64,
    },
}

impl Planes {
    /// Lays planes round a light, fitted to the surfaces' box. Those in whose direction nothing lies are left
    /// without cells.
    pub(super) fn new(occluders: &Occluders, light: &LightShape, resolution: u32) -> Self {
        let light = light.without_underflow();
        let bounds = occluders.bounds();
        let scale = if bounds.is_empty() {
            0.0
        } else {
            bounds.largest_coordinate() + bounds.size().max_element()
        };
        let bounds = bounds.inflated(DVec3::splat(BOX_MARGIN * scale));
        let plane = |eye, axes, sign, margin| Plane {
            eye,
            axes,
            sign,
            from: [0.0; 2],
            cell: [0.0; 2],
            margin,
            resolution,
        };
        let planes = match light {
            LightShape::Point(position) => (0..6)
                .map(|face| {
                    let depth = face / 2;
                    let axes = [(depth + 1) % 3, (depth + 2) % 3, depth];
                    let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
                    plane(Eye::Point(position), axes, sign, POINT_MARGIN)
                })
                .collect(),
            LightShape::Direction(to) => {
                let size = to.abs();
                let depth = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]));
                let depth = depth.unwrap_or(0);
                let axes = [(depth + 1) % 3, (depth + 2) % 3, depth];
                let slopes = [to[axes[0]] / to[depth], to[axes[1]] / to[depth]];
                let middle = if bounds.is_empty() {
                    DVec3::ZERO
                } else {
                    bounds.center()
                };
                let sign = if to[depth] > 0.0 { -1.0 } else { 1.0 };
                let eye = Eye::Direction(middle, slopes);
                vec![plane(eye, axes, sign, DIRECTION_MARGIN * scale)]
            }
        };
        let mut planes = Self {
            planes,
            light,
            scale,
        };
        for plane in &mut planes.planes {
            plane.fit(&bounds);
        }
        planes
    }

    /// Returns how many cells all planes have.
    pub(super) fn cell_count(&self) -> usize {
        self.planes.iter().map(Plane::cell_count).sum()
    }

    /// Returns a depth that everything lies behind: zero for points.
    pub(super) fn before_all(&self) -> f64 {
        match self.light {
            LightShape::Point(_) => 0.0,
            LightShape::Direction(_) => -2.0 * self.scale,
        }
    }

    /// Finds the cell of a start that is so far off a point, in any coordinate, at most.
    #[inline]
    pub(super) fn place(&self, origin: DVec3, error: f64) -> Place {
        let number = match self.light {
            LightShape::Point(position) => {
                let from_light = origin - position;
                let size = from_light.abs();
                let axis = if size.x >= size.y && size.x >= size.z {
                    0
                } else if size.y >= size.z {
                    1
                } else {
                    2
                };
                // Not for NaN and starts at the light.
                if !(error <= POINT_ERROR * size[axis] && size[axis] > UNDERFLOW) {
                    return Place::InDoubt;
                }
                2 * axis + usize::from(from_light[axis] < 0.0)
            }
            LightShape::Direction(_) => {
                let is_fine = error <= DIRECTION_ERROR * self.scale
                    && origin.abs().max_element() <= 2.0 * self.scale
                    && self.scale > UNDERFLOW;
                if !is_fine {
                    return Place::InDoubt;
                }
                0
            }
        };
        let plane = &self.planes[number];
        let place = plane.project(origin);
        let depth = plane.depth(origin);
        let mut at = [0; 2];
        for axis in 0..2 {
            let cells = (place[axis] / place.z - plane.from[axis]) / plane.cell[axis];
            // Not for NaN either: planes without cells.
            if !(cells >= 0.0 && cells <= f64::from(plane.resolution)) {
                return Place::Outside;
            }
            at[axis] = (cells as usize).min(plane.resolution as usize - 1);
        }
        Place::Cell {
            plane: number,
            cell: at[1] * plane.resolution as usize + at[0],
            depth,
            depth_error: error + 4.0 * ROUNDOFF * depth.abs(),
        }
    }
}

impl Plane {
    /// Lays the rectangle round what the plane sees of a box.
    pub(super) fn fit(&mut self, bounds: &Bounds) {
        let count = f64::from(self.resolution);
        let (mut from, mut to) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        if bounds.is_empty() {
            (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
            return;
        }
        let corners = bounds.corners().map(|corner| self.project(corner));
        if corners.iter().all(|corner| corner.z < 0.0) {
            (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
            return;
        }
        let is_in_front = corners.iter().all(|corner| corner.z > 0.0);
        for axis in 0..2 {
            for corner in &corners {
                let at = corner[axis] / corner.z;
                from[axis] = from[axis].min(at);
                to[axis] = to[axis].max(at);
            }
            if let Eye::Point(_) = self.eye {
                if !is_in_front {
                    (from[axis], to[axis]) = (-1.0, 1.0);
                }
                // Round the cube the next face goes on.
                from[axis] = from[axis].max(-1.0);
                to[axis] = to[axis].min(1.0);
            }
            from[axis] -= 2.0 * self.margin;
            to[axis] += 2.0 * self.margin;
            self.from[axis] = from[axis];
            self.cell[axis] = (to[axis] - from[axis]) / count;
            if from[axis] >= to[axis] {
                // The box is seen by other faces only.
                (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
                return;
            }
        }
    }

    /// Returns whether there are cells.
    pub(super) fn has_cells(&self) -> bool {
        self.cell[0] > 0.0 && self.cell[1] > 0.0
    }

    /// Returns how many cells there are.
    pub(super) fn cell_count(&self) -> usize {
        if self.has_cells() {
            (self.resolution * self.resolution) as usize
        } else {
            0
        }
    }

    /// Returns where a point is seen, homogeneous.
    pub(super) fn project(&self, point: DVec3) -> DVec3 {
        let [p, q, depth] = self.axes;
        match self.eye {
            Eye::Point(position) => {
                let seen = point - position;
                DVec3::new(seen[p], seen[q], self.sign * seen[depth])
            }
            Eye::Direction(middle, slopes) => {
                let seen = point - middle;
                let along = seen[depth];
                DVec3::new(
                    seen[p] - along * slopes[0],
                    seen[q] - along * slopes[1],
                    1.0,
                )
            }
        }
    }

    /// Returns how far from the light a point is, along the axis of depth.
    pub(super) fn depth(&self, point: DVec3) -> f64 {
        let axis = self.axes[2];
        match self.eye {
            Eye::Point(position) => self.sign * (point[axis] - position[axis]),
            Eye::Direction(middle, _) => self.sign * (point[axis] - middle[axis]),
        }
    }

    /// Returns the inflated square of `side` cells at a cell.
    pub(super) fn region(&self, at: [u32; 2], side: u32) -> Region {
        let edge = |axis: usize, n: u32| self.from[axis] + self.cell[axis] * f64::from(n);
        let [x, y] = at;
        Region {
            from: [edge(0, x) - self.margin, edge(1, y) - self.margin],
            to: [
                edge(0, x + side) + self.margin,
                edge(1, y + side) + self.margin,
            ],
        }
    }

    /// Returns the ray through the middle of a cell, away from the light, as origin and direction of depth 1;
    /// a direction's begins at depth `begin`.
    pub(super) fn ray(&self, cell: usize, begin: f64) -> (DVec3, DVec3) {
        let at = [
            cell % self.resolution as usize,
            cell / self.resolution as usize,
        ];
        let place = [0, 1].map(|axis| self.from[axis] + self.cell[axis] * (at[axis] as f64 + 0.5));
        let [p, q, depth] = self.axes;
        let (mut origin, mut direction) = (DVec3::ZERO, DVec3::ZERO);
        direction[depth] = self.sign;
        match self.eye {
            Eye::Point(position) => {
                origin = position;
                direction[p] = place[0];
                direction[q] = place[1];
            }
            Eye::Direction(middle, slopes) => {
                let along = self.sign * begin;
                origin[p] = place[0] + along * slopes[0];
                origin[q] = place[1] + along * slopes[1];
                origin[depth] = along;
                origin += middle;
                direction[p] = self.sign * slopes[0];
                direction[q] = self.sign * slopes[1];
            }
        }
        (origin, direction)
    }

    /// Returns the width of a cell at a depth.
    pub(super) fn width_at(&self, depth: f64) -> f64 {
        let width = self.cell[0].max(self.cell[1]);
        match self.eye {
            Eye::Point(_) => width * depth,
            Eye::Direction(..) => width,
        }
    }

    /// Calls `found` for every cell whose region a surface may meet, with the region.
    pub(super) fn cells_of(&self, surface: &Projected, found: &mut impl FnMut(usize, &Region)) {
        if self.has_cells() {
            self.descend(surface, [0; 2], self.resolution, found);
        }
    }

    fn descend(
        &self,
        surface: &Projected,
        at: [u32; 2],
        side: u32,
        found: &mut impl FnMut(usize, &Region),
    ) {
        let region = self.region(at, side);
        if !surface.may_meet(&region) {
            return;
        }
        if side == 1 {
            found((at[1] * self.resolution + at[0]) as usize, &region);
            return;
        }
        let half = side / 2;
        for (x, y) in [(0, 0), (half, 0), (0, half), (half, half)] {
            self.descend(surface, [at[0] + x, at[1] + y], half, found);
        }
    }
}
