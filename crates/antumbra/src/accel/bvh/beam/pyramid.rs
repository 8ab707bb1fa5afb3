//! The pyramid that holds the segments from one start to some targets.
//!
//! In: segments whose directions have one axis in common along which none is slow. Out: the children of a node
//! that any of them may meet; the range of each direction's slopes. `README.md` of `crate::beam` proves it.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x8, f32x16};

use super::super::data::{LANES, Node, SphereGroup, WIDTH};
use super::super::ray::{FilterBounds, SMALLEST_COMPONENT, U};
use super::targets::{CHUNK, Segments, TARGETS, bits_of, lanes};

/// An axis, and whether segments go down along it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    pub(super) axis: usize,
    pub(super) is_down: bool,
}

impl Face {
    const ALL: [Self; 6] = [
        Self::new(0, false),
        Self::new(1, false),
        Self::new(2, false),
        Self::new(0, true),
        Self::new(1, true),
        Self::new(2, true),
    ];

    const fn new(axis: usize, is_down: bool) -> Self {
        Self { axis, is_down }
    }

    /// The two other axes.
    #[inline(always)]
    pub(super) fn across(self) -> [usize; 2] {
        match self.axis {
            0 => [1, 2],
            1 => [2, 0],
            _ => [0, 1],
        }
    }
}

/// Which segments go along which faces at half their largest speed at least; each does along one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faces([u64; 6]);

impl Faces {
    #[inline(always)]
    pub(super) fn of<S: Simd>(simd: S, segments: &Segments) -> Self {
        let mut faces = [0; 6];
        for chunk in 0..TARGETS / CHUNK {
            let [x, y, z] = segments.directions(simd, chunk);
            let largest = x.abs().max(y.abs()).max(z.abs()) * 0.5;
            for (axis, component) in [x, y, z].into_iter().enumerate() {
                let up = component.simd_ge(largest).to_bitmask();
                let down = component.simd_le(-largest).to_bitmask();
                faces[axis] |= up << (chunk * CHUNK);
                faces[axis + 3] |= down << (chunk * CHUNK);
            }
        }
        Self(faces)
    }

    /// Returns the face that most of some segments share, and these.
    #[inline(always)]
    pub(super) fn shared_by_most(&self, among: u64) -> (Face, u64) {
        let (mut face, mut most) = (0, 0_u64);
        for (number, &mask) in self.0.iter().enumerate() {
            if (mask & among).count_ones() > most.count_ones() {
                (face, most) = (number, mask & among);
            }
        }
        (Face::ALL[face], most)
    }
}

/// One bound of the height along the axis: a row of a node's planes, times a factor, less an offset.
#[derive(Clone, Copy, Debug, Default)]
struct Bound {
    row: usize,
    factor: f32,
    offset: f32,
}

impl Bound {
    #[inline(always)]
    fn new(row: usize, slope: f32, origin: f32) -> Self {
        let factor = 1.0 / slope;
        Self {
            row,
            factor,
            offset: origin * factor,
        }
    }
}

/// The segments of some targets, all along one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pyramid {
    pub(super) face: Face,
    /// Least and greatest slopes: movement along the two other axes for one unit along the axis.
    pub(super) slopes: [[f32; 2]; 2],
    /// Where they all have ended, in units along the axis.
    pub(super) end: f32,
    bounds: [Bound; 6],
    /// A bit for each bound at whose height segments are entered; they are left at the others'.
    enters: u32,
    /// Which targets it was made for.
    pub(super) targets: u64,
}

/// Returns the greatest of sixteen numbers.
#[inline(always)]
fn greatest<S: Simd>(numbers: f32x16<S>) -> f32 {
    let numbers: [f32; CHUNK] = numbers.into();
    let four = |i: usize| {
        let first = numbers[i].max(numbers[i + 4]);
        first.max(numbers[i + 8].max(numbers[i + 12]))
    };
    four(0).max(four(1)).max(four(2).max(four(3)))
}

/// Room for the roundings of a slope, `u` of it each: two components, a reciprocal, a product, and two sums that
/// make room; two are spare.
const SLOPE_ROOM: f32 = 8.0 / (1 << 24) as f32;

/// Returns the slopes of a pyramid's bounds on both sides of slopes that are between these.
#[inline(always)]
fn slopes<S: Simd>(least: f32x16<S>, most: f32x16<S>) -> [f32; 2] {
    let (least, most) = (-greatest(-least), greatest(most));
    // What small components were moved by, over half of 1.
    let smallest = SMALLEST_COMPONENT as f32;
    let low = least - least.abs() * SLOPE_ROOM - 4.0 * smallest;
    let high = most + most.abs() * SLOPE_ROOM + 4.0 * smallest;
    [
        if low.abs() < smallest { -smallest } else { low },
        if high.abs() < smallest {
            smallest
        } else {
            high
        },
    ]
}

impl Pyramid {
    /// Makes the pyramid of some targets, which all go along a face.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, segments: &Segments, face: Face, targets: u64) -> Self {
        let [u, v] = face.across();
        let infinite = f32x16::splat(simd, f32::INFINITY);
        let mut least = [infinite; 2];
        let mut most = [-infinite; 2];
        let mut end = f32x16::splat(simd, 0.0);
        for chunk in 0..TARGETS / CHUNK {
            let bits = bits_of(targets, chunk);
            if bits == 0 {
                continue;
            }
            let is_there = fearless_simd::mask32x16::from_bitmask(simd, bits);
            let along = lanes(simd, &segments.direction[face.axis], chunk).abs();
            let inverse = f32x16::splat(simd, 1.0) / along;
            let ends = lanes(simd, &segments.end, chunk) * along;
            end = end.max(is_there.select(ends, f32x16::splat(simd, 0.0)));
            for (place, axis) in [u, v].into_iter().enumerate() {
                let slope = lanes(simd, &segments.direction[axis], chunk) * inverse;
                least[place] = least[place].min(is_there.select(slope, infinite));
                most[place] = most[place].max(is_there.select(slope, -infinite));
            }
        }
        let slopes = [slopes(least[0], most[0]), slopes(least[1], most[1])];
        let end = greatest(end) * (1.0 + 8.0 * U as f32) + 4.0 * U as f32;
        let mut pyramid = Self {
            face,
            slopes,
            end,
            bounds: [Bound::default(); 6],
            enters: 0,
            targets,
        };
        pyramid.start_at(segments.origin, segments.origin);
        pyramid
    }

    /// Moves the start, in the frame's units: to a place, or to every place of a box. Then all is bounded for all of them.
    #[inline(always)]
    pub(super) fn start_at(&mut self, least: [f32; 3], most: [f32; 3]) {
        let Face { axis, is_down } = self.face;
        let up = if is_down { -1.0 } else { 1.0 };
        self.enters = 0;
        // The start that is first at the near plane, and the one that is last at the far one.
        let (near, far, first, last) = match is_down {
            false => (axis, axis + 3, most[axis], least[axis]),
            true => (axis + 3, axis, least[axis], most[axis]),
        };
        self.set(0, true, Bound::new(near, up, first));
        self.set(1, false, Bound::new(far, up, last));
        for (place, axis) in self.face.across().into_iter().enumerate() {
            let [low, high] = self.slopes[place];
            // Behind the upper plane for the least slope, before the lower one for the greatest.
            let number = 2 + 2 * place;
            self.set(number, low < 0.0, Bound::new(axis + 3, low, least[axis]));
            self.set(number + 1, high > 0.0, Bound::new(axis, high, most[axis]));
        }
    }

    #[inline(always)]
    fn set(&mut self, number: usize, enters: bool, bound: Bound) {
        self.bounds[number] = bound;
        self.enters |= u32::from(enters) << number;
    }

    /// Returns a bit for each child of a node that a segment may meet.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, simd: S, node: &Node) -> u32 {
        let at = |number: usize| {
            let bound = &self.bounds[number];
            f32x8::from_slice(simd, &node.planes[bound.row % 6]).mul_sub(
                f32x8::splat(simd, bound.factor),
                f32x8::splat(simd, bound.offset),
            )
        };
        let mut near = at(0).max(f32x8::splat(simd, 0.0));
        let mut far = at(1).min(f32x8::splat(simd, self.end));
        for number in 2..6 {
            if self.enters >> number & 1 != 0 {
                near = near.max(at(number));
            } else {
                far = far.min(at(number));
            }
        }
        near.simd_le(far).to_bitmask() as u32
    }

    /// Returns how far along the axis each child of a node begins, about.
    #[inline(always)]
    pub(super) fn heights(&self, node: &Node) -> [f32; WIDTH] {
        let Bound {
            row,
            factor,
            offset,
        } = self.bounds[0];
        let mut heights = node.planes[row % 6];
        for height in &mut heights {
            *height = *height * factor - offset;
        }
        heights
    }

    /// Returns a bit for each sphere of a group that a segment may meet.
    #[inline(always)]
    pub(super) fn may_meet_spheres<S: Simd>(
        &self,
        simd: S,
        group: &SphereGroup,
        origin: [f32; 3],
        bounds: &FilterBounds,
    ) -> u32 {
        let seen = |axis: usize| {
            let center = f32x4::from_slice(simd, &group.center[axis % 3]);
            center - f32x4::splat(simd, origin[axis % 3])
        };
        let radius = f32x4::from_slice(simd, &group.radius);
        let room = f32x4::splat(simd, bounds.line);
        let [u, v] = self.face.across();
        let along = if self.face.is_down {
            -seen(self.face.axis)
        } else {
            seen(self.face.axis)
        };
        // Behind the start, beyond the end.
        let mut height = (-along).max(along - f32x4::splat(simd, self.end)) - radius;
        for (place, axis) in [u, v].into_iter().enumerate() {
            let across = seen(axis);
            let [low, high] = self.slopes[place];
            for (slope, side) in [(low, -1.0), (high, 1.0)] {
                let length = (1.0 + slope * slope).sqrt();
                let above = (across - along * slope) * side - radius * length;
                height = height.max(above);
            }
        }
        !height.simd_gt(room).to_bitmask() as u32 & ((1 << LANES) - 1)
    }

    /// Parts some of the targets in up to four, each smaller than all: by the middle of both slopes, else in halves.
    #[inline(always)]
    pub(super) fn quarters<S: Simd>(
        &self,
        simd: S,
        segments: &Segments,
        among: u64,
    ) -> impl Iterator<Item = u64> {
        let axes = self.face.across();
        let mut upper = [0_u64; 2];
        for chunk in 0..TARGETS / CHUNK {
            let along = lanes(simd, &segments.direction[self.face.axis], chunk).abs();
            for place in 0..2 {
                let [low, high] = self.slopes[place];
                let across = lanes(simd, &segments.direction[axes[place]], chunk);
                let is_upper = across.simd_gt(along * (0.5 * (low + high)));
                upper[place] |= is_upper.to_bitmask() << (chunk * CHUNK);
            }
        }
        let [u, v] = upper;
        let mut parts = [u & v, u & !v, !u & v, !u & !v].map(|part| part & among);
        if parts.contains(&among) {
            // All go the same way: those with lower numbers first.
            let half = among.count_ones() / 2;
            let low = (0..half).fold(among, |rest, _| rest & rest.wrapping_sub(1));
            parts = [among & !low, low, 0, 0];
        }
        parts.into_iter().filter(|&part| part != 0)
    }
}
