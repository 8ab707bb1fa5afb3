//! Building the tree: the binary tree, cut into a tree of eight children.
//!
//! Which subtrees become children of one node, and which become groups of shapes, minimises the
//! expected cost of a ray (surface area heuristic), by dynamic programming over the binary tree
//! (Ylitie et al. 2017, section 3). One thread, no hashing, no clock: the tree is a function of the
//! scene.

use super::binary::{Binary, BinaryNode, FrameBox};
use super::data::{Bvh, Child, ChildKind, LANES, Members, Node, SphereGroup, TriangleGroup, WIDTH};
use super::ray::{FilterBounds, USUAL_ORIGIN_ERROR};
use crate::frame::Frame;
use antumbra_geometry::{Occluders, SurfaceId};
use antumbra_task::{check, checked};
use fearless_simd::Level;

/// Cost of visiting a node, in units of testing a group of shapes. Measured together with the build
/// setting; the optimum is flat.
const NODE_COST: f32 = 1.0;
const GROUP_COST: f32 = 1.0;
/// Shapes without a filter go to the exact rule at once.
const OTHER_COST: f32 = 4.0;

/// Where empty children are, on all axes: beyond every ray's end or before its start.
const FAR_AWAY: f32 = 1e20;

impl Bvh {
    /// Builds the tree over all surfaces.
    pub(crate) fn build(occluders: &Occluders) -> Self {
        let boxes = Self::boxes(occluders);
        Self::of_binary(occluders, &Binary::new(&boxes))
    }

    /// Returns the boxes of all surfaces.
    pub(super) fn boxes(occluders: &Occluders) -> Vec<FrameBox> {
        let frame = Frame::new(occluders.bounds());
        checked(occluders.surfaces())
            .map(|surface| FrameBox::new(&frame, &occluders.surface_bounds(surface)))
            .collect()
    }

    /// Returns about the bytes that building the tree takes at its height, and those of the tree. How full groups and
    /// nodes are hardly depends on the scene (`crates/antumbra/tests/memory.rs`).
    pub(crate) fn predict_bytes(occluders: &Occluders) -> [u64; 2] {
        /// Shapes in a group, and groups below a node.
        const FULL: [f64; 2] = [1.6, 5.0];
        /// What the binary tree takes while it is built, for each surface.
        const BINARY: usize = 320;
        let surface_count = occluders.surface_count();
        let (triangles, others) = (
            occluders.triangle_count() as f64,
            (surface_count - occluders.triangle_count()) as f64,
        );
        let [triangle_group, sphere_group, node] = [
            size_of::<TriangleGroup>(),
            size_of::<SphereGroup>(),
            size_of::<Node>(),
        ]
        .map(|size| size as f64);
        let groups = triangles * triangle_group + others * sphere_group;
        let nodes = surface_count as f64 * node / FULL[1];
        let taken = ((groups + nodes) / FULL[0]) as u64;
        // The boxes, and for each node of the binary tree how it is cut, until all is written.
        let binary = 2 * (size_of::<BinaryNode>() + Plan::NODE_BYTES);
        let height = (size_of::<FrameBox>() + binary) * surface_count;
        let height = taken + height as u64;
        [height.max((BINARY * surface_count) as u64), taken]
    }

    /// Cuts a binary tree over all surfaces.
    pub(super) fn of_binary(occluders: &Occluders, binary: &Binary) -> Self {
        let frame = Frame::new(occluders.bounds());
        let mut bvh = Self {
            frame,
            nodes: Vec::new(),
            triangles: Vec::new(),
            spheres: Vec::new(),
            others: Vec::new(),
            depth: 0,
            level: Level::new(),
            usual_bounds: FilterBounds::new(frame.margin_in_frame, USUAL_ORIGIN_ERROR),
        };
        if binary.nodes.is_empty() {
            return bvh;
        }
        let plan = Plan::new(occluders, binary);
        Writer {
            occluders,
            plan: &plan,
            bvh: &mut bvh,
        }
        .write();
        bvh
    }
}

/// What one child's subtree holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Triangles,
    Spheres,
    Other,
    Mixed,
}

/// For each node of the binary tree how its subtree is cut best.
struct Plan<'a> {
    binary: &'a Binary,
    /// Cheapest cost of the subtree as at most `i + 1` children of a wide node.
    costs: Vec<[f32; WIDTH]>,
    /// How many of `i + 1` children the left side takes; 0: one child fewer is as good, or, for a
    /// single child, a choice between node and group.
    left_shares: Vec<[u8; WIDTH]>,
    is_group: Vec<bool>,
    /// Surfaces and kind of each subtree.
    counts: Vec<u32>,
    contents: Vec<Content>,
}

impl<'a> Plan<'a> {
    /// Bytes of a node of the binary tree.
    const NODE_BYTES: usize = size_of::<[f32; WIDTH]>()
        + size_of::<[u8; WIDTH]>()
        + size_of::<bool>()
        + size_of::<u32>()
        + size_of::<Content>();

    fn new(occluders: &Occluders, binary: &'a Binary) -> Self {
        let count = binary.nodes.len();
        let mut plan = Self {
            binary,
            costs: vec![[0.0; WIDTH]; count],
            left_shares: vec![[0; WIDTH]; count],
            is_group: vec![false; count],
            counts: vec![0; count],
            contents: vec![Content::Mixed; count],
        };
        // Parents before children, then backwards. A subtree may be deep: no recursion.
        let mut order = Vec::with_capacity(count);
        let mut pending = vec![0usize];
        while let Some(node) = pending.pop() {
            order.push(node);
            if let Some(children) = plan.children(node) {
                pending.extend(children);
            }
        }
        for &node in checked(order.iter().rev()) {
            plan.decide(occluders, node);
        }
        plan
    }

    fn children(&self, node: usize) -> Option<[usize; 2]> {
        self.binary.nodes[node].children()
    }

    fn bounds(&self, node: usize) -> &FrameBox {
        &self.binary.nodes[node].bounds
    }

    fn decide(&mut self, occluders: &Occluders, node: usize) {
        let area = self.bounds(node).half_area();
        let Some([left, right]) = self.children(node) else {
            let surface = self.binary.nodes[node].surface();
            let (content, cost) = if occluders.triangle_positions(surface).is_some() {
                (Content::Triangles, GROUP_COST)
            } else if occluders.sphere(surface).is_some() {
                (Content::Spheres, GROUP_COST)
            } else {
                (Content::Other, OTHER_COST)
            };
            self.counts[node] = 1;
            self.contents[node] = content;
            self.is_group[node] = true;
            self.costs[node] = [area * cost; WIDTH];
            return;
        };
        self.counts[node] = self.counts[left] + self.counts[right];
        let (ours, theirs) = (self.contents[left], self.contents[right]);
        self.contents[node] = if ours == theirs { ours } else { Content::Mixed };

        // As exactly `i + 1` children: the best split between left and right.
        let mut costs = [f32::INFINITY; WIDTH];
        let mut shares = [0u8; WIDTH];
        for i in 1..WIDTH {
            for share in 1..=i {
                let cost = self.costs[left][share - 1] + self.costs[right][i - share];
                if cost < costs[i] {
                    costs[i] = cost;
                    shares[i] = share as u8;
                }
            }
        }
        // As one child: a group of shapes, or a node with eight children.
        let is_groupable = self.counts[node] <= LANES as u32
            && matches!(self.contents[node], Content::Triangles | Content::Spheres);
        let as_node = area * NODE_COST + costs[WIDTH - 1];
        let as_group = if is_groupable {
            area * GROUP_COST
        } else {
            f32::INFINITY
        };
        self.is_group[node] = as_group <= as_node;
        costs[0] = as_group.min(as_node);
        // Fewer children may do; the node that this would be a child of knows 0 as that.
        let as_whole = shares;
        for i in 1..WIDTH {
            if costs[i - 1] <= costs[i] {
                costs[i] = costs[i - 1];
                shares[i] = 0;
            }
        }
        // A node of its own always divides: its eight children are not itself.
        shares[0] = as_whole[WIDTH - 1];
        self.costs[node] = costs;
        self.left_shares[node] = shares;
    }

    /// Returns the children of the wide node that a subtree becomes.
    fn wide_children(&self, node: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(WIDTH);
        let Some([left, right]) = self.children(node).filter(|_| !self.is_group[node]) else {
            // The root of a scene of a few shapes.
            return vec![node];
        };
        let share = usize::from(self.left_shares[node][0]);
        let mut pending = vec![(right, WIDTH - share), (left, share)];
        while let Some((node, mut slots)) = pending.pop() {
            while slots > 1 && self.left_shares[node][slots - 1] == 0 {
                slots -= 1;
            }
            match self.children(node) {
                Some([left, right]) if slots > 1 => {
                    let share = usize::from(self.left_shares[node][slots - 1]);
                    pending.push((right, slots - share));
                    pending.push((left, share));
                }
                _ => children.push(node),
            }
        }
        children
    }
}

/// Writes the wide tree.
struct Writer<'a> {
    occluders: &'a Occluders,
    plan: &'a Plan<'a>,
    bvh: &'a mut Bvh,
}

impl Writer<'_> {
    /// Takes room for all nodes and groups: vectors that grow would take twice as much.
    fn take_room(&mut self) {
        let mut node_count = 0;
        let mut counts = [0; 4];
        let mut pending = vec![0];
        while let Some(node) = pending.pop() {
            node_count += 1;
            for child in self.plan.wide_children(node) {
                if self.plan.is_group[child] {
                    counts[self.plan.contents[child] as usize] += 1;
                } else {
                    pending.push(child);
                }
            }
        }
        let [triangle_count, sphere_count, other_count, mixed_count] = counts;
        self.bvh.nodes.reserve_exact(node_count);
        self.bvh.triangles.reserve_exact(triangle_count);
        self.bvh.spheres.reserve_exact(sphere_count);
        self.bvh.others.reserve_exact(other_count + mixed_count);
    }

    fn write(&mut self) {
        self.take_room();
        // Depth first, so that a node's first inner child is the next in memory.
        struct Pending {
            binary: usize,
            parent: Option<(usize, usize)>,
            depth: usize,
        }
        let mut pending = vec![Pending {
            binary: 0,
            parent: None,
            depth: 1,
        }];
        while let Some(Pending {
            binary,
            parent,
            depth,
        }) = pending.pop()
        {
            check();
            let index = self.bvh.nodes.len();
            self.bvh.depth = self.bvh.depth.max(depth);
            if let Some((parent, slot)) = parent {
                self.bvh.nodes[parent].children[slot] = Child::new(ChildKind::Node, index);
            }
            let mut children = self.plan.wide_children(binary);
            // Leaves first; then those that a ray hits most likely.
            let area = |node: usize| self.plan.bounds(node).half_area();
            children.sort_by(|&a, &b| {
                let is_node = |node: usize| !self.plan.is_group[node];
                is_node(a)
                    .cmp(&is_node(b))
                    .then(area(b).total_cmp(&area(a)))
            });
            let mut node = Node {
                planes: [[FAR_AWAY; WIDTH]; 6],
                children: [Child::NONE; WIDTH],
            };
            let first_pending = pending.len();
            for (slot, &child) in children.iter().enumerate() {
                let bounds = self.plan.bounds(child);
                for axis in 0..3 {
                    node.planes[axis][slot] = bounds.min[axis];
                    node.planes[axis + 3][slot] = bounds.max[axis];
                }
                if self.plan.is_group[child] {
                    node.children[slot] = self.group(child);
                } else {
                    pending.push(Pending {
                        binary: child,
                        parent: Some((index, slot)),
                        depth: depth + 1,
                    });
                }
            }
            pending[first_pending..].reverse();
            self.bvh.nodes.push(node);
        }
    }

    fn group(&mut self, node: usize) -> Child {
        let mut surfaces = Vec::with_capacity(LANES);
        let mut pending = vec![node];
        while let Some(node) = pending.pop() {
            match self.plan.children(node) {
                Some(children) => pending.extend(children),
                None => surfaces.push(self.plan.binary.nodes[node].surface()),
            }
        }
        surfaces.sort_unstable();
        let bvh = &mut *self.bvh;
        match self.plan.contents[node] {
            Content::Triangles => {
                let group = TriangleGroup::new(self.occluders, &bvh.frame, &surfaces);
                bvh.triangles.push(group);
                Child::new(ChildKind::Triangles, bvh.triangles.len() - 1)
            }
            Content::Spheres => {
                let group = SphereGroup::new(self.occluders, &bvh.frame, &surfaces);
                bvh.spheres.push(group);
                Child::new(ChildKind::Spheres, bvh.spheres.len() - 1)
            }
            Content::Other | Content::Mixed => {
                bvh.others.push(surfaces[0]);
                Child::new(ChildKind::Other, bvh.others.len() - 1)
            }
        }
    }
}

impl Members {
    fn new(occluders: &Occluders, surfaces: &[SurfaceId]) -> Self {
        let bits = |is_set: &dyn Fn(SurfaceId) -> bool| {
            surfaces
                .iter()
                .enumerate()
                .fold(0, |bits, (lane, &surface)| {
                    bits | u8::from(is_set(surface)) << lane
                })
        };
        Self {
            surfaces: std::array::from_fn(|lane| surfaces[lane.min(surfaces.len() - 1)]),
            present: bits(&|_| true),
            opaque: bits(&|surface| occluders.is_opaque(surface)),
            whole: bits(&|surface| occluders.is_opaque_everywhere(surface)),
        }
    }
}

impl TriangleGroup {
    fn new(occluders: &Occluders, frame: &Frame, surfaces: &[SurfaceId]) -> Self {
        let mut group = Self {
            corner: [[0.0; LANES]; 3],
            edge_ab: [[0.0; LANES]; 3],
            edge_ac: [[0.0; LANES]; 3],
            reach: [Self::SMALLEST_REACH; LANES],
            members: Members::new(occluders, surfaces),
        };
        for (lane, &surface) in surfaces.iter().enumerate() {
            let Some([a, b, c]) = occluders.triangle_positions(surface) else {
                continue;
            };
            let corner = frame.point_in_frame(a);
            let (ab, ac) = ((b - a) * frame.scale, (c - a) * frame.scale);
            for axis in 0..3 {
                group.corner[axis][lane] = corner[axis] as f32;
                group.edge_ab[axis][lane] = ab[axis] as f32;
                group.edge_ac[axis][lane] = ac[axis] as f32;
            }
            let reach = ab.abs().max(ac.abs()).max_element() as f32;
            group.reach[lane] = reach.next_up().max(Self::SMALLEST_REACH);
        }
        group
    }
}

impl SphereGroup {
    fn new(occluders: &Occluders, frame: &Frame, surfaces: &[SurfaceId]) -> Self {
        let mut group = Self {
            center: [[0.0; LANES]; 3],
            radius: [0.0; LANES],
            members: Members::new(occluders, surfaces),
        };
        for (lane, &surface) in surfaces.iter().enumerate() {
            let Some(sphere) = occluders.sphere(surface) else {
                continue;
            };
            let center = frame.point_in_frame(sphere.center);
            for axis in 0..3 {
                group.center[axis][lane] = center[axis] as f32;
            }
            group.radius[lane] = (sphere.radius * frame.scale) as f32;
        }
        group
    }
}
