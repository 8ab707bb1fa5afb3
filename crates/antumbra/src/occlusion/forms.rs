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
use fearless_simd::{Simd, f32x4, f32x8, f32x16, mask32x8};

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

/// The forms of eight triangles, form by form and coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct EightForms {
    rows: [[[f32; 8]; 4]; 4],
}

impl EightForms {
    /// Takes at most eight; in place of missing ones are forms that are negative everywhere.
    pub(crate) fn new(forms: &[Forms]) -> Self {
        let mut rows = [[[0.0; 8], [0.0; 8], [0.0; 8], [-1.0; 8]]; 4];
        for (lane, one) in forms.iter().take(8).enumerate() {
            for (form, rows) in rows.iter_mut().enumerate() {
                for (row, values) in rows.iter_mut().enumerate() {
                    values[lane] = one.rows[row][form];
                }
            }
        }
        Self { rows }
    }

    /// Returns a bit for each triangle whose forms are not surely negative somewhere, and for each whose forms
    /// are all surely positive.
    #[inline(always)]
    pub(crate) fn verdicts<S: Simd>(&self, simd: S, [x, y, z]: [f32; 3]) -> (u32, u32) {
        let height = |[nx, ny, nz, offset]: &[[f32; 8]; 4]| {
            let wide = |row: &[f32; 8]| f32x8::from_slice(simd, row);
            wide(nx) * x + wide(ny) * y + (wide(nz) * z + wide(offset))
        };
        let [a, b, c, d] = &self.rows;
        let lowest = height(a).min(height(b)).min(height(c).min(height(d)));
        let bits = |mask: mask32x8<S>| mask.to_bitmask() as u32;
        (bits(lowest.simd_ge(-BOUND)), bits(lowest.simd_gt(BOUND)))
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
mod tests {
    use antumbra_geometry::{Bounds, Occluders, Opacity, Start, SurfaceId};
    use fearless_simd::{Level, dispatch};

    use super::super::testing::Random;
    use super::*;

    const ONE: SurfaceId = SurfaceId(0);

    fn narrow(v: DVec3) -> [f32; 3] {
        v.to_array().map(|x| x as f32)
    }

    fn occluders_of(corners: [DVec3; 3]) -> Occluders {
        let mut builder = Occluders::builder();
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
        builder.build()
    }

    fn is_blocked(occluders: &Occluders, point: DVec3, light: &LightShape) -> bool {
        let start = Start {
            point,
            surface: None,
        };
        occluders.blocks(ONE, &occluders.segment(&start, light))
    }

    /// A triangle somewhere in a scene: as large as that, small, or a sliver.
    fn triangle(scene: &Bounds, random: &mut Random) -> [DVec3; 3] {
        let a = random.in_box(scene);
        let towards = |random: &mut Random, share: f64| a + share * (random.in_box(scene) - a);
        let share = random.pick(&[1.0, 1.0, 0.1, 1e-3, 1e-6]);
        let b = towards(random, share);
        let share = share * random.pick(&[1.0, 1.0, 0.1, 1e-4]);
        let mut c = towards(random, share);
        if random.below(4) == 0 {
            c = a + 0.5 * (b - a) + 1e-5 * (c - a);
        }
        [a, b, c]
    }

    /// A point on the border of what a triangle blocks, moved by little.
    fn near_border(
        corners: [DVec3; 3],
        light: &LightShape,
        frame: &Frame,
        random: &mut Random,
    ) -> DVec3 {
        let first = random.below(3);
        let (a, b) = (corners[first], corners[(first + 1) % 3]);
        let through = a + random.real(0.0, 1.0) * (b - a);
        let away = match *light {
            LightShape::Point(light) => through - light,
            LightShape::Direction(direction) => -direction,
        };
        let reach = 1.0 / (frame.scale * away.abs().max_element());
        let far = random.pick(&[0.0, 1.0]) * random.real(0.0, reach);
        let nudge = random.pick(&[0.25, 1.0, 2.0, 8.0]) * f64::from(BOUND) / frame.scale;
        through + far * away + nudge * random.in_cube()
    }

    #[test]
    fn verdicts_hold_for_all_starts_in_their_room() {
        let random = &mut Random(1);
        let mut told = [0; 2];
        for _ in 0..4_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let light = random.light(&scene);
            let corners = triangle(&scene, random);
            let occluders = occluders_of(corners);
            let forms = Forms::of_umbra(&frame, corners, &light);
            for _ in 0..20 {
                let point = if random.below(4) == 0 {
                    random.in_box(&scene)
                } else {
                    near_border(corners, &light, &frame, random)
                };
                let x = frame.point_in_frame(point);
                if x.abs().max_element() > 1.0 {
                    continue;
                }
                let x = narrow(x);
                let wide = dispatch!(Level::new(), simd => forms.wide_verdict(simd, x));
                let start = point + START_ROOM / frame.scale * random.of_cube();
                let expected = is_blocked(&occluders, start, &light);
                for verdict in [wide, forms.verdict(x)] {
                    let is_wrong = match verdict {
                        Verdict::Outside => expected,
                        Verdict::Inside => !expected,
                        Verdict::Doubt => false,
                    };
                    assert!(
                        !is_wrong,
                        "{verdict:?}: {corners:?}, {light:?}, {point:?}, {start:?}"
                    );
                    told[usize::from(expected)] += usize::from(verdict != Verdict::Doubt);
                }
                if forms.outside(x) != 0 {
                    assert!(!expected, "{corners:?}, {light:?}, {point:?}, {start:?}");
                }
            }
        }
        // Not by doubting everything.
        assert!(told.iter().all(|&count| count > 5_000), "{told:?}");
    }

    #[test]
    fn triangles_without_area_or_seen_edge_on_are_always_in_doubt() {
        let v = DVec3::new;
        let (a, b) = (v(0.1, 0.2, 0.3), v(0.7, -0.4, 0.5));
        let along = |t: f64| a + t * (b - a);
        let point = LightShape::Point(v(0.3, 0.9, 2.0));
        let direction = LightShape::Direction(v(0.1, 0.3, 1.0));
        let flat = [v(0.1, 0.2, 0.25), v(0.7, -0.4, 0.25), v(-0.5, 0.1, 0.25)];
        let in_plane = LightShape::Point(v(0.9, 0.9, 0.25));
        let along_plane = LightShape::Direction(v(0.2, -1.0, 0.0));
        let random = &mut Random(2);
        for (corners, light) in [
            ([a, a, a], point),
            ([a, a, b], point),
            ([a, b, a], direction),
            ([a, b, along(0.3)], point),
            ([a, b, along(1.7)], direction),
            (flat, in_plane),
            (flat, along_plane),
        ] {
            let frame = Frame::new(Bounds {
                min: DVec3::splat(-1.0),
                max: DVec3::ONE,
            });
            let forms = Forms::of_umbra(&frame, corners, &light);
            for _ in 0..200 {
                let x = narrow(random.in_cube());
                assert_eq!(forms.verdict(x), Verdict::Doubt, "{corners:?} {light:?}");
                let wide = dispatch!(Level::new(), simd => forms.wide_verdict(simd, x));
                assert_eq!(wide, Verdict::Doubt, "{corners:?} {light:?}");
            }
        }
    }

    #[test]
    fn verdicts_of_boxes_hold_everywhere_in_them() {
        let random = &mut Random(3);
        let mut told = [0; 2];
        for _ in 0..20_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let light = random.light(&scene);
            let corners = triangle(&scene, random);
            let occluders = occluders_of(corners);
            let forms = Forms::of_umbra(&frame, corners, &light);
            // Anywhere, about the border, about the middle of the umbra.
            let mut center = random.in_box(&scene);
            let place = random.below(3);
            if place > 0 {
                center = near_border(corners, &light, &frame, random);
            }
            if place > 1 {
                let [a, b, c] = corners;
                center += random.pick(&[0.1, 0.5, 1.0]) * ((a + b + c) / 3.0 - center);
                center -= random.real(0.0, 0.3) * light.towards(center).normalize() / frame.scale;
            }
            let half = 2f64.powf(random.real(-18.0, -1.0)) / frame.scale;
            let bounds = Bounds {
                min: center - half,
                max: center + half,
            };
            let reach = |point| frame.point_in_frame(point).abs().max_element();
            if reach(bounds.min).max(reach(bounds.max)) > 1.0 {
                continue;
            }
            // As cells are asked about.
            let center = narrow(frame.point_in_frame(bounds.center()));
            let half = narrow(bounds.size() * (0.5 * frame.scale)).map(|x| x + 0.25 * BOUND);
            let verdict = forms.verdict_of_box(center, half);
            if verdict == Verdict::Doubt {
                continue;
            }
            told[usize::from(verdict == Verdict::Inside)] += 1;
            let inside: Vec<DVec3> = (0..4).map(|_| random.in_box(&bounds)).collect();
            for point in bounds.corners().into_iter().chain(inside) {
                assert_eq!(
                    is_blocked(&occluders, point, &light),
                    verdict == Verdict::Inside,
                    "{corners:?} {light:?} {bounds:?} {point:?}"
                );
            }
        }
        assert!(told.iter().all(|&count| count > 500), "{told:?}");
    }

    #[test]
    fn boxes_that_straddle_not_lie_on_one_side_of_an_edge() {
        let random = &mut Random(4);
        let mut told = 0;
        for _ in 0..20_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let light = random.light(&scene);
            let [from, to, _] = triangle(&scene, random);
            let forms = Forms::through_light(&frame, [from, to], &light);
            let center = from + random.real(0.0, 2.0) * (random.in_box(&scene) - from);
            let half = 2f64.powf(random.real(-16.0, -3.0)) / frame.scale;
            let bounds = Bounds {
                min: center - half,
                max: center + half,
            };
            let x = frame.point_in_frame(center);
            if x.abs().max_element() > 0.8 {
                continue;
            }
            let size = bounds.size() * (0.5 * frame.scale);
            if !forms.straddles_not(narrow(x), narrow(size).map(|x| x + 0.25 * BOUND)) {
                continue;
            }
            told += 1;
            let ray = match light {
                LightShape::Point(light) => from - light,
                LightShape::Direction(direction) => direction,
            };
            let normal = ray.cross(to - from);
            let sides = bounds.corners().map(|x| normal.dot(x - from) > 0.0);
            assert_eq!(sides, [sides[0]; 8], "{from} {to} {light:?} {bounds:?}");
        }
        assert!(told > 2_000, "{told}");
    }

    #[test]
    fn starts_are_where_their_points_are() {
        let random = &mut Random(5);
        let light = LightShape::Direction(DVec3::Z);
        let (mut told, mut refused) = (0, 0);
        for _ in 0..20_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let corners = triangle(&scene, random);
            let occluders = occluders_of(corners);
            let Some(axis) = occluders.dominant_axis(ONE) else {
                continue;
            };
            let forms = Forms::of_starts(&frame, corners, axis);
            let [s, t] = [random.real(-0.1, 1.1), random.real(-0.1, 1.1)];
            let [a, b, c] = corners;
            let mut point = a + s * (b - a) + t * (c - a);
            let nudge = random.pick(&[0.0, 0.2, 0.45, 0.55, 1.0, 2.0, 5.0]);
            point[axis] += nudge * START_ROOM / frame.scale;
            let x = frame.point_in_frame(point);
            if x.abs().max_element() > 1.0 {
                continue;
            }
            let x = narrow(x);
            let is_told = dispatch!(Level::new(), simd => forms.is_start(simd, x));
            if !is_told {
                refused += 1;
                continue;
            }
            told += 1;
            let start = Start {
                point,
                surface: Some(ONE),
            };
            let segment = occluders.segment(&start, &light);
            let offset = (segment.origin() - point).abs().max_element() + segment.origin_error();
            assert!(
                offset * frame.scale <= START_ROOM,
                "{corners:?} {point:?}: {}",
                offset * frame.scale / START_ROOM
            );
            // Seen along the axis it is over the triangle.
            assert!(s > 0.0 && t > 0.0 && s + t < 1.0, "{corners:?} {s} {t}");
        }
        assert!(told > 1_000 && refused > 1_000, "{told} {refused}");
    }

    #[test]
    fn nothing_starts_nowhere() {
        for x in [[0.0; 3], [1.0; 3], [f32::NAN; 3], [f32::INFINITY; 3]] {
            let is_told = dispatch!(Level::new(), simd => Forms::NOWHERE.is_start(simd, x));
            assert!(!is_told, "{x:?}");
        }
    }
}
