//! What queries cost, and what is made when they have paid for it (Paper 9.2).

use std::sync::atomic::{AtomicBool, Ordering};

use antumbra_geometry::{Occluders, Start};

use super::super::bricks::Store;
use super::super::budget::Account;
use super::super::columns::{Columns, Wanted};
use super::super::links::{Link, charge, claim, publish, read};
use super::super::refine::Care;
use super::super::tables::LightTables;
use super::AdaptiveValues;
use super::making::Scene;
use crate::Refine;
use crate::clock::Reading;

/// A unit of cost in links, in nanoseconds, as a power of two.
pub(super) const UNIT: u32 = 4;

/// A cell is worth so many times what it has cost: more queries will come, and the account of all
/// cells bounds what is spent in vain.
pub(super) const HASTE: u64 = 4;

/// Says of a light that a thread makes its tables, until it has, or is stopped.
struct Busy<'a>(&'a AtomicBool);

impl<'a> Busy<'a> {
    fn begin(is_busy: &'a AtomicBool) -> Option<Self> {
        (!is_busy.swap(true, Ordering::Acquire)).then_some(Self(is_busy))
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

/// What tables cost: for each triangle that none is entered for, for each that is, and for each other surface.
const TABLE_NS: u64 = 15;
const WHOLE_NS: u64 = 700;
const CURVED_NS: u64 = 500;

impl AdaptiveValues {
    /// Adds what some queries of a light came to, with so many more known to come; makes the light's tables
    /// and columns when they pay.
    pub(crate) fn note(&self, occluders: &Occluders, light: usize, account: &Account, ahead: u64) {
        let values = &self.lights[light];
        values.budget.note(account);
        if values.columns.get().is_some() || !values.is_ordinary || values.is_complete() {
            return;
        }
        let wanted = match self.refine {
            Refine::Asked => Wanted::Few,
            Refine::Lazy | Refine::Eager => Wanted::For(ahead),
        };
        let curved_count = occluders.surface_count() - occluders.triangle_count();
        let price = TABLE_NS * occluders.triangle_count() as u64
            + CURVED_NS * curved_count as u64
            + Columns::price(occluders, &self.frame, &values.light, wanted);
        let can_make = self.refine == Refine::Asked || values.budget.allows_columns(price, ahead);
        if can_make && let Some(_busy) = Busy::begin(&values.is_busy) {
            let begin = Reading::now();
            self.make_tables(occluders, light);
            self.make_columns(occluders, light, wanted);
            values.budget.spend(begin.elapsed_ns());
        }
    }

    /// Returns what a query of the list at a cell costs more than a value.
    pub(crate) fn cost_of_list(&self, store: &Store, place: u32) -> u64 {
        const ENTRY_NS: u64 = 1;
        let list = read(store.word(place)).list();
        list.map_or(0, |list| {
            4 + ENTRY_NS * store.list(list).surfaces.len() as u64
        })
    }

    /// Returns what to charge a cell for where columns answer.
    pub(crate) fn cost_of_column(&self, light: usize) -> u64 {
        match self.refine {
            // So that what is made does not depend on times.
            Refine::Asked => 16,
            Refine::Lazy | Refine::Eager => self.lights[light].budget.column_charge(),
        }
    }

    /// Adds what a query has cost at the cell whose link or list stands there; makes finer cells when the price
    /// is paid. Returns what that took, in nanoseconds.
    pub(crate) fn charge(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        start: &Start,
        place: u32,
        cost_ns: u64,
    ) -> u64 {
        let counter = match read(store.word(place)).list() {
            Some(list) => Store::list_counter(list),
            None => place,
        };
        let units = (cost_ns >> UNIT).max(1) as u32;
        if !charge(store.word(counter), units) {
            return 0;
        }
        let price = read(store.word(counter)).price();
        let budget = &self.lights[light].budget;
        if self.refine != Refine::Asked && !budget.allows(HASTE << (price + UNIT)) {
            return 0;
        }
        let took = self.refine(store, scene, light, start, counter);
        budget.spend(took);
        took
    }

    /// Makes what pays where a counter has its price; returns what that took, in nanoseconds.
    #[cold]
    #[inline(never)]
    fn refine(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        start: &Start,
        counter: u32,
    ) -> u64 {
        let Some((audience, code)) = self.code_of_start(store, scene.occluders, light, start)
        else {
            return 0;
        };
        let Some(claimed) = claim(store.word(counter)) else {
            return 0;
        };
        let unclaim = Unclaim(store, counter, claimed.price());
        let lattice = &self.lattices[audience as usize];
        let finder = store.finder(light, audience, lattice);
        let leaf = finder.find(code);
        let is_its = leaf.place == counter
            || leaf
                .link
                .list()
                .is_some_and(|list| Store::list_counter(list) == counter);
        if !is_its {
            // Another thread was faster, or the list is another cell's, too.
            return 0;
        }
        let level = finder.level_of(code, lattice);
        let target = (light, audience, code.cell(level));
        let is_first_look = level <= lattice.root_level
            && counter == leaf.place
            && claimed.price() <= self.look_price()
            && self.depth.early_list > 0;
        let begin = Reading::now();
        let made = if is_first_look {
            self.look(store, scene, target)
        } else if self.care(level, audience) == Care::Quick
            || self.has_whole_tables(scene.occluders, light)
        {
            self.brick(store, scene, target)
        } else {
            return 0;
        };
        let took = begin.elapsed_ns();
        // First the cell, then the list's counter: who claims that again must see what came of it.
        if let Some(made) = made {
            store.publish(leaf.place, made);
        }
        if counter != leaf.place || made.is_none() {
            drop(unclaim);
        } else {
            unclaim.settle();
        }
        if made.is_none() {
            self.evict(store);
        }
        took
    }

    /// Returns whether there are tables of all triangles; makes them when they pay.
    fn has_whole_tables(&self, occluders: &Occluders, light: usize) -> bool {
        let values = &self.lights[light];
        if values.tables.get().is_some_and(LightTables::is_whole) {
            return true;
        }
        let price = WHOLE_NS * occluders.triangle_count() as u64;
        let can_make = self.refine == Refine::Asked || values.budget.allows(price);
        if can_make && let Some(_busy) = Busy::begin(&values.is_busy) {
            self.make_whole_tables(occluders, light);
            return true;
        }
        false
    }

    /// Drops a store that is full for an empty one, unless that was done.
    fn evict(&self, full: &Store) {
        let current = self.store.load();
        if !current
            .as_ref()
            .is_some_and(|now| std::ptr::eq(&raw const **now, full))
        {
            return;
        }
        let before = self.store.compare_and_swap(&current, self.empty_store());
        if before
            .as_ref()
            .is_some_and(|before| std::ptr::eq(&raw const **before, full))
        {
            self.evictions.fetch_add(1, Ordering::Relaxed);
        }
    }
}
