//! Four linear functions of a point at a time, in `f32` with one error bound.
//!
//! In the frame's units a form is `n . x + w` with largest `|n|` 1, so `|w| <= 3`. What it is worth at a
//! point `x` of the frame, as given, for an exact start within [`START_ROOM`] of it, is known up to
//! [`BOUND`]: with `u = 2^-24`, rounding of `n`, `w` and `x` costs `1.5 u + 2 u + 1.5 u` (half a last
//! place each), the products `1.5 u`, the sums `2 u` where the whole is near zero, the start
//! `3 * START_ROOM = 48 u`; together less than `2^-18 = 64 u`, also for the points beside a flat scene
//! that its cells hold, which are up to 2: there rounding costs twice as much, `15 u`. A form that `f64`
//! cannot tell well enough is zero everywhere: always in doubt.

use antumbra_geometry::{DVec3, LightShape};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16};

use crate::accel::frame::Frame;

/// How far a start may lie from its point as given, in any coordinate, for values and lists to be asked,
/// in the frame's units.
pub(crate) const START_ROOM: f64 = 1.0 / (1u64 << 20) as f64;

/// What a form's value may be off.
pub(crate) const BOUND: f32 = 1.0 / (1u64 << 18) as f32;

/// Four forms, coordinate by coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Forms {
    rows: [[f32; 4]; 4],
}

/// What four forms say of a point or a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// One is surely negative.
    Outside,
    /// All are surely positive.
    Inside,
    Doubt,
}

/// A linear function in `f64`, in the frame's units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Form {
    normal: DVec3,
    offset: f64,
}

impl Form {
    pub(crate) const DOUBT: Self = Self {
        normal: DVec3::ZERO,
        offset: 0.0,
    };

    /// The plane through `point` spanned by two vectors, positive on the side of `inside`; that is
    /// `None` for lights at infinity seen along minus the vector.
    pub(crate) fn spanned(u: DVec3, v: DVec3, point: DVec3, inside: Inside) -> Self {
        let normal = u.cross(v);
        let size = normal.abs().max_element();
        let products = u.abs().max_element() * v.abs().max_element();
        // The normal's error is below 2^-49 of the products.
        let is_good = size > products * 2f64.powi(-20) && size > 1e-250;
        if !is_good {
            return Self::DOUBT;
        }
        let normal = normal / size;
        let form = Self {
            normal,
            offset: -normal.dot(point),
        };
        let (height, error) = match inside {
            Inside::Point(inside) => {
                let far = inside.abs().max_element().max(1.0);
                (form.at(inside), far * 2f64.powi(-26))
            }
            Inside::Direction(direction) => {
                let length = direction.abs().max_element();
                (normal.dot(direction), length * 2f64.powi(-26))
            }
        };
        if height.abs() <= error || height.is_nan() {
            Self::DOUBT
        } else if height < 0.0 {
            Self {
                normal: -form.normal,
                offset: -form.offset,
            }
        } else {
            form
        }
    }

    fn at(&self, x: DVec3) -> f64 {
        self.normal.dot(x) + self.offset
    }
}

/// Where a form is positive.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Inside {
    Point(DVec3),
    Direction(DVec3),
}

impl Forms {
    /// Negative everywhere.
    pub(crate) const NOWHERE: Self = Self {
        rows: [[0.0; 4], [0.0; 4], [0.0; 4], [-1.0; 4]],
    };

    pub(crate) fn new(forms: [Form; 4]) -> Self {
        let row = |value: &dyn Fn(&Form) -> f64| std::array::from_fn(|i| value(&forms[i]) as f32);
        Self {
            rows: [
                row(&|form| form.normal.x),
                row(&|form| form.normal.y),
                row(&|form| form.normal.z),
                row(&|form| form.offset),
            ],
        }
    }

    /// Returns the forms at a point.
    #[inline(always)]
    pub(crate) fn wide_at<S: Simd>(&self, simd: S, x: [f32; 3]) -> f32x4<S> {
        let row = |i: usize| f32x4::from_slice(simd, &self.rows[i]);
        row(0) * x[0] + row(1) * x[1] + (row(2) * x[2] + row(3))
    }

    /// Returns whether one form is surely negative at a point, each of whose coordinates is given four times,
    /// and four times 1.
    #[inline(always)]
    pub(crate) fn is_outside<S: Simd>(&self, simd: S, x: f32x16<S>) -> bool {
        let terms = f32x16::from_slice(simd, self.rows.as_flattened()) * x;
        let (low, high) = terms.split();
        let (even, odd) = (low + high).split();
        (even + odd).simd_lt(-BOUND).any_true()
    }

    /// Returns what the forms say of the start at a point.
    #[inline(always)]
    pub(crate) fn wide_verdict<S: Simd>(&self, simd: S, x: [f32; 3]) -> Verdict {
        let heights = self.wide_at(simd, x);
        if heights.simd_lt(-BOUND).any_true() {
            Verdict::Outside
        } else if heights.simd_gt(BOUND).all_true() {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }

    #[inline]
    pub(crate) fn at(&self, x: [f32; 3]) -> [f32; 4] {
        std::array::from_fn(|i| {
            self.rows[0][i] * x[0]
                + self.rows[1][i] * x[1]
                + self.rows[2][i] * x[2]
                + self.rows[3][i]
        })
    }

    /// Returns what the forms say of the start at a point.
    #[inline]
    pub(crate) fn verdict(&self, x: [f32; 3]) -> Verdict {
        let heights = self.at(x);
        let lowest = heights[0].min(heights[1]).min(heights[2].min(heights[3]));
        if lowest < -BOUND {
            Verdict::Outside
        } else if lowest > BOUND {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }

    /// Returns what the forms say of all starts between two points.
    #[inline]
    pub(crate) fn verdict_between(&self, ends: [[f32; 3]; 2]) -> Verdict {
        let [first, second] = ends.map(|end| self.at(end));
        let highest = |i: usize| first[i].max(second[i]);
        let lowest = |i: usize| first[i].min(second[i]);
        // Half spaces are convex.
        if (0..4).any(|i| highest(i) < -BOUND) {
            Verdict::Outside
        } else if (0..4).all(|i| lowest(i) > BOUND) {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }

    /// Returns by how much the forms differ within a box from their values in its middle.
    #[inline]
    fn reach(&self, half: [f32; 3]) -> [f32; 4] {
        std::array::from_fn(|i| {
            self.rows[0][i].abs() * half[0]
                + self.rows[1][i].abs() * half[1]
                + self.rows[2][i].abs() * half[2]
        })
    }

    /// Returns what the forms say of all points of a box.
    #[inline]
    pub(crate) fn verdict_of_box(&self, center: [f32; 3], half: [f32; 3]) -> Verdict {
        let middle = self.at(center);
        let reach = self.reach(half);
        let (mut highest, mut lowest) = (f32::INFINITY, f32::INFINITY);
        for i in 0..4 {
            highest = highest.min(middle[i] + reach[i]);
            lowest = lowest.min(middle[i] - reach[i]);
        }
        if highest < -BOUND {
            Verdict::Outside
        } else if lowest > BOUND {
            Verdict::Inside
        } else {
            Verdict::Doubt
        }
    }

    /// Returns the forms of a triangle's umbra, corners and light in world space: positive together at
    /// the starts that it blocks.
    pub(crate) fn of_umbra(frame: &Frame, corners: [DVec3; 3], light: &LightShape) -> Self {
        let places = corners.map(|corner| frame.point_in_frame(corner));
        // Differences are taken in world space: rounding to the frame would turn short ones.
        let way = |from: usize, to: usize| (corners[to] - corners[from]) * frame.scale;
        let over = |from: usize, to: usize, inside: usize| {
            let ray = match *light {
                LightShape::Point(light) => (corners[from] - light) * frame.scale,
                LightShape::Direction(direction) => direction,
            };
            let inside = Inside::Point(places[inside]);
            Form::spanned(ray, way(from, to), places[from], inside)
        };
        let lit = match *light {
            LightShape::Point(light) => Inside::Point(frame.point_in_frame(light)),
            LightShape::Direction(direction) => Inside::Direction(direction),
        };
        let plane = Form::spanned(way(0, 1), way(0, 2), places[0], lit);
        let behind = Form {
            normal: -plane.normal,
            offset: -plane.offset,
        };
        Self::new([over(0, 1, 2), over(1, 2, 0), over(2, 0, 1), behind])
    }
}

impl Forms {
    /// Returns the plane through the light and an edge, four times; which side is positive is of no
    /// account.
    pub(crate) fn through_light(frame: &Frame, ends: [DVec3; 2], light: &LightShape) -> Self {
        let [from, to] = ends;
        let ray = match *light {
            LightShape::Point(light) => (from - light) * frame.scale,
            LightShape::Direction(direction) => direction,
        };
        let way = (to - from) * frame.scale;
        let from = frame.point_in_frame(from);
        let normal = ray.cross(way);
        let inside = Inside::Point(from + normal.normalize_or_zero());
        Self::new([Form::spanned(ray, way, from, inside); 4])
    }

    /// Returns whether a box surely lies on one side of the first form.
    #[inline]
    pub(crate) fn straddles_not(&self, center: [f32; 3], half: [f32; 3]) -> bool {
        let middle = self.at(center)[0];
        let reach = self.rows[0][0].abs() * half[0]
            + self.rows[1][0].abs() * half[1]
            + self.rows[2][0].abs() * half[2];
        middle.abs() > reach + BOUND
    }

    /// Returns for each form whether it is surely negative at a point, a bit each.
    #[inline]
    pub(crate) fn outside(&self, x: [f32; 3]) -> u32 {
        let heights = self.at(x);
        (0..4).fold(0, |bits, i| bits | u32::from(heights[i] < -BOUND) << i)
    }

    /// Returns the forms of the starts on a triangle: three that are positive over the inside of each
    /// edge, seen along the axis of the normal's largest component, and the height over the plane along
    /// that axis.
    pub(crate) fn of_starts(frame: &Frame, corners: [DVec3; 3], axis: usize) -> Self {
        let places = corners.map(|corner| frame.point_in_frame(corner));
        let way = |from: usize, to: usize| (corners[to] - corners[from]) * frame.scale;
        let mut along = DVec3::ZERO;
        along[axis] = 1.0;
        let over = |from: usize, to: usize, inside: usize| {
            // Seen along the axis, so that the form does not change along it.
            let mut edge = way(from, to);
            edge[axis] = 0.0;
            Form::spanned(edge, along, places[from], Inside::Point(places[inside]))
        };
        let normal = way(0, 1).cross(way(0, 2));
        let products = way(0, 1).abs().max_element() * way(0, 2).abs().max_element();
        let slope = normal[axis];
        let height = if slope.abs() > products * 2f64.powi(-20) && slope.abs() > 1e-250 {
            let normal = normal / slope;
            Form {
                normal,
                offset: -normal.dot(places[0]),
            }
        } else {
            // Never near zero: such a triangle's starts are for the exact rule.
            Form {
                normal: DVec3::ZERO,
                offset: 2.0,
            }
        };
        Self::new([over(0, 1, 2), over(1, 2, 0), over(2, 0, 1), height])
    }

    /// Returns whether a box surely holds no start on this triangle: it lies outside an edge, or above or
    /// below the plane.
    #[inline]
    pub(crate) fn is_beside(&self, center: [f32; 3], half: [f32; 3]) -> bool {
        let middle = self.at(center);
        let reach = self.reach(half);
        // A height that does not change is none: the plane is not known.
        let is_off_plane = reach[3] > 0.0 && middle[3].abs() > reach[3] + BOUND;
        is_off_plane || (0..3).any(|i| middle[i] + reach[i] < -BOUND)
    }

    /// Returns whether a point given for a start on this triangle surely is where the start is, up to
    /// [`START_ROOM`] and an eighth of it along one axis.
    #[inline(always)]
    pub(crate) fn is_start<S: Simd>(&self, simd: S, x: [f32; 3]) -> bool {
        // With `u = 2^-24` the height is right up to `10 u`, so the start lies within `18 u`, and along one axis
        // only: forms grant `48 u` for it, and cells `32 u`, where a code is off by 11.
        const HEIGHT: f32 = (0.5 * START_ROOM) as f32;
        let heights = self.wide_at(simd, x);
        heights.simd_gt(BOUND).to_bitmask() & 0b111 == 0b111 && heights[3].abs() < HEIGHT
    }
}

#[cfg(test)]
mod tests;
