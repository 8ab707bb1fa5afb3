//! Starts on planes between voxels.
//!
//! Values are kept for voxels of several sizes, so planes between every 1, 2, 4, ... of the finest
//! voxels are taken alike.

use antumbra_geometry::{Bounds, DVec3, ReceiverPoint};

use super::Attack;
use crate::commands::verify::random::{Random, next};

/// Moves a coordinate to one of the numbers around it, seldom further.
fn beside(random: &mut Random, x: f64, edge: f64) -> f64 {
    match random.below(4) {
        0 => x,
        1 | 2 => next(x, random.below(9) as i32 - 4),
        // As far as starts and their cells may be apart.
        _ => x + edge * random.one_of(&[-1.0, 1.0]) * random.power_of_ten(-9.0, -1.0),
    }
}

impl Attack<'_> {
    /// Returns a start on a surface and on so many planes between voxels, or a few roundings beside.
    pub(super) fn on_voxel_planes(
        &self,
        random: &mut Random,
        plane_count: usize,
    ) -> Option<ReceiverPoint> {
        let first = random.below(3);
        let second = (first + 1 + random.below(2)) % 3;
        let axes = [first, second];
        if random.below(3) == 0 {
            return self.hit_between_voxels(random, &axes[..plane_count]);
        }
        let (surface, corners, inside) = self.triangle_point(random)?;
        // The line in which the first plane cuts the triangle.
        let bounds = Bounds::of_points(corners);
        let (low, high) = (bounds.min[first], bounds.max[first]);
        let limit = match self.voxels.between(random, first, low, high) {
            Some(limit) => limit,
            None => self.voxels.nearest(random, first, inside[first]),
        };
        let [from, to] = cut(corners, first, limit)?;
        let mut point = from + random.draw() * (to - from);
        let edge = self.voxels.edge;
        if plane_count > 1 {
            let along = to[second] - from[second];
            let limit = self.voxels.nearest(random, second, point[second]);
            let share = (limit - from[second]) / along;
            if (0.0..=1.0).contains(&share) {
                point = from + share * (to - from);
                point[second] = beside(random, limit, edge);
            }
        }
        point[first] = beside(random, limit, edge);
        Some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }

    /// Returns what a ray hits that runs between voxels: in the planes across `axes`.
    fn hit_between_voxels(&self, random: &mut Random, axes: &[usize]) -> Option<ReceiverPoint> {
        let mut origin = random.in_box(&self.surfaces.reach);
        let mut direction = random.direction();
        for &axis in axes {
            origin[axis] = self.voxels.nearest(random, axis, origin[axis]);
            origin[axis] = beside(random, origin[axis], self.voxels.edge);
            direction[axis] = 0.0;
        }
        // From outside half of the time.
        if random.below(2) == 0 {
            origin -= 3.0 * self.surfaces.size * direction;
        }
        self.surfaces.cast(origin, direction, None)
    }

    /// Returns a free point at a corner, on an edge or on a face of a voxel.
    pub(super) fn at_voxel_border(&self, random: &mut Random) -> ReceiverPoint {
        let mut point = random.in_box(&self.surfaces.reach);
        let count = 1 + random.below(3);
        let first = random.below(3);
        for number in 0..count {
            let axis = (first + number) % 3;
            let plane = self.voxels.nearest(random, axis, point[axis]);
            point[axis] = beside(random, plane, self.voxels.edge);
        }
        ReceiverPoint {
            point,
            surface: None,
        }
    }
}

/// Returns the two points of a triangle's border in a plane across an axis.
fn cut(corners: [DVec3; 3], axis: usize, limit: f64) -> Option<[DVec3; 2]> {
    let mut ends = [DVec3::ZERO; 2];
    let mut count = 0;
    for number in 0..3 {
        let [from, to] = [corners[number], corners[(number + 1) % 3]];
        let share = (limit - from[axis]) / (to[axis] - from[axis]);
        if (0.0..=1.0).contains(&share) && count < 2 {
            ends[count] = from + share * (to - from);
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::super::voxels::Voxels;
    use super::*;

    #[test]
    fn planes_lie_between_voxels() {
        let reach = Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(8.0),
        };
        let voxels = Voxels::new(Some((DVec3::splat(-1.0), 0.5, [16; 3])), &reach);
        for number in 0..200 {
            let mut random = Random::new(1, number);
            let plane = voxels.between(&mut random, 1, 0.9, 4.2);
            if let Some(plane) = plane {
                assert!((0.9..=4.2).contains(&plane) && (2.0 * plane).fract() == 0.0);
            }
            assert_eq!((2.0 * voxels.nearest(&mut random, 2, 3.3)).fract(), 0.0);
        }
    }

    #[test]
    fn a_triangle_is_cut_where_the_plane_is() {
        let corners = [DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Y];
        let [from, to] = cut(corners, 0, 1.0).unwrap();
        assert_eq!((from.x, to.x, from.y + to.y), (1.0, 1.0, 1.0));
        assert_eq!(cut(corners, 0, 3.0), None);
        assert_eq!(cut(corners, 2, 0.0), None);
    }
}
