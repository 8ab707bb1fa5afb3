//! The umbra of a sphere.

use super::shaft::SidePlane;
use super::{Relation, SHRINK, Shaft};
use crate::intersect::sphere_blocks;
use crate::number::UNIT_ROUNDOFF;
use crate::{Bounds, LightShape, Sphere};

/// A sphere's umbra: with the light outside it is convex, so eight corners speak for a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereUmbra {
    sphere: Sphere,
    shrunk: Sphere,
    place: LightPlace,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum LightPlace {
    Outside,
    Inside,
    /// Too close to the surface to tell.
    Near,
}

/// Relative width of the shell in which a light counts as near the surface.
const NEAR: f64 = 1e-9;

impl SphereUmbra {
    pub(crate) fn new(sphere: Sphere, light: &LightShape) -> Self {
        let place = match *light {
            LightShape::Direction(_) => LightPlace::Outside,
            LightShape::Point(position) => {
                let distance = position.distance(sphere.center);
                // The coordinates' own rounding counts too, far from the origin.
                let slack = NEAR * sphere.radius
                    + 1e-15 * (position.abs().max_element() + sphere.center.abs().max_element());
                if distance > sphere.radius + slack {
                    LightPlace::Outside
                } else if distance < sphere.radius - slack {
                    LightPlace::Inside
                } else {
                    LightPlace::Near
                }
            }
        };
        let shrunk = Sphere {
            radius: sphere.radius * SHRINK,
            ..sphere
        };
        Self {
            sphere,
            shrunk,
            place,
        }
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        match self.place {
            LightPlace::Near => Relation::Crosses,
            LightPlace::Inside => self.relation_from_inside(&shaft.bounds),
            LightPlace::Outside => {
                if self.is_missed(shaft) {
                    Relation::Misses
                } else if shaft
                    .corner_segments()
                    .all(|s| sphere_blocks(&self.shrunk, &s))
                {
                    Relation::Covers
                } else {
                    Relation::Crosses
                }
            }
        }
    }

    /// With the light inside, all of outside is umbra and all of inside is lit.
    fn relation_from_inside(&self, bounds: &Bounds) -> Relation {
        let Sphere { center, radius } = self.sphere;
        let nearest = center.clamp(bounds.min, bounds.max).distance(center);
        let farthest = (bounds.min - center)
            .abs()
            .max((bounds.max - center).abs())
            .length();
        let slack = NEAR * radius;
        if nearest > radius + slack {
            Relation::Covers
        } else if farthest < radius - slack {
            Relation::Misses
        } else {
            Relation::Crosses
        }
    }

    fn is_missed(&self, shaft: &Shaft) -> bool {
        let Sphere { center, radius } = self.sphere;
        shaft.misses(|plane| plane.is_ball_above(center, radius))
            || self.separating_planes(shaft).iter().any(|&(plane, reach)| {
                // The ball stays below `reach`; the shaft stays above if box and light do.
                plane.range(&shaft.bounds).0 > reach && is_light_above(&plane, &shaft.light, reach)
            })
    }

    /// Planes just off the ball, turned towards the box: straight, and tilted to pass through the
    /// light. Given as a plane through the centre and a height over it that the ball stays below.
    fn separating_planes(&self, shaft: &Shaft) -> [(SidePlane, f64); 2] {
        let Sphere { center, radius } = self.sphere;
        let to_light = shaft.light.towards(center);
        let distance = to_light.length();
        let unit = to_light / distance;
        // Room for the rounding of the tilted normal, which the light's distance magnifies.
        let (margin, sine) = match shaft.light {
            LightShape::Point(_) => {
                let margin = NEAR * radius + 512.0 * UNIT_ROUNDOFF * distance;
                (margin, ((radius + margin) / distance).min(1.0))
            }
            // Tilted a hair towards the light, so that rays surely do not sink below the plane.
            LightShape::Direction(_) => (NEAR * radius, 1e-14),
        };
        let towards_box = (shaft.bounds.center() - center).normalize_or_zero();
        let across = (towards_box - unit * unit.dot(towards_box)).normalize_or_zero();
        // For a box in line with the light `across` is rounding alone, at any angle: the sum is no unit
        // vector then, and any unit vector will do.
        let tilted = (across * (1.0 - sine * sine).sqrt() + unit * sine).normalize_or_zero();
        let reach = radius + 0.5 * margin;
        [
            (SidePlane::with_normal(towards_box, center), reach),
            (SidePlane::with_normal(tilted, center), reach),
        ]
    }
}

fn is_light_above(plane: &SidePlane, light: &LightShape, reach: f64) -> bool {
    match *light {
        LightShape::Point(position) => {
            let (height, error) = plane.height(position);
            height - error > reach
        }
        LightShape::Direction(direction) => {
            let (height, error) = plane.height_of_direction(direction);
            height > error
        }
    }
}
