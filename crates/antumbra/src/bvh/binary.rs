//! The binary tree over the surfaces' boxes, from the top down.
//!
//! Each range of boxes is cut where the surface area heuristic costs least among planes at even distances along
//! each axis (Wald 2007). Where the cuts of one range after another take little off, ranges are halved by number:
//! so no scene takes more than `n log n`, nested boxes, fans and heaps with one middle included. One thread,
//! no hashing, no clock: the tree is a function of the boxes.

use antumbra_geometry::{Bounds, DVec3};
use antumbra_task::check;
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};

use super::data::LANES;
use super::ray::PLANE_ROOM;
use crate::frame::Frame;

/// Places along an axis between which a range may be cut: so many, and more in larger ranges.
const FEWEST_BINS: usize = 8;
const MOST_BINS: usize = 32;
const BOXES_A_BIN: usize = 16;

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
}

/// The tree, depth first: a node's left side comes right after it.
#[derive(Debug)]
pub(super) struct Binary {
    pub(super) nodes: Vec<BinaryNode>,
}

/// A node with two children, or a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: FrameBox,
    /// The right child, or a surface and [`Self::IS_SURFACE`].
    link: u32,
}

impl BinaryNode {
    const IS_SURFACE: u32 = 1 << 31;

    fn of_surface(bounds: FrameBox, surface: u32) -> Self {
        Self {
            bounds,
            link: surface | Self::IS_SURFACE,
        }
    }

    /// Returns the number of a leaf's surface among the boxes.
    pub(super) fn surface(&self) -> Option<u32> {
        (self.link & Self::IS_SURFACE != 0).then_some(self.link & !Self::IS_SURFACE)
    }
}

impl Binary {
    /// Returns the children of a node.
    pub(super) fn children(&self, node: usize) -> Option<[usize; 2]> {
        let link = self.nodes[node].link;
        (link & BinaryNode::IS_SURFACE == 0).then_some([node + 1, link as usize])
    }

    /// Builds the tree over boxes; surfaces are numbered as these.
    pub(super) fn new(boxes: Vec<FrameBox>) -> Self {
        let mut items: Vec<Item> = (0..)
            .zip(&boxes)
            .map(|(surface, bounds)| Item::new(bounds, surface))
            .collect();
        check();
        // There are millions, and the items say the same.
        drop(boxes);
        let mut binary = Self {
            nodes: Vec::with_capacity((2 * items.len()).saturating_sub(1)),
        };
        if !items.is_empty() {
            dispatch!(Level::new(), simd => Cutting::new(simd).cut(simd, &mut items, &mut binary));
            binary.fit();
        }
        binary
    }

    /// Returns the tree whose nodes these are, depth first: a leaf's surface, or a mark, and then its sides.
    pub(super) fn of_words(words: &[u32], boxes: &[FrameBox], inner: u32) -> Self {
        let mut binary = Self {
            nodes: Vec::with_capacity(words.len()),
        };
        // Nodes whose right sides are due.
        let mut due = Vec::new();
        for &word in words {
            if word == inner {
                due.push(binary.nodes.len());
                binary.add_inner();
            } else {
                let leaf = BinaryNode::of_surface(boxes[word as usize], word);
                binary.nodes.push(leaf);
                if let Some(parent) = due.pop() {
                    binary.nodes[parent].link = binary.nodes.len() as u32;
                }
            }
        }
        binary.fit();
        binary
    }

    /// Adds a node whose right side and box are still to come.
    fn add_inner(&mut self) {
        let bounds = FrameBox {
            min: [0.0; 3],
            max: [0.0; 3],
        };
        self.nodes.push(BinaryNode { bounds, link: 0 });
    }

    /// Fits boxes around their children's, from below: children come after their parents.
    fn fit(&mut self) {
        for node in (0..self.nodes.len()).rev() {
            if let Some([left, right]) = self.children(node) {
                self.nodes[node].bounds = self.nodes[left].bounds.union(&self.nodes[right].bounds);
            }
        }
    }
}

/// A surface's box, on its way into the tree: the lowest corner, the surface's bits, and the highest corner
/// negated, so that one minimum joins two boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
struct Item([f32; 8]);

impl Item {
    fn new(bounds: &FrameBox, surface: u32) -> Self {
        let ([a, b, c], [d, e, f]) = (bounds.min, bounds.max);
        Self([a, b, c, f32::from_bits(surface), -d, -e, -f, 0.0])
    }

    fn surface(&self) -> u32 {
        self.0[3].to_bits()
    }

    fn bounds(&self) -> FrameBox {
        let [a, b, c, _, d, e, f, _] = self.0;
        FrameBox {
            min: [a, b, c],
            max: [-d, -e, -f],
        }
    }

    fn half_area(&self) -> f32 {
        half_area(&self.0)
    }

    /// Returns twice the middle along an axis.
    #[inline(always)]
    fn middle(&self, axis: usize) -> f32 {
        self.0[axis] - self.0[axis + 4]
    }
}

/// Half the area of a box as an [`Item`] has it.
#[inline(always)]
fn half_area(x: &[f32; 8]) -> f32 {
    let [x, y, z] = [-x[4] - x[0], -x[5] - x[1], -x[6] - x[2]];
    x * y + y * z + z * x
}

/// Boxes of the items with their middles between two planes.
#[derive(Clone, Copy, Debug)]
struct Bin<S: Simd> {
    bounds: f32x8<S>,
    count: u32,
}

/// How a range is cut.
#[derive(Clone, Copy, Debug)]
struct Cut {
    axis: usize,
    /// Items of bins up to this one are on the left.
    last: u32,
}

/// Bins along one axis of a range.
#[derive(Clone, Copy, Debug)]
struct Bins {
    from: [f32; 3],
    rate: [f32; 3],
}

/// Added to a number, this leaves the nearest whole one in the last bits.
const WHOLE: f32 = 12_582_912.0; // 3 * 2^22

impl Bins {
    /// Lays bins over the middles of some items; `None` if these are one.
    #[inline(always)]
    fn over(items: &[Item], count: usize) -> Option<Self> {
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for item in items {
            for axis in 0..3 {
                let middle = item.middle(axis);
                low[axis] = low[axis].min(middle);
                high[axis] = high[axis].max(middle);
            }
        }
        let mut rate = [0.0; 3];
        for axis in 0..3 {
            let most = (count - 1) as f32 * (1.0 - 1e-6);
            let extent = high[axis] - low[axis];
            // Not where the division overflows, either.
            let fine = most / extent;
            rate[axis] = if fine.is_finite() { fine } else { 0.0 };
        }
        (rate != [0.0; 3]).then_some(Self { from: low, rate })
    }

    #[inline(always)]
    fn bin(&self, item: &Item, axis: usize) -> u32 {
        let place = (item.middle(axis) - self.from[axis]) * self.rate[axis] + WHOLE;
        place.to_bits() & (MOST_BINS as u32 - 1)
    }
}

/// Room for the cutting of ranges, taken once.
struct Cutting<S: Simd> {
    bins: [[Bin<S>; MOST_BINS]; 3],
    empty: Bin<S>,
}

impl<S: Simd> Cutting<S> {
    fn new(simd: S) -> Self {
        let empty = Bin {
            bounds: f32x8::splat(simd, f32::INFINITY),
            count: 0,
        };
        Self {
            bins: [[empty; MOST_BINS]; 3],
            empty,
        }
    }

    /// Writes the tree over items, which it puts in order.
    #[inline(always)]
    fn cut(&mut self, simd: S, items: &mut [Item], binary: &mut Binary) {
        // Ranges deeper than any sensible tree's are halved.
        let usual_depth = 2 * items.len().ilog2() + 8;
        struct Pending {
            from: usize,
            to: usize,
            parent: Option<usize>,
            depth: u32,
        }
        let mut pending = vec![Pending {
            from: 0,
            to: items.len(),
            parent: None,
            depth: 0,
        }];
        while let Some(Pending {
            from,
            to,
            parent,
            depth,
        }) = pending.pop()
        {
            let here = binary.nodes.len();
            if let Some(parent) = parent {
                binary.nodes[parent].link = here as u32;
            }
            let range = &mut items[from..to];
            if let [item] = range {
                let leaf = BinaryNode::of_surface(item.bounds(), item.surface());
                binary.nodes.push(leaf);
                continue;
            }
            binary.add_inner();
            let middle = from + self.split(simd, range, depth > usual_depth);
            pending.push(Pending {
                from: middle,
                to,
                parent: Some(here),
                depth: depth + 1,
            });
            pending.push(Pending {
                from,
                to: middle,
                parent: None,
                depth: depth + 1,
            });
        }
    }

    /// Puts the items of one side first and returns how many these are: some, and not all.
    #[inline(always)]
    fn split(&mut self, simd: S, items: &mut [Item], is_deep: bool) -> usize {
        if items.len() <= 2 {
            return 1;
        }
        let bin_count = (FEWEST_BINS + items.len() / BOXES_A_BIN).min(MOST_BINS);
        let bins = Bins::over(items, bin_count);
        let cut = bins
            .filter(|_| !is_deep)
            .and_then(|bins| Some((bins, self.best_cut(simd, items, &bins, bin_count)?)));
        match (cut, bins) {
            (Some((bins, cut)), _) => {
                let (mut low, mut high) = (0, items.len());
                while low < high {
                    if bins.bin(&items[low], cut.axis) <= cut.last {
                        low += 1;
                    } else {
                        high -= 1;
                        items.swap(low, high);
                    }
                }
                low
            }
            (None, Some(bins)) => {
                // The axis on which middles are farthest apart.
                let axis = (0..3)
                    .min_by(|&a, &b| {
                        let spread = |axis: usize| match bins.rate[axis] {
                            0.0 => f32::INFINITY,
                            rate => rate,
                        };
                        spread(a).total_cmp(&spread(b))
                    })
                    .unwrap_or(0);
                let half = items.len() / 2;
                items.select_nth_unstable_by(half, |a, b| {
                    let by_middle = a.middle(axis).total_cmp(&b.middle(axis));
                    by_middle.then(a.surface().cmp(&b.surface()))
                });
                half
            }
            // Boxes with one middle lie one in the other: the smaller ones apart from the larger.
            (None, None) => {
                let half = items.len() / 2;
                items.select_nth_unstable_by(half, |a, b| {
                    let by_area = a.half_area().total_cmp(&b.half_area());
                    by_area.then(a.surface().cmp(&b.surface()))
                });
                half
            }
        }
    }

    /// Returns the cut that costs least, in groups of surfaces.
    #[inline(always)]
    fn best_cut(&mut self, simd: S, items: &[Item], bins: &Bins, bin_count: usize) -> Option<Cut> {
        for axis in 0..3 {
            self.bins[axis][..bin_count].fill(self.empty);
        }
        for item in items {
            let bounds = f32x8::from_slice(simd, &item.0);
            for axis in 0..3 {
                let bin = &mut self.bins[axis][bins.bin(item, axis) as usize];
                bin.bounds = bin.bounds.min(bounds);
                bin.count += 1;
            }
        }
        let group_count = |count: u32| count.div_ceil(LANES as u32) as f32;
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if bins.rate[axis] == 0.0 {
                continue;
            }
            let row = &self.bins[axis][..bin_count];
            // Costs of what is right of each cut, from the right; then of what is left.
            let mut right_costs = [0.0; MOST_BINS];
            let mut right = self.empty;
            for (i, bin) in row.iter().enumerate().skip(1).rev() {
                right.bounds = right.bounds.min(bin.bounds);
                right.count += bin.count;
                right_costs[i - 1] = half_area(&right.bounds.into()) * group_count(right.count);
            }
            let mut left = self.empty;
            for (i, bin) in row[..bin_count - 1].iter().enumerate() {
                left.bounds = left.bounds.min(bin.bounds);
                left.count += bin.count;
                if left.count == 0 || left.count as usize == items.len() {
                    continue;
                }
                let cost =
                    half_area(&left.bounds.into()) * group_count(left.count) + right_costs[i];
                if cost < least {
                    least = cost;
                    best = Some(Cut {
                        axis,
                        last: i as u32,
                    });
                }
            }
        }
        best
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
            let binary = Binary::new(boxes.clone());
            let mut seen = vec![false; boxes.len()];
            let mut pending = vec![(0, 1)];
            let mut deepest = 0;
            while let Some((node, depth)) = pending.pop() {
                deepest = deepest.max(depth);
                if let Some(children) = binary.children(node) {
                    pending.extend(children.map(|child| (child, depth + 1)));
                }
                if let Some(surface) = binary.nodes[node].surface() {
                    let surface = surface as usize;
                    assert!(!std::mem::replace(&mut seen[surface], true));
                    assert_eq!(binary.nodes[node].bounds, boxes[surface]);
                }
            }
            assert!(seen.iter().all(|&seen| seen));
            assert!(deepest < 25, "{deepest}");
        }
    }
}
