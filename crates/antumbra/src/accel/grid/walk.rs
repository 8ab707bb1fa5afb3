//! The walk of Amanatides and Woo: the voxels along a ray, in order.
//!
//! Distances to voxel planes are computed from the voxel's number at each step, not summed up, so
//! that no error grows along the way.

use antumbra_geometry::{DVec3, Segment};

use super::Layout;

/// One voxel on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Visit {
    /// Its number in memory.
    pub(crate) voxel: usize,
    /// How far from the start the ray leaves it, in lengths of the segment's direction.
    pub(crate) leaves_at: f64,
    /// Whether the ray starts in it.
    pub(crate) is_first: bool,
}

/// Voxels along a segment, from its start to its light or out of the grid.
#[derive(Clone, Debug)]
pub(crate) struct Walk<'a> {
    layout: &'a Layout,
    /// A point of the line inside the grid or where it enters, and how far along it lies.
    origin: DVec3,
    offset: f64,
    direction: DVec3,
    inverse: DVec3,
    voxel: [u32; 3],
    /// Where the segment ends, in lengths of its direction.
    end: f64,
    is_started_inside: bool,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Before,
    Going,
    Done,
}

impl<'a> Walk<'a> {
    pub(crate) fn new(layout: &'a Layout, segment: &Segment) -> Self {
        let origin = segment.origin();
        let direction = segment.direction();
        let (bounds, margin) = (&layout.bounds, layout.margin);
        let length = direction.abs().max_element();
        // A little beyond the light: the voxel it stands in, by any rounding, is visited.
        let end = if segment.is_finite() {
            1.0 + margin / length
        } else {
            f64::INFINITY
        };
        let inverse = direction.recip();
        let is_started_inside = bounds.contains(origin);
        let mut walk = Self {
            layout,
            origin,
            offset: 0.0,
            direction,
            inverse,
            voxel: [0; 3],
            end,
            is_started_inside,
            state: State::Before,
        };
        if !is_started_inside {
            match walk.entry() {
                Some(entry) if entry <= end => {
                    walk.origin = point_along(origin, direction, segment.direction_tail(), entry);
                    walk.offset = entry;
                }
                _ => walk.state = State::Done,
            }
        }
        walk.voxel = layout.voxel_at(walk.origin);
        walk
    }

    /// Returns where a ray from outside enters the grid's box, a little generously.
    fn entry(&self) -> Option<f64> {
        // The rounding of a far start may let the line seem to pass by: give it room in proportion.
        let room = self.layout.margin + 1e-15 * self.origin.abs().max_element();
        let bounds = self.layout.bounds.inflated(DVec3::splat(room));
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (low, high) = (bounds.min[axis], bounds.max[axis]);
            let (from, rate) = (self.origin[axis], self.inverse[axis]);
            if !rate.is_finite() {
                if from < low || from > high {
                    return None;
                }
                continue;
            }
            let (a, b) = ((low - from) * rate, (high - from) * rate);
            enters = enters.max(a.min(b));
            leaves = leaves.min(a.max(b));
        }
        // Entry and exit of a line that grazes a corner differ by less than their rounding.
        (enters <= leaves + leaves.abs() * 1e-14).then_some(enters)
    }

    /// Returns where the ray crosses the far plane of its voxel along an axis.
    fn crossing(&self, axis: usize) -> f64 {
        let rate = self.inverse[axis];
        if !rate.is_finite() {
            return f64::INFINITY;
        }
        let plane = self
            .layout
            .plane(axis, self.voxel[axis] + u32::from(rate > 0.0));
        (plane - self.origin[axis]) * rate
    }

    /// Moves to the next voxel, or returns `false` at the end.
    fn step(&mut self) -> bool {
        let [x, y, z] = [self.crossing(0), self.crossing(1), self.crossing(2)];
        let axis = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        let distance = [x, y, z][axis];
        if distance == f64::INFINITY || distance + self.offset > self.end {
            return false;
        }
        if self.direction[axis] > 0.0 {
            self.voxel[axis] += 1;
            self.voxel[axis] < self.layout.resolution[axis]
        } else if self.voxel[axis] > 0 {
            self.voxel[axis] -= 1;
            true
        } else {
            false
        }
    }
}

impl Iterator for Walk<'_> {
    type Item = Visit;

    fn next(&mut self) -> Option<Visit> {
        let is_first = match self.state {
            State::Done => return None,
            State::Before => {
                self.state = State::Going;
                self.is_started_inside
            }
            State::Going => {
                if !self.step() {
                    self.state = State::Done;
                    return None;
                }
                false
            }
        };
        let leaves_at = self.crossing(0).min(self.crossing(1)).min(self.crossing(2)) + self.offset;
        Some(Visit {
            voxel: self.layout.index(self.voxel),
            leaves_at,
            is_first,
        })
    }
}

/// Returns `origin + t (direction + tail)` rounded once: a start far outside would otherwise lose
/// in the sum more than the grid's margin.
pub(crate) fn point_along(origin: DVec3, direction: DVec3, tail: DVec3, t: f64) -> DVec3 {
    let along = |axis: usize| {
        let (o, d) = (origin[axis], direction[axis]);
        let product = t * d;
        let product_tail = t.mul_add(d, -product);
        let sum = o + product;
        let part = sum - o;
        let sum_tail = (o - (sum - part)) + (product - part);
        sum + (sum_tail + product_tail + t * tail[axis])
    };
    DVec3::new(along(0), along(1), along(2))
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Bounds, LightShape, Occluders, ReceiverPoint};

    use super::*;

    fn walk_voxels(n: u32, from: DVec3, light: LightShape) -> Vec<usize> {
        let layout = Layout::new(
            Bounds {
                min: DVec3::ZERO,
                max: DVec3::splat(4.0),
            },
            [n; 3],
        );
        let start = ReceiverPoint {
            point: from,
            surface: None,
        };
        let segment = Occluders::default().segment(&start, &light);
        Walk::new(&layout, &segment)
            .map(|visit| visit.voxel)
            .collect()
    }

    #[test]
    fn crosses_the_grid_along_an_axis() {
        let along_x = LightShape::Direction(DVec3::X);
        assert_eq!(
            walk_voxels(4, DVec3::new(0.5, 0.5, 0.5), along_x),
            [0, 1, 2, 3]
        );
        let back = LightShape::Direction(-DVec3::X);
        assert_eq!(
            walk_voxels(4, DVec3::new(9.0, 0.5, 0.5), back),
            [3, 2, 1, 0]
        );
    }

    #[test]
    fn ends_at_the_light() {
        let light = LightShape::Point(DVec3::new(1.5, 0.5, 0.5));
        assert_eq!(walk_voxels(4, DVec3::new(0.5, 0.5, 0.5), light), [0, 1]);
    }

    #[test]
    fn passes_by_or_away() {
        assert!(
            walk_voxels(
                4,
                DVec3::new(9.0, 9.0, 9.0),
                LightShape::Direction(DVec3::X)
            )
            .is_empty()
        );
        assert!(
            walk_voxels(
                4,
                DVec3::new(-9.0, 9.0, 1.0),
                LightShape::Direction(DVec3::X)
            )
            .is_empty()
        );
    }

    #[test]
    fn enters_rightly_from_very_far() {
        // From 10^12 away the sum of start and way would be off by more than the margin.
        let distance = 1e12;
        let target = DVec3::new(1.0, 2.0, 3.0);
        let direction = DVec3::new(0.1, 0.7, -0.3);
        let from = target - direction * distance;
        let visited = walk_voxels(4, from, LightShape::Direction(direction));
        assert!(!visited.is_empty());
    }
}
