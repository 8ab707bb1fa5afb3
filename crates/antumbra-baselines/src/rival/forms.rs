//! Shadow volumes and shadow polygons as linear forms with error bounds.
//!
//! In: triangles, edges, a light. Out: [`Polygon`]s: the triangle that closes a volume towards the light, and
//! the walls behind its edges, with answers "inside", "crossed" and "in doubt". Invariant: whatever is not in
//! doubt is so for the exact numbers, for all points within a [`Frame`]. Directions of light count as points at
//! infinity throughout.
//!
//! Bounds. With `u` = 2^-53, a difference of points is off by `u` of itself, and a component of a cross product
//! of vectors of largest components `A`, `B` that are off by `a`, `b` by no more than
//! `2 (A b + B a + a b) + 8 u A B`. A form is `n . (X - m) + c` with `m` the middle of the frame: with `n` off by
//! `e` a component, `R` the largest component of `X - m` and of the distance from `m` to the plane's own point,
//! it is off by less than `6 e R + 16 u |n| R`, `|n|` the sum of components, and by `|n|` times the error of the
//! start. What products lose by underflow is below [`UNDERFLOW`] as long as they have coordinates of 2^-100 and
//! more; smaller ones leave everything in doubt.

use antumbra_geometry::{Bounds, DVec3, LightShape, Segment};

const ROUNDOFF: f64 = f64::EPSILON / 2.0;
/// More than what products lose by underflow, and less than forms of all but the smallest scenes.
const UNDERFLOW: f64 = 1e-250;
/// Errors of starts that are allowed for, as shares of the scene's largest coordinate and size.
const START_ERROR: f64 = 1.0 / (1u64 << 44) as f64;

/// The points that forms are for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    bounds: Bounds,
    middle: DVec3,
    reach: f64,
    start_error: f64,
}

impl Frame {
    /// Around all of a box, and a little more.
    pub(super) fn new(bounds: Bounds) -> Self {
        let bounds = if bounds.is_empty() {
            Bounds {
                min: DVec3::ZERO,
                max: DVec3::ZERO,
            }
        } else {
            bounds
        };
        let scale = bounds.largest_coordinate() + bounds.size().max_element();
        let start_error = START_ERROR * scale;
        let bounds = bounds.inflated(DVec3::splat(4.0 * start_error));
        Self {
            bounds,
            middle: bounds.center(),
            reach: bounds.size().max_element(),
            start_error,
        }
    }

    /// Returns the box of the points.
    pub(super) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// Returns a segment's start as forms take it, `None` if forms say nothing about it.
    pub(super) fn start(&self, segment: &Segment) -> Option<DVec3> {
        let is_fine =
            segment.origin_error() <= self.start_error && self.bounds.contains(segment.origin());
        is_fine.then(|| self.seen(segment.origin()))
    }

    /// Returns a point of the box as forms take it.
    pub(super) fn seen(&self, point: DVec3) -> DVec3 {
        point - self.middle
    }
}

/// A vector, and how far off its components may be.
#[derive(Clone, Copy)]
struct Rounded {
    vector: DVec3,
    error: f64,
}

impl Rounded {
    fn difference(a: DVec3, b: DVec3) -> Self {
        let vector = a - b;
        Self {
            vector,
            error: ROUNDOFF * largest(vector),
        }
    }

    fn towards(light: &LightShape, from: DVec3) -> Self {
        match *light {
            LightShape::Point(position) => Self::difference(position, from),
            LightShape::Direction(vector) => Self { vector, error: 0.0 },
        }
    }

    fn cross(self, other: Self) -> Self {
        let (a, b) = (largest(self.vector), largest(other.vector));
        let given = a * other.error + b * self.error + self.error * other.error;
        Self {
            vector: self.vector.cross(other.vector),
            error: 2.0 * given + 8.0 * ROUNDOFF * a * b + UNDERFLOW,
        }
    }

    fn times(self, sign: f64) -> Self {
        Self {
            vector: sign * self.vector,
            ..self
        }
    }
}

fn largest(vector: DVec3) -> f64 {
    vector.abs().max_element()
}

/// A linear function of a point.
#[derive(Clone, Copy, Debug)]
struct Form {
    normal: DVec3,
    offset: f64,
    error: f64,
}

impl Form {
    /// The plane through a point.
    fn new(normal: Rounded, point: DVec3, frame: &Frame) -> Self {
        let from_point = frame.middle - point;
        let reach = frame.reach.max(largest(from_point));
        let sum = normal.vector.abs().element_sum();
        Self {
            normal: normal.vector,
            offset: normal.vector.dot(from_point),
            error: 6.0 * normal.error * reach
                + sum * (16.0 * ROUNDOFF * reach + frame.start_error)
                + UNDERFLOW,
        }
    }

    #[inline]
    fn at(&self, seen: DVec3) -> f64 {
        self.normal.dot(seen) + self.offset
    }

    /// Returns the most that the form changes within so far of a point, along each axis.
    fn change_within(&self, half: DVec3) -> f64 {
        self.normal.abs().dot(half)
    }
}

/// A part of the boundary of shadow volumes: a convex part of a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    plane: Form,
    /// Positive inside; any three, in any order.
    sides: [Form; 3],
    /// How the number of volumes changes where the plane's form turns positive.
    change: i32,
    /// The triangle that it is; [`WALL`] for walls.
    pub(super) triangle: u32,
}

/// In place of a triangle's number.
pub(super) const WALL: u32 = u32::MAX;

impl Polygon {
    /// The triangle that closes its own volume; `light_side` is its exact side, not zero.
    pub(super) fn cap(
        triangle: u32,
        corners: [DVec3; 3],
        light_side: i8,
        light: &LightShape,
        frame: &Frame,
    ) -> Self {
        let [a, b, c] = corners;
        let sign = f64::from(light_side);
        let normal = Rounded::difference(b, a).cross(Rounded::difference(c, a));
        // The third corner is on the other side of the plane through an edge and the light than the light is of
        // the triangle's.
        let side = |from: DVec3, to: DVec3| {
            let along = Rounded::difference(to, from);
            Form::new(
                along.cross(Rounded::towards(light, from)).times(-sign),
                from,
                frame,
            )
        };
        Self {
            plane: Form::new(normal.times(sign), a, frame),
            sides: [side(a, b), side(b, c), side(c, a)],
            change: -1,
            triangle,
        }
    }

    /// The wall behind an edge; `change` is by how many volumes more lie on the side of
    /// `(to - from) x (light - from)`.
    pub(super) fn wall(
        [from, to]: [DVec3; 2],
        change: i32,
        light: &LightShape,
        frame: &Frame,
    ) -> Self {
        let along = Rounded::difference(to, from);
        let [first, last] = [from, to].map(|end| Rounded::towards(light, end));
        let normal = along.cross(first);
        Self {
            plane: Form::new(normal, from, frame),
            sides: [
                Form::new(first.cross(normal), from, frame),
                Form::new(normal.cross(last), to, frame),
                Form::new(along.cross(normal), from, frame),
            ],
            change,
            triangle: WALL,
        }
    }

    /// Returns whether the volume that this triangle closes holds a start; `None` in doubt.
    #[inline]
    pub(super) fn volume_holds(&self, start: DVec3) -> Option<bool> {
        let mut is_certain = true;
        for side in &self.sides {
            let height = side.at(start);
            if height < -side.error {
                return Some(false);
            }
            is_certain &= height > side.error;
        }
        let height = self.plane.at(start);
        if height > self.plane.error {
            return Some(false);
        }
        (is_certain && height < -self.plane.error).then_some(true)
    }

    /// Returns on which side of the plane a point is: the light's for triangles; 0 in doubt.
    pub(super) fn side_of(&self, point: DVec3) -> i8 {
        let height = self.plane.at(point);
        i8::from(height > self.plane.error) - i8::from(height < -self.plane.error)
    }

    /// Returns whether a start in the plane lies well inside.
    pub(super) fn is_well_inside(&self, start: DVec3) -> bool {
        self.sides.iter().all(|side| side.at(start) > side.error)
    }

    /// Returns how many more volumes hold `start` than `reference`, by this polygon alone; `None` in doubt.
    #[inline]
    pub(super) fn crossing(&self, reference: DVec3, start: DVec3) -> Option<i32> {
        let error = self.plane.error;
        let (from, to) = (self.plane.at(reference), self.plane.at(start));
        if (from > error && to > error) || (from < -error && to < -error) {
            return Some(0);
        }
        // Where the ray goes through the plane, times the sum of both heights: what is left of a side there is
        // not crossed, also if the ray does not go through at all.
        let (from_height, to_height) = (from.abs(), to.abs());
        let mut is_inside = true;
        for side in &self.sides {
            let (first, last) = (side.at(reference), side.at(start));
            let (a, b) = (to_height * first, from_height * last);
            let bound = (from_height + to_height + 2.0 * error) * side.error
                + error * (first.abs() + last.abs())
                + 4.0 * ROUNDOFF * (a.abs() + b.abs())
                + UNDERFLOW;
            if a + b < -bound {
                return Some(0);
            }
            is_inside &= a + b > bound;
        }
        let is_through = from_height > error && to_height > error;
        (is_inside && is_through).then_some(if to > 0.0 { self.change } else { -self.change })
    }

    /// Returns whether the polygon may meet a box, given by its middle as forms take it; never `false` if it
    /// does.
    pub(super) fn may_meet(&self, middle: DVec3, half: DVec3) -> bool {
        let within = |form: &Form| form.change_within(half) * (1.0 + 1e-9) + form.error;
        self.plane.at(middle).abs() <= within(&self.plane)
            && self
                .sides
                .iter()
                .all(|side| side.at(middle) >= -within(side))
    }
}
