//! Which tiles of a light's view a surface may lie in.
//!
//! In: a view, a triangle or a curved shape. Out: every cell of a grid of squares that, inflated, holds a part of its
//! projection, and those that lie in it wholly. `f64` is off by 2^-40 of a tile here; margins are 2^-11 and
//! more.

use antumbra_geometry::{DVec2, DVec3, Occluders, SurfaceId};

use super::views::View;
use crate::frame::Frame;

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

/// A grid of square cells in a view: its tiles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Where it begins, in tiles.
    pub(super) origin: DVec2,
    /// Cells along both axes.
    pub(super) size: [usize; 2],
    /// Cells along the side of a tile.
    pub(super) fineness: f64,
}

impl Window {
    pub(super) fn tiles(view: &View) -> Self {
        Self {
            origin: DVec2::ZERO,
            size: view.size,
            fineness: 1.0,
        }
    }

    /// Returns the cells along both axes that a box meets: the first, and the one after the last.
    #[inline]
    fn ranges(&self, low: DVec2, high: DVec2) -> [[usize; 2]; 2] {
        let low = (low - self.origin) * self.fineness;
        let high = (high - self.origin) * self.fineness;
        std::array::from_fn(|axis| {
            let count = self.size[axis] as f64;
            let first = low[axis].clamp(0.0, count) as usize;
            let end = (high[axis] + 1.0).clamp(0.0, count) as usize;
            [first, end.max(first)]
        })
    }
}

/// A cell of a footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) at: [usize; 2],
    /// Whether all of the inflated cell lies in the footprint.
    pub(super) is_covered: bool,
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

    /// Calls `visit` with every cell.
    #[inline]
    pub(super) fn parts(&self, window: &Window, mut visit: impl FnMut(Part)) {
        let [[left, right], [bottom, top]] = window.ranges(self.low, self.high);
        // A polygon meets all cells of a row that is its whole height.
        if self.count == 0 || right - left <= 1 || top - bottom <= 1 {
            for row in bottom..top {
                for column in left..right {
                    visit(Part {
                        at: [column, row],
                        is_covered: false,
                    });
                }
            }
            return;
        }
        let (step, margin) = (1.0 / window.fineness, self.margin);
        for row in bottom..top {
            let low = window.origin.y + row as f64 * step;
            let [outer, inner] = self.across([low - margin, low + step + margin]);
            let [outer, inner] = [outer, inner].map(|range| range.map(|x| x - window.origin.x));
            let first = ((outer[0] - margin) * window.fineness).max(0.0) as usize;
            let end = (outer[1] + margin) * window.fineness + 1.0;
            let end = end.clamp(0.0, window.size[0] as f64) as usize;
            for column in first..end {
                let left = column as f64 * step;
                let is_covered = left - margin >= inner[0] && left + step + margin <= inner[1];
                visit(Part {
                    at: [column, row],
                    is_covered,
                });
            }
        }
    }

    /// Returns what the polygon covers at some heights between two lines, and at all.
    #[inline]
    fn across(&self, lines: [f64; 2]) -> [[f64; 2]; 2] {
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let join = |[low, high]: [f64; 2], x: f64| [low.min(x), high.max(x)];
        let mut between = NOTHING;
        let mut at = [NOTHING; 2];
        let places = &self.places[..self.count];
        let mut from = places[self.count - 1];
        for &to in places {
            if to.y >= lines[0] && to.y <= lines[1] {
                between = join(between, to.x);
            }
            for (line, at) in lines.iter().zip(&mut at) {
                let (below, above) = (from.y - line, to.y - line);
                if below * above < 0.0 {
                    let x = from.x + (to.x - from.x) * (below / (below - above));
                    *at = join(*at, x);
                }
            }
            from = to;
        }
        let outer = [
            between[0].min(at[0][0]).min(at[1][0]),
            between[1].max(at[0][1]).max(at[1][1]),
        ];
        // A convex set that holds both ends of an upright piece holds the piece.
        let inner = [at[0][0].max(at[1][0]), at[0][1].min(at[1][1])];
        [outer, inner]
    }
}
