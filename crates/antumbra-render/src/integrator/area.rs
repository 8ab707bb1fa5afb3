//! Lights with size in one point: which samples reach it, or which share of the light does, and what they bring
//! (Paper 9.3).

use antumbra::{Counters, LightSampling, ReceiverSide, ShadowCounters, VisibleFraction};
use antumbra_geometry::{AreaSample, AreaShape, LightShape, ReceiverPoint, SamplePattern};
use antumbra_scene::model::{AreaLight, Color, Facing};

use super::area_query::AreaQuery;
use super::terms::local_term;
use super::{FINE, Integrator, SurfacePoint, Work};
use crate::prepare::Look;

impl<'a> Integrator<'a> {
    /// Returns which side of its surface a point is lit on; `None` seen along its edge.
    pub(super) fn lit_side(&self, point: &SurfacePoint<'_>) -> Option<ReceiverSide> {
        match self.prepared.scene().facing {
            Facing::Winding => Some(ReceiverSide::Front),
            Facing::Viewer => match point.viewer_side {
                1.. => Some(ReceiverSide::Front),
                0 => None,
                _ => Some(ReceiverSide::Back),
            },
        }
    }

    /// Asks which samples of a light with size reach a point, or which share of it does.
    pub(super) fn ask_area(
        &self,
        point: &SurfacePoint<'_>,
        light: usize,
        work: &mut Work<'a>,
    ) -> AreaQuery {
        let Work { samples, tally, .. } = work;
        let scene = self.prepared.scene();
        let start = ReceiverPoint {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };
        let sampling = LightSampling {
            samples: self.light_samples,
            seed: self.seed,
            light: light as u64,
        };
        let mut query = AreaQuery {
            samples: sampling.count(),
            ..AreaQuery::default()
        };
        // Seen along its edge a surface has no lit side.
        if let Some(side) = self.lit_side(point) {
            let shape = &scene.area_lights[light].shape;
            let mut counters = Counters::default();
            if self.is_exact {
                let exact = self
                    .index()
                    .exact_fraction(&start, side, shape, &mut counters);
                query.exact = exact.expect(FINE);
            }
            if query.exact.is_some() {
                query.samples = 0;
                tally.counters.add(&counters);
                tally.area.count(&query);
                return query;
            }
            self.index()
                .sample_light(
                    &start,
                    side,
                    shape,
                    self.sample_number,
                    &sampling,
                    samples,
                    &mut counters,
                )
                .expect(FINE);
            query.asked = samples.queried().len() as u32;
            query.lit = samples.lit_count();
            // Lights without size have those for themselves.
            counters.shadow = ShadowCounters::default();
            tally.counters.add(&counters);
        }
        tally.area.count(&query);
        query
    }

    /// Returns what a share of a light brings: the share of what is asked about that is lit, of what all of that would
    /// bring. Places of the light are the same for all points, so that there is no noise.
    pub(super) fn light_of_share(
        &self,
        point: &SurfacePoint<'_>,
        look: &Look<'_>,
        front_normal: antumbra_geometry::DVec3,
        light: &AreaLight,
        exact: &VisibleFraction,
        work: &mut Work<'_>,
    ) -> Color {
        let start = ReceiverPoint {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };
        let is_back = self.lit_side(point) == Some(ReceiverSide::Back);
        let side_of = |target: &LightShape| {
            let side = self.index().occluders().light_side(&start, target);
            if is_back { -side } else { side }
        };
        let count = self.light_samples.max(1);
        let sum = (0..count)
            .filter_map(|number| {
                let place = SamplePattern::place(0, number);
                light.shape.sample(start.point, place)
            })
            .filter(|sample| side_of(&sample.target) > 0)
            .map(|sample| {
                let left = self.left_of(&sample.target, start.point);
                let share = share_of(light, &sample) * left;
                let glass = self.through_glass_towards(point, &sample.target, &mut work.tally);
                glass * share * local_term(look, point, front_normal, &sample.target)
            })
            .fold(Color::ZERO, |sum, term| sum + term);
        light.color * sum * (exact.fraction / exact.queried / f64::from(count))
    }

    /// Returns what the samples that reach a point bring.
    pub(super) fn light_of_area(
        &self,
        point: &SurfacePoint<'_>,
        look: &Look<'_>,
        front_normal: antumbra_geometry::DVec3,
        light: &AreaLight,
        Work { samples, tally, .. }: &mut Work<'_>,
    ) -> Color {
        let sum = samples
            .lit()
            .map(|sample| {
                let left = self.left_of(&sample.target, point.hit.point);
                let glass = self.through_glass_towards(point, &sample.target, tally);
                glass
                    * (share_of(light, sample) * left)
                    * local_term(look, point, front_normal, &sample.target)
            })
            .fold(Color::ZERO, |sum, term| sum + term);
        light.color * sum / f64::from(samples.total())
    }
}

/// Returns how much of the light's color a surface has that faces a sample, if all of the light were like it.
fn share_of(light: &AreaLight, sample: &AreaSample) -> f64 {
    match light.shape {
        AreaShape::SunDisc(_) => 1.0,
        // A sky of radiance 1 / pi all around gives open ground an irradiance of 1.
        AreaShape::Sky(_) => sample.solid_angle / std::f64::consts::PI,
        _ if light.falls_off => sample.solid_angle / std::f64::consts::PI,
        _ => sample.emitted,
    }
}
