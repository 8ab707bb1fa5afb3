//! Whitted's model: what a ray sees.
//!
//! In: a ray and a prepared scene. Out: linear RGB, and every count of the work in a [`Tally`].
//! At each hit: emission, ambient light times diffuse color (times the texture), and for each
//! light a Lambertian and a Phong term if the light is in front, inside its cone and not blocked;
//! for each light with size the mean of such terms over its samples that are lit, or its exact visible fraction of their
//! mean over all samples (`area`);
//! then a mirrored and a refracted ray. With fog each ray gains the light that the air before its hit scatters, and what is
//! behind is weakened (`air`). Where a surface covers only part of what is behind, the
//! ray goes on straight and both are mixed by coverage.
//!
//! Invariants: each shaded hit asks one shadow query per light, unless the light is behind the
//! surface (by the exact sign of `ShadowIndex::light_side`) or does not shine into that
//! direction; a hit that covers nothing is not shaded. What is queried depends on geometry,
//! coverage and reliefs alone: not on shading normals, colors or earlier answers (`bumps`).

mod air;
mod area;
mod area_query;
mod at_once;
mod bump_tally;
mod bumps;
mod glass;
mod seen_air;
mod surface_point;
mod tally;
mod terms;
mod work;

use antumbra::{Answer, LightId, Shadow, ShadowIndex};
use antumbra_geometry::{DVec3, Ray, ReceiverPoint};
use antumbra_scene::model::{Color, Facing, Scene};

use crate::fog::Fog;
use crate::prepare::{Look, Prepared};
use crate::vector::unit;
use terms::{cone_share, local_term, power_at, reflected, refracted};

pub use area_query::{AreaQuery, AreaTally, Region};
pub use bump_tally::BumpTally;
pub use seen_air::{Air, AirTally};
pub use surface_point::SurfacePoint;
pub use tally::Tally;
pub use work::Work;

/// How often the rays of one chain go on behind a surface that does not cover everything. The
/// next surface counts as whole, so that stacks of glass panes cost what they show, and no more.
pub const MAX_PASSED: u32 = 32;

/// Outcome of one hit's query about one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightQuery {
    /// Not asked: the surface faces away.
    FacingAway,
    /// Not asked: the spot does not shine here.
    OutOfCone,
    /// Asked.
    Asked {
        /// The answer: exact, unless a stand-in gave it that is not.
        answer: Answer,
        /// Share of the light's power sent into this direction, above 0, at most 1.
        cone_share: f64,
    },
}

/// First sight of an eye ray: the first surface that covers anything.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seen {
    /// Whether there is one.
    pub is_surface: bool,
    /// Outcome of its query about each light of the scene, in order; empty without one.
    pub queries: Vec<LightQuery>,
    /// Queries of the lights with size, in the same order as these.
    pub areas: Vec<AreaQuery>,
    /// The air up to it, or as far as it goes; its light is that of the whole straight way of the eye ray.
    pub air: Air,
}

impl Seen {
    fn clear(&mut self) {
        self.is_surface = false;
        self.queries.clear();
        self.areas.clear();
        self.air = Air::default();
    }
}

/// How far a chain of rays has come.
#[derive(Clone, Copy, Debug)]
struct Chain {
    /// The ray's number in its chain; those that went on straight have the number of the first.
    depth: u32,
    /// How many went on straight.
    passed: u32,
}

/// Why no query of the integrator is refused: hits lie on surfaces of the index, whose coordinates
/// are finite, and lights are numbered as the index numbers them.
const FINE: &str = "a hit is a fine start";

/// Follows rays through a prepared scene.
#[derive(Clone, Copy, Debug)]
pub struct Integrator<'a> {
    prepared: &'a Prepared,
    max_depth: u32,
    light_samples: u32,
    is_exact: bool,
    has_colored_shadows: bool,
    has_bumps: bool,
    fog: Option<Fog>,
    seed: u64,
    sample_number: u64,
}

/// Samples of each light with size for each hit, where nothing else is asked for.
pub const DEFAULT_LIGHT_SAMPLES: u32 = 16;

impl<'a> Integrator<'a> {
    /// Starts with the longest chain of rays to follow: the eye ray is number 1, as in the SPD
    /// test procedure. 0 and 1 both mean eye rays only, with shadows. Rays that go on straight
    /// behind a blended surface do not count; [`MAX_PASSED`] bounds them.
    pub fn new(prepared: &'a Prepared, max_depth: u32) -> Self {
        Self {
            prepared,
            max_depth,
            light_samples: DEFAULT_LIGHT_SAMPLES,
            is_exact: false,
            has_colored_shadows: true,
            has_bumps: true,
            fog: None,
            seed: 0,
            sample_number: 0,
        }
    }

    /// Takes so many samples of each light with size at each hit, and others for another seed.
    pub fn with_light_samples(self, light_samples: u32, seed: u64) -> Self {
        Self {
            light_samples,
            seed,
            ..self
        }
    }

    /// Takes the exact visible fraction of each light with size where it has a closed form, or samples everywhere.
    pub fn with_exact_fractions(self, is_exact: bool) -> Self {
        Self { is_exact, ..self }
    }

    /// Lets see-through surfaces color the light that reaches others through them, or not.
    pub fn with_colored_shadows(self, has_colored_shadows: bool) -> Self {
        Self {
            has_colored_shadows,
            ..self
        }
    }

    /// Gives surfaces the reliefs that their materials have, or leaves them smooth.
    pub fn with_bumps(self, has_bumps: bool) -> Self {
        Self { has_bumps, ..self }
    }

    /// Fills the space between surfaces with a medium, or leaves it clear.
    pub fn with_fog(self, fog: Option<Fog>) -> Self {
        Self { fog, ..self }
    }

    /// Returns an integrator for one sample of a picture. Its number chooses the samples of lights with size.
    pub fn at_sample(self, sample_number: u64) -> Self {
        Self {
            sample_number,
            ..self
        }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'a Scene {
        self.prepared.scene()
    }

    fn index(&self) -> &'a ShadowIndex {
        self.prepared.index()
    }

    /// Returns what an eye ray sees, linear RGB, and notes in `seen` what it saw first.
    pub fn radiance(&self, eye_ray: &Ray, work: &mut Work<'a>, seen: &mut Seen) -> Color {
        seen.clear();
        work.tally.primary += 1;
        let chain = Chain {
            depth: 1,
            passed: 0,
        };
        self.trace(*eye_ray, chain, Some(seen), work)
    }

    /// Notes in `seen` what an eye ray sees first; asks every light there and follows no further.
    pub fn look_only(&self, eye_ray: &Ray, work: &mut Work<'a>, seen: &mut Seen) {
        seen.clear();
        if let Some(point) = self.first_seen(eye_ray, &mut work.tally) {
            seen.is_surface = true;
            self.ask_at_once(&point, work);
            let lights = 0..self.prepared.scene().lights.len();
            seen.queries
                .extend(lights.map(|light| self.query(&point, light, work)));
            let areas = 0..self.prepared.scene().area_lights.len();
            seen.areas
                .extend(areas.map(|light| self.ask_area(&point, light, work)));
        }
    }

    /// Returns the first point along an eye ray whose surface covers anything, or `None` where
    /// nothing is seen.
    pub fn first_seen(&self, eye_ray: &Ray, tally: &mut Tally) -> Option<SurfacePoint<'a>> {
        tally.primary += 1;
        let mut ray = *eye_ray;
        let mut passed = 0;
        loop {
            let point = self.nearest(&ray, tally)?;
            tally.primary_hits += u64::from(passed == 0);
            let look = self.prepared.look(&point.hit, point.viewer_side);
            if look.coverage > 0.0 || passed == MAX_PASSED {
                return Some(point);
            }
            passed += 1;
            tally.passed += 1;
            ray = point.ray_towards(ray.direction);
        }
    }

    /// Follows a ray through whatever does not cover everything. `seen` is for the eye ray.
    fn trace(
        &self,
        mut ray: Ray,
        mut chain: Chain,
        mut seen: Option<&mut Seen>,
        work: &mut Work<'a>,
    ) -> Color {
        let mut color = Color::ZERO;
        // The share of what is seen from here on.
        let mut share = 1.0;
        let mut is_first_of_eye = seen.is_some();
        let mut is_first_shaded = true;
        loop {
            let found = self.nearest(&ray, &mut work.tally);
            if let Some(fog) = &self.fog {
                let air = self.air(fog, &ray, found.as_ref(), work);
                color += share * air.light;
                if let Some(seen) = &mut seen {
                    seen.air.light += share * air.light;
                    if is_first_shaded {
                        seen.air.transmittance *= air.transmittance;
                    }
                }
                share *= air.transmittance;
            }
            let Some(point) = found else {
                return color + share * self.prepared.scene().background;
            };
            work.tally.primary_hits += u64::from(is_first_of_eye);
            is_first_of_eye = false;

            let look = self.prepared.look(&point.hit, point.viewer_side);
            let coverage = if chain.passed < MAX_PASSED {
                look.coverage
            } else {
                1.0
            };
            if coverage > 0.0 {
                let noted = seen.as_deref_mut().filter(|_| is_first_shaded);
                let shaded = self.shade(&point, &look, &ray, chain, noted, work);
                color += share * coverage * shaded;
                is_first_shaded = false;
            }
            if coverage >= 1.0 {
                return color;
            }
            share *= 1.0 - coverage;
            chain.passed += 1;
            work.tally.passed += 1;
            ray = point.ray_towards(ray.direction);
        }
    }

    fn nearest(&self, ray: &Ray, tally: &mut Tally) -> Option<SurfacePoint<'a>> {
        let hit = self.index().nearest(ray, &mut tally.counters)?;
        let geometric_normal = self.prepared.geometric_normal(&hit);
        let towards_viewer = unit(-ray.direction).unwrap_or(geometric_normal);
        let viewer_side = sign(geometric_normal.dot(-ray.direction));
        let mut shading_normal = self.prepared.shading_normal(&hit, geometric_normal);
        let relief = match self.has_bumps {
            true => self.prepared.relief(&hit),
            false => None,
        };
        if let Some(relief) = &relief {
            let is_back = self.is_back(viewer_side);
            shading_normal = relief.normal(hit.point, geometric_normal, shading_normal, is_back);
        }
        Some(SurfacePoint {
            hit,
            geometric_normal,
            shading_normal,
            towards_viewer,
            viewer_side,
            relief,
        })
    }

    /// Asks whether a light of the scene reaches a point, if it can at all.
    pub fn ask(&self, point: &SurfacePoint<'_>, light: usize, tally: &mut Tally) -> LightQuery {
        tally.queries += 1;
        let start = ReceiverPoint {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };

        // In front of which side is the light, exactly?
        let side = self
            .index()
            .light_side(&start, LightId::from_index(light))
            .expect(FINE);
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

        let answer = match &point.relief {
            Some(relief) => self.ask_bumped(point, relief, side, light, tally),
            None => self
                .prepared
                .shadow(&start, light, &mut tally.counters, &mut tally.candidates)
                .expect(FINE),
        };
        LightQuery::Asked { answer, cone_share }
    }

    /// Returns whether the back of a surface is what may be lit, seen from a side.
    fn is_back(&self, viewer_side: i8) -> bool {
        self.scene().facing == Facing::Viewer && viewer_side < 0
    }

    /// Returns the light that leaves a point against `ray`, and notes its questions in `seen`.
    fn shade(
        &self,
        point: &SurfacePoint<'_>,
        look: &Look<'_>,
        ray: &Ray,
        chain: Chain,
        mut seen: Option<&mut Seen>,
        work: &mut Work<'a>,
    ) -> Color {
        let scene = self.prepared.scene();
        let mut color = look.material.emission + scene.ambient * look.diffuse;
        if let Some(seen) = &mut seen {
            seen.is_surface = true;
        }

        // The side that may be lit: as wound, or as looked at.
        let front_normal = if self.is_back(point.viewer_side) {
            -point.shading_normal
        } else {
            point.shading_normal
        };
        self.ask_at_once(point, work);
        for (number, light) in scene.lights.iter().enumerate() {
            let query = self.query(point, number, work);
            if let Some(seen) = &mut seen {
                seen.queries.push(query);
            }
            if let LightQuery::Asked { answer, cone_share } = query
                && answer.shadow == Shadow::Lit
            {
                let shape = &self.index().lights()[number];
                let left = self.left_of(shape, point.hit.point);
                let power = cone_share * left * power_at(light, shape, point.hit.point);
                let term = local_term(look, point, front_normal, shape);
                if term != Color::ZERO {
                    color += self.through_glass(point, number, work) * power * term;
                }
            }
        }

        for (number, light) in scene.area_lights.iter().enumerate() {
            let query = self.ask_area(point, number, work);
            if let Some(seen) = &mut seen {
                seen.areas.push(query);
            }
            if let Some(exact) = &query.exact {
                if exact.fraction > 0.0 {
                    color += self.light_of_share(point, look, front_normal, light, exact, work);
                }
            } else if query.lit > 0 {
                color += self.light_of_area(point, look, front_normal, light, work);
            }
        }

        if chain.depth < self.max_depth {
            color += self.secondary(point, look, ray.direction, chain, work);
        }
        color
    }

    /// Follows the mirrored and the refracted ray.
    fn secondary(
        &self,
        point: &SurfacePoint<'_>,
        look: &Look<'_>,
        direction: DVec3,
        chain: Chain,
        work: &mut Work<'a>,
    ) -> Color {
        let material = look.material;
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
                work.tally.refraction += 1;
                color += material.transmission * self.follow(point, through, chain, work);
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
            work.tally.reflection += 1;
            color += reflection * self.follow(point, mirrored, chain, work);
        }
        color
    }

    fn follow(
        &self,
        from: &SurfacePoint<'_>,
        direction: DVec3,
        chain: Chain,
        work: &mut Work<'a>,
    ) -> Color {
        let chain = Chain {
            depth: chain.depth + 1,
            ..chain
        };
        self.trace(from.ray_towards(direction), chain, None, work)
    }
}

fn sign(value: f64) -> i8 {
    i8::from(value > 0.0) - i8::from(value < 0.0)
}
