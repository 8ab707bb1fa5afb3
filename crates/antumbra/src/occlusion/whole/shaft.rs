//! What lies between starts and a light with size: half-spaces that hold all segments from the ones to the other.
//!
//! In: a cell's box, or a triangle's part in it, and the hull of a light. Out: planes that all segments lie below.
//! Invariant: a height is that of the highest corner of both, so *any* normal gives a plane that holds; which normals are
//! tried decides only how tight they are. Points of the frame.

use antumbra_geometry::{Bounds, DVec3};

use super::hull::{Flat, LightHull};

/// Most corners of a triangle in a box.
pub(super) const MOST_CORNERS: usize = 9;

/// Most planes of a shaft.
const MOST_PLANES: usize = 26;

/// A convex set of starts in the frame's units: the part of a triangle in a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
}

impl Polygon {
    /// Cuts a triangle by a box. `None` where nothing is left.
    pub(super) fn new(corners: [DVec3; 3], bounds: &Bounds) -> Option<Self> {
        let mut polygon = Self {
            corners: [DVec3::ZERO; MOST_CORNERS],
            count: 3,
        };
        polygon.corners[..3].copy_from_slice(&corners);
        for axis in 0..3 {
            polygon.cut(|point| point[axis] - bounds.min[axis])?;
            polygon.cut(|point| bounds.max[axis] - point[axis])?;
        }
        Some(polygon)
    }

    /// Leaves the part where a linear form is not negative, up to rounding.
    fn cut(&mut self, form: impl Fn(DVec3) -> f64) -> Option<()> {
        let before = *self;
        self.count = 0;
        for number in 0..before.count {
            let (a, b) = (
                before.corners[number],
                before.corners[(number + 1) % before.count],
            );
            let (at_a, at_b) = (form(a), form(b));
            if at_a >= 0.0 {
                self.push(a);
            }
            if (at_a >= 0.0) != (at_b >= 0.0) {
                self.push(a + (b - a) * (at_a / (at_a - at_b)));
            }
        }
        (self.count > 0).then_some(())
    }

    fn push(&mut self, point: DVec3) {
        if self.count < MOST_CORNERS {
            self.corners[self.count] = point;
            self.count += 1;
        }
    }

    #[inline]
    pub(super) fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    pub(super) fn middle(&self) -> DVec3 {
        self.corners().iter().sum::<DVec3>() / self.count as f64
    }

    pub(super) fn bounds(&self) -> Bounds {
        Bounds::of_points(self.corners().iter().copied())
    }
}

/// Half-spaces, all segments below them.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    /// Largest component 1.
    normals: [DVec3; MOST_PLANES],
    heights: [f64; MOST_PLANES],
    count: usize,
}

impl Planes {
    const NONE: Self = Self {
        normals: [DVec3::ZERO; MOST_PLANES],
        heights: [0.0; MOST_PLANES],
        count: 0,
    };

    /// Returns the planes around the segments from a box to a light, twelve at most.
    pub(super) fn of_box(bounds: &Bounds, hull: &LightHull) -> Self {
        let mut planes = Self::NONE;
        let corners = bounds.corners();
        // Through an edge of the box along an axis and a corner of the light: tangents in the projection along it.
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut found = [false; 2];
            for corner in 0..4 {
                let mut from = bounds.min;
                if corner & 1 != 0 {
                    from[u] = bounds.max[u];
                }
                if corner & 2 != 0 {
                    from[v] = bounds.max[v];
                }
                for number in 0..hull.corners.len() {
                    let way = hull.towards(number, from);
                    let mut normal = DVec3::ZERO;
                    normal[u] = -way[v];
                    normal[v] = way[u];
                    for (turn, is_found) in [1.0, -1.0].into_iter().zip(&mut found) {
                        if !*is_found && is_tangent(turn * normal, from, &corners, hull) {
                            *is_found = true;
                            planes.push(turn * normal, &corners, hull);
                        }
                    }
                }
            }
        }
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut normal = DVec3::ZERO;
                normal[axis] = sign;
                planes.push(normal, &corners, hull);
            }
        }
        planes
    }

    /// Returns the planes around the segments from a part of a triangle to a light, but for the triangle's own.
    pub(super) fn of_polygon(polygon: &Polygon, hull: &LightHull) -> Self {
        let mut planes = Self::NONE;
        let corners = polygon.corners();
        let middle = polygon.middle();
        let toward_light = hull
            .corners
            .iter()
            .enumerate()
            .map(|(number, _)| hull.towards(number, middle))
            .sum::<DVec3>();
        // The end of the light first: what lies behind it is much of a scene.
        for number in 0..corners.len() {
            let (a, b) = (corners[number], corners[(number + 1) % corners.len()]);
            let edge = b - a;
            let best = (0..hull.corners.len()).filter_map(|corner| {
                let mut normal = edge.cross(hull.towards(corner, a));
                if normal.dot(middle - a) > 0.0 {
                    normal = -normal;
                }
                let normal = unit(normal)?;
                let over = excess(normal, a, corners, hull);
                Some((over, normal))
            });
            if let Some((_, normal)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) {
                planes.push(normal, corners, hull);
            }
        }
        for &[first, second] in &hull.edges {
            let [first, second] = [first, second].map(usize::from);
            let normals: &mut dyn Iterator<Item = DVec3> = if hull.is_afar {
                &mut std::iter::once(hull.corners[first].cross(hull.corners[second]))
            } else {
                let edge = hull.corners[second] - hull.corners[first];
                let at = hull.corners[first];
                &mut corners.iter().map(move |corner| edge.cross(*corner - at))
            };
            let best = normals
                .filter_map(unit)
                .flat_map(|normal| [normal, -normal])
                .map(|normal| {
                    let from = if hull.is_afar {
                        corners[0]
                    } else {
                        hull.corners[first]
                    };
                    (excess(normal, from, corners, hull), normal)
                });
            if let Some((_, normal)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) {
                planes.push(normal, corners, hull);
            }
        }
        planes.push(toward_light, corners, hull);
        planes.push(-toward_light, corners, hull);
        planes
    }

    fn push(&mut self, normal: DVec3, corners: &[DVec3], hull: &LightHull) {
        let Some(normal) = unit(normal) else { return };
        if self.count == MOST_PLANES {
            return;
        }
        let start = corners
            .iter()
            .fold(f64::MIN, |most, corner| most.max(normal.dot(*corner)));
        let light = hull.highest(normal);
        let height = if hull.is_afar {
            start + light
        } else {
            start.max(light)
        };
        self.normals[self.count] = normal;
        self.heights[self.count] = height + 8.0 * hull.slack;
        self.count += 1;
    }

    /// Returns normals and heights.
    pub(super) fn all(&self) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        let heights = self.heights[..self.count].iter().copied();
        self.normals[..self.count].iter().copied().zip(heights)
    }

    /// Returns whether the hull of some points surely lies above one of the planes.
    #[inline]
    pub(super) fn misses<const N: usize>(&self, points: &[DVec3; N]) -> bool {
        self.all()
            .any(|(normal, height)| points.iter().all(|point| normal.dot(*point) > height))
    }
}

/// Returns a vector with largest component 1; `None` for zero.
#[inline]
fn unit(normal: DVec3) -> Option<DVec3> {
    let size = normal.abs().max_element();
    (size > 1e-200).then(|| normal / size)
}

/// Returns how far starts and light reach over the plane through a point of them.
#[inline]
fn excess(normal: DVec3, from: DVec3, corners: &[DVec3], hull: &LightHull) -> f64 {
    let at = normal.dot(from);
    let start = corners
        .iter()
        .fold(f64::MIN, |most, corner| most.max(normal.dot(*corner)));
    let light = hull.highest(normal);
    if hull.is_afar {
        start - at + light
    } else {
        start.max(light) - at
    }
}

fn is_tangent(normal: DVec3, from: DVec3, corners: &[DVec3; 8], hull: &LightHull) -> bool {
    unit(normal).is_some_and(|normal| excess(normal, from, corners, hull) <= 8.0 * hull.slack)
}

/// Returns whether no line from some starts to a light meets the line through two points, because all pass on one side:
/// the form is linear in start and in light, so corners decide.
pub(super) fn passes_beside([a, b]: [DVec3; 2], corners: &[DVec3], hull: &LightHull) -> bool {
    let edge = b - a;
    let size = edge.abs().max_element();
    let (mut is_left, mut is_right) = (true, true);
    for start in corners {
        let seen = a - *start;
        let turned = seen.cross(edge);
        let reach = seen.abs().max_element() + size;
        for number in 0..hull.corners.len() {
            let way = hull.towards(number, *start);
            // Each point is known up to the slack: products of two sizes times that, for three factors.
            let length = way.abs().max_element();
            let bound = 16.0 * hull.slack * reach * (2.0 * length + size);
            let form = turned.dot(way);
            is_left &= form > bound;
            is_right &= form < -bound;
            if !is_left && !is_right {
                return false;
            }
        }
    }
    is_left || is_right
}

/// Returns whether all starts surely lie on one side of a triangle's plane.
#[inline]
pub(super) fn are_off_plane(triangle: &Flat, corners: &[DVec3], slack: f64) -> bool {
    let bound = triangle.bound(8.0 * slack);
    let (mut is_over, mut is_under) = (true, true);
    for corner in corners {
        let height = triangle.height(*corner);
        is_over &= height > bound;
        is_under &= height < -bound;
    }
    is_over || is_under
}
