//! Building the tree: the binary tree, cut into a tree of eight children.
//!
//! Which subtrees become children of one node, and which become groups of shapes, minimises the
//! expected cost of a ray (surface area heuristic), by dynamic programming over the binary tree
//! (Ylitie et al. 2017, section 3). One thread, no hashing, no clock: the tree is a function of the
//! scene.

use super::binary::{Binary, BinaryNode, FrameBox};
use super::data::{Bvh, Child, ChildKind, LANES, Members, Node, SphereGroup, TriangleGroup, WIDTH};
use super::ray::{FilterBounds, USUAL_ORIGIN_ERROR};
use crate::accel::frame::Frame;
use antumbra_geometry::{Bounds, DVec3, Occluders, SurfaceId};
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

/// The surfaces that a tree is over.
pub(super) struct Held<'a> {
    occluders: &'a Occluders,
    /// Which these are; nothing for all.
    surfaces: Option<Vec<SurfaceId>>,
    bounds: Bounds,
}

impl<'a> Held<'a> {
    /// All surfaces that are not left out.
    pub(super) fn all(occluders: &'a Occluders) -> Self {
        let has_all = occluders.present_surfaces().count() == occluders.surface_count();
        Self {
            occluders,
            surfaces: (!has_all).then(|| occluders.present_surfaces().collect()),
            bounds: occluders.bounds(),
        }
    }

    pub(super) fn count(&self) -> usize {
        let all = self.occluders.surface_count();
        self.surfaces.as_ref().map_or(all, Vec::len)
    }

    /// Returns the surface that the tree knows by a number.
    fn surface(&self, number: u32) -> SurfaceId {
        let surfaces = self.surfaces.as_ref();
        surfaces.map_or(SurfaceId(number), |surfaces| surfaces[number as usize])
    }

    /// Returns the boxes of the surfaces.
    pub(super) fn boxes(&self) -> impl ExactSizeIterator<Item = FrameBox> {
        let frame = Frame::new(self.bounds);
        (0..self.count() as u32).map(move |number| {
            let bounds = self.occluders.surface_bounds(self.surface(number));
            FrameBox::new(&frame, &bounds)
        })
    }
}

impl Bvh {
    /// Builds the tree over all surfaces that are not left out.
    pub(crate) fn build(occluders: &Occluders) -> Self {
        Self::over(&Held::all(occluders))
    }

    /// Builds a tree over some surfaces.
    pub(crate) fn build_of(occluders: &Occluders, surfaces: &[SurfaceId]) -> Self {
        let bounds = surfaces.iter().map(|&one| occluders.surface_bounds(one));
        Self::over(&Held {
            occluders,
            bounds: bounds.fold(Bounds::EMPTY, Bounds::union),
            surfaces: Some(surfaces.to_vec()),
        })
    }

    /// Returns about the bytes that building the tree takes at its height, and those of the tree. How full groups and
    /// nodes are hardly depends on the scene (`crates/antumbra/tests/memory.rs`).
    pub(crate) fn predict_bytes(occluders: &Occluders) -> [u64; 2] {
        /// Shapes in a group, and groups below a node.
        const FULL: [f64; 2] = [1.6, 5.0];
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
        // For each surface two nodes of the binary tree and how they are cut, until all is written, and how the wide
        // tree is laid out: about one and a half words, in a vector that has grown.
        let binary = 2 * (size_of::<BinaryNode>() + size_of::<Choice>()) + 3 * size_of::<u32>();
        [taken + (binary * surface_count) as u64, taken]
    }

    fn over(held: &Held) -> Self {
        Self::of_binary(held, &Binary::new(held.boxes()))
    }

    /// Cuts a binary tree over the surfaces.
    pub(super) fn of_binary(held: &Held, binary: &Binary) -> Self {
        let frame = Frame::new(held.bounds);
        let mut bvh = Self {
            frame,
            bounds: held.bounds.inflated(DVec3::splat(frame.margin)),
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
        let plan = Plan::new(held, binary);
        Writer {
            held,
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

/// How the subtree of one node of the binary tree is cut best, in 32 bits.
///
/// For each of the seven numbers of children after 1 three bits: how many of them the left side takes; 0: one
/// child fewer is as good. For a single child the same of the wide node's eight. Then whether a single child
/// is a group, and what the subtree holds.
#[derive(Clone, Copy, Debug)]
struct Choice(u32);

impl Choice {
    fn new(left_shares: [u8; WIDTH], is_group: bool, content: Content) -> Self {
        let shares = (0..)
            .zip(left_shares)
            .fold(0, |bits, (i, share)| bits | u32::from(share) << (3 * i));
        Self(shares | u32::from(is_group) << 24 | (content as u32) << 25)
    }

    fn left_share(self, child_count: usize) -> usize {
        (self.0 >> (3 * (child_count - 1)) & 7) as usize
    }

    fn is_group(self) -> bool {
        self.0 >> 24 & 1 != 0
    }

    fn content(self) -> Content {
        match self.0 >> 25 {
            0 => Content::Triangles,
            1 => Content::Spheres,
            2 => Content::Other,
            _ => Content::Mixed,
        }
    }
}

/// What a node's parent must know to choose.
#[derive(Clone, Copy, Debug)]
struct Costs {
    /// Cheapest cost of the subtree as at most `i + 1` children of a wide node.
    of_children: [f32; WIDTH],
    surface_count: u32,
    content: Content,
}

/// For each node of the binary tree how its subtree is cut best.
struct Plan<'a> {
    binary: &'a Binary,
    choices: Vec<Choice>,
}

impl<'a> Plan<'a> {
    fn new(held: &Held, binary: &'a Binary) -> Self {
        let count = binary.nodes.len();
        let mut choices = vec![Choice(0); count];
        // Nodes come depth first. From the last to the first, the two subtrees that were decided last and wait
        // for their parents are a node's own, the left one on top.
        let mut waiting: Vec<Costs> = Vec::new();
        for node in checked((0..count).rev()) {
            let area = binary.nodes[node].bounds.half_area();
            let (choice, costs) = match binary.nodes[node].surface() {
                Some(number) => Self::of_surface(held.occluders, held.surface(number), area),
                None => match (waiting.pop(), waiting.pop()) {
                    (Some(left), Some(right)) => Self::of_sides(area, &left, &right),
                    // No node is without sides.
                    _ => break,
                },
            };
            choices[node] = choice;
            waiting.push(costs);
        }
        Self { binary, choices }
    }

    fn bounds(&self, node: usize) -> &FrameBox {
        &self.binary.nodes[node].bounds
    }

    fn is_group(&self, node: usize) -> bool {
        self.choices[node].is_group()
    }

    fn of_surface(occluders: &Occluders, surface: SurfaceId, area: f32) -> (Choice, Costs) {
        let (content, cost) = if (surface.0 as usize) < occluders.triangle_count() {
            (Content::Triangles, GROUP_COST)
        } else if occluders.sphere(surface).is_some() {
            (Content::Spheres, GROUP_COST)
        } else {
            (Content::Other, OTHER_COST)
        };
        let costs = Costs {
            of_children: [area * cost; WIDTH],
            surface_count: 1,
            content,
        };
        (Choice::new([0; WIDTH], true, content), costs)
    }

    fn of_sides(area: f32, left: &Costs, right: &Costs) -> (Choice, Costs) {
        let surface_count = left.surface_count + right.surface_count;
        let content = if left.content == right.content {
            left.content
        } else {
            Content::Mixed
        };
        // As exactly `i + 1` children: the best split between left and right.
        let mut costs = [f32::INFINITY; WIDTH];
        let mut shares = [0u32; WIDTH];
        let mut shifted = [f32::INFINITY; 2 * WIDTH];
        shifted[WIDTH..].copy_from_slice(&right.of_children);
        for share in 1..WIDTH {
            // Where the left side takes so many, the right side has the others.
            let left = left.of_children[share - 1];
            for i in 0..WIDTH {
                let cost = left + shifted[WIDTH + i - share];
                let is_less = cost < costs[i];
                costs[i] = if is_less { cost } else { costs[i] };
                shares[i] = if is_less { share as u32 } else { shares[i] };
            }
        }
        let mut shares = shares.map(|share| share as u8);
        // As one child: a group of shapes, or a node with eight children.
        let is_groupable = surface_count <= LANES as u32
            && matches!(content, Content::Triangles | Content::Spheres);
        let as_node = area * NODE_COST + costs[WIDTH - 1];
        let as_group = if is_groupable {
            area * GROUP_COST
        } else {
            f32::INFINITY
        };
        let is_group = as_group <= as_node;
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
        let costs = Costs {
            of_children: costs,
            surface_count,
            content,
        };
        (Choice::new(shares, is_group, content), costs)
    }

    /// Returns the children of the wide node that a subtree becomes.
    fn wide_children(&self, node: usize) -> Wide {
        let mut children = Wide::default();
        let Some([left, right]) = self.binary.children(node).filter(|_| !self.is_group(node))
        else {
            // The root of a scene of a few shapes.
            children.push(node);
            return children;
        };
        let share = self.choices[node].left_share(1);
        // All together never wait for more children than a node has.
        let mut pending = [(0, 0); WIDTH];
        pending[0] = (right, WIDTH - share);
        pending[1] = (left, share);
        let mut height = 2;
        while height > 0 {
            height -= 1;
            let (node, mut slots) = pending[height];
            while slots > 1 && self.choices[node].left_share(slots) == 0 {
                slots -= 1;
            }
            match self.binary.children(node) {
                Some([left, right]) if slots > 1 => {
                    let share = self.choices[node].left_share(slots);
                    pending[height] = (right, slots - share);
                    pending[height + 1] = (left, share);
                    height += 2;
                }
                _ => children.push(node),
            }
        }
        children
    }

    /// Returns the children in the order in which a ray asks them, groups first, and how many of these there are.
    fn ordered_children(&self, node: usize) -> (Wide, usize) {
        let mut children = self.wide_children(node);
        // Leaves first; then those that a ray hits most likely.
        let key = |&node: &u32| {
            let node = node as usize;
            (!self.is_group(node), self.bounds(node).half_area())
        };
        children.as_mut().sort_by(|a, b| {
            let ((is_a_node, a), (is_b_node, b)) = (key(a), key(b));
            is_a_node.cmp(&is_b_node).then(b.total_cmp(&a))
        });
        let groups = children.as_ref().iter();
        let group_count = groups
            .filter(|&&child| self.is_group(child as usize))
            .count();
        (children, group_count)
    }
}

/// The children of a wide node, as nodes of the binary tree.
#[derive(Clone, Copy, Debug, Default)]
struct Wide {
    nodes: [u32; WIDTH],
    count: usize,
}

impl Wide {
    fn push(&mut self, node: usize) {
        self.nodes[self.count] = node as u32;
        self.count += 1;
    }
}

impl AsRef<[u32]> for Wide {
    fn as_ref(&self) -> &[u32] {
        &self.nodes[..self.count]
    }
}

impl AsMut<[u32]> for Wide {
    fn as_mut(&mut self) -> &mut [u32] {
        &mut self.nodes[..self.count]
    }
}

/// Writes the wide tree.
struct Writer<'a> {
    held: &'a Held<'a>,
    plan: &'a Plan<'a>,
    bvh: &'a mut Bvh,
}

impl Writer<'_> {
    /// Lays out the nodes and takes room for them and for all groups: vectors that grow would take twice as much.
    /// Returns for each node how many children and groups it has, and its children. Nodes come depth first, so that
    /// a node's first inner child is the next in memory.
    fn lay_out(&mut self) -> Vec<u32> {
        let mut laid = Vec::new();
        let mut node_count = 0;
        let mut counts = [0; 4];
        let mut pending = vec![(0, 1)];
        while let Some((node, depth)) = pending.pop() {
            check();
            node_count += 1;
            self.bvh.depth = self.bvh.depth.max(depth);
            let (children, group_count) = self.plan.ordered_children(node);
            let (groups, inner) = children.as_ref().split_at(group_count);
            for &group in groups {
                counts[self.plan.choices[group as usize].content() as usize] += 1;
            }
            let inner = inner.iter().rev();
            pending.extend(inner.map(|&child| (child as usize, depth + 1)));
            laid.push((children.count << 4 | group_count) as u32);
            laid.extend_from_slice(children.as_ref());
        }
        let [triangle_count, sphere_count, other_count, mixed_count] = counts;
        self.bvh.nodes.reserve_exact(node_count);
        self.bvh.triangles.reserve_exact(triangle_count);
        self.bvh.spheres.reserve_exact(sphere_count);
        self.bvh.others.reserve_exact(other_count + mixed_count);
        laid
    }

    fn write(&mut self) {
        let laid = self.lay_out();
        let mut laid = laid.as_slice();
        // Children whose numbers their parents wait for, on top the next.
        let mut due: Vec<(usize, usize)> = Vec::new();
        while let [counts, rest @ ..] = laid {
            check();
            let index = self.bvh.nodes.len();
            if let Some((parent, slot)) = due.pop() {
                self.bvh.nodes[parent].children[slot] = Child::new(ChildKind::Node, index);
            }
            let (count, group_count) = ((counts >> 4) as usize, (counts & 15) as usize);
            let (children, rest) = rest.split_at(count);
            laid = rest;
            let mut node = Node {
                planes: [[FAR_AWAY; WIDTH]; 6],
                children: [Child::NONE; WIDTH],
            };
            for (slot, &child) in children.iter().enumerate() {
                let bounds = self.plan.bounds(child as usize);
                for axis in 0..3 {
                    node.planes[axis][slot] = bounds.min[axis];
                    node.planes[axis + 3][slot] = bounds.max[axis];
                }
                if slot < group_count {
                    node.children[slot] = self.group(child as usize);
                }
            }
            due.extend((group_count..count).rev().map(|slot| (index, slot)));
            self.bvh.nodes.push(node);
        }
    }

    fn group(&mut self, node: usize) -> Child {
        let mut surfaces = [SurfaceId(u32::MAX); LANES];
        let mut count = 0;
        // Depth first, a group's nodes come one after the other, until no side is due.
        let mut due = 1;
        for node in &self.plan.binary.nodes[node..] {
            match node.surface() {
                Some(number) => {
                    surfaces[count] = self.held.surface(number);
                    count += 1;
                    due -= 1;
                }
                None => due += 1,
            }
            if due == 0 {
                break;
            }
        }
        let surfaces = &mut surfaces[..count];
        surfaces.sort_unstable();
        let bvh = &mut *self.bvh;
        match self.plan.choices[node].content() {
            Content::Triangles => {
                let group = TriangleGroup::new(self.held.occluders, &bvh.frame, surfaces);
                bvh.triangles.push(group);
                Child::new(ChildKind::Triangles, bvh.triangles.len() - 1)
            }
            Content::Spheres => {
                let group = SphereGroup::new(self.held.occluders, &bvh.frame, surfaces);
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
