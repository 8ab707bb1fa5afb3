//! Starts in tiles of at most 64 that lie near each other, on one triangle where it has many.
//!
//! In: starts. Out: tiles. Invariant: each start is in one tile.

use antumbra_geometry::{DVec3, ReceiverPoint};

use crate::ReceiverSide;
use crate::accel::bvh::TARGETS;

/// A triangle with as many starts has tiles of its own.
const MANY: usize = 12;

/// As few starts are not parted further, however far they are from each other.
pub(super) const FEW: usize = 7;

/// Calls with the numbers of the starts of each tile, whose box is at most `near` long unless they are few, and with whether all are on one surface and are asked about one of its
/// sides.
pub(super) fn tiles(
    starts: &[ReceiverPoint],
    sides: &[ReceiverSide],
    near: f64,
    mut take: impl FnMut(&[u32], bool),
) {
    let mut order: Vec<u32> = (0..starts.len() as u32).collect();
    let kind_of = |number: &u32| {
        let side = match sides[*number as usize] {
            ReceiverSide::Front => Some(0),
            ReceiverSide::Back => Some(1),
            ReceiverSide::Both => Some(2),
            ReceiverSide::Normal(_) => None,
        };
        starts[*number as usize].surface.zip(side)
    };
    order.sort_by_key(kind_of);
    let mut others = Vec::new();
    for run in order.chunk_by_mut(|a, b| kind_of(a) == kind_of(b)) {
        if kind_of(&run[0]).is_none() || run.len() < MANY {
            others.extend_from_slice(run);
        } else {
            part(starts, run, near, &mut |tile| take(tile, true));
        }
    }
    part(starts, &mut others, near, &mut |tile| take(tile, false));
}

/// Halves the longest side until few are left, and these near each other.
fn part(starts: &[ReceiverPoint], numbers: &mut [u32], near: f64, take: &mut impl FnMut(&[u32])) {
    if numbers.is_empty() {
        return;
    }
    let point = |number: &u32| starts[*number as usize].point;
    let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for number in &*numbers {
        least = least.min(point(number));
        most = most.max(point(number));
    }
    let size = most - least;
    let is_near = size.max_element() <= near || numbers.len() <= FEW;
    if numbers.len() <= TARGETS && is_near {
        take(numbers);
        return;
    }
    let axis = (0..3).fold(0, |axis, other| {
        if size[other] > size[axis] {
            other
        } else {
            axis
        }
    });
    let half = numbers.len() / 2;
    numbers.select_nth_unstable_by(half, |a, b| {
        let of = |number: &u32| point(number)[axis];
        of(a).total_cmp(&of(b)).then(a.cmp(b))
    });
    let (low, high) = numbers.split_at_mut(half);
    part(starts, low, near, take);
    part(starts, high, near, take);
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::SurfaceId;

    use super::*;

    #[test]
    fn every_start_is_in_one_tile() {
        let starts: Vec<ReceiverPoint> = (0..777)
            .map(|i| ReceiverPoint {
                point: DVec3::new(f64::from(i % 31), f64::from(i % 7), 0.0),
                surface: (i % 5 != 0).then_some(SurfaceId(if i < 300 { 4 } else { i as u32 })),
            })
            .collect();
        let sides = [ReceiverSide::Front, ReceiverSide::Back]
            .into_iter()
            .cycle();
        let sides: Vec<ReceiverSide> = sides.take(starts.len()).collect();
        let mut seen = vec![0; starts.len()];
        let mut of_one = 0;
        tiles(&starts, &sides, 100.0, |tile, is_one| {
            assert!((1..=TARGETS).contains(&tile.len()));
            let of = |number: u32| (starts[number as usize].surface, sides[number as usize]);
            for &number in tile {
                seen[number as usize] += 1;
                assert!(!is_one || of(number) == of(tile[0]));
            }
            of_one += if is_one { tile.len() } else { 0 };
        });
        assert!(seen.iter().all(|&count| count == 1));
        assert_eq!(of_one, 240);
    }
}
