//! The own rules of EXACTNESS.md for starts that are asked about many lights: no segment is made where plain `f64` tells.

use super::{CurvedShape, Occluders, Surface, SurfaceId};
use crate::intersect::{own_sphere_filter, own_sphere_surely_shows};
use crate::{LightShape, ReceiverPoint, Sphere};

/// The own rule of a start's surface, which may hide lights.
#[derive(Clone, Copy, Debug)]
pub struct OwnRule<'a> {
    occluders: &'a Occluders,
    start: &'a ReceiverPoint,
    /// The sphere that the start is on, if it has a size.
    sphere: Option<Sphere>,
}

impl Occluders {
    /// Returns whether a surface has an own rule (EXACTNESS.md, "Which surfaces block"): curved ones.
    #[inline(always)]
    pub fn has_own_rule(&self, surface: SurfaceId) -> bool {
        matches!(self.surface(surface), Surface::Curved(_))
    }

    /// Returns the own rule of a start's surface, if it has one.
    #[inline]
    pub fn own_rule<'a>(&'a self, start: &'a ReceiverPoint) -> Option<OwnRule<'a>> {
        let Surface::Curved(curved) = self.surface(start.surface?) else {
            return None;
        };
        let sphere = match curved.shape {
            CurvedShape::Sphere(sphere) if sphere.radius > 0.0 => Some(sphere),
            _ => None,
        };
        self.solids[curved.solid as usize]
            .is_opaque
            .then_some(OwnRule {
                occluders: self,
                start,
                sphere,
            })
    }
}

impl OwnRule<'_> {
    /// Returns whether it hides a light: as [`Occluders::own_rule_blocks`] says of the segment.
    #[inline]
    pub fn hides(&self, light: &LightShape) -> bool {
        let told = self
            .sphere
            .and_then(|sphere| own_sphere_filter(&sphere, self.start.point, light.homogeneous()));
        told.unwrap_or_else(|| self.hides_exactly(light))
    }

    /// Returns whether it surely hides nothing between some lights, nor what lies so far off; `false` says nothing.
    #[inline]
    pub fn surely_hides_none(&self, lights: &[LightShape], slack: f64) -> bool {
        self.sphere.is_some_and(|sphere| {
            lights
                .iter()
                .all(|light| own_sphere_surely_shows(&sphere, self.start.point, light, slack))
        })
    }

    #[inline(never)]
    fn hides_exactly(&self, light: &LightShape) -> bool {
        let segment = self.occluders.segment(self.start, light);
        self.occluders.own_rule_blocks(&segment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cone, DVec3, Opacity};

    /// Lights in the tangent plane, at the start, in the ball, on it, far off and nowhere.
    #[test]
    fn lights_are_hidden_as_their_segments_are() {
        let (mut told, mut shown) = ([0, 0], 0);
        for (center, radius) in [
            (DVec3::ZERO, 1.0),
            (DVec3::new(0.3, -1e3, 7e5), 0.1),
            (DVec3::splat(1e-170), 1e-170),
            (DVec3::new(1e30, 0.0, -1e30), 3e29),
        ] {
            let mut builder = Occluders::builder();
            let ball = Sphere { center, radius };
            let ball = builder.add_sphere(ball, Opacity::Opaque).unwrap();
            let cone = Cone {
                base: center,
                base_radius: radius,
                apex: center + DVec3::new(0.0, 0.0, radius),
                apex_radius: 0.5 * radius,
                is_closed: true,
            };
            builder.add_cone(cone, Opacity::Opaque).unwrap();
            let occluders = builder.build();
            assert_eq!(ball.0, 0);
            let ways = [
                DVec3::X,
                DVec3::new(0.6, 0.8, 0.0),
                DVec3::new(0.36, 0.48, 0.8),
                DVec3::new(-1.0, 2.0, 2.0) / 3.0,
            ];
            for surface in occluders.surfaces() {
                for out in ways {
                    let point = center + radius * out;
                    let start = ReceiverPoint {
                        point,
                        surface: Some(surface),
                    };
                    let rule = occluders.own_rule(&start).expect("a curved surface");
                    let mut lights = vec![
                        LightShape::Point(point),
                        LightShape::Point(center),
                        LightShape::Point(center - radius * out),
                        LightShape::Direction(DVec3::ZERO),
                    ];
                    for way in ways {
                        for along in [-1.0, 1.0, 1e-9, 1e9] {
                            for across in [-1e-16, 0.0, 1e-16, 0.1] {
                                let flat = way - way.dot(out) * out;
                                let to = along * (flat + across * out);
                                lights.push(LightShape::Direction(to));
                                lights.push(LightShape::Direction(radius * to));
                                lights.push(LightShape::Point(point + radius * to));
                            }
                        }
                    }
                    for light in lights {
                        let is_hidden =
                            occluders.own_rule_blocks(&occluders.segment(&start, &light));
                        assert_eq!(rule.hides(&light), is_hidden, "{start:?} {light:?}");
                        told[usize::from(is_hidden)] += 1;
                        let is_shown = rule.surely_hides_none(&[light], 0.0);
                        assert!(!is_shown || !is_hidden, "{start:?} {light:?}");
                        let is_far = rule.surely_hides_none(&[light], f64::MAX);
                        assert!(!is_far, "{start:?} {light:?}");
                        shown += u32::from(is_shown);
                    }
                }
            }
        }
        assert!(told.iter().all(|&count| count > 500), "{told:?}");
        assert!(shown > 500, "{shown}");
    }
}
