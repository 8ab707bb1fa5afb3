//! Occlusion values of any mesh, blocker lists, and rays for the rest.

use std::sync::Arc;

use antumbra_geometry::{Occluders, ReceiverPoint};

use super::order::{self, Order, WINDOW};
use crate::accel::bvh::Bvh;
use crate::clock::Reading;
use crate::draw::{TIMED, draw};
use crate::occlusion::{
    Account, AdaptiveValues, BLOCK, Found, Known, MANY, PackedLight, Scene, Store,
};
use crate::{Answer, Counters, Decided, QueryError};

/// Who answers what values do not know, own rules and all.
pub(crate) trait Rays {
    /// Returns whether an opaque surface blocks a start's segment.
    fn is_blocked(&self, start: &ReceiverPoint, counters: &mut Counters) -> bool;

    /// Tells the same of many starts.
    fn are_blocked(
        &self,
        starts: &[ReceiverPoint],
        is_blocked: &mut [bool],
        counters: &mut Counters,
    ) {
        for (start, is_blocked) in starts.iter().zip(is_blocked) {
            *is_blocked = self.is_blocked(start, counters);
        }
    }
}

impl<F: Fn(&ReceiverPoint, &mut Counters) -> bool> Rays for F {
    fn is_blocked(&self, start: &ReceiverPoint, counters: &mut Counters) -> bool {
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
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        if self.values.has_maps() {
            return self.answer_by_map(starts, is_shadowed, counters, check);
        }
        if !order::is_scattered(self.values, self.light_number, starts) {
            return self.answer_in_order(starts, is_shadowed, counters, check);
        }
        let mut order = Order::new();
        for (starts, is_shadowed) in starts.chunks(WINDOW).zip(is_shadowed.chunks_mut(WINDOW)) {
            let together = (self.values, NOTED);
            order.answer(together, starts, is_shadowed, &check, |starts, found| {
                self.answer_in_order(starts, found, counters, &check)
            })?;
        }
        Ok(())
    }

    #[inline]
    fn answer_in_order(
        &self,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let light = self.light_number;
        if let Some(packed) = self.values.packed(light) {
            return self.answer_packed(packed, starts, is_shadowed, counters, check);
        }
        let is_refining = self.values.is_refining();
        let (mut left, mut left_answers) = (starts, is_shadowed);
        let mut is_first = true;
        while !left.is_empty() {
            let begin = is_refining.then(Reading::now);
            let known = self.known_that_pays(is_refining);
            // Rays are put in order together, once it is known what they cost.
            let count = match known {
                None if !is_first => WINDOW,
                _ => NOTED,
            };
            is_first = false;
            let (starts, is_shadowed);
            (starts, left) = left.split_at(count.min(left.len()));
            (is_shadowed, left_answers) =
                std::mem::take(&mut left_answers).split_at_mut(starts.len());
            let rays = match known.as_deref().and_then(with_store) {
                Some(known) => self.answer_growing(known, starts, is_shadowed, counters, &check)?,
                None => {
                    self.answer_by_rays(starts, is_shadowed, counters, &check)?;
                    Rayed {
                        count: starts.len() as u64,
                        ns: begin.map_or(0, Reading::elapsed_ns),
                        made: 0,
                    }
                }
            };
            if let Some(begin) = begin {
                let account = Account {
                    queries: starts.len() as u64,
                    rays: rays.count,
                    rays_ns: rays.ns,
                    lookups_ns: begin.elapsed_ns().saturating_sub(rays.ns + rays.made),
                };
                let coming = left.len() as u64;
                self.values.note(self.occluders, light, &account, coming);
            }
        }
        Ok(())
    }

    /// Returns what is known of the light while more is made, if there are values and looking them up pays.
    #[inline(always)]
    fn known_that_pays(&self, is_refining: bool) -> Option<Arc<Known>> {
        let known = self.values.known(self.light_number);
        known.filter(|known| {
            known.store.is_some() && self.values.is_looked_up(self.light_number, is_refining)
        })
    }

    /// Answers by values that are all made.
    #[inline]
    fn answer_packed(
        &self,
        packed: &PackedLight,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
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
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        starts.iter().try_for_each(check)?;
        self.rays.are_blocked(starts, is_shadowed, counters);
        let shadowed = is_shadowed.iter().filter(|&&is_shadowed| is_shadowed);
        counters.shadow.shadowed += shadowed.count() as u64;
        counters.shadow.rays += starts.len() as u64;
        Ok(())
    }

    /// Answers queries of a chunk by values while more are made, and by rays where they know nothing.
    #[inline]
    fn answer_growing(
        &self,
        (known, store): (&Known, &Store),
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<Rayed, QueryError> {
        let (occluders, light) = (self.occluders, self.light_number);
        let (mut shadowed_count, mut list_count) = (0, 0);
        // Their numbers, and where the links of their cells stand.
        let (mut asked, mut places) = (Vec::new(), Vec::new());
        let blocks = starts.chunks(BLOCK).zip(is_shadowed.chunks_mut(BLOCK));
        for (block, (starts, is_shadowed)) in blocks.enumerate() {
            antumbra_task::check();
            let looked = self
                .values
                .find((&known.lists, store), occluders, starts, light);
            let found = looked.found;
            for (is_shadowed, found) in is_shadowed.iter_mut().zip(&found) {
                *is_shadowed = found.is_shadowed();
            }
            shadowed_count += Found::count(&found, Found::is_shadowed);
            list_count += Found::count(&found, Found::is_by_list);
            for (number, start) in starts.iter().enumerate() {
                if found[number].is_nothing() {
                    asked.push(*start);
                    places.push((block * BLOCK + number, looked.places[number]));
                }
            }
        }
        counters.shadow.shadowed += shadowed_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.first_pass += (starts.len() - asked.len()) as u64 - list_count;
        let mut rays = Rayed::default();
        if asked.is_empty() {
            return Ok(rays);
        }
        let is_refining = self.values.is_refining();
        let begin = is_refining.then(Reading::now);
        let mut blocked = vec![false; asked.len()];
        self.answer_by_rays(&asked, &mut blocked, counters, check)?;
        rays.count = asked.len() as u64;
        rays.ns = begin.map_or(0, Reading::elapsed_ns);
        for ((start, &(number, place)), &blocked) in asked.iter().zip(&places).zip(&blocked) {
            is_shadowed[number] = blocked;
            rays.made += self.count_ray((known, store), start, place);
        }
        Ok(rays)
    }

    /// Answers one query.
    pub(crate) fn answer_one(&self, start: &ReceiverPoint, counters: &mut Counters) -> Answer {
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
        let is_timed = is_refining && draw().is_multiple_of(TIMED);
        // What reading the clock takes comes beside.
        let begin = is_timed.then(|| (Reading::now(), Reading::now()));
        let known = self.known_that_pays(is_refining);
        let values = known.as_deref().and_then(with_store);
        let (found, place) = match values {
            Some((known, store)) => {
                let values = (&*known.lists, store);
                let light = self.light_number;
                self.values.find_one(values, self.occluders, start, light)
            }
            None => (Found::NOTHING, 0),
        };
        let (mut rays, mut read) = (Rayed::default(), 0);
        let answer = if found.is_nothing() {
            let begin = is_timed.then(Reading::now);
            let answer = Answer::new(self.rays.is_blocked(start, counters), Decided::Ray);
            (rays.count, rays.ns) = (1, begin.map_or(0, Reading::elapsed_ns));
            read = 2;
            if let Some(values) = values {
                rays.made = self.count_ray(values, start, place);
            }
            answer
        } else {
            Answer::new(found.is_shadowed(), found.decided())
        };
        if let Some((first, second)) = begin {
            let reading = second.since_ns(first);
            let beside = rays.ns + rays.made + (1 + read) * reading;
            let account = Account {
                queries: TIMED,
                rays: TIMED * rays.count,
                rays_ns: TIMED * rays.ns.saturating_sub(reading),
                lookups_ns: TIMED * second.elapsed_ns().saturating_sub(beside),
            };
            self.values
                .note(self.occluders, self.light_number, &account, 0);
        }
        answer
    }

    /// Counts a ray at the cell whose link stands at a place; returns what the making of values took, in nanoseconds.
    fn count_ray(&self, values: (&Known, &Store), start: &ReceiverPoint, place: u32) -> u64 {
        match self.bvh {
            Some(bvh) if place != 0 && self.values.is_refining() => {
                let scene = Scene {
                    occluders: self.occluders,
                    bvh,
                };
                self.values
                    .count_ray(values, &scene, self.light_number, start, place)
            }
            _ => 0,
        }
    }
}

#[inline(always)]
fn with_store(known: &Known) -> Option<(&Known, &Store)> {
    Some((known, known.store.as_ref()?))
}

/// Queries that rays answered, what these took, and what the making of values took meanwhile, in nanoseconds.
#[derive(Clone, Copy, Debug, Default)]
struct Rayed {
    count: u64,
    ns: u64,
    made: u64,
}
