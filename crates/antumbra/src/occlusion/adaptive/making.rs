//! What is made: tables, columns, bricks; all of them before the first query, or one by one.

use antumbra_geometry::Occluders;
use antumbra_task::{Steps, check};
use rayon::prelude::*;

use super::super::bricks::{Decision, Store, cell_in_brick};
use super::super::candidates::{Candidates, Casters};
use super::super::columns::{Columns, Wanted};
use super::super::lattice::Cell;
use super::super::links::{Link, read};
use super::super::packed::Packed;
use super::super::refine::{Care, Refiner};
use super::super::tables::{LightTables, SceneTables, Tables};
use super::super::value::Audience;
use super::AdaptiveValues;
use super::demand::{HASTE, UNIT};
use crate::Refine;
use crate::bvh::Bvh;

/// What is worked with while values are made.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) bvh: &'a Bvh,
}

/// What a first look at a cell at the root costs, as a power of two of units.
pub(super) const LOOK_PRICE: u32 = 9;

/// Bricks so many halvings below the root are made quickly.
const QUICK_LEVELS: u32 = 2;

/// What a brick costs, quick and full: itself, and each candidate.
const QUICK_NS: [u64; 2] = [6_000, 300];
const FULL_NS: [u64; 2] = [20_000, 1_100];

fn cost([own, each]: [u64; 2], candidate_count: usize) -> u64 {
    own + each * candidate_count as u64
}

impl AdaptiveValues {
    /// Makes all values of all lights, as far as there is room.
    pub(super) fn make_all(&self, occluders: &Occluders, bvh: &Bvh) {
        let Some(store) = self.store() else {
            return;
        };
        let scene = Scene { occluders, bvh };
        let brick_count: u64 = Audience::ALL
            .iter()
            .map(|&audience| self.lattices[audience as usize].root_bricks().count() as u64)
            .sum();
        let steps = Steps::new("baking", self.lights.len() as u64 * brick_count);
        for light in 0..self.lights.len() {
            if !self.lights[light].is_ordinary || self.packed(light).is_some() {
                continue;
            }
            self.make_whole_tables(occluders, light);
            if self.lights[light].is_complete() {
                continue;
            }
            for audience in Audience::ALL {
                let lattice = &self.lattices[audience as usize];
                let finder = store.finder(light, audience, lattice);
                let cells: Vec<Cell> = lattice.root_bricks().collect();
                cells.into_par_iter().for_each(|cell| {
                    let place = finder.place_in_root(cell);
                    steps.step(|| self.make_rest(&store, &scene, light, audience, cell, place));
                });
            }
        }
        self.pack(occluders, &store);
    }

    /// Packs the values of all lights for reading and drops the store, if all of it can be told so.
    pub(super) fn pack(&self, occluders: &Occluders, store: &Store) {
        let packed: Option<Vec<_>> = (0..self.lights.len())
            .filter(|&light| self.lights[light].is_ordinary && self.packed(light).is_none())
            .map(|light| {
                // Of a light that was kept there may be none yet.
                self.make_whole_tables(occluders, light);
                Some((light, Packed::new(store, light, &self.lattices)?))
            })
            .collect();
        for (light, packed) in packed.into_iter().flatten() {
            // What was kept is to be there at once.
            if !self.lights[light].is_complete() {
                self.make_columns(occluders, light, Wanted::For(u64::MAX));
            }
            self.lights[light].packed.get_or_init(|| packed);
            self.store.store(None);
        }
    }

    /// Makes the values that are missing of a cell whose link this is, and of all finer ones.
    fn make_rest(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        audience: Audience,
        cell: Cell,
        place: u32,
    ) {
        let link = read(store.word(place));
        let is_pending = match link.list() {
            Some(list) => read(store.word(Store::list_counter(list))).is_pending(),
            None => link.is_pending(),
        };
        if is_pending {
            self.make_below(store, scene, light, audience, cell, place);
        } else if let Some(brick_at) = link.brick() {
            for (place, number) in store.unfinished(brick_at) {
                let finer = cell_in_brick(cell, number);
                self.make_rest(store, scene, light, audience, finer, place);
            }
        }
    }

    /// Makes the values of a cell whose link this is, and of all finer ones.
    fn make_below(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        light: usize,
        audience: Audience,
        cell: Cell,
        place: u32,
    ) {
        check();
        let Some(made) = self.brick(store, scene, (light, audience, cell)) else {
            return;
        };
        store.publish(place, made);
        if made.brick().is_some() {
            self.make_rest(store, scene, light, audience, cell, place);
        }
    }

    /// Makes tables of the scene and a light, in which triangles are entered when they are asked for.
    pub(super) fn make_tables(&self, occluders: &Occluders, light: usize) {
        self.tables.get_or_init(|| SceneTables::new(occluders));
        let values = &self.lights[light];
        values
            .tables
            .get_or_init(|| LightTables::new(occluders, &self.frame, &values.light));
    }

    /// Makes tables of all triangles.
    pub(super) fn make_whole_tables(&self, occluders: &Occluders, light: usize) {
        self.make_tables(occluders, light);
        let values = &self.lights[light];
        if let (Some(scene), Some(of_light)) = (self.tables.get(), values.tables.get()) {
            of_light.make_whole(scene, occluders, &self.frame, &values.light);
        }
    }

    /// Makes the lists of all directions from a light, where there is room.
    pub(super) fn make_columns(&self, occluders: &Occluders, light: usize, wanted: Wanted) {
        let has_room = self.store_bytes >= Columns::predict_bytes(occluders);
        let may_list = self.depth.long_list > 0;
        self.lights[light].columns.get_or_init(|| {
            if !has_room || !may_list {
                return None;
            }
            let values = &self.lights[light];
            let of_light = values.tables.get()?;
            of_light.make_all(occluders, &self.frame, &values.light);
            let tables = self.tables(occluders, light)?;
            Columns::new(occluders, &tables, wanted)
        });
    }

    /// Returns what refines the cells of an audience.
    pub(super) fn refiner<'a>(
        &'a self,
        tables: Tables<'a>,
        audience: Audience,
        care: Care,
    ) -> Refiner<'a> {
        Refiner {
            casters: Casters::new(tables),
            lattice: &self.lattices[audience as usize],
            audience,
            depth: self.depth,
            care,
        }
    }

    /// Returns how much work goes into the cells below one.
    pub(super) fn care(&self, level: u32, audience: Audience) -> Care {
        let is_coarse = level <= self.lattices[audience as usize].root_level + QUICK_LEVELS;
        if is_coarse && self.refine != Refine::Eager && self.depth.early_list > 0 {
            Care::Quick
        } else {
            Care::Full
        }
    }

    /// Takes a first look at a cell at the root.
    pub(super) fn look(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        (light, audience, cell): (usize, Audience, Cell),
    ) -> Option<Link> {
        let tables = self.tables(scene.occluders, light)?;
        let refiner = self.refiner(tables, audience, Care::Quick);
        let bounds = self.lattices[audience as usize].inflated(cell);
        let gathered = refiner.casters.gather(scene.bvh, &bounds, false);
        let mut candidates = Candidates::NONE;
        refiner.casters.narrow(&gathered, &bounds, &mut candidates);
        let decision = refiner.decide_quickly(cell.level, &candidates);
        let price = match self.refine {
            Refine::Asked => 1,
            Refine::Lazy | Refine::Eager => {
                price_of(cost(QUICK_NS, candidates.triangles.len())).max(LOOK_PRICE + 1)
            }
        };
        store.write_one(&decision, price, |list| refiner.casters.side_by_side(list))
    }

    /// Makes a brick in place of a cell; `None` if there is no room.
    pub(super) fn brick(
        &self,
        store: &Store,
        scene: &Scene<'_>,
        (light, audience, cell): (usize, Audience, Cell),
    ) -> Option<Link> {
        let tables = self.tables(scene.occluders, light)?;
        let lattice = &self.lattices[audience as usize];
        let care = self.care(cell.level, audience);
        let refiner = self.refiner(tables, audience, care);
        let bounds = lattice.inflated(cell);
        let casters = &refiner.casters;
        let gathered = casters.gather(scene.bvh, &bounds, care == Care::Full);
        let mut candidates = Candidates::NONE;
        casters.narrow_holders(&gathered, &bounds, audience, &mut candidates);
        casters.narrow(&gathered, &bounds, &mut candidates);
        let decisions = refiner.decide_brick(cell, &candidates);
        let price = match self.refine {
            Refine::Asked => 0,
            Refine::Lazy | Refine::Eager => {
                let costs = match self.care(cell.level + 2, audience) {
                    Care::Quick => QUICK_NS,
                    Care::Full => FULL_NS,
                };
                price_below(&decisions, costs, candidates.count())
            }
        };
        store.write(&decisions, price, |list| {
            (care == Care::Quick)
                .then(|| casters.side_by_side(list))
                .flatten()
        })
    }
}

/// Returns the price of a brick below one that was decided so, as a power of two of units: what it will
/// cost, and more where few cells were decided.
fn price_below(decisions: &[Decision; 64], costs: [u64; 2], candidate_count: usize) -> u32 {
    let (mut asked, mut decided) = (0_u64, 0_u64);
    for decision in decisions {
        asked += u64::from(*decision != Decision::Nobody);
        decided += u64::from(!matches!(
            decision,
            Decision::Nobody | Decision::Pending | Decision::Ray
        ));
    }
    let cost_ns = cost(costs, candidate_count / 4);
    let weighed = cost_ns * asked.max(1) / decided.max(1);
    price_of(weighed)
}

/// Returns what a cell must have cost before so much is spent on it, as a power of two of units.
fn price_of(ns: u64) -> u32 {
    ((ns / HASTE) >> UNIT).max(1).ilog2() + 1
}
