//! The umbra of a surface without a closed form: what surely blocks and what surely does not (Paper 9.1).

use super::{Relation, Shaft};
use crate::freeform::{Level, PatchPart};
use crate::segment::Segment;
use crate::{Bounds, LightShape};

/// An outer set that holds the surface, and an inner set through which no light comes. What lies between is uncertain, and left to
/// rays.
#[derive(Clone, Debug)]
pub(crate) struct FreeformUmbra {
    outer: BoxTree,
    inner: Vec<Bounds>,
}

/// Boxes are shrunk by this share on each side, so that every ray through one is in it for a good while: for many of the samples
/// that decide about an implicit surface.
const INSET: f64 = 1.0 / 16.0;

impl FreeformUmbra {
    pub(crate) fn of_patch<'a>(
        parts: impl Iterator<Item = &'a PatchPart>,
        _light: &LightShape,
    ) -> Self {
        Self {
            outer: BoxTree::new(parts.map(PatchPart::bounds).collect()),
            inner: Vec::new(),
        }
    }

    pub(crate) fn of_level(level: &Level, light: &LightShape) -> Self {
        let boxes = level.boxes();
        let whole = level.bounds();
        // A ray that goes deep inside comes out again before a light beyond the box.
        let is_beyond = match *light {
            LightShape::Point(place) => !whole.contains(place),
            LightShape::Direction(_) => true,
        };
        let inset = |bounds: &Bounds| {
            let inset = bounds.size() * INSET;
            Bounds {
                min: bounds.min + inset,
                max: bounds.max - inset,
            }
        };
        let least = whole.size().max_element() * SMALLEST;
        let inner = boxes
            .inner
            .iter()
            .filter(|bounds| is_beyond && bounds.size().min_element() > least)
            .map(inset)
            .collect();
        Self {
            outer: BoxTree::new(boxes.outer.clone()),
            inner,
        }
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        if self.outer.is_missed_by(shaft) {
            return Relation::Misses;
        }
        let covers = |bounds: &Bounds| {
            shaft
                .corner_segments()
                .all(|segment| goes_through(bounds, &segment))
        };
        if self.inner.iter().any(covers) {
            Relation::Covers
        } else {
            Relation::Crosses
        }
    }
}

/// Boxes in boxes.
#[derive(Clone, Debug, Default)]
struct BoxTree {
    /// Each node before those in it.
    nodes: Vec<BoxNode>,
}

#[derive(Clone, Copy, Debug)]
struct BoxNode {
    bounds: Bounds,
    /// The first node that is not in it.
    next: u32,
}

impl BoxTree {
    fn new(mut boxes: Vec<Bounds>) -> Self {
        let mut tree = Self::default();
        if !boxes.is_empty() {
            tree.add(&mut boxes);
        }
        tree
    }

    fn add(&mut self, boxes: &mut [Bounds]) {
        let bounds = boxes.iter().copied().fold(Bounds::EMPTY, Bounds::union);
        let number = self.nodes.len();
        self.nodes.push(BoxNode { bounds, next: 0 });
        if boxes.len() > 1 {
            let size = bounds.size();
            let axis = (0..3).fold(
                0,
                |most, axis| if size[axis] > size[most] { axis } else { most },
            );
            let middle = boxes.len() / 2;
            let place = |bounds: &Bounds| bounds.min[axis] + bounds.max[axis];
            boxes.select_nth_unstable_by(middle, |one, other| place(one).total_cmp(&place(other)));
            let (low, high) = boxes.split_at_mut(middle);
            self.add(low);
            self.add(high);
        }
        self.nodes[number].next = self.nodes.len() as u32;
    }

    fn is_missed_by(&self, shaft: &Shaft) -> bool {
        let mut number = 0;
        while let Some(node) = self.nodes.get(number) {
            if shaft.misses_box(&node.bounds) {
                number = node.next as usize;
            } else if node.next as usize == number + 1 {
                return false;
            } else {
                number += 1;
            }
        }
        true
    }
}

/// Boxes that are a smaller share of the surface's own may be between two samples.
const SMALLEST: f64 = 1.0 / 256.0;

/// Returns whether a segment begins in a box or goes through it. What is in or behind a convex set as seen from a light is
/// convex, so the corners of a box speak for all of it. Where a ray begins inside it comes out, too.
fn goes_through(bounds: &Bounds, segment: &Segment) -> bool {
    let (origin, direction) = (segment.origin(), segment.direction());
    let mut shares = [
        0.0,
        if segment.is_finite() {
            1.0
        } else {
            f64::INFINITY
        },
    ];
    for axis in 0..3 {
        let (from, along) = (origin[axis], direction[axis]);
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        if along == 0.0 {
            if from <= low || from >= high {
                return false;
            }
            continue;
        }
        let (one, other) = ((low - from) / along, (high - from) / along);
        shares = [shares[0].max(one.min(other)), shares[1].min(one.max(other))];
    }
    shares[0] < shares[1]
}
