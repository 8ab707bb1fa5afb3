//! The air along a ray: which stretches of it lights reach, and what those scatter.
//!
//! In: a ray from its origin to what it meets. Out: [`Air`], and counts. Invariants: lit stretches are the exact lit intervals
//! where they have a closed form, else the exact answers in the middles of [`PARTS`] equal parts, so that they depend on neither
//! method nor threads; lights with size use the places of their samples. Formulas are those of [`crate::fog`].

use std::f64::consts::PI;

use antumbra::{Counters, LitIntervalsError, ShadowCounters, Targets};
use antumbra_geometry::{
    AreaShape, DVec3, Emission, LightShape, MAX_LIGHT_SAMPLES, Ray, ReceiverPoint, SamplePattern,
};
use antumbra_scene::model::{AreaLight, Color, Light, LightKind};
use antumbra_task::check;

use super::seen_air::Air;
use super::{FINE, Integrator, SurfacePoint, Work};
use crate::fog::{Fog, PointView, Shine};
use crate::vector::unit;

/// Parts of a segment that are asked one by one where lit intervals have no closed form.
const PARTS: u32 = 128;

/// Largest coordinate that is asked about; the air ends there.
const LARGEST: f64 = (1_u128 << 100) as f64;

/// A stretch of a ray, with air all along.
#[derive(Clone, Copy)]
struct Line {
    ends: [DVec3; 2],
    direction: DVec3,
    length: f64,
}

impl Integrator<'_> {
    /// Returns the share of a light's power that the air leaves on the way to a point: 1 without air. Light from a direction
    /// is as strong as the scene says where it arrives.
    pub(super) fn left_of(&self, target: &LightShape, point: DVec3) -> f64 {
        match (&self.fog, target) {
            (Some(fog), LightShape::Point(place)) => fog.transmittance(place.distance(point)),
            _ => 1.0,
        }
    }

    /// Returns the air between a ray's origin and what it meets, or as far as the air goes.
    pub(super) fn air(
        &self,
        fog: &Fog,
        ray: &Ray,
        found: Option<&SurfacePoint<'_>>,
        work: &mut Work<'_>,
    ) -> Air {
        let end = match found {
            Some(point) => Some(point.hit.point),
            None => unit(ray.direction).map(|d| ray.origin + d * self.reach(ray.origin)),
        };
        let Some(line) = end.and_then(|end| Line::between([ray.origin, end])) else {
            return Air::default();
        };
        let mut light = Color::ZERO;
        if fog.extinction() > 0.0 && fog.albedo() > 0.0 {
            let scene = self.scene();
            for (one, shape) in scene.lights.iter().zip(self.index().lights()) {
                let share = match *shape {
                    LightShape::Direction(towards) => self.of_direction(fog, &line, towards, work),
                    LightShape::Point(place) => {
                        let shine = shine_of(one);
                        let view = line.view(place, shine, one.falls_off);
                        self.of_point(fog, &line, place, &view, work)
                    }
                };
                // What lights a surface of diffuse color 1 with color 1 has the irradiance pi.
                light += one.color * (PI * share);
            }
            for (number, one) in scene.area_lights.iter().enumerate() {
                let share = self.of_area(fog, &line, number, one, work);
                light += one.color * (PI * share);
            }
        }
        Air {
            light,
            transmittance: fog.transmittance(line.length),
        }
    }

    /// Returns how far the air goes where a ray meets nothing: as far as the farthest corner of the box around all surfaces.
    fn reach(&self, origin: DVec3) -> f64 {
        let bounds = self.index().occluders().bounds();
        let farthest = (bounds.min - origin).abs().max((bounds.max - origin).abs());
        let reach = farthest.length();
        // Nothing, where there are no surfaces.
        if bounds.min.cmple(bounds.max).all() && reach.is_finite() {
            reach.min(0.5 * (LARGEST - origin.abs().max_element()))
        } else {
            0.0
        }
    }

    fn of_direction(&self, fog: &Fog, line: &Line, towards: DVec3, work: &mut Work<'_>) -> f64 {
        let Some(unit) = unit(towards) else {
            return 0.0;
        };
        let cosine = unit.dot(line.direction).clamp(-1.0, 1.0);
        let light = LightShape::Direction(towards);
        self.sum(line, &light, work, |begin, end| {
            fog.airlight_of_direction(cosine, begin, end)
        })
    }

    fn of_point(
        &self,
        fog: &Fog,
        line: &Line,
        place: DVec3,
        view: &PointView,
        work: &mut Work<'_>,
    ) -> f64 {
        if view.is_dark(line.length) {
            return 0.0;
        }
        self.sum(line, &LightShape::Point(place), work, |begin, end| {
            view.airlight(fog, begin, end)
        })
    }

    /// Returns the mean over the samples of a light with size.
    fn of_area(
        &self,
        fog: &Fog,
        line: &Line,
        number: usize,
        light: &AreaLight,
        work: &mut Work<'_>,
    ) -> f64 {
        let pattern = SamplePattern { seed: self.seed };
        let scramble = pattern.scramble(self.sample_number, number as u64);
        let count = self.light_samples.clamp(1, MAX_LIGHT_SAMPLES);
        let mut sum = 0.0;
        for sample in 0..count {
            check();
            let place = SamplePattern::place(scramble, sample);
            for point in light.shape.emitting_points(place).into_iter().flatten() {
                sum += match point.target {
                    LightShape::Direction(towards) => {
                        // A sky of radiance 1 / pi all around gives open ground an irradiance of 1.
                        let share = match light.shape {
                            AreaShape::Sky(_) => light.shape.size() / PI,
                            _ => 1.0,
                        };
                        share * self.of_direction(fog, line, towards, work)
                    }
                    LightShape::Point(place) => {
                        let shine = match point.emission {
                            Emission::Even => Shine::Even,
                            Emission::Sine { axis } => Shine::Sine { axis },
                            Emission::Cosine {
                                normal,
                                is_two_sided,
                            } => Shine::Cosine {
                                normal,
                                is_two_sided,
                            },
                        };
                        let share = if light.falls_off {
                            light.shape.size() / PI
                        } else {
                            1.0 / point.mean
                        };
                        let view = line.view(place, shine, light.falls_off);
                        share * self.of_point(fog, line, place, &view, work)
                    }
                };
            }
        }
        sum / f64::from(count)
    }

    /// Adds up what lit stretches bring, from the origin on.
    fn sum(
        &self,
        line: &Line,
        light: &LightShape,
        work: &mut Work<'_>,
        airlight: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let [origin, end] = line.ends;
        let exact = self.index().lit_intervals_along(origin, end, light);
        let is_by_parts = matches!(exact, Err(LitIntervalsError::NoClosedForm { .. }));
        let lit = if is_by_parts {
            self.lit_parts(line, light, &mut work.tally.counters)
        } else {
            exact.expect(FINE)
        };
        let tally = &mut work.tally.air;
        tally.segments += 1;
        tally.by_parts += u64::from(is_by_parts);
        tally.intervals += lit.len() as u64;
        let of = |[begin, end]: [f64; 2]| airlight(begin * line.length, end * line.length);
        lit.into_iter().map(of).sum()
    }

    /// Returns lit stretches by the exact answers in the middles of parts, as shares of the length.
    fn lit_parts(&self, line: &Line, light: &LightShape, counters: &mut Counters) -> Vec<[f64; 2]> {
        let share = |part: u32| f64::from(part) / f64::from(PARTS);
        let [origin, end] = line.ends;
        let starts: Vec<ReceiverPoint> = (0..PARTS)
            .map(|part| ReceiverPoint {
                point: origin + (end - origin) * (0.5 * (share(part) + share(part + 1))),
                surface: None,
            })
            .collect();
        let targets = Targets::Shared(std::slice::from_ref(light));
        let mut dark = vec![0; starts.len()];
        let mut asked = Counters::default();
        self.index()
            .occluded_targets_of(&starts, targets, &mut dark, &mut asked)
            .expect(FINE);
        // Queries about surfaces have those for themselves.
        asked.shadow = ShadowCounters::default();
        counters.add(&asked);
        let mut lit: Vec<[f64; 2]> = Vec::new();
        for (part, _) in (0..PARTS).zip(&dark).filter(|(_, word)| **word == 0) {
            match lit.last_mut() {
                Some(last) if last[1] == share(part) => last[1] = share(part + 1),
                _ => lit.push([part, part + 1].map(share)),
            }
        }
        lit
    }
}

impl Line {
    /// Returns the stretch between two points; `None` if it has no length, or leaves what may be asked about.
    fn between(ends @ [origin, end]: [DVec3; 2]) -> Option<Self> {
        let is_fine = |point: DVec3| point.abs().cmple(DVec3::splat(LARGEST)).all();
        if !ends.into_iter().all(is_fine) {
            return None;
        }
        let along = end - origin;
        let length = along.length();
        Some(Self {
            ends,
            direction: unit(along)?,
            length,
        })
        .filter(|line| line.length > 0.0)
    }

    fn view(&self, light: DVec3, shine: Shine, falls_off: bool) -> PointView {
        let ray = [self.ends[0], self.direction];
        PointView::new(ray, self.length, light, shine, falls_off)
    }
}

fn shine_of(light: &Light) -> Shine {
    match light.kind {
        LightKind::Spot {
            axis,
            inner_cosine,
            outer_cosine,
            ..
        } => unit(axis).map_or(Shine::Even, |axis| Shine::Cone {
            axis,
            inner_cosine,
            outer_cosine,
        }),
        LightKind::Point { .. } | LightKind::Directional { .. } => Shine::Even,
    }
}
