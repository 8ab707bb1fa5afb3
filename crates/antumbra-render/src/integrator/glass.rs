//! Light through see-through surfaces: the shares of each color that they leave (Paper 6.3).
//!
//! In: a point that a light reaches but for glass. Out: factors of its color. Invariant: they are those of
//! `ShadowIndex::transmittance`, so the same for every method.

use antumbra::LightId;
use antumbra_geometry::{LightShape, ReceiverPoint};
use antumbra_scene::model::Color;

use super::{FINE, Integrator, SurfacePoint, Tally, Work};

impl Integrator<'_> {
    /// Returns what glass leaves of a light without size.
    pub(super) fn through_glass(
        &self,
        point: &SurfacePoint<'_>,
        light: usize,
        work: &mut Work<'_>,
    ) -> Color {
        if !self.asks_glass() {
            return Color::ONE;
        }
        let counters = &mut work.tally.counters;
        let light = LightId::from_index(light);
        let shares = self
            .index()
            .filtered_from(&start_of(point), light, counters);
        Color::from_array(shares.expect(FINE))
    }

    /// Returns what glass leaves of a sample of a light with size.
    pub(super) fn through_glass_towards(
        &self,
        point: &SurfacePoint<'_>,
        target: &LightShape,
        tally: &mut Tally,
    ) -> Color {
        if !self.asks_glass() {
            return Color::ONE;
        }
        let counters = &mut tally.counters;
        let shares = self
            .index()
            .filtered_towards(&start_of(point), target, counters);
        Color::from_array(shares.expect(FINE))
    }

    fn asks_glass(&self) -> bool {
        self.has_colored_shadows && self.index().has_glass()
    }
}

fn start_of(point: &SurfacePoint<'_>) -> ReceiverPoint {
    ReceiverPoint {
        point: point.hit.point,
        surface: Some(point.hit.surface),
    }
}
