//! Eight vectors of `f64`, coordinate by coordinate.
//!
//! Rows are turned in registers: what is stored in parts and loaded as a whole waits for all that was before.
//! Closures and the methods of arrays are not always inlined, and their SIMD is slow then: only functions here.

use antumbra_geometry::DVec3;
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x4, f64x8};

/// Eight vectors.
#[derive(Clone, Copy)]
pub(super) struct Vectors<S: Simd>(pub(super) [f64x8<S>; 3]);

impl<S: Simd> Vectors<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, vector: DVec3) -> Self {
        Self([
            f64x8::splat(simd, vector.x),
            f64x8::splat(simd, vector.y),
            f64x8::splat(simd, vector.z),
        ])
    }

    #[inline(always)]
    pub(super) fn new(simd: S, points: [&DVec3; 8]) -> Self {
        let [a, b, c, d, e, f, g, h] = points;
        let [low_x, low_y, low_z] = four_points(simd, [a, b, c, d]);
        let [high_x, high_y, high_z] = four_points(simd, [e, f, g, h]);
        Self([
            low_x.combine(high_x),
            low_y.combine(high_y),
            low_z.combine(high_z),
        ])
    }

    #[inline(always)]
    pub(super) fn minus(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([a - d, b - e, c - f])
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> f64x8<S> {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        a * d + b * e + c * f
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([b * f - e * c, c * d - f * a, a * e - d * b])
    }

    #[inline(always)]
    pub(super) fn length_squared(self) -> f64x8<S> {
        self.dot(self)
    }

    /// The sum of the coordinates' absolute values.
    #[inline(always)]
    pub(super) fn size(self) -> f64x8<S> {
        let [a, b, c] = self.0;
        a.abs() + b.abs() + c.abs()
    }
}

/// Four rows of four numbers, column by column.
#[inline(always)]
pub(super) fn turned<S: Simd>([a, b, c, d]: [f64x4<S>; 4]) -> [f64x4<S>; 4] {
    let (even, odd) = (a.zip_low(c), b.zip_low(d));
    let (even_high, odd_high) = (a.zip_high(c), b.zip_high(d));
    [
        even.zip_low(odd),
        even.zip_high(odd),
        even_high.zip_low(odd_high),
        even_high.zip_high(odd_high),
    ]
}

/// Four points, coordinate by coordinate.
#[inline(always)]
pub(super) fn four_points<S: Simd>(simd: S, points: [&DVec3; 4]) -> [f64x4<S>; 3] {
    let [a, b, c, d] = points;
    let rows = [row(simd, a), row(simd, b), row(simd, c), row(simd, d)];
    let [x, y, z, _] = turned(rows);
    [x, y, z]
}

#[inline(always)]
fn row<S: Simd>(simd: S, point: &DVec3) -> f64x4<S> {
    f64x4::from_slice(simd, &[point.x, point.y, point.z, 0.0])
}
