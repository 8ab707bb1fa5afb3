//! The scene as a light sees it, on planes of cells.
//!
//! In: a light, surfaces, starts. Out: which cells a surface may darken, which it darkens whole, from what
//! depth on; and the cell of a start. A point has six planes, the faces of a cube round it; a direction has
//! one, onto which everything is moved along the direction. Both are the same arithmetic: a point of space
//! has a place `(p, q, w)` on the plane, homogeneous, and a depth that grows away from the light.
//!
//! Invariants, for all starts that are not said to be in doubt: the exact start lies in its cell's
//! [`Region`], which is the cell inflated by the plane's margin; a surface that blocks some start of a region
//! [`Projected::may_meet`] it, and is no nearer than [`Projected::nearest`]; one that
//! [`Projected::covers`] it blocks every start of the region that is deeper, other than its own.
//!
//! Margins. Let `u` be 2^-53. A difference from a light's position is rounded once, so `p / w` is off by no
//! more than `4 u`, and by the start's own error over its distance from the light, for which 2^-26 is allowed;
//! cells are inflated by 2^-22. For directions, places are in units of the scene: with `s` its largest
//! coordinate plus its size, rounding is below `2^-50 s`, `2^-38 s` is allowed for the start, and cells are
//! inflated by `2^-36 s`. Starts in doubt are those with larger errors.

use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders, SurfaceId};

/// What cells are inflated by, round a point.
const POINT_MARGIN: f64 = 1.0 / (1 << 22) as f64;
/// What the error of a start may be, as a share of its distance from a point.
const POINT_ERROR: f64 = 1.0 / (1 << 26) as f64;
/// The same two for directions, as shares of the scene's scale.
const DIRECTION_MARGIN: f64 = 1.0 / (1u64 << 36) as f64;
const DIRECTION_ERROR: f64 = 1.0 / (1u64 << 38) as f64;
/// Boxes of curved surfaces are right up to rounding only.
const BOX_MARGIN: f64 = 1.0 / (1u64 << 40) as f64;
const ROUNDOFF: f64 = f64::EPSILON / 2.0;
/// More than products of coordinates lose by underflow.
const UNDERFLOW: f64 = 1e-290;

/// One plane of cells.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    eye: Eye,
    /// The axes of `p`, of `q` and of depth.
    axes: [usize; 3],
    /// 1 if depth grows along its axis, else -1.
    sign: f64,
    /// The rectangle of all cells: where the scene is.
    from: [f64; 2],
    cell: [f64; 2],
    margin: f64,
    /// Cells along each side, a power of two.
    pub(super) resolution: u32,
}

#[derive(Clone, Copy, Debug)]
enum Eye {
    Point(DVec3),
    /// What places are relative to, and the slopes of the direction along `p` and `q`.
    Direction(DVec3, [f64; 2]),
}

/// A rectangle of cells, inflated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Region {
    from: [f64; 2],
    to: [f64; 2],
}

/// Planes round a light, and how a start finds its own.
#[derive(Clone, Debug)]
pub(super) struct Planes {
    pub(super) planes: Vec<Plane>,
    light: LightShape,
    /// The scene's largest coordinate plus its size.
    scale: f64,
}

/// Where a start is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Nothing can be said.
    InDoubt,
    /// Nothing lies in that direction.
    Outside,
    /// In a cell of a plane.
    Cell {
        plane: usize,
        cell: usize,
        /// The depth, and a bound on its error.
        depth: f64,
        depth_error: f64,
    },
}

impl Planes {
    /// Lays planes round a light, fitted to the surfaces' box. Those in whose direction nothing lies are left
    /// without cells.
    pub(super) fn new(occluders: &Occluders, light: &LightShape, resolution: u32) -> Self {
        let light = light.without_underflow();
        let bounds = occluders.bounds();
        let scale = if bounds.is_empty() {
            0.0
        } else {
            bounds.largest_coordinate() + bounds.size().max_element()
        };
        let bounds = bounds.inflated(DVec3::splat(BOX_MARGIN * scale));
        let plane = |eye, axes, sign, margin| Plane {
            eye,
            axes,
            sign,
            from: [0.0; 2],
            cell: [0.0; 2],
            margin,
            resolution,
        };
        let planes = match light {
            LightShape::Point(position) => (0..6)
                .map(|face| {
                    let depth = face / 2;
                    let axes = [(depth + 1) % 3, (depth + 2) % 3, depth];
                    let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
                    plane(Eye::Point(position), axes, sign, POINT_MARGIN)
                })
                .collect(),
            LightShape::Direction(to) => {
                let size = to.abs();
                let depth = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b]));
                let depth = depth.unwrap_or(0);
                let axes = [(depth + 1) % 3, (depth + 2) % 3, depth];
                let slopes = [to[axes[0]] / to[depth], to[axes[1]] / to[depth]];
                let middle = if bounds.is_empty() {
                    DVec3::ZERO
                } else {
                    bounds.center()
                };
                let sign = if to[depth] > 0.0 { -1.0 } else { 1.0 };
                let eye = Eye::Direction(middle, slopes);
                vec![plane(eye, axes, sign, DIRECTION_MARGIN * scale)]
            }
        };
        let mut planes = Self {
            planes,
            light,
            scale,
        };
        for plane in &mut planes.planes {
            plane.fit(&bounds);
        }
        planes
    }

    /// Returns how many cells all planes have.
    pub(super) fn cell_count(&self) -> usize {
        self.planes.iter().map(Plane::cell_count).sum()
    }

    /// Returns a depth that everything lies behind: zero for points.
    pub(super) fn before_all(&self) -> f64 {
        match self.light {
            LightShape::Point(_) => 0.0,
            LightShape::Direction(_) => -2.0 * self.scale,
        }
    }

    /// Finds the cell of a start that is so far off a point, in any coordinate, at most.
    #[inline]
    pub(super) fn place(&self, origin: DVec3, error: f64) -> Place {
        let number = match self.light {
            LightShape::Point(position) => {
                let from_light = origin - position;
                let size = from_light.abs();
                let axis = if size.x >= size.y && size.x >= size.z {
                    0
                } else if size.y >= size.z {
                    1
                } else {
                    2
                };
                // Not for NaN and starts at the light.
                if !(error <= POINT_ERROR * size[axis] && size[axis] > UNDERFLOW) {
                    return Place::InDoubt;
                }
                2 * axis + usize::from(from_light[axis] < 0.0)
            }
            LightShape::Direction(_) => {
                let is_fine = error <= DIRECTION_ERROR * self.scale
                    && origin.abs().max_element() <= 2.0 * self.scale
                    && self.scale > UNDERFLOW;
                if !is_fine {
                    return Place::InDoubt;
                }
                0
            }
        };
        let plane = &self.planes[number];
        let place = plane.project(origin);
        let depth = plane.depth(origin);
        let mut at = [0; 2];
        for axis in 0..2 {
            let cells = (place[axis] / place.z - plane.from[axis]) / plane.cell[axis];
            // Not for NaN either: planes without cells.
            if !(cells >= 0.0 && cells <= f64::from(plane.resolution)) {
                return Place::Outside;
            }
            at[axis] = (cells as usize).min(plane.resolution as usize - 1);
        }
        Place::Cell {
            plane: number,
            cell: at[1] * plane.resolution as usize + at[0],
            depth,
            depth_error: error + 4.0 * ROUNDOFF * depth.abs(),
        }
    }
}

impl Plane {
    /// Lays the rectangle round what the plane sees of a box.
    fn fit(&mut self, bounds: &Bounds) {
        let count = f64::from(self.resolution);
        let (mut from, mut to) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        if bounds.is_empty() {
            (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
            return;
        }
        let corners = bounds.corners().map(|corner| self.project(corner));
        if corners.iter().all(|corner| corner.z < 0.0) {
            (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
            return;
        }
        let is_in_front = corners.iter().all(|corner| corner.z > 0.0);
        for axis in 0..2 {
            for corner in &corners {
                let at = corner[axis] / corner.z;
                from[axis] = from[axis].min(at);
                to[axis] = to[axis].max(at);
            }
            if let Eye::Point(_) = self.eye {
                if !is_in_front {
                    (from[axis], to[axis]) = (-1.0, 1.0);
                }
                // Round the cube the next face goes on.
                from[axis] = from[axis].max(-1.0);
                to[axis] = to[axis].min(1.0);
            }
            from[axis] -= 2.0 * self.margin;
            to[axis] += 2.0 * self.margin;
            self.from[axis] = from[axis];
            self.cell[axis] = (to[axis] - from[axis]) / count;
            if from[axis] >= to[axis] {
                // The box is seen by other faces only.
                (self.from, self.cell) = ([f64::NAN; 2], [f64::NAN; 2]);
                return;
            }
        }
    }

    /// Returns whether there are cells.
    pub(super) fn has_cells(&self) -> bool {
        self.cell[0] > 0.0 && self.cell[1] > 0.0
    }

    /// Returns how many cells there are.
    pub(super) fn cell_count(&self) -> usize {
        if self.has_cells() {
            (self.resolution * self.resolution) as usize
        } else {
            0
        }
    }

    /// Returns where a point is seen, homogeneous.
    fn project(&self, point: DVec3) -> DVec3 {
        let [p, q, depth] = self.axes;
        match self.eye {
            Eye::Point(position) => {
                let seen = point - position;
                DVec3::new(seen[p], seen[q], self.sign * seen[depth])
            }
            Eye::Direction(middle, slopes) => {
                let seen = point - middle;
                let along = seen[depth];
                DVec3::new(
                    seen[p] - along * slopes[0],
                    seen[q] - along * slopes[1],
                    1.0,
                )
            }
        }
    }

    /// Returns how far from the light a point is, along the axis of depth.
    fn depth(&self, point: DVec3) -> f64 {
        let axis = self.axes[2];
        match self.eye {
            Eye::Point(position) => self.sign * (point[axis] - position[axis]),
            Eye::Direction(middle, _) => self.sign * (point[axis] - middle[axis]),
        }
    }

    /// Returns the inflated square of `side` cells at a cell.
    fn region(&self, at: [u32; 2], side: u32) -> Region {
        let edge = |axis: usize, n: u32| self.from[axis] + self.cell[axis] * f64::from(n);
        let [x, y] = at;
        Region {
            from: [edge(0, x) - self.margin, edge(1, y) - self.margin],
            to: [
                edge(0, x + side) + self.margin,
                edge(1, y + side) + self.margin,
            ],
        }
    }

    /// Returns the ray through the middle of a cell, away from the light, as origin and direction of depth 1;
    /// a direction's begins at depth `begin`.
    pub(super) fn ray(&self, cell: usize, begin: f64) -> (DVec3, DVec3) {
        let at = [
            cell % self.resolution as usize,
            cell / self.resolution as usize,
        ];
        let place = [0, 1].map(|axis| self.from[axis] + self.cell[axis] * (at[axis] as f64 + 0.5));
        let [p, q, depth] = self.axes;
        let (mut origin, mut direction) = (DVec3::ZERO, DVec3::ZERO);
        direction[depth] = self.sign;
        match self.eye {
            Eye::Point(position) => {
                origin = position;
                direction[p] = place[0];
                direction[q] = place[1];
            }
            Eye::Direction(middle, slopes) => {
                let along = self.sign * begin;
                origin[p] = place[0] + along * slopes[0];
                origin[q] = place[1] + along * slopes[1];
                origin[depth] = along;
                origin += middle;
                direction[p] = self.sign * slopes[0];
                direction[q] = self.sign * slopes[1];
            }
        }
        (origin, direction)
    }

    /// Returns the width of a cell at a depth.
    pub(super) fn width_at(&self, depth: f64) -> f64 {
        let width = self.cell[0].max(self.cell[1]);
        match self.eye {
            Eye::Point(_) => width * depth,
            Eye::Direction(..) => width,
        }
    }

    /// Calls `found` for every cell whose region a surface may meet, with the region.
    pub(super) fn cells_of(&self, surface: &Projected, found: &mut impl FnMut(usize, &Region)) {
        if self.has_cells() {
            self.descend(surface, [0; 2], self.resolution, found);
        }
    }

    fn descend(
        &self,
        surface: &Projected,
        at: [u32; 2],
        side: u32,
        found: &mut impl FnMut(usize, &Region),
    ) {
        let region = self.region(at, side);
        if !surface.may_meet(&region) {
            return;
        }
        if side == 1 {
            found((at[1] * self.resolution + at[0]) as usize, &region);
            return;
        }
        let half = side / 2;
        for (x, y) in [(0, 0), (half, 0), (0, half), (half, half)] {
            self.descend(surface, [at[0] + x, at[1] + y], half, found);
        }
    }
}

impl Region {
    fn corners(&self) -> [DVec3; 4] {
        let Self { from, to } = *self;
        [
            DVec3::new(from[0], from[1], 1.0),
            DVec3::new(to[0], from[1], 1.0),
            DVec3::new(from[0], to[1], 1.0),
            DVec3::new(to[0], to[1], 1.0),
        ]
    }
}

/// A surface as a plane sees it.
#[derive(Clone, Debug)]
pub(super) struct Projected {
    /// The corners of a triangle, or of a box around the surface.
    corners: Vec<DVec3>,
    least_depth: f64,
    most_depth: f64,
    triangle: Option<Triangle>,
    sphere: Option<Sphere>,
}

/// A triangle as a cone of three edges.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    depths: [f64; 3],
    /// `edges[i]` is the plane through the light and the two corners other than `i`, positive inside.
    edges: [DVec3; 3],
    /// The largest error of `edges[i] . c` for `|c| = 1`.
    errors: [f64; 3],
}

#[derive(Clone, Copy, Debug)]
struct Sphere {
    center: DVec3,
    radius: f64,
    /// How far its edge is from its middle along `p` and `q`, for directions.
    reach: [f64; 2],
    depth: f64,
    /// For directions: the unit direction in the axes `p`, `q`, depth.
    direction: Option<DVec3>,
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

fn lowered(depth: f64) -> f64 {
    depth - 8.0 * ROUNDOFF * depth.abs()
}

fn raised(depth: f64) -> f64 {
    depth + 1e-9 * depth.abs()
}

impl Triangle {
    /// `None` if rounding leaves in doubt how the corners turn, as seen from the light.
    fn new(corners: [DVec3; 3], depths: &[f64]) -> Option<Self> {
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
    fn new(sphere: &antumbra_geometry::Sphere, plane: &Plane) -> Self {
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
    fn holds(&self, corner: DVec3) -> bool {
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
