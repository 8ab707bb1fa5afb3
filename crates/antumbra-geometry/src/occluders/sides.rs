//! Sides of a triangle's plane, for many directions or for other triangles.
//!
//! In: a triangle. Out: exact signs. Most are told in `f64` with a bound, the others by exact arithmetic.

use glam::DVec3;

use super::{Occluders, SurfaceId};
use crate::light::LightShape;
use crate::ray::ReceiverPoint;

/// Directions whose sides are told together.
const COUNT: usize = 64;

/// Bounds the error of `n . d`, in shares of the magnitudes it is made of. With `u` = 2^-53 and `P` the product of the two
/// edges' largest components, a component of the normal errs by at most `8 u P` and is at most `2 P`, so the sum
/// of three products errs by `8 u P + 6 u P` for each unit of the direction; 32 are granted. A corner seen from another one errs by
/// `u` of itself: `2 u P` more.
const ERROR: f64 = 1.0 / (1_u64 << 48) as f64;

impl Occluders {
    /// Returns which of up to 64 directions towards light from afar are strictly in front of a triangle, as its winding
    /// says, and which strictly behind: a bit each, exact. Directions are given axis by axis.
    ///
    /// Each bit is that of [`Occluders::light_side`] for a light in that direction. Without area nothing is on either side.
    ///
    /// # Panics
    /// The surface is no triangle.
    pub fn sides_of_directions(
        &self,
        surface: SurfaceId,
        directions: &[[f64; COUNT]; 3],
        count: usize,
    ) -> [u64; 2] {
        let corners = self.triangle_positions(surface).expect("a triangle");
        let (ab, ac) = (corners[1] - corners[0], corners[2] - corners[0]);
        let size = ab.abs().max_element() * ac.abs().max_element();
        let start = ReceiverPoint {
            point: corners[0],
            surface: Some(surface),
        };
        sides(ab.cross(ac), size, directions, count, |direction| {
            self.light_side(&start, &LightShape::Direction(direction))
        })
    }

    /// Returns the plane of a triangle; `None` for other surfaces and those without area.
    pub fn plane_of(&self, surface: SurfaceId) -> Option<SurfacePlane> {
        self.start_triangle(surface)?;
        let [a, b, c] = self.triangle_positions(surface)?;
        let (ab, ac) = (b - a, c - a);
        Some(SurfacePlane {
            surface,
            corner: a,
            normal: ab.cross(ac),
            size: ab.abs().max_element() * ac.abs().max_element(),
        })
    }

    /// Returns whether a triangle has no point strictly on one side of a plane: in front with `side` 1, behind with -1.
    /// Exact. `false` for other surfaces.
    ///
    /// From a start on the plane's triangle, light from that side is not blocked by such a triangle.
    pub fn has_nothing_beyond(&self, plane: &SurfacePlane, side: i8, surface: SurfaceId) -> bool {
        let Some(corners) = self.triangle_positions(surface) else {
            return false;
        };
        corners.into_iter().all(|corner| {
            let seen = corner - plane.corner;
            let height = plane.normal.dot(seen) * f64::from(side);
            let magnitude = seen.abs().element_sum();
            let bound = ERROR * plane.size * magnitude + f64::MIN_POSITIVE;
            if height.abs() > bound {
                return height < 0.0;
            }
            // Neighbors share corners; those of the plane's triangle need no arithmetic.
            let own = self.triangle_positions(plane.surface);
            if own.is_some_and(|own| own.contains(&corner)) {
                return true;
            }
            // Any start on the plane's triangle: sides do not depend on it.
            let start = ReceiverPoint {
                point: plane.corner,
                surface: Some(plane.surface),
            };
            self.light_side(&start, &LightShape::Point(corner)) * side <= 0
        })
    }
}

/// The plane of a triangle, rounded, and whose it is exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlane {
    surface: SurfaceId,
    corner: DVec3,
    normal: DVec3,
    /// The product of two edges' largest components, which bounds the normal's error.
    size: f64,
}

impl SurfacePlane {
    /// Returns the triangle whose plane it is.
    pub fn surface(&self) -> SurfaceId {
        self.surface
    }
}

/// Returns which of up to 64 directions are strictly on the side of a normal, and which strictly on the other: a bit each,
/// exact.
pub fn sides_of_normal(normal: DVec3, directions: &[[f64; COUNT]; 3], count: usize) -> [u64; 2] {
    let size = normal.abs().max_element();
    sides(normal, size, directions, count, |direction| {
        LightShape::Direction(direction).side_of(DVec3::ZERO, normal)
    })
}

/// Returns the sides of directions by a rounded normal where that is sure, else as told.
fn sides(
    normal: DVec3,
    size: f64,
    directions: &[[f64; COUNT]; 3],
    count: usize,
    exactly: impl Fn(DVec3) -> i8,
) -> [u64; 2] {
    let [xs, ys, zs] = directions;
    let error = ERROR * size;
    let (mut heights, mut bounds) = ([0.0; COUNT], [0.0; COUNT]);
    for i in 0..COUNT {
        heights[i] = (normal.x * xs[i] + normal.y * ys[i]) + normal.z * zs[i];
        let magnitude = (xs[i].abs() + ys[i].abs()) + zs[i].abs();
        bounds[i] = error * magnitude + f64::MIN_POSITIVE;
    }
    let (mut front, mut behind) = (0, 0);
    for i in 0..COUNT {
        front |= u64::from(heights[i] > bounds[i]) << i;
        behind |= u64::from(-heights[i] > bounds[i]) << i;
    }
    let asked = u64::MAX
        .checked_shr((COUNT - count.min(COUNT)) as u32)
        .unwrap_or(0);
    let mut rest = asked & !(front | behind);
    while rest != 0 {
        let i = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        match exactly(DVec3::new(xs[i], ys[i], zs[i])) {
            1 => front |= 1 << i,
            -1 => behind |= 1 << i,
            _ => {}
        }
    }
    [front & asked, behind & asked]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::occluders::Opacity;

    /// Triangles in a plane that is not exactly representable, and directions along it and a hair off.
    #[test]
    fn sides_are_those_of_single_directions() {
        let corners = [
            DVec3::new(0.1, 0.2, 0.3),
            DVec3::new(1.7, 0.3, -0.2),
            DVec3::new(0.4, 2.1, 0.9),
        ];
        let mut builder = Occluders::builder();
        builder.add_face(&corners, Opacity::Opaque).unwrap();
        let flat = [corners[0], corners[0], corners[1]];
        builder
            .add_mesh(&flat.map(|p| p.to_array()), &[[0, 1, 2]], Opacity::Opaque)
            .unwrap();
        let occluders = builder.build();
        let (ab, ac) = (corners[1] - corners[0], corners[2] - corners[0]);
        let mut directions = [[0.0; COUNT]; 3];
        for i in 0..COUNT - 3 {
            let (s, t) = ((i % 8) as f64 - 3.0, (i / 8) as f64 - 3.0);
            let mut direction = ab * s + ac * t;
            if i % 5 == 4 {
                direction.z = direction.z.next_up();
            }
            for axis in 0..3 {
                directions[axis][i] = direction[axis];
            }
        }
        let normal = ab.cross(ac);
        for surface in [SurfaceId(0), SurfaceId(1)] {
            let start = ReceiverPoint {
                point: corners[0],
                surface: Some(surface),
            };
            let sides = occluders.sides_of_directions(surface, &directions, COUNT - 3);
            let by_normal = sides_of_normal(normal, &directions, COUNT - 3);
            for i in 0..COUNT {
                let direction = DVec3::new(directions[0][i], directions[1][i], directions[2][i]);
                let light = LightShape::Direction(direction);
                let told = |sides: [u64; 2]| (sides[0] >> i & 1) as i8 - (sides[1] >> i & 1) as i8;
                assert_eq!(told(sides), occluders.light_side(&start, &light), "{i}");
                assert_eq!(told(by_normal), light.side_of(DVec3::ZERO, normal), "{i}");
            }
        }
        assert_eq!(
            occluders.sides_of_directions(SurfaceId(0), &directions, 0),
            [0, 0]
        );
    }

    #[test]
    fn neighbors_under_a_plane_have_nothing_beyond_it() {
        let mut builder = Occluders::builder();
        let v = DVec3::new;
        let positions = [
            v(0.0, 0.0, 0.0),
            v(1.0, 0.0, 0.0),
            v(0.0, 1.0, 0.0),
            v(0.0, 0.0, -1.0),
            v(0.0, 0.0, f64::MIN_POSITIVE),
        ];
        let faces = [[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 2, 1]];
        builder
            .add_mesh(&positions.map(|p| p.to_array()), &faces, Opacity::Opaque)
            .unwrap();
        let occluders = builder.build();
        let plane = occluders.plane_of(SurfaceId(0)).unwrap();
        let beyond =
            |side, surface| !occluders.has_nothing_beyond(&plane, side, SurfaceId(surface));
        assert_eq!(
            [0, 1, 2, 3].map(|s| beyond(1, s)),
            [false, false, true, false]
        );
        assert_eq!(
            [0, 1, 2, 3].map(|s| beyond(-1, s)),
            [false, true, false, false]
        );
    }
}
