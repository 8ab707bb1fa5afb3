//! Up to 64 targets of one start: as given, and as the tree sees them.

use antumbra_geometry::{DVec3, LightShape};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8};

use super::super::data::Bvh;
use super::super::ray::{
    FARTHEST, FilterBounds, FrameRay, INSIDE, SMALLEST_COMPONENT, U, USUAL_ORIGIN_ERROR,
};
use crate::limits::LARGEST;

/// Targets that are asked about together.
pub(crate) const TARGETS: usize = 64;

/// Targets handled by one instruction.
pub(super) const CHUNK: usize = 16;

/// Up to 64 targets as given, coordinate by coordinate.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Block {
    at: [[f64; TARGETS]; 3],
    /// 1 for points, 0 for directions: what the start is taken off with.
    weight: [f64; TARGETS],
    asked: u64,
    /// How far targets may be off, in world units, or in those of a direction.
    slack: f64,
    /// Whether all numbers are finite and at most 2^100.
    is_fine: bool,
}

impl Block {
    /// No targets.
    pub(crate) const NONE: Self = Self {
        at: [[0.0; TARGETS]; 3],
        weight: [0.0; TARGETS],
        asked: 0,
        slack: 0.0,
        is_fine: true,
    };

    /// Takes up to 64 targets.
    #[inline]
    pub(crate) fn new(targets: &[LightShape]) -> Self {
        let mut block = Self::NONE;
        block.take(targets);
        block
    }

    /// Takes places that are off by some distance at most.
    pub(crate) fn about(targets: &[LightShape], slack: f64) -> Self {
        Self {
            slack,
            ..Self::new(targets)
        }
    }

    /// Takes up to 64 targets in place of others.
    #[inline]
    pub(crate) fn take(&mut self, targets: &[LightShape]) {
        let count = targets.len().min(TARGETS);
        for (number, target) in targets.iter().enumerate().take(TARGETS) {
            let (at, weight) = target.homogeneous();
            self.at[0][number] = at.x;
            self.at[1][number] = at.y;
            self.at[2][number] = at.z;
            self.weight[number] = weight;
        }
        // Those that are left over from before are as fine as they were.
        let are_fine = |numbers: &[f64; TARGETS]| {
            let numbers = numbers.iter();
            numbers.fold(true, |are_fine, x| are_fine & (x.abs() <= LARGEST))
        };
        self.is_fine = self.at.iter().all(are_fine);
        if !self.is_fine && count < TARGETS {
            self.is_fine = self
                .at
                .iter()
                .all(|at| at[..count].iter().all(|x| x.abs() <= LARGEST));
        }
        self.asked = u64::MAX.checked_shr((TARGETS - count) as u32).unwrap_or(0);
        if self.weight[..count].contains(&0.0) {
            for number in 0..count {
                let at = [self.at[0][number], self.at[1][number], self.at[2][number]];
                let is_nowhere = self.weight[number] == 0.0 && at == [0.0; 3];
                self.asked &= !(u64::from(is_nowhere) << number);
            }
        }
    }

    /// Returns whether all targets have an answer.
    #[inline(always)]
    pub(crate) fn is_fine(&self) -> bool {
        self.is_fine
    }

    /// Returns the coordinates of its targets, axis by axis; those beyond the last mean nothing.
    #[inline(always)]
    pub(crate) fn coordinates(&self) -> &[[f64; TARGETS]; 3] {
        &self.at
    }

    /// Returns the least of the largest components of the targets that are there, infinity if none are.
    pub(super) fn least_length(&self) -> f64 {
        let [x, y, z] = &self.at;
        (0..TARGETS)
            .filter(|i| self.asked >> i & 1 != 0)
            .map(|i| x[i].abs().max(y[i].abs()).max(z[i].abs()))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns a bit for each target that is there; not for zero directions, which are nowhere.
    #[inline(always)]
    pub(crate) fn asked(&self) -> u64 {
        self.asked
    }
}

/// The segments from one start to up to 64 targets, as [`FrameRay`] has them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Segments {
    pub(super) origin: [f32; 3],
    /// Largest component in `[1, 2)`.
    pub(super) direction: [[f32; TARGETS]; 3],
    /// Where the light is, or a place outside the frame on the way to it.
    pub(super) light: [f32; TARGETS],
    /// Where the segment surely has ended.
    pub(super) end: [f32; TARGETS],
    /// A bit for each that is one; the others' numbers mean nothing.
    pub(super) fit: u64,
}

impl Segments {
    /// Prepares the segments of a mask, and others, by the operations of [`Bvh::prepare`]. Those that it would not take from inside the
    /// frame at their usual bounds are not fit.
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        bvh: &Bvh,
        (point, offset): (DVec3, f64),
        block: &Block,
        asked: u64,
    ) -> Self {
        let frame = &bvh.frame;
        let mut segments = Self {
            origin: [0.0; 3],
            direction: [[0.0; TARGETS]; 3],
            light: [0.0; TARGETS],
            end: [0.0; TARGETS],
            fit: 0,
        };
        let place = frame.point_in_frame(point);
        // Not for NaN.
        let is_start_fit =
            offset <= frame.margin_of_starts() && place.abs().max_element() <= INSIDE;
        if !is_start_fit {
            return segments;
        }
        segments.origin = [place.x as f32, place.y as f32, place.z as f32];
        let smallest = SMALLEST_COMPONENT as f32;
        let (offset, most) = (f64x8::splat(simd, offset + block.slack), USUAL_ORIGIN_ERROR);
        for chunk in 0..TARGETS / CHUNK {
            if bits_of(asked, chunk) == 0 {
                continue;
            }
            let first = chunk % (TARGETS / CHUNK) * CHUNK;
            let these = first..first + CHUNK;
            let weight = &block.weight[these.clone()];
            let mut directions = [[0.0_f64; CHUNK]; 3];
            let mut lengths = [0.0_f64; CHUNK];
            for axis in 0..3 {
                let from = point[axis];
                let at = &block.at[axis][these.clone()];
                for i in 0..CHUNK {
                    // Times 1 or 0, which rounds nothing.
                    let direction = at[i] - from * weight[i];
                    directions[axis][i] = direction;
                    lengths[i] = lengths[i].max(direction.abs());
                }
            }
            let mut to_unit = [0.0_f64; CHUNK];
            let lights = &mut segments.light[these.clone()];
            let ends = &mut segments.end[these.clone()];
            for i in 0..CHUNK {
                let exponent = lengths[i].to_bits() >> 52;
                to_unit[i] = f64::from_bits(2046_u64.wrapping_sub(exponent) << 52);
                let rate = frame.scale * f64::from_bits(exponent << 52);
                // A direction has no end.
                let rate = if weight[i] == 0.0 { FARTHEST } else { rate };
                let light = rate.min(FARTHEST);
                lights[i] = light as f32;
                ends[i] = (light * (1.0 + 4.0 * U) + 4.0 * U) as f32;
            }
            for axis in 0..3 {
                let components = &mut segments.direction[axis][these.clone()];
                for i in 0..CHUNK {
                    let x = (directions[axis][i] * to_unit[i]) as f32;
                    components[i] = if x.abs() < smallest {
                        smallest.copysign(x)
                    } else {
                        x
                    };
                }
            }
            for half in [0, 8] {
                let length = f64x8::from_slice(simd, &lengths[half..half + 8]);
                let error = f64x8::from_slice(simd, &to_unit[half..half + 8]) * offset;
                // Not for NaN.
                let is_fit = error.simd_le(most) & length.simd_ge(1e-290) & length.simd_le(1e290);
                segments.fit |= (is_fit.to_bitmask() & 0xff) << (first + half);
            }
        }
        segments
    }

    /// Returns a target's segment.
    #[inline(always)]
    pub(super) fn ray<S: Simd>(&self, simd: S, lane: usize, bounds: &FilterBounds) -> FrameRay {
        let lane = lane % TARGETS;
        let [x, y, z] = [0, 1, 2].map(|axis: usize| self.direction[axis][lane]);
        let direction = fearless_simd::f32x4::simd_from(simd, [x, y, z, 1.0]);
        let [a, b, c] = self.origin;
        let origin = fearless_simd::f32x4::simd_from(simd, [a, b, c, 0.0]);
        let inverse = fearless_simd::f32x4::splat(simd, 1.0) / direction;
        FrameRay {
            origin: origin.into(),
            direction: [x, y, z, 0.0],
            inverse: inverse.into(),
            offset: (origin * inverse).into(),
            end: self.end[lane],
            light: self.light[lane],
            length: (x * x + y * y + z * z).sqrt(),
            bounds: *bounds,
            entry: 0.0,
            rate: 1.0,
        }
    }

    /// Returns sixteen directions.
    #[inline(always)]
    pub(super) fn directions<S: Simd>(&self, simd: S, chunk: usize) -> [f32x16<S>; 3] {
        [
            lanes(simd, &self.direction[0], chunk),
            lanes(simd, &self.direction[1], chunk),
            lanes(simd, &self.direction[2], chunk),
        ]
    }
}

/// Returns sixteen of 64 numbers.
#[inline(always)]
pub(super) fn lanes<S: Simd>(simd: S, numbers: &[f32; TARGETS], chunk: usize) -> f32x16<S> {
    let first = chunk % (TARGETS / CHUNK) * CHUNK;
    f32x16::from_slice(simd, &numbers[first..first + CHUNK])
}

/// Returns sixteen bits of 64.
#[inline(always)]
pub(super) fn bits_of(mask: u64, chunk: usize) -> u64 {
    mask >> (chunk * CHUNK) & 0xffff
}

/// Returns the numbers of the bits set.
#[inline(always)]
pub(super) fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let bit = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            bit
        })
    })
}
