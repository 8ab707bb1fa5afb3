//! The binary tree over the surfaces' boxes, from the top down.
//!
//! Each range of boxes is cut where the surface area heuristic costs least among planes at even distances along
//! each axis (Wald 2007), and of few boxes at any. Where the cuts of one range after another take little off, ranges are halved by number:
//! so no scene takes more than `n log n`, nested boxes, fans and heaps with one middle included. One thread,
//! no hashing, no clock: the tree is a function of the boxes.

use antumbra_task::{check, checked};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x8};

pub(super) use super::boxes::{Binary, BinaryNode, FrameBox};
use super::data::LANES;
use super::reinsert::reinsert;

/// Places along an axis between which a range may be cut, at most; a quarter in small ranges.
const MOST_BINS: usize = 32;

/// Ranges of so many boxes take as long as there may be between two looks whether to stop.
const CHECKED: usize = 1 << 12;

/// Of so few boxes all cuts are compared.
const FEW: usize = 8;

impl Binary {
    /// Returns the children of a node.
    pub(super) fn children(&self, node: usize) -> Option<[usize; 2]> {
        let link = self.nodes[node].link;
        (link & BinaryNode::IS_SURFACE == 0).then_some([node + 1, link as usize])
    }

    /// Builds the tree over boxes; surfaces are numbered as these.
    pub(super) fn new(boxes: impl ExactSizeIterator<Item = FrameBox>) -> Self {
        let mut binary = Self::cut(boxes);
        reinsert(&mut binary);
        binary
    }

    /// Cuts boxes from the top down, and no more.
    pub(super) fn cut(boxes: impl ExactSizeIterator<Item = FrameBox>) -> Self {
        let mut items = Vec::with_capacity(boxes.len());
        for (surface, bounds) in (0..).zip(checked(boxes)) {
            items.push(Item::new(&bounds, surface));
        }
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

    /// Returns whether a link is a surface's.
    pub(super) fn is_surface(link: u32) -> bool {
        link & BinaryNode::IS_SURFACE != 0
    }

    /// Adds a node, as the right side of another or right after it, and returns its number.
    pub(super) fn add(&mut self, bounds: FrameBox, link: u32, right_of: Option<usize>) -> usize {
        let here = self.nodes.len();
        if let Some(parent) = right_of {
            self.nodes[parent].link = here as u32;
        }
        self.nodes.push(BinaryNode { bounds, link });
        here
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
    /// Keeps small numbers of surfaces from being tiny `f32`s, which are slow.
    const NOT_TINY: u32 = 1 << 30;

    fn new(bounds: &FrameBox, surface: u32) -> Self {
        let ([a, b, c], [d, e, f]) = (bounds.min, bounds.max);
        let surface = f32::from_bits(surface | Self::NOT_TINY);
        Self([a, b, c, surface, -d, -e, -f, 0.0])
    }

    fn surface(&self) -> u32 {
        self.0[3].to_bits() & !Self::NOT_TINY
    }

    fn bounds(&self) -> FrameBox {
        let [a, b, c, _, d, e, f, _] = self.0;
        FrameBox {
            min: [a, b, c],
            max: [-d, -e, -f],
        }
    }

    fn half_area(&self) -> f32 {
        self.bounds().half_area()
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S) -> f32x8<S> {
        f32x8::from_slice(simd, &self.0)
    }

    /// Returns twice the middle along an axis.
    #[inline(always)]
    fn middle(&self, axis: usize) -> f32 {
        self.0[axis] - self.0[axis + 4]
    }
}

/// Returns twice the middle of a box as an [`Item`] has it; the last is nothing.
#[inline(always)]
fn middle<S: Simd>(bounds: f32x8<S>) -> f32x4<S> {
    let (low, high) = bounds.split();
    low - high
}

/// The box of the middles of some items.
#[derive(Clone, Copy, Debug)]
struct Middles<S: Simd> {
    low: f32x4<S>,
    high: f32x4<S>,
}

impl<S: Simd> Middles<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self {
            low: f32x4::splat(simd, f32::INFINITY),
            high: f32x4::splat(simd, f32::NEG_INFINITY),
        }
    }

    #[inline(always)]
    fn add(&mut self, middle: f32x4<S>) {
        self.low = self.low.min(middle);
        self.high = self.high.max(middle);
    }
}

/// How a range is cut.
#[derive(Clone, Copy, Debug)]
struct Cut {
    axis: usize,
    /// Items of bins up to this one are on the left.
    last: u32,
}

/// Bins along the axes of a range.
#[derive(Clone, Copy, Debug)]
struct Bins<S: Simd> {
    from: f32x4<S>,
    rate: f32x4<S>,
    /// The rate of each axis; 0 where all middles are one.
    rates: [f32; 4],
}

/// Added to a number, this leaves the nearest whole one in the last bits.
const WHOLE: f32 = 12_582_912.0; // 3 * 2^22

impl<S: Simd> Bins<S> {
    /// Lays bins over the middles of some items; `None` if these are one.
    #[inline(always)]
    fn over(simd: S, middles: &Middles<S>, count: usize) -> Option<Self> {
        let most = (count - 1) as f32 * (1.0 - 1e-6);
        let extents: [f32; 4] = (middles.high - middles.low).into();
        let mut rates = [0.0; 4];
        for axis in 0..3 {
            // Not where the division overflows, either.
            let rate = most / extents[axis];
            rates[axis] = if rate.is_finite() { rate } else { 0.0 };
        }
        (rates != [0.0; 4]).then_some(Self {
            from: middles.low,
            rate: f32x4::from_slice(simd, &rates),
            rates,
        })
    }

    /// Returns the bins of an item along all axes.
    #[inline(always)]
    fn bins(&self, simd: S, middle: f32x4<S>) -> [usize; 3] {
        let place = (middle - self.from) * self.rate + f32x4::splat(simd, WHOLE);
        let [x, y, z, _]: [f32; 4] = place.into();
        [x, y, z].map(|place| (place.to_bits() & (MOST_BINS as u32 - 1)) as usize)
    }
}

/// Room for the cutting of ranges, taken once.
struct Cutting<S: Simd> {
    /// Along each axis the boxes of the items whose middles are between two planes.
    bins: [[f32x8<S>; MOST_BINS]; 3],
    /// How many these are.
    counts: [[u32; MOST_BINS]; 3],
    /// Extents and numbers of groups of what is left and right of each plane of an axis.
    extents: [[f32; 4 * MOST_BINS]; 2],
    groups: [[f32; MOST_BINS]; 2],
}

/// A range of items that is to be cut.
struct Pending<S: Simd> {
    from: usize,
    to: usize,
    /// The node whose right side it is.
    parent: Option<usize>,
    depth: u32,
    middles: Middles<S>,
}

impl<S: Simd> Cutting<S> {
    fn new(simd: S) -> Self {
        Self {
            bins: [[f32x8::splat(simd, f32::INFINITY); MOST_BINS]; 3],
            counts: [[0; MOST_BINS]; 3],
            extents: [[0.0; 4 * MOST_BINS]; 2],
            groups: [[0.0; MOST_BINS]; 2],
        }
    }

    /// Writes the tree over items, which it puts in order.
    #[inline(always)]
    fn cut(&mut self, simd: S, items: &mut [Item], binary: &mut Binary) {
        // Ranges deeper than any sensible tree's are halved.
        let usual_depth = 2 * items.len().ilog2() + 8;
        let mut middles = Middles::none(simd);
        for item in &*items {
            middles.add(middle(item.load(simd)));
        }
        let mut pending = vec![Pending {
            from: 0,
            to: items.len(),
            parent: None,
            depth: 0,
            middles,
        }];
        while let Some(Pending {
            from,
            to,
            parent,
            depth,
            middles,
        }) = pending.pop()
        {
            let here = binary.nodes.len();
            if let Some(parent) = parent {
                binary.nodes[parent].link = here as u32;
            }
            if to - from >= CHECKED {
                check();
            }
            let range = &mut items[from..to];
            if let [item] = range {
                let leaf = BinaryNode::of_surface(item.bounds(), item.surface());
                binary.nodes.push(leaf);
                continue;
            }
            binary.add_inner();
            let (left_count, sides) = match range.len() {
                2 => (1, [middles; 2]),
                3..=FEW => (self.split_few(simd, range), [middles; 2]),
                _ => self.split(simd, range, &middles, depth > usual_depth),
            };
            let middle = from + left_count;
            let [left, right] = sides;
            pending.push(Pending {
                from: middle,
                to,
                parent: Some(here),
                depth: depth + 1,
                middles: right,
            });
            pending.push(Pending {
                from,
                to: middle,
                parent: None,
                depth: depth + 1,
                middles: left,
            });
        }
    }

    /// Puts the items of one side first and returns how many these are - some, and not all - and the middles
    /// of both.
    #[inline(always)]
    fn split(
        &mut self,
        simd: S,
        items: &mut [Item],
        middles: &Middles<S>,
        is_deep: bool,
    ) -> (usize, [Middles<S>; 2]) {
        let bin_count = match items.len() {
            0..=32 => MOST_BINS / 4,
            33..=256 => MOST_BINS / 2,
            _ => MOST_BINS,
        };
        let mut sides = [Middles::none(simd); 2];
        let bins = Bins::over(simd, middles, bin_count);
        let cut = bins
            .filter(|_| !is_deep)
            .and_then(|bins| Some((bins, self.best_cut(simd, items, &bins, bin_count)?)));
        if let Some((bins, cut)) = cut {
            let (mut low, mut high) = (0, items.len());
            while low < high {
                let middle = middle(items[low].load(simd));
                if bins.bins(simd, middle)[cut.axis] <= cut.last as usize {
                    sides[0].add(middle);
                    low += 1;
                } else {
                    sides[1].add(middle);
                    high -= 1;
                    items.swap(low, high);
                }
            }
            return (low, sides);
        }
        let half = items.len() / 2;
        match bins {
            Some(bins) => {
                // The axis on which middles are farthest apart.
                let axis = (0..3)
                    .min_by(|&a, &b| {
                        let spread = |axis: usize| match bins.rates[axis] {
                            0.0 => f32::INFINITY,
                            rate => rate,
                        };
                        spread(a).total_cmp(&spread(b))
                    })
                    .unwrap_or(0);
                items.select_nth_unstable_by(half, |a, b| {
                    let by_middle = a.middle(axis).total_cmp(&b.middle(axis));
                    by_middle.then(a.surface().cmp(&b.surface()))
                });
            }
            // Boxes with one middle lie one in the other: the smaller ones apart from the larger.
            None => {
                items.select_nth_unstable_by(half, |a, b| {
                    let by_area = a.half_area().total_cmp(&b.half_area());
                    by_area.then(a.surface().cmp(&b.surface()))
                });
            }
        }
        for (side, items) in sides.iter_mut().zip([&items[..half], &items[half..]]) {
            for item in items {
                side.add(middle(item.load(simd)));
            }
        }
        (half, sides)
    }

    /// Returns the cut that costs least, in groups of surfaces.
    #[inline(always)]
    fn best_cut(
        &mut self,
        simd: S,
        items: &[Item],
        bins: &Bins<S>,
        bin_count: usize,
    ) -> Option<Cut> {
        for axis in 0..3 {
            self.bins[axis][..bin_count].fill(f32x8::splat(simd, f32::INFINITY));
            self.counts[axis][..bin_count].fill(0);
        }
        for item in items {
            let bounds = item.load(simd);
            let places = bins.bins(simd, middle(bounds));
            for axis in 0..3 {
                let bin = &mut self.bins[axis][places[axis]];
                *bin = bin.min(bounds);
                self.counts[axis][places[axis]] += 1;
            }
        }
        let mut best = None;
        for axis in 0..3 {
            if bins.rates[axis] != 0.0 {
                self.better_cut(simd, axis, bin_count, &mut best);
            }
        }
        best.map(|(_, cut)| cut)
    }

    /// Puts at most [`FEW`] items in the order of the axis that they are cut best along, and returns how many are left
    /// of the cut: all cuts are compared.
    #[inline(always)]
    fn split_few(&mut self, simd: S, items: &mut [Item]) -> usize {
        let count = items.len();
        let bin_count = count.next_multiple_of(4);
        let mut best = None;
        let mut keys = [[f32::INFINITY; FEW]; 3];
        for (i, item) in items.iter().enumerate() {
            for axis in 0..3 {
                keys[axis][i] = item.middle(axis);
            }
        }
        for axis in 0..3 {
            self.bins[axis][..bin_count].fill(f32x8::splat(simd, f32::INFINITY));
            self.counts[axis][..bin_count].fill(0);
            let row = f32x8::from_slice(simd, &keys[axis]);
            for (i, item) in items.iter().enumerate() {
                // Each to the place that it has in order.
                let key = f32x8::splat(simd, keys[axis][i]);
                let before = row.simd_lt(key).to_bitmask() as u32;
                let same = row.simd_eq(key).to_bitmask() as u32 & ((1 << i) - 1);
                let place = (before | same).count_ones() as usize % FEW;
                self.bins[axis][place] = item.load(simd);
                self.counts[axis][place] = 1;
            }
            self.better_cut(simd, axis, bin_count, &mut best);
        }
        let cut = best.map_or(Cut { axis: 0, last: 0 }, |(_, cut)| cut);
        for (item, bin) in items.iter_mut().zip(&self.bins[cut.axis]) {
            item.0 = (*bin).into();
        }
        cut.last as usize + 1
    }

    /// Compares the cuts along an axis with the best so far.
    #[inline(always)]
    fn better_cut(
        &mut self,
        simd: S,
        axis: usize,
        bin_count: usize,
        best: &mut Option<(f32, Cut)>,
    ) {
        let (bins, counts) = (&self.bins[axis], &self.counts[axis]);
        let groups = |count: u32| count.div_ceil(LANES as u32) as f32;
        let [of_left, of_right] = &mut self.extents;
        let [left_groups, right_groups] = &mut self.groups;
        let extent = |bounds: f32x8<S>| -> [f32; 4] {
            let (low, high) = bounds.split();
            (-(low + high)).into()
        };
        let (mut bounds, mut count) = (f32x8::splat(simd, f32::INFINITY), 0);
        for i in 0..bin_count {
            bounds = bounds.min(bins[i]);
            count += counts[i];
            of_left[4 * i..4 * i + 4].copy_from_slice(&extent(bounds));
            left_groups[i] = groups(count);
        }
        (bounds, count) = (f32x8::splat(simd, f32::INFINITY), 0);
        for i in (0..bin_count).rev() {
            // What is right of the plane after this bin.
            of_right[4 * i..4 * i + 4].copy_from_slice(&extent(bounds));
            right_groups[i] = groups(count);
            bounds = bounds.min(bins[i]);
            count += counts[i];
        }
        let areas = |extents: &[f32; 4 * MOST_BINS], i: usize| {
            let four = extents[4 * i..4 * i + 16].try_into().unwrap_or(&[0.0; 16]);
            let [x, y, z, _] = simd.load_four_interleaved_f32x4(four);
            x * y + y * z + z * x
        };
        for i in (0..bin_count).step_by(4) {
            let left = areas(of_left, i) * f32x4::from_slice(simd, &left_groups[i..i + 4]);
            let right = areas(of_right, i) * f32x4::from_slice(simd, &right_groups[i..i + 4]);
            let costs: [f32; 4] = (left + right).into();
            for (place, &cost) in (i as u32..).zip(&costs) {
                // Nothing on one side costs what is no number.
                if cost < best.map_or(f32::INFINITY, |(least, _)| least) {
                    *best = Some((cost, Cut { axis, last: place }));
                }
            }
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
            let binary = Binary::new(boxes.clone().into_iter());
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
