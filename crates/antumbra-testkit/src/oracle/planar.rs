//! Triangles and disks.

use super::{Light, ReceiverPoint, Segment};
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
    pub(super) fn start(&self, point: Vec3) -> ReceiverPoint {
        let missing = &self.offset - &self.normal.dot(&point);
        if missing.is_zero() {
            return ReceiverPoint {
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
        ReceiverPoint { scaled, scale }
    }

    pub(super) fn side_of_light(&self, light: &Light) -> i8 {
        let offset = if light.is_direction() {
            &Exact::ZERO
        } else {
            &self.offset
        };
        (&self.normal.dot(&light.position) - offset).sign()
    }

    /// Whether the start lies in the plane.
    fn holds_start(&self, segment: &Segment) -> bool {
        let start = &segment.start;
        (&self.normal.dot(&start.scaled) - &(&self.offset * &start.scale)).is_zero()
    }

    /// Where the open segment goes through the plane from one strict side to the other.
    fn crossing(&self, segment: &Segment) -> Option<Crossing> {
        // The height over the plane, times scale and |normal|, is `height + v rate`.
        let Segment {
            start,
            delta,
            light,
            ..
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

    /// Rules 2 and 3: the segment goes through the plane, at a point of the closed triangle; where
    /// the start itself lies in the plane, or the line meets an edge, a start a little further
    /// inside its own triangle decides.
    pub(super) fn is_crossed(&self, segment: &Segment) -> bool {
        let turns = self.turns_at_crossing(segment);
        let is_tied = match &turns {
            Some(turns) => turns.contains(&0) && !turns.contains(&-1),
            None => self.plane.holds_start(segment),
        };
        match segment.nudged() {
            Some(nudged) if is_tied => self
                .turns_at_crossing(&nudged)
                .is_some_and(|turns| !turns.contains(&-1)),
            _ => turns.is_some_and(|turns| !turns.contains(&-1)),
        }
    }

    /// Whether light is filtered here: the segment crosses the triangle, and where it meets an edge, a start moved by next to
    /// nothing crosses the inside.
    pub(super) fn is_pierced(&self, segment: &Segment) -> bool {
        if !self.is_crossed(segment) {
            return false;
        }
        let pierces = |segment: &Segment| {
            let turns = self.turns_at_crossing(segment);
            turns
                .filter(|turns| !turns.contains(&0))
                .map(|turns| !turns.contains(&-1))
        };
        let inside = || segment.nudged().and_then(|nudged| pierces(&nudged));
        let moved = || match segment.nudged() {
            Some(nudged) => pierces(&nudged.moved()),
            None => pierces(&segment.moved()),
        };
        pierces(segment)
            .or_else(inside)
            .or_else(moved)
            .unwrap_or(false)
    }

    /// Where the segment goes through the plane: to which side of each edge, seen in the coordinate
    /// plane where the triangle looks largest.
    fn turns_at_crossing(&self, segment: &Segment) -> Option<Vec<i8>> {
        let crossing = self.plane.crossing(segment)?;
        let turn = |(from, to): (&Vec3, &Vec3)| {
            let to_point = &crossing.scaled - &from.scale(&crossing.scale);
            self.turn(&(to - from), &to_point)
        };
        Some(self.edges().map(turn).collect())
    }

    /// The height of the start, and on which side of the planes through the light and the edges it is.
    pub(super) fn decisive(&self, segment: &Segment) -> Vec<Exact> {
        let (start, light) = (&segment.start.scaled, &segment.light);
        let side = |(from, to): (&Vec3, &Vec3)| {
            let towards = &light.position - &from.scale(&light.weight);
            towards.cross(&(to - from)).dot(&(start - from))
        };
        let height = &self.plane.normal.dot(start) - &self.plane.offset;
        self.edges().map(side).chain([height]).collect()
    }

    /// Three times the middle of the corners.
    pub(super) fn three_centroids(&self) -> Vec3 {
        let [a, b, c] = &self.corners;
        &(a + b) + c
    }

    /// The point of the closed triangle nearest to `point`, seen along the plane's own axis.
    ///
    /// The outside of a convex figure is divided among its corners (both edges lead away from
    /// `point`) and its edges (`point` is beyond the edge and between the ends of it).
    pub(super) fn start(&self, point: Vec3) -> ReceiverPoint {
        let (i, j) = self.axes_seen();
        let dot = |x: &Vec3, y: &Vec3| &x.0[i] * &y.0[i] + &x.0[j] * &y.0[j];
        let is_outside = |(from, to): (&Vec3, &Vec3)| self.turn(&(to - from), &(&point - from)) < 0;
        if !self.edges().any(is_outside) {
            return self.plane.start(point);
        }
        for k in 0..3 {
            let [corner, next, last] = [0, 1, 2].map(|step| &self.corners[(k + step) % 3]);
            let to_point = &point - corner;
            let leads_away = |end: &Vec3| dot(&(end - corner), &to_point).sign() <= 0;
            if leads_away(next) && leads_away(last) {
                return ReceiverPoint {
                    scaled: corner.clone(),
                    scale: Exact::ONE,
                };
            }
        }
        for (from, to) in self.edges().filter(|&edge| is_outside(edge)) {
            let edge = to - from;
            let (along, scale) = (dot(&edge, &(&point - from)), dot(&edge, &edge));
            if along.sign() > 0 && along.compare(&scale).is_lt() {
                return ReceiverPoint {
                    scaled: &from.scale(&scale) + &edge.scale(&along),
                    scale,
                };
            }
        }
        unreachable!("a point outside a triangle is nearest to a corner or to an edge of it")
    }

    /// The two axes in which the triangle is seen along its plane's own axis.
    fn axes_seen(&self) -> (usize, usize) {
        ((self.plane.axis + 1) % 3, (self.plane.axis + 2) % 3)
    }

    /// Whether `x` is to the left of an edge's direction (1), to its right (-1) or neither (0),
    /// seen from the side from which the corners go round to the left.
    fn turn(&self, edge: &Vec3, x: &Vec3) -> i8 {
        let (i, j) = self.axes_seen();
        let area = &edge.0[i] * &x.0[j] - &edge.0[j] * &x.0[i];
        area.sign() * self.plane.normal.0[self.plane.axis].sign()
    }

    /// The edges, in the order of the corners.
    fn edges(&self) -> impl Iterator<Item = (&Vec3, &Vec3)> {
        (0..3).map(|i| (&self.corners[i], &self.corners[(i + 1) % 3]))
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

    /// The height of the start, and by how much the crossing with the plane is beyond the rim.
    pub(super) fn decisive(&self, segment: &Segment) -> Vec<Exact> {
        let (start, delta) = (&segment.start.scaled, &segment.delta);
        let height = &self.plane.normal.dot(start) - &self.plane.offset;
        let rate = self.plane.normal.dot(delta);
        // rate (start - height / rate delta - center)
        let from_center = &(start - &self.center).scale(&rate) - &delta.scale(&height);
        let reach = &self.radius * &rate;
        let beyond = &from_center.norm_squared() - &reach.square();
        vec![height, beyond]
    }
}
