//! Triangles and disks.

use super::{Light, Segment, Start};
use crate::exact::{Exact, Vec3};

/// The plane of the points `x` with `normal . x = offset`.
#[derive(Debug)]
pub(super) struct Plane {
    normal: Vec3,
    offset: Exact,
    /// The axis of the largest component of the normal, the lowest on ties.
    axis: usize,
}

/// A point with rational coordinates `scaled / scale`, `scale > 0`.
#[derive(Clone)]
struct Crossing {
    scaled: Vec3,
    scale: Exact,
}

impl Plane {
    fn new(normal: Vec3, point: &Vec3) -> Option<Self> {
        if normal.is_zero() {
            return None;
        }
        let offset = normal.dot(point);
        let mut axis = 0;
        for k in 1..3 {
            if normal.0[k].abs().compare(&normal.0[axis].abs()).is_gt() {
                axis = k;
            }
        }
        Some(Self {
            normal,
            offset,
            axis,
        })
    }

    /// The point of the plane that agrees with `point` in the two axes that are not the plane's
    /// own: solve `normal . x = offset` for the third coordinate.
    pub(super) fn start(&self, point: Vec3) -> Start {
        let missing = &self.offset - &self.normal.dot(&point);
        if missing.is_zero() {
            return Start {
                scaled: point,
                scale: Exact::ONE,
            };
        }
        // x_k = p_k + missing / n_k
        let pivot = &self.normal.0[self.axis];
        let scale = pivot.abs();
        let step = if pivot.sign() < 0 { -&missing } else { missing };
        let mut scaled = point.scale(&scale);
        scaled.0[self.axis] = &scaled.0[self.axis] + &step;
        Start { scaled, scale }
    }

    pub(super) fn side_of_light(&self, light: &Light) -> i8 {
        let offset = if light.is_direction() {
            &Exact::ZERO
        } else {
            &self.offset
        };
        (&self.normal.dot(&light.position) - offset).sign()
    }

    /// The part of a polygon in the closed half-space on the given side.
    fn clip(&self, polygon: Vec<Crossing>, side: i8) -> Vec<Crossing> {
        let height = |x: &Crossing| {
            let height = &self.normal.dot(&x.scaled) - &(&self.offset * &x.scale);
            if side < 0 { -&height } else { height }
        };
        let mut part = Vec::new();
        for (i, from) in polygon.iter().enumerate() {
            let to = &polygon[(i + 1) % polygon.len()];
            let (start, end) = (height(from), height(to));
            if start.sign() >= 0 {
                part.push(from.clone());
            }
            if start.sign() * end.sign() < 0 {
                let (start, end) = (start.abs(), end.abs());
                part.push(Crossing {
                    scaled: &from.scaled.scale(&end) + &to.scaled.scale(&start),
                    scale: &from.scale * &end + &to.scale * &start,
                });
            }
        }
        part
    }

    /// Where the open segment goes through the plane from one strict side to the other.
    fn crossing(&self, segment: &Segment) -> Option<Crossing> {
        // The height over the plane, times scale and |normal|, is `height + v rate`.
        let Segment {
            start,
            delta,
            light,
        } = segment;
        let height = &self.normal.dot(&start.scaled) - &(&self.offset * &start.scale);
        if height.is_zero() {
            return None;
        }
        let rate = self.normal.dot(delta);
        let end = if light.is_direction() {
            rate.clone()
        } else {
            &height + &rate
        };
        if height.sign() * end.sign() >= 0 {
            return None;
        }
        // v = -height / rate, put into scale x(v) = start.scaled + v delta.
        let (toward, away) = if rate.sign() < 0 {
            (height, -&rate)
        } else {
            (-&height, rate)
        };
        Some(Crossing {
            scaled: &start.scaled.scale(&away) + &delta.scale(&toward),
            scale: &start.scale * &away,
        })
    }
}

/// A triangle of non-zero area.
#[derive(Debug)]
pub(super) struct Triangle {
    corners: [Vec3; 3],
    pub(super) plane: Plane,
}

impl Triangle {
    pub(super) fn new(corners: [[f64; 3]; 3]) -> Option<Self> {
        let corners = corners.map(Vec3::new);
        let normal = (&corners[1] - &corners[0]).cross(&(&corners[2] - &corners[0]));
        let plane = Plane::new(normal, &corners[0])?;
        Some(Self { corners, plane })
    }

    /// Rules 2 and 3: the segment goes through the plane, at a point of the closed triangle.
    pub(super) fn is_crossed(&self, segment: &Segment) -> bool {
        let Some(crossing) = self.plane.crossing(segment) else {
            return false;
        };
        // In the coordinate plane where the triangle looks largest, the point must lie to the
        // left of every edge of the triangle (to its right if the projection turns it over).
        let (i, j) = ((self.plane.axis + 1) % 3, (self.plane.axis + 2) % 3);
        let turn = self.plane.normal.0[self.plane.axis].sign();
        self.edges().all(|(from, to, _)| {
            let edge = to - from;
            let to_point = &crossing.scaled - &from.scale(&crossing.scale);
            let area = &edge.0[i] * &to_point.0[j] - &edge.0[j] * &to_point.0[i];
            area.sign() * turn >= 0
        })
    }

    /// Rule 4, for `self` the triangle of the start: whether it and the part of `other` that is on
    /// the light's side of its plane overlap seen from the light. Always so when the light is in
    /// the plane of `self`.
    pub(super) fn may_be_hidden_by(&self, other: &Self, segment: &Segment) -> bool {
        let light = &segment.light;
        let side = self.plane.side_of_light(light);
        if side == 0 {
            return true;
        }
        let whole = |triangle: &Self| {
            triangle
                .corners
                .clone()
                .map(|scaled| Crossing {
                    scaled,
                    scale: Exact::ONE,
                })
                .to_vec()
        };
        let own = whole(self);
        let part = self.plane.clip(whole(other), side);
        part.len() >= 3
            && !has_edge_separating(&own, &part, light)
            && !has_edge_separating(&part, &own, light)
    }

    /// The edges, each with the corner opposite to it.
    fn edges(&self) -> impl Iterator<Item = (&Vec3, &Vec3, &Vec3)> {
        (0..3).map(|i| {
            (
                &self.corners[i],
                &self.corners[(i + 1) % 3],
                &self.corners[(i + 2) % 3],
            )
        })
    }
}

/// Whether the plane through the light and an edge of `one` has it on one side and `other` on
/// the opposite one, both weakly.
fn has_edge_separating(one: &[Crossing], other: &[Crossing], light: &Light) -> bool {
    (0..one.len()).any(|i| {
        let (from, to) = (&one[i], &one[(i + 1) % one.len()]);
        let turn = |x: &Crossing| turn_seen_from(light, from, to, x);
        let inner = one.iter().map(turn).find(|&turn| turn != 0).unwrap_or(0);
        other.iter().all(|x| turn(x) * inner <= 0)
    })
}

/// Which way `a`, `b`, `c` turn seen from the light: the sign of the volume they span with it.
fn turn_seen_from(light: &Light, a: &Crossing, b: &Crossing, c: &Crossing) -> i8 {
    if light.is_direction() {
        let from_a = |x: &Crossing| &x.scaled.scale(&a.scale) - &a.scaled.scale(&x.scale);
        from_a(b).cross(&from_a(c)).dot(&light.position).sign()
    } else {
        let [a, b, c] = [a, b, c].map(|x| &x.scaled - &light.position.scale(&x.scale));
        a.dot(&b.cross(&c)).sign()
    }
}

/// A disk with a normal and a radius that are not zero.
#[derive(Debug)]
pub(super) struct Disk {
    center: Vec3,
    radius: Exact,
    pub(super) plane: Plane,
}

impl Disk {
    pub(super) fn new(center: Vec3, normal: Vec3, radius: f64) -> Option<Self> {
        assert!(
            radius >= 0.0,
            "the radius of a disk must not be negative, but is {radius}"
        );
        let plane = Plane::new(normal, &center)?;
        (radius > 0.0).then(|| Self {
            center,
            radius: Exact::new(radius),
            plane,
        })
    }

    pub(super) fn is_crossed(&self, segment: &Segment) -> bool {
        let Some(crossing) = self.plane.crossing(segment) else {
            return false;
        };
        let from_center = &crossing.scaled - &self.center.scale(&crossing.scale);
        let reach = &self.radius * &crossing.scale;
        from_center.norm_squared().compare(&reach.square()).is_le()
    }
}
