//! What queries cost, and what is made when they have paid for it (Paper 9.2).

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use antumbra_geometry::{Occluders, ReceiverPoint};

use super::super::bricks::Store;
use super::super::budget::Account;
use super::super::links::{Link, charge, claim, publish};
use super::super::map::{self, Map, Spent};
use super::scene::Scene;
use super::{AdaptiveValues, Known, Lists};
use crate::Refine;
use crate::clock::Reading;
use crate::draw::SAMPLED;

/// Turns, for each light that knows something, after which one that was not asked meanwhile may lose it.
const LONG_AGO: u32 = 4;

/// Says of a light that a thread makes its tables, until it has, or is stopped.
struct Busy<'a>(&'a AtomicBool);

impl<'a> Busy<'a> {
    fn begin(is_busy: &'a AtomicBool) -> Option<Self> {
        // Not `then_some`: what that makes in vain it drops, and so says that the other thread is done.
        (!is_busy.swap(true, Ordering::Acquire)).then(|| Self(is_busy))
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// Gives a claimed counter back with its price, also when the work is stopped.
struct Unclaim<'a>(&'a Store, u32, u32);

impl Unclaim<'_> {
    /// What was made stands there now.
    fn settle(self) {
        std::mem::forget(self);
    }
}

impl Drop for Unclaim<'_> {
    fn drop(&mut self) {
        let Self(store, counter, price) = *self;
        publish(store.word(counter), Link::pending(price));
    }
}

/// What tables cost: for each triangle those of the scene, and for each the mesh and its edges, and for each other
/// surface.
pub(super) const TABLE_NS: u64 = 400;
const WHOLE_NS: u64 = 700;
pub(super) const CURVED_NS: u64 = 500;

/// Starts of a call that are sampled to see where its queries are; more if that is one in [`MOST_STRIDE`].
const ANNOUNCED: usize = 8_192;
const MOST_STRIDE: usize = 64;

/// The places of a call's queries, by a sample, and for how many each stands.
#[derive(Debug, Default)]
pub(crate) struct Announced {
    places: Vec<(u32, u32)>,
    each: u32,
}

impl AdaptiveValues {
    /// Adds what some queries of a light took, with so many more known to come; makes the light's tables when they pay.
    pub(crate) fn note(&self, occluders: &Occluders, light: usize, account: &Account, ahead: u64) {
        let values = &self.lights[light];
        values.budget.note(account);
        self.take_turn(light);
        if !values.is_ordinary || values.is_complete() || self.packed(light).is_some() {
            return;
        }
        let has_store = |known: &Known| known.store.is_some();
        if values.known.load().as_deref().is_some_and(has_store) {
            return;
        }
        let curved_count = occluders.surface_count() - occluders.triangle_count();
        let price = TABLE_NS * occluders.triangle_count() as u64 + CURVED_NS * curved_count as u64;
        let can_make =
            self.refine == Refine::Queried || values.budget.sums(ahead).pays(price as f64);
        if can_make && let Some(_busy) = Busy::begin(&values.is_busy) {
            let begin = Reading::now();
            if self.make_known(occluders, light, false).is_none() {
                self.make_room(light);
            }
            values.budget.add_made(begin.elapsed_ns());
        }
    }

    /// Adds what some queries of a light took; makes its map when that pays.
    pub(crate) fn spent(&self, occluders: &Occluders, light: usize, spent: &Spent) {
        let values = &self.lights[light];
        values.prices.note(spent);
        self.take_turn(light);
        if !values.is_ordinary {
            return;
        }
        let has_map = |known: &Known| known.lists.map.get().is_some();
        if values.known.load().as_deref().is_some_and(has_map) {
            return;
        }
        let is_asked = self.refine == Refine::Queried;
        let is_joined = self
            .tables
            .get()
            .is_some_and(|(scene, _)| scene.mesh_bytes() > 0);
        if (is_asked || values.prices.allow(map::price(occluders, is_joined)))
            && let Some(_busy) = Busy::begin(&values.is_busy)
        {
            let begin = Reading::now();
            match self.make_known(occluders, light, false) {
                Some(known) => self.make_map(occluders, light, &known.lists, None),
                None => {
                    self.make_room(light);
                }
            }
            values.prices.note(&Spent::making(begin.elapsed_ns()));
        }
    }

    /// Makes those cells of a light's map that starts found nothing in, where that pays; one start alone stands for
    /// [`SAMPLED`]. Returns how long that took, in nanoseconds, 0 if none was made.
    pub(crate) fn make_cells(
        &self,
        (lists, map): (&Lists, &Map),
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: usize,
    ) -> u64 {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return 0;
        };
        if !self.is_refining() {
            return 0;
        }
        let begin = Reading::now();
        let asking = self.places_in_map(map, &tables, starts);
        let prices = &self.lights[light].prices;
        let (each, ray_ns) = match self.refine {
            // So that what is made does not depend on times.
            Refine::Queried => (1e3, 1e3),
            // One alone stands for those that were not sampled.
            Refine::Lazy | Refine::Eager => (
                if starts.len() == 1 {
                    SAMPLED as f32
                } else {
                    1.0
                },
                prices.ray_ns(),
            ),
        };
        let is_made = map.make_for(&tables, &asking, each, ray_ns);
        if map.is_full() {
            self.lights[light].is_refused.store(true, Ordering::Relaxed);
        }
        match is_made {
            true => begin.elapsed_ns().max(1),
            false => 0,
        }
    }

    /// Tells a light's map where the queries of a call are. If more are known to come than the call has, the others
    /// are expected at the same places.
    pub(crate) fn announce(
        &self,
        (lists, map): (&Lists, &Map),
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: usize,
    ) -> Announced {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Announced::default();
        };
        let stride = (starts.len() / ANNOUNCED).clamp(1, MOST_STRIDE);
        let sample: Vec<ReceiverPoint> = starts.iter().step_by(stride).copied().collect();
        let places = self.places_in_map(map, &tables, &sample);
        let expected = self.lights[light].prices.expected();
        let each = stride as u64 * (expected / starts.len().max(1) as u64).max(1);
        let each = each.min(u64::from(u16::MAX)) as u32;
        map.expect(&places, each);
        Announced { places, each }
    }

    /// Returns what a ray to a light took lately, in nanoseconds.
    pub(crate) fn ray_ns(&self, light: usize) -> u64 {
        self.lights[light].prices.ray_ns() as u64
    }

    /// Takes back what a call announced, at its end.
    pub(crate) fn retract(&self, light: usize, announced: &Announced) {
        if let Some(map) = self
            .known(light)
            .as_deref()
            .and_then(|known| known.lists.map())
        {
            map.expect_no_more(&announced.places, announced.each);
        }
    }

    /// Notes that so many queries of a light are known to come.
    pub(crate) fn expect(&self, light: usize, queries: u64) {
        self.lights[light].prices.expect(queries);
    }

    /// Notes that a light is asked, and when it was before others were.
    fn take_turn(&self, light: usize) {
        if self.asked_last.load(Ordering::Relaxed) != light {
            self.asked_last.store(light, Ordering::Relaxed);
            let turn = self.turns.fetch_add(1, Ordering::Relaxed).wrapping_add(1);
            let [last, before] = &self.lights[light].turns;
            before.store(last.swap(turn, Ordering::Relaxed), Ordering::Relaxed);
        }
    }

    /// Drops what is known of the light that was asked longest ago, if that was long before the turn before this one
    /// of a light: where lights take turns, those that know something go on. Returns whether it did.
    fn make_room(&self, light: usize) -> bool {
        let before = self.lights[light].turns[1].load(Ordering::Relaxed);
        let last = |light: usize| self.lights[light].turns[0].load(Ordering::Relaxed);
        let (holder_count, oldest) = {
            let holders = self.holders();
            let all = holders.iter().map(|&holder| (last(holder), holder));
            (holders.len() as u32, all.min())
        };
        match oldest {
            Some((turn, holder)) if turn + LONG_AGO * holder_count < before && holder != light => {
                self.drop_known(holder);
                self.evictions.fetch_add(1, Ordering::Relaxed);
                true
            }
            _ => false,
        }
    }

    /// Counts a ray at the cell whose link stands there, and makes a brick in its place when there were enough and the
    /// account allows it. Returns what that took, in nanoseconds.
    pub(crate) fn count_ray(
        &self,
        values: (&Known, &Store),
        scene: &Scene<'_>,
        light: usize,
        start: &ReceiverPoint,
        place: u32,
    ) -> u64 {
        if !charge(values.1.word(place), 1) {
            return 0;
        }
        let budget = &self.lights[light].budget;
        if self.refine != Refine::Queried && !budget.allows_brick() {
            return 0;
        }
        let took = self.refine(values, scene, light, start, place);
        if took > 0 {
            budget.add_brick(took);
        }
        took
    }

    /// Makes a brick in place of a start's cell, whose link stands at a place; returns what that took, in nanoseconds, 0
    /// if nothing was made.
    #[cold]
    #[inline(never)]
    fn refine(
        &self,
        (known, store): (&Known, &Store),
        scene: &Scene<'_>,
        light: usize,
        start: &ReceiverPoint,
        place: u32,
    ) -> u64 {
        let lists = &*known.lists;
        let Some((class, code)) = self.code_of_start(known, scene.occluders, light, start) else {
            return 0;
        };
        if !self.has_edges(scene.occluders, light, lists) {
            return 0;
        }
        let Some(claimed) = claim(store.word(place)) else {
            return 0;
        };
        let unclaim = Unclaim(store, place, claimed.price());
        let lattice = &self.lattices[class as usize];
        let finder = store.finder(class, lattice);
        if finder.find(code).place != place {
            // The start is another cell's.
            return 0;
        }
        let cell = code.cell(finder.level_of(code, lattice));
        let begin = Reading::now();
        let made = self.brick((store, lists), scene, (light, class, cell), false);
        match made {
            Some(made) => {
                store.publish(place, made);
                unclaim.settle();
            }
            None => {
                drop(unclaim);
                self.evict(light, known);
            }
        }
        begin.elapsed_ns().max(1)
    }

    /// Returns whether there are the mesh and its edges; makes them when they pay.
    fn has_edges(&self, occluders: &Occluders, light: usize, lists: &Lists) -> bool {
        let values = &self.lights[light];
        if lists.tables.has_edges() {
            return true;
        }
        let price = WHOLE_NS * occluders.triangle_count() as u64;
        let can_make = self.refine == Refine::Queried || values.budget.sums(0).pays(price as f64);
        if can_make && let Some(_busy) = Busy::begin(&values.is_busy) {
            let begin = Reading::now();
            let is_made = self.make_edges(occluders, light, lists);
            values.budget.add_made(begin.elapsed_ns());
            return is_made;
        }
        false
    }

    /// Makes room where there is none: another light that is not asked any more loses what it knows, or this one its
    /// store, in whose place the next query makes an empty one. Nothing where that is empty, or bytes will be free
    /// in a moment.
    fn evict(&self, light: usize, full: &Known) {
        let values = &self.lights[light];
        values.is_refused.store(true, Ordering::Relaxed);
        let is_bare = full.store.as_ref().is_none_or(Store::is_bare);
        if self.room.is_held() || self.make_room(light) || is_bare {
            return;
        }
        let is_full = |known: &Option<Arc<Known>>| {
            let known = known.as_deref();
            known.is_some_and(|known| std::ptr::eq(known, full))
        };
        let current = values.known.load_full();
        if !is_full(&current) {
            return;
        }
        let without = Known {
            lists: Arc::clone(&full.lists),
            store: None,
        };
        let before = values
            .known
            .compare_and_swap(&current, Some(Arc::new(without)));
        if is_full(&before) {
            self.evictions.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_refused_leaves_the_other_busy() {
        let is_busy = AtomicBool::new(false);
        let busy = Busy::begin(&is_busy);
        assert!(busy.is_some());
        for _ in 0..2 {
            assert!(Busy::begin(&is_busy).is_none());
        }
        drop(busy);
        assert!(Busy::begin(&is_busy).is_some());
    }
}
