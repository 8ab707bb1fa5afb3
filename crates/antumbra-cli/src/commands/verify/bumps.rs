//! Knowledge of our methods about points above surfaces before they are asked: where surfaces have bumps ("Bumps" in EXACTNESS.md).
//!
//! In: a start on a surface, a light. Out: how many methods know all answers up to a height, and how many of them are wrong
//! about a point between. Invariant: the point is a function of query and scene.

use antumbra::{LightId, Shadow};
use antumbra_geometry::{DVec3, ReceiverPoint};

use super::candidate::{Candidate, VALID};
use super::random::Random;
use super::surfaces::Surfaces;

/// Bumps are up to this share of the scene's size high.
const HIGHEST: f64 = 1.0 / 64.0;

/// Answers of methods about one start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// Those that took it to be in a full or null region.
    pub(super) known: u64,
    /// Of these, those whose answer is not the judge's at the lifted point.
    pub(super) differences: u64,
}

/// Asks methods of our own about a start on a surface with some relief. `judge` answers for a point.
pub(super) fn ask(
    start: &ReceiverPoint,
    light: LightId,
    surfaces: &Surfaces<'_>,
    candidates: &[Candidate],
    random: &mut Random,
    judge: impl FnOnce(&ReceiverPoint) -> Shadow,
) -> Found {
    let mut found = Found::default();
    let Some(surface) = start.surface else {
        return found;
    };
    let occluders = surfaces.index.occluders();
    let side = surfaces.index.light_side(start, light).expect(VALID);
    let normal = f64::from(side.signum()) * occluders.normal_at(surface, start.point);
    let height = random.draw() * random.draw() * HIGHEST * surfaces.size;
    let lifted = |share: f64| start.point + (share * height) * normal;
    let [from, to] = [1.0 / 64.0, 1.0].map(lifted);
    let lifted = lifted(random.draw().max(1.0 / 64.0));
    let is_point = |point: DVec3| point.abs().max_element() < 1e30;
    if side == 0 || ![from, to, lifted].into_iter().all(is_point) {
        return found;
    }
    let own = candidates.iter().filter(|other| other.stand_in.is_none());
    let known = own.filter_map(|candidate| {
        let known = candidate.index.known_between(from, to, light);
        known.expect(VALID)
    });
    let known: Vec<Shadow> = known.collect();
    if known.is_empty() {
        return found;
    }
    let expected = judge(&ReceiverPoint {
        point: lifted,
        surface: None,
    });
    found.known = known.len() as u64;
    found.differences = known.iter().filter(|&&known| known != expected).count() as u64;
    found
}
