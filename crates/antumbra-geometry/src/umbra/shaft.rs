//! The hull of a box and a light, as half-spaces.

use glam::DVec3;

use crate::number::UNIT_ROUNDOFF;
use crate::segment::Segment;
use crate::{Bounds, LightShape, ReceiverPoint};

/// The union of all segments from a box, or from a polygon, to a light.
///
/// Held as the planes of its faces, with the shaft on their negative side: for a box its faces that
/// do not see the light, and one plane through the light for each silhouette edge.
#[derive(Clone, Debug)]
pub struct Shaft {
    pub(crate) bounds: Bounds,
    pub(crate) light: LightShape,
    planes: [SidePlane; MAX_PLANES],
    plane_count: usize,
    /// The corners of the box or the polygon.
    corners: [DVec3; MAX_CORNERS],
    corner_count: usize,
}

/// At most six silhouette edges of a box, and three faces turned away from the light; a light inside
/// the slabs of the box leaves up to six faces. A polygon has its plane and one a corner.
const MAX_PLANES: usize = 12;

/// A triangle cut by a box has nine corners at most.
pub(crate) const MAX_CORNERS: usize = 9;

/// A plane through a point, with a bound on the rounding of its normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SidePlane {
    normal: DVec3,
    point: DVec3,
    /// Largest error of a height, per unit of distance from `point`.
    error: f64,
    /// Heights up to this one count as below the plane: what lies on it may be off by as much.
    limit: f64,
}

/// More than products of lengths lose that underflow.
const UNDERFLOW: f64 = 1e-280;

impl SidePlane {
    pub(crate) const NONE: Self = Self {
        normal: DVec3::ZERO,
        point: DVec3::ZERO,
        error: 0.0,
        limit: 0.0,
    };

    /// The plane through the light and the points `a` and `b`.
    pub(crate) fn through_light(light: &LightShape, a: DVec3, b: DVec3) -> Self {
        let from_light = match *light {
            LightShape::Point(position) => a - position,
            // From infinity light comes along minus its direction; the sign does not matter more
            // than it does for points: both give planes turned the same way.
            LightShape::Direction(direction) => -direction,
        };
        Self::spanned(from_light, b - a, a)
    }

    /// The plane through `point` spanned by two vectors.
    pub(crate) fn spanned(u: DVec3, v: DVec3, point: DVec3) -> Self {
        // Two rounded differences and a cross product: 5 roundings on products of sum at most
        // 2 |u| |v| a component, 6 |u| |v| in all; the height adds three more.
        let error = 64.0 * UNIT_ROUNDOFF * u.abs().max_element() * v.abs().max_element();
        Self {
            normal: u.cross(v),
            point,
            error,
            limit: 0.0,
        }
    }

    /// The plane through `point` with exactly this normal.
    pub(crate) fn with_normal(normal: DVec3, point: DVec3) -> Self {
        let error = 16.0 * UNIT_ROUNDOFF * normal.abs().max_element();
        Self {
            normal,
            point,
            error,
            limit: 0.0,
        }
    }

    fn axis_aligned(axis: usize, sign: f64, point: DVec3) -> Self {
        let mut normal = DVec3::ZERO;
        normal[axis] = sign;
        Self {
            normal,
            point,
            error: 8.0 * UNIT_ROUNDOFF,
            limit: 0.0,
        }
    }

    pub(crate) fn flipped(self) -> Self {
        Self {
            normal: -self.normal,
            ..self
        }
    }

    /// Returns the plane with a limit below which heights count as negative.
    pub(crate) fn with_limit(self, limit: f64) -> Self {
        Self { limit, ..self }
    }

    /// Returns by how much heights change when a point moves by `distance` along every axis.
    pub(crate) fn steepness(&self, distance: f64) -> f64 {
        self.normal.abs().element_sum() * distance
    }

    /// Returns the height of a point and a bound on its error.
    pub(crate) fn height(&self, x: DVec3) -> (f64, f64) {
        let seen = x - self.point;
        let error = self.error * seen.abs().max_element() + UNDERFLOW;
        (self.normal.dot(seen), error)
    }

    /// Returns how fast a ray gains height, and a bound on the error.
    pub(crate) fn height_of_direction(&self, direction: DVec3) -> (f64, f64) {
        (
            self.normal.dot(direction),
            self.error * direction.abs().max_element(),
        )
    }

    /// Returns whether the point is surely on the positive side.
    pub(crate) fn is_above(&self, x: DVec3) -> bool {
        let (height, error) = self.height(x);
        height > error + self.limit
    }

    /// Returns lower and upper bounds of the heights of the points of a box.
    pub(crate) fn range(&self, bounds: &Bounds) -> (f64, f64) {
        let half = 0.5 * bounds.size();
        let seen = bounds.center() - self.point;
        let middle = self.normal.dot(seen);
        let reach = half.dot(self.normal.abs());
        let error = self.error * (seen.abs().max_element() + half.max_element());
        (middle - reach - error, middle + reach + error)
    }

    /// Returns whether the ball is surely on the positive side.
    pub(crate) fn is_ball_above(&self, center: DVec3, radius: f64) -> bool {
        let (height, error) = self.height(center);
        height > error + self.limit + radius * (self.normal.length() + self.error)
    }

    /// Returns whether a flat disk with unit normal `axis` is surely on the positive side.
    pub(crate) fn is_disk_above(&self, center: DVec3, axis: DVec3, radius: f64) -> bool {
        let (height, error) = self.height(center);
        let in_plane = self.normal - axis * axis.dot(self.normal);
        let reach = in_plane.length() + self.error + 8.0 * UNIT_ROUNDOFF * self.normal.length();
        height > error + self.limit + radius * reach
    }
}

impl Shaft {
    /// Returns the shaft of a box, which the caller has inflated by its margin of safety.
    pub fn new(bounds: Bounds, light: LightShape) -> Self {
        let light = light.without_underflow();
        let mut shaft = Self {
            bounds,
            light,
            planes: [SidePlane::NONE; MAX_PLANES],
            plane_count: 0,
            corners: [DVec3::ZERO; MAX_CORNERS],
            corner_count: 8,
        };
        shaft.corners[..8].copy_from_slice(&bounds.corners());
        // For each axis: does the face at the lower and at the upper end see the light?
        let mut sees = [[false; 2]; 3];
        for axis in 0..3 {
            sees[axis] = match light {
                LightShape::Point(position) => [
                    position[axis] < bounds.min[axis],
                    position[axis] > bounds.max[axis],
                ],
                LightShape::Direction(direction) => [direction[axis] < 0.0, direction[axis] > 0.0],
            };
            // Blind faces bound the shaft.
            if !sees[axis][0] {
                shaft.push(SidePlane::axis_aligned(axis, -1.0, bounds.min));
            }
            if !sees[axis][1] {
                shaft.push(SidePlane::axis_aligned(axis, 1.0, bounds.max));
            }
        }
        // A silhouette edge lies between a face that sees the light and one that does not.
        let center = bounds.center();
        for axis in 0..3 {
            let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
            for corner in 0..4 {
                let (at_j, at_k) = (corner & 1, corner >> 1);
                if sees[j][at_j] == sees[k][at_k] {
                    continue;
                }
                let mut from = bounds.min;
                from[j] = [bounds.min[j], bounds.max[j]][at_j];
                from[k] = [bounds.min[k], bounds.max[k]][at_k];
                let mut to = from;
                to[axis] = bounds.max[axis];
                let plane = SidePlane::through_light(&light, from, to);
                shaft.push(if plane.height(center).0 > 0.0 {
                    plane.flipped()
                } else {
                    plane
                });
            }
        }
        shaft
    }

    /// Returns the shaft of a polygon with these corners, below all of `planes`. The light is one
    /// that [`LightShape::without_underflow`] gave.
    pub(crate) fn of_polygon(
        corners: &[DVec3],
        planes: impl IntoIterator<Item = SidePlane>,
        light: LightShape,
    ) -> Self {
        let mut shaft = Self {
            bounds: Bounds::of_points(corners.iter().copied()),
            light,
            planes: [SidePlane::NONE; MAX_PLANES],
            plane_count: 0,
            corners: [DVec3::ZERO; MAX_CORNERS],
            corner_count: corners.len(),
        };
        shaft.corners[..corners.len()].copy_from_slice(corners);
        planes.into_iter().for_each(|plane| shaft.push(plane));
        shaft
    }

    fn push(&mut self, plane: SidePlane) {
        if self.plane_count < MAX_PLANES {
            self.planes[self.plane_count] = plane;
            self.plane_count += 1;
        }
    }

    /// Returns planes that the shaft lies behind: an outward normal with largest component 1 and a point of
    /// each. Heights over them err by less than 2^-24 of the distance from that point; planes that are not
    /// known so well are left out.
    pub fn outer_planes(&self) -> impl Iterator<Item = (DVec3, DVec3)> + use<'_> {
        self.planes().iter().filter_map(|plane| {
            let size = plane.normal.abs().max_element();
            // A limit is beside an error, and boxes have none.
            let is_known = plane.limit == 0.0 && plane.error < size / f64::from(1u32 << 25);
            is_known.then(|| (plane.normal / size, plane.point))
        })
    }

    pub(crate) fn planes(&self) -> &[SidePlane] {
        &self.planes[..self.plane_count]
    }

    /// Returns whether the shaft surely misses all points of a convex set, given a test whether the
    /// set lies above a plane.
    pub(crate) fn misses(&self, is_above: impl Fn(&SidePlane) -> bool) -> bool {
        self.planes().iter().any(is_above)
    }

    /// Returns the corners of the box, or of the polygon.
    pub(crate) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.corner_count]
    }

    /// Returns the segments from the corners of the box, or of the polygon, to the light.
    pub(crate) fn corner_segments(&self) -> impl Iterator<Item = Segment> + use<'_> {
        self.corners[..self.corner_count]
            .iter()
            .map(|&corner| self.segment_from(corner))
    }

    /// Returns whether the shaft surely misses a box, which the caller has by rounding only.
    pub fn misses_box(&self, bounds: &Bounds) -> bool {
        self.misses(|plane| plane.range(bounds).0 > plane.limit + UNDERFLOW)
    }

    /// Returns whether the shaft surely misses the segment between two points.
    pub fn misses_edge(&self, ends: &[DVec3; 2]) -> bool {
        self.misses(|plane| ends.iter().all(|&end| plane.is_above(end)))
    }

    /// Returns whether the shaft surely misses a triangle.
    pub fn misses_triangle(&self, corners: &[DVec3; 3]) -> bool {
        self.misses(|plane| corners.iter().all(|&corner| plane.is_above(corner)))
    }

    /// Returns the segment from a point of space to the light.
    pub(crate) fn segment_from(&self, point: DVec3) -> Segment {
        Segment::new(
            ReceiverPoint {
                point,
                surface: None,
            },
            &self.light,
            None,
        )
    }
}
