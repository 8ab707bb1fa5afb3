//! The binary tree over the surfaces' boxes, by obvhs.
//!
//! Boxes with one middle, nested or coincident, are taken out first and halved by hand: bottom-up
//! building merges such a pile one by one, which makes a tree as deep as the pile and takes the
//! square of its size.

use antumbra_geometry::{Bounds, DVec3, SurfaceId};
use antumbra_task::check;
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::ray::PLANE_ROOM;
use crate::frame::Frame;

/// As many boxes with one middle make a pile.
const PILE: usize = 32;

/// Ten times what the library's medium setting starts with: a fifth fewer nodes on the way among the
/// boxes of a city, for twice the time to build.
const REINSERTION_RATIO: f32 = 0.5;

/// A surface's box in the frame's units, moved outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameBox {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

impl FrameBox {
    pub(super) fn new(frame: &Frame, bounds: &Bounds) -> Self {
        let room = DVec3::splat(frame.margin_in_frame + PLANE_ROOM);
        let min = frame.point_in_frame(bounds.min) - room;
        let max = frame.point_in_frame(bounds.max) + room;
        Self {
            min: min.to_array().map(|x| (x as f32).next_down()),
            max: max.to_array().map(|x| (x as f32).next_up()),
        }
    }
}

impl FrameBox {
    pub(super) fn half_area(&self) -> f32 {
        let [x, y, z] = std::array::from_fn(|axis| self.max[axis] - self.min[axis]);
        x * y + y * z + z * x
    }

    fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// Returns the cell of the middle, of edge `2^-19`.
    fn cell(&self) -> [i32; 3] {
        std::array::from_fn(|axis| {
            let middle = 0.5 * (self.min[axis] + self.max[axis]);
            (middle * (1u32 << 19) as f32).floor() as i32
        })
    }
}

impl Boundable for FrameBox {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.min.into(), self.max.into())
    }
}

/// The tree; the root is the first node.
#[derive(Debug)]
pub(super) struct Binary {
    pub(super) nodes: Vec<BinaryNode>,
}

/// A node with two children, or a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: FrameBox,
    content: NodeContent,
}

#[derive(Clone, Copy, Debug)]
enum NodeContent {
    Children([u32; 2]),
    Surface(SurfaceId),
}

impl BinaryNode {
    pub(super) fn children(&self) -> Option<[usize; 2]> {
        match self.content {
            NodeContent::Children(children) => Some(children.map(|child| child as usize)),
            NodeContent::Surface(_) => None,
        }
    }

    /// Returns a leaf's surface; an inner node's is none's.
    pub(super) fn surface(&self) -> SurfaceId {
        match self.content {
            NodeContent::Children(_) => SurfaceId(u32::MAX),
            NodeContent::Surface(surface) => surface,
        }
    }
}

impl Binary {
    /// Builds the tree over boxes; surfaces are numbered as these.
    pub(super) fn new(boxes: &[FrameBox]) -> Self {
        if boxes.is_empty() {
            return Self { nodes: Vec::new() };
        }
        // Runs of boxes with one middle, smaller boxes first.
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let keys: Vec<[i32; 3]> = boxes.iter().map(FrameBox::cell).collect();
        let bounds_of = |surface: u32| &boxes[surface as usize];
        order.sort_unstable_by(|&a, &b| {
            keys[a as usize]
                .cmp(&keys[b as usize])
                .then_with(|| {
                    let area = |surface: u32| bounds_of(surface).half_area();
                    area(a).total_cmp(&area(b))
                })
                .then(a.cmp(&b))
        });
        let mut runs: Vec<&[u32]> = Vec::with_capacity(boxes.len());
        for run in order.chunk_by(|&a, &b| keys[a as usize] == keys[b as usize]) {
            if run.len() >= PILE {
                runs.push(run);
            } else {
                runs.extend(run.chunks(1));
            }
        }
        // In the order of the surfaces again, which decides ties of the builder.
        runs.sort_unstable_by_key(|run| run[0]);

        let run_boxes: Vec<FrameBox> = runs
            .iter()
            .map(|run| {
                let first = *bounds_of(run[0]);
                run.iter()
                    .fold(first, |all, &surface| all.union(bounds_of(surface)))
            })
            .collect();
        check();
        let mut tree = PlocBuilder::with_capacity(runs.len()).build(
            PlocSearchDistance::Medium,
            &run_boxes,
            (0..runs.len() as u32).collect(),
            SortPrecision::U64,
            3,
        );
        check();
        ReinsertionOptimizer::default().run(&mut tree, REINSERTION_RATIO, None);
        check();

        // Copy it, with the piles in the places of their leaves.
        let mut binary = Self {
            nodes: Vec::with_capacity(2 * boxes.len()),
        };
        let mut pending = vec![(0usize, None)];
        while let Some((node, parent)) = pending.pop() {
            let node = &tree.nodes[node];
            let first = node.first_index as usize;
            if node.is_leaf() {
                binary.add_pile(boxes, runs[tree.primitive_indices[first] as usize], parent);
            } else {
                // Its box comes with those of its children.
                let bounds = boxes[0];
                let here = binary.add(bounds, NodeContent::Children([0; 2]), parent);
                pending.push((first + 1, Some((here, 1))));
                pending.push((first, Some((here, 0))));
            }
        }
        binary.fit();
        binary
    }

    /// Returns the tree whose nodes these are, depth first: a leaf's surface, or a mark, and then its sides.
    pub(super) fn of_words(words: &[u32], boxes: &[FrameBox], inner: u32) -> Self {
        let mut binary = Self {
            nodes: Vec::with_capacity(words.len()),
        };
        let mut pending = vec![None];
        for &word in words {
            let parent = pending.pop().flatten();
            if word == inner {
                let here = binary.add(boxes[0], NodeContent::Children([0; 2]), parent);
                pending.extend([Some((here, 1)), Some((here, 0))]);
            } else {
                let surface = NodeContent::Surface(SurfaceId(word));
                binary.add(boxes[word as usize], surface, parent);
            }
        }
        binary.fit();
        binary
    }

    /// Fits boxes around their children's, from below: children come after their parents.
    fn fit(&mut self) {
        for node in (0..self.nodes.len()).rev() {
            if let Some([left, right]) = self.nodes[node].children() {
                self.nodes[node].bounds = self.nodes[left].bounds.union(&self.nodes[right].bounds);
            }
        }
    }

    /// Adds a node and tells its parent.
    fn add(
        &mut self,
        bounds: FrameBox,
        content: NodeContent,
        parent: Option<(usize, usize)>,
    ) -> usize {
        let here = self.nodes.len();
        self.nodes.push(BinaryNode { bounds, content });
        if let Some((parent, side)) = parent
            && let NodeContent::Children(children) = &mut self.nodes[parent].content
        {
            children[side] = here as u32;
        }
        here
    }

    /// Adds surfaces as a balanced tree.
    fn add_pile(&mut self, boxes: &[FrameBox], run: &[u32], parent: Option<(usize, usize)>) {
        let mut pending = vec![(run, parent)];
        while let Some((run, parent)) = pending.pop() {
            let bounds = boxes[run[0] as usize];
            if let [surface] = *run {
                self.add(bounds, NodeContent::Surface(SurfaceId(surface)), parent);
                continue;
            }
            let here = self.add(bounds, NodeContent::Children([0; 2]), parent);
            let (low, high) = run.split_at(run.len() / 2);
            pending.push((high, Some((here, 1))));
            pending.push((low, Some((here, 0))));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene of boxes whose bottom-up tree would be a chain.
    fn nested(count: u32, share: f32) -> Vec<FrameBox> {
        (0..count)
            .map(|i| {
                let reach = 0.5 - 0.4 * share * i as f32 / count as f32;
                FrameBox {
                    min: [-reach; 3],
                    max: [reach; 3],
                }
            })
            .collect()
    }

    #[test]
    fn piles_are_balanced_and_complete() {
        for share in [0.0, 1.0] {
            let boxes = nested(100_000, share);
            let binary = Binary::new(&boxes);
            let mut seen = vec![false; boxes.len()];
            let mut pending = vec![(0, 1)];
            let mut deepest = 0;
            while let Some((node, depth)) = pending.pop() {
                deepest = deepest.max(depth);
                let node = &binary.nodes[node];
                match node.children() {
                    Some(children) => pending.extend(children.map(|child| (child, depth + 1))),
                    None => {
                        let surface = node.surface().0 as usize;
                        assert!(!std::mem::replace(&mut seen[surface], true));
                        assert_eq!(node.bounds, boxes[surface]);
                    }
                }
            }
            assert!(seen.iter().all(|&seen| seen));
            assert!(deepest < 25, "{deepest}");
        }
    }
}
