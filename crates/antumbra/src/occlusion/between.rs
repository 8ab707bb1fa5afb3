//! What is known of all points between two.
//!
//! In: two points, a light. Out: the one answer of all points of space between them, if it is known. Invariant: it is the
//! reference's at each of them, and at points that are off by the rounding of `f64`. Cells are convex, and so is what
//! a value, a threshold, a form or a plane tells of them: what holds at both ends holds between. Absent here: rays. Paper 7.2.

use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use fearless_simd::{Simd, dispatch};

use super::adaptive::AdaptiveValues;
use super::bricks::{Leaf, Store};
use super::forms::Verdict;
use super::lookup::{Listed, Lookup, Source};
use super::map::{Map, NOWHERE, Told, rough_depth};
use super::value::ReceiverClass;

/// Coordinates of points in the frame are smaller, where forms are known well.
const NEAR: f32 = 1.25;

/// Sums of three products err by less, in shares of the largest product.
const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

/// Heights over a triangle that is no needle err by less, in shares of the largest distance.
const OF_HEIGHTS: f64 = 1.0 / (1_u64 << 26) as f64;

/// The points between two, and where the light is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Between {
    pub(crate) ends: [DVec3; 2],
    light: LightShape,
    /// From the first to the second, at length one.
    ahead: DVec3,
}

impl Between {
    pub(crate) fn new(ends: [DVec3; 2], light: LightShape) -> Self {
        let way = ends[1] - ends[0];
        Self {
            ends,
            light,
            ahead: way / way.length(),
        }
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.ends[0] + self.ends[1])
    }

    /// Returns how far the points are from the middle at most, in any coordinate.
    fn reach(&self) -> f64 {
        let middle = self.middle();
        let far = self.ends.map(|end| (end - middle).abs().max_element());
        far[0].max(far[1])
    }

    /// Returns whether a surface surely blocks none of the points: it is wholly behind the first, seen along the way to the
    /// second, with the light before it; or it is a triangle, and they lie on the light's side of its plane.
    pub(crate) fn is_clear_of(&self, occluders: &Occluders, surface: SurfaceId) -> bool {
        match occluders.triangle_positions(surface) {
            Some(corners) => self.is_before(corners) || self.is_over(occluders, surface, corners),
            None => match occluders.sphere(surface) {
                Some(ball) => self.is_before([ball.center + ball.radius * self.ahead]),
                None => {
                    let bounds = occluders.surface_bounds(surface);
                    // The corner farthest along the way.
                    let is_ahead = self.ahead.cmpgt(DVec3::ZERO);
                    self.is_before([DVec3::select(is_ahead, bounds.max, bounds.min)])
                }
            },
        }
    }

    /// Returns whether a plane across the way has the points and the light on one side and some others on the other.
    fn is_before<const N: usize>(&self, others: [DVec3; N]) -> bool {
        let largest = |points: &[DVec3]| {
            let all = points.iter().map(|point| point.abs().max_element());
            all.fold(0.0, f64::max)
        };
        let highest = others.map(|point| point.dot(self.ahead));
        let highest = highest.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let room = ROUNDING * largest(&others).max(largest(&self.ends));
        let is_light_before = match self.light {
            LightShape::Point(light) => {
                light.dot(self.ahead) > highest + room + ROUNDING * largest(&[light])
            }
            LightShape::Direction(direction) => {
                direction.dot(self.ahead) > ROUNDING * largest(&[direction])
            }
        };
        // Not for what is no number.
        is_light_before
            && self
                .ends
                .iter()
                .all(|end| end.dot(self.ahead) > highest + room)
    }

    /// Returns whether all points lie on the light's side of a triangle's plane, or the plane holds the light.
    fn is_over(&self, occluders: &Occluders, surface: SurfaceId, [a, b, c]: [DVec3; 3]) -> bool {
        let on_it = ReceiverPoint {
            point: a,
            surface: Some(surface),
        };
        let side = f64::from(occluders.light_side(&on_it, &self.light));
        if side == 0.0 {
            return true;
        }
        let (f, g) = (b - a, c - a);
        let normal = f.cross(g);
        let size = normal.abs().max_element();
        let products = f.abs().max_element() * g.abs().max_element();
        let is_good = size > products * 2_f64.powi(-20) && size > 1e-250;
        let is_over = |end: &DVec3| {
            let from_corner = *end - a;
            let room =
                OF_HEIGHTS * from_corner.abs().max_element() + ROUNDING * end.abs().max_element();
            side * (normal / size).dot(from_corner) > room
        };
        is_good && self.ends.iter().all(is_over)
    }
}

impl AdaptiveValues {
    /// Returns whether all points between two are in shadow, or none is, if that is known. Values that are packed are not asked.
    pub(crate) fn known_between(
        &self,
        occluders: &Occluders,
        between: &Between,
        light: usize,
    ) -> Option<bool> {
        let known = self.known(light)?;
        let lists = &*known.lists;
        let tables = self.tables(occluders, light, lists)?;
        let map = lists.map().filter(|_| self.has_maps());
        dispatch!(self.level, simd => {
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            match (map, &known.store) {
                (Some(map), _) => lookup.between_in_map(map, between),
                (None, Some(store)) => lookup.between_in_store(store, between),
                (None, None) => None,
            }
        })
    }
}

impl<S: Simd> Lookup<'_, S> {
    /// Returns what a map knows of points that have one cell of it.
    #[inline(always)]
    fn between_in_map(&self, map: &Map, between: &Between) -> Option<bool> {
        let ends = between.ends.map(|end| self.values.narrow(end));
        if !ends.as_flattened().iter().all(|x| x.abs() < NEAR) {
            return None;
        }
        let [first, second] = ends;
        let places = [0, 1, 2].map(|axis| {
            let mut places = [second[axis]; 8];
            places[0] = first[axis];
            places
        });
        let located = map.locate(self.simd, &places);
        let tile = located.tiles[0];
        if tile == NOWHERE || tile != located.tiles[1] {
            return None;
        }
        let (words, cells) = map.words(self.simd, &located);
        let place = |end: usize| (words[end], cells[end]);
        if place(0) != place(1) {
            return None;
        }
        let told = [0, 1].map(|end| map.told((&located, end), place(end), false));
        let word = match told {
            [Told::Is(first), Told::Is(second)] if first == second => return Some(first),
            [Told::List(first), Told::List(second)] if first == second => first,
            _ => return None,
        };
        let list = map.list(tile, word);
        let depths = [located.depths[0], located.depths[1]];
        if depths.iter().all(|&depth| depth > list.full) {
            return Some(true);
        }
        let depths = depths.map(rough_depth);
        for number in 0..list.counts[1] {
            let entries = depths.map(|depth| list.entry(number, depth));
            if entries.iter().all(|&(_, may_block)| !may_block) {
                continue;
            }
            match self.verdict_between(entries[0].0, ends, between) {
                Verdict::Outside => {}
                Verdict::Inside => return Some(true),
                Verdict::Doubt => return None,
            }
        }
        Some(false)
    }

    /// Returns what values know of points that have one cell.
    #[inline(always)]
    fn between_in_store(&self, store: &Store, between: &Between) -> Option<bool> {
        let lattice = &self.values.lattices[ReceiverClass::Free as usize];
        let ends = between.ends.map(|end| self.values.narrow(end));
        let [first, second] = ends.map(|end| lattice.code_of(self.simd, end));
        let finder = store.finder(ReceiverClass::Free, lattice);
        let leaf = finder.find(first);
        if leaf == Leaf::OUTSIDE {
            return None;
        }
        // Finer at most than the leaf, if more was made meanwhile.
        let level = finder.level_of(first, lattice);
        if first.number(level) != second.number(level) {
            return None;
        }
        if let Some(is_shadowed) = leaf.link.answer() {
            return Some(is_shadowed);
        }
        for entry in store.list(leaf.link.list()?) {
            match self.verdict_between(entry.surface(), ends, between) {
                Verdict::Outside => {}
                Verdict::Inside => return Some(true),
                Verdict::Doubt => return None,
            }
        }
        Some(false)
    }

    /// Returns whether a surface blocks all of some points, or none, if that is sure.
    #[inline(always)]
    fn verdict_between(
        &self,
        surface: SurfaceId,
        ends: [[f32; 3]; 2],
        between: &Between,
    ) -> Verdict {
        let told = match self.tables.umbra_forms(surface.0 as usize) {
            Some(forms) => match forms.verdict_between(ends) {
                Verdict::Inside if !self.occluders.is_opaque_everywhere(surface) => Verdict::Doubt,
                told => told,
            },
            None => {
                let start = ReceiverPoint {
                    point: between.middle(),
                    surface: None,
                };
                self.curved_verdict_within(surface, &start, start.point, between.reach())
            }
        };
        if told != Verdict::Doubt {
            return told;
        }
        match between.is_clear_of(self.occluders, surface) {
            true => Verdict::Outside,
            false => Verdict::Doubt,
        }
    }
}
