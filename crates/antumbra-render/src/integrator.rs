//! Whitted's model: what a ray sees.
//!
//! In: a ray and a prepared scene. Out: linear RGB, and every count of the work in a [`Tally`].
//! At each hit: emission, ambient light times diffuse colour, and for each light a Lambertian and
//! a Phong term if the light is in front, inside its cone and not blocked; then a mirrored and a
//! refracted ray.
//!
//! Invariants: each hit asks one shadow query per light, unless the light is behind the surface
//! (by the exact sign of `ShadowIndex::light_side`) or does not shine into that direction. What
//! is queried depends on geometry alone: not on shading normals, colours or earlier answers.

use antumbra::{Answer, Counters, Shadow, ShadowIndex};
use antumbra_geometry::{DVec3, Hit, LightShape, Ray, Start};
use antumbra_scene::model::{Color, Facing, Light, LightKind, Material};

use crate::prepare::Prepared;
use crate::vector::unit;

/// Counts of rays and queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays from the eye.
    pub primary: u64,
    /// Rays from the eye that hit something.
    pub primary_hits: u64,
    /// Mirrored rays.
    pub reflection: u64,
    /// Refracted rays.
    pub refraction: u64,
    /// One per hit and light, whatever became of it.
    pub queries: u64,
    /// Of `queries`, those not asked because the surface faces away from the light.
    pub facing_away: u64,
    /// Of `queries`, those not asked because the point is outside the spot's cone.
    pub out_of_cone: u64,
    /// What the shadow index counted.
    pub counters: Counters,
}

impl Tally {
    /// Adds another tally to this one.
    pub fn add(&mut self, other: &Self) {
        self.primary += other.primary;
        self.primary_hits += other.primary_hits;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
        self.queries += other.queries;
        self.facing_away += other.facing_away;
        self.out_of_cone += other.out_of_cone;
        self.counters.add(&other.counters);
    }
}

/// What became of one hit's question about one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightQuery {
    /// Not asked: the surface faces away.
    FacingAway,
    /// Not asked: the spot does not shine here.
    OutOfCone,
    /// Asked.
    Asked {
        /// The exact answer.
        answer: Answer,
        /// Share of the light's power sent into this direction, above 0, at most 1.
        cone_share: f64,
    },
}

/// A hit with its normals.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The hit.
    pub hit: Hit,
    /// Unit normal by winding, or outwards.
    pub geometric_normal: DVec3,
    /// Unit normal for shading, on the same side.
    pub shading_normal: DVec3,
    /// Unit vector back along the ray.
    pub towards_viewer: DVec3,
    /// Which side is looked at: 1 the side of the geometric normal, -1 the other, 0 edge-on.
    pub viewer_side: i8,
}

/// Follows rays through a prepared scene.
#[derive(Clone, Copy, Debug)]
pub struct Integrator<'a> {
    prepared: &'a Prepared,
    max_depth: u32,
}

impl<'a> Integrator<'a> {
    /// Starts with the longest chain of rays to follow: the eye ray is number 1, as in the SPD
    /// test procedure. 0 and 1 both mean eye rays only, with shadows.
    pub fn new(prepared: &'a Prepared, max_depth: u32) -> Self {
        Self {
            prepared,
            max_depth,
        }
    }

    fn index(&self) -> &'a ShadowIndex {
        self.prepared.index()
    }

    /// Returns what an eye ray sees, linear RGB.
    pub fn radiance(&self, eye_ray: &Ray, tally: &mut Tally) -> Color {
        self.primary_hit(eye_ray, tally)
            .map_or(self.prepared.scene().background, |point| {
                self.shade(&point, eye_ray, 1, tally)
            })
    }

    /// Returns what an eye ray hits.
    pub fn primary_hit(&self, eye_ray: &Ray, tally: &mut Tally) -> Option<SurfacePoint> {
        tally.primary += 1;
        let point = self.nearest(eye_ray, tally)?;
        tally.primary_hits += 1;
        Some(point)
    }

    fn nearest(&self, ray: &Ray, tally: &mut Tally) -> Option<SurfacePoint> {
        let hit = self.index().nearest(ray, &mut tally.counters)?;
        let geometric_normal = self.prepared.geometric_normal(&hit);
        let towards_viewer = unit(-ray.direction).unwrap_or(geometric_normal);
        Some(SurfacePoint {
            hit,
            geometric_normal,
            shading_normal: self.prepared.shading_normal(&hit, geometric_normal),
            towards_viewer,
            viewer_side: sign(geometric_normal.dot(-ray.direction)),
        })
    }

    /// Asks whether a light of the scene reaches a point, if it can at all.
    pub fn ask(&self, point: &SurfacePoint, light: usize, tally: &mut Tally) -> LightQuery {
        tally.queries += 1;
        let start = Start {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };

        // In front of which side is the light, exactly?
        let side = self.index().light_side(&start, light);
        let is_facing = match self.prepared.scene().facing {
            Facing::Winding => side > 0,
            Facing::Viewer => side != 0 && side.signum() == point.viewer_side,
        };
        if !is_facing {
            tally.facing_away += 1;
            return LightQuery::FacingAway;
        }

        // Does it shine into this direction?
        let cone_share = cone_share(&self.prepared.scene().lights[light].kind, start.point);
        if cone_share <= 0.0 {
            tally.out_of_cone += 1;
            return LightQuery::OutOfCone;
        }

        let answer = self.index().shadow(&start, light, &mut tally.counters);
        LightQuery::Asked { answer, cone_share }
    }

    /// Returns the light that leaves a point against `ray`, which is number `depth` of its chain.
    fn shade(&self, point: &SurfacePoint, ray: &Ray, depth: u32, tally: &mut Tally) -> Color {
        let scene = self.prepared.scene();
        let material = self.prepared.material(point.hit.surface);
        let mut color = material.emission + scene.ambient * material.diffuse;

        // The side that may be lit: as wound, or as looked at.
        let is_turned = scene.facing == Facing::Viewer && point.viewer_side < 0;
        let front_normal = if is_turned {
            -point.shading_normal
        } else {
            point.shading_normal
        };
        for (number, light) in scene.lights.iter().enumerate() {
            if let LightQuery::Asked { answer, cone_share } = self.ask(point, number, tally)
                && answer.shadow == Shadow::Lit
            {
                let shape = &self.index().lights()[number];
                let power = cone_share * power_at(light, shape, point.hit.point);
                color += power * local_term(material, point, front_normal, shape);
            }
        }

        if depth < self.max_depth {
            color += self.secondary(point, material, ray.direction, depth, tally);
        }
        color
    }

    /// Follows the mirrored and the refracted ray.
    fn secondary(
        &self,
        point: &SurfacePoint,
        material: &Material,
        direction: DVec3,
        depth: u32,
        tally: &mut Tally,
    ) -> Color {
        let mut color = Color::ZERO;
        let mut reflection = material.reflection;

        let flip = if point.viewer_side < 0 { -1.0 } else { 1.0 };
        let shading_normal = flip * point.shading_normal;
        let geometric_normal = flip * point.geometric_normal;
        let Some(direction) = unit(direction) else {
            return color;
        };

        if material.transmission != Color::ZERO {
            let ratio = if point.viewer_side < 0 {
                material.ior
            } else {
                1.0 / material.ior
            };
            let through = refracted(direction, shading_normal, ratio)
                .filter(|d| d.dot(geometric_normal) < 0.0)
                .or_else(|| refracted(direction, geometric_normal, ratio));
            if let Some(through) = through {
                tally.refraction += 1;
                color += material.transmission * self.follow(point, through, depth, tally);
            } else {
                // Total reflection: what would have gone through is mirrored too.
                reflection += material.transmission;
            }
        }

        if reflection != Color::ZERO {
            let mut mirrored = reflected(direction, shading_normal);
            if mirrored.dot(geometric_normal) <= 0.0 {
                mirrored = reflected(direction, geometric_normal);
            }
            tally.reflection += 1;
            color += reflection * self.follow(point, mirrored, depth, tally);
        }
        color
    }

    fn follow(
        &self,
        from: &SurfacePoint,
        direction: DVec3,
        depth: u32,
        tally: &mut Tally,
    ) -> Color {
        let ray = Ray {
            origin: from.hit.point,
            direction,
            leaves: Some(from.hit.surface),
        };
        match self.nearest(&ray, tally) {
            Some(point) => self.shade(&point, &ray, depth + 1, tally),
            None => self.prepared.scene().background,
        }
    }
}

/// Returns the share of a light's power that it sends towards a point: 1 but for spots.
fn cone_share(kind: &LightKind, point_in_world: DVec3) -> f64 {
    let LightKind::Spot {
        position,
        axis,
        inner_cosine,
        outer_cosine,
    } = *kind
    else {
        return 1.0;
    };
    let (Some(axis), Some(direction)) = (unit(axis), unit(point_in_world - position)) else {
        return 1.0;
    };
    let cosine = axis.dot(direction);
    if cosine >= inner_cosine {
        1.0
    } else if cosine <= outer_cosine {
        0.0
    } else {
        let t = (cosine - outer_cosine) / (inner_cosine - outer_cosine);
        t * t * (3.0 - 2.0 * t)
    }
}

/// Returns a light's colour at a point, weakened by distance if it weakens.
fn power_at(light: &Light, shape: &LightShape, point_in_world: DVec3) -> Color {
    match shape {
        LightShape::Point(position) if light.falls_off => {
            let square = position.distance_squared(point_in_world);
            if square > 0.0 {
                light.color / square
            } else {
                Color::ZERO
            }
        }
        _ => light.color,
    }
}

/// Returns the Lambertian and the Phong term for a light that reaches the point.
fn local_term(
    material: &Material,
    point: &SurfacePoint,
    front_normal: DVec3,
    shape: &LightShape,
) -> Color {
    let Some(towards_light) = unit(shape.towards(point.hit.point)) else {
        return Color::ZERO;
    };
    let cosine = front_normal.dot(towards_light);
    if cosine <= 0.0 {
        return Color::ZERO;
    }
    let mut color = material.diffuse * cosine;
    if material.specular != Color::ZERO {
        let mirror_cosine = reflected(-towards_light, front_normal).dot(point.towards_viewer);
        if mirror_cosine > 0.0 {
            // The C library's pow differs between platforms; libm's does not.
            color += material.specular * libm::pow(mirror_cosine, material.shininess);
        }
    }
    color
}

fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// Returns the direction after Snell's law, or `None` on total reflection. `normal` is on the side
/// the unit `direction` comes from; `ratio` is the index of refraction here over the one beyond.
fn refracted(direction: DVec3, normal: DVec3, ratio: f64) -> Option<DVec3> {
    let cosine = -direction.dot(normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if !(square >= 0.0 && square.is_finite()) {
        return None;
    }
    unit(ratio * direction + (ratio * cosine - square.sqrt()) * normal)
}

fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(found: DVec3, expected: DVec3) {
        assert!(
            (found - expected).length() < 1e-15,
            "{found} is not {expected}"
        );
    }

    #[test]
    fn snell_bends_towards_the_normal_in_the_denser_medium_and_back() {
        let slanted = unit(DVec3::new(1.0, 0.0, -1.0)).unwrap();
        let inside = refracted(slanted, DVec3::Z, 1.0 / 1.5).unwrap();
        assert!((inside.x - slanted.x / 1.5).abs() < 1e-15, "{inside}");
        let outside = refracted(inside, DVec3::Z, 1.5).unwrap();
        assert_close(outside, slanted);
        assert_close(refracted(slanted, DVec3::Z, 1.0).unwrap(), slanted);
    }

    #[test]
    fn beyond_the_critical_angle_nothing_goes_through() {
        let grazing = unit(DVec3::new(1.0, 0.0, -0.5)).unwrap();
        assert_eq!(refracted(grazing, DVec3::Z, 1.5), None);
    }

    #[test]
    fn mirrors_keep_the_tangent_and_turn_the_normal() {
        assert_close(
            reflected(DVec3::new(1.0, 2.0, -3.0), DVec3::Z),
            DVec3::new(1.0, 2.0, 3.0),
        );
    }

    #[test]
    fn a_spot_is_full_inside_dark_outside_and_smooth_between() {
        let spot = LightKind::Spot {
            position: DVec3::ZERO,
            axis: DVec3::new(0.0, 0.0, -2.0),
            inner_cosine: 0.9,
            outer_cosine: 0.5,
        };
        let at = |cosine: f64| {
            cone_share(
                &spot,
                DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine),
            )
        };
        assert_eq!(at(0.95), 1.0);
        assert_eq!(at(0.4), 0.0);
        assert_eq!(at(-1.0), 0.0);
        assert!((at(0.7) - 0.5).abs() < 1e-12, "{}", at(0.7));
    }

    #[test]
    fn a_light_in_the_point_itself_adds_nothing_and_gives_no_nan() {
        let light = Light {
            name: String::new(),
            kind: LightKind::Point {
                position: DVec3::ONE,
            },
            color: Color::ONE,
            falls_off: true,
        };
        let shape = LightShape::Point(DVec3::ONE);
        assert_eq!(power_at(&light, &shape, DVec3::ONE), Color::ZERO);
        assert_eq!(
            power_at(&light, &shape, DVec3::new(1.0, 1.0, 3.0)),
            Color::splat(0.25)
        );
    }
}
