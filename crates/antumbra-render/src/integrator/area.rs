//! Lights with size in one point: which samples reach it, and what they bring (Paper 9.3).

use antumbra::{Counters, LightSamples, LightSampling, ReceiverSide, ShadowCounters};
use antumbra_geometry::{AreaSample, AreaShape, Start};
use antumbra_scene::model::{AreaLight, Color, Facing};

use super::terms::local_term;
use super::{FINE, Integrator, SurfacePoint, Tally};
use crate::prepare::Look;

/// Which part of a light with size reaches a hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaQuery {
    /// All samples of the light.
    pub samples: u32,
    /// Those that the light shines from to the point, above the point's own plane.
    pub asked: u32,
    /// Of `asked`, those that reach it.
    pub lit: u32,
}

/// Region of a light's shadow that a point lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// No sample was asked: the point or the light faces away.
    FacingAway,
    /// No sample that was asked reaches the point.
    Umbra,
    /// Some do.
    Penumbra,
    /// All do.
    Lit,
}

impl AreaQuery {
    /// Returns the visible fraction, 0 to 1.
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.lit) / f64::from(self.samples.max(1))
    }

    /// Returns what the point is.
    pub fn region(&self) -> Region {
        match (self.asked, self.lit) {
            (0, _) => Region::FacingAway,
            (_, 0) => Region::Umbra,
            (asked, lit) if lit < asked => Region::Penumbra,
            _ => Region::Lit,
        }
    }
}

/// Counts of samples of lights with size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaTally {
    /// One per shaded hit and light with size.
    pub points: u64,
    /// Of `points`, those where no sample was asked.
    pub facing_away: u64,
    /// Of `points`, those that no sample reaches that was asked.
    pub umbra: u64,
    /// Of `points`, those that some samples reach that were asked.
    pub penumbra: u64,
    /// Of `points`, those that all samples reach that were asked.
    pub lit: u64,
    /// Samples of all points.
    pub samples: u64,
    /// Of `samples`, those that were asked.
    pub asked: u64,
    /// Of `asked`, those found blocked.
    pub blocked: u64,
}

impl AreaTally {
    pub(super) fn add(&mut self, other: &Self) {
        self.points += other.points;
        self.facing_away += other.facing_away;
        self.umbra += other.umbra;
        self.penumbra += other.penumbra;
        self.lit += other.lit;
        self.samples += other.samples;
        self.asked += other.asked;
        self.blocked += other.blocked;
    }

    fn count(&mut self, query: &AreaQuery) {
        self.points += 1;
        match query.region() {
            Region::FacingAway => self.facing_away += 1,
            Region::Umbra => self.umbra += 1,
            Region::Penumbra => self.penumbra += 1,
            Region::Lit => self.lit += 1,
        }
        self.samples += u64::from(query.samples);
        self.asked += u64::from(query.asked);
        self.blocked += u64::from(query.asked - query.lit);
    }
}

impl Integrator<'_> {
    /// Asks which samples of a light with size reach a point.
    pub(super) fn ask_area(
        &self,
        point: &SurfacePoint,
        light: usize,
        samples: &mut LightSamples,
        tally: &mut Tally,
    ) -> AreaQuery {
        let scene = self.prepared.scene();
        let start = Start {
            point: point.hit.point,
            surface: Some(point.hit.surface),
        };
        let side = match scene.facing {
            Facing::Winding => Some(ReceiverSide::Front),
            Facing::Viewer => match point.viewer_side {
                1.. => Some(ReceiverSide::Front),
                0 => None,
                _ => Some(ReceiverSide::Back),
            },
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
        if let Some(side) = side {
            let shape = &scene.area_lights[light].shape;
            let mut counters = Counters::default();
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
            query.asked = samples.asked().len() as u32;
            query.lit = samples.lit_count();
            // Lights without size have those for themselves.
            counters.shadow = ShadowCounters::default();
            tally.counters.add(&counters);
        }
        tally.area.count(&query);
        query
    }

    /// Returns what the samples that reach a point bring.
    pub(super) fn light_of_area(
        &self,
        point: &SurfacePoint,
        look: &Look<'_>,
        front_normal: antumbra_geometry::DVec3,
        light: &AreaLight,
        samples: &LightSamples,
    ) -> Color {
        let sum = samples
            .lit()
            .map(|sample| {
                share_of(light, sample) * local_term(look, point, front_normal, &sample.target)
            })
            .fold(Color::ZERO, |sum, term| sum + term);
        light.color * sum / f64::from(samples.total())
    }
}

/// Returns how much of the light's colour a surface has that faces a sample, if all of the light were like it.
fn share_of(light: &AreaLight, sample: &AreaSample) -> f64 {
    match light.shape {
        AreaShape::SunDisc(_) => 1.0,
        // A sky of radiance 1 / pi all around gives open ground an irradiance of 1.
        AreaShape::Sky(_) => sample.solid_angle / std::f64::consts::PI,
        _ if light.falls_off => sample.solid_angle / std::f64::consts::PI,
        _ => sample.emitted,
    }
}
