//! Where things meet: one pair of shapes a file.
//!
//! `segment_*`: the rule of EXACTNESS.md ("Which surfaces block") and the distance of the crossing.
//! `box_*`: conservative overlap of a shape and a box, for putting shapes into voxels.
//! Invariant of the former: the answer is the rule's, whatever the rounding. Invariant of the
//! latter: never `false` for shapes that meet the box.

mod box_shapes;
mod box_triangle;
mod segment_cone;
mod segment_disk;
mod segment_sphere;
mod segment_triangle;

pub(crate) use box_shapes::{
    box_meets_cone, box_meets_disk, box_meets_sphere, cone_bounds, disk_bounds, unit_of,
};
pub(crate) use box_triangle::box_meets_triangle;
pub(crate) use segment_cone::{
    cone_distance, cone_is_outside, cone_meets_interior, is_behind_wall, own_tube_blocks,
    tube_blocks, tube_side, wall_exit,
};
pub(crate) use segment_disk::{DiskPlane, cap_exit, disk_blocks, disk_distance};
pub(crate) use segment_sphere::{
    line_surely_misses_ball, own_sphere_blocks, sphere_blocks, sphere_distance, sphere_side,
};
pub(crate) use segment_triangle::{plane_side, triangle_blocks, triangle_distance};

use crate::number::{Number, Sign};

/// Returns a power of two that brings a length near 1, so that its fourth power keeps its bits: to
/// scale lengths by it rounds nothing.
fn near_one(largest: f64) -> f64 {
    // The exponent's bits, so that no logarithm is needed for each hit.
    let exponent = (largest.to_bits() >> 52) as i32 - 1023;
    if largest.is_finite() && (-1022..=1022).contains(&exponent) {
        2f64.powi(-exponent)
    } else {
        1.0
    }
}

/// The signs that a quadratic form `A s^2 + 2 B s t + C t^2` takes for `s, t > 0`.
#[derive(Clone, Copy, Debug)]
struct SignsTaken {
    negative: bool,
    positive: bool,
}

/// Returns the signs taken inside the quadrant, `None` if undecided.
fn signs_in_quadrant<N: Number>(a: &N, b: &N, c: &N) -> Option<SignsTaken> {
    let (sign_a, sign_b, sign_c) = (a.sign()?, b.sign()?, c.sign()?);
    let is_mixed_discriminant =
        || -> Option<bool> { Some(b.times(b).minus(&a.times(c)).sign()?.is_positive()) };
    // At the ends the form has the signs of A and C; in between it can dip below zero only if B
    // pulls it there and the discriminant is positive, and rise above zero likewise.
    let takes = |wanted: Sign| -> Option<bool> {
        if sign_a == wanted || sign_c == wanted {
            return Some(true);
        }
        if sign_b != wanted {
            return Some(false);
        }
        is_mixed_discriminant()
    };
    Some(SignsTaken {
        negative: takes(Sign::Negative)?,
        positive: takes(Sign::Positive)?,
    })
}
