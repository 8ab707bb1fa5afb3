//! Any-hit for many starts and one light.
//!
//! In: starts. Out: the bits of [`Bvh::any_hit`] for each. Starts are prepared sixteen at a time; those that
//! lie close together walk the tree as one ([`Hull`]), and each asks only for the leaves whose boxes it
//! meets itself. Where neighbours in the caller's order do not lie close together they are put in
//! order first ([`Order`]).
//!
//! Invariants: whoever walks visits every leaf that one of its segments may meet (`hull`), and every
//! segment is tested against all leaves that it meets (`ray`). What blocked the last segment is asked first; a
//! surface that blocks decides wherever it is found. A node that several visit together is one step;
//! a triangle is tested once for each segment.

use antumbra_geometry::{LightShape, Occluders, ReceiverPoint};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, u32x16};

use super::data::{Bvh, Child, ChildKind, Members, Node, TriangleGroup, WIDTH};
use super::filter::{self, Verdicts};
use super::hull::Hull;
use super::offsets::offsets;
use super::order::{self, FARTHEST_APART, Order, WINDOW};
use super::rays::{RAYS, Rays};
use super::walk::{Question, USUAL_DEPTH, Waiting, enters};
use crate::Counters;

/// Nor do those farther apart than so many groups side by side, if all groups lie in a square as wide as the frame:
/// together they would walk through much that none of them meets alone.
const MOST_GROUPS_APART: f32 = 12.0;

/// As many segments are tested against a triangle together.
const MANY: u32 = 4;

/// So few segments ask for themselves.
const FEW: u32 = 2;

impl Bvh {
    /// Answers for each start whether an opaque surface blocks the segment to the light. Own rules have
    /// been asked before; starts that they shadow are marked so, and left as they are.
    pub(crate) fn any_hits(
        &self,
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: &LightShape,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        if self.nodes.is_empty() || self.depth > USUAL_DEPTH {
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                antumbra_task::check();
                *is_shadowed = *is_shadowed || self.any_hit(occluders, start, light, counters);
            }
            return;
        }
        let mut many = Many {
            bvh: self,
            occluders,
            light,
            farthest_apart: FARTHEST_APART.min(self.farthest_by_groups()),
            last: Child::NONE,
            steps: 0,
            tests: 0,
        };
        dispatch!(self.level, simd => many.answer_all(simd, starts, is_shadowed, counters));
        counters.steps += many.steps;
        counters.intersections += many.tests;
    }

    fn farthest_by_groups(&self) -> f32 {
        let group_count = self.triangles.len() + self.spheres.len() + self.others.len();
        2.0 * MOST_GROUPS_APART / (group_count as f32).sqrt()
    }
}

struct Many<'a> {
    bvh: &'a Bvh,
    occluders: &'a Occluders,
    light: &'a LightShape,
    /// Starts that walk together lie no farther apart, in the frame's units.
    farthest_apart: f32,
    /// The leaf that blocked the last segment that was blocked.
    last: Child,
    steps: u64,
    tests: u64,
}

impl Many<'_> {
    #[inline(always)]
    fn answer_all<S: Simd>(
        &mut self,
        simd: S,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        if !order::is_scattered(&self.bvh.frame, starts) {
            let sixteens = starts.chunks(RAYS).zip(is_shadowed.chunks_mut(RAYS));
            for (starts, is_shadowed) in sixteens {
                self.answer(simd, starts, is_shadowed, counters);
            }
            return;
        }
        let mut order = Order::default();
        let mut near = [starts[0]; RAYS];
        let mut found = [false; RAYS];
        let windows = starts.chunks(WINDOW).zip(is_shadowed.chunks_mut(WINDOW));
        for (starts, is_shadowed) in windows {
            for numbers in order.of(&self.bvh.frame, starts).chunks(RAYS) {
                for (i, &number) in numbers.iter().enumerate() {
                    near[i] = starts[number as usize];
                    found[i] = is_shadowed[number as usize];
                }
                let (near, found) = (&near[..numbers.len()], &mut found[..numbers.len()]);
                self.answer(simd, near, found, counters);
                for (&number, &found) in numbers.iter().zip(&*found) {
                    is_shadowed[number as usize] = found;
                }
            }
        }
    }

    #[inline(always)]
    fn answer<S: Simd>(
        &mut self,
        simd: S,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        antumbra_task::check();
        let mut points = [[0.0; RAYS]; 3];
        let mut own = [u32::MAX; RAYS];
        let mut asked = 0;
        for (i, start) in starts.iter().enumerate().take(RAYS) {
            for axis in 0..3 {
                points[axis][i] = start.point[axis];
            }
            if let Some(surface) = start.surface {
                own[i] = surface.0;
            }
            asked |= u32::from(!is_shadowed[i]) << i;
        }
        let offsets = offsets(simd, self.occluders, starts);
        let rays = Rays::new(self.bvh, &points, &offsets, self.light);
        let mut alone = asked & !rays.fit;
        while alone != 0 {
            let lane = alone.trailing_zeros() as usize;
            alone &= alone - 1;
            is_shadowed[lane] =
                self.bvh
                    .any_hit(self.occluders, &starts[lane], self.light, counters);
        }
        let mut group = Group {
            many: self,
            starts,
            rays: &rays,
            own: &own,
        };
        let mut blocked = group.blocked(simd, asked & rays.fit);
        while blocked != 0 {
            is_shadowed[blocked.trailing_zeros() as usize] = true;
            blocked &= blocked - 1;
        }
    }
}

/// Starts that were prepared together.
struct Group<'a, 'b> {
    many: &'a mut Many<'b>,
    starts: &'a [ReceiverPoint],
    rays: &'a Rays,
    own: &'a [u32; RAYS],
}

impl Group<'_, '_> {
    /// Returns which of the segments of a mask are blocked.
    #[inline(always)]
    fn blocked<S: Simd>(&mut self, simd: S, asked: u32) -> u32 {
        let mut blocked = self.blocked_by_last(simd, asked);
        let asked = asked & !blocked;
        // Those that lie close together: all, else halves, else quarters, else each.
        let mut pending = [0; 8];
        pending[0] = asked;
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let part = pending[count];
            if part.count_ones() > FEW {
                let starts = self.rays.start_box(part);
                if starts.extent() <= self.many.farthest_apart
                    && let Some(hull) = Hull::new(&self.many.bvh.frame, &starts, self.many.light)
                {
                    blocked |= self.walk(simd, Some(&hull), part);
                    continue;
                }
                if let Some((low, high)) = halves(part) {
                    pending[count] = high;
                    pending[count + 1] = low;
                    count += 2;
                    continue;
                }
            }
            let mut rest = part;
            while rest != 0 {
                let one = rest & rest.wrapping_neg();
                rest &= rest - 1;
                blocked |= self.walk(simd, None, one);
            }
        }
        blocked
    }

    /// Asks the leaf that blocked the last segment; all only if it blocks the first.
    #[inline(always)]
    fn blocked_by_last<S: Simd>(&mut self, simd: S, asked: u32) -> u32 {
        let last = self.many.last;
        let mut blocked = 0;
        if last == Child::NONE {
            return 0;
        }
        let mut rest = asked;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            if self.is_blocked_in(simd, last, lane) {
                blocked |= 1 << lane;
            } else if blocked == 0 {
                break;
            }
        }
        blocked
    }

    /// Walks the tree for the segments of a mask and returns which are blocked.
    #[inline(always)]
    fn walk<S: Simd>(&mut self, simd: S, hull: Option<&Hull>, asked: u32) -> u32 {
        let bvh = self.many.bvh;
        let mut stack = [Waiting::default(); USUAL_DEPTH];
        let mut height = 0;
        let mut index = 0;
        let mut active = asked;
        'nodes: loop {
            self.many.steps += 1;
            let mut node = &bvh.nodes[index];
            let is_few = active.count_ones() <= FEW;
            let mut mask = match hull {
                Some(hull) if !is_few => hull.meets(simd, node),
                _ => self.met_by_each(simd, node, active),
            };
            loop {
                if mask == 0 {
                    // Up to the lowest node with a child left.
                    if height == 0 {
                        return asked & !active;
                    }
                    height -= 1;
                    index = stack[height].node as usize;
                    mask = stack[height].mask;
                    node = &bvh.nodes[index];
                }
                let slot = mask.trailing_zeros() as usize % WIDTH;
                let child = node.children[slot];
                mask &= mask - 1;
                if child.is_node() {
                    if mask != 0 {
                        stack[height] = Waiting {
                            node: index as u32,
                            mask,
                        };
                        height += 1;
                    }
                    index = child.index();
                    continue 'nodes;
                }
                let mut near = active;
                if active.count_ones() > FEW {
                    near &= self.rays.meet(simd, node, slot);
                }
                if near.count_ones() >= MANY && child.kind() == ChildKind::Triangles {
                    let blocked = self.blocked_by_triangles(simd, child, near);
                    if blocked != 0 {
                        self.many.last = child;
                        active &= !blocked;
                        if active == 0 {
                            return asked;
                        }
                    }
                    continue;
                }
                while near != 0 {
                    let lane = near.trailing_zeros() as usize;
                    near &= near - 1;
                    if self.is_blocked_in(simd, child, lane) {
                        self.many.last = child;
                        active &= !(1 << lane);
                        if active == 0 {
                            return asked;
                        }
                    }
                }
            }
        }
    }

    /// Returns the children that some of a few segments meet.
    #[inline(always)]
    fn met_by_each<S: Simd>(&self, simd: S, node: &Node, active: u32) -> u32 {
        let mut mask = 0;
        let mut rest = active;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            rest &= rest - 1;
            let ray = self.rays.ray(lane, &self.many.bvh.usual_bounds);
            mask |= enters(simd, node, &ray, ray.end).1;
        }
        mask
    }

    /// Returns which of the segments of a mask a group of triangles blocks.
    #[inline(always)]
    fn blocked_by_triangles<S: Simd>(&mut self, simd: S, child: Child, mut near: u32) -> u32 {
        let bvh = self.many.bvh;
        let group: &TriangleGroup = &bvh.triangles[child.index()];
        let members: &Members = &group.members;
        let normals = filter::normals(simd, group);
        let mut blocked = 0;
        let mut opaque = u32::from(members.opaque);
        while opaque != 0 {
            let lane = opaque.trailing_zeros() as usize;
            let bit = opaque & opaque.wrapping_neg();
            opaque &= opaque - 1;
            self.many.tests += u64::from(near.count_ones());
            let verdicts =
                filter::triangle_by_rays(simd, group, &normals, lane, self.rays, &bvh.usual_bounds);
            let mut possible = verdicts.possible & near;
            if possible == 0 {
                continue;
            }
            let surface = u32x16::splat(simd, members.surfaces[lane].0);
            let own = u32x16::from_slice(simd, self.own).simd_eq(surface);
            possible &= !(own.to_bitmask() as u32);
            let sure = if u32::from(members.whole) & bit != 0 {
                possible & verdicts.sure
            } else {
                0
            };
            let mut here = sure;
            let mut in_doubt = possible & !sure;
            while in_doubt != 0 {
                let ray = in_doubt.trailing_zeros() as usize;
                in_doubt &= in_doubt - 1;
                let alone = Verdicts {
                    possible: bit,
                    sure: 0,
                };
                if self.question(ray).is_blocked_by(members, alone) {
                    here |= 1 << ray;
                }
            }
            blocked |= here;
            near &= !here;
            if near == 0 {
                break;
            }
        }
        blocked
    }

    #[inline(always)]
    fn is_blocked_in<S: Simd>(&mut self, simd: S, child: Child, lane: usize) -> bool {
        let bvh = self.many.bvh;
        let ray = self.rays.ray(lane, &bvh.usual_bounds);
        let (verdicts, members) = match child.kind() {
            ChildKind::Triangles => {
                let group = &bvh.triangles[child.index()];
                (filter::triangles(simd, group, &ray), &group.members)
            }
            ChildKind::Spheres => {
                let group = &bvh.spheres[child.index()];
                (filter::spheres(simd, group, &ray), &group.members)
            }
            _ => {
                self.many.tests += 1;
                return self.question(lane).blocks(bvh.others[child.index()]);
            }
        };
        self.many.tests += u64::from(members.opaque.count_ones());
        let possible = verdicts.possible
            & u32::from(members.opaque)
            & !members.those_of(self.own[lane % RAYS]);
        possible != 0
            && self.question(lane).is_blocked_by(
                members,
                Verdicts {
                    possible,
                    ..verdicts
                },
            )
    }

    #[inline(always)]
    fn question(&self, lane: usize) -> Question<'_> {
        Question {
            occluders: self.many.occluders,
            start: &self.starts[lane],
            light: self.many.light,
        }
    }
}

/// Cuts a mask in two between neighbours; not one of four.
#[inline(always)]
fn halves(mask: u32) -> Option<(u32, u32)> {
    for low in [0x00ff, 0x000f, 0x0fff] {
        if mask & low != 0 && mask & !low != 0 {
            return Some((mask & low, mask & !low));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{DVec3, Disk, Occluders, Opacity, Sphere, SurfaceId};

    use super::*;
    use crate::accel::grid::any_hit_by_reference;
    use crate::occlusion::testing::Random;

    /// Triangles of all sizes, some of them in one plane, balls and disks.
    fn scene(random: &mut Random) -> Occluders {
        let within = random.scene();
        let size = within.size().max_element();
        let mut builder = Occluders::builder();
        for number in 0..2 + random.below(150) {
            let middle = random.in_box(&within);
            let reach = size * random.pick(&[0.003, 0.02, 0.1, 0.4]);
            let flat = random.below(6);
            let corners = [(); 3].map(|()| {
                let mut corner = middle + reach * random.of_cube();
                if flat < 3 {
                    corner[flat] = within.center()[flat];
                }
                corner
            });
            let opacity = match number % 5 {
                0 => Opacity::Transparent,
                _ => Opacity::Opaque,
            };
            let (center, radius) = (middle, reach);
            let added = match random.below(12) {
                0 => builder.add_sphere(Sphere { center, radius }, opacity),
                1 => builder.add_disk(
                    Disk {
                        center,
                        normal: random.in_cube(),
                        radius,
                    },
                    opacity,
                ),
                _ => builder.add_face(&corners, opacity),
            };
            drop(added);
        }
        builder.build()
    }

    /// A start on a surface near a point, at its very corner now and then, or near no surface.
    fn start(
        occluders: &Occluders,
        middle: DVec3,
        reach: f64,
        random: &mut Random,
    ) -> ReceiverPoint {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        let Some([a, b, c]) = occluders.triangle_positions(surface) else {
            return ReceiverPoint {
                point: middle + reach * random.of_cube(),
                surface: None,
            };
        };
        let (u, v) = (random.pick(&[0.0, 0.2, 0.7]), random.real(0.0, 0.3));
        ReceiverPoint {
            point: a + (b - a) * u + (c - a) * v,
            surface: Some(surface).filter(|_| random.below(8) > 0),
        }
    }

    #[test]
    fn many_are_answered_as_each() {
        let random = &mut Random(5);
        let (mut shadowed_count, mut lit_count, mut step_count, mut each_count) = (0, 0, 0, 0);
        for _ in 0..120 {
            let occluders = scene(random);
            if occluders.surface_count() == 0 {
                continue;
            }
            let bvh = Bvh::build(&occluders);
            let bounds = occluders.bounds();
            let size = bounds.size().max_element();
            for _ in 0..4 {
                let light = random.light(&bounds);
                // Close together, apart, outside and far outside.
                let reach = size * random.pick(&[1e-9, 1e-3, 0.02, 2.0, 1e6]);
                let middle = random.in_box(&bounds);
                let mut starts = Vec::new();
                for _ in 0..1 + random.below(100) {
                    starts.push(match random.below(4) {
                        0 => start(&occluders, middle, reach, random),
                        _ => ReceiverPoint {
                            point: middle + reach * random.of_cube(),
                            surface: None,
                        },
                    });
                }
                let mut found = vec![false; starts.len()];
                let (mut together, mut each) = (Counters::default(), Counters::default());
                bvh.any_hits(&occluders, &starts, &light, &mut found, &mut together);
                for (start, found) in starts.iter().zip(found) {
                    let segment = occluders.segment(start, &light);
                    let expected = any_hit_by_reference(&occluders, &segment);
                    assert_eq!(found, expected, "{start:?} {light:?} of {starts:?}");
                    let alone = bvh.any_hit(&occluders, start, &light, &mut each);
                    assert_eq!(alone, expected, "{start:?} {light:?}");
                    shadowed_count += u32::from(expected);
                    lit_count += u32::from(!expected);
                }
                step_count += together.steps;
                each_count += each.steps;
            }
        }
        assert!(
            shadowed_count > 1_000 && lit_count > 1_000,
            "{shadowed_count} {lit_count}"
        );
        assert!(
            4 * step_count < 3 * each_count,
            "{step_count} of {each_count}"
        );
    }

    #[test]
    fn what_own_rules_shadow_is_left_so() {
        let random = &mut Random(6);
        let occluders = scene(random);
        let bvh = Bvh::build(&occluders);
        let starts = [(); 40].map(|()| ReceiverPoint {
            point: occluders.bounds().max + DVec3::ONE,
            surface: None,
        });
        let mut found = [true; 40];
        let light = LightShape::Direction(DVec3::ONE);
        bvh.any_hits(
            &occluders,
            &starts,
            &light,
            &mut found,
            &mut Counters::default(),
        );
        assert_eq!(found, [true; 40]);
        let mut found = [false; 40];
        bvh.any_hits(
            &occluders,
            &starts,
            &light,
            &mut found,
            &mut Counters::default(),
        );
        assert_eq!(found, [false; 40]);
    }

    #[test]
    fn masks_are_cut_between_neighbours() {
        for mask in 1_u32..1 << 16 {
            match halves(mask) {
                Some((low, high)) => {
                    assert!(low != 0 && high != 0 && low ^ high == mask);
                    assert!(low < high & high.wrapping_neg(), "{mask:x}");
                }
                None => assert!(mask.count_ones() <= 4, "{mask:x}"),
            }
        }
    }
}
