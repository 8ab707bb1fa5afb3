//! Sixteen segments to one light as the tree sees them, coordinate by coordinate.
//!
//! In: starts. Out: what [`Bvh::prepare`] makes of each, by the same operations, so that all that `ray` and
//! `filter` say of one holds for each of them.

use antumbra_geometry::LightShape;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::data::{Bvh, Node};
use super::hull::ReceiverBox;
use super::ray::{
    FARTHEST, FilterBounds, FrameRay, INSIDE, SMALLEST_COMPONENT, U, USUAL_ORIGIN_ERROR,
};

/// Starts that are prepared together.
pub(super) const RAYS: usize = 16;

/// Segments as [`FrameRay`] has them, coordinate by coordinate.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Rays {
    pub(super) origin: [[f32; RAYS]; 3],
    pub(super) direction: [[f32; RAYS]; 3],
    pub(super) inverse: [[f32; RAYS]; 3],
    pub(super) offset: [[f32; RAYS]; 3],
    end: [f32; RAYS],
    pub(super) light: [f32; RAYS],
    length: [f32; RAYS],
    /// A bit for each that is one; the others' numbers mean nothing.
    pub(super) fit: u32,
}

impl Rays {
    /// Prepares segments as [`Bvh::prepare`] does; those that it would not take from inside the frame at
    /// their usual bounds are not fit.
    #[inline(always)]
    pub(super) fn new(
        bvh: &Bvh,
        points: &[[f64; RAYS]; 3],
        offsets: &[f64; RAYS],
        light: &LightShape,
    ) -> Self {
        let frame = &bvh.frame;
        let (light, is_finite) = match *light {
            LightShape::Point(light) => (light, true),
            LightShape::Direction(direction) => (direction, false),
        };
        let mut rays = Self {
            origin: [[0.0; RAYS]; 3],
            direction: [[0.0; RAYS]; 3],
            inverse: [[0.0; RAYS]; 3],
            offset: [[0.0; RAYS]; 3],
            end: [0.0; RAYS],
            light: [0.0; RAYS],
            length: [0.0; RAYS],
            fit: 0,
        };
        let mut directions = [[0.0_f64; RAYS]; 3];
        let mut reach = [0.0_f64; RAYS];
        let mut lengths = [0.0_f64; RAYS];
        for axis in 0..3 {
            for i in 0..RAYS {
                let place = (points[axis][i] - frame.center[axis]) * frame.scale;
                reach[i] = reach[i].max(place.abs());
                rays.origin[axis][i] = place as f32;
                let direction = if is_finite {
                    light[axis] - points[axis][i]
                } else {
                    light[axis]
                };
                directions[axis][i] = direction;
                lengths[i] = lengths[i].max(direction.abs());
            }
        }
        let mut to_unit = [0.0_f64; RAYS];
        for i in 0..RAYS {
            let exponent = lengths[i].to_bits() >> 52;
            to_unit[i] = f64::from_bits(2046_u64.wrapping_sub(exponent) << 52);
            let rate = frame.scale * f64::from_bits(exponent << 52);
            let light = if is_finite {
                rate.min(FARTHEST)
            } else {
                FARTHEST
            };
            rays.light[i] = light as f32;
            rays.end[i] = (light * (1.0 + 4.0 * U) + 4.0 * U) as f32;
        }
        let mut squares = [0.0_f32; RAYS];
        let smallest = SMALLEST_COMPONENT as f32;
        for axis in 0..3 {
            for i in 0..RAYS {
                let x = (directions[axis][i] * to_unit[i]) as f32;
                let x = if x.abs() < smallest {
                    smallest.copysign(x)
                } else {
                    x
                };
                let inverse = 1.0 / x;
                rays.direction[axis][i] = x;
                rays.inverse[axis][i] = inverse;
                rays.offset[axis][i] = rays.origin[axis][i] * inverse;
                squares[i] += x * x;
            }
        }
        for i in 0..RAYS {
            rays.length[i] = squares[i].sqrt();
        }
        let margin = frame.margin_of_starts();
        for i in 0..RAYS {
            // Not for NaN.
            let is_fit = (offsets[i] <= margin)
                & (to_unit[i] * offsets[i] <= USUAL_ORIGIN_ERROR)
                & (reach[i] <= INSIDE)
                & (lengths[i] >= 1e-290)
                & (lengths[i] <= 1e290);
            rays.fit |= u32::from(is_fit) << i;
        }
        rays
    }

    #[inline(always)]
    pub(super) fn ray(&self, lane: usize, bounds: &FilterBounds) -> FrameRay {
        let lane = lane % RAYS;
        let of = |rows: &[[f32; RAYS]; 3]| [rows[0][lane], rows[1][lane], rows[2][lane], 0.0];
        FrameRay {
            origin: of(&self.origin),
            direction: of(&self.direction),
            inverse: of(&self.inverse),
            offset: of(&self.offset),
            end: self.end[lane],
            light: self.light[lane],
            length: self.length[lane],
            bounds: *bounds,
            entry: 0.0,
            rate: 1.0,
        }
    }

    /// Returns the box of the starts of a mask, which has some.
    #[inline(always)]
    pub(super) fn start_box(&self, mask: u32) -> ReceiverBox {
        let mut all = ReceiverBox::EMPTY;
        let mut rest = mask;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % RAYS;
            rest &= rest - 1;
            all.add([
                self.origin[0][lane],
                self.origin[1][lane],
                self.origin[2][lane],
            ]);
        }
        all
    }

    /// Returns a bit for each segment that meets a child's box.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, simd: S, node: &Node, child: usize) -> u32 {
        let (near_x, far_x) = self.crossings(simd, node, child, 0);
        let (near_y, far_y) = self.crossings(simd, node, child, 1);
        let (near_z, far_z) = self.crossings(simd, node, child, 2);
        let near = near_x.max(near_y).max(near_z.max(f32x16::splat(simd, 0.0)));
        let far = far_x
            .min(far_y)
            .min(far_z.min(f32x16::from_slice(simd, &self.end)));
        near.simd_le(far).to_bitmask() as u32
    }

    /// Returns where segments cross the nearer and the farther plane of a child's box. No closure: those are not always
    /// inlined, and have no wide registers then.
    #[inline(always)]
    fn crossings<S: Simd>(
        &self,
        simd: S,
        node: &Node,
        child: usize,
        axis: usize,
    ) -> (f32x16<S>, f32x16<S>) {
        let inverse = f32x16::from_slice(simd, &self.inverse[axis]);
        let offset = f32x16::from_slice(simd, &self.offset[axis]);
        let low = f32x16::splat(simd, node.planes[axis][child]).mul_sub(inverse, offset);
        let high = f32x16::splat(simd, node.planes[axis + 3][child]).mul_sub(inverse, offset);
        (low.min(high), low.max(high))
    }
}
