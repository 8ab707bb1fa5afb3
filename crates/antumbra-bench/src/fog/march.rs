//! Marches of shadow rays along segments.
//!
//! In: segments and a number of steps. Out: the steps as a batch of free queries with the exact rule's answers, ray after ray
//! or many rays side by side; and the reference, whose steps are compared with lit intervals.

use antumbra::{Counters, LightId, ShadowIndex};
use antumbra_baselines::Batch;
use antumbra_geometry::{DVec3, ReceiverPoint};
use rayon::prelude::*;

use super::segments::{Ends, SHARE_BITS, exact_place, jittered};

/// Segments whose rays lie side by side.
const SIDE_BY_SIDE: usize = 16;

/// In which order the steps of a march are asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// All steps of a segment, then those of the next: packets are points along one segment.
    Along,
    /// A step of 16 neighbouring segments, then their next: packets are points side by side.
    Across,
}

/// A march along many segments.
#[derive(Debug)]
pub(super) struct March {
    pub(super) batch: Batch,
    pub(super) is_shadowed: Vec<bool>,
    /// Segment of each step.
    segments: Vec<u32>,
    steps: u32,
}

impl March {
    /// Makes the steps and asks an index about them.
    pub(super) fn new(
        index: &ShadowIndex,
        segments: &[Ends],
        steps: u32,
        seed: u64,
        order: Order,
    ) -> Self {
        let points: Vec<Vec<ReceiverPoint>> = segments
            .iter()
            .enumerate()
            .map(|(number, &ends)| jittered(ends, number, steps, seed).collect())
            .collect();
        let width = match order {
            Order::Along => 1,
            Order::Across => SIDE_BY_SIDE,
        };
        let mut starts = Vec::with_capacity(segments.len() * steps as usize);
        let mut of_segments = Vec::with_capacity(starts.capacity());
        for (number, block) in points.chunks(width).enumerate() {
            for step in 0..steps as usize {
                for (within, points) in block.iter().enumerate() {
                    starts.push(points[step]);
                    of_segments.push((number * width + within) as u32);
                }
            }
        }
        let mut is_shadowed = vec![false; starts.len()];
        let chunks = starts.par_chunks(super::SLICE);
        let chunks = chunks.zip(is_shadowed.par_chunks_mut(super::SLICE));
        chunks.for_each(|(starts, is_shadowed)| ask(index, starts, is_shadowed));
        Self {
            batch: Batch {
                light: 0,
                light_shape: index.lights()[0],
                normals: vec![DVec3::ZERO; starts.len()],
                starts,
                is_coherent: true,
            },
            is_shadowed,
            segments: of_segments,
            steps,
        }
    }

    /// Returns the lit share of each segment.
    pub(super) fn lit_shares(&self) -> Vec<f64> {
        let count = self.segments.len() / self.steps as usize;
        let mut lit = vec![0_u32; count];
        for (&segment, &is_shadowed) in self.segments.iter().zip(&self.is_shadowed) {
            lit[segment as usize] += u32::from(!is_shadowed);
        }
        let share = |lit: u32| f64::from(lit) / f64::from(self.steps);
        lit.into_iter().map(share).collect()
    }
}

fn ask(index: &ShadowIndex, starts: &[ReceiverPoint], is_shadowed: &mut [bool]) {
    let light = LightId::from_index(0);
    index
        .shadows(starts, light, is_shadowed, &mut Counters::default())
        .expect("points of segments are fine starts");
}

/// Findings of a march of the exact rule in many steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Reference {
    /// Lit share of each segment.
    pub(super) lit_shares: Vec<f64>,
    pub(super) mismatches: u64,
    pub(super) at_ends: u64,
}

/// Marches in the middles of so many steps, a power of two, and compares each with lit intervals.
pub(super) fn reference(
    index: &ShadowIndex,
    segments: &[Ends],
    intervals: &[Vec<[f64; 2]>],
    steps: u32,
) -> Reference {
    let one = |(&ends, intervals): (&Ends, &Vec<[f64; 2]>)| {
        let share = |step: u32| (f64::from(step) + 0.5) / f64::from(steps);
        let starts: Vec<ReceiverPoint> = (0..steps)
            .map(|step| exact_place(ends, share(step)))
            .collect();
        let mut is_shadowed = vec![false; starts.len()];
        ask(index, &starts, &mut is_shadowed);
        let (mut mismatches, mut at_ends) = (0, 0);
        for (step, &is_shadowed) in (0..steps).zip(&is_shadowed) {
            match is_lit(intervals, share(step)) {
                Some(is_lit) => mismatches += u64::from(is_lit == is_shadowed),
                // The step may be on either side of the exact end: the rule beside it decides.
                None => {
                    at_ends += 1;
                    mismatches += u64::from(!agree_beside(index, ends, intervals, share(step)));
                }
            }
        }
        let lit = is_shadowed.iter().filter(|&&is_shadowed| !is_shadowed);
        (lit.count() as f64 / f64::from(steps), (mismatches, at_ends))
    };
    let (lit_shares, counts): (Vec<f64>, Vec<(u64, u64)>) =
        segments.par_iter().zip(intervals).map(one).unzip();
    Reference {
        lit_shares,
        mismatches: counts.iter().map(|(mismatches, _)| mismatches).sum(),
        at_ends: counts.iter().map(|(_, at_ends)| at_ends).sum(),
    }
}

/// Returns whether lit intervals have a place lit; `None` at their ends.
fn is_lit(intervals: &[[f64; 2]], place: f64) -> Option<bool> {
    let is_end = intervals.as_flattened().contains(&place);
    let is_inside = |&[begin, end]: &[f64; 2]| begin < place && place < end;
    (!is_end).then(|| intervals.iter().any(is_inside))
}

/// Returns whether the nearest exact places on both sides of one are as lit intervals have them.
fn agree_beside(index: &ShadowIndex, ends: Ends, intervals: &[[f64; 2]], place: f64) -> bool {
    let room = 1.0 / f64::from(1 << SHARE_BITS);
    [place - room, place + room].into_iter().all(|place| {
        let mut is_shadowed = [false];
        ask(index, &[exact_place(ends, place)], &mut is_shadowed);
        is_lit(intervals, place).is_none_or(|is_lit| is_lit != is_shadowed[0])
    })
}
