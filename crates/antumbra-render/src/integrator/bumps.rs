//! Shadows where surfaces have a relief (Paper 7.2).
//!
//! In: a point with a relief, a light in front of it. Out: whether the light reaches it, and counts. Invariant: the answer is that
//! of the free query of EXACTNESS.md ("Bumps"). It is not asked, nor is its start worked out, where all starts that it may
//! have are known to be lit, or in shadow: near the borders of shadows only.

use antumbra::{Answer, Decided, Shadow};
use antumbra_geometry::ReceiverPoint;

use super::{FINE, Integrator, SurfacePoint, Tally};
use crate::prepare::Relief;

impl Integrator<'_> {
    /// Asks whether a light reaches a point with a relief, on the side of its surface where the light is.
    pub(super) fn ask_bumped(
        &self,
        point: &SurfacePoint<'_>,
        relief: &Relief<'_>,
        side: i8,
        light: usize,
        tally: &mut Tally,
    ) -> Answer {
        let (place, normal) = (point.hit.point, point.geometric_normal);
        let normal = if side < 0 { -normal } else { normal };
        tally.bumps.queries += 1;
        let reach = relief.reach(place, normal);
        let known = self.prepared.known_between(reach, light).expect(FINE);
        if let Some(shadow) = known {
            let answer = Answer {
                shadow,
                decided: Decided::FirstPass,
            };
            match shadow {
                Shadow::Lit => tally.bumps.known_lit += 1,
                Shadow::Shadowed => tally.bumps.known_shadowed += 1,
            }
            tally.counters.shadow.first_pass += 1;
            tally.counters.shadow.shadowed += u64::from(shadow == Shadow::Shadowed);
            return answer;
        }
        tally.bumps.perturbed += 1;
        let start = ReceiverPoint {
            point: relief.lifted(place, normal, relief.share(place)),
            surface: None,
        };
        self.prepared
            .shadow(&start, light, &mut tally.counters, &mut tally.candidates)
            .expect(FINE)
    }
}
