//! The forms of spheres, disks and tubes along a segment.
//!
//! In: a curved shape, a segment, a light. Out: the forms of EXACTNESS.md ("Which surfaces block") as quadratic functions of
//! the place on the segment. Invariant: none has a higher degree, so the same code gives them in both arithmetics.
//!
//! A sphere, the ball around a disk and the infinite cone of a tube are all where `across . across` is less than
//! `reach reach`, for a vector and a number that are linear in the point. So one polar form serves all.

use glam::DVec3;

use super::quadratic::Quadratic;
use super::refined::Refined;
use crate::intersect::near_one;
use crate::number::{Exact, Number, Vector};
use crate::occluders::RoundShape;

/// A plane of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Plane {
    /// Of a disk, or at the base of a tube.
    Base,
    /// At the apex of a tube.
    Apex,
}

/// A point that moves with the place on the segment, or stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The place itself.
    Start,
    /// The light.
    Light,
    /// The point of the line through both in a plane, times `h(L)`: its weight is above zero where that is, and the start is
    /// on the other side.
    At(Plane),
    /// The direction from the start to the light.
    Direction,
}

/// One of a shape's forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CurvedForm {
    /// The height of the start over a plane, towards the middle of a tube.
    Height(Plane),
    /// That of the light.
    LightHeight(Plane),
    /// The polar form of two points.
    Product(End, End),
    /// Above zero where the line through start and light goes in and out.
    Discriminant,
}

/// Numbers that are made of lengths.
pub(super) trait Measured: Number {
    /// Returns `to - from`, times a power of two or not: all lengths alike.
    fn length(to: f64, from: f64, scale: f64) -> Self;
}

impl Measured for Exact {
    fn length(to: f64, from: f64, _: f64) -> Self {
        Self::from_f64(to).minus(&Self::from_f64(from))
    }
}

impl Measured for Refined {
    fn length(to: f64, from: f64, scale: f64) -> Self {
        Self::scaled_difference(to, from, scale)
    }
}

fn vector<N: Measured>(to: DVec3, from: DVec3, scale: f64) -> Vector<N> {
    Vector([0, 1, 2].map(|axis: usize| N::length(to[axis], from[axis], scale)))
}

/// A homogeneous point as a shape sees it; all are linear in it.
#[derive(Clone, Debug)]
struct Point<N> {
    across: Vector<N>,
    weight: N,
    /// Over the base plane.
    height: N,
    reach: N,
}

impl<N: Number> Point<N> {
    /// Returns `u self - v other`.
    fn minus(&self, u: &N, other: &Self, v: &N) -> Self {
        let number = |own: &N, its: &N| own.times(u).minus(&its.times(v));
        Self {
            across: self.across.scaled(u).minus(&other.across.scaled(v)),
            weight: number(&self.weight, &other.weight),
            height: number(&self.height, &other.height),
            reach: number(&self.reach, &other.reach),
        }
    }
}

/// A shape with a segment and a light.
#[derive(Clone, Debug)]
pub(super) struct Quadric<N> {
    /// The segment's ends.
    starts: [Point<N>; 2],
    light: Point<N>,
    /// The squared length of a tube's axis.
    axis_squared: Option<N>,
}

/// What lengths are to be multiplied with: powers of two.
#[derive(Clone, Copy)]
struct Scales {
    place: f64,
    /// Of a direction of light, and of a disk's normal.
    direction: f64,
    normal: f64,
}

impl<N: Measured> Quadric<N> {
    /// Looks at a segment and a light, a homogeneous point.
    pub(super) fn new(
        shape: &RoundShape,
        points: [DVec3; 2],
        (light, weight): (DVec3, f64),
    ) -> Self {
        let (origin, sizes) = match shape {
            RoundShape::Ball(sphere) => (sphere.center, [sphere.radius, 0.0]),
            RoundShape::Disk(disk) => (disk.center, [disk.radius, 0.0]),
            RoundShape::Tube(cone) => {
                let length = largest(cone.apex - cone.base);
                (cone.base, [length, cone.base_radius.max(cone.apex_radius)])
            }
        };
        let is_direction = weight == 0.0;
        let seen = points.map(|point| largest(point - origin));
        let to_light = if is_direction {
            0.0
        } else {
            largest(light - origin)
        };
        let size = seen.into_iter().chain(sizes).fold(to_light, f64::max);
        let normal = match shape {
            RoundShape::Disk(disk) => disk.normal(),
            RoundShape::Ball(_) | RoundShape::Tube(_) => DVec3::ONE,
        };
        let scales = Scales {
            place: near_one(size),
            direction: near_one(largest(light)),
            normal: near_one(largest(normal)),
        };
        let [first, last] = points.map(|point| vector(point, origin, scales.place));
        let towards = if is_direction {
            vector(light, DVec3::ZERO, scales.direction)
        } else {
            vector(light, origin, scales.place)
        };
        let length = |value: f64| N::length(value, 0.0, scales.place);
        let one = N::from_f64(1.0);
        let seen = [
            (first, one.clone()),
            (last, one),
            (towards, N::from_f64(weight)),
        ];
        let mut axis_squared = None;
        let [first, last, light] = match shape {
            RoundShape::Ball(sphere) => {
                let radius = length(sphere.radius);
                seen.map(|(across, weight)| Point {
                    reach: radius.times(&weight),
                    height: N::from_f64(0.0),
                    across,
                    weight,
                })
            }
            RoundShape::Disk(disk) => {
                let normal = vector(disk.normal_tip, disk.normal_tail, scales.normal);
                let radius = length(disk.radius);
                seen.map(|(across, weight)| Point {
                    reach: radius.times(&weight),
                    height: normal.dot(&across),
                    across,
                    weight,
                })
            }
            RoundShape::Tube(cone) => {
                let axis: Vector<N> = vector(cone.apex, cone.base, scales.place);
                let squared = axis.dot(&axis);
                let base_reach = length(cone.base_radius).times(&squared);
                let widening = N::length(cone.apex_radius, cone.base_radius, scales.place);
                axis_squared = Some(squared);
                seen.map(|(across, weight)| {
                    let height = across.dot(&axis);
                    let reach = base_reach.times(&weight).plus(&widening.times(&height));
                    Point {
                        across,
                        weight,
                        height,
                        reach,
                    }
                })
            }
        };
        Self {
            starts: [first, last],
            light,
            axis_squared,
        }
    }

    /// Returns a form; `Product(Start, Light)` and heights are linear.
    pub(super) fn form(&self, form: CurvedForm) -> Quadratic<N> {
        let [first, last] = &self.starts;
        match form {
            CurvedForm::Height(plane) => {
                Quadratic::linear(self.height(plane, first), self.height(plane, last))
            }
            CurvedForm::LightHeight(plane) => constant(self.height(plane, &self.light)),
            CurvedForm::Product(End::Light, End::Light) => {
                constant(self.polar(&self.light, &self.light))
            }
            CurvedForm::Product(End::Start, End::Light) => Quadratic::linear(
                self.polar(first, &self.light),
                self.polar(last, &self.light),
            ),
            CurvedForm::Product(one, other) if one == other => {
                let [first, last] = self.points(one);
                Quadratic {
                    first: self.polar(&first, &first),
                    middle: Some(self.polar(&first, &last)),
                    last: self.polar(&last, &last),
                }
            }
            CurvedForm::Product(one, other) => {
                let [first, last] = self.points(one);
                let [other_first, other_last] = self.points(other);
                let middle = self
                    .polar(&first, &other_last)
                    .plus(&self.polar(&last, &other_first));
                let [first, last] = [
                    self.polar(&first, &other_first),
                    self.polar(&last, &other_last),
                ];
                Quadratic {
                    first: first.plus(&first),
                    middle: Some(middle),
                    last: last.plus(&last),
                }
            }
            CurvedForm::Discriminant => {
                let light = self.polar(&self.light, &self.light);
                let [side, last_side] = [first, last].map(|end| self.polar(end, &self.light));
                let form = |one: &N, other: &N, x: &Point<N>, y: &Point<N>| {
                    one.times(other).minus(&self.polar(x, y).times(&light))
                };
                Quadratic {
                    first: form(&side, &side, first, first),
                    middle: Some(form(&side, &last_side, first, last)),
                    last: form(&last_side, &last_side, last, last),
                }
            }
        }
    }

    /// Returns the points that an end is at both ends of the segment.
    fn points(&self, end: End) -> [Point<N>; 2] {
        let (starts, light) = (self.starts.each_ref(), &self.light);
        match end {
            End::Start => self.starts.clone(),
            End::Light => [light.clone(), light.clone()],
            End::At(plane) => {
                let light_height = self.height(plane, light);
                starts.map(|start| start.minus(&light_height, light, &self.height(plane, start)))
            }
            End::Direction => starts.map(|start| light.minus(&start.weight, start, &light.weight)),
        }
    }

    fn height(&self, plane: Plane, point: &Point<N>) -> N {
        match (plane, &self.axis_squared) {
            (Plane::Apex, Some(squared)) => squared.times(&point.weight).minus(&point.height),
            _ => point.height.clone(),
        }
    }

    fn polar(&self, one: &Point<N>, other: &Point<N>) -> N {
        let product = one.across.dot(&other.across);
        let product = match &self.axis_squared {
            None => product,
            Some(squared) => {
                let heights = one.height.times(&other.height);
                squared.times(&squared.times(&product).minus(&heights))
            }
        };
        product.minus(&one.reach.times(&other.reach))
    }
}

fn constant<N: Number>(value: N) -> Quadratic<N> {
    Quadratic::linear(value.clone(), value)
}

fn largest(vector: DVec3) -> f64 {
    vector.abs().max_element()
}
