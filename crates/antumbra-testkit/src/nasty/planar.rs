//! The families that are made of triangles and disks.

use super::Nasty;
use crate::build::{cuboid, cuboid_of, floor, lerp, quad};
use crate::oracle::{OracleShape, OracleSurface};

impl Nasty {
    /// A floor of tiles from -6 to 6 at height 0.
    pub(super) fn tiles(&mut self) -> Vec<OracleSurface> {
        let step = self.pick(&[3, 4, 6, 12]);
        let mut tiles = Vec::new();
        for x in (-6..6).step_by(step) {
            for y in (-6..6).step_by(step) {
                let (low, high) = (
                    [x, y].map(f64::from),
                    [x, y].map(|c| f64::from(c + step as i32)),
                );
                tiles.extend(floor(low, high, 0.0));
            }
        }
        tiles
    }

    pub(super) fn lattice_soup(&mut self) -> Vec<OracleSurface> {
        let count = 6 + self.below(24);
        let mut soup: Vec<[[f64; 3]; 3]> = Vec::new();
        for _ in 0..count {
            // Most share an edge or a corner with one that is there.
            let mut corners = [0; 3].map(|_| self.lattice_point(-2, 2));
            if !soup.is_empty() {
                let other = soup[self.below(soup.len())];
                let shared = self.below(3);
                for corner in corners.iter_mut().take(shared) {
                    *corner = other[self.below(3)];
                }
            }
            soup.push(corners);
        }
        soup.into_iter().map(OracleSurface::triangle).collect()
    }

    pub(super) fn boxes_on_floor(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = self.tiles();
        for _ in 0..2 + self.below(5) {
            let on_lattice = self.chance(0.6);
            let mut corner = || {
                if on_lattice {
                    self.integer(-4, 3)
                } else {
                    self.real(-4.0, 3.0)
                }
            };
            let (x, y) = (corner(), corner());
            let z = if self.chance(0.7) {
                0.0
            } else {
                self.integer(1, 3)
            };
            let [dx, dy, dz] = [0; 3].map(|_| {
                if on_lattice {
                    self.integer(1, 3)
                } else {
                    self.real(0.2, 3.0)
                }
            });
            surfaces.extend(cuboid([x, y, z], [x + dx, y + dy, z + dz]));
        }
        surfaces
    }

    pub(super) fn turned_boxes(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        // One rotation for all: a floor and boxes on it, none of their planes exact.
        let axes = self.rotation();
        let turn = |p: [f64; 3]| {
            [0, 1, 2].map(|i| p[0] * axes[0][i] + p[1] * axes[1][i] + p[2] * axes[2][i])
        };
        surfaces.extend(quad(
            [
                [-6.0, -6.0, 0.0],
                [6.0, -6.0, 0.0],
                [6.0, 6.0, 0.0],
                [-6.0, 6.0, 0.0],
            ]
            .map(turn),
        ));
        for _ in 0..1 + self.below(4) {
            let [x, y] = [0; 2].map(|_| self.real(-4.0, 3.0));
            let [dx, dy, dz] = [0; 3].map(|_| self.real(0.3, 3.0));
            surfaces.extend(cuboid_of(|i, j, k| {
                turn([
                    if i { x + dx } else { x },
                    if j { y + dy } else { y },
                    if k { dz } else { 0.0 },
                ])
            }));
        }
        surfaces
    }

    /// Three nearly orthogonal unit vectors.
    fn rotation(&mut self) -> [[f64; 3]; 3] {
        loop {
            let [w, x, y, z] = [0; 4].map(|_| self.real(-1.0, 1.0));
            let length = (w * w + x * x + y * y + z * z).sqrt();
            if length < 0.1 {
                continue;
            }
            let [w, x, y, z] = [w, x, y, z].map(|c| c / length);
            return [
                [
                    1.0 - 2.0 * (y * y + z * z),
                    2.0 * (x * y + w * z),
                    2.0 * (x * z - w * y),
                ],
                [
                    2.0 * (x * y - w * z),
                    1.0 - 2.0 * (x * x + z * z),
                    2.0 * (y * z + w * x),
                ],
                [
                    2.0 * (x * z + w * y),
                    2.0 * (y * z - w * x),
                    1.0 - 2.0 * (x * x + y * y),
                ],
            ];
        }
    }

    pub(super) fn fan(&mut self) -> Vec<OracleSurface> {
        let on_lattice = self.chance(0.5);
        let hub = if on_lattice {
            [0.0; 3]
        } else {
            self.any_point(-0.3, 0.3)
        };
        let count = 4 + self.below(8);
        let steep = self.pick(&[0.0, 0.5, 2.0, 4.0]);
        let rim: Vec<[f64; 3]> = (0..count)
            .map(|i| {
                let angle = i as f64 / count as f64 * 6.3;
                let [x, y] = [4.0 * cos(angle), 4.0 * cos(angle - 1.57)];
                let z = self.real(-1.0, 1.0) * steep;
                if on_lattice {
                    [x.round(), y.round(), z.round()]
                } else {
                    [x, y, z]
                }
            })
            .collect();
        let mut fan: Vec<_> = (0..count)
            .map(|i| OracleSurface::triangle([hub, rim[i], rim[(i + 1) % count]]))
            .collect();
        // Sometimes a second fan through the same hub, which pierces the first, and a lid.
        for _ in 0..1 + self.below(4) {
            let [a, b] = [0; 2].map(|_| self.lattice_point(-3, 3));
            let corner = if self.chance(0.7) {
                hub
            } else {
                self.lattice_point(-3, 3)
            };
            fan.push(OracleSurface::triangle([corner, a, b]));
        }
        if self.chance(0.5) {
            let [a, b, c] = [0; 3].map(|_| [self.real(-4.0, 4.0), self.real(-4.0, 4.0), 4.5]);
            fan.push(OracleSurface::triangle([a, b, c]));
        }
        fan
    }

    pub(super) fn valley(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for _ in 0..1 + self.below(3) {
            let [a, b] = [0; 2].map(|_| self.any_point(-3.0, 3.0));
            for _ in 0..2 + self.below(2) {
                // Steep, shallow and almost flat wings.
                let [x, y] = [0; 2].map(|_| self.real(-5.0, 5.0));
                let z = self.pick(&[4.0, 1.0, 1e-3, 1e-9, 0.0]);
                let wing = [x, y, lerp(a, b, 0.5)[2] + z];
                surfaces.push(OracleSurface::triangle([a, b, wing]));
                // a neighbour of the wing
                let outer = self.any_point(-4.0, 4.0);
                surfaces.push(OracleSurface::triangle([b, wing, outer]));
            }
        }
        let roof = self.real(3.0, 5.0);
        let [a, b, c] = [0; 3].map(|_| [self.real(-6.0, 6.0), self.real(-6.0, 6.0), roof]);
        surfaces.push(OracleSurface::triangle([a, b, c]));
        surfaces
    }

    pub(super) fn height_field(&mut self) -> Vec<OracleSurface> {
        let size = 3 + self.below(3);
        let on_lattice = self.chance(0.5);
        let spread = self.pick(&[1.0, 2.0, 4.0]);
        let mut point = vec![vec![[0.0; 3]; size + 1]; size + 1];
        for (i, row) in point.iter_mut().enumerate() {
            for (j, corner) in row.iter_mut().enumerate() {
                let height = self.real(0.0, 1.0) * spread;
                let z = if on_lattice { height.round() } else { height };
                let step = 8.0 / size as f64;
                *corner = [i as f64 * step - 4.0, j as f64 * step - 4.0, z];
            }
        }
        let mut surfaces = Vec::new();
        for i in 0..size {
            for j in 0..size {
                let corners = [
                    point[i][j],
                    point[i + 1][j],
                    point[i + 1][j + 1],
                    point[i][j + 1],
                ];
                surfaces.extend(quad(corners));
            }
        }
        // Some towers make shadows long enough to matter.
        for _ in 0..2 {
            let [x, y] = [0; 2].map(|_| self.integer(-3, 2));
            surfaces.extend(cuboid([x, y, 0.0], [x + 1.0, y + 1.0, 6.0]));
        }
        surfaces
    }

    pub(super) fn coplanar_layers(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for layer in 0..2 + self.below(2) {
            let height = layer as f64 * self.pick(&[1.0, 1.0, 0.3]);
            let axis = self.pick(&[2, 2, 2, 1, 0]);
            for _ in 0..2 + self.below(4) {
                let [a, b, c] = [0; 3].map(|_| {
                    let mut corner = if self.chance(0.7) {
                        self.lattice_point(-4, 4)
                    } else {
                        self.any_point(-4.0, 4.0)
                    };
                    corner[axis] = height;
                    corner
                });
                surfaces.push(OracleSurface::triangle([a, b, c]));
                match self.below(4) {
                    0 => surfaces.push(OracleSurface::triangle([c, b, a])),
                    1 => surfaces.push(OracleSurface::triangle([b, c, a])),
                    _ => {}
                }
            }
            if self.chance(0.7) {
                let mut center = self.lattice_point(-3, 3);
                center[axis] = height;
                let mut normal = [0.0; 3];
                normal[axis] = self.pick(&[1.0, -1.0, 0.3]);
                let radius = self.pick(&[1.0, 2.5, 5.0]);
                surfaces.push(OracleSurface::opaque(OracleShape::Disk {
                    center,
                    normal,
                    radius,
                }));
            }
        }
        let normal = self.any_point(-1.0, 1.0);
        let center = self.any_point(-2.0, 2.0);
        surfaces.push(OracleSurface::opaque(OracleShape::Disk {
            center,
            normal,
            radius: 1.5,
        }));
        surfaces
    }

    pub(super) fn needles(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for _ in 0..8 + self.below(16) {
            let [a, b] = [0; 2].map(|_| self.any_point(-5.0, 5.0));
            let along = self.real(0.1, 0.9);
            let width = self.pick(&[1.0, 1.0, 1e-3, 1e-12]);
            let mut c = lerp(a, b, along);
            for x in &mut c {
                *x += self.real(-1.0, 1.0) * width;
            }
            surfaces.push(OracleSurface::triangle([a, b, c]));
        }
        // Broad ones, so that there is something to shade and be shaded.
        for z in [-3.0, 0.0, 1.0, 2.0, 4.0] {
            let [a, b, c] = [0; 3].map(|_| [self.real(-6.0, 6.0), self.real(-6.0, 6.0), z]);
            surfaces.push(OracleSurface::triangle([a, b, c]));
        }
        surfaces
    }
}

/// A cosine good to some digits, the same on every platform: scenes must not depend on `libm`.
fn cos(angle: f64) -> f64 {
    // Fold into half a turn round zero, then a Taylor polynomial.
    let turn = std::f64::consts::TAU;
    let x = angle - turn * (angle / turn).round();
    let y = x * x;
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..12 {
        let k = f64::from(k);
        term *= -y / ((2.0 * k - 1.0) * (2.0 * k));
        sum += term;
    }
    sum
}
