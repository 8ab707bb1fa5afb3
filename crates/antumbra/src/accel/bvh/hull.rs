//! The segments of many starts to one light, as one swept box.
//!
//! In: the box of the starts, in the frame's units, and the light. Out: the children of a node that any of
//! the segments may meet, for the price of one segment.
//!
//! # Why no surface is missed
//!
//! At `s`, from 0 at the starts to 1 at the light `L`, the segments are in the box `(1 - s) B + s L`, where
//! `B` is the box of the starts. It meets a box `N` along an axis where
//!
//! `s (L - min B) <= max N - min B` and `s (L - max B) >= min N - max B`,
//!
//! each of which bounds `s` from one side. A light at infinity in direction `D` has `D` in the place of both
//! differences. The two are planes crossed by the lines from the two corners of `B`, computed as those of
//! a ray are (`ray`, points 2 to 5): corner and box in `f32`, difference rounded once and scaled by
//! a power of two so that its largest component is in `[1, 2)`, small components made larger. What rounding
//! in `f64` moves is a share of `2^-52` of the frame for lights near it, and of the distance for others. So
//! what is computed is right for planes at most `10 u` from those given, and the boxes have room for that,
//! for the starts' offsets and for `2^-39`.

use antumbra_geometry::{DVec3, LightShape};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::data::Node;
use super::ray::{SMALLEST_COMPONENT, U};
use crate::accel::frame::Frame;

/// A box of starts, in the frame's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReceiverBox {
    pub(super) min: [f32; 3],
    pub(super) max: [f32; 3],
}

impl ReceiverBox {
    /// The box of no start.
    pub(super) const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    #[inline(always)]
    pub(super) fn add(&mut self, place: [f32; 3]) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(place[axis]);
            self.max[axis] = self.max[axis].max(place[axis]);
        }
    }

    /// Returns the largest edge.
    #[inline(always)]
    pub(super) fn extent(&self) -> f32 {
        let edge = |axis: usize| self.max[axis] - self.min[axis];
        edge(0).max(edge(1)).max(edge(2))
    }
}

/// One bound of `s` along an axis: a row of a node's planes, times a factor, less an offset.
#[derive(Clone, Copy, Debug)]
struct Bound {
    row: usize,
    factor: f32,
    offset: f32,
}

/// A box of starts swept to a light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hull {
    /// Where the sweep enters and leaves, axis by axis.
    near: [Bound; 3],
    far: [Bound; 3],
    /// Along an axis on which the light is between the box's sides there are two ends and no beginning.
    second_far: [Bound; 3],
    has_second: bool,
    end: f32,
}

/// A light farther away than this, in the frame's units, leaves every segment's largest component above 3/4
/// of the sweep's, for starts are at most 2 apart; so all have left the frame at [`FAR_END`].
const FAR_LIGHT: f64 = 8.0;
const FAR_END: f64 = 4.0;

/// Beyond every end.
const NEVER: f32 = 1e30;

impl Hull {
    /// Returns nothing where the light is as good as in the box.
    #[inline(always)]
    pub(super) fn new(frame: &Frame, starts: &ReceiverBox, light: &LightShape) -> Option<Self> {
        let corner = |x: [f32; 3]| DVec3::new(x[0].into(), x[1].into(), x[2].into());
        // Seen from the lower and the upper corner.
        let (is_finite, seen) = match *light {
            LightShape::Point(light) => {
                let light = frame.point_in_frame(light);
                (
                    true,
                    [light - corner(starts.min), light - corner(starts.max)],
                )
            }
            LightShape::Direction(direction) => (false, [direction; 2]),
        };
        let length = seen[0].abs().max(seen[1].abs()).max_element();
        if !(1e-18..=1e290).contains(&length) || !seen[0].is_finite() {
            return None;
        }
        let exponent = length.to_bits() >> 52;
        let to_unit = f64::from_bits((2046 - exponent) << 52);
        let light_at = f64::from_bits(exponent << 52);
        let end = if !is_finite || length >= FAR_LIGHT {
            FAR_END
        } else {
            light_at
        };
        let mut hull = Self {
            near: [Bound::open(0.0); 3],
            far: [Bound::open(NEVER); 3],
            second_far: [Bound::open(NEVER); 3],
            has_second: false,
            end: (end * (1.0 + 4.0 * U) + 4.0 * U) as f32,
        };
        for axis in 0..3 {
            let component = |v: DVec3| {
                let x = (v[axis] * to_unit) as f32;
                let smallest = SMALLEST_COMPONENT as f32;
                if x.abs() < smallest {
                    smallest.copysign(x)
                } else {
                    x
                }
            };
            let (from_low, from_high) = (component(seen[0]), component(seen[1]));
            // The upper plane from the lower corner, and the other way round.
            let upper = Bound::new(axis + 3, from_low, starts.min[axis]);
            let lower = Bound::new(axis, from_high, starts.max[axis]);
            match (from_low > 0.0, from_high > 0.0) {
                (true, true) => (hull.near[axis], hull.far[axis]) = (lower, upper),
                (false, false) => (hull.near[axis], hull.far[axis]) = (upper, lower),
                (true, false) => {
                    (hull.far[axis], hull.second_far[axis]) = (lower, upper);
                    hull.has_second = true;
                }
                // The light is not lower than the lower corner and higher than the upper one.
                (false, true) => return None,
            }
        }
        Some(hull)
    }

    /// Returns a bit for each child of a node that the sweep meets.
    #[inline(always)]
    pub(super) fn meets<S: Simd>(&self, simd: S, node: &Node) -> u32 {
        let at = |bound: &Bound| {
            f32x8::from_slice(simd, &node.planes[bound.row % 6]).mul_sub(
                f32x8::splat(simd, bound.factor),
                f32x8::splat(simd, bound.offset),
            )
        };
        let near = at(&self.near[0])
            .max(at(&self.near[1]))
            .max(at(&self.near[2]).max(f32x8::splat(simd, 0.0)));
        let mut far = at(&self.far[0])
            .min(at(&self.far[1]))
            .min(at(&self.far[2]).min(f32x8::splat(simd, self.end)));
        if self.has_second {
            far = far
                .min(at(&self.second_far[0]))
                .min(at(&self.second_far[1]).min(at(&self.second_far[2])));
        }
        near.simd_le(far).to_bitmask() as u32
    }
}

impl Bound {
    #[inline(always)]
    fn new(row: usize, direction: f32, origin: f32) -> Self {
        let factor = 1.0 / direction;
        Self {
            row,
            factor,
            offset: origin * factor,
        }
    }

    /// A bound that says the same of all planes.
    fn open(at: f32) -> Self {
        Self {
            row: 0,
            factor: 0.0,
            offset: -at,
        }
    }
}
