//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{LightShape, Occluders, Start};

use crate::bvh::Bvh;
use crate::occlusion::{Account, AdaptiveValues, BLOCK, Found, Scene, Store, cost_of_rays};
use crate::{Answer, Counters, Decided, QueryError};

/// What queries are answered by.
pub(crate) struct ByVoxel<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
    pub(crate) values: &'a AdaptiveValues,
    pub(crate) light_number: usize,
    pub(crate) light: &'a LightShape,
}

/// After so many queries of a batch what they cost is noted.
const NOTED: usize = 64 * BLOCK;

/// One query or block in so many says what using lists has cost, for all of them.
const SAMPLED: u32 = 16;

impl ByVoxel<'_> {
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
        let chunks = starts.chunks(NOTED).zip(is_shadowed.chunks_mut(NOTED));
        for (starts, is_shadowed) in chunks {
            let before = *counters;
            match self.values.store() {
                Some(store) => self.answer_some(&store, starts, is_shadowed, counters, &check)?,
                None => {
                    for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                        check(start)?;
                        *is_shadowed = self.is_blocked(start, counters);
                        counters.shadow.shadowed += u64::from(*is_shadowed);
                        counters.shadow.rays += 1;
                    }
                    continue;
                }
            }
            if !self.values.is_refining() {
                continue;
            }
            let ray_count = counters.shadow.rays - before.shadow.rays;
            let account = Account {
                ray_count,
                rays_ns: cost_of_rays(&before, counters, ray_count),
                answered: starts.len() as u64 - ray_count,
            };
            self.values
                .note(self.occluders, self.light_number, &account);
        }
        Ok(())
    }

    #[inline]
    fn answer_some(
        &self,
        store: &Store,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let (mut shadowed_count, mut list_count, mut ray_count) = (0, 0, 0);
        for (starts, is_shadowed) in starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK)) {
            let looked = self
                .values
                .find(store, self.occluders, starts, self.light_number);
            let found = &looked.found;
            for (is_shadowed, found) in is_shadowed.iter_mut().zip(found) {
                *is_shadowed = found.is_shadowed();
            }
            // What is beyond the starts is as nothing found.
            shadowed_count += Found::count(found, Found::is_shadowed);
            let listed_here = Found::count(found, Found::is_by_list);
            list_count += listed_here;
            if listed_here > 0 && is_sampled(&starts[0]) {
                for (number, start) in starts.iter().enumerate() {
                    if found[number].is_by_list() {
                        self.charge_list(store, start, looked.places[number]);
                    }
                }
            }
            let unknown_count = Found::count(found, Found::is_nothing);
            if unknown_count as usize == BLOCK - starts.len() {
                continue;
            }
            for (number, start) in starts.iter().enumerate() {
                if found[number].is_nothing() {
                    check(start)?;
                    is_shadowed[number] =
                        self.is_blocked_at(store, start, looked.places[number], counters);
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
        let Some(store) = self.values.store() else {
            return Answer::new(self.is_blocked(start, counters), Decided::Ray);
        };
        let looked = self.values.find(
            &store,
            self.occluders,
            std::slice::from_ref(start),
            self.light_number,
        );
        let (found, place) = (looked.found[0], looked.places[0]);
        let before = *counters;
        let answer = if found.is_nothing() {
            let is_blocked = self.is_blocked_at(&store, start, place, counters);
            Answer::new(is_blocked, Decided::Ray)
        } else if found.is_by_list() {
            Answer::new(found.is_shadowed(), Decided::BlockerList)
        } else {
            Answer::new(found.is_shadowed(), Decided::FirstPass)
        };
        if is_sampled(start) && self.values.is_refining() {
            if found.is_by_list() {
                self.charge_list(&store, start, place);
            }
            let ray_count = u64::from(found.is_nothing()) * u64::from(SAMPLED);
            let account = Account {
                ray_count,
                rays_ns: u64::from(SAMPLED) * cost_of_rays(&before, counters, ray_count.min(1)),
                answered: u64::from(SAMPLED) - ray_count,
            };
            self.values
                .note(self.occluders, self.light_number, &account);
        }
        answer
    }

    /// Answers by a ray, which the cell pays for whose link stands at a place.
    fn is_blocked_at(
        &self,
        store: &Store,
        start: &Start,
        place: u32,
        counters: &mut Counters,
    ) -> bool {
        let before = *counters;
        let is_blocked = self.is_blocked(start, counters);
        if place != 0 && self.values.is_refining() {
            let cost = cost_of_rays(&before, counters, 1);
            self.charge(store, start, place, cost);
        }
        is_blocked
    }

    #[cold]
    #[inline(never)]
    fn charge_list(&self, store: &Store, start: &Start, place: u32) {
        if place != 0 && self.values.is_refining() {
            let cost = self.values.cost_of_list(store, place);
            self.charge(store, start, place, cost * u64::from(SAMPLED));
        }
    }

    fn charge(&self, store: &Store, start: &Start, place: u32, cost_ns: u64) {
        let scene = Scene {
            occluders: self.occluders,
            bvh: self.bvh,
        };
        self.values
            .charge(store, &scene, self.light_number, start, place, cost_ns);
    }

    fn is_blocked(&self, start: &Start, counters: &mut Counters) -> bool {
        super::by_bvh(self.occluders, self.bvh, start, self.light, counters).shadow
            == crate::Shadow::Shadowed
    }
}

/// One in [`SAMPLED`] starts, by the last bits of its point (Knuth's multiplicative hash).
fn is_sampled(start: &Start) -> bool {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let bits = start.point.x.to_bits() ^ start.point.y.to_bits().rotate_left(32);
    bits.wrapping_mul(FACTOR) >> 60 == 0
}
