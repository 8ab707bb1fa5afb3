//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{LightShape, Occluders, Start};

use crate::bvh::Bvh;
use crate::occlusion::{AdaptiveValues, BLOCK, Known};
use crate::{Answer, Counters, Decided};

/// What queries are answered by.
pub(crate) struct ByVoxel<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
    pub(crate) values: &'a AdaptiveValues,
    pub(crate) light_number: usize,
    pub(crate) light: &'a LightShape,
}

impl ByVoxel<'_> {
    /// Answers queries by the value or the list of the start's voxel where there is one, by a ray where
    /// not, and gives each answer with its place.
    #[inline]
    pub(crate) fn answer(
        &self,
        starts: &[Start],
        counters: &mut Counters,
        mut give: impl FnMut(usize, Answer),
    ) {
        let mut known = [Known::Nothing; BLOCK];
        for (block, starts) in starts.chunks(BLOCK).enumerate() {
            self.values
                .get(self.occluders, starts, self.light_number, &mut known);
            for ((place, start), known) in starts.iter().enumerate().zip(&known) {
                give(
                    block * BLOCK + place,
                    self.answer_known(start, *known, counters),
                );
            }
        }
    }

    #[inline]
    fn answer_known(&self, start: &Start, known: Known, counters: &mut Counters) -> Answer {
        // Values speak of starts that no own rule shadows.
        let has_own_rule = start
            .surface
            .is_some_and(|own| self.occluders.has_own_rule(own));
        if has_own_rule
            && self
                .occluders
                .own_rule_blocks(&self.occluders.segment(start, self.light))
        {
            return Answer::new(true, Decided::FirstPass);
        }
        match known {
            Known::Value(is_shadowed) => Answer::new(is_shadowed, Decided::FirstPass),
            Known::List(is_shadowed) => Answer::new(is_shadowed, Decided::BlockerList),
            Known::Nothing => {
                let is_shadowed = self
                    .bvh
                    .any_hit(self.occluders, start, self.light, counters);
                Answer::new(is_shadowed, Decided::Ray)
            }
        }
    }
}
