//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{Occluders, Start};

use super::order::{self, Order, WINDOW};
use crate::bvh::Bvh;
use crate::clock::Reading;
use crate::occlusion::{
    Account, AdaptiveValues, BLOCK, Found, Looks, MANY, Packed, SCOUTS, Scene, Store, cost_of_rays,
};
use crate::{Answer, Counters, Decided, QueryError};

/// Who answers what values do not know, own rules and all.
pub(crate) trait Rays {
    /// Returns whether an opaque surface blocks a start's segment.
    fn is_blocked(&self, start: &Start, counters: &mut Counters) -> bool;

    /// Tells the same of many starts.
    fn are_blocked(&self, starts: &[Start], is_blocked: &mut [bool], counters: &mut Counters) {
        for (start, is_blocked) in starts.iter().zip(is_blocked) {
            *is_blocked = self.is_blocked(start, counters);
        }
    }
}

impl<F: Fn(&Start, &mut Counters) -> bool> Rays for F {
    fn is_blocked(&self, start: &Start, counters: &mut Counters) -> bool {
        self(start, counters)
    }
}

/// What queries are answered by.
pub(crate) struct ByVoxel<'a, R> {
    pub(crate) occluders: &'a Occluders,
    /// What values are made with.
    pub(crate) bvh: Option<&'a Bvh>,
    pub(crate) values: &'a AdaptiveValues,
    pub(crate) light_number: usize,
    pub(crate) rays: R,
}

/// After so many queries of a batch what they cost is noted.
const NOTED: usize = 64 * BLOCK;

/// One query or block in so many says what using lists has cost, for all of them.
const SAMPLED: u64 = 16;

impl<R: Rays> ByVoxel<'_, R> {
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
        if !order::is_scattered(self.values, starts) {
            return self.answer_in_order(starts, is_shadowed, counters, check);
        }
        let mut order = Order::new();
        let mut near = Vec::with_capacity(NOTED);
        let mut found = [false; NOTED];
        for (starts, is_shadowed) in starts.chunks(WINDOW).zip(is_shadowed.chunks_mut(WINDOW)) {
            for numbers in order.of(self.values, starts).chunks(NOTED) {
                near.clear();
                near.extend(numbers.iter().map(|&number| starts[number as usize]));
                let found = &mut found[..near.len()];
                if let Err(error) = self.answer_in_order(&near, found, counters, &check) {
                    // The first in the caller's order.
                    starts.iter().try_for_each(&check)?;
                    return Err(error);
                }
                for (&number, &found) in numbers.iter().zip(&*found) {
                    is_shadowed[number as usize] = found;
                }
            }
        }
        Ok(())
    }

    #[inline]
    fn answer_in_order(
        &self,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        if let Some(packed) = self.values.packed(self.light_number) {
            return self.answer_packed(packed, starts, is_shadowed, counters, check);
        }
        let is_refining = self.values.is_refining();
        let store = self.values.store();
        let chunks = starts.chunks(NOTED).zip(is_shadowed.chunks_mut(NOTED));
        for (starts, is_shadowed) in chunks {
            let before = *counters;
            let begin = is_refining.then(Reading::now);
            let looks = match &store {
                Some(_) => self.values.looks(self.light_number, is_refining),
                None => Looks::None,
            };
            let (mut looked_count, mut made) = (0, 0);
            match (&store, looks) {
                (Some(store), Looks::All) => {
                    looked_count = starts.len();
                    made = self.answer_some(store, starts, is_shadowed, counters, 1, &check)?;
                }
                (Some(store), Looks::Scouts) => {
                    // Blocks here and there, by the chunk's first point.
                    let first = hash(&starts[0]) % SCOUTS;
                    let blocks = starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK));
                    for ((starts, is_shadowed), number) in blocks.zip(first..) {
                        if number.is_multiple_of(SCOUTS) {
                            looked_count += starts.len();
                            made += self.answer_some(
                                store,
                                starts,
                                is_shadowed,
                                counters,
                                SCOUTS,
                                &check,
                            )?;
                        } else {
                            self.answer_by_rays(starts, is_shadowed, counters, &check)?;
                        }
                    }
                }
                (None, _) | (_, Looks::None) => {
                    self.answer_by_rays(starts, is_shadowed, counters, &check)?;
                }
            }
            if let Some(begin) = begin {
                let ray_count = counters.shadow.rays - before.shadow.rays;
                let account = Account {
                    query_count: starts.len() as u64,
                    ray_count,
                    rays_ns: cost_of_rays(&before, counters, ray_count),
                    looked_count: looked_count as u64,
                    took: Some(begin.elapsed_ns().saturating_sub(made)),
                };
                self.values
                    .note(self.occluders, self.light_number, &account);
            }
        }
        Ok(())
    }

    /// Answers by values that are all made.
    #[inline]
    fn answer_packed(
        &self,
        packed: &Packed,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let (mut shadowed_count, mut list_count, mut ray_count) = (0_u64, 0_u64, 0_u64);
        for (starts, is_shadowed) in starts.chunks(MANY).zip(is_shadowed.chunks_mut(MANY)) {
            let (occluders, light) = (self.occluders, self.light_number);
            let told = self
                .values
                .find_many(packed, occluders, starts, light, is_shadowed);
            shadowed_count += u64::from(told.shadowed.count_ones());
            list_count += u64::from(told.listed.count_ones());
            ray_count += u64::from(told.unknown.count_ones());
            let mut unknown = told.unknown;
            while unknown != 0 {
                let number = unknown.trailing_zeros() as usize;
                unknown &= unknown - 1;
                check(&starts[number])?;
                is_shadowed[number] = self.rays.is_blocked(&starts[number], counters);
                shadowed_count += u64::from(is_shadowed[number]);
            }
        }
        counters.shadow.first_pass += starts.len() as u64 - list_count - ray_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.rays += ray_count;
        counters.shadow.shadowed += shadowed_count;
        Ok(())
    }

    fn answer_by_rays(
        &self,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        starts.iter().try_for_each(check)?;
        self.rays.are_blocked(starts, is_shadowed, counters);
        let shadowed = is_shadowed.iter().filter(|&&is_shadowed| is_shadowed);
        counters.shadow.shadowed += shadowed.count() as u64;
        counters.shadow.rays += starts.len() as u64;
        Ok(())
    }

    /// Answers queries of a chunk, each of which stands for so many; returns what the making of values took
    /// meanwhile, in nanoseconds.
    #[inline]
    fn answer_some(
        &self,
        store: &Store,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        weight: u64,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<u64, QueryError> {
        let mut made = 0;
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
            if listed_here > 0 && hash(&starts[0]).is_multiple_of(SAMPLED) {
                for (number, start) in starts.iter().enumerate() {
                    if found[number].is_by_list() {
                        let place = looked.places[number];
                        made += self.charge_list(store, start, place, weight);
                    }
                }
            }
            let unknown_count = Found::count(found, Found::is_nothing);
            if unknown_count as usize == BLOCK - starts.len() {
                continue;
            }
            let mut unknown = [0_usize; BLOCK];
            let mut asked = [starts[0]; BLOCK];
            let mut count = 0;
            for (number, start) in starts.iter().enumerate() {
                if found[number].is_nothing() {
                    check(start)?;
                    (unknown[count], asked[count]) = (number, *start);
                    count += 1;
                }
            }
            let mut blocked = [false; BLOCK];
            let (asked, blocked) = (&asked[..count], &mut blocked[..count]);
            let before = *counters;
            self.rays.are_blocked(asked, blocked, counters);
            let cost = cost_of_rays(&before, counters, count as u64) / count as u64;
            for (i, &number) in unknown[..count].iter().enumerate() {
                is_shadowed[number] = blocked[i];
                shadowed_count += u64::from(blocked[i]);
                made += self.charge_ray(store, &asked[i], looked.places[number], cost * weight);
            }
            ray_count += count as u64;
        }
        counters.shadow.first_pass += starts.len() as u64 - list_count - ray_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.rays += ray_count;
        counters.shadow.shadowed += shadowed_count;
        Ok(made)
    }

    /// Answers one query.
    pub(crate) fn answer_one(&self, start: &Start, counters: &mut Counters) -> Answer {
        if let Some(packed) = self.values.packed(self.light_number) {
            let (occluders, light) = (self.occluders, self.light_number);
            let found = self.values.find_packed(packed, occluders, start, light);
            return if found.is_nothing() {
                Answer::new(self.rays.is_blocked(start, counters), Decided::Ray)
            } else {
                Answer::new(found.is_shadowed(), found.decided())
            };
        }
        let is_refining = self.values.is_refining();
        let store = self.values.store();
        let looks = self.values.looks(self.light_number, is_refining);
        let hash = hash(start);
        let is_sampled = is_refining && hash.is_multiple_of(SAMPLED);
        let (is_looked_up, weight) = match looks {
            Looks::None => (false, 1),
            // Other ones than those that are sampled.
            Looks::Scouts => ((hash / SAMPLED).is_multiple_of(SCOUTS), SCOUTS),
            Looks::All => (true, 1),
        };
        let before = *counters;
        let answer = match store.filter(|_| is_looked_up) {
            Some(store) => self.look_up_one(&store, start, weight, is_sampled, counters),
            None => Answer::new(self.rays.is_blocked(start, counters), Decided::Ray),
        };
        if is_sampled {
            let is_ray = u64::from(answer.decided == Decided::Ray);
            let account = Account {
                query_count: SAMPLED,
                ray_count: SAMPLED * is_ray,
                rays_ns: SAMPLED * cost_of_rays(&before, counters, is_ray),
                looked_count: SAMPLED * u64::from(is_looked_up),
                took: None,
            };
            self.values
                .note(self.occluders, self.light_number, &account);
        }
        answer
    }

    fn look_up_one(
        &self,
        store: &Store,
        start: &Start,
        weight: u64,
        is_sampled: bool,
        counters: &mut Counters,
    ) -> Answer {
        let (found, place) = self
            .values
            .find_one(store, self.occluders, start, self.light_number);
        if found.is_nothing() {
            let (is_blocked, _) = self.is_blocked_at(store, start, place, weight, counters);
            Answer::new(is_blocked, Decided::Ray)
        } else {
            if found.is_by_list() && is_sampled {
                self.charge_list(store, start, place, weight);
            }
            Answer::new(found.is_shadowed(), found.decided())
        }
    }

    /// Answers by a ray, which the cell pays for whose link stands at a place; and returns what the making
    /// of values took, in nanoseconds.
    fn is_blocked_at(
        &self,
        store: &Store,
        start: &Start,
        place: u32,
        weight: u64,
        counters: &mut Counters,
    ) -> (bool, u64) {
        let before = *counters;
        let is_blocked = self.rays.is_blocked(start, counters);
        let cost = cost_of_rays(&before, counters, 1);
        let made = self.charge_ray(store, start, place, cost * weight);
        (is_blocked, made)
    }

    /// Lets a cell pay for a ray, and returns what the making of values took, in nanoseconds.
    fn charge_ray(&self, store: &Store, start: &Start, place: u32, cost_ns: u64) -> u64 {
        if place == 0 || !self.values.is_refining() {
            return 0;
        }
        self.charge(store, start, place, cost_ns)
    }

    #[cold]
    #[inline(never)]
    fn charge_list(&self, store: &Store, start: &Start, place: u32, weight: u64) -> u64 {
        if place == 0 || !self.values.is_refining() {
            return 0;
        }
        let cost = self.values.cost_of_list(store, place);
        self.charge(store, start, place, cost * SAMPLED * weight)
    }

    /// Returns what the making of values took, in nanoseconds.
    fn charge(&self, store: &Store, start: &Start, place: u32, cost_ns: u64) -> u64 {
        let Some(bvh) = self.bvh else {
            return 0;
        };
        let scene = Scene {
            occluders: self.occluders,
            bvh,
        };
        self.values
            .charge(store, &scene, self.light_number, start, place, cost_ns)
    }
}

/// A number from all bits of a start's point (Knuth's multiplicative hash).
fn hash(start: &Start) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let bits = start.point.x.to_bits() ^ start.point.y.to_bits().rotate_left(32);
    bits.wrapping_mul(FACTOR) >> 40
}
