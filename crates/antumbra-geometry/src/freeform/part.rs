//! A piece of a patch, as a surface of its own: which of its triangles a segment crosses, and which one a point is on.

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::bezier::{BezierPatch, Net};
use crate::Bounds;
use crate::flat::way_to_triangle;
use crate::intersect::{triangle_blocks, triangle_distance};
use crate::segment::Segment;

/// A square piece of a patch's cells.
#[derive(Clone, Debug)]
pub(crate) struct PatchPart {
    patch: Arc<Shared>,
    /// Its first cell.
    first: [u32; 2],
    /// It is halved so often down to cells.
    depth: u32,
    net: Net,
    bounds: Bounds,
    /// Largest magnitude of a coordinate of the patch.
    largest: f64,
    /// More than all roundings of coordinates here.
    room: f64,
}

/// Shared data of the parts of a patch.
#[derive(Debug)]
struct Shared {
    patch: BezierPatch,
    /// Halvings from the patch down to its parts.
    depth: u32,
    /// Made when first asked for.
    pieces: OnceLock<Vec<Piece>>,
}

/// A piece of a patch with what is known of its shadow.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub(crate) bounds: Bounds,
    /// The first of the pieces that are not in it; those that are follow it.
    pub(crate) next: u32,
    /// Its two halves; `None` where one has no area to speak of.
    pub(crate) halves: [Option<Half>; 2],
}

/// A half of a piece: flat up to how far it bends.
#[derive(Clone, Debug)]
pub(crate) struct Half {
    pub(crate) corners: [DVec3; 3],
    /// Unit normal.
    pub(crate) normal: DVec3,
    /// For each edge, from its corner to the next, the unit vector in the plane that looks inwards.
    pub(crate) inwards: [DVec3; 3],
    /// No point of the half is farther from the same point of the flat triangle.
    pub(crate) bend: f64,
}

impl Half {
    fn new(corners: [DVec3; 3], bend: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).try_normalize()?;
        let inward = |from: DVec3, to: DVec3| normal.cross(to - from).try_normalize();
        let inwards = [inward(a, b)?, inward(b, c)?, inward(c, a)?];
        // Thinner ones hold nothing that is far enough from the border.
        let width = inwards[0]
            .dot(c - a)
            .min(inwards[1].dot(a - b))
            .min(inwards[2].dot(b - c));
        (width > 2.0 * bend).then_some(Self {
            corners,
            normal,
            inwards,
            bend,
        })
    }
}

/// A share of the coordinates that is more than what vertices and nets are rounded by, and their projections.
const ROUNDING: f64 = 1.0 / (1_u64 << 46) as f64;

/// Pieces bend by no more than this share of their size, or are as small as they may be.
const FLAT: f64 = 1.0 / 16.0;

/// A patch has at most 4 to the power of this many pieces.
const MOST_HALVINGS: u32 = 3;

/// Cuts a patch into pieces that are nearly flat; at the same depth all over.
pub(crate) fn parts_of(patch: &BezierPatch) -> Vec<PatchPart> {
    let largest = patch
        .points()
        .fold(0.0_f64, |most, point| most.max(point.abs().max_element()));
    let patch = patch.clone();
    let mut nets = vec![([0, 0], Net(patch.control))];
    let mut depth = patch.level;
    let is_flat = |net: &Net| {
        let size = Bounds::of_points(net.points()).size().max_element();
        net.bend().max_element() <= FLAT * size
    };
    let most = MOST_HALVINGS.min(patch.level);
    while patch.level - depth < most && !nets.iter().all(|(_, net)| is_flat(net)) {
        depth -= 1;
        let quartered = nets.iter().flat_map(|&(first, net)| {
            let quarters = net.quarters().into_iter().enumerate();
            quarters.map(move |(number, quarter)| (quarter_at(first, number, depth), quarter))
        });
        nets = quartered.collect();
    }
    let room = ROUNDING * largest;
    let patch = Arc::new(Shared {
        depth: patch.level - depth,
        patch,
        pieces: OnceLock::new(),
    });
    let part = |(first, net): ([u32; 2], Net)| PatchPart {
        patch: Arc::clone(&patch),
        first,
        depth,
        net,
        bounds: Bounds::of_points(net.points()).inflated(DVec3::splat(room)),
        largest,
        room,
    };
    nets.into_iter().map(part).collect()
}

fn add_pieces(pieces: &mut Vec<Piece>, net: &Net, depth: u32, room: f64) {
    let number = pieces.len();
    let [first, along, across, last] = net.corners();
    let bend = net.bend().length() + 4.0 * room;
    pieces.push(Piece {
        bounds: Bounds::of_points(net.points()).inflated(DVec3::splat(room)),
        next: 0,
        halves: [[first, along, last], [first, last, across]]
            .map(|corners| Half::new(corners, bend)),
    });
    if depth > 0 {
        for quarter in net.quarters() {
            add_pieces(pieces, &quarter, depth - 1, room);
        }
    }
    pieces[number].next = pieces.len() as u32;
}

impl BezierPatch {
    /// Returns how many surfaces the patch becomes: parts that are nearly flat, 1 to 64.
    pub fn part_count(&self) -> usize {
        parts_of(self).len()
    }
}

/// Returns the first cell of a quarter that has 2 to the power of `depth` cells a side.
fn quarter_at([i, j]: [u32; 2], number: usize, depth: u32) -> [u32; 2] {
    let number = number as u32;
    [i + ((number & 1) << depth), j + ((number >> 1) << depth)]
}

/// A triangle of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    /// By rows first.
    row: u32,
    column: u32,
    is_second: bool,
}

impl Place {
    fn of_cell([column, row]: [u32; 2]) -> [Self; 2] {
        [false, true].map(|is_second| Self {
            row,
            column,
            is_second,
        })
    }
}

/// Next step of a search at a piece.
enum Look {
    Skip,
    Enter,
    Stop,
}

impl PatchPart {
    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds
    }

    pub(crate) fn patch(&self) -> &BezierPatch {
        &self.patch.patch
    }

    /// Returns the pieces of the whole patch, each before those that are in it.
    pub(crate) fn pieces(&self) -> &[Piece] {
        let Shared {
            patch,
            depth,
            pieces,
        } = &*self.patch;
        pieces.get_or_init(|| {
            let mut pieces = Vec::new();
            add_pieces(&mut pieces, &Net(patch.control), *depth, self.room);
            pieces
        })
    }

    pub(crate) fn first_cell(&self) -> [u32; 2] {
        self.first
    }

    /// Returns the bytes beside the patch's own.
    pub(crate) fn memory_bytes(&self) -> u64 {
        (size_of::<Self>() + size_of::<BezierPatch>() / 4) as u64
    }

    /// Returns whether a triangle of the piece blocks the segment. Of all of them the start's own is the only one that may hold the start: it
    /// blocks nothing, as no triangle does in whose plane the start is.
    pub(crate) fn is_crossed(&self, segment: &Segment) -> bool {
        let Some(view) = View::along(segment, self) else {
            return false;
        };
        let look = |net: &Net| match view.look(net, f64::INFINITY) {
            Look::Enter if view.is_surely_crossed(net) => Look::Stop,
            look => look,
        };
        let cell = |place: Place| match triangle_blocks(self.corners(place), segment) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        self.search(&view.project(&self.net), look, cell).is_break()
    }

    /// Returns how far the first crossing is in lengths of the segment's direction, and where. `None` where there is none.
    pub(crate) fn crossing(&self, segment: &Segment) -> Option<(f64, DVec3)> {
        let view = View::along(segment, self)?;
        let nearest = std::cell::Cell::new(None::<(f64, DVec3)>);
        let farthest = || {
            nearest
                .get()
                .map_or(f64::INFINITY, |(distance, _)| distance)
        };
        let look = |net: &Net| view.look(net, farthest());
        let cell = |place: Place| {
            let corners = self.corners(place);
            if triangle_blocks(corners, segment) {
                let (distance, [b_share, c_share]) = triangle_distance(corners, segment);
                if distance < farthest() {
                    let [a, b, c] = corners;
                    let point = a + (b - a) * b_share + (c - a) * c_share;
                    nearest.set(Some((distance, point)));
                }
            }
            ControlFlow::Continue(())
        };
        let _ = self.search(&view.project(&self.net), look, cell);
        nearest.get()
    }

    /// Returns the corners of the triangle that a start at a point is on (EXACTNESS.md, "Patches").
    pub(crate) fn own_triangle(&self, point: DVec3) -> [DVec3; 3] {
        let quick = self.quick_place(point);
        let corners = self.corners(quick);
        let coordinates = point
            .abs()
            .max(self.bounds.max.abs().max(self.bounds.min.abs()));
        if way_to_triangle(corners, point).length() <= ON * coordinates.max_element() {
            return corners;
        }
        self.corners(self.nearest_place(point, quick))
    }

    /// Returns the shortest way from a point to the triangle that it is on.
    pub(crate) fn way_from(&self, point: DVec3) -> DVec3 {
        way_to_triangle(self.own_triangle(point), point)
    }

    /// Returns the normal of the smooth patch near a point of it, any length; zero where it has none.
    pub(crate) fn smooth_normal(&self, point: DVec3) -> DVec3 {
        let [_, along, across] = self.net.at(self.foot(point));
        along.cross(across)
    }

    fn corners(&self, place: Place) -> [DVec3; 3] {
        self.patch
            .patch
            .triangle([place.column, place.row], place.is_second)
    }

    /// Returns the parameters in the piece, 0 to 1, of a point near the given one: Gauss and Newton's search.
    fn foot(&self, point: DVec3) -> [f64; 2] {
        let mut place = [0.5; 2];
        for _ in 0..MOST_STEPS {
            let [at, along, across] = self.net.at(place);
            let off = point - at;
            let (a, b, c) = (along.dot(along), along.dot(across), across.dot(across));
            let (f, g) = (along.dot(off), across.dot(off));
            let divisor = a * c - b * b;
            let step = [(c * f - b * g) / divisor, (a * g - b * f) / divisor];
            if !step.iter().all(|step| step.is_finite()) {
                break;
            }
            let next = [0, 1].map(|i: usize| (place[i] + step[i]).clamp(0.0, 1.0));
            let is_done = (0..2).all(|i| (next[i] - place[i]).abs() < ENOUGH);
            place = next;
            if is_done {
                break;
            }
        }
        place
    }

    fn quick_place(&self, point: DVec3) -> Place {
        let cells = f64::from(1_u32 << self.depth);
        let scaled = self.foot(point).map(|share| share * cells);
        let cell = scaled.map(|scaled| scaled.floor().min(cells - 1.0));
        let [along, across] = [0, 1].map(|i: usize| scaled[i] - cell[i]);
        Place {
            column: self.first[0] + cell[0] as u32,
            row: self.first[1] + cell[1] as u32,
            is_second: across > along,
        }
    }

    /// Returns the nearest triangle, the first of equally near ones.
    fn nearest_place(&self, point: DVec3, quick: Place) -> Place {
        let distance = |place: Place| way_to_triangle(self.corners(place), point).length();
        let best = std::cell::Cell::new((distance(quick), quick));
        let room = 4.0 * self.room + ROUNDING * point.abs().max_element();
        let look = |net: &Net| {
            let bounds = Bounds::of_points(net.points());
            let away = (point.clamp(bounds.min, bounds.max) - point).length();
            match away > best.get().0 + room {
                true => Look::Skip,
                false => Look::Enter,
            }
        };
        let cell = |place: Place| {
            let found = (distance(place), place);
            let (least, first) = best.get();
            if found.0 < least || (found.0 == least && place < first) {
                best.set(found);
            }
            ControlFlow::Continue(())
        };
        let _ = self.search(&self.net, look, cell);
        best.get().1
    }

    /// Visits the triangles of the pieces that are entered, until one stops the search.
    fn search(
        &self,
        net: &Net,
        mut look: impl FnMut(&Net) -> Look,
        mut cell: impl FnMut(Place) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut waiting = Vec::with_capacity(4 * self.depth as usize + 4);
        waiting.push((self.first, self.depth, *net));
        while let Some((first, depth, net)) = waiting.pop() {
            match look(&net) {
                Look::Skip => continue,
                Look::Stop => return ControlFlow::Break(()),
                Look::Enter => {}
            }
            let Some(depth) = depth.checked_sub(1) else {
                for place in Place::of_cell(first) {
                    cell(place)?;
                }
                continue;
            };
            for (number, quarter) in net.quarters().into_iter().enumerate() {
                waiting.push((quarter_at(first, number, depth), depth, quarter));
            }
        }
        ControlFlow::Continue(())
    }
}

/// Points are on the triangle that a quick search finds, if they are within this share of the coordinates: eight
/// roundings of `f32`.
const ON: f64 = 1.0 / (1_u64 << 21) as f64;
const MOST_STEPS: u32 = 8;
/// How far from its place an edge may be, in lengths of its own.
const LONGEST_ARM: f64 = 256.0;
const ENOUGH: f64 = 1.0 / (1_u64 << 40) as f64;

/// Space as a segment sees it: two coordinates in which all of its line is zero, and a third that grows along it.
///
/// With `k` the axis of the direction's largest component the first two are `P_i - P_k D_i / D_k - m_i`, where `m_i` is the value that
/// makes them zero. It is a difference of products that is rounded but once or twice, so starts and lights may be far from everything.
struct View {
    axes: [usize; 3],
    slopes: [f64; 2],
    offsets: [f64; 2],
    /// The third coordinate is that along the axis, times this.
    sign: f64,
    /// Its values at both ends.
    ends: [f64; 2],
    /// How much it grows in a length of the direction.
    growth: f64,
    /// More than the roundings of what is projected.
    room: f64,
}

impl View {
    /// `None` where the segment has no length.
    fn along(segment: &Segment, part: &PatchPart) -> Option<Self> {
        let (origin, direction) = (segment.origin(), segment.direction());
        let size = direction.abs();
        let k = (0..3).fold(
            0,
            |most, axis| if size[axis] > size[most] { axis } else { most },
        );
        let growth = size[k];
        if growth == 0.0 {
            return None;
        }
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let is_finite = segment.is_finite();
        let (light, _) = segment.light;
        // The direction itself, or the light in its place: what is left out cancels.
        let other = if is_finite { light } else { direction };
        let offset = |i: usize| {
            difference_of_products(origin[i], other[k], origin[k], other[i]) / direction[k]
        };
        let offsets = [offset(i), offset(j)];
        let sign = direction[k].signum();
        let end = if is_finite {
            sign * light[k]
        } else {
            f64::INFINITY
        };
        let near = part.largest + offsets[0].abs().max(offsets[1].abs());
        // An error of the start turns the line about the light.
        let lever = if is_finite {
            (part.largest + light[k].abs()) / growth
        } else {
            0.0
        };
        Some(Self {
            axes: [i, j, k],
            slopes: [direction[i] / direction[k], direction[j] / direction[k]],
            offsets,
            sign,
            ends: [sign * origin[k], end],
            growth,
            room: ROUNDING * near
                + 8.0 * segment.origin_error() * (1.0 + lever)
                + f64::MIN_POSITIVE / growth,
        })
    }

    fn project(&self, net: &Net) -> Net {
        let [i, j, k] = self.axes;
        let mut projected = *net;
        for point in projected.0.as_flattened_mut() {
            let along = point[k];
            *point = DVec3::new(
                point[i] - along * self.slopes[0] - self.offsets[0],
                point[j] - along * self.slopes[1] - self.offsets[1],
                self.sign * along,
            );
        }
        projected
    }

    /// Tells whether the segment may meet a projected piece nearer than a distance, in lengths of the direction.
    fn look(&self, net: &Net, nearest: f64) -> Look {
        let bounds = Bounds::of_points(net.points());
        let (low, high) = (bounds.min - self.room, bounds.max + self.room);
        let farthest = self.ends[1].min(self.ends[0] + nearest * self.growth + self.room);
        let is_beside = low.x > 0.0 || low.y > 0.0 || high.x < 0.0 || high.y < 0.0;
        if is_beside || high.z < self.ends[0] || low.z > farthest {
            Look::Skip
        } else {
            Look::Enter
        }
    }

    /// Returns whether the segment surely crosses a triangle of a projected piece.
    ///
    /// The triangles of each half of the piece, on either side of its diagonal, are a continuous image of the triangle between three
    /// corners, with no point moved by more than the piece bends. So is their border. If the segment goes through
    /// that triangle farther from its border than that, the border of the image winds round the segment, and the
    /// image holds a point of it. It is strictly between the ends, as all of the piece is.
    fn is_surely_crossed(&self, net: &Net) -> bool {
        let depths = Bounds::of_points(net.points());
        if depths.min.z <= self.ends[0] + self.room || depths.max.z >= self.ends[1] - self.room {
            return false;
        }
        let bend = net.bend();
        let reach = bend.x + bend.y + 2.0 * self.room;
        let [first, along, across, last] = net.corners().map(DVec3::truncate);
        [[first, along, last], [first, last, across]]
            .iter()
            .any(|corners| {
                let mut turns = [0.0; 3];
                for (turn, (i, j)) in turns.iter_mut().zip([(0, 1), (1, 2), (2, 0)]) {
                    let (from, to) = (corners[i], corners[j]);
                    let edge = to - from;
                    // The distance of the segment from the edge's line, by its side. Of an edge that is short beside how far
                    // it is away nothing is told: its direction is rounded.
                    let length = edge.length();
                    if from.length() < LONGEST_ARM * length {
                        *turn = from.perp_dot(edge) / length;
                    }
                }
                turns.iter().all(|&turn| turn > reach) || turns.iter().all(|&turn| turn < -reach)
            })
    }
}

/// Returns `a b - c d`, rounded once or twice (Kahan).
fn difference_of_products(a: f64, b: f64, c: f64, d: f64) -> f64 {
    let product = c * d;
    let lost = (-c).mul_add(d, product);
    a.mul_add(b, -product) + lost
}
