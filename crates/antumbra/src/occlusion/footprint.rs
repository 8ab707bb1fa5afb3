//! Which tiles of a light's view a surface may lie in.
//!
//! In: a view, a triangle or a curved shape. Out: every tile that, inflated, holds a part of its projection. `f64` is off by 2^-40 of a tile here; margins are 2^-11 and
//! more.

use antumbra_geometry::{DVec2, DVec3, Occluders, SurfaceId};

use super::views::View;
use crate::accel::frame::Frame;

/// A triangle in a view, cut to what it shows: `A`, `B` and `Z` of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    corners: [DVec3; MOST_CORNERS],
    count: usize,
}

/// Four cuts of a triangle.
const MOST_CORNERS: usize = 8;

/// Faces show so many tiles more than they have, on each side: more than margins.
const BEYOND: f64 = 1.0;

/// A face's polygon that comes closer to the light is taken to be everywhere.
const CLOSEST: f64 = 1e-6;

/// Cuts let so much more remain, in the frame's units: many times the rounding of corners and cuts. A triangle that
/// all but holds the light shows itself by a tip of that size only, and blocks half of everything.
const TIP: f64 = 1e-9;

impl Polygon {
    /// `None` if the view does not show the triangle.
    #[inline]
    pub(super) fn new(view: &View, corners: [DVec3; 3]) -> Option<Self> {
        let mut polygon = Self {
            corners: [DVec3::ZERO; MOST_CORNERS],
            count: 3,
        };
        for (place, corner) in polygon.corners.iter_mut().zip(corners) {
            *place = view.project(corner);
        }
        if !view.is_face {
            return Some(polygon);
        }
        let steepness = 1.0 + BEYOND / view.scale;
        for side in 0..4 {
            // Positive where the face shows nothing.
            let beyond = |corner: &DVec3| {
                let sign = if side & 1 == 0 { 1.0 } else { -1.0 };
                sign * corner[side / 2] - steepness * corner.z - TIP
            };
            polygon = polygon.cut(beyond)?;
        }
        Some(polygon)
    }

    /// Cuts off what lies beyond (Sutherland and Hodgman 1974).
    #[inline]
    fn cut(self, beyond: impl Fn(&DVec3) -> f64) -> Option<Self> {
        let corners = &self.corners[..self.count];
        let out_count = corners.iter().filter(|corner| beyond(corner) > 0.0).count();
        if out_count == 0 {
            return Some(self);
        }
        if out_count == self.count {
            return None;
        }
        let mut kept = Self { count: 0, ..self };
        for (number, corner) in corners.iter().enumerate() {
            let next = &corners[(number + 1) % self.count];
            let (here, there) = (beyond(corner), beyond(next));
            if here <= 0.0 {
                kept.push(*corner);
            }
            if (here <= 0.0) != (there <= 0.0) {
                kept.push(*corner + (*next - *corner) * (here / (here - there)));
            }
        }
        Some(kept)
    }

    fn push(&mut self, corner: DVec3) {
        // A convex polygon gains one corner a cut; rounding may give a spare one no room.
        if self.count < MOST_CORNERS {
            self.corners[self.count] = corner;
            self.count += 1;
        }
    }
}

/// Where something may lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// Corners of a convex polygon, in tiles; none if it may be everywhere in its box.
    places: [DVec2; MOST_CORNERS],
    count: usize,
    /// A box about all of it, inflated.
    pub(super) low: DVec2,
    pub(super) high: DVec2,
    /// Least and greatest depth.
    pub(super) depths: [f64; 2],
    /// By how much cells are inflated.
    pub(super) margin: f64,
}

impl Footprint {
    #[inline]
    pub(super) fn of_polygon(view: &View, polygon: Polygon) -> Self {
        let corners = &polygon.corners[..polygon.count];
        let mut depths = [f64::INFINITY, f64::NEG_INFINITY];
        for corner in corners {
            depths = [depths[0].min(corner.z), depths[1].max(corner.z)];
        }
        if view.is_face && depths[0] < CLOSEST {
            return Self::everywhere(view, depths);
        }
        let margin = view.margin(view.weight(depths[0]));
        let mut places = [DVec2::ZERO; MOST_CORNERS];
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (place, &corner) in places.iter_mut().zip(corners) {
            *place = view.place(corner);
            low = low.min(*place);
            high = high.max(*place);
        }
        Self {
            places,
            count: polygon.count,
            low: low - margin,
            high: high + margin,
            depths,
            margin,
        }
    }

    fn everywhere(view: &View, depths: [f64; 2]) -> Self {
        Self {
            places: [DVec2::ZERO; MOST_CORNERS],
            count: 0,
            low: DVec2::ZERO,
            high: DVec2::new(view.size[0] as f64, view.size[1] as f64),
            depths,
            margin: 0.0,
        }
    }

    /// A curved shape's: that of a box about it, or of the cube about a sphere, along the view's axes. `None` if
    /// the view does not show it.
    pub(super) fn of_curved(
        view: &View,
        frame: &Frame,
        occluders: &Occluders,
        surface: SurfaceId,
    ) -> Option<Self> {
        // More than the rounding of shapes and their boxes.
        const ROOM: f64 = 1e-9;
        let (center, half) = match occluders.sphere(surface) {
            Some(sphere) => {
                let radius = sphere.radius * frame.scale;
                (frame.point_in_frame(sphere.center), DVec3::splat(radius))
            }
            None => {
                let bounds = occluders.surface_bounds(surface);
                let half = 0.5 * frame.scale * bounds.size();
                let reach = view.axes.map(|axis| axis.abs().dot(half));
                (
                    frame.point_in_frame(bounds.center()),
                    DVec3::from_array(reach),
                )
            }
        };
        let middle = view.project(center);
        let (low, high) = (middle - half - ROOM, middle + half + ROOM);
        let depths = [low.z, high.z];
        let [near, far] = depths.map(|depth| view.weight(depth));
        if view.is_face {
            if far <= 0.0 {
                return None;
            }
            let steepness = 1.0 + BEYOND / view.scale;
            let is_beside =
                |axis: usize| low[axis] > steepness * far || high[axis] < -steepness * far;
            if is_beside(0) || is_beside(1) {
                return None;
            }
            if near < CLOSEST {
                return Some(Self::everywhere(view, depths));
            }
        } else if near < CLOSEST {
            // No surface of the scene.
            return Some(Self::everywhere(view, depths));
        }
        let margin = view.margin(near);
        let place = |x: f64, is_low: bool| {
            // Of the two the one that is farther out.
            let weight = if (x < 0.0) == is_low { near } else { far };
            x * view.scale / weight
        };
        let lowest = DVec2::new(place(low.x, true), place(low.y, true)) + view.shift;
        let highest = DVec2::new(place(high.x, false), place(high.y, false)) + view.shift;
        Some(Self {
            places: [DVec2::ZERO; MOST_CORNERS],
            count: 0,
            low: lowest - margin,
            high: highest + margin,
            depths,
            margin,
        })
    }

    /// Calls `visit` with column and row of every tile of the view that may hold a part of it, inflated.
    #[inline]
    pub(super) fn tiles(&self, view: &View, mut visit: impl FnMut([usize; 2])) {
        let [[left, right], [bottom, top]] = self.ranges(view);
        // A polygon meets all tiles of a row that is its whole height.
        if self.count == 0 || right - left <= 1 || top - bottom <= 1 {
            for row in bottom..top {
                (left..right).for_each(|column| visit([column, row]));
            }
            return;
        }
        let margin = self.margin;
        for row in bottom..top {
            let low = row as f64;
            let [first, last] = self.across([low - margin, low + 1.0 + margin]);
            let first = (first - margin).max(0.0) as usize;
            let end = (last + margin + 1.0).clamp(0.0, view.size[0] as f64) as usize;
            (first..end).for_each(|column| visit([column, row]));
        }
    }

    /// Returns the tiles along both axes that the box meets: the first, and the one after the last.
    #[inline]
    fn ranges(&self, view: &View) -> [[usize; 2]; 2] {
        std::array::from_fn(|axis| {
            let count = view.size[axis] as f64;
            let first = self.low[axis].clamp(0.0, count) as usize;
            let end = (self.high[axis] + 1.0).clamp(0.0, count) as usize;
            [first, end.max(first)]
        })
    }

    /// Returns what the polygon covers at any height between two lines.
    #[inline]
    fn across(&self, lines: [f64; 2]) -> [f64; 2] {
        let mut covered = [f64::INFINITY, f64::NEG_INFINITY];
        let mut join = |x: f64| covered = [covered[0].min(x), covered[1].max(x)];
        let places = &self.places[..self.count];
        let mut from = places[self.count - 1];
        for &to in places {
            if to.y >= lines[0] && to.y <= lines[1] {
                join(to.x);
            }
            for line in lines {
                let (below, above) = (from.y - line, to.y - line);
                if below * above < 0.0 {
                    join(from.x + (to.x - from.x) * (below / (below - above)));
                }
            }
            from = to;
        }
        covered
    }
}
