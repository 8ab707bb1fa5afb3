//! All lights without size of a point, asked one by one or at once.
//!
//! In: a point. Out: what became of the query about each light, and counts. Invariant: which way lights are asked changes
//! neither answers nor counts, but for how answers were found.

use antumbra::{LightId, LightSamples};
use antumbra_geometry::ReceiverPoint;
use antumbra_scene::model::LightKind;

use super::terms::cone_share;
use super::work::{AtOnce, Work};
use super::{FINE, Integrator, LightQuery, SurfacePoint, Tally};

impl<'a> Integrator<'a> {
    /// Returns what a thread follows rays with.
    pub fn work(&self) -> Work<'a> {
        let at_once = self.prepared.asks_lights_at_once().then(|| {
            let lights = &self.scene().lights;
            let is_spot = |&light: &usize| matches!(lights[light].kind, LightKind::Spot { .. });
            AtOnce {
                lights: self.index().lights_in_turn(),
                spots: (0..lights.len()).filter(is_spot).collect(),
                dark: vec![0; lights.len().div_ceil(64)],
                has_side: false,
            }
        });
        Work {
            tally: Tally::default(),
            samples: LightSamples::default(),
            at_once,
        }
    }

    /// Asks about all lights without size of a point, if they are asked at once: not where there is a relief.
    pub(super) fn ask_at_once(&self, point: &SurfacePoint<'_>, work: &mut Work<'a>) {
        let Some(at_once) = work.at_once.as_mut().filter(|_| point.relief.is_none()) else {
            return;
        };
        let tally = &mut work.tally;
        let lights = &self.scene().lights;
        tally.queries += lights.len() as u64;
        let side = self.lit_side(point);
        at_once.has_side = side.is_some();
        let Some(side) = side else {
            tally.facing_away += lights.len() as u64;
            return;
        };

        // Which spots do not shine into this direction?
        at_once.dark.fill(0);
        for &light in &at_once.spots {
            let is_dark = cone_share(&lights[light].kind, point.hit.point) <= 0.0;
            at_once.dark[light / 64] |= u64::from(is_dark) << (light % 64);
        }

        let start = ReceiverPoint {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };
        at_once
            .lights
            .ask(&start, side, &at_once.dark, &mut tally.counters)
            .expect(FINE);
        tally.facing_away += lights.len() as u64;
        for (on_side, dark) in at_once.lights.on_side().iter().zip(&at_once.dark) {
            tally.facing_away -= u64::from(on_side.count_ones());
            tally.out_of_cone += u64::from((on_side & dark).count_ones());
        }
    }

    /// Returns what became of the query of a point about a light. Where lights are asked at once, they have been.
    pub(super) fn query(
        &self,
        point: &SurfacePoint<'_>,
        light: usize,
        work: &mut Work<'a>,
    ) -> LightQuery {
        let Some(at_once) = work.at_once.as_ref().filter(|_| point.relief.is_none()) else {
            return self.ask(point, light, &mut work.tally);
        };
        let is = |words: &[u64]| words[light / 64] >> (light % 64) & 1 != 0;
        if !at_once.has_side || !is(at_once.lights.on_side()) {
            return LightQuery::FacingAway;
        }
        if is(&at_once.dark) {
            return LightQuery::OutOfCone;
        }
        LightQuery::Asked {
            answer: at_once.lights.answer_of(LightId::from_index(light)),
            cone_share: cone_share(&self.scene().lights[light].kind, point.hit.point),
        }
    }
}
