//! A segment as the tree sees it: `f32`, in the frame's units.
//!
//! # Why no surface is missed
//!
//! Let `X` be the point where the exact segment meets a surface. Units are the frame's: the scene
//! with its room lies in `[-1, 1]^3`; `m` is the margin, `u = 2^-24` the largest relative error of an
//! `f32` operation.
//!
//! 1. *Start and direction.* The walk starts at the point as given, so that it need not wait for the
//!    start proper, which is at most `m / 4` away ([`Bvh::prepare`] leaves other starts to the
//!    reference). So the exact segment differs from the walked one by that much at the start and
//!    nothing at the light, and by `2^-53` of its length for the rounding of the direction. A start
//!    outside the scene is moved to where the line enters the frame, with
//!    the direction's tail, so that the rounding of the direction acts over the frame's size only,
//!    and the sum is rounded once, by `2^-53` of a coordinate of the scene, which is `2^-13 m`. So a
//!    point of the `f64` segment `o + t d`, `t` the parameter of `X`, lies within `m / 2` of `X`.
//! 2. *Small components.* Components of the direction below `2^-40` of the largest are made that
//!    large. The segment stays in the frame for `t <= 2`, so that moves a point by `2^-39`.
//! 3. *Planes.* For a plane at `p` the walk computes `p r - q` with `r = fl(1 / d)`,
//!    `q = fl(fl(o) r)`, `d` itself rounded. Each of the six operations errs by a factor `1 + u` at
//!    most, so the result is `(p' - o) / d` exactly for a plane `p'` with
//!    `|p' - p| <= u |p| + 2 u |o| + 3 u |p - o| + (...)u^2 < 10 u`, all coordinates being at most
//!    `1 + 2^-19`. A fused multiply-add errs less.
//! 4. *Boxes.* A box is its surface's, which is right up to `m / 4` (its own rounding), moved outwards
//!    by `m` and [`PLANE_ROOM`], `10 u` and a bit, and rounded outwards; a node's box holds its
//!    children's. By 1 and 2 the segment's point lies in the surface's box moved by `3 m / 4` and
//!    `2^-39`, by 3 the interval that the walk computes for each axis holds `t`.
//! 5. *Ends.* `0 <= t <= end` with `end` rounded up. So the intervals overlap, and the box is visited.

use antumbra_geometry::{DVec3, LightShape, Segment};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f64x4};

pub(super) use super::bounds::{FilterBounds, PLANE_ROOM, SMALLEST_COMPONENT, U};
use super::data::Bvh;
use crate::accel::frame::Frame;
use crate::accel::grid::point_along;

/// The farthest parameter inside the frame is 2: the largest component of the direction is at least
/// 1, and the frame is 2 wide.
pub(super) const FARTHEST: f64 = 2.25;

/// Starts farther out than this many frames are left to the reference.
const FARTHEST_START: f64 = (1u64 << 27) as f64;

/// Starts beyond this lie outside; 2^-19 covers what 1 in `f64` may be.
pub(super) const INSIDE: f64 = 1.0;

/// What the tree can do for a segment.
#[derive(Clone, Copy, Debug)]
pub(super) enum Prepared {
    /// Walk.
    Ray(FrameRay),
    /// The segment passes the scene by.
    Miss,
    /// Ask the reference.
    Unfit,
}

/// A segment in the frame's units. Its direction's largest component is in `[1, 2)`; fourth components
/// mean nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameRay {
    pub(super) origin: [f32; 4],
    pub(super) direction: [f32; 4],
    /// Reciprocal of the direction, and times the origin.
    pub(super) inverse: [f32; 4],
    pub(super) offset: [f32; 4],
    /// Where the segment surely has ended.
    pub(super) end: f32,
    /// Where the light is, or a place outside the frame on the way to it.
    pub(super) light: f32,
    /// The direction's length.
    pub(super) length: f32,
    pub(super) bounds: FilterBounds,
    /// Parameters of the segment become the ray's by `(parameter - entry) * rate`.
    pub(super) entry: f64,
    pub(super) rate: f64,
}

/// The error of the start in lengths of the direction that the tree's own bounds allow for; it is more
/// only where the light is very near.
pub(super) const USUAL_ORIGIN_ERROR: f64 = 1.0 / (1u64 << 32) as f64;

impl Bvh {
    /// Returns a segment as the tree sees it: from `point`, the exact start being at most `offset` away,
    /// to a light. `segment` gives the segment itself, which starts from outside need.
    #[inline(always)]
    pub(super) fn prepare<S: Simd>(
        &self,
        simd: S,
        point: DVec3,
        offset: f64,
        light: &LightShape,
        segment: impl Fn() -> Segment,
    ) -> Prepared {
        let frame = &self.frame;
        let (light, is_finite) = match *light {
            LightShape::Point(light) => (light, true),
            LightShape::Direction(direction) => (direction, false),
        };
        let direction = if is_finite { light - point } else { light };
        let length = direction.abs().max_element();
        // Not for starts that lie far off the plane of a needle-thin triangle, nor for lengths whose
        // reciprocal overflows; a NaN among the components is one in the sum.
        let is_fit = offset <= frame.margin_of_starts()
            && (1e-290..=1e290).contains(&length)
            && !direction.element_sum().is_nan();
        if !is_fit {
            return Prepared::Unfit;
        }
        let lanes = |v: DVec3| f64x4::simd_from(simd, [v.x, v.y, v.z, 0.0]);
        let mut origin = (lanes(point) - lanes(frame.center)) * frame.scale;
        let mut entry = 0.0;
        if !origin.abs().simd_le(INSIDE).all_true() {
            let place = DVec3::new(origin[0], origin[1], origin[2]);
            match enter(frame, &segment(), place) {
                Entry::At(parameter, place) => (entry, origin) = (parameter, lanes(place)),
                Entry::Never => return Prepared::Miss,
                Entry::Unfit => return Prepared::Unfit,
            }
        }

        // A power of two that brings the largest component into [1, 2); `length` is normal.
        let exponent = length.to_bits() >> 52;
        let to_unit = f64::from_bits((2046 - exponent) << 52);
        let rate = frame.scale * f64::from_bits(exponent << 52);
        let light = if is_finite {
            ((1.0 - entry) * rate).min(FARTHEST)
        } else {
            FARTHEST
        };
        let end = (light * (1.0 + 4.0 * U) + 4.0 * U) as f32;
        let origin_error = to_unit * offset;
        let bounds = if origin_error <= USUAL_ORIGIN_ERROR {
            self.usual_bounds
        } else {
            FilterBounds::new(frame.margin_in_frame, origin_error)
        };

        let narrow = |v: f64x4<S>| {
            let v: [f64; 4] = v.into();
            f32x4::simd_from(simd, v.map(|x| x as f32))
        };
        let origin = narrow(origin);
        let direction = narrow(lanes(direction) * to_unit);
        let smallest = f32x4::splat(simd, SMALLEST_COMPONENT as f32);
        let is_small = direction.abs().simd_lt(smallest);
        let direction = is_small.select(smallest.copysign(direction), direction);
        let inverse = f32x4::splat(simd, 1.0) / direction;
        let squares = direction * direction;
        Prepared::Ray(FrameRay {
            origin: origin.into(),
            direction: direction.into(),
            inverse: inverse.into(),
            offset: (origin * inverse).into(),
            end,
            light: light as f32,
            length: (squares[0] + squares[1] + squares[2]).sqrt(),
            bounds,
            entry,
            rate,
        })
    }
}

enum Entry {
    /// The segment's parameter and the place in the frame.
    At(f64, DVec3),
    Never,
    Unfit,
}

/// Returns where a segment from outside enters the frame.
#[cold]
fn enter(frame: &Frame, segment: &Segment, origin: DVec3) -> Entry {
    let direction = segment.direction();
    let distance = origin.abs().max_element();
    if distance.is_nan() || distance > FARTHEST_START {
        return Entry::Unfit;
    }
    // A slab test in f64. Each parameter errs by less than 2^-50 of itself, which is 2^-23 of the frame at
    // most: the box is taken that much larger, and the entry that much earlier.
    let room = INSIDE + distance / (1u64 << 49) as f64 + 1.0 / (1u64 << 28) as f64;
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    let step = direction * frame.scale;
    for axis in 0..3 {
        let (from, rate) = (origin[axis], 1.0 / step[axis]);
        if !rate.is_finite() {
            if from.abs() > room {
                return Entry::Never;
            }
            continue;
        }
        let (a, b) = ((-room - from) * rate, (room - from) * rate);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    if enters > leaves + leaves.abs() * 1e-14 {
        return Entry::Never;
    }
    let enters = enters * (1.0 - 1e-15);
    if segment.is_finite() && enters > 1.0 + 1e-12 {
        return Entry::Never;
    }
    let place = frame.point_in_frame(point_along(
        segment.origin(),
        direction,
        segment.direction_tail(),
        enters,
    ));
    if place.abs().max_element() <= INSIDE + 1.0 / (1u64 << 20) as f64 {
        Entry::At(enters, place)
    } else {
        // A line that grazes the frame's corner within the rounding of this test, or overflow.
        Entry::Unfit
    }
}
