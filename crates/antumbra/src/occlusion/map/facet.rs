//! A surface as a tile of a light's view sees it.
//!
//! In: a view, a surface, a tile. Out: a [`Facet`], in `f32`, in units of the tile and from its middle: the lines of a
//! triangle's sides, its plane's depths, a box. Of sixteen cells at a time it tells which it may meet, which it covers
//! and between which depths it lies there. Invariants: a cell that it is said not to meet it does not meet, not even
//! inflated; a cell that it is said to cover it covers, inflated; depths hold what they say.
//!
//! Errors. With `H = (A, B, W)` of a corner, off by `2^-51`, the line of a side is `H_i x H_j`, off by
//! `2^-49 (|H_i| + |H_j|)` in each number. A line is used if its slope in a tile is `2^22` times what that does at the
//! places of a view, up to 2.1 along each axis: so it is right up to `2^-20` of a tile, and once more with what `f32`
//! adds for places in the tile (`2^-22`). [`ROOM`] is four times as much. Which side of a line is inside says the
//! exact side that the light is on.

use antumbra_geometry::{DVec2, DVec3, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::super::footprint::{Footprint, Polygon};
use super::super::forms::BOUND;
use super::super::tables::{NONE, Tables};
use super::super::views::View;

/// What places and lines in a tile may be off together, in tiles.
pub(super) const ROOM: f32 = 1.0 / (1u32 << 17) as f32;

/// Corners at most so many tiles away are compared with lines: a place, a slope and the line are off by `2^-20` each.
const FARTHEST: f32 = 4.0;

/// Sides are told whose slope is so many times the error of their numbers, for a unit of place.
const STEEPEST_ERROR: f64 = 1.0 / (1u64 << 26) as f64;

/// How the depth `Z` follows from the key of a plane, which is linear over a view.
#[derive(Clone, Copy, Debug)]
pub(super) enum Depths {
    /// The key is `Z`.
    Parallel,
    /// The key is `Z / W`, with `W = 1 + w Z`.
    Perspective(f64),
    /// The key is `-1 / Z`.
    Cube,
}

impl Depths {
    pub(super) fn of(view: &View) -> Self {
        match (view.is_face, view.w[1]) {
            (true, _) => Self::Cube,
            (false, 0.0) => Self::Parallel,
            (false, w) => Self::Perspective(w),
        }
    }

    pub(super) fn key(self, z: f64) -> f64 {
        match self {
            Self::Parallel => z,
            Self::Perspective(w) => z / (1.0 + w * z),
            Self::Cube => -1.0 / z,
        }
    }

    /// Returns by how much `Z` changes with the key, at most up to a depth.
    pub(super) fn steepness(self, z: f64) -> f64 {
        self.weight(z) * self.weight(z)
    }

    /// Returns what coordinates are divided by at a depth.
    pub(super) fn weight(self, z: f64) -> f64 {
        match self {
            Self::Parallel => 1.0,
            Self::Perspective(w) => 1.0 + w * z,
            Self::Cube => z,
        }
    }

    /// Returns the key of a start's depth.
    #[inline(always)]
    pub(super) fn key_of_start(self, z: f32) -> f32 {
        match self {
            Self::Parallel => z,
            Self::Perspective(w) => z / (1.0 + w as f32 * z),
            Self::Cube => -1.0 / z.max(f32::MIN_POSITIVE),
        }
    }

    #[inline(always)]
    fn depth<S: Simd>(self, simd: S, key: f32x16<S>) -> f32x16<S> {
        match self {
            Self::Parallel => key,
            Self::Perspective(w) => key / (key * -(w as f32) + 1.0),
            Self::Cube => f32x16::splat(simd, -1.0) / key,
        }
    }
}

/// A surface in a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) surface: u32,
    /// Whether it blocks everywhere and its sides are told.
    pub(super) is_whole: bool,
    /// Whether depths are those of its plane, and not between its nearest and farthest only.
    has_plane: bool,
    /// Whether all corners have places.
    has_places: bool,
    /// `x u + y v + z`, positive inside; the larger slope is 1. All 0 if they are not told.
    pub(super) sides: [[f32; 3]; 3],
    pub(super) corners: [[f32; 2]; 3],
    low: [f32; 2],
    high: [f32; 2],
    /// The key of its plane likewise.
    plane: [f32; 3],
    keys: [f32; 2],
    depths: [f32; 2],
}

/// Sixteen cells: their middles, and half a side, inflated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells<S: Simd> {
    pub(super) u: f32x16<S>,
    pub(super) v: f32x16<S>,
    pub(super) half: f32,
}

/// What a facet is to sixteen cells.
pub(super) struct Measured {
    pub(super) meets: u32,
    pub(super) covers: u32,
    pub(super) near: [f32; 16],
    pub(super) far: [f32; 16],
}

/// Sides of a triangle whose plane is used are at least so long, its normal is at least so much of their product.
/// Corners err by 2^-53, so the normal by `2^-50 / (LEAST_NORMAL LEAST_SIDE)` = 2^-30 at
/// most, and over the triangle, which is no longer than 3.5, its heights by [`HEIGHT_ERROR`]. Beyond the triangle the
/// plane is cut at the depths of its corners.
const LEAST_SIDE: f64 = 1.0 / 8192.0;
const LEAST_NORMAL: f64 = 1.0 / 128.0;
const HEIGHT_ERROR: f64 = 1.0 / (1u64 << 28) as f64;

impl Facet {
    /// `None` if the surface blocks nothing in the view. `middle` is the tile's, in tiles. Returns also by how much cells
    /// are to be inflated for it.
    pub(super) fn new(
        view: &View,
        depths: Depths,
        middle: DVec2,
        surface: SurfaceId,
        tables: &Tables<'_>,
    ) -> Option<(Self, f64)> {
        let (footprint, corners) = footprint(view, surface, tables)?;
        let narrow = |x: f64| x as f32;
        let [near, far] = footprint.depths;
        let mut facet = Self {
            surface: surface.0,
            is_whole: false,
            has_plane: false,
            has_places: false,
            sides: [[0.0; 3]; 3],
            corners: [[0.0; 2]; 3],
            low: (footprint.low - middle).to_array().map(narrow),
            high: (footprint.high - middle).to_array().map(narrow),
            plane: [0.0; 3],
            keys: [0.0; 2],
            depths: [narrow(near), narrow(far)],
        };
        if let Some(corners) = corners {
            let side = tables.side(surface.0 as usize).unwrap_or(0);
            let seen = corners.map(|corner| view.project(corner));
            let is_known = facet.tell_sides(view, middle, seen, side);
            facet.is_whole = is_known && tables.occluders.is_opaque_everywhere(surface);
            facet.tell_plane(view, depths, middle, corners, [near, far]);
        }
        Some((facet, footprint.margin))
    }

    fn tell_sides(&mut self, view: &View, middle: DVec2, seen: [DVec3; 3], side: i8) -> bool {
        let homogeneous = seen.map(|seen| DVec3::new(seen.x, seen.y, view.weight(seen.z)));
        let [a, b, c] = view.axes;
        // Of a triangle that winds as its place in the view the light is behind.
        let turn = -f64::from(side) * a.cross(b).dot(c).signum();
        if turn == 0.0 {
            return false;
        }
        let at = (middle - view.shift) / view.scale;
        let mut sides = [[0.0; 3]; 3];
        for number in 0..3 {
            let (from, to) = (homogeneous[number], homogeneous[(number + 1) % 3]);
            let line = turn * from.cross(to);
            let slope = line.x.abs().max(line.y.abs());
            let error = from.length() + to.length();
            // Not for NaN.
            let is_known = slope > view.scale * STEEPEST_ERROR * error;
            if !is_known {
                return false;
            }
            let value = (line.x * at.x + line.y * at.y + line.z) * view.scale;
            sides[number] = [line.x, line.y, value].map(|x| (x / slope) as f32);
        }
        self.sides = sides;
        self.has_places = homogeneous.iter().all(|seen| seen.z > 1.0 / 1024.0);
        if self.has_places {
            let place = |seen: DVec3| (view.place(seen) - middle).to_array().map(|x| x as f32);
            self.corners = seen.map(place);
        }
        true
    }

    /// The plane is `n . x + h = 0` along the view's axes; over a place `s = n_x A / W + n_y B / W` says its key.
    fn tell_plane(
        &mut self,
        view: &View,
        depths: Depths,
        middle: DVec2,
        [a, b, c]: [DVec3; 3],
        [near, far]: [f64; 2],
    ) {
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let size = normal.abs().max_element();
        let sides = [u, v].map(|side| side.abs().max_element());
        let is_good = sides.iter().all(|&side| side > LEAST_SIDE)
            && size > LEAST_NORMAL * sides[0] * sides[1];
        if !is_good {
            return;
        }
        let normal = normal / size;
        let n = view.axes.map(|axis| normal.dot(axis));
        let height = normal.dot(view.origin - a);
        let (below, add) = match depths {
            Depths::Parallel => (-n[2], height),
            Depths::Perspective(w) => (height * w - n[2], height),
            Depths::Cube => (height, n[2]),
        };
        if depths_are_extreme(depths, near) {
            return;
        }
        let at = (middle - view.shift) / view.scale;
        let slope = [n[0], n[1]].map(|x| x / (below * view.scale));
        let key = (n[0] * at.x + n[1] * at.y + add) / below;
        // What `f32` makes of the key, and what a height errs by, in depth: at a point of weight `W` the key errs by
        // `1 / (W below)` of that.
        let rounding =
            (key.abs() + slope[0].abs() + slope[1].abs()) * f64::from(f32::EPSILON) * 2.0;
        let weight = depths.weight(near).max(depths.weight(far));
        let error = rounding * depths.steepness(far) + HEIGHT_ERROR * weight / below.abs();
        // Not for NaN.
        let is_known = error <= f64::from(BOUND) / 2.0;
        if !is_known {
            return;
        }
        self.has_plane = true;
        self.plane = [slope[0], slope[1], key].map(|x| x as f32);
        self.keys = [near, far].map(|z| depths.key(z) as f32);
    }

    /// Tells of sixteen cells which it may meet, which it covers, and between which depths it lies there.
    #[inline(always)]
    pub(super) fn measure<S: Simd>(&self, simd: S, depths: Depths, cells: &Cells<S>) -> Measured {
        let half = cells.half;
        let mut is_out = cells.u.simd_lt(self.low[0] - half)
            | cells.u.simd_gt(self.high[0] + half)
            | cells.v.simd_lt(self.low[1] - half)
            | cells.v.simd_gt(self.high[1] + half);
        let mut covers = 0;
        if self.has_sides() {
            let mut least = f32x16::splat(simd, f32::INFINITY);
            for [x, y, z] in self.sides {
                let value = cells.u * x + (cells.v * y + z);
                let reach = (x.abs() + y.abs()) * half;
                is_out |= value.simd_lt(-reach);
                least = least.min(value - reach);
            }
            if self.is_whole {
                covers = least.simd_gt(0.0).to_bitmask() as u32;
            }
        }
        let meets = !(is_out.to_bitmask() as u32) & 0xffff;
        let (mut near, mut far) = ([self.depths[0]; 16], [self.depths[1]; 16]);
        if self.has_plane {
            let [x, y, z] = self.plane;
            let key = cells.u * x + (cells.v * y + z);
            let reach = (x.abs() + y.abs()) * half;
            let least = (key - reach).max(f32x16::splat(simd, self.keys[0]));
            let most = (key + reach).min(f32x16::splat(simd, self.keys[1]));
            // Beside the triangle the two may have passed each other.
            near = depths
                .depth(simd, least)
                .min(f32x16::splat(simd, self.depths[1]))
                .into();
            far = depths
                .depth(simd, most)
                .max(f32x16::splat(simd, self.depths[0]))
                .into();
        }
        for (near, far) in near.iter_mut().zip(&mut far) {
            (*near, *far) = (*near - BOUND, *far + BOUND);
        }
        Measured {
            meets,
            covers: covers & meets,
            near,
            far,
        }
    }

    /// Returns whether its sides are told.
    pub(super) fn has_sides(&self) -> bool {
        self.sides[0] != [0.0; 3]
    }

    /// Returns the depth before which it is nowhere.
    pub(super) fn nearest(&self) -> f32 {
        self.depths[0] - BOUND
    }

    /// Returns the slopes of its plane's key, and about which share of a cell's box its own has.
    pub(super) fn slope(&self, middle: [f32; 2], half: f32) -> Option<([f32; 2], f32)> {
        let share = |axis: usize| {
            let (low, high) = (middle[axis] - half, middle[axis] + half);
            (self.high[axis].min(high) - self.low[axis].max(low)).max(0.0)
        };
        let [x, y, _] = self.plane;
        self.has_plane.then(|| ([x, y], share(0) * share(1)))
    }

    /// Returns between which values its plane's key less a linear function is over a cell.
    pub(super) fn key_less(&self, slope: [f32; 2], middle: [f32; 2], half: f32) -> [f32; 2] {
        if !self.has_plane {
            return [f32::NEG_INFINITY, f32::INFINITY];
        }
        let [x, y] = [0, 1].map(|axis| self.plane[axis] - slope[axis]);
        let key = x * middle[0] + (y * middle[1] + self.plane[2]);
        let reach = (x.abs() + y.abs()) * half;
        [key - reach, key + reach]
    }

    /// Returns whether a side may come into a cell about this middle.
    #[inline(always)]
    pub(super) fn side_may_meet(&self, side: usize, [u, v]: [f32; 2], half: f32) -> bool {
        let [x, y, z] = self.sides[side];
        let value = x * u + (y * v + z);
        if value > (x.abs() + y.abs()) * half {
            return false;
        }
        if !self.has_places {
            return true;
        }
        let (from, to) = (self.corners[side], self.corners[(side + 1) % 3]);
        let half = half + ROOM;
        let is_beside = |axis: usize, middle: f32| {
            from[axis].min(to[axis]) > middle + half || from[axis].max(to[axis]) < middle - half
        };
        !is_beside(0, u) && !is_beside(1, v)
    }

    /// Returns whether a place is inside, `None` if a side's line comes near.
    #[inline(always)]
    pub(super) fn holds(&self, [u, v]: [f32; 2]) -> Option<bool> {
        let values = self.sides.map(|[x, y, z]| x * u + (y * v + z));
        let least = values[0].min(values[1]).min(values[2]);
        if least < -ROOM {
            Some(false)
        } else if least > ROOM {
            Some(true)
        } else {
            None
        }
    }

    /// Returns whether no place is inside both, up to lines of this one. `ends` are the positions of both triangles'
    /// corners.
    pub(super) fn parts_from(&self, other: &Self, [own, others]: [&[DVec3; 3]; 2]) -> bool {
        // Of corners far off `f32` does not tell on which side of a line they are.
        let is_near = |corner: &[f32; 2]| corner.iter().all(|x| x.abs() < FARTHEST);
        self.has_places
            && other.has_places
            && other.corners.iter().all(is_near)
            && self.sides.iter().enumerate().any(|(number, &[x, y, z])| {
                // A corner that both share lies exactly on the line.
                let ends = [own[number], own[(number + 1) % 3]];
                let mut corners = other.corners.iter().zip(others);
                corners.all(|(corner, position)| {
                    ends.contains(position) || x * corner[0] + (y * corner[1] + z) < -ROOM
                })
            })
    }
}

/// A key would not tell such a depth.
fn depths_are_extreme(depths: Depths, near: f64) -> bool {
    matches!(depths, Depths::Cube) && near < 1.0 / 1024.0
}

/// Returns where a surface lies in a view in which it may block, and the corners of a triangle, in the frame.
pub(super) fn footprint(
    view: &View,
    surface: SurfaceId,
    tables: &Tables<'_>,
) -> Option<(Footprint, Option<[DVec3; 3]>)> {
    let occluders = tables.occluders;
    if !occluders.is_opaque(surface) {
        return None;
    }
    let Some(side) = tables.side(surface.0 as usize) else {
        if tables.curved_number(surface) == NONE {
            return None;
        }
        let footprint = Footprint::of_curved(view, tables.frame, occluders, surface)?;
        return Some((footprint, None));
    };
    // A triangle whose plane holds the light blocks nothing; nor is one needed that repeats another.
    if side == 0
        || tables
            .joined()
            .is_some_and(|mesh| mesh.is_repeated(surface))
    {
        return None;
    }
    let corners = occluders.triangle_positions(surface)?;
    let corners = corners.map(|corner| tables.frame.point_in_frame(corner));
    let footprint = Footprint::of_polygon(view, Polygon::new(view, corners)?);
    Some((footprint, Some(corners)))
}
