//! What a light sees: a table of tiles, each a bundle of directions from the light.
//!
//! In: the scene's box, a light. Out: for each start the tile that it lies in, where in it and how deep, in `f32`
//! for many at a time; for surfaces the same projection in `f64`. Light from afar has one view, parallel or in
//! perspective; light among the surfaces has six, the faces of a cube about it (Haines and Greenberg 1986).
//!
//! A view has three axes `a`, `b`, `c` of length 1 at right angles, `c` away from the light, and an origin `o`.
//! With `A = a . (x - o)`, `B = b . (x - o)`, depth `Z = c . (x - o)` and `W = w0 + w1 Z` a point's place is
//! `(A / W, B / W)`, the same for all points of a line through the light. Along a segment towards the light
//! `Z` decreases.

use antumbra_geometry::{Bounds, DVec2, DVec3, LightShape};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use super::forms::BOUND;
use crate::accel::frame::Frame;

/// One projection, in the frame's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) axes: [DVec3; 3],
    pub(super) origin: DVec3,
    /// `W = w[0] + w[1] Z`.
    pub(super) w: [f64; 2],
    /// Tiles for a unit of place.
    pub(super) scale: f64,
    /// What is added then, in tiles.
    pub(super) shift: DVec2,
    /// Tiles along both axes.
    pub(super) size: [usize; 2],
    /// The number of the first tile.
    pub(super) first: usize,
    /// Whether places beyond the borders belong to other views.
    pub(super) is_face: bool,
    /// One more than any `|A / W|` in the view.
    steepest: f64,
}

/// All views of a light.
#[derive(Debug)]
pub(super) struct Views {
    pub(super) all: Vec<View>,
    locator: Locator,
}

/// The frame has its origin in the scene's middle.
fn is_among(scene: &Bounds, frame: &Frame, light_in_frame: DVec3) -> bool {
    let reach = 0.5 * frame.scale * scene.size().length();
    light_in_frame.length() <= FAR * reach
}

/// Where starts are, in `f32`.
#[derive(Clone, Copy, Debug)]
enum Locator {
    One {
        /// For each axis a form.
        rows: [[f32; 4]; 3],
        w: [f32; 2],
        scale: f32,
        shift: [f32; 2],
        size: [f32; 2],
        width: u32,
    },
    Cube {
        light: [f32; 3],
        size: u32,
    },
}

/// Where some starts are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located<const N: usize> {
    /// Numbers of tiles, [`NO_TILE`] for none.
    pub(super) tiles: [u32; N],
    /// Where in the tile, along both axes, from 0 to 1.
    pub(super) within: [[f32; N]; 2],
    pub(super) depths: [f32; N],
}

pub(super) const NO_TILE: u32 = u32::MAX;

/// The same for eight starts.
struct Eight<S: Simd> {
    tiles: u32x8<S>,
    within: [f32x8<S>; 2],
    depths: f32x8<S>,
}

/// A light so many times farther from the scene's middle than the scene reaches has one view: `W` is at
/// least a third in the scene.
const FAR: f64 = 1.5;
/// Starts of a smaller `W` have no tile: in one view they are outside the scene, near the light
/// of a cube they are too close for their place to be told well.
const LEAST_W: [f64; 2] = [0.25, 1.0 / 64.0];
/// The light of a cube is within so much of the middle, along each axis: forms are known up to [`BOUND`].
const FARTHEST: f64 = 3.0;
/// Tiles along an axis at most.
const MOST_ALONG: f64 = 512.0;
/// Places that rounding leads beyond a face are moved into the last of so many cells of a tile.
pub(super) const CELLS_ALONG_TILE: u32 = 64;
/// Tiles about what surfaces fill.
const BORDER: f64 = 1.0;

impl Views {
    /// Lays about so many tiles; `None` for lights that no view suits.
    pub(super) fn new(
        scene: &Bounds,
        frame: &Frame,
        light: &LightShape,
        tile_count: f64,
    ) -> Option<Self> {
        let one = |away: DVec3, w: [f64; 2]| {
            let view = View::one(scene, frame, away, w, tile_count)?;
            let narrow = |x: f64| x as f32;
            let row = |axis: usize| {
                let DVec3 { x, y, z } = view.axes[axis];
                [x, y, z, 0.0].map(narrow)
            };
            Some(Self {
                all: vec![view],
                locator: Locator::One {
                    rows: [row(0), row(1), row(2)],
                    w: w.map(narrow),
                    scale: narrow(view.scale),
                    shift: view.shift.to_array().map(narrow),
                    size: view.size.map(|size| size as f32),
                    width: view.size[0] as u32,
                },
            })
        };
        match *light {
            LightShape::Direction(direction) => one(-direction.normalize(), [1.0, 0.0]),
            LightShape::Point(light) => {
                let light = frame.point_in_frame(light);
                let distance = light.length();
                if !is_among(scene, frame, light) {
                    return one(-light / distance, [1.0, 1.0 / distance]);
                }
                (light.abs().max_element() < FARTHEST).then(|| Self::cube(light, tile_count))
            }
        }
    }

    fn cube(light: DVec3, tile_count: f64) -> Self {
        let size = (tile_count / 4.0).sqrt().ceil().clamp(8.0, 256.0) as usize;
        let half = 0.5 * size as f64;
        let all = (0..6).map(|face| {
            let axis = |number: usize| {
                DVec3::from_array(std::array::from_fn(|i| {
                    f64::from(u8::from(i == number % 3))
                }))
            };
            let (number, sign) = (face / 2, [1.0, -1.0][face % 2]);
            View {
                axes: [axis(number + 1), axis(number + 2), sign * axis(number)],
                origin: light,
                w: [0.0, 1.0],
                scale: half,
                shift: DVec2::splat(half),
                size: [size; 2],
                first: face * size * size,
                is_face: true,
                steepest: 2.1,
            }
        });
        Self {
            all: all.collect(),
            locator: Locator::Cube {
                light: light.to_array().map(|x| x as f32),
                size: size as u32,
            },
        }
    }

    pub(super) fn tile_count(&self) -> usize {
        let counts = self.all.iter().map(|view| view.size[0] * view.size[1]);
        counts.sum()
    }

    /// Returns where starts within the scene's box are, given coordinate by coordinate.
    ///
    /// The start itself is within [`View::margin`] of its place, and its depth is right up to [`BOUND`]: the rows
    /// are unit vectors, so they are forms as that bound is derived for.
    #[inline(always)]
    pub(super) fn locate<S: Simd, const N: usize>(
        &self,
        simd: S,
        places: &[[f32; N]; 3],
    ) -> Located<N> {
        let mut located = Located {
            tiles: [NO_TILE; N],
            within: [[0.0; N]; 2],
            depths: [0.0; N],
        };
        for first in (0..N).step_by(8) {
            let x = f32x8::from_slice(simd, &places[0][first..first + 8]);
            let y = f32x8::from_slice(simd, &places[1][first..first + 8]);
            let z = f32x8::from_slice(simd, &places[2][first..first + 8]);
            let Eight {
                tiles,
                within: [u, v],
                depths,
            } = match &self.locator {
                Locator::One { .. } => self.locator.in_one(simd, [x, y, z]),
                Locator::Cube { .. } => self.locator.in_cube(simd, [x, y, z]),
            };
            located.tiles[first..first + 8].copy_from_slice(tiles.as_slice());
            located.within[0][first..first + 8].copy_from_slice(u.as_slice());
            located.within[1][first..first + 8].copy_from_slice(v.as_slice());
            located.depths[first..first + 8].copy_from_slice(depths.as_slice());
        }
        located
    }
}

/// Added to a number below 2^22, this leaves the nearest whole one in the last bits.
const WHOLE: f32 = 12_582_912.0; // 3 * 2^22
const WHOLE_MASK: u32 = (1 << 22) - 1;

/// The whole part of numbers of `0..2^22`; of whole numbers perhaps the one below.
#[inline(always)]
pub(super) fn whole<S: Simd>(x: f32x8<S>) -> u32x8<S> {
    let bits: u32x8<S> = (x - 0.5 + WHOLE).to_bits();
    bits & WHOLE_MASK
}

impl Locator {
    #[inline(always)]
    fn in_one<S: Simd>(&self, simd: S, [x, y, z]: [f32x8<S>; 3]) -> Eight<S> {
        let Self::One {
            rows,
            w,
            scale,
            shift,
            size,
            width,
        } = self
        else {
            return Eight::nowhere(simd);
        };
        let depths = form(&rows[2], [x, y, z]);
        let weight = depths * w[1] + w[0];
        let rate = f32x8::splat(simd, *scale) / weight;
        let u = form(&rows[0], [x, y, z]) * rate + shift[0];
        let v = form(&rows[1], [x, y, z]) * rate + shift[1];
        // Not for NaN.
        let is_there = weight.simd_ge(LEAST_W[0] as f32)
            & u.simd_ge(0.0)
            & u.simd_lt(size[0])
            & v.simd_ge(0.0)
            & v.simd_lt(size[1]);
        let (column, row) = (whole(u), whole(v));
        Eight {
            tiles: is_there.select(row * *width + column, u32x8::splat(simd, NO_TILE)),
            within: [
                u - column.to_float::<f32x8<S>>(),
                v - row.to_float::<f32x8<S>>(),
            ],
            depths,
        }
    }

    #[inline(always)]
    fn in_cube<S: Simd>(&self, simd: S, [x, y, z]: [f32x8<S>; 3]) -> Eight<S> {
        let Self::Cube { light, size } = self else {
            return Eight::nowhere(simd);
        };
        let [x, y, z] = [x - light[0], y - light[1], z - light[2]];
        let depths = x.abs().max(y.abs()).max(z.abs());
        let is_x = x.abs().simd_ge(depths);
        let is_y = y.abs().simd_ge(depths);
        let a = is_x.select(y, is_y.select(z, x));
        let b = is_x.select(z, is_y.select(x, y));
        let along = is_x.select(x, is_y.select(y, z));
        let face = is_x.select(
            u32x8::splat(simd, 0),
            is_y.select(u32x8::splat(simd, 2), u32x8::splat(simd, 4)),
        );
        let is_behind = along.simd_lt(0.0);
        let face = face + is_behind.select(u32x8::splat(simd, 1), u32x8::splat(simd, 0));
        let half = 0.5 * *size as f32;
        let rate = f32x8::splat(simd, half) / depths;
        // Rounding may lead a little beyond a face.
        let last = f32x8::splat(simd, *size as f32 - 1.0 / CELLS_ALONG_TILE as f32);
        let u = (a * rate + half).max(f32x8::splat(simd, 0.0)).min(last);
        let v = (b * rate + half).max(f32x8::splat(simd, 0.0)).min(last);
        let (column, row) = (whole(u), whole(v));
        // Not for NaN.
        let is_there = depths.simd_ge(LEAST_W[1] as f32)
            & depths.simd_lt(8.0)
            & a.abs().simd_le(depths)
            & b.abs().simd_le(depths);
        let tiles = (face * *size + row) * *size + column;
        Eight {
            tiles: is_there.select(tiles, u32x8::splat(simd, NO_TILE)),
            within: [
                u - column.to_float::<f32x8<S>>(),
                v - row.to_float::<f32x8<S>>(),
            ],
            depths,
        }
    }
}

impl<S: Simd> Eight<S> {
    #[inline(always)]
    fn nowhere(simd: S) -> Self {
        Self {
            tiles: u32x8::splat(simd, NO_TILE),
            within: [f32x8::splat(simd, 0.0); 2],
            depths: f32x8::splat(simd, 0.0),
        }
    }
}

#[inline(always)]
fn form<S: Simd>(row: &[f32; 4], [x, y, z]: [f32x8<S>; 3]) -> f32x8<S> {
    x * row[0] + y * row[1] + (z * row[2] + row[3])
}

impl View {
    /// One view of a whole scene, `away` from the light.
    fn one(
        scene: &Bounds,
        frame: &Frame,
        away: DVec3,
        w: [f64; 2],
        tile_count: f64,
    ) -> Option<Self> {
        let (a, b) = away.any_orthonormal_pair();
        let mut view = Self {
            axes: [a, b, away],
            origin: DVec3::ZERO,
            w,
            scale: 1.0,
            shift: DVec2::ZERO,
            size: [1; 2],
            first: 0,
            is_face: false,
            steepest: 1.0,
        };
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in scene.corners() {
            let place = view.place(view.project(frame.point_in_frame(corner)));
            low = low.min(place);
            high = high.max(place);
        }
        let longest = (high - low).max_element();
        // A scene that is seen from its edge has tiles no longer than wide.
        let extent = (high - low).max(DVec2::splat((longest / 64.0).max(1.0 / 1024.0)));
        let scale = (tile_count / (extent.x * extent.y))
            .sqrt()
            .min((MOST_ALONG - 2.0 * BORDER) / longest);
        if !scale.is_finite() {
            return None;
        }
        if w[1] != 0.0 {
            let farthest = low.abs().max(high.abs()).max_element();
            view.steepest = 1.01 * (1.0 + farthest + 2.0 * BORDER / scale);
        }
        view.scale = scale;
        view.shift = DVec2::splat(BORDER) - low * scale;
        view.size = (extent * scale)
            .to_array()
            .map(|count| (count + 2.0 * BORDER).ceil() as usize);
        Some(view)
    }

    /// Returns `A`, `B` and `Z` of a point.
    #[inline]
    pub(super) fn project(&self, point: DVec3) -> DVec3 {
        let seen = point - self.origin;
        DVec3::new(
            self.axes[0].dot(seen),
            self.axes[1].dot(seen),
            self.axes[2].dot(seen),
        )
    }

    /// Returns `W` at a depth.
    #[inline]
    pub(super) fn weight(&self, depth: f64) -> f64 {
        self.w[0] + self.w[1] * depth
    }

    /// Returns a projected point's place, in tiles.
    #[inline]
    pub(super) fn place(&self, projected: DVec3) -> DVec2 {
        let rate = self.scale / self.weight(projected.z);
        DVec2::new(projected.x * rate, projected.y * rate) + self.shift
    }

    /// Returns by how much a part of the view is inflated, in tiles, to hold every start that is located in it and
    /// that something may block whose `W` is at least so much.
    ///
    /// `A`, `B` and `W` err by [`BOUND`] at most, so `A / W` errs by `(1 + |A / W|) BOUND / W` up to second
    /// order; twice that is more, as `W` is a thousand times its error. In parallel light only `A` errs. The
    /// last steps, in tiles, of which there are at most 2^9, err by `2^-13`.
    pub(super) fn margin(&self, weight: f64) -> f64 {
        let least = LEAST_W[usize::from(self.is_face)];
        2.0 * self.scale * f64::from(BOUND) * self.steepest / weight.max(least) + 1.0 / 2048.0
    }
}
