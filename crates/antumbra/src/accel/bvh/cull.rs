//! Which surfaces may meet the shaft of a box.
//!
//! In: a shaft and the box that it starts from. Out: every surface whose box in the tree may meet the
//! shaft. Invariant: no surface that meets it is left out.

use std::ops::ControlFlow;

use antumbra_geometry::{Bounds, DVec3, Shaft, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, dispatch, f32x8};

use super::data::{Bvh, Child, ChildKind, Node};
use crate::accel::frame::Frame;

/// Pairs of half-spaces that are left out of a region at most.
pub(crate) const WEDGES: usize = 2;

/// The planes of a shaft and its box, in the frame's units.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    /// Outward normals with largest component 1, and offsets: four planes, coordinate by coordinate.
    fours: [[[f32; 4]; 4]; 3],
    plane_count: usize,
    /// Pairs of half-spaces: what is within both of a pair does not matter.
    without: [[[f32; 4]; 2]; WEDGES],
    without_count: usize,
    min: [f32; 3],
    max: [f32; 3],
}

/// What a height in `f32` may be off, for boxes within 2 of the frame's middle and planes through points
/// within 3: with `u = 2^-24`, normals, offset and place `15 u`, products and sums `24 u`, and what
/// `outer_planes` grants, `9 u`.
pub(super) const BOUND: f32 = 1.0 / (1u64 << 18) as f32;

impl Region {
    pub(crate) fn new(frame: &Frame, shaft: &Shaft, bounds: &Bounds) -> Self {
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        Self {
            min: narrow(frame.point_in_frame(bounds.min)).map(|x| x - BOUND),
            max: narrow(frame.point_in_frame(bounds.max)).map(|x| x + BOUND),
            ..Self::below(frame, shaft.outer_planes())
        }
    }

    /// Makes the region below up to twelve planes: outward normals with largest component 1, and points on them in
    /// world space. Everything is near its box. A normal may err by 2^-21, which [`BOUND`] grants.
    pub(crate) fn below(frame: &Frame, planes: impl IntoIterator<Item = (DVec3, DVec3)>) -> Self {
        let height =
            |(normal, point): (DVec3, DVec3)| (normal, normal.dot(frame.point_in_frame(point)));
        Self::of_heights(planes.into_iter().map(height))
    }

    /// Makes the region below up to twelve planes in the frame's units: outward normals with largest component 1, and
    /// heights of what lies on them. Those that no point of the frame is above are left out.
    pub(crate) fn of_heights(planes: impl IntoIterator<Item = (DVec3, f64)>) -> Self {
        // All is above a plane that is nowhere.
        let mut fours = [[[0.0; 4], [0.0; 4], [0.0; 4], [-1.0; 4]]; 3];
        let mut plane_count = 0;
        let planes = planes.into_iter().filter(|&(_, height)| height.abs() < 9.0);
        for ((n, height), number) in planes.zip(0..12) {
            let plane = [n.x as f32, n.y as f32, n.z as f32, -height as f32];
            for (row, value) in plane.into_iter().enumerate() {
                fours[number / 4][row][number % 4] = value;
            }
            plane_count = number + 1;
        }
        Self {
            fours,
            plane_count,
            without: [[[0.0; 4]; 2]; WEDGES],
            without_count: 0,
            min: [f32::NEG_INFINITY; 3],
            max: [f32::INFINITY; 3],
        }
    }
}

impl Region {
    /// Leaves out what is within both half-spaces of a pair, which have outward normals with largest component 1 and heights
    /// of what lies on them, all in the frame's units; `None` is all of space.
    pub(crate) fn leave_out(&mut self, pairs: impl IntoIterator<Item = [Option<(DVec3, f64)>; 2]>) {
        self.without_count = 0;
        for pair in pairs.into_iter().take(WEDGES) {
            let planes = pair.map(|side| match side {
                // Below everything, and above it.
                None => Some([0.0, 0.0, 0.0, -1.0]),
                Some((_, height)) if height > 9.0 => Some([0.0, 0.0, 0.0, -1.0]),
                Some((n, height)) if height > -9.0 => {
                    Some([n.x as f32, n.y as f32, n.z as f32, -height as f32])
                }
                Some(_) => None,
            });
            if let [Some(one), Some(other)] = planes {
                self.without[self.without_count] = [one, other];
                self.without_count += 1;
            }
        }
    }

    /// Returns the pairs that are left out.
    #[inline(always)]
    pub(super) fn without(&self) -> &[[[f32; 4]; 2]] {
        &self.without[..self.without_count]
    }
}

/// A group of shapes of the tree, or a surface without a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Leaf(u32);

impl Leaf {
    pub(super) fn child(self) -> Child {
        Child::of_word(self.0)
    }

    /// Returns it as a number.
    pub(crate) fn word(self) -> u32 {
        self.0
    }

    /// Returns whether its shapes are told many segments at a time.
    pub(crate) fn has_filter(self) -> bool {
        matches!(
            self.child().kind(),
            ChildKind::Triangles | ChildKind::Spheres
        )
    }
}

impl Region {
    /// Returns the planes: outward normals and offsets.
    #[inline(always)]
    pub(super) fn planes(&self) -> impl Iterator<Item = [f32; 4]> {
        // Spelled out: `map` is a function of its own, which is not made for this instruction set.
        let plane = |number: usize| {
            let ([x, y, z, offset], lane) = (&self.fours[number / 4], number % 4);
            [x[lane], y[lane], z[lane], offset[lane]]
        };
        (0..self.plane_count).map(plane)
    }

    /// Returns whether the hull of some points is surely beyond one plane.
    #[inline]
    pub(crate) fn misses(&self, points: impl Iterator<Item = [f32; 3]> + Clone) -> bool {
        self.fours[..self.plane_count.div_ceil(4)]
            .iter()
            .any(|[nx, ny, nz, offset]| {
                let mut is_above = [true; 4];
                for [x, y, z] in points.clone() {
                    for i in 0..4 {
                        let height = nx[i] * x + ny[i] * y + (nz[i] * z + offset[i]);
                        is_above[i] &= height > BOUND;
                    }
                }
                is_above.contains(&true)
            })
    }
}

impl Bvh {
    /// Returns whether a surface lies in a leaf.
    #[cfg(test)]
    pub(crate) fn leaf_holds(&self, leaf: u32, surface: SurfaceId) -> bool {
        let child = Child::of_word(leaf);
        match child.kind() {
            ChildKind::Node => false,
            ChildKind::Other => self.others[child.index()] == surface,
            ChildKind::Triangles => self.triangles[child.index()].members.those_of(surface.0) != 0,
            ChildKind::Spheres => self.spheres[child.index()].members.those_of(surface.0) != 0,
        }
    }

    /// Calls `visit` with every surface that may meet a region, and whether it may meet its box.
    pub(crate) fn cull(&self, region: &Region, mut visit: impl FnMut(SurfaceId, bool)) {
        let _ = self.cull_until(region, |surface, is_near| {
            visit(surface, is_near);
            ControlFlow::Continue(())
        });
    }

    /// The same, as long as `visit` says so.
    pub(crate) fn cull_until(
        &self,
        region: &Region,
        mut visit: impl FnMut(SurfaceId, bool) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.cull_leaves(region, |_, surface, is_near| visit(surface, is_near))
    }

    /// Calls `visit` with every surface of the leaves that may meet a region, its leaf, and whether that may meet the
    /// region's box, as long as `visit` says so.
    pub(crate) fn cull_leaves(
        &self,
        region: &Region,
        mut visit: impl FnMut(Leaf, SurfaceId, bool) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if self.nodes.is_empty() {
            return ControlFlow::Continue(());
        }
        let mut pending = vec![0_usize];
        while let Some(index) = pending.pop() {
            let node = &self.nodes[index];
            let (meets_shaft, meets_box) = dispatch!(self.level, simd => meets(simd, node, region));
            for (number, &child) in node.children.iter().enumerate() {
                if meets_shaft >> number & 1 == 0 || child == Child::NONE {
                    continue;
                }
                let is_near = meets_box >> number & 1 != 0;
                let members = match child.kind() {
                    ChildKind::Node => {
                        pending.push(child.index());
                        continue;
                    }
                    ChildKind::Other => {
                        visit(Leaf(child.word()), self.others[child.index()], is_near)?;
                        continue;
                    }
                    ChildKind::Triangles => &self.triangles[child.index()].members,
                    ChildKind::Spheres => &self.spheres[child.index()].members,
                };
                for (lane, &surface) in members.surfaces.iter().enumerate() {
                    if members.present >> lane & 1 != 0 {
                        visit(Leaf(child.word()), surface, is_near)?;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// A bit for each child whose box may meet the shaft, and for each whose box may meet the box.
#[inline(always)]
fn meets<S: Simd>(simd: S, node: &Node, region: &Region) -> (u32, u32) {
    let is_met = meets_planes(simd, node, region);
    let row = |row: usize| f32x8::from_slice(simd, &node.planes[row]);
    let (low, high) = ([row(0), row(1), row(2)], [row(3), row(4), row(5)]);
    let mut is_near = is_met;
    for axis in 0..3 {
        is_near &= low[axis].simd_le(region.max[axis]).to_bitmask() as u32;
        is_near &= high[axis].simd_ge(region.min[axis]).to_bitmask() as u32;
    }
    (is_met, is_near)
}

/// Returns the lower and the upper corners of a node's boxes.
#[inline(always)]
pub(super) fn corners<S: Simd>(simd: S, node: &Node) -> [[f32x8<S>; 3]; 2] {
    let [x, y, z, to_x, to_y, to_z] = &node.planes;
    [
        [
            f32x8::from_slice(simd, x),
            f32x8::from_slice(simd, y),
            f32x8::from_slice(simd, z),
        ],
        [
            f32x8::from_slice(simd, to_x),
            f32x8::from_slice(simd, to_y),
            f32x8::from_slice(simd, to_z),
        ],
    ]
}

/// Returns the heights over a plane of a corner of each box: coordinates are of `rising` where the normal's are above zero,
/// of `falling` where not. The lower and the upper corners make the lowest height, the reverse the highest.
#[inline(always)]
pub(super) fn height<S: Simd>(
    rising: &[f32x8<S>; 3],
    falling: &[f32x8<S>; 3],
    [x, y, z, offset]: [f32; 4],
) -> f32x8<S> {
    let nearest = if x > 0.0 { rising[0] } else { falling[0] } * x;
    let next = if y > 0.0 { rising[1] } else { falling[1] } * y;
    let last = if z > 0.0 { rising[2] } else { falling[2] } * z;
    nearest + next + (last + offset)
}

/// Returns a bit for each child whose box may meet the shaft.
#[inline(always)]
pub(super) fn meets_planes<S: Simd>(simd: S, node: &Node, region: &Region) -> u32 {
    let [low, high] = corners(simd, node);
    let mut is_met = u32::MAX;
    for plane in region.planes() {
        // The corner that lies deepest behind the plane.
        let height = height(&low, &high, plane);
        is_met &= height.simd_le(BOUND).to_bitmask() as u32;
    }
    is_met
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use antumbra_geometry::{
        Cone, DVec3, Disk, LightShape, Occluders, Opacity, ReceiverPoint, Sphere,
    };

    use super::*;
    use crate::occlusion::testing::Random;

    /// Triangles of all sizes, balls, cones and disks in a box, some of them flat along an axis.
    fn scene(random: &mut Random) -> Occluders {
        let within = random.scene();
        let size = within.size().max_element();
        let mut builder = Occluders::builder();
        for _ in 0..1 + random.below(120) {
            let middle = random.in_box(&within);
            let reach = size * random.pick(&[1e-6, 0.01, 0.05, 0.3]);
            let flat = random.below(6);
            let corners = [(); 3].map(|()| {
                let mut corner = middle + reach * random.of_cube();
                if flat < 3 {
                    corner[flat] = middle[flat];
                }
                corner
            });
            let opacity = random.pick(&[Opacity::Opaque, Opacity::Opaque, Opacity::Transparent]);
            // Some have no area.
            let added = match random.below(8) {
                0 => builder.add_sphere(
                    Sphere {
                        center: middle,
                        radius: reach,
                    },
                    opacity,
                ),
                1 => builder.add_cone(
                    Cone {
                        base: middle,
                        base_radius: 0.3 * reach,
                        apex: corners[0],
                        apex_radius: 0.1 * reach,
                        is_closed: flat == 0,
                    },
                    opacity,
                ),
                2 => builder.add_disk(
                    Disk {
                        center: middle,
                        normal: random.in_cube(),
                        radius: reach,
                    },
                    opacity,
                ),
                _ => builder.add_face(&corners, opacity),
            };
            drop(added);
        }
        builder.build()
    }

    /// A part of a scene's box, as cells are.
    fn part(bounds: &Bounds, random: &mut Random) -> Bounds {
        let center = random.in_box(bounds);
        let half = bounds.size().max_element() * random.pick(&[0.3, 0.05, 0.01, 0.001]);
        Bounds {
            min: center,
            max: center,
        }
        .inflated(DVec3::splat(half))
    }

    #[test]
    fn nothing_that_meets_a_shaft_is_left_out() {
        let random = &mut Random(1);
        let (mut visited_count, mut all_count) = (0, 0);
        let (mut in_shaft_count, mut near_count, mut blocked_count) = (0, 0, 0);
        for _ in 0..150 {
            let occluders = scene(random);
            if occluders.surface_count() == 0 {
                continue;
            }
            let bvh = Bvh::build(&occluders);
            let scene = occluders.bounds();
            for _ in 0..12 {
                let bounds = part(&scene, random);
                // Around the box, far away, at infinity, and in the box.
                let light = match random.below(5) {
                    0 => LightShape::Point(random.in_box(&bounds)),
                    _ => random.light(&scene),
                };
                let shaft = Shaft::new(bounds, light);
                let region = Region::new(&bvh.frame, &shaft, &bounds);
                let mut visited = HashMap::new();
                bvh.cull(&region, |surface, is_near| {
                    let before = visited.insert(surface, is_near);
                    assert_eq!(before, None, "{surface:?} is visited twice");
                });
                let label = || format!("{bounds:?} {light:?}");
                for surface in occluders.surfaces() {
                    let corners = occluders.triangle_positions(surface);
                    if corners.is_some_and(|corners| !shaft.misses_triangle(&corners)) {
                        in_shaft_count += 1;
                        assert!(visited.contains_key(&surface), "{} {surface:?}", label());
                    }
                    if occluders.surface_bounds(surface).overlaps(&bounds) {
                        near_count += 1;
                        assert_eq!(visited.get(&surface), Some(&true), "{}", label());
                    }
                }
                for _ in 0..8 {
                    let start = ReceiverPoint {
                        point: bounds.center() + 0.5 * bounds.size() * random.of_cube(),
                        surface: None,
                    };
                    let segment = occluders.segment(&start, &light);
                    for surface in occluders.surfaces() {
                        if occluders.blocks(surface, &segment) {
                            blocked_count += 1;
                            let is_visited = visited.contains_key(&surface);
                            assert!(is_visited, "{} {start:?} {surface:?}", label());
                        }
                    }
                }
                visited_count += visited.len();
                all_count += occluders.surface_count();
            }
        }
        assert!(
            in_shaft_count > 5_000 && near_count > 2_000 && blocked_count > 2_000,
            "{in_shaft_count} {near_count} {blocked_count}"
        );
        assert!(2 * visited_count < all_count, "{visited_count} {all_count}");
    }

    /// What `Region::misses` says of a hull must hold for all that it holds.
    #[test]
    fn hulls_that_are_said_to_miss_a_shaft_block_nothing_there() {
        let random = &mut Random(2);
        let (mut missed_count, mut met_count) = (0, 0);
        for _ in 0..150 {
            let occluders = scene(random);
            if occluders.surface_count() == 0 {
                continue;
            }
            let frame = Frame::new(occluders.bounds());
            for _ in 0..6 {
                let bounds = part(&occluders.bounds(), random);
                let light = random.light(&occluders.bounds());
                let region = Region::new(&frame, &Shaft::new(bounds, light), &bounds);
                let starts = [(); 8].map(|()| ReceiverPoint {
                    point: bounds.center() + 0.5 * bounds.size() * random.of_cube(),
                    surface: None,
                });
                let segments = starts.map(|start| occluders.segment(&start, &light));
                for surface in occluders.surfaces() {
                    let Some(corners) = occluders.triangle_positions(surface) else {
                        continue;
                    };
                    let corners = corners
                        .map(|corner| frame.point_in_frame(corner).to_array().map(|x| x as f32));
                    if region.misses(corners.into_iter()) {
                        missed_count += 1;
                        for segment in &segments {
                            assert!(!occluders.blocks(surface, segment), "{bounds:?} {light:?}");
                        }
                    } else {
                        met_count += 1;
                    }
                }
            }
        }
        assert!(
            missed_count > 10_000 && met_count > 2_000,
            "{missed_count} {met_count}"
        );
    }
}
