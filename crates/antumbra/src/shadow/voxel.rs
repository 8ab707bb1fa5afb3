//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{Occluders, Start};

use crate::occlusion::{AdaptiveValues, BLOCK, Found};
use crate::{Answer, Counters, Decided, QueryError};

/// What queries are answered by.
pub(crate) struct ByVoxel<'a, F> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) values: &'a AdaptiveValues,
    pub(crate) light_number: usize,
    /// Casts a ray, own rule and all.
    pub(crate) is_blocked: F,
}

impl<F: Fn(&Start, &mut Counters) -> bool> ByVoxel<'_, F> {
    /// Answers queries by the value or the list of the start's voxel where there is one, by a ray where
    /// not. `check` says what is no start.
    #[inline]
    pub(crate) fn answer(
        &self,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let (mut shadowed_count, mut list_count, mut ray_count) = (0, 0, 0);
        for (starts, is_shadowed) in starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK)) {
            let found = self.values.find(self.occluders, starts, self.light_number);
            for (is_shadowed, found) in is_shadowed.iter_mut().zip(&found) {
                *is_shadowed = found.is_shadowed();
            }
            // What is beyond the starts is as nothing found.
            shadowed_count += Found::count(&found, Found::is_shadowed);
            list_count += Found::count(&found, Found::is_by_list);
            let unknown_count = Found::count(&found, Found::is_nothing);
            if unknown_count as usize == BLOCK - starts.len() {
                continue;
            }
            for (number, start) in starts.iter().enumerate() {
                if found[number].is_nothing() {
                    check(start)?;
                    is_shadowed[number] = (self.is_blocked)(start, counters);
                    shadowed_count += u64::from(is_shadowed[number]);
                    ray_count += 1;
                }
            }
        }
        counters.shadow.first_pass += starts.len() as u64 - list_count - ray_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.rays += ray_count;
        counters.shadow.shadowed += shadowed_count;
        Ok(())
    }

    /// Answers one query.
    pub(crate) fn answer_one(&self, start: &Start, counters: &mut Counters) -> Answer {
        let [found, ..] = self.values.find(
            self.occluders,
            std::slice::from_ref(start),
            self.light_number,
        );
        if found.is_nothing() {
            Answer::new((self.is_blocked)(start, counters), Decided::Ray)
        } else if found.is_by_list() {
            Answer::new(found.is_shadowed(), Decided::BlockerList)
        } else {
            Answer::new(found.is_shadowed(), Decided::FirstPass)
        }
    }
}
