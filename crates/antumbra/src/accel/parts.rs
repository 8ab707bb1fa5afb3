//! Which surfaces the accelerators hold together, and which lie too far out for that.
//!
//! In: the surfaces. Out: those that lie close together (`near`), which grid, tree and values are built over,
//! and few groups of others (`Zone`), each with a tree of its own, or tested one by one. What a tree, a grid or a
//! value loses to rounding is a share of the extent of what it holds: one far triangle would blur all others.
//!
//! A query is blocked if a near surface blocks it or a far one does. `near` keeps the numbers of all surfaces, but
//! far ones block nothing there and are in no box. Invariants: every surface is in one part; which one is a
//! function of the scene and the method. Absent here: what blocks, which is the rule's.

use std::sync::Arc;

use antumbra_geometry::{
    Bounds, DVec3, ElementId, Hit, LightShape, Occluders, ReceiverPoint, Segment, SurfaceId,
};

use crate::Counters;
use crate::accel::bvh::Bvh;
use crate::accel::grid::{Layout, nearest_of};
use crate::accel::sweep::may_meet;

/// Smaller scenes stay whole: testing every surface costs no more.
const FEWEST_ELEMENTS: usize = 64;

/// Zones at most; what is left when there are so many is one of them.
const MOST_ZONES: usize = 6;

/// So few surfaces of a zone have no tree.
const FEW: usize = 8;

/// How far out is far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Split {
    /// For trees and values: 2^10 extents, where boxes are blurred by a share of 2^-10 of the others. Up to half
    /// of the elements may be far.
    Wide,
    /// For grids, whose voxels are a share of the whole: 2^5 extents, for one element in 64.
    Narrow,
}

impl Split {
    fn bits(self) -> i32 {
        match self {
            Self::Wide => 10,
            Self::Narrow => 5,
        }
    }

    fn most_far(self, count: usize) -> usize {
        match self {
            Self::Wide => count / 2,
            Self::Narrow => count / 64,
        }
    }
}

/// The surfaces of a scene, those that lie close together apart from the others.
#[derive(Debug)]
pub(crate) struct Parts {
    /// All surfaces, the far ones left out.
    pub(crate) near: Arc<Occluders>,
    near_box: NearBox,
    zones: Vec<Zone>,
}

/// Where starts on near surfaces lie.
#[derive(Clone, Copy, Debug)]
struct NearBox {
    /// The box of the near surfaces, and a little more: points are rounded.
    points: Bounds,
    /// A box that holds the exact start (EXACTNESS.md, "The start") of every point in `points` on a near surface.
    ///
    /// On a triangle it is a point of that triangle. Else it is the point itself, or, on a disk or a cap, the point
    /// moved along the axis of the largest component of the plane's normal by at most sqrt(3) times the distance of
    /// the plane's own point, which is in `points` as well. Twice the extents leave room for every rounding.
    starts: Bounds,
}

impl NearBox {
    const NONE: Self = Self {
        points: Bounds::EMPTY,
        starts: Bounds::EMPTY,
    };

    fn new(near: &Occluders) -> Self {
        let bounds = near.bounds();
        let extents = bounds.size().element_sum();
        Self {
            points: bounds.inflated(DVec3::splat(extents / 1024.0)),
            starts: bounds.inflated(DVec3::splat(2.0 * extents)),
        }
    }
}

/// Far surfaces that lie close together themselves.
#[derive(Debug)]
struct Zone {
    /// Their box, with room for every rounding.
    bounds: Bounds,
    surfaces: Vec<SurfaceId>,
    tree: Option<Bvh>,
}

impl Parts {
    /// Parts the surfaces of a scene.
    pub(crate) fn new(all: &Arc<Occluders>, split: Split) -> Self {
        let mut groups = groups(all, split);
        // Also there can be nothing near.
        if groups.len() <= 1 {
            return Self {
                near: all.clone(),
                near_box: NearBox::NONE,
                zones: Vec::new(),
            };
        }
        let far = groups.split_off(1);
        let left_out: Vec<ElementId> = far.iter().flatten().copied().collect();
        let zones = far.iter().map(|elements| Zone::new(all, elements));
        let zones = zones.collect();
        let near = Arc::new(all.without(&left_out));
        Self {
            near_box: NearBox::new(&near),
            zones,
            near,
        }
    }

    /// Returns the box that the near part of a scene has.
    pub(crate) fn near_bounds(all: &Occluders, split: Split) -> Bounds {
        match &*groups(all, split) {
            [near, _, ..] => bounds_of(all, near),
            _ => all.bounds(),
        }
    }

    /// Returns whether every surface is near.
    #[inline(always)]
    pub(crate) fn is_whole(&self) -> bool {
        self.zones.is_empty()
    }

    /// Returns whether a start lies on a far surface: values and grid know nothing of it.
    #[inline(always)]
    pub(crate) fn is_far(&self, start: &ReceiverPoint) -> bool {
        !self.is_whole()
            && start
                .surface
                .is_some_and(|surface| self.near.is_left_out(surface))
    }

    /// Returns whether a far surface blocks. Own rules have been asked before.
    #[inline]
    pub(crate) fn far_blocks(
        &self,
        all: &Occluders,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> bool {
        if self.is_whole() {
            return false;
        }
        let starts = around(all, std::slice::from_ref(start));
        let mut zones = self.zones.iter();
        zones.any(|zone| {
            may_meet(&starts, light, &zone.bounds) && zone.blocks(all, start, light, counters)
        })
    }

    /// Returns all far surfaces.
    pub(crate) fn far_surfaces(&self) -> impl Iterator<Item = SurfaceId> {
        let zones = self.zones.iter();
        zones.flat_map(|zone| zone.surfaces.iter().copied())
    }

    /// Marks the starts that far surfaces block and returns how many these are. None of the starts is on a far surface.
    pub(crate) fn mark_blocked(
        &self,
        all: &Occluders,
        starts: &[ReceiverPoint],
        light: &LightShape,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> u64 {
        const TOGETHER: usize = 64;
        if self.is_whole() {
            return 0;
        }
        let near = &self.near_box;
        let is_near_free = !self.may_block(&near.starts, light);
        let mut count = 0;
        let chunks = starts
            .chunks(TOGETHER)
            .zip(is_shadowed.chunks_mut(TOGETHER));
        for (starts, is_shadowed) in chunks {
            if is_near_free && starts.iter().all(|start| near.points.contains(start.point)) {
                continue;
            }
            let bounds = around(all, starts);
            let mut zones = self.zones.iter();
            if !zones.any(|zone| may_meet(&bounds, light, &zone.bounds)) {
                continue;
            }
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                if !*is_shadowed && self.far_blocks(all, start, light, counters) {
                    *is_shadowed = true;
                    count += 1;
                }
            }
        }
        count
    }

    /// Returns whether a far surface may block some start in a box.
    pub(crate) fn may_block(&self, bounds: &Bounds, light: &LightShape) -> bool {
        let mut zones = self.zones.iter();
        zones.any(|zone| may_meet(bounds, light, &zone.bounds))
    }

    /// Returns the nearest of a hit on the near surfaces and of all far ones.
    pub(crate) fn nearest(
        &self,
        all: &Occluders,
        segment: &Segment,
        near: Option<Hit>,
        counters: &mut Counters,
    ) -> Option<Hit> {
        self.zones_along(segment).fold(near, |best, zone| {
            let Some(tree) = &zone.tree else {
                counters.intersections += zone.surfaces.len() as u64;
                return nearest_of(all, zone.surfaces.iter().copied(), segment, best);
            };
            let far = tree.nearest(all, segment, counters);
            match (best, far) {
                (Some(best), Some(far))
                    if (far.distance, far.surface) < (best.distance, best.surface) =>
                {
                    Some(far)
                }
                (None, far) => far,
                (best, _) => best,
            }
        })
    }

    /// Visits every far surface that a segment crosses.
    pub(crate) fn all(
        &self,
        all: &Occluders,
        segment: &Segment,
        counters: &mut Counters,
        visit: &mut impl FnMut(Hit),
    ) {
        for zone in self.zones_along(segment) {
            if let Some(tree) = &zone.tree {
                tree.all(all, segment, counters, &mut *visit);
                continue;
            }
            counters.intersections += zone.surfaces.len() as u64;
            for &surface in &zone.surfaces {
                if all.crosses(surface, segment) {
                    visit(all.hit(surface, segment));
                }
            }
        }
    }

    fn zones_along(&self, segment: &Segment) -> impl Iterator<Item = &Zone> {
        let start = segment.origin();
        let start = Bounds {
            min: start,
            max: start,
        }
        .inflated(DVec3::splat(segment.origin_error()));
        let light = LightShape::Direction(segment.direction());
        let zones = self.zones.iter();
        zones.filter(move |zone| may_meet(&start, &light, &zone.bounds))
    }

    /// Visits at least the far surfaces within `reach` of a point, as [`Bvh::visit_near`] does.
    pub(crate) fn visit_near(
        &self,
        point: DVec3,
        mut reach: f64,
        visit: &mut impl FnMut(SurfaceId) -> f64,
    ) {
        for zone in &self.zones {
            let around = zone.bounds.inflated(DVec3::splat(reach));
            if !around.contains(point) {
                continue;
            }
            match &zone.tree {
                Some(tree) => tree.visit_near(point, reach, |surface| {
                    reach = visit(surface);
                    reach
                }),
                None => {
                    for &surface in &zone.surfaces {
                        reach = visit(surface);
                    }
                }
            }
        }
    }
}

impl Zone {
    fn new(all: &Occluders, elements: &[ElementId]) -> Self {
        let surfaces: Vec<SurfaceId> = elements
            .iter()
            .flat_map(|&element| all.surfaces_of(element))
            .collect();
        let bounds = bounds_of(all, elements);
        let margin = Layout::margin_of(&bounds);
        Self {
            bounds: bounds.inflated(DVec3::splat(margin)),
            tree: (surfaces.len() > FEW).then(|| Bvh::build_of(all, &surfaces)),
            surfaces,
        }
    }

    fn blocks(
        &self,
        all: &Occluders,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> bool {
        if let Some(tree) = &self.tree {
            return tree.any_hit(all, start, light, counters);
        }
        counters.intersections += self.surfaces.len() as u64;
        let segment = all.segment(start, light);
        let mut surfaces = self.surfaces.iter();
        surfaces.any(|&surface| all.blocks(surface, &segment))
    }
}

/// Returns a box that holds the exact starts.
fn around(all: &Occluders, starts: &[ReceiverPoint]) -> Bounds {
    starts.iter().fold(Bounds::EMPTY, |bounds, start| {
        let point = Bounds {
            min: start.point,
            max: start.point,
        };
        bounds.union(point.inflated(DVec3::splat(all.start_offset(start))))
    })
}

fn bounds_of(all: &Occluders, elements: &[ElementId]) -> Bounds {
    let bounds = elements.iter().map(|&element| all.element_bounds(element));
    bounds.fold(Bounds::EMPTY, Bounds::union)
}

/// Returns the elements in groups that lie close together, the near ones first, those of a group in order.
fn groups(all: &Occluders, split: Split) -> Vec<Vec<ElementId>> {
    let count = all.elements().len();
    if count < FEWEST_ELEMENTS {
        return Vec::new();
    }
    let of_number = |number: u32| ElementId(number);
    let Some((near, mut rest)) = nearer(all, (0..count as u32).map(of_number), count, split) else {
        return Vec::new();
    };
    let mut groups = vec![near];
    while groups.len() <= MOST_ZONES && rest.len() >= FEWEST_ELEMENTS {
        let all_left = rest.iter().copied();
        let Some((near, left)) = nearer(all, all_left, rest.len(), Split::Wide) else {
            break;
        };
        groups.push(near);
        rest = left;
    }
    groups.push(rest);
    groups
}

/// Parts elements into those that lie close together and the others; `None` if that are none.
///
/// Counts how many reach how far from their middle, in powers of two: where there is nothing far inside of
/// the farthest, these are apart, one time after another.
fn nearer(
    all: &Occluders,
    elements: impl Iterator<Item = ElementId> + Clone,
    count: usize,
    split: Split,
) -> Option<(Vec<ElementId>, Vec<ElementId>)> {
    const SAMPLES: usize = 4096;
    let samples: Vec<DVec3> = elements
        .clone()
        .step_by(count.div_ceil(SAMPLES))
        .map(|element| all.element_bounds(element).center())
        .collect();
    // Half of the elements are on each side of it along each axis.
    let middle = DVec3::from_array(std::array::from_fn(|axis| {
        let mut places: Vec<f64> = samples.iter().map(|sample| sample[axis]).collect();
        let half = places.len() / 2;
        *places.select_nth_unstable_by(half, f64::total_cmp).1
    }));
    let reach_of = |element: ElementId| {
        let bounds = all.element_bounds(element);
        let reach = (bounds.min - middle).abs().max((bounds.max - middle).abs());
        exponent(reach.max_element())
    };
    if is_close(elements.clone().map(reach_of), split.most_far(count), {
        let bounds = all.bounds();
        let reach = (bounds.min - middle).abs().max((bounds.max - middle).abs());
        (exponent(reach.max_element())).saturating_sub(split.bits() as usize)
    }) {
        return None;
    }
    let mut counts = vec![0_usize; 2048];
    for element in elements.clone() {
        counts[reach_of(element)] += 1;
    }
    let farthest = counts.iter().rposition(|&count| count > 0)?;
    let (mut most, mut kept) = (farthest, count);
    loop {
        let next = most.saturating_sub(split.bits() as usize);
        let inside: usize = counts[..=next].iter().sum();
        if most == 0 || count - inside > split.most_far(count) || inside == 0 {
            break;
        }
        most = counts[..=next].iter().rposition(|&count| count > 0)?;
        kept = inside;
    }
    if kept == count {
        return None;
    }
    let (near, far) = elements.partition(|&element| reach_of(element) <= most);
    Some((near, far))
}

/// Returns whether more elements than may be far reach farther than some distance, for which about so many need to
/// be looked at.
fn is_close(reaches: impl Iterator<Item = usize>, most_far: usize, distance: usize) -> bool {
    reaches
        .filter(|&reach| reach > distance)
        .nth(most_far)
        .is_some()
}

/// Returns the exponent of a number that is not negative, as its bits have it.
fn exponent(x: f64) -> usize {
    (x.to_bits() >> 52 & 0x7ff) as usize
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Cone, Disk, Opacity};

    use super::*;
    use crate::occlusion::testing::Random;

    /// Surfaces of all kinds in a unit cube, and a triangle far out.
    fn scene(random: &mut Random) -> Arc<Occluders> {
        let mut builder = Occluders::builder();
        for number in 0..2 * FEWEST_ELEMENTS {
            let center = random.of_cube();
            // Nearly along three axes at once, too.
            let normals = [random.of_cube(), DVec3::new(1.0, 1.0, 1.0 - 1e-15)];
            let added = match number % 4 {
                0 => builder.add_disk(
                    Disk {
                        center,
                        normal: random.pick(&normals),
                        radius: 0.1,
                    },
                    Opacity::Opaque,
                ),
                1 => builder.add_cone(
                    Cone {
                        base: center,
                        base_radius: 0.1,
                        apex: random.of_cube(),
                        apex_radius: 0.05,
                        is_closed: true,
                    },
                    Opacity::Opaque,
                ),
                _ => {
                    let corners = [(); 3].map(|()| center + 0.1 * random.of_cube());
                    builder.add_face(&corners, Opacity::Opaque)
                }
            };
            added.expect("a surface");
        }
        let far = [DVec3::X, DVec3::Y, DVec3::Z].map(|corner| 1e6 * (corner + DVec3::ONE));
        builder.add_face(&far, Opacity::Opaque).expect("a face");
        Arc::new(builder.build())
    }

    #[test]
    fn exact_starts_on_near_surfaces_lie_in_the_box_of_near_starts() {
        let random = &mut Random(5);
        let mut moved_count = 0;
        for _ in 0..20 {
            let all = scene(random);
            let parts = Parts::new(&all, Split::Wide);
            assert!(!parts.is_whole());
            let NearBox { points, starts } = parts.near_box;
            for surface in parts.near.present_surfaces() {
                for _ in 0..20 {
                    // Corners as well.
                    let shares = [random.of_cube().signum(), random.of_cube()];
                    let share = random.pick(&shares);
                    let point = points.center() + 0.5 * points.size() * share;
                    let point = point.clamp(points.min, points.max);
                    let start = ReceiverPoint {
                        point,
                        surface: Some(surface),
                    };
                    let segment = all.segment(&start, &LightShape::Direction(DVec3::Z));
                    assert!(starts.contains(segment.origin()), "{start:?}");
                    moved_count += u32::from(!points.contains(segment.origin()));
                }
            }
        }
        // Disks and caps move points out of the box of the surfaces.
        assert!(moved_count > 100, "{moved_count}");
    }
}
