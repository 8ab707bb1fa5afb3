//! The families that hold spheres, tubes and closed cones.

use super::Nasty;
use crate::oracle::OracleSurface;

impl Nasty {
    pub(super) fn touching_spheres(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.6) {
            self.tiles()
        } else {
            Vec::new()
        };
        let mut spheres: Vec<([f64; 3], f64)> = vec![([0.0, 0.0, 1.0], 1.0)];
        for _ in 0..3 + self.below(8) {
            let (center, radius) = self.pick(&spheres);
            spheres.push(match self.below(6) {
                // on top of, or beside, another one, exactly touching
                0 | 1 => {
                    let other = self.pick(&[1.0, 0.5, 2.0]);
                    let mut at = center;
                    at[self.below(3)] +=
                        if self.chance(0.8) { 1.0 } else { -1.0 } * (radius + other);
                    (at, other)
                }
                // the same again
                2 => (center, radius),
                // inside, touching from within
                3 => (
                    [center[0] + radius / 2.0, center[1], center[2]],
                    radius / 2.0,
                ),
                // standing on the floor
                4 => {
                    let other = self.real(0.3, 2.0);
                    ([self.real(-5.0, 5.0), self.real(-5.0, 5.0), other], other)
                }
                // anywhere, sunk into the floor perhaps
                _ => (self.any_point(-4.0, 4.0), self.real(0.3, 1.5)),
            });
        }
        surfaces.extend(
            spheres
                .into_iter()
                .map(|(c, r)| OracleSurface::sphere(c, r)),
        );
        surfaces
    }

    pub(super) fn jointed_cones(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.5) {
            self.tiles()
        } else {
            Vec::new()
        };
        let on_lattice = self.chance(0.5);
        let joint = |rng: &mut Self| {
            if on_lattice {
                rng.lattice_point(-3, 4)
            } else {
                rng.any_point(-3.0, 4.0)
            }
        };
        for _ in 0..1 + self.below(3) {
            let mut from = joint(self);
            let mut radius = self.pick(&[0.25, 0.5, 1.0]);
            surfaces.push(OracleSurface::sphere(from, radius));
            for _ in 0..1 + self.below(4) {
                let to = joint(self);
                let next = self.pick(&[0.25, 0.5, 0.7, 1.0, 0.0]);
                if radius != 0.0 || next != 0.0 {
                    surfaces.push(OracleSurface::open_tube(from, radius, to, next));
                }
                if next > 0.0 && self.chance(0.8) {
                    surfaces.push(OracleSurface::sphere(to, next));
                }
                (from, radius) = (to, next);
            }
        }
        surfaces
    }

    pub(super) fn closed_cylinders(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = self.tiles();
        let mut cones: Vec<([f64; 3], f64, [f64; 3], f64)> = Vec::new();
        for _ in 0..2 + self.below(6) {
            let on_lattice = self.chance(0.7);
            let radius = if on_lattice {
                self.pick(&[0.5, 1.0, 2.0])
            } else {
                self.real(0.2, 2.0)
            };
            let end = if self.chance(0.6) {
                radius
            } else {
                self.pick(&[0.0, 0.5, 1.5])
            };
            let mut base = self.lattice_point(-4, 4);
            base[2] = 0.0;
            let mut apex = [base[0], base[1], self.integer(1, 4)];
            if !on_lattice {
                base[0] += self.real(-0.5, 0.5);
                if self.chance(0.5) {
                    apex = self.any_point(0.5, 3.0);
                }
            }
            // Some are doubled, and some stand on others.
            match (self.below(5), cones.last()) {
                (0, Some(&twin)) => cones.push(twin),
                (1, Some(&(_, _, below, r))) if r > 0.0 => {
                    cones.push((below, r, [below[0], below[1], below[2] + 1.0], end));
                }
                _ => cones.push((base, radius, apex, end)),
            }
        }
        for (solid, (base, base_radius, apex, apex_radius)) in cones.into_iter().enumerate() {
            surfaces.extend(OracleSurface::closed_cone(
                solid,
                base,
                base_radius,
                apex,
                apex_radius,
            ));
        }
        surfaces
    }

    pub(super) fn open_tubes(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.5) {
            self.tiles()
        } else {
            Vec::new()
        };
        for _ in 0..2 + self.below(4) {
            let mut base = if self.chance(0.6) {
                self.lattice_point(-3, 3)
            } else {
                self.any_point(-3.0, 3.0)
            };
            let axis = match self.below(4) {
                0 => [0.0, 0.0, 3.0],
                1 => [0.0, -2.0, 0.0],
                2 => self.lattice_point(1, 3),
                _ => self.any_point(-3.0, 3.0),
            };
            if self.chance(0.3) {
                base[2] = 0.0;
            }
            let apex = [0, 1, 2].map(|i| base[i] + axis[i]);
            let radius = self.pick(&[1.0, 2.0, 0.7]);
            let end = self.pick(&[radius, radius, 0.0, 0.5]);
            surfaces.push(OracleSurface::open_tube(base, radius, apex, end));
            match self.below(4) {
                0 => surfaces.push(OracleSurface::open_tube(base, radius, apex, end)),
                1 => surfaces.push(OracleSurface::open_tube(
                    base,
                    radius / 2.0,
                    apex,
                    end / 2.0,
                )),
                2 if end > 0.0 => {
                    // a continuation that shares the rim
                    let further = [0, 1, 2].map(|i| apex[i] + axis[i]);
                    surfaces.push(OracleSurface::open_tube(apex, end, further, end));
                }
                _ => {}
            }
        }
        surfaces
    }
}
