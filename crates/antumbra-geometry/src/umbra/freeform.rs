//! The umbra of a surface without a closed form: what surely blocks and what surely does not (Paper 9.1).

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

use super::{Relation, Shaft};
use crate::freeform::{Half, Level, PatchPart, Piece};
use crate::segment::Segment;
use crate::{Bounds, LightShape};

/// An outer set that holds the surface, and an inner set through which no light comes. What lies between is uncertain, and left to
/// rays.
#[derive(Clone, Debug)]
pub(crate) enum FreeformUmbra {
    /// Boxes that hold the surface, and boxes deep inside.
    Boxes { outer: BoxTree, inner: Vec<Bounds> },
    /// A part of the patch, which knows the pieces of all of it.
    Patch(Arc<PatchPart>),
}

/// Boxes are shrunk by this share on each side, so that every ray through one is in it for a good while: for many of the samples
/// that decide about an implicit surface.
const INSET: f64 = 1.0 / 16.0;

impl FreeformUmbra {
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
        Self::Boxes {
            outer: BoxTree::new(boxes.outer.clone()),
            inner,
        }
    }

    pub(crate) fn relation(&self, shaft: &Shaft) -> Relation {
        let (is_missed, is_covered) = match self {
            Self::Boxes { outer, inner } => {
                let covers = |bounds: &Bounds| {
                    let mut segments = shaft.corner_segments();
                    segments.all(|segment| goes_through(bounds, &segment))
                };
                let is_missed = outer.is_missed_by(shaft);
                (is_missed, !is_missed && inner.iter().any(covers))
            }
            Self::Patch(part) => {
                let pieces = part.pieces();
                let node = |number| pieces.get(number).map(|it: &Piece| (it.bounds, it.next));
                let is_missed = are_missed(shaft, node);
                (is_missed, !is_missed && is_covered(pieces, shaft))
            }
        };
        if is_missed {
            Relation::Misses
        } else if is_covered {
            Relation::Covers
        } else {
            Relation::Crosses
        }
    }
}

impl FreeformUmbra {
    /// Visits the numbers of the surfaces of the element, counted from its first, that may block some start of a shaft's box, until a
    /// visit breaks it off.
    pub(crate) fn try_for_each_in_the_way(
        &self,
        shaft: &Shaft,
        mut visit: impl FnMut(u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Self::Patch(part) = self else {
            return visit(0);
        };
        let pieces = part.pieces();
        let (mut number, mut part) = (0, 0);
        while let Some(piece) = pieces.get(number) {
            let count = piece.next as usize - number;
            if shaft.misses_box(&piece.bounds) {
                // Of a tree of quarters, three in four are leaves: the parts, in their order.
                part += (3 * count as u32).div_ceil(4);
                number = piece.next as usize;
            } else {
                if count == 1 {
                    visit(part)?;
                    part += 1;
                }
                number += 1;
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns whether a shaft misses everything of a tree of boxes, each before those in it; `node` gives the box of a number and the first
/// number that is not in it, or `None` behind the last.
fn are_missed(shaft: &Shaft, node: impl Fn(usize) -> Option<(Bounds, u32)>) -> bool {
    let mut number = 0;
    while let Some((bounds, next)) = node(number) {
        if shaft.misses_box(&bounds) {
            number = next as usize;
        } else if next as usize == number + 1 {
            return false;
        } else {
            number += 1;
        }
    }
    true
}

/// Returns whether one of the pieces covers a shaft.
fn is_covered(pieces: &[Piece], shaft: &Shaft) -> bool {
    let size = shaft.bounds.size().max_element();
    let mut number = 0;
    while let Some(piece) = pieces.get(number) {
        // A piece that is smaller than the box may cover it, near a light, but hardly does.
        let is_small = piece.bounds.size().max_element() < size;
        if is_small || shaft.misses_box(&piece.bounds) {
            number = piece.next as usize;
        } else if piece
            .halves
            .iter()
            .flatten()
            .any(|half| covers(half, shaft))
        {
            return true;
        } else {
            number += 1;
        }
    }
    false
}

/// Returns whether no light comes through a half of a piece to any point of a shaft's box.
///
/// The half is a continuous image of a triangle, and no point of it is farther than `bend` from the same point of the triangle.
/// Seen along a ray that meets the triangle's plane at a cosine `c`, its border is that near to the triangle's, and a place
/// farther than `bend / c` inside of the triangle is farther from it than that. So the border winds round the ray,
/// and the half holds a point of the ray. It lies within `bend` of the plane, and both ends of the ray farther off. The
/// places behind a triangle as seen from a light are convex, so the corners of the box speak for all of it.
fn covers(half: &Half, shaft: &Shaft) -> bool {
    let [origin, ..] = half.corners;
    let (light, is_point) = match shaft.light {
        LightShape::Point(place) => (place, true),
        LightShape::Direction(direction) => (direction, false),
    };
    let height = |place: DVec3| half.normal.dot(place - origin);
    // What lights at infinity gain with every step along their direction.
    let light_height = if is_point {
        height(light)
    } else {
        half.normal.dot(light)
    };
    let side = light_height.signum();
    let beyond = 2.0 * half.bend;
    if is_point && side * light_height <= beyond {
        return false;
    }
    let (mut least_rise, mut longest) = (f64::INFINITY, 0.0_f64);
    for &corner in shaft.corners() {
        let corner_height = height(corner);
        if side * corner_height >= -beyond {
            return false;
        }
        let (rise, way) = if is_point {
            (light_height - corner_height, light - corner)
        } else {
            (light_height, light)
        };
        least_rise = least_rise.min(side * rise);
        longest = longest.max(way.length());
    }
    // A little more than what the bend may take, and for rounding.
    let margin = 1.01 * half.bend * longest / least_rise;
    shaft.corners().iter().all(|&corner| {
        let corner_height = height(corner);
        let (rise, way) = if is_point {
            (light_height - corner_height, light - corner)
        } else {
            (light_height, light)
        };
        let place = corner - way * (corner_height / rise);
        let mut edges = half.corners.iter().zip(&half.inwards);
        edges.all(|(&corner, inward)| inward.dot(place - corner) > margin)
    })
}

/// Boxes in boxes.
#[derive(Clone, Debug, Default)]
pub(crate) struct BoxTree {
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
        let node = |number| {
            self.nodes
                .get(number)
                .map(|it: &BoxNode| (it.bounds, it.next))
        };
        are_missed(shaft, node)
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
