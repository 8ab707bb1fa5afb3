//! Whether a point is where a start on its triangle is, in half a cache line a triangle.
//!
//! In: a triangle, the side that the light is on; points of the frame, eight at a time. Out: whose values speak
//! of the starts. The point is taken from a corner of the triangle and told by two barycentric
//! coordinates in 16 bits and by its height in `f32`, seen along the axis of the normal's largest component.
//!
//! Errors, with `u = 2^-24`, for points of the frame: a difference of two coordinates is off by `2 u` (`u` from
//! rounding both, `u` from the difference, which is at most 2). The height is off by `2 u`, twice `4 u` for a
//! slope of at most 1 times such a difference, rounded itself, and `2 u` for the sum: `12 u`. With a height of
//! at most `8 u` the start lies within `20 u` of its point, along one axis: forms grant `48 u` for it
//! (`START_ROOM` in each coordinate), cells `32 u`, where a code is off by 11. Coordinates `b T`, in units of
//! a rounded coefficient: half a unit for each difference, [`ROUNDING`] with what `f32` adds; and
//! `2^15 * 2 u` twice for the differences' own error, and rounding where all is near zero, [`SLACK`].

use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8, mask32x8, u32x4, u32x8};

use super::forms::START_ROOM;
use crate::accel::frame::Frame;

/// A triangle that queries start from, for one light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub(super) struct ReceiverPlane {
    /// `f32`: a corner and the slopes of the plane, along the axes beside the normal's, in turn, and the corner along
    /// the normal's between them; two pairs of `i16`: the coefficients of the coordinates of the two other
    /// corners; `f32`: what all coordinates sum to, its last bits [`AXIS`], [`IS_BEHIND`] and
    /// [`IS_CLEAR`].
    words: [u32; 8],
}

/// Bits that say which axis is the normal's.
const AXIS: u32 = 0b0011;
/// Set if the light is behind.
const IS_BEHIND: u32 = 0b0100;
/// Set if the triangle is not opaque, so that nothing lists it.
const IS_CLEAR: u32 = 0b1000;
const FLAGS: u32 = 0b1111;

/// The largest coefficient.
const LARGEST: f64 = 32_766.0;
const ROUNDING: f32 = 0.53;
const SLACK: f32 = 0.04;
const HEIGHT: f32 = (0.5 * START_ROOM) as f32;

impl ReceiverPlane {
    /// Tells of no start where it is.
    pub(super) const NOWHERE: Self = Self { words: [0; 8] };

    /// Fetches a plane into the caches.
    #[inline(always)]
    pub(super) fn any_word(&self) -> u32 {
        self.words[0]
    }

    pub(super) fn new(frame: &Frame, corners: [DVec3; 3], axis: usize, is_behind: bool) -> Self {
        let (w, u, v) = (axis, (axis + 1) % 3, (axis + 2) % 3);
        // Differences are taken in world space: rounding to the frame would turn short ones.
        let way = |to: usize| (corners[to] - corners[0]) * frame.scale;
        let (first, second) = (way(1), way(2));
        let normal = first.cross(second);
        let products = first.abs().max_element() * second.abs().max_element();
        let slope = normal[w];
        let is_good = slope.abs() > products * 2f64.powi(-20) && slope.abs() > 1e-250;
        if !is_good {
            return Self::NOWHERE;
        }
        let rows = [second[v], -second[u], -first[v], first[u]];
        let largest = rows.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let coefficient = |x: f64| {
            let rounded = (x * slope.signum() / largest * LARGEST).round() as i16;
            u32::from(rounded.cast_unsigned())
        };
        let pair = |x: f64, y: f64| coefficient(x) | coefficient(y) << 16;
        // Rounded down, and further by the flags.
        let sum = (LARGEST * slope.abs() / largest * (1.0 - 2f64.powi(-22))) as f32;
        let flags = axis as u32 | if is_behind { IS_BEHIND } else { 0 };
        let corner = frame.point_in_frame(corners[0]);
        let bits = |x: f64| (x as f32).to_bits();
        Self {
            words: [
                bits(corner[u]),
                bits(corner[v]),
                bits(corner[w]),
                bits(-normal[u] / slope),
                bits(-normal[v] / slope),
                pair(rows[0], rows[1]),
                pair(rows[2], rows[3]),
                sum.to_bits() & !FLAGS | flags,
            ],
        }
    }
}

impl ReceiverPlane {
    /// The plane of a triangle of which the light is on this side.
    pub(super) fn of_triangle(
        occluders: &Occluders,
        frame: &Frame,
        triangle: SurfaceId,
        side: i8,
    ) -> Self {
        // Of starts whose triangle's plane holds the light no values speak.
        let is_behind = match side {
            1 => false,
            -1 => true,
            _ => return Self::NOWHERE,
        };
        match (
            occluders.triangle_positions(triangle),
            occluders.dominant_axis(triangle),
        ) {
            (Some(corners), Some(axis)) => {
                let mut plane = Self::new(frame, corners, axis, is_behind);
                if !occluders.is_opaque(triangle) {
                    plane.words[7] |= IS_CLEAR;
                }
                plane
            }
            _ => Self::NOWHERE,
        }
    }

    /// Returns 1 if the triangle is not opaque.
    #[inline(always)]
    pub(super) fn clear_bit(&self) -> u32 {
        (self.words[7] & IS_CLEAR) / IS_CLEAR
    }

    /// Returns whether the light is behind, if a point is where the start on this triangle is.
    #[inline(always)]
    pub(super) fn tell_one<S: Simd>(&self, simd: S, [x, y, z]: [f32; 3]) -> Option<bool> {
        let x = [
            f32x8::splat(simd, x),
            f32x8::splat(simd, y),
            f32x8::splat(simd, z),
        ];
        let (are_starts, are_behind) = tell(simd, [self; 8], x);
        (are_starts.to_bitmask() & 1 != 0).then(|| are_behind.to_bitmask() & 1 != 0)
    }
}

// Closures and the methods of arrays are not always inlined, and their SIMD is slow then: only functions here.

/// Four words of the planes of four starts, word by word.
#[inline(always)]
fn four_words<S: Simd>(simd: S, planes: [&ReceiverPlane; 4], first: usize) -> [u32x4<S>; 4] {
    let a = u32x4::from_slice(simd, &planes[0].words[first..first + 4]);
    let b = u32x4::from_slice(simd, &planes[1].words[first..first + 4]);
    let c = u32x4::from_slice(simd, &planes[2].words[first..first + 4]);
    let d = u32x4::from_slice(simd, &planes[3].words[first..first + 4]);
    let (even, odd) = (a.zip_low(c), b.zip_low(d));
    let (even_high, odd_high) = (a.zip_high(c), b.zip_high(d));
    [
        even.zip_low(odd),
        even.zip_high(odd),
        even_high.zip_low(odd_high),
        even_high.zip_high(odd_high),
    ]
}

/// Four words of the planes of eight starts, word by word.
#[inline(always)]
fn words<S: Simd>(simd: S, planes: [&ReceiverPlane; 8], first: usize) -> [u32x8<S>; 4] {
    let [a, b, c, d, e, f, g, h] = planes;
    let low = four_words(simd, [a, b, c, d], first);
    let high = four_words(simd, [e, f, g, h], first);
    [
        low[0].combine(high[0]),
        low[1].combine(high[1]),
        low[2].combine(high[2]),
        low[3].combine(high[3]),
    ]
}

#[inline(always)]
fn real<S: Simd>(bits: u32x8<S>) -> f32x8<S> {
    f32x8::from_bits(bits)
}

/// The first of a pair of signed numbers.
#[inline(always)]
fn first<S: Simd>(pair: u32x8<S>) -> f32x8<S> {
    let high: i32x8<S> = (pair << 16).bitcast();
    (high >> 16).to_float()
}

#[inline(always)]
fn second<S: Simd>(pair: u32x8<S>) -> f32x8<S> {
    let both: i32x8<S> = pair.bitcast();
    (both >> 16).to_float()
}

/// Tells the same of up to 32 points, whose number is a multiple of eight, a bit each.
#[inline(always)]
pub(super) fn are_starts<S: Simd, const N: usize>(
    simd: S,
    planes: &[&ReceiverPlane; N],
    [x, y, z]: &[[f32; N]; 3],
) -> u32 {
    let mut are_starts = 0;
    for first in (0..N).step_by(8) {
        let eight = [0, 1, 2, 3, 4, 5, 6, 7].map(|lane: usize| planes[first + lane]);
        let at = [
            f32x8::from_slice(simd, &x[first..first + 8]),
            f32x8::from_slice(simd, &y[first..first + 8]),
            f32x8::from_slice(simd, &z[first..first + 8]),
        ];
        are_starts |= (tell(simd, eight, at).0.to_bitmask() as u32 & 0xff) << first;
    }
    are_starts
}

/// Tells for eight points of the frame, given coordinate by coordinate, which are where the starts on their
/// triangles are, and for which the light is behind.
#[inline(always)]
pub(super) fn tell<S: Simd>(
    simd: S,
    planes: [&ReceiverPlane; 8],
    [x, y, z]: [f32x8<S>; 3],
) -> (mask32x8<S>, mask32x8<S>) {
    let [corner_u, corner_v, corner_w, slope_u] = words(simd, planes, 0);
    let [slope_v, row_b, row_c, sum] = words(simd, planes, 4);
    let axis = sum & AXIS;
    let (is_x, is_y) = (axis.simd_eq(0), axis.simd_eq(1));
    let u = is_x.select(y, is_y.select(z, x)) - real(corner_u);
    let v = is_x.select(z, is_y.select(x, y)) - real(corner_v);
    let w = is_x.select(x, is_y.select(y, z)) - real(corner_w);
    let height = w - (u * real(slope_u) + v * real(slope_v));
    let b = u * first(row_b) + v * second(row_b);
    let c = u * first(row_c) + v * second(row_c);
    let margin = (u.abs() + v.abs()) * ROUNDING + SLACK;
    let rest = real(sum) - b - c;
    let is_over = b.simd_gt(margin) & c.simd_gt(margin) & rest.simd_gt(margin + margin);
    let is_behind = (sum & IS_BEHIND).simd_ne(0);
    (is_over & height.abs().simd_lt(HEIGHT), is_behind)
}

/// Returns a point within half the room of a start on a surface that is no triangle, if it is surely near the surface.
pub(super) fn start_on_curved(
    occluders: &Occluders,
    frame: &Frame,
    start: &ReceiverPoint,
) -> Option<DVec3> {
    let surface = start.surface?;
    let room = 0.5 * START_ROOM / frame.scale;
    let mut point = start.point;
    if occluders.start_offset(start) != 0.0 {
        // Where the light is is of no matter to where the start is.
        let segment = occluders.segment(start, &LightShape::Direction(DVec3::Z));
        point = segment.origin();
        // Not for NaN.
        let is_near = segment.origin_error() < room;
        is_near.then_some(())?;
    }
    let is_near = occluders.is_surely_near_curved(surface, point, room);
    is_near.then_some(point)
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{LightShape, Opacity, ReceiverPoint};
    use fearless_simd::{Level, dispatch};

    use super::super::testing::Random;
    use super::*;

    const ONE: SurfaceId = SurfaceId(0);

    /// What is told of one point, the same in each of the eight places.
    fn tell_one(plane: &ReceiverPlane, x: [f32; 3]) -> (bool, bool) {
        let (are_told, are_behind) = dispatch!(Level::new(), simd => {
            let (are_told, are_behind) =
                tell(simd, [plane; 8], x.map(|x| f32x8::splat(simd, x)));
            (are_told.to_bitmask(), are_behind.to_bitmask())
        });
        assert!(are_told == 0 || are_told == 0xff, "{are_told:x}");
        assert!(are_behind == 0 || are_behind == 0xff, "{are_behind:x}");
        (are_told != 0, are_behind != 0)
    }

    #[test]
    fn starts_are_where_their_points_are() {
        let random = &mut Random(1);
        let light = LightShape::Direction(DVec3::Z);
        let (mut told, mut inside, mut refused) = (0, 0, 0);
        for _ in 0..40_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            // As large as the scene, small, or a sliver.
            let a = random.in_box(&scene);
            let share = random.pick(&[1.0, 1.0, 0.1, 1e-3, 1e-5]);
            let b = a + share * (random.in_box(&scene) - a);
            let share = share * random.pick(&[1.0, 1.0, 0.1, 1e-3]);
            let c = a + share * (random.in_box(&scene) - a);
            let corners = [a, b, c];
            let mut builder = Occluders::builder();
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
            let occluders = builder.build();
            let Some(axis) = occluders.dominant_axis(ONE) else {
                continue;
            };
            let is_behind = random.below(2) == 0;
            let plane = ReceiverPlane::new(&frame, corners, axis, is_behind);
            let near = random.pick(&[0.0, 1e-3, 1e-4, 1e-5, 1e-6]);
            let [s, t] = match random.below(3) {
                0 => [random.real(-0.1, 1.1), random.real(-0.1, 1.1)],
                // About an edge.
                1 => [random.real(0.0, 1.0), near * random.real(-1.0, 1.0)],
                _ => {
                    let s = random.real(0.0, 1.0);
                    [s, 1.0 - s + near * random.real(-1.0, 1.0)]
                }
            };
            let mut point = a + s * (b - a) + t * (c - a);
            let nudge = random.pick(&[0.0, 0.2, 0.45, 0.55, 1.0, 2.0, 5.0]);
            point[axis] += nudge * START_ROOM / frame.scale;
            let x = frame.point_in_frame(point);
            if x.abs().max_element() > 1.0 {
                continue;
            }
            let (is_known, behind) = tell_one(&plane, x.to_array().map(|x| x as f32));
            if !is_known {
                refused += 1;
                continue;
            }
            assert_eq!(behind, is_behind);
            told += 1;
            inside += usize::from(s.min(t).min(1.0 - s - t) < 1e-2);
            let start = ReceiverPoint {
                point,
                surface: Some(ONE),
            };
            let segment = occluders.segment(&start, &light);
            let offset = (segment.origin() - point).abs().max_element() + segment.origin_error();
            assert!(
                offset * frame.scale <= 1.25 * START_ROOM,
                "{corners:?} {point:?}: {}",
                offset * frame.scale / START_ROOM
            );
            // Seen along the axis it is over the triangle.
            assert!(s > 0.0 && t > 0.0 && s + t < 1.0, "{corners:?} {s} {t}");
        }
        assert!(
            told > 1_000 && inside > 100 && refused > 1_000,
            "{told} {inside} {refused}"
        );
    }

    #[test]
    fn most_points_of_a_triangle_are_told() {
        let random = &mut Random(2);
        let (mut told, mut asked) = (0, 0);
        for _ in 0..2_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let a = random.in_box(&scene);
            let corners =
                [a, random.in_box(&scene), random.in_box(&scene)].map(|x| a + 0.05 * (x - a));
            let mut builder = Occluders::builder();
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
            let Some(axis) = builder.build().dominant_axis(ONE) else {
                continue;
            };
            let plane = ReceiverPlane::new(&frame, corners, axis, false);
            for _ in 0..10 {
                let [s, t] = [random.real(0.0, 1.0), random.real(0.0, 1.0)];
                let [s, t] = if s + t > 1.0 {
                    [1.0 - s, 1.0 - t]
                } else {
                    [s, t]
                };
                let point = a + s * (corners[1] - a) + t * (corners[2] - a);
                let x = frame.point_in_frame(point).to_array().map(|x| x as f32);
                asked += 1;
                told += usize::from(tell_one(&plane, x).0);
            }
        }
        assert!(100 * told > 97 * asked, "{told} of {asked}");
    }

    #[test]
    fn nothing_starts_nowhere() {
        let frame = Frame::new(antumbra_geometry::Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        });
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let plane = ReceiverPlane::new(&frame, corners, 2, false);
        assert!(tell_one(&plane, [-0.4, -0.4, -0.5]).0);
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            for axis in 0..3 {
                let mut point = [-0.4, -0.4, -0.5];
                point[axis] = x;
                assert!(!tell_one(&plane, point).0, "{point:?}");
                assert!(!tell_one(&ReceiverPlane::NOWHERE, point).0, "{point:?}");
            }
        }
        assert!(!tell_one(&ReceiverPlane::NOWHERE, [0.0; 3]).0);
    }
}
