//! Surfaces as a plane of cells sees them.

use antumbra_geometry::{DVec3, LightShape, Occluders, SurfaceId};

use super::plane::{BOX_MARGIN, Eye, Plane, ROUNDOFF, Region, UNDERFLOW};

/// A surface as a plane sees it.
#[derive(Clone, Debug)]
pub(super) struct Projected {
    /// The corners of a triangle, or of a box around the surface.
    pub(super) corners: Vec<DVec3>,
    least_depth: f64,
    most_depth: f64,
    pub(super) triangle: Option<Triangle>,
    pub(super) sphere: Option<Sphere>,
}

/// A triangle as a cone of three edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) depths: [f64; 3],
    /// `edges[i]` is the plane through the light and the two corners other than `i`, positive inside.
    pub(super) edges: [DVec3; 3],
    /// The largest error of `edges[i] . c` for `|c| = 1`.
    errors: [f64; 3],
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    /// How far its edge is from its middle along `p` and `q`, for directions.
    pub(super) reach: [f64; 2],
    pub(super) depth: f64,
    /// For directions: the unit direction in the axes `p`, `q`, depth.
    pub(super) direction: Option<DVec3>,
}

impl Projected {
    /// Projects a surface; `None` for those that block nothing.
    pub(super) fn new(
        occluders: &Occluders,
        surface: SurfaceId,
        plane: &Plane,
        light: &LightShape,
    ) -> Option<Self> {
        if !occluders.is_opaque(surface) {
            return None;
        }
        let points: Vec<DVec3> = match occluders.triangle_positions(surface) {
            Some(corners) => {
                // Triangles without area and seen from the edge block nothing.
                if occluders.light_side_of(surface, light) == 0 {
                    return None;
                }
                corners.to_vec()
            }
            None => {
                let bounds = occluders.surface_bounds(surface);
                let margin =
                    BOX_MARGIN * (bounds.largest_coordinate() + bounds.size().max_element());
                bounds.inflated(DVec3::splat(margin)).corners().to_vec()
            }
        };
        let corners: Vec<DVec3> = points.iter().map(|&point| plane.project(point)).collect();
        let depths: Vec<f64> = points.iter().map(|&point| plane.depth(point)).collect();
        let triangle = occluders
            .triangle_positions(surface)
            .and_then(|_| Triangle::new([corners[0], corners[1], corners[2]], &depths));
        let sphere = occluders
            .sphere(surface)
            .map(|sphere| Sphere::new(&sphere, plane));
        Some(Self {
            corners,
            least_depth: depths.iter().copied().fold(f64::INFINITY, f64::min),
            most_depth: depths.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            triangle,
            sphere,
        })
    }

    /// Returns whether some start of a region may be blocked; never `false` if one is.
    pub(super) fn may_meet(&self, region: &Region) -> bool {
        // Planes through the light separate two convex cones: the region's sides, and the triangle's.
        if self.corners.iter().all(|corner| corner.z < 0.0) {
            return false;
        }
        for axis in 0..2 {
            let (from, to) = (region.from[axis], region.to[axis]);
            let beyond = |corner: &DVec3, bound: f64| {
                let product = bound * corner.z;
                let height = corner[axis] - product;
                let error = 4.0 * ROUNDOFF * (corner[axis].abs() + product.abs()) + UNDERFLOW;
                (height, error)
            };
            let is_below = |corner: &DVec3| {
                let (height, error) = beyond(corner, from);
                height < -error
            };
            let is_above = |corner: &DVec3| {
                let (height, error) = beyond(corner, to);
                height > error
            };
            if self.corners.iter().all(is_below) || self.corners.iter().all(is_above) {
                return false;
            }
            if let Some(sphere) = &self.sphere {
                let (height, error) = beyond(&sphere.center, from);
                let is_below = height < -error - sphere.reach_over(axis, from);
                let (height, error) = beyond(&sphere.center, to);
                let is_above = height > error + sphere.reach_over(axis, to);
                if is_below || is_above {
                    return false;
                }
            }
        }
        let Some(triangle) = &self.triangle else {
            return true;
        };
        let corners = region.corners();
        !(0..3).any(|i| {
            corners.iter().all(|corner| {
                triangle.edges[i].dot(*corner) < -triangle.errors[i] * corner.length() - UNDERFLOW
            })
        })
    }

    /// Returns a depth that no part of the surface inside a region falls below.
    pub(super) fn nearest(&self, region: &Region) -> f64 {
        let least = lowered(self.least_depth);
        let over_region = self.triangle.as_ref().and_then(|triangle| {
            triangle
                .depths_over(region)
                .map(|depths| depths.map(|(depth, error)| depth - error))
        });
        match over_region {
            Some(depths) => least.max(depths.into_iter().fold(f64::INFINITY, f64::min)),
            None => least,
        }
    }

    /// Returns the depth from which on all starts of a region are blocked, if the surface covers it.
    pub(super) fn covers(&self, region: &Region) -> Option<f64> {
        if let Some(triangle) = &self.triangle {
            let is_inside = region.corners().iter().all(|corner| {
                (0..3).all(|i| {
                    triangle.edges[i].dot(*corner)
                        > triangle.errors[i] * corner.length() + UNDERFLOW
                })
            });
            if !is_inside {
                return None;
            }
            let most = raised(self.most_depth);
            let over_region = triangle.depths_over(region).map(|depths| {
                depths
                    .map(|(depth, error)| depth + error)
                    .into_iter()
                    .fold(f64::NEG_INFINITY, f64::max)
            });
            return Some(over_region.map_or(most, |depth| depth.min(most)));
        }
        let sphere = self.sphere.as_ref()?;
        region
            .corners()
            .iter()
            .all(|corner| sphere.holds(*corner))
            .then(|| raised(sphere.depth.abs() + sphere.radius) - sphere.depth.abs() + sphere.depth)
    }
}

pub(super) fn lowered(depth: f64) -> f64 {
    depth - 8.0 * ROUNDOFF * depth.abs()
}

pub(super) fn raised(depth: f64) -> f64 {
    depth + 1e-9 * depth.abs()
}

impl Triangle {
    /// `None` if rounding leaves in doubt how the corners turn, as seen from the light.
    pub(super) fn new(corners: [DVec3; 3], depths: &[f64]) -> Option<Self> {
        let [a, b, c] = corners;
        // A cross product of vectors that are off by a rounding each is off by less than 6 u of their lengths'
        // product, and a dot product with it adds 4 u.
        let error =
            |first: DVec3, second: DVec3| 16.0 * ROUNDOFF * first.length() * second.length();
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let errors = [error(b, c), error(c, a), error(a, b)];
        let turn = a.dot(edges[0]);
        // Not for NaN.
        let is_certain = turn.abs() > errors[0] * a.length() + UNDERFLOW;
        is_certain.then(|| Self {
            depths: [depths[0], depths[1], depths[2]],
            edges: edges.map(|edge| edge * turn.signum()),
            errors,
        })
    }

    /// Returns the depths of its plane at the corners of a region with bounds on their errors; `None` where
    /// some corner is near or beyond the horizon of the plane.
    fn depths_over(&self, region: &Region) -> Option<[(f64, f64); 4]> {
        let largest = self
            .depths
            .iter()
            .fold(0.0_f64, |most, d| most.max(d.abs()));
        let mut all = [(0.0, 0.0); 4];
        for (depth, corner) in all.iter_mut().zip(region.corners()) {
            let weights = self.edges.map(|edge| edge.dot(corner));
            let sum: f64 = weights.iter().sum();
            let error = corner.length() * self.errors.iter().sum::<f64>() + UNDERFLOW;
            let share = 4.0 * error / sum;
            if !(sum > 0.0 && share < 1e-3) {
                return None;
            }
            let mean = (0..3).map(|i| weights[i] * self.depths[i]).sum::<f64>() / sum;
            // Weights that are off by a share of their sum move the mean by no more than that share of the
            // depths and of itself.
            *depth = (mean, share * (largest + mean.abs()) + f64::MIN_POSITIVE);
        }
        Some(all)
    }
}

impl Sphere {
    pub(super) fn new(sphere: &antumbra_geometry::Sphere, plane: &Plane) -> Self {
        let center = plane.project(sphere.center);
        let (reach, direction) = match plane.eye {
            Eye::Point(_) => ([0.0; 2], None),
            Eye::Direction(_, slopes) => {
                let reach = slopes.map(|slope| sphere.radius * (1.0 + slope * slope).sqrt());
                let direction = DVec3::new(slopes[0], slopes[1], 1.0).normalize();
                (reach, Some(direction))
            }
        };
        Self {
            center,
            radius: sphere.radius,
            reach,
            depth: plane.depth(sphere.center),
            direction,
        }
    }

    /// Returns how far below a side of a region, in heights over it, the middle may be while the sphere meets it.
    fn reach_over(&self, axis: usize, bound: f64) -> f64 {
        let reach = match self.direction {
            // A height is a distance from the plane times the length of its normal.
            None => self.radius * (1.0 + bound * bound).sqrt(),
            Some(_) => self.reach[axis],
        };
        reach * (1.0 + 1e-9)
    }

    /// Returns whether the line through a corner goes through the inside, well off its outline.
    pub(super) fn holds(&self, corner: DVec3) -> bool {
        match self.direction {
            None => {
                let (along, length) = (corner.dot(self.center), corner.length_squared());
                let (far, near) = (self.center.length_squared(), self.radius * self.radius);
                let is_outside = far - near > 1e-9 * far;
                is_outside
                    && along > 0.0
                    && along * along - length * (far - near) > 1e-9 * length * far
            }
            Some(direction) => {
                let off = DVec3::new(corner.x - self.center.x, corner.y - self.center.y, 0.0);
                let along = off.dot(direction);
                let room = 1e-9 * (corner.length_squared() + self.center.length_squared());
                off.length_squared() - along * along + room
                    < self.radius * self.radius * (1.0 - 1e-9)
            }
        }
    }
}
