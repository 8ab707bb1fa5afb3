//! How far a point is from a surface: what finds the surface that a point is meant to lie on.
//!
//! In: a point, a surface. Out: a distance, and a start, in `f64`, rounded. They say what is asked and decide
//! no answer.

use glam::DVec3;

use super::{CurvedShape, NO_AXIS, Occluders, Surface, SurfaceId};
use crate::flat::{self, length, to_unit, way_to_triangle};
use crate::intersect::DiskPlane;
use crate::{Cone, ReceiverPoint};

/// The shortest way from a point to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// How long it is, world units.
    pub distance: f64,
    /// Its direction, a unit vector up to rounding; zero where the point is on the surface.
    pub(super) direction: DVec3,
}

impl Gap {
    /// Of a point that nothing is known of: it is not on the surface.
    const UNKNOWN: Self = Self {
        distance: f64::INFINITY,
        direction: DVec3::ZERO,
    };

    fn along(way: DVec3) -> Self {
        Self {
            distance: length(way),
            direction: unit(way).unwrap_or(DVec3::ZERO),
        }
    }
}

impl Occluders {
    /// Returns how far a point of world space is from the nearest point of a surface, in the order of operations
    /// that EXACTNESS.md gives ("Distances"). It is rounded: with an error of some 2^-50 of the surface's size and
    /// the distance, more beside needle-thin triangles. A sphere and a tube are their walls, without what they
    /// enclose. `None` for degenerate surfaces, which hold no start.
    pub fn distance(&self, surface: SurfaceId, point_in_world: DVec3) -> Option<f64> {
        self.gap(surface, point_in_world).map(|gap| gap.distance)
    }

    /// Returns the shortest way from a point to a surface, as [`Occluders::distance`] does its length.
    pub fn gap(&self, surface: SurfaceId, point_in_world: DVec3) -> Option<Gap> {
        match self.surface(surface) {
            Surface::Triangle(triangle) => (triangle.axis != NO_AXIS)
                .then(|| Gap::along(way_to_triangle(self.positions_of(triangle), point_in_world))),
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Sphere(sphere) => (sphere.radius > 0.0).then(|| {
                    let from_center = point_in_world - sphere.center;
                    Gap {
                        distance: (length(from_center) - sphere.radius).abs(),
                        direction: unit(from_center).unwrap_or(DVec3::X),
                    }
                }),
                CurvedShape::Tube(cone) => {
                    is_solid(cone).then(|| to_tube(cone, point_in_world - cone.base))
                }
                CurvedShape::Cap(disk, cone) => {
                    is_solid(cone).then(|| to_disk(disk, point_in_world - disk.center))
                }
                CurvedShape::Disk(disk, axis) => (*axis != NO_AXIS && disk.radius > 0.0)
                    .then(|| to_disk(disk, point_in_world - disk.center)),
                CurvedShape::Part(part) => Some(Gap::along(part.way_from(point_in_world))),
                CurvedShape::Level(level) => Some(
                    level
                        .way_from(point_in_world)
                        .map_or(Gap::UNKNOWN, Gap::along),
                ),
            },
        }
    }

    /// Returns the start on a surface that a point near it means. The rule of starts moves a point over a
    /// triangle or a disk onto it exactly, so such a point stays. Others are moved to the nearest point of
    /// the surface, rounded.
    pub fn start_on(&self, surface: SurfaceId, point_in_world: DVec3) -> ReceiverPoint {
        let point = match self.surface(surface) {
            Surface::Triangle(triangle) if triangle.axis != NO_AXIS => {
                let corners = self.positions_of(triangle);
                if flat::is_over(point_in_world, corners, usize::from(triangle.axis)) {
                    point_in_world
                } else {
                    point_in_world + way_to_triangle(corners, point_in_world)
                }
            }
            Surface::Triangle(_) => point_in_world,
            Surface::Curved(curved) => match &curved.shape {
                CurvedShape::Sphere(sphere) => {
                    let radial = unit(point_in_world - sphere.center).unwrap_or(DVec3::X);
                    sphere.center + radial * sphere.radius
                }
                CurvedShape::Tube(cone) if is_solid(cone) => {
                    let profile = Profile::of(cone, point_in_world - cone.base);
                    let [z, radius] = profile.nearest;
                    cone.base + (profile.axis * z + profile.out * radius)
                }
                CurvedShape::Part(part) => point_in_world + part.way_from(point_in_world),
                // Where nothing is known of the way, no point is taken to be on it.
                CurvedShape::Level(level) => level
                    .way_from(point_in_world)
                    .map_or(point_in_world, |way| point_in_world + way),
                CurvedShape::Tube(_) | CurvedShape::Cap(..) | CurvedShape::Disk(..) => {
                    point_in_world
                }
            },
        };
        ReceiverPoint {
            point,
            surface: Some(surface),
        }
    }
}

fn is_solid(cone: &Cone) -> bool {
    cone.base != cone.apex && (cone.base_radius > 0.0 || cone.apex_radius > 0.0)
}

/// `None` for zero.
fn unit(v: DVec3) -> Option<DVec3> {
    (v * to_unit(v.abs().max_element())).try_normalize()
}

fn to_disk(disk: &DiskPlane, from_center: DVec3) -> Gap {
    let axis = unit(disk.normal()).unwrap_or(DVec3::ZERO);
    let height = from_center.dot(axis);
    let across = from_center - axis * height;
    let beyond_rim = (length(across) - disk.radius).max(0.0);
    Gap {
        distance: length(DVec3::new(height, beyond_rim, 0.0)),
        direction: unit(axis * height + unit(across).unwrap_or(DVec3::ZERO) * beyond_rim)
            .unwrap_or(DVec3::ZERO),
    }
}

fn to_tube(cone: &Cone, from_base: DVec3) -> Gap {
    let profile = Profile::of(cone, from_base);
    let [along, away] = [0, 1].map(|i: usize| profile.nearest[i] - profile.point[i]);
    Gap {
        distance: length(DVec3::new(along, away, 0.0)),
        direction: unit(profile.axis * along + profile.out * away).unwrap_or(DVec3::ZERO),
    }
}

/// A tube in the half plane that its axis and a point span, where its wall is a line from `(0, base_radius)` to
/// `(length, apex_radius)`. Points are given by how far they are along the axis and off it.
struct Profile {
    axis: DVec3,
    out: DVec3,
    point: [f64; 2],
    /// The point of the wall.
    nearest: [f64; 2],
}

impl Profile {
    fn of(cone: &Cone, from_base: DVec3) -> Self {
        let along = cone.apex - cone.base;
        let axis = unit(along).unwrap_or(DVec3::ZERO);
        let z = from_base.dot(axis);
        let across = from_base - axis * z;
        let out = unit(across).unwrap_or_else(|| axis.any_orthonormal_vector());
        let off = length(across);
        let wall_base = DVec3::new(0.0, cone.base_radius, 0.0);
        let wall = DVec3::new(length(along), cone.apex_radius, 0.0) - wall_base;
        let direction = unit(wall).unwrap_or(DVec3::ZERO);
        let reach = (DVec3::new(z, off, 0.0) - wall_base).dot(direction);
        let nearest = wall_base + direction * reach.clamp(0.0, length(wall));
        Self {
            axis,
            out,
            point: [z, off],
            nearest: [nearest.x, nearest.y],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Disk, Opacity, Sphere};

    const V: fn(f64, f64, f64) -> DVec3 = DVec3::new;

    /// A triangle, a sphere, a tube, its base cap, its apex cap, a disk; all `size` times as large.
    fn shapes(size: f64) -> Occluders {
        let mut builder = Occluders::builder();
        let corners = [V(0.0, 0.0, 0.0), V(4.0, 0.0, 0.0), V(0.0, 4.0, 0.0)];
        builder
            .add_face(&corners.map(|x| x * size), Opacity::Transparent)
            .expect("a face");
        let sphere = Sphere {
            center: V(0.0, 0.0, 10.0) * size,
            radius: 2.0 * size,
        };
        builder
            .add_sphere(sphere, Opacity::Opaque)
            .expect("a sphere");
        let cone = Cone {
            base: V(20.0, 0.0, 0.0) * size,
            base_radius: 4.0 * size,
            apex: V(20.0, 0.0, 3.0) * size,
            apex_radius: 0.0,
            is_closed: true,
        };
        builder.add_cone(cone, Opacity::Opaque).expect("a cone");
        let disk = Disk {
            center: V(40.0, 0.0, 0.0) * size,
            normal: V(0.0, 0.0, 3.0),
            radius: 2.0 * size,
        };
        builder.add_disk(disk, Opacity::Opaque).expect("a disk");
        builder.build()
    }

    #[test]
    fn distances_are_those_of_geometry() {
        let cases = [
            // Over the triangle, beside an edge, beside the slanted one, beyond each corner.
            (0, V(1.0, 1.0, -2.0), 2.0),
            (0, V(1.0, -3.0, 4.0), 5.0),
            (0, V(5.0, 5.0, 0.0), 18.0_f64.sqrt()),
            (0, V(-3.0, -4.0, 0.0), 5.0),
            (0, V(7.0, -4.0, 0.0), 5.0),
            (0, V(-3.0, 8.0, 0.0), 5.0),
            (0, V(2.0, 2.0, 0.0), 0.0),
            // Inside and outside of the sphere, and its centre.
            (1, V(0.0, 0.5, 10.0), 1.5),
            (1, V(0.0, 5.0, 10.0), 3.0),
            (1, V(0.0, 0.0, 10.0), 2.0),
            // The wall of the cone falls 3 in 4: on its axis at the base, above its tip, beyond its rim.
            (2, V(20.0, 0.0, 0.0), 2.4),
            (2, V(20.0, 0.0, 4.0), 1.0),
            (2, V(24.0, 0.0, -1.0), 1.0),
            (3, V(21.0, 0.0, -1.0), 1.0),
            (3, V(27.0, 0.0, 4.0), 5.0),
            (4, V(40.0, 1.0, 2.0), 2.0),
            (4, V(45.0, 0.0, 4.0), 5.0),
        ];
        // At the smallest and the largest sizes squares vanish and overflow.
        for size in [1.0, 2.0_f64.powi(-600), 2.0_f64.powi(90)] {
            let occluders = shapes(size);
            for (surface, point, expected) in cases {
                let found = occluders.distance(SurfaceId(surface), point * size);
                let found = found.expect("no degenerate surface") / size;
                assert!(
                    (found - expected).abs() < 1e-13,
                    "{surface}, {point}: {found}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn starts_are_on_their_surfaces() {
        let occluders = shapes(1.0);
        let cases = [
            // Over the triangle and the disk the rule of starts moves it.
            (0, V(1.0, 1.0, -2.0), V(1.0, 1.0, -2.0)),
            (0, V(0.0, 3.0, 1.0), V(0.0, 3.0, 1.0)),
            (4, V(41.0, 1.0, 0.5), V(41.0, 1.0, 0.5)),
            (0, V(1.0, -3.0, 4.0), V(1.0, 0.0, 0.0)),
            (0, V(5.0, 5.0, 1.0), V(2.0, 2.0, 0.0)),
            (1, V(0.0, 0.5, 10.0), V(0.0, 2.0, 10.0)),
            (1, V(0.0, 0.0, 10.0), V(2.0, 0.0, 10.0)),
            (2, V(20.0, 0.0, 4.0), V(20.0, 0.0, 3.0)),
            (2, V(25.0, 0.0, 5.5), V(22.0, 0.0, 1.5)),
            (2, V(26.0, 0.0, -9.0), V(24.0, 0.0, 0.0)),
        ];
        for (surface, point, expected) in cases {
            let start = occluders.start_on(SurfaceId(surface), point);
            let off = (start.point - expected).length();
            assert!(
                off < 1e-14,
                "{surface}, {point}: {}, not {expected}",
                start.point
            );
            assert_eq!(start.surface, Some(SurfaceId(surface)));
        }
    }

    #[test]
    fn degenerate_surfaces_hold_no_start() {
        let mut builder = Occluders::builder();
        let corners = [V(0.0, 0.0, 0.0), V(1.0, 0.0, 0.0), V(2.0, 0.0, 0.0)];
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
        let sphere = Sphere {
            center: V(0.0, 0.0, 0.0),
            radius: 0.0,
        };
        builder
            .add_sphere(sphere, Opacity::Opaque)
            .expect("a sphere");
        let occluders = builder.build();
        for surface in occluders.surfaces() {
            assert_eq!(occluders.distance(surface, V(0.0, 0.0, 0.0)), None);
        }
    }
}
