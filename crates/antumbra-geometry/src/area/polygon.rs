//! A convex polygon of light.

use glam::DVec3;

use super::{AreaError, AreaSample, Emitter, check_point, mesh::Fan};

/// How far a corner may lie off the plane, as a share of the polygon's extent: what `f32` corners may have lost.
const FLAT: f64 = 1e-5;

/// A convex, flat polygon. Its front is the side from which its corners wind counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PolygonLight {
    corners: Vec<DVec3>,
    fan: Fan,
    plane: Emitter,
}

impl PolygonLight {
    /// Makes a polygon from its corners in order, world space. Corners may lie on straight edges.
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, there are fewer than three corners or no area, or the polygon is
    /// not convex or not flat.
    pub fn new(corners: Vec<DVec3>, is_two_sided: bool) -> Result<Self, AreaError> {
        corners
            .iter()
            .try_for_each(|&corner| check_point(corner, "a corner"))?;
        let [first, .., _, _] = corners[..] else {
            return Err(AreaError::TooFewCorners(corners.len()));
        };
        let triangles: Vec<_> = corners[1..]
            .windows(2)
            .map(|pair| [first, pair[0], pair[1]])
            .collect();
        let normal = triangles
            .iter()
            .map(|&[a, b, c]| (b - a).cross(c - a))
            .sum::<DVec3>();
        let fan = Fan::new(triangles);
        let plane = Emitter::new(first, normal, fan.area(), is_two_sided)?;
        check_outline(&corners, plane.normal)?;
        Ok(Self {
            corners,
            fan,
            plane,
        })
    }

    /// Returns the corners.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// Returns whether both sides shine.
    pub fn is_two_sided(&self) -> bool {
        self.plane.is_two_sided
    }

    /// Returns the unit normal of the front.
    pub fn normal(&self) -> DVec3 {
        self.plane.normal
    }

    /// Returns the area.
    pub fn area(&self) -> f64 {
        self.plane.area
    }

    /// Returns the triangles that samples lie on, with their areas.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = ([DVec3; 3], f64)> {
        self.fan.with_areas()
    }

    pub(super) fn sample(&self, receiver: DVec3, u: f64, v: f64) -> Option<AreaSample> {
        self.plane.sample(receiver, self.point_at(u, v))
    }

    pub(super) fn point_at(&self, u: f64, v: f64) -> DVec3 {
        let (triangle, u) = self.fan.choose(u);
        super::triangle::point_of(self.fan.triangle(triangle), u, v)
    }
}

/// Refuses outlines that are not flat, turn back, or go around more than once.
fn check_outline(corners: &[DVec3], normal: DVec3) -> Result<(), AreaError> {
    let count = corners.len();
    let first = corners[0];
    let extent = corners
        .iter()
        .map(|corner| (corner - first).abs().max_element())
        .fold(0.0, f64::max);
    for (corner, point) in corners.iter().enumerate() {
        if normal.dot(point - first).abs() > FLAT * extent {
            return Err(AreaError::NotFlat { corner });
        }
    }
    // What rounding may make of corners on a straight edge.
    let none = -1e-12 * extent * extent;
    for corner in 0..count {
        let [a, b, c] = [0, 1, 2].map(|next| corners[(corner + next) % count]);
        if normal.dot((b - a).cross(c - b)) < none {
            return Err(AreaError::NotConvex {
                corner: (corner + 1) % count,
            });
        }
        // Seen from the first corner the others come in order, too: once around.
        if normal.dot((a - first).cross(b - first)) < none {
            return Err(AreaError::NotConvex { corner });
        }
    }
    Ok(())
}
