//! Lines on a light: where planes through a start, planes of faces and the light's own edges cross it.
//!
//! In: a plane. Out: the linear form that has it for its zeros, over the light's own coordinates, in both arithmetics.
//! Invariant: the exact form's sign at a place of the light is that of the rule's form there.

use glam::DVec3;

use crate::number::{Approximate, Exact, Number, Point4, Sign, Vector};
use crate::segment::{Plane, Segment};
use crate::{LightShape, Occluders, ReceiverPoint, Sphere};

/// A place of the light as given: a point with weight 1, or a direction with weight 0.
pub(super) type Place = (DVec3, f64);

/// A plane, or for a light without width the point where that crosses it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Trace<const K: usize> {
    /// A form of the light's own coordinates.
    Own([f64; K]),
    /// The plane through the start and two corners of a face.
    Edge([DVec3; 2]),
    /// The same through the middle of the start's own face: what decides where the start is on the edge's line.
    InnerEdge([DVec3; 2]),
    /// A plane of space, such as a face's.
    Plane(Plane),
    /// The tangent plane of a sphere at the start.
    Tangent(Sphere),
}

/// A form that may be too close to zero to tell.
#[derive(Clone, Debug)]
pub(super) struct Line<const K: usize> {
    trace: Trace<K>,
    pub(super) rough: [Approximate; K],
    exact: Option<Box<[Exact; K]>>,
}

/// A start, and the places that a light's own coordinates are measured by.
#[derive(Debug)]
pub(super) struct Eye<const K: usize> {
    pub(super) segment: Segment,
    basis: [Place; K],
    /// Whether forms are wanted as differences from the first place: the places are corners then.
    is_affine: bool,
}

impl<const K: usize> Eye<K> {
    pub(super) fn new(
        occluders: &Occluders,
        start: &ReceiverPoint,
        basis: [Place; K],
        is_affine: bool,
    ) -> Self {
        Self {
            segment: occluders.segment(start, &LightShape::Direction(DVec3::Z)),
            basis,
            is_affine,
        }
    }

    /// Makes a form.
    pub(super) fn line(&self, trace: Trace<K>) -> Line<K> {
        let start = self.segment.approximate().start;
        let mut rough = self.form::<Approximate>(&trace, &start, self.segment.inner());
        let largest = rough.iter().map(|x| x.value().abs()).fold(0.0, f64::max);
        // Powers of two round nothing; products of forms stay in range.
        if (1e-280..1e280).contains(&largest) {
            let exponent = largest.to_bits() >> 52;
            let factor = f64::from_bits((2046 - exponent) << 52);
            rough = rough.map(|x| Approximate::new(x.value() * factor, x.error() * factor));
        }
        Line {
            trace,
            rough,
            exact: None,
        }
    }

    /// Returns a form's exact numbers.
    pub(super) fn exact<'a>(&self, line: &'a mut Line<K>) -> &'a [Exact; K] {
        let trace = &line.trace;
        line.exact.get_or_insert_with(|| {
            let start = &self.segment.exact().start;
            Box::new(self.form::<Exact>(trace, start, self.segment.inner()))
        })
    }

    /// Returns whether a form is zero everywhere.
    pub(super) fn is_zero(&self, line: &mut Line<K>) -> bool {
        let is_sure = |x: &Approximate| matches!(x.sign(), Some(Sign::Negative | Sign::Positive));
        if line.rough.iter().any(is_sure) {
            return false;
        }
        let numbers = self.exact(line);
        numbers.iter().all(|x| x.sign() == Some(Sign::Zero))
    }

    /// Returns the form of an edge, by the rule for starts on its line, and whether it is seen from the start itself;
    /// `None` where there is nothing to tell.
    pub(super) fn edge(&self, ends: [DVec3; 2]) -> Option<(Line<K>, bool)> {
        let mut line = self.line(Trace::Edge(ends));
        if !self.is_zero(&mut line) {
            return Some((line, true));
        }
        self.segment.inner::<Approximate>()?;
        let mut line = self.line(Trace::InnerEdge(ends));
        (!self.is_zero(&mut line)).then_some((line, false))
    }

    /// Returns the side of a plane that the start is on, by the rule for starts in it.
    pub(super) fn side_of_start(&self, plane: &Plane) -> Sign {
        fn side<N: Number>(plane: &Plane, start: &Point4<N>) -> Option<Sign> {
            plane.height(start).sign()
        }
        let sign = crate::number::decide(side(plane, &self.segment.approximate().start), || {
            side(plane, &self.segment.exact().start)
        });
        if sign != Sign::Zero {
            return sign;
        }
        let inner = self.segment.inner::<Approximate>();
        let Some(inner) = inner else {
            return Sign::Zero;
        };
        crate::number::decide(side(plane, &inner), || {
            side(plane, &self.segment.inner::<Exact>()?)
        })
    }

    fn form<N: Number>(
        &self,
        trace: &Trace<K>,
        start: &Point4<N>,
        inner: Option<Point4<N>>,
    ) -> [N; K] {
        let places = self.basis.map(Point4::from_f64);
        let through = |from: &Point4<N>, [a, b]: [DVec3; 2]| {
            let seen = |x: DVec3| Vector::from_f64(x).scaled(&from.w).minus(&from.x);
            let normal = seen(a).cross(&seen(b));
            places.each_ref().map(|place| {
                let place = place.x.scaled(&from.w).minus(&from.x.scaled(&place.w));
                place.dot(&normal)
            })
        };
        let values = match *trace {
            Trace::Own(numbers) => return numbers.map(N::from_f64),
            Trace::Edge(ends) => through(start, ends),
            Trace::InnerEdge(ends) => through(&inner.unwrap_or_else(|| start.clone()), ends),
            Trace::Plane(plane) => places.each_ref().map(|place| plane.height(place)),
            Trace::Tangent(sphere) => {
                let center = Vector::from_f64(sphere.center);
                let radial = Vector::from_f64(self.segment.start().point).minus(&center);
                let radius = N::from_f64(sphere.radius);
                let square = radius.times(&radius);
                places.each_ref().map(|place| {
                    let along = radial.dot(&place.seen_from(&center));
                    along.minus(&square.times(&place.w))
                })
            }
        };
        if self.is_affine {
            let first = values[0].clone();
            let mut number = 0;
            return values.map(|value| {
                number += 1;
                if number == 1 {
                    value
                } else {
                    value.minus(&first)
                }
            });
        }
        values
    }
}
