//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use antumbra_geometry::{Occluders, Start};

use super::order::{self, Order, WINDOW};
use crate::accel::bvh::Bvh;
use crate::clock::Reading;
use crate::draw::{SAMPLED, TIMED, draw};
use crate::occlusion::{
    Account, AdaptiveValues, BLOCK, Found, Known, Lists, Looks, MANY, PackedLight, SCOUTS, Scene,
    Store, cost_of_rays,
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
pub(super) const NOTED: usize = 64 * BLOCK;

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
        if self.values.has_maps() {
            return self.answer_by_map(starts, is_shadowed, counters, check);
        }
        if !order::is_scattered(self.values, self.light_number, starts) {
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
        let (mut left, mut left_answers) = (starts, is_shadowed);
        let mut is_first = true;
        while !left.is_empty() {
            let before = *counters;
            let begin = is_refining.then(Reading::now);
            let light = self.light_number;
            let now = self.values.known(light);
            let looks = self.values.looks(light, now.as_deref(), is_refining);
            let known = now.as_deref();
            // Rays are put in order together, once it is known what they cost.
            let is_by_rays = looks == Looks::None && !is_first;
            let count = if is_by_rays { WINDOW } else { NOTED }.min(left.len());
            is_first = false;
            let (starts, is_shadowed);
            (starts, left) = left.split_at(count);
            (is_shadowed, left_answers) = std::mem::take(&mut left_answers).split_at_mut(count);
            let mut sum = Sum::default();
            match (known, looks) {
                (Some(known), Looks::All | Looks::Try(_)) => {
                    let weight = looks.weight();
                    sum = self.answer_some(known, starts, is_shadowed, counters, weight, &check)?;
                }
                (Some(known), Looks::Scouts) => {
                    // Blocks here and there.
                    let first = draw() % SCOUTS;
                    let blocks = starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK));
                    for ((starts, is_shadowed), number) in blocks.zip(first..) {
                        if number.is_multiple_of(SCOUTS) {
                            sum.add(&self.answer_some(
                                known,
                                starts,
                                is_shadowed,
                                counters,
                                SCOUTS,
                                &check,
                            )?);
                        } else {
                            self.answer_by_rays(starts, is_shadowed, counters, &check)?;
                        }
                    }
                }
                (Some(_), Looks::None | Looks::Rays) | (None, _) => {
                    self.answer_by_rays(starts, is_shadowed, counters, &check)?
                }
            }
            if let Some(begin) = begin {
                let ray_count = counters.shadow.rays - before.shadow.rays;
                let account = Account {
                    query_count: starts.len() as u64,
                    ray_count,
                    rays_ns: cost_of_rays(&before, counters, ray_count),
                    looked_count: sum.looked_count,
                    found_count: sum.found_count,
                    took: Some(begin.elapsed_ns().saturating_sub(sum.made)),
                };
                self.values.note(
                    self.occluders,
                    self.light_number,
                    &account,
                    left.len() as u64,
                );
            }
        }
        Ok(())
    }

    /// Answers by values that are all made.
    #[inline]
    fn answer_packed(
        &self,
        packed: &PackedLight,
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
            if unknown != 0 {
                antumbra_task::check();
            }
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

    pub(super) fn answer_by_rays(
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

    /// Answers queries of a chunk, each of which stands for so many.
    #[inline]
    fn answer_some(
        &self,
        known: &Known,
        starts: &[Start],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        weight: u64,
        check: impl Fn(&Start) -> Result<(), QueryError>,
    ) -> Result<Sum, QueryError> {
        let Some(values) = lists_and_store(known) else {
            self.answer_by_rays(starts, is_shadowed, counters, check)?;
            return Ok(Sum::default());
        };
        let mut sum = Sum::default();
        let (mut shadowed_count, mut list_count, mut ray_count) = (0, 0, 0);
        for (starts, is_shadowed) in starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK)) {
            antumbra_task::check();
            let looked = self
                .values
                .find(values, self.occluders, starts, self.light_number);
            let found = looked.found;
            // What is beyond the starts is as nothing found.
            let beyond = (BLOCK - starts.len()) as u64;
            let unknown_count = Found::count(&found, Found::is_nothing) - beyond;
            sum.found_count += starts.len() as u64 - unknown_count;
            let is_sampled = self.values.is_asked() || draw().is_multiple_of(SAMPLED);
            if is_sampled && Found::count(&found, Found::is_by_list) > 0 {
                for (number, start) in starts.iter().enumerate() {
                    if found[number].is_by_list() {
                        let place = looked.places[number];
                        sum.made += self.charge_list(known, start, place, weight);
                    }
                }
            }
            for (is_shadowed, found) in is_shadowed.iter_mut().zip(&found) {
                *is_shadowed = found.is_shadowed();
            }
            shadowed_count += Found::count(&found, Found::is_shadowed);
            list_count += Found::count(&found, Found::is_by_list);
            if unknown_count == 0 {
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
                sum.made += self.charge_ray(known, &asked[i], looked.places[number], cost * weight);
            }
            ray_count += count as u64;
        }
        sum.looked_count = starts.len() as u64;
        counters.shadow.first_pass += starts.len() as u64 - list_count - ray_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.rays += ray_count;
        counters.shadow.shadowed += shadowed_count;
        Ok(sum)
    }

    /// Answers one query.
    pub(crate) fn answer_one(&self, start: &Start, counters: &mut Counters) -> Answer {
        if self.values.has_maps() {
            return self.answer_one_by_map(start, counters);
        }
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
        let light = self.light_number;
        let now = self.values.known(light);
        let looks = self.values.looks(light, now.as_deref(), is_refining);
        let drawn = draw();
        let is_sampled = is_refining && drawn.is_multiple_of(SAMPLED);
        let weight = looks.weight();
        let is_looked_up = match looks {
            Looks::None | Looks::Rays => false,
            // Other ones than those that are sampled.
            Looks::Scouts => (drawn / SAMPLED).is_multiple_of(SCOUTS),
            Looks::Try(_) | Looks::All => true,
        };
        let is_timed = is_sampled && (drawn / SAMPLED).is_multiple_of(TIMED);
        // What reading the clock takes comes beside.
        let begin = is_timed.then(|| (Reading::now(), Reading::now()));
        let mut made = 0;
        let before = *counters;
        let known = now.as_deref();
        let mut is_found = false;
        let values = known.and_then(|known| Some((known, lists_and_store(known)?)));
        let answer = match values {
            Some((known, values)) if is_looked_up => {
                let (found, place) = self.values.find_one(values, self.occluders, start, light);
                is_found = !found.is_nothing();
                if found.is_by_list() && (is_sampled || self.values.is_asked()) {
                    made += self.charge_list(known, start, place, weight);
                }
                if is_found {
                    Answer::new(found.is_shadowed(), found.decided())
                } else {
                    let (is_blocked, took) =
                        self.is_blocked_at(known, start, place, weight, counters);
                    made += took;
                    Answer::new(is_blocked, Decided::Ray)
                }
            }
            _ => Answer::new(self.rays.is_blocked(start, counters), Decided::Ray),
        };
        if is_sampled {
            let is_ray = u64::from(answer.decided == Decided::Ray);
            let account = Account {
                query_count: SAMPLED,
                ray_count: SAMPLED * is_ray,
                rays_ns: SAMPLED * cost_of_rays(&before, counters, is_ray),
                looked_count: SAMPLED * u64::from(is_looked_up),
                found_count: SAMPLED * u64::from(is_found),
                took: begin.map(|(first, second)| {
                    let reading = second.since_ns(first);
                    SAMPLED * second.elapsed_ns().saturating_sub(reading + made)
                }),
            };
            self.values
                .note(self.occluders, self.light_number, &account, 0);
        }
        answer
    }

    /// Answers by a ray, which the cell pays for whose link stands at a place; and returns what the making
    /// of values took, in nanoseconds.
    fn is_blocked_at(
        &self,
        known: &Known,
        start: &Start,
        place: u32,
        weight: u64,
        counters: &mut Counters,
    ) -> (bool, u64) {
        let before = *counters;
        let is_blocked = self.rays.is_blocked(start, counters);
        let cost = cost_of_rays(&before, counters, 1);
        let made = self.charge_ray(known, start, place, cost * weight);
        (is_blocked, made)
    }

    /// Lets a cell pay for a ray, and returns what the making of values took, in nanoseconds.
    fn charge_ray(&self, known: &Known, start: &Start, place: u32, cost_ns: u64) -> u64 {
        if place == 0 || !self.values.is_refining() {
            return 0;
        }
        self.charge(known, start, place, cost_ns)
    }

    #[cold]
    #[inline(never)]
    fn charge_list(&self, known: &Known, start: &Start, place: u32, weight: u64) -> u64 {
        if place == 0 || !self.values.is_refining() {
            return 0;
        }
        let store = known.store.as_ref();
        let cost = store.map_or(0, |store| self.values.cost_of_list(store, place));
        self.charge(known, start, place, cost * SAMPLED * weight)
    }

    /// Returns what the making of values took, in nanoseconds.
    fn charge(&self, known: &Known, start: &Start, place: u32, cost_ns: u64) -> u64 {
        let (Some(bvh), Some(store)) = (self.bvh, &known.store) else {
            return 0;
        };
        let scene = Scene {
            occluders: self.occluders,
            bvh,
        };
        self.values.charge(
            (known, store),
            &scene,
            self.light_number,
            start,
            place,
            cost_ns,
        )
    }
}

#[inline(always)]
fn lists_and_store(known: &Known) -> Option<(&Lists, &Store)> {
    Some((&known.lists, known.store.as_ref()?))
}

/// What became of queries that were looked up.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    looked_count: u64,
    /// Those that values or lists of voxels answered.
    found_count: u64,
    /// What the making of values took meanwhile, in nanoseconds.
    made: u64,
}

impl Sum {
    fn add(&mut self, other: &Self) {
        self.looked_count += other.looked_count;
        self.found_count += other.found_count;
        self.made += other.made;
    }
}
