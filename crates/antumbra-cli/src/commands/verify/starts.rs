//! Where queries of `verify` start.
//!
//! In: a number and a seed. Out: a start, a pure function of both and the scene. The kinds take
//! turns; where a kind has no point (no triangle, nothing seen), a free point stands in.

use antumbra_geometry::{Bounds, ReceiverPoint, SurfaceId};
use antumbra_scene::gather::Gathered;

use super::random::Random;
use super::surfaces::Surfaces;

/// Returns start number `number`.
pub(super) fn start(number: u64, seed: u64, surfaces: &Surfaces<'_>) -> ReceiverPoint {
    let mut random = Random::new(seed, number);
    let bounds = surfaces.reach;
    let gathered = surfaces.gathered;
    let surface = surfaces.any(&mut random);
    let on_surface = match number % 10 {
        0..=3 => seen(&mut random, &bounds, surfaces),
        4..=5 => surface.and_then(|surface| surfaces.point_on(&mut random, surface)),
        6 => surface.and_then(|surface| on_edge(&mut random, surface, gathered)),
        7 => surface.and_then(|surface| on_vertex(&mut random, surface, gathered)),
        8 => surface
            .and_then(|surface| on_vertex(&mut random, surface, gathered))
            .map(|start| ReceiverPoint {
                surface: None,
                ..start
            }),
        _ => None,
    };
    on_surface.unwrap_or_else(|| ReceiverPoint {
        point: random.in_box(&bounds),
        surface: None,
    })
}

/// Returns the point that a random view sees: an eye around the scene looks at some point of it.
fn seen(random: &mut Random, bounds: &Bounds, surfaces: &Surfaces<'_>) -> Option<ReceiverPoint> {
    let aim = random.in_box(bounds);
    let distance = (0.2 + 1.3 * random.draw()) * bounds.size().length();
    let eye = bounds.center() + distance * random.direction();
    surfaces.cast(eye, aim - eye, None)
}

/// Returns a point on an edge of a triangle, rounded; inner edges of polygons count.
fn on_edge(random: &mut Random, surface: SurfaceId, gathered: &Gathered) -> Option<ReceiverPoint> {
    let corners = gathered.occluders().triangle_positions(surface)?;
    let edge = random.below(3);
    let [from, to] = [corners[edge], corners[(edge + 1) % 3]];
    Some(ReceiverPoint {
        point: from + random.draw() * (to - from),
        surface: Some(surface),
    })
}

/// Returns a corner of a triangle, exactly.
fn on_vertex(
    random: &mut Random,
    surface: SurfaceId,
    gathered: &Gathered,
) -> Option<ReceiverPoint> {
    let corners = gathered.occluders().triangle_positions(surface)?;
    Some(ReceiverPoint {
        point: corners[random.below(3)],
        surface: Some(surface),
    })
}
