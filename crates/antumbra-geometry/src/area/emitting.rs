//! Places of lights with size, without a receiver: what shines along a whole line of receivers.
//!
//! In: a shape, two numbers in `[0, 1)`. Out: [`EmittingPoint`]s. Invariants: places are uniform by area, length or solid
//! angle, over the whole light. Absent here: how much light that is.

use glam::DVec3;

use super::shape::AreaShape;
use super::warp;
use crate::light::LightShape;

/// Directions that a place of a light shines in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// All directions alike.
    Even,
    /// By the cosine to a unit normal: into the half in front, or into both.
    Cosine {
        /// The normal.
        normal: DVec3,
        /// Whether the back shines, too.
        is_two_sided: bool,
    },
    /// By the sine to a unit axis, as a line does.
    Sine {
        /// The axis.
        axis: DVec3,
    },
}

/// A place of a light with size that stands for its share of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmittingPoint {
    /// Point, or direction towards the light.
    pub target: LightShape,
    /// Directions that it shines in.
    pub emission: Emission,
    /// Mean of the emission over all places of the light, seen from far away where it shines most: 1, but 1/4 for balls, of
    /// which one half hides the other.
    pub mean: f64,
}

impl AreaShape {
    /// Returns what shines at `u` and `v`, both in `[0, 1)`: one place. Of triangles of the scene that shine to both sides
    /// each side has one, since such a triangle hides what is a rounding behind it.
    pub fn emitting_points(&self, [u, v]: [f64; 2]) -> [Option<EmittingPoint>; 2] {
        let even = |target| EmittingPoint {
            target,
            emission: Emission::Even,
            mean: 1.0,
        };
        let flat = |point, normal, is_two_sided| EmittingPoint {
            target: LightShape::Point(point),
            emission: Emission::Cosine {
                normal,
                is_two_sided,
            },
            mean: 1.0,
        };
        let one = match self {
            Self::Segment(light) => EmittingPoint {
                emission: Emission::Sine {
                    axis: light.direction(),
                },
                ..even(LightShape::Point(light.point_at(u)))
            },
            Self::Rectangle(light) => {
                flat(light.point_at(u, v), light.normal(), light.is_two_sided())
            }
            Self::Triangle(light) => {
                let point = super::triangle::point_of(&light.corners(), u, v);
                flat(point, light.normal(), light.is_two_sided())
            }
            Self::Polygon(light) => {
                flat(light.point_at(u, v), light.normal(), light.is_two_sided())
            }
            Self::Disk(light) => flat(light.point_at(u, v), light.normal(), light.is_two_sided()),
            Self::Sphere(light) => {
                let normal = warp::cap(u, v, 2.0);
                let point = light.center() + normal * light.radius();
                EmittingPoint {
                    mean: 0.25,
                    ..flat(point, normal, false)
                }
            }
            Self::SunDisc(light) => even(light.sample(u, v).target),
            Self::Sky(light) => even(light.sample(u, v).target),
            Self::Mesh(light) => {
                let side = |side| {
                    let (point, normal) = light.point_at(u, v, side)?;
                    Some(flat(point, normal, false))
                };
                let back = light.is_two_sided().then(|| side(-1)).flatten();
                return [side(1), back];
            }
        };
        [Some(one), None]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{MeshLight, RectangleLight, SegmentLight, Sky, SphereLight};
    use std::sync::Arc;

    const PLACES: u32 = 128;

    fn places() -> impl Iterator<Item = [f64; 2]> {
        let all = (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| [i, j]));
        all.map(|place| place.map(|n| (f64::from(n) + 0.5) / f64::from(PLACES)))
    }

    /// Returns the steradians that a light fills, by its places.
    fn solid_angle(shape: &AreaShape, receiver: DVec3) -> f64 {
        let points = places().flat_map(|place| shape.emitting_points(place));
        let of = |point: EmittingPoint| {
            let LightShape::Point(place) = point.target else {
                panic!("a direction");
            };
            let back = receiver - place;
            let towards = back.normalize();
            let emitted = match point.emission {
                Emission::Even => 1.0,
                Emission::Cosine {
                    normal,
                    is_two_sided,
                } => {
                    let cosine = normal.dot(towards);
                    if is_two_sided {
                        cosine.abs()
                    } else {
                        cosine.max(0.0)
                    }
                }
                Emission::Sine { axis } => axis.cross(towards).length(),
            };
            emitted / back.length_squared()
        };
        points.flatten().map(of).sum::<f64>() * shape.size() / f64::from(PLACES * PLACES)
    }

    /// Returns the same by the samples of the receiver.
    fn solid_angle_by_samples(shape: &AreaShape, receiver: DVec3) -> f64 {
        let samples = places().filter_map(|place| shape.sample(receiver, place));
        samples.map(|sample| sample.solid_angle).sum::<f64>() / f64::from(PLACES * PLACES)
    }

    #[test]
    fn places_fill_the_solid_angle_that_samples_fill() {
        let receiver = DVec3::new(0.4, -0.3, 5.0);
        let edges = [DVec3::X * 2.0, DVec3::Y];
        let sheet = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for shape in [
            AreaShape::Rectangle(RectangleLight::new(DVec3::ZERO, edges, false).unwrap()),
            AreaShape::Sphere(SphereLight::new(DVec3::ZERO, 0.7).unwrap()),
            AreaShape::Segment(SegmentLight::new([DVec3::ZERO, DVec3::ONE]).unwrap()),
            AreaShape::Mesh(Arc::new(MeshLight::new(vec![sheet], true).unwrap())),
        ] {
            for receiver in [receiver, -receiver] {
                let expected = solid_angle_by_samples(&shape, receiver);
                let found = solid_angle(&shape, receiver);
                assert!(
                    (found - expected).abs() <= 0.01 * expected,
                    "{shape:?}: {found}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn the_sky_shines_from_above() {
        let sky = AreaShape::Sky(Sky::new(DVec3::Y).unwrap());
        for place in places() {
            let [Some(point), None] = sky.emitting_points(place) else {
                panic!("one place");
            };
            assert!(point.target.towards(DVec3::ZERO).y >= 0.0);
        }
    }
}
