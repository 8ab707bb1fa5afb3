//! Do all starts of a cell have one answer? By visibility events (README.md, section 3).
//!
//! In: the candidates of a cell. Out: the one answer, if it is proven. An answer changes along a path of
//! starts only where a contour edge comes between, where the path goes through a surface, or where a
//! surface with its own outline (curved, with holes) does. Where none of these is, one start speaks for
//! all. Absent here: bits, bricks, queries.

use std::ops::ControlFlow;

use antumbra_geometry::{
    Bounds, NO_COMPONENT, Patch, ReceiverPoint, Relation, Segment, Shaft, SurfaceId,
};

use super::candidates::{Candidates, Casters};
use super::forms::Verdict;
use super::value::ReceiverClass;

/// Cells with more surfaces or events are not tried.
const MOST_HOLDERS: usize = 48;
const MOST_CONTOURS: usize = 512;
/// More triangles are not searched for a component that covers.
const MOST_COVERS: usize = 512;

/// A cell's parts that a receiver class starts from.
pub(crate) struct Receivers<'a> {
    pub(crate) patches: Vec<Patch<'a>>,
    /// Surfaces that are no triangles.
    pub(crate) curved: Vec<SurfaceId>,
    /// Whether there are more than were looked at.
    pub(crate) are_too_many: bool,
}

impl<'a> Receivers<'a> {
    /// Returns one patch alone.
    pub(crate) fn of_patch(patch: Patch<'a>, candidates: &Candidates) -> Self {
        Self {
            patches: vec![patch],
            curved: Vec::new(),
            are_too_many: candidates.holders.len() > MOST_HOLDERS,
        }
    }

    /// Returns one surface alone that is no triangle.
    pub(crate) fn of_curved(surface: SurfaceId, candidates: &Candidates) -> Self {
        Self {
            patches: Vec::new(),
            curved: vec![surface],
            are_too_many: candidates.holders.len() > MOST_HOLDERS,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.patches.is_empty() && self.curved.is_empty() && !self.are_too_many
    }
}

impl<'a> Casters<'a> {
    /// Returns the surfaces in a cell from which a receiver class asks.
    pub(crate) fn receivers(
        &self,
        class: ReceiverClass,
        candidates: &Candidates,
        bounds: &Bounds,
    ) -> Receivers<'a> {
        let mut receivers = Receivers {
            patches: Vec::new(),
            curved: Vec::new(),
            are_too_many: candidates.holders.len() > MOST_HOLDERS,
        };
        if receivers.are_too_many {
            return receivers;
        }
        let wanted = match class {
            ReceiverClass::Front => 1,
            ReceiverClass::Back => -1,
            ReceiverClass::Free => return receivers,
        };
        for &surface in &candidates.holders {
            match self.side(surface) {
                Some(side) if side == wanted => {
                    let patch = self
                        .occluders
                        .patch(SurfaceId(surface), bounds, &self.light, side);
                    receivers.patches.extend(patch);
                }
                Some(_) => {}
                None if wanted == 1 => receivers.curved.push(SurfaceId(surface)),
                None => {}
            }
        }
        receivers
    }

    /// Returns whether all points of a cell are in shadow, or all lit.
    pub(crate) fn decide_free(&self, candidates: &Candidates, bounds: &Bounds) -> Option<bool> {
        if candidates.is_covered || !candidates.covering.is_empty() {
            return Some(true);
        }
        if candidates.triangles.is_empty() && candidates.crossing.is_empty() {
            return Some(false);
        }
        let start = ReceiverPoint {
            point: bounds.center(),
            surface: None,
        };
        self.decide_box(candidates, &start, true)
    }

    /// Returns the answer of all starts in a cell, taking the one of the middle; surfaces of the
    /// cell that are not opaque do not matter.
    fn decide_box(
        &self,
        candidates: &Candidates,
        start: &ReceiverPoint,
        are_holders_in_the_way: bool,
    ) -> Option<bool> {
        if candidates.contours.len() > MOST_CONTOURS {
            return None;
        }
        let is_opaque = |&surface: &u32| self.occluders.is_opaque(SurfaceId(surface));
        let is_clear = candidates.contours.is_empty()
            && candidates.crossing.is_empty()
            && !(are_holders_in_the_way && candidates.holders.iter().any(is_opaque))
            && !self.has_holes(candidates);
        let segment = self.occluders.segment(start, &self.light);
        if is_clear {
            return Some(self.is_blocked_by_triangle(candidates, &segment));
        }
        let dirty = candidates
            .contours
            .iter()
            .filter_map(|&contour| Some(self.contour(contour)?.edge.component))
            .collect();
        self.is_covered_by_component(candidates, dirty, &segment)
            .then_some(true)
    }

    fn has_holes(&self, candidates: &Candidates) -> bool {
        let mut triangles = candidates.triangles.iter();
        triangles.any(|&triangle| !self.blocks_everywhere(triangle))
    }

    fn is_blocked_by_triangle(&self, candidates: &Candidates, segment: &Segment) -> bool {
        candidates
            .triangles
            .iter()
            .any(|&triangle| self.occluders.blocks(SurfaceId(triangle), segment))
    }

    /// Returns whether the start is blocked by a component that has no triangle in the cell, nor an
    /// edge in the way (`dirty` lists those that have): then all starts are.
    fn is_covered_by_component(
        &self,
        candidates: &Candidates,
        mut dirty: Vec<u32>,
        segment: &Segment,
    ) -> bool {
        if candidates.triangles.len() > MOST_COVERS || candidates.holders.len() > MOST_HOLDERS {
            return false;
        }
        let triangle_count = self.occluders.triangle_count() as u32;
        let held = candidates.holders.iter().filter(|&&s| s < triangle_count);
        dirty.extend(held.map(|&surface| self.mesh.component(SurfaceId(surface))));
        dirty.push(NO_COMPONENT);
        dirty.sort_unstable();
        dirty.dedup();
        candidates.triangles.iter().any(|&triangle| {
            let component = self.mesh.component(SurfaceId(triangle));
            dirty.binary_search(&component).is_err()
                && self.occluders.blocks(SurfaceId(triangle), segment)
        })
    }

    /// Returns whether all starts on the surfaces of a cell have one answer, and which.
    pub(crate) fn decide_surfaces(
        &self,
        receivers: &Receivers<'_>,
        candidates: &Candidates,
        bounds: &Bounds,
    ) -> Option<bool> {
        if candidates.is_covered {
            return Some(true);
        }
        if receivers.are_too_many || candidates.contours.len() > MOST_CONTOURS {
            return None;
        }
        if !candidates.covering.is_empty() && receivers.curved.is_empty() {
            return Some(true);
        }
        let mut answer = None;
        let mut agrees = |one: bool| *answer.get_or_insert(one) == one;
        for &surface in &receivers.curved {
            if !agrees(self.decide_curved(surface, candidates, bounds)?) {
                return None;
            }
        }
        for patch in &receivers.patches {
            if !agrees(self.decide_patch(patch, candidates)?) {
                return None;
            }
        }
        answer
    }

    /// Returns the answer of all starts of a cell on a curved surface whose own rule lets them through.
    fn decide_curved(
        &self,
        surface: SurfaceId,
        candidates: &Candidates,
        bounds: &Bounds,
    ) -> Option<bool> {
        let is_own = |&&number: &&u32| {
            // Of a patch other parts may be in the way.
            let mut surfaces = self.occluders.surfaces_of(self.curved(number).element);
            surfaces
                .all(|other| other == surface || self.occluders.have_one_own_rule(surface, other))
        };
        if candidates.covering.iter().any(|number| !is_own(&number)) {
            return Some(true);
        }
        let is_crossed = candidates.crossing.iter().any(|number| !is_own(&number));
        let mut holders = candidates.holders.iter();
        let is_met = holders.any(|&holder| {
            self.occluders.is_opaque(SurfaceId(holder))
                && (holder as usize) < self.occluders.triangle_count()
        });
        if is_crossed || is_met {
            return None;
        }
        // Its own solid blocks nothing here, and no other curved one does: triangles decide.
        let start = ReceiverPoint {
            point: bounds.center(),
            surface: None,
        };
        let others = Candidates {
            crossing: Vec::new(),
            ..candidates.clone()
        };
        self.decide_box(&others, &start, false)
    }

    fn decide_patch(&self, patch: &Patch<'_>, candidates: &Candidates) -> Option<bool> {
        // A convex umbra that holds the corners holds the patch.
        let narrow = |point| {
            self.frame
                .point_in_frame(point)
                .to_array()
                .map(|x| x as f32)
        };
        let is_covered = candidates.triangles.iter().any(|&triangle| {
            let forms = self.umbra_forms(triangle);
            self.blocks_everywhere(triangle)
                && patch
                    .corners()
                    .all(|corner| forms.verdict(narrow(corner)) == Verdict::Inside)
        });
        if is_covered {
            return Some(true);
        }

        // Events: outlines in the way, or surfaces that the patch goes through.
        let mut dirty = Vec::new();
        for &number in &candidates.contours {
            let edge = self.contour(number).map(|contour| &contour.edge);
            if let Some(edge) = edge.filter(|edge| !patch.misses_edge(edge)) {
                dirty.push(edge.component);
            }
        }
        let mut is_clear = dirty.is_empty();
        let curved = candidates.crossing.iter().chain(&candidates.covering);
        let mut shaft = None;
        for &number in curved {
            let caster = self.curved(number);
            match caster
                .umbra
                .relation(shaft.get_or_insert_with(|| patch.shaft()))
            {
                Relation::Misses => {}
                Relation::Covers if caster.may_cover_patches => return Some(true),
                Relation::Covers | Relation::Crosses => is_clear = false,
            }
        }
        let triangle_count = self.occluders.triangle_count();
        is_clear = is_clear
            && candidates.holders.iter().all(|&holder| {
                holder as usize >= triangle_count
                    || !self.blocks_everywhere(holder)
                    || patch.is_clear_of(SurfaceId(holder))
            })
            && candidates.triangles.iter().all(|&triangle| {
                self.blocks_everywhere(triangle) || patch.misses_triangle(SurfaceId(triangle))
            });
        let start = ReceiverPoint {
            point: patch.middle(),
            surface: Some(patch.surface()),
        };
        let segment = self.occluders.segment(&start, &self.light);
        if is_clear {
            Some(self.is_blocked_by_triangle(candidates, &segment))
        } else {
            self.is_covered_by_component(candidates, dirty, &segment)
                .then_some(true)
        }
    }

    /// Returns the surfaces that may block a start of a receiver class in a cell; `None` if they are more than `most`, where
    /// one that is no triangle counts as `curved_cost` triangles.
    pub(crate) fn blockers(
        &self,
        receivers: Option<&Receivers<'_>>,
        candidates: &Candidates,
        bounds: &Bounds,
        (most, curved_cost): (usize, usize),
    ) -> Option<Vec<u32>> {
        const MOST_TRIED: usize = 4;
        const MOST_PATCHES: usize = 16;
        if candidates.triangles.len() > MOST_TRIED * most {
            return None;
        }
        let patches = match receivers {
            Some(receivers)
                if receivers.curved.is_empty()
                    && !receivers.are_too_many
                    && receivers.patches.len() <= MOST_PATCHES =>
            {
                Some(&receivers.patches)
            }
            _ => None,
        };
        let mut list: Vec<u32> = match patches {
            None => candidates.triangles.clone(),
            Some(patches) => candidates
                .triangles
                .iter()
                .copied()
                .filter(|&triangle| patches.iter().any(|patch| self.may_block(triangle, patch)))
                .collect(),
        };
        let mut cost = list.len();
        let mut cell = None;
        for &number in candidates.crossing.iter().chain(&candidates.covering) {
            if cost > most {
                return None;
            }
            let caster = self.curved(number);
            let is_missed = patches.is_some_and(|patches| {
                patches
                    .iter()
                    .all(|patch| caster.umbra.relation(&patch.shaft()) == Relation::Misses)
            });
            if !is_missed {
                let surfaces = &self.occluders.elements()[caster.element.0 as usize].surfaces;
                let first = list.len();
                // Of the parts of a patch few are in the way.
                let cell = cell.get_or_insert_with(|| Shaft::new(*bounds, self.light));
                let has_parts = caster.umbra.try_for_each_part(cell, |part| {
                    list.push(surfaces.start + part);
                    match cost + curved_cost * (list.len() - first) > most {
                        true => ControlFlow::Break(()),
                        false => ControlFlow::Continue(()),
                    }
                });
                if !has_parts {
                    list.extend(surfaces.clone());
                }
                cost += curved_cost * (list.len() - first);
            }
        }
        (cost <= most).then_some(list)
    }

    fn may_block(&self, triangle: u32, patch: &Patch<'_>) -> bool {
        let surface = SurfaceId(triangle);
        if self.mesh.flat_group(surface) == self.mesh.flat_group(patch.surface()) {
            return false;
        }
        let narrow = |point| {
            self.frame
                .point_in_frame(point)
                .to_array()
                .map(|x| x as f32)
        };
        let forms = self.umbra_forms(triangle);
        let outside = patch
            .corners()
            .fold(0b1111, |bits, corner| bits & forms.outside(narrow(corner)));
        outside == 0 && !patch.misses_triangle(surface)
    }
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, Sphere};

    use super::super::lattice::{Cell, Lattice};
    use super::super::room::Room;
    use super::super::tables::{LightTables, SceneTables, Tables};
    use super::super::testing::Random;
    use super::*;
    use crate::accel::bvh::Bvh;
    use crate::accel::frame::Frame;

    /// Triangles that share corners, doubled ones, panes, balls; numbers are whole half the time.
    fn scene(random: &mut Random) -> Occluders {
        let mut builder = Occluders::builder();
        let is_whole = random.below(2) == 0;
        let point = |random: &mut Random| {
            let point = 3.0 * random.in_cube();
            if is_whole { point.round() } else { point }
        };
        let pool: Vec<DVec3> = (0..7).map(|_| point(random)).collect();
        let opacity = |random: &mut Random| match random.below(6) {
            0 => Opacity::Transparent,
            _ => Opacity::Opaque,
        };
        for _ in 0..1 + random.below(10) {
            let corners = [(); 3].map(|()| pool[random.below(pool.len())]);
            builder.add_face(&corners, opacity(random)).expect("a face");
        }
        for _ in 0..random.below(4) {
            let center = point(random);
            let radius = random.pick(&[0.0, 0.2, 0.5, 1.0, 2.0]);
            let sphere = Sphere { center, radius };
            builder
                .add_sphere(sphere, opacity(random))
                .expect("a sphere");
        }
        builder.build()
    }

    /// Starts in a box: of space, or on a surface.
    fn starts(
        occluders: &Occluders,
        surface: Option<SurfaceId>,
        bounds: &Bounds,
        light: &LightShape,
        random: &mut Random,
    ) -> Vec<ReceiverPoint> {
        let mut points: Vec<DVec3> = Vec::new();
        match surface.map(|surface| (surface, occluders.sphere(surface))) {
            None => {
                points.extend(bounds.corners());
                points.extend((0..8).map(|_| random.in_box(bounds)));
            }
            Some((_, Some(sphere))) => {
                for _ in 0..20 {
                    let seen = random.in_box(bounds) - sphere.center;
                    points.push(sphere.center + sphere.radius * seen.normalize_or_zero());
                }
            }
            Some((surface, None)) => {
                let side = occluders.light_sides(light)[surface.0 as usize];
                let patch = occluders.patch(surface, bounds, light, side);
                let corners: Vec<DVec3> = patch.iter().flat_map(|p| p.corners()).collect();
                if !corners.is_empty() {
                    for _ in 0..12 {
                        let [a, b, c] = [(); 3].map(|()| corners[random.below(corners.len())]);
                        let between = a + random.real(0.0, 1.0) * (b - a);
                        points.push(between + random.real(0.0, 1.0) * (c - between));
                    }
                    points.extend(corners);
                }
            }
        }
        points.retain(|&point| bounds.contains(point));
        let start = |point| ReceiverPoint { point, surface };
        points.into_iter().map(start).collect()
    }

    fn holds(casters: &Casters<'_>, candidates: &Candidates, surface: SurfaceId) -> bool {
        let curved = candidates.crossing.iter().chain(&candidates.covering);
        candidates.triangles.contains(&surface.0)
            || curved
                .map(|&number| casters.curved(number).element)
                .any(|element| casters.occluders.surfaces_of(element).any(|s| s == surface))
    }

    /// The classifier against the exact rule, without bricks, codes and filters of queries between:
    /// what blocks a start of a cell is a candidate and in its list, and what is decided holds for all.
    #[test]
    fn what_is_said_of_a_cell_holds_for_its_starts() {
        let random = &mut Random(1);
        // By receiver class, lit and shadowed.
        let mut decided = [[0; 2]; 3];
        let mut listed = [0; 3];
        for round in 0..1_500 {
            let occluders = scene(random);
            let bounds = occluders.bounds();
            let light = random.light(&Bounds {
                min: DVec3::splat(-3.0),
                max: DVec3::splat(3.0),
            });
            let frame = Frame::new(bounds);
            if bounds.size().max_element() == 0.0 {
                continue;
            }
            let lattice = Lattice::new(&bounds, &frame, 8);
            let scene = SceneTables::new(&occluders, &frame, true);
            let of_light = LightTables::new(&occluders, &frame, &light);
            let room = Room::new(u64::MAX);
            assert!(of_light.make_edges(&scene, &occluders, (&frame, &light), &room));
            let tables = Tables::new(&occluders, &frame, &light, &scene, &of_light);
            let casters = Casters::new(tables);
            let bvh = Bvh::build(&occluders);
            for _ in 0..12 {
                // A cell about a surface or anywhere, reached from cell to cell.
                let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
                let around = match random.below(3) {
                    0 => bounds,
                    _ => occluders.surface_bounds(surface),
                };
                let target = random.in_box(&around);
                let mut cell = Cell::ROOT;
                let mut candidates = casters.gather(&bvh, &lattice.inflated(cell));
                for _ in 0..random.below(8) {
                    let holds = |cell: &Cell| lattice.inflated(*cell).contains(target);
                    if let Some(child) = cell.children().into_iter().find(holds) {
                        cell = child;
                        let bounds = lattice.inflated(cell);
                        if random.below(2) == 0 {
                            let mut kept = Candidates::NONE;
                            casters.narrow_holders(
                                &candidates,
                                &bounds,
                                ReceiverClass::Free,
                                &mut kept,
                            );
                            casters.narrow(&candidates, &bounds, &mut kept);
                            candidates = kept;
                        } else {
                            candidates = casters.gather(&bvh, &bounds);
                        }
                    }
                }
                let bounds = lattice.inflated(cell);
                for class in ReceiverClass::ALL {
                    let receivers = casters.receivers(class, &candidates, &bounds);
                    let (answer, list, surfaces) = if class == ReceiverClass::Free {
                        let answer = casters.decide_free(&candidates, &bounds);
                        let list = casters.blockers(None, &candidates, &bounds, (8, 1));
                        (answer, list, vec![None])
                    } else if receivers.is_empty() {
                        continue;
                    } else {
                        let answer = casters.decide_surfaces(&receivers, &candidates, &bounds);
                        let list = casters.blockers(Some(&receivers), &candidates, &bounds, (8, 1));
                        let flat = receivers.patches.iter().map(Patch::surface);
                        let all = flat.chain(receivers.curved.iter().copied());
                        (answer, list, all.map(Some).collect())
                    };
                    for surface in surfaces {
                        for start in starts(&occluders, surface, &bounds, &light, random) {
                            let segment = occluders.segment(&start, &light);
                            if occluders.own_rule_blocks(&segment) {
                                continue;
                            }
                            let context = || {
                                let triangles = occluders.surfaces().map(|s| {
                                    (occluders.triangle_positions(s), occluders.sphere(s))
                                });
                                format!(
                                    "{round} {class:?} {start:?} {light:?} {cell:?} {:?}",
                                    triangles.collect::<Vec<_>>()
                                )
                            };
                            let mut is_blocked = false;
                            for other in occluders.surfaces() {
                                if !occluders.blocks(other, &segment) {
                                    continue;
                                }
                                is_blocked = true;
                                assert!(
                                    holds(&casters, &candidates, other),
                                    "{other:?} {}",
                                    context()
                                );
                                if let Some(list) = &list {
                                    assert!(list.contains(&other.0), "{other:?} {}", context());
                                    listed[class as usize] += 1;
                                }
                            }
                            if let Some(answer) = answer {
                                assert_eq!(answer, is_blocked, "{}", context());
                                decided[class as usize][usize::from(answer)] += 1;
                            }
                        }
                    }
                }
            }
        }
        assert!(
            decided
                .iter()
                .flatten()
                .chain(&listed)
                .all(|&count| count > 1_000),
            "{decided:?} {listed:?}"
        );
    }
}
