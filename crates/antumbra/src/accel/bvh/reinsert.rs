//! A binary tree made better: subtrees move to where they cost less.
//!
//! In: a binary tree. Out: one over the same surfaces, in which a ray meets fewer boxes. A subtree with a large box is
//! taken out and put beside the node where the areas of all boxes together shrink most (Meister and Bittner 2018);
//! one after the other, in the order of the tree, so that no two moves are in each other's way. A look around ends
//! after so many nodes, and a tree that became too deep is left as it was: no scene takes more than its number of
//! surfaces. One thread, no hashing, no clock: the tree is a function of the one before.

use antumbra_task::check;

use super::binary::{Binary, FrameBox};

/// Fewer surfaces have one tree, or nearly so.
const FEWEST_SURFACES: usize = 4;

/// Of more surfaces nothing moves: rays wait for memory there, and not for boxes, and moving takes a fifth of the time
/// to build.
const MOST_SURFACES: usize = 1 << 20;

/// Share of all subtrees that are looked at, the ones with the largest boxes. Five times as many leave rays through
/// FlightHelmet 1 % fewer nodes and a tenth fewer tests, and take a third more time to build.
const SHARE: f32 = 0.1;

/// Nodes that are looked at for one subtree.
const MOST_VISITS: usize = 64;

/// Boxes that are fitted until it is given up, for each node of the tree.
const MOST_STEPS_EACH: usize = 16;

/// Areas that the share is estimated from.
const SAMPLES: usize = 4096;

/// A node with what it knows of its children: a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Inner {
    bounds: [FrameBox; 2],
    /// Inner nodes, or what the binary tree has for a surface.
    links: [u32; 2],
    /// Whose child it is.
    place: Place,
}

/// A child of an inner node: the node's number and the side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place(u32);

impl Place {
    const NONE: Self = Self(u32::MAX);

    fn new(node: usize, side: usize) -> Self {
        Self((node << 1 | side) as u32)
    }

    fn node(self) -> usize {
        (self.0 >> 1) as usize
    }

    fn side(self) -> usize {
        (self.0 & 1) as usize
    }

    fn beside(self) -> Self {
        Self(self.0 ^ 1)
    }
}

/// The tree while it changes.
struct Moving {
    nodes: Vec<Inner>,
    /// Places that are to be looked at, with what is left of the area there.
    ahead: Vec<(f32, Place)>,
    /// Steps upwards until it is given up, so that chains do not take the square of their length.
    steps_left: usize,
}

/// Makes a tree better.
pub(super) fn reinsert(binary: &mut Binary) {
    let surface_count = binary.nodes.len().div_ceil(2);
    if !(FEWEST_SURFACES..=MOST_SURFACES).contains(&surface_count) {
        return;
    }
    let mut moving = Moving::new(binary);
    moving.improve();
    // Boxes in boxes cost least as a chain.
    let usual_depth = 3 * surface_count.ilog2() as usize + 16;
    if moving.steps_left > 0 && moving.depth() <= usual_depth {
        moving.write(binary);
    }
}

impl Moving {
    fn new(binary: &Binary) -> Self {
        let mut nodes: Vec<Inner> = Vec::with_capacity(binary.nodes.len() / 2);
        // Right sides that are still to come, on top the next, and the place of the next node.
        let mut due = Vec::new();
        let mut place = Place::NONE;
        for (number, node) in binary.nodes.iter().enumerate() {
            if place != Place::NONE {
                let parent = &mut nodes[place.node()];
                parent.bounds[place.side()] = node.bounds;
                parent.links[place.side()] = node.link;
            }
            if binary.children(number).is_some() {
                let here = nodes.len();
                if place != Place::NONE {
                    nodes[place.node()].links[place.side()] = here as u32;
                }
                nodes.push(Inner {
                    bounds: [node.bounds; 2],
                    links: [0; 2],
                    place,
                });
                due.push(Place::new(here, 1));
                place = Place::new(here, 0);
            } else if let Some(next) = due.pop() {
                place = next;
            }
        }
        Self {
            steps_left: MOST_STEPS_EACH * nodes.len(),
            nodes,
            ahead: Vec::new(),
        }
    }

    fn bounds(&self, place: Place) -> &FrameBox {
        &self.nodes[place.node()].bounds[place.side()]
    }

    /// Returns the inner node at a place.
    fn inner(&self, place: Place) -> Option<usize> {
        let link = self.nodes[place.node()].links[place.side()];
        (!Binary::is_surface(link)).then_some(link as usize)
    }

    /// Looks at a share of all subtrees, those with the largest boxes.
    fn improve(&mut self) {
        let step = self.nodes.len().div_ceil(SAMPLES);
        let mut areas: Vec<f32> = self
            .nodes
            .iter()
            .step_by(step)
            .flat_map(|node| node.bounds.map(|bounds| bounds.half_area()))
            .collect();
        areas.sort_unstable_by(|a, b| b.total_cmp(a));
        let least = areas[((areas.len() as f32 * SHARE) as usize).min(areas.len() - 1)];
        for node in 1..self.nodes.len() {
            if node % 1024 == 0 {
                check();
            }
            if self.steps_left == 0 {
                return;
            }
            for side in 0..2 {
                let place = Place::new(node, side);
                let area = self.bounds(place).half_area();
                // The root stays where it is, and so do its children.
                if area >= least
                    && self.nodes[node].place != Place::NONE
                    && let Some(target) = self.better_place(place, area)
                {
                    self.put(place, target);
                }
            }
        }
    }

    /// Returns beside which node a subtree is best, if not where it is.
    fn better_place(&mut self, place: Place, area: f32) -> Option<Place> {
        let mut ahead = std::mem::take(&mut self.ahead);
        ahead.clear();
        let bounds = *self.bounds(place);
        let mut best = None;
        let mut most = 0.0;
        let mut visits_left = MOST_VISITS;
        // From its parent up: the area that is saved without it, and the box of what is left.
        let mut pivot = self.nodes[place.node()].place;
        let mut saved = self.bounds(pivot).half_area();
        let mut rest = *self.bounds(place.beside());
        let mut beside = place.beside();
        loop {
            ahead.push((saved, beside));
            while let Some((saved, there)) = ahead.pop() {
                if saved - area <= most {
                    continue;
                }
                if visits_left == 0 {
                    break;
                }
                visits_left -= 1;
                let other = self.bounds(there);
                let gain = saved - other.union(&bounds).half_area();
                if gain > most && there != place.beside() {
                    most = gain;
                    best = Some(there);
                }
                if let Some(inner) = self.inner(there) {
                    let saved = gain + other.half_area();
                    if saved - area > most {
                        ahead.push((saved, Place::new(inner, 1)));
                        ahead.push((saved, Place::new(inner, 0)));
                    }
                }
            }
            if beside != place.beside() {
                rest = rest.union(self.bounds(beside));
                let above = self.nodes[beside.node()].place;
                if above == Place::NONE {
                    break;
                }
                saved += self.bounds(above).half_area() - rest.half_area();
                pivot = above;
            }
            if visits_left == 0 {
                break;
            }
            visits_left -= 1;
            beside = pivot.beside();
        }
        self.ahead = ahead;
        best
    }

    /// Takes out a subtree and puts it beside another.
    fn put(&mut self, from: Place, to: Place) {
        let moved = from.node();
        let above = self.nodes[moved].place;
        let (left, left_side) = (self.nodes[moved], from.beside().side());
        self.set(above, left.bounds[left_side], left.links[left_side]);
        let (target, target_side) = (self.nodes[to.node()], to.side());
        self.set(
            from.beside(),
            target.bounds[target_side],
            target.links[target_side],
        );
        let bounds = target.bounds[target_side].union(&left.bounds[from.side()]);
        self.set(to, bounds, moved as u32);
        self.fit_above(to.node());
        self.fit_above(above.node());
    }

    fn set(&mut self, place: Place, bounds: FrameBox, link: u32) {
        let node = &mut self.nodes[place.node()];
        node.bounds[place.side()] = bounds;
        node.links[place.side()] = link;
        if !Binary::is_surface(link) {
            self.nodes[link as usize].place = place;
        }
    }

    /// Fits the boxes of a node and of those above.
    fn fit_above(&mut self, mut node: usize) {
        loop {
            let Inner { bounds, place, .. } = &self.nodes[node];
            let (bounds, place) = (bounds[0].union(&bounds[1]), *place);
            if place == Place::NONE || *self.bounds(place) == bounds {
                return;
            }
            self.nodes[place.node()].bounds[place.side()] = bounds;
            self.steps_left = self.steps_left.saturating_sub(1);
            node = place.node();
        }
    }

    /// Returns how many inner nodes there are on the longest way down.
    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut pending = vec![(0, 1)];
        while let Some((node, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            let inner = [0, 1].map(|side| self.inner(Place::new(node, side)));
            pending.extend(inner.into_iter().flatten().map(|inner| (inner, depth + 1)));
        }
        deepest
    }

    /// Writes the tree, depth first.
    fn write(&self, binary: &mut Binary) {
        let whole = self.nodes[0].bounds[0].union(&self.nodes[0].bounds[1]);
        binary.nodes.clear();
        let mut pending = vec![(whole, 0, None)];
        while let Some((bounds, link, parent)) = pending.pop() {
            let here = binary.add(bounds, link, parent);
            if !Binary::is_surface(link) {
                let node = &self.nodes[link as usize];
                pending.push((node.bounds[1], node.links[1], Some(here)));
                pending.push((node.bounds[0], node.links[0], None));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Long and short boxes, here and there.
    fn boxes(count: u32) -> Vec<FrameBox> {
        let place = |i: u32, by: u32| (i.wrapping_mul(by) % 1009) as f32 / 1009.0 - 0.5;
        (0..count)
            .map(|i| {
                let min = [place(i, 7919), place(i, 104_729), place(i, 1_299_709)];
                let mut max = min.map(|x| x + 0.01);
                max[i as usize % 3] += 0.3 * (i % 7) as f32 / 7.0;
                FrameBox { min, max }
            })
            .collect()
    }

    fn areas(binary: &Binary) -> f32 {
        let areas = binary.nodes.iter().map(|node| node.bounds.half_area());
        areas.sum()
    }

    #[test]
    fn trees_stay_whole_and_shrink() {
        for count in [1, 2, 3, 4, 5, 17, 2000] {
            let boxes = boxes(count);
            let mut binary = Binary::cut(boxes.iter().copied());
            let before = areas(&binary);
            reinsert(&mut binary);
            let after = areas(&binary);
            assert!(after <= before * 1.001, "{count}: {before} {after}");
            assert!(count < 2000 || after < 0.99 * before, "{before} {after}");

            let mut seen = vec![false; boxes.len()];
            let mut pending = vec![0];
            let mut node_count = 0;
            while let Some(node) = pending.pop() {
                node_count += 1;
                let bounds = binary.nodes[node].bounds;
                if let Some([left, right]) = binary.children(node) {
                    let [a, b] = [left, right].map(|side| binary.nodes[side].bounds);
                    assert_eq!(bounds, a.union(&b));
                    pending.extend([left, right]);
                }
                if let Some(surface) = binary.nodes[node].surface() {
                    assert_eq!(bounds, boxes[surface as usize]);
                    assert!(!std::mem::replace(&mut seen[surface as usize], true));
                }
            }
            assert!(seen.iter().all(|&seen| seen));
            assert_eq!(node_count, binary.nodes.len());
        }
    }
}
