//! All linear forms of a triangle at once, as rounded numbers with bounds.
//!
//! In: a triangle's corners, the segment's ends and the light. Out: [`Forms`]: at both ends the height over the triangle's plane
//! and the sides of the planes through the light and each edge. Invariant: no value errs by more than its bound. One lane of
//! a vector is one form, so a triangle costs as much as one form by itself.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f64x4};
use glam::DVec3;

use super::linear::{Ends, FaceForm, Values};
use crate::number::UNIT_ROUNDOFF;

/// Lanes of the edges; the first is the plane's.
pub(super) const EDGES: u32 = 0b1110;

/// All lanes.
pub(super) const ALL: u32 = 0b1111;

/// Values of the four forms: the plane's, then those of the edges from the first, second and third corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forms {
    /// At the segment's first and last point.
    pub(super) values: [[f64; 4]; 2],
    pub(super) errors: [[f64; 4]; 2],
    /// Lanes that are surely above zero at both points.
    pub(super) above: [u32; 2],
    /// Lanes that are surely below it.
    pub(super) below: [u32; 2],
    /// Height of the light over the plane, with its error.
    pub(super) light: (f64, f64),
}

impl Forms {
    #[inline]
    pub(super) fn of(level: Level, ends: &Ends, corners: &[DVec3; 3]) -> Self {
        dispatch!(level, simd => of(simd, ends, corners))
    }

    /// Returns the values of one form.
    #[inline]
    pub(super) fn lane(&self, lane: usize) -> Values {
        Values {
            values: [self.values[0][lane], self.values[1][lane]],
            errors: [self.errors[0][lane], self.errors[1][lane]],
        }
    }
}

/// Returns what a lane is about.
#[inline]
pub(super) fn form_of(lane: usize) -> FaceForm {
    match lane {
        0 => FaceForm::Height,
        _ => FaceForm::Edge(lane as u8 - 1),
    }
}

type Lanes<S> = [f64x4<S>; 3];

/// No closures here: they would be functions of their own, without wide registers.
///
/// With `u` the unit roundoff and `s` the product of the largest components of the two vectors that make a normal, each rounded
/// at most once: a component of the normal is a difference of two products of rounded factors, so at most `2 s` and off by
/// `8 u s`. Three products with a vector of largest component `w` add at most `24 u s w` for that, `12 u s w` for their own
/// and the vector's rounding and `12 u s w` for sums.
#[inline(always)]
fn of<S: Simd>(simd: S, ends: &Ends, [a, b, c]: &[DVec3; 3]) -> Forms {
    let (light, weight) = ends.light;
    // The plane has the first corner and the vectors to both others; an edge its corner, the vector to the light (which
    // is a difference unless the light is a direction) and the one to the next corner.
    let zero = [
        f64x4::simd_from(simd, [a.x, a.x, b.x, c.x]),
        f64x4::simd_from(simd, [a.y, a.y, b.y, c.y]),
        f64x4::simd_from(simd, [a.z, a.z, b.z, c.z]),
    ];
    let weight = if weight == 0.0 { 0.0 } else { 1.0 };
    let is_subtracted = f64x4::simd_from(simd, [1.0, weight, weight, weight]);
    let first = [
        f64x4::simd_from(simd, [b.x, light.x, light.x, light.x]) - zero[0] * is_subtracted,
        f64x4::simd_from(simd, [b.y, light.y, light.y, light.y]) - zero[1] * is_subtracted,
        f64x4::simd_from(simd, [b.z, light.z, light.z, light.z]) - zero[2] * is_subtracted,
    ];
    let second = [
        f64x4::simd_from(simd, [c.x, b.x, c.x, a.x]) - zero[0],
        f64x4::simd_from(simd, [c.y, b.y, c.y, a.y]) - zero[1],
        f64x4::simd_from(simd, [c.z, b.z, c.z, a.z]) - zero[2],
    ];
    let normal = [
        first[1] * second[2] - first[2] * second[1],
        first[2] * second[0] - first[0] * second[2],
        first[0] * second[1] - first[1] * second[0],
    ];
    let size = largest(&first) * largest(&second) * (64.0 * UNIT_ROUNDOFF);
    let (at_first, first_error) = at(simd, &zero, &normal, size, ends.points[0]);
    let (at_last, last_error) = at(simd, &zero, &normal, size, ends.points[1]);
    // Of the light only the plane's lane is of use.
    let towards = [
        f64x4::splat(simd, light.x) - zero[0] * weight,
        f64x4::splat(simd, light.y) - zero[1] * weight,
        f64x4::splat(simd, light.z) - zero[2] * weight,
    ];
    let (at_light, light_error) = value(&normal, &towards, size);
    Forms {
        values: [at_first.into(), at_last.into()],
        errors: [first_error.into(), last_error.into()],
        above: [
            at_first.simd_gt(first_error).to_bitmask() as u32,
            at_last.simd_gt(last_error).to_bitmask() as u32,
        ],
        below: [
            at_first.simd_lt(-first_error).to_bitmask() as u32,
            at_last.simd_lt(-last_error).to_bitmask() as u32,
        ],
        light: (at_light[0], light_error[0]),
    }
}

#[inline(always)]
fn largest<S: Simd>(v: &Lanes<S>) -> f64x4<S> {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

/// Returns values at vectors from the zero, and bounds on their errors; what underflows has bounds of its own.
#[inline(always)]
fn value<S: Simd>(normal: &Lanes<S>, from: &Lanes<S>, size: f64x4<S>) -> (f64x4<S>, f64x4<S>) {
    let value = normal[0] * from[0] + normal[1] * from[1] + normal[2] * from[2];
    let reach = largest(from);
    let error = size * reach + (reach * (8.0 * f64::MIN_POSITIVE) + 8.0 * f64::MIN_POSITIVE);
    (value, error)
}

/// Values at a point, and bounds on their errors.
#[inline(always)]
fn at<S: Simd>(
    simd: S,
    zero: &Lanes<S>,
    normal: &Lanes<S>,
    size: f64x4<S>,
    point: DVec3,
) -> (f64x4<S>, f64x4<S>) {
    let from = [
        f64x4::splat(simd, point.x) - zero[0],
        f64x4::splat(simd, point.y) - zero[1],
        f64x4::splat(simd, point.z) - zero[2],
    ];
    value(normal, &from, size)
}
