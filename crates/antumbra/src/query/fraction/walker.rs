//! Samples of a start that no value answers: by the corners of the light, a list, or a walk.
//!
//! In: a start, its samples, the light's corners and the leaves that hold what may block, as far as these are known. Out: a bit a
//! sample. Invariant: a bit is that of [`ShadowIndex::shadow`] for the sample (`README.md` of `crate::query::beam`).

use antumbra_geometry::{DVec3, LightShape, OwnRule, ReceiverPoint};

use crate::accel::bvh::{Block, Found, Memory, TARGETS, Whole};
use crate::occlusion::Corners;
use crate::query::beam::{AskedBlock, BadTargets};
use crate::{Counters, ShadowIndex};

/// Marks all targets and returns how many these are. Zero directions are nowhere: nothing hides them.
pub(super) fn fill(words: &mut [u64], targets: &[LightShape]) -> u64 {
    let nowhere = LightShape::Direction(DVec3::ZERO);
    let mut hidden = 0;
    for (targets, word) in targets.chunks(TARGETS).zip(words) {
        *word = 0;
        for (bit, target) in targets.iter().enumerate() {
            *word |= u64::from(*target != nowhere) << bit;
        }
        hidden += u64::from(word.count_ones());
    }
    hidden
}

/// A walker answers samples, start after start, and remembers what blocked the last ones.
pub(super) struct Walker {
    block: Block,
    memory: Memory,
    /// Last occluder of walks with whole lights.
    whole: Memory,
    found: Found,
    tries: Tries,
}

/// Whether the next start is told of the whole light: the more often nothing was told, the more starts are passed over.
#[derive(Default)]
struct Tries {
    in_vain: u32,
    passed_over: u32,
}

impl Tries {
    /// Most starts that are passed over, as a power of two.
    const MOST_IN_VAIN: u32 = 5;

    fn is_next(&mut self) -> bool {
        self.passed_over += 1;
        self.passed_over >= 1 << self.in_vain
    }

    fn note(&mut self, is_known: bool) {
        self.passed_over = 0;
        self.in_vain = match is_known {
            true => 0,
            false => Self::MOST_IN_VAIN.min(self.in_vain + 1),
        };
    }
}

impl Walker {
    /// Makes one for so many words a start.
    pub(super) fn new(stride: usize) -> Self {
        Self {
            block: Block::NONE,
            memory: Memory::new(stride),
            whole: Memory::new(1),
            found: Found::default(),
            tries: Tries::default(),
        }
    }

    /// Answers the samples of a start, by the corners of the light where they tell all, and by a list where there is one.
    pub(super) fn walk(
        &mut self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        targets: &[LightShape],
        (corners, leaves): (Option<&Corners>, Option<&[u32]>),
        words: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), BadTargets> {
        let count = match leaves {
            Some(_) => &mut counters.shadow.blocker_list,
            None => &mut counters.shadow.rays,
        };
        *count += targets.len() as u64;
        let told = match corners {
            Some(corners) if self.tries.is_next() => {
                let told = self.tell(index, start, (corners, leaves), counters);
                self.tries.note(told != Whole::Open);
                told
            }
            _ => Whole::Open,
        };
        let leaves = match told {
            Whole::Lit => {
                words.fill(0);
                return Ok(());
            }
            Whole::Dark => {
                counters.shadow.shadowed += fill(words, targets);
                return Ok(());
            }
            Whole::Found => Some(self.found.leaves()),
            Whole::Open => leaves,
        };
        for ((number, targets), word) in targets.chunks(TARGETS).enumerate().zip(words) {
            self.block.take(targets);
            if !self.block.is_fine() {
                return Err(BadTargets);
            }
            let asked = AskedBlock {
                targets,
                block: &self.block,
                number,
                mask: u64::MAX,
                leaves,
            };
            *word = index.occluded_block(start, &asked, &mut self.memory, counters);
            counters.shadow.shadowed += u64::from(word.count_ones());
        }
        Ok(())
    }

    /// Tells what it can of all of a light.
    fn tell(
        &mut self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        (corners, leaves): (&Corners, Option<&[u32]>),
        counters: &mut Counters,
    ) -> Whole {
        let near = &*index.parts.near;
        let hides_none =
            |rule: OwnRule<'_>| rule.surely_hides_none(&corners.targets, corners.slack);
        let Some(bvh) = index.bvh() else {
            return Whole::Open;
        };
        if !index.parts.is_whole() || !near.own_rule(start).is_none_or(hides_none) {
            return Whole::Open;
        }
        let of = (&corners.block, corners.slack_in_frame);
        let work = (&mut self.found, &mut self.whole);
        bvh.tell_whole((near, start), of, leaves, work, counters)
    }
}
