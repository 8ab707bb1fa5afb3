//! Surfaces on their way into the columns of a light.
//!
//! In: the views of a light, its surfaces. Out: which tiles a triangle covers, how finely each tile is cut, and the
//! entries of all columns in order. Nothing is proven here but that what is left out blocks nothing.

use antumbra_geometry::{DVec2, DVec3, Occluders, SurfaceId};
use antumbra_task::checked;

use super::columns::{Columns, Entry, HALVING_BITS, Head, MOST_HALVINGS, Tile};
use super::footprint::{Footprint, Part, Polygon, Window};
use super::forms::BOUND;
use super::tables::{NONE, Tables};
use super::views::{View, Views};

/// Entries for a surface and for a column at most: beyond that columns are made wider.
const MOST_ENTRIES: [usize; 2] = [32, 12];

/// Returns how many entries there are at most.
pub(super) fn most_entries(surface_count: usize, column_count: usize) -> usize {
    MOST_ENTRIES[0] * surface_count + MOST_ENTRIES[1] * column_count
}

/// Bytes of an entry at the height of making columns: with its column in a vector that grows, in order, and once more
/// where it stays.
pub(super) const ENTRY_BYTES: usize =
    3 * size_of::<Placed>() + size_of::<Entry>() + 2 * size_of::<u32>();

/// Returns the other bytes: of what a view shows of the surfaces, and of tiles and columns.
pub(super) fn height_bytes(surface_count: usize, tile_count: usize, column_count: usize) -> u64 {
    let parts = 2 * size_of::<SeenPart>() * surface_count;
    let tiles = (2 * size_of::<f32>() + 2 * size_of::<Tile>()) * tile_count;
    let columns = (2 * size_of::<f32>() + 2 * size_of::<Head>()) * column_count;
    (parts + tiles + columns) as u64
}

/// Surfaces in so many columns of a tile are taken as a whole.
const SMALL: usize = 4;
/// Those in so many tiles may cover some.
const LARGE: usize = 9;
/// Twice the area in tiles below which a triangle's plane may hold the light.
const NARROW: f64 = 1e-4;

/// Depths in `f32` that are off by [`BOUND`] are compared with what is so much less or more.
const DEPTH_ROOM: f64 = 2.0 * BOUND as f64;

/// An entry and its column.
#[derive(Clone, Copy, Debug)]
struct Placed {
    column: u32,
    entry: Entry,
}

/// What a view shows of surfaces.
pub(super) struct Seen {
    /// For each tile the depth behind which one triangle blocks all.
    full_from: Vec<f32>,
    parts: Vec<SeenPart>,
}

/// What a view shows of a surface.
#[derive(Clone, Copy, Debug)]
struct SeenPart {
    surface: u32,
    view: u8,
    /// The tile of its middle.
    tile: u32,
    nearest: f32,
}

impl Seen {
    pub(super) fn new(views: &Views, occluders: &Occluders, tables: &Tables<'_>) -> Self {
        let mut seen = Self {
            full_from: vec![f32::INFINITY; views.tile_count()],
            parts: Vec::with_capacity(occluders.surface_count()),
        };
        for (number, view) in views.all.iter().enumerate() {
            let window = Window::tiles(view);
            for surface in checked(occluders.surfaces()) {
                let Some((footprint, plane)) = footprint(view, surface, tables) else {
                    continue;
                };
                if footprint.part_count_at_most(&window) >= LARGE
                    && occluders.is_opaque_everywhere(surface)
                    && let Some(plane) = plane.and_then(|corners| Plane::new(view, corners))
                {
                    seen.cover(view, &window, &footprint, &plane);
                }
                let middle = footprint.middle();
                let at = [0, 1].map(|axis| (middle[axis] as usize).min(view.size[axis] - 1));
                seen.parts.push(SeenPart {
                    surface: surface.0,
                    view: number as u8,
                    tile: (view.first + at[1] * view.size[0] + at[0]) as u32,
                    nearest: (footprint.depths[0] - DEPTH_ROOM) as f32,
                });
            }
        }
        seen
    }

    /// Notes which tiles a triangle covers.
    fn cover(&mut self, view: &View, window: &Window, footprint: &Footprint, plane: &Plane) {
        let reach = plane.reach(0.5 + footprint.margin, view);
        footprint.parts(window, |Part { at, is_covered }| {
            if is_covered && let Some([_, far]) = plane.depths(view, window.middle(at), reach) {
                let far = far.min(footprint.depths[1]) + DEPTH_ROOM;
                let full_from = &mut self.full_from[view.first + at[1] * view.size[0] + at[0]];
                *full_from = full_from.min(far as f32);
            }
        });
    }

    /// Cuts tiles into columns, about so many for each surface; `None` if there are more than can be told.
    pub(super) fn tiles(&self, fineness: f64) -> Option<Vec<Tile>> {
        let mut counts = vec![0_u32; self.full_from.len()];
        for part in &self.parts {
            let is_hidden = part.nearest > self.full_from[part.tile as usize];
            counts[part.tile as usize] += u32::from(!is_hidden);
        }
        let mut first = 0;
        let tiles = counts.iter().map(|&count| {
            let along = (fineness * f64::from(count)).max(1.0).sqrt();
            let halvings = (along.log2().round() as u32).min(MOST_HALVINGS);
            let tile = Tile::new(first, halvings);
            first += tile.column_count();
            tile
        });
        let tiles = tiles.collect();
        (first < 1 << (31 - HALVING_BITS)).then_some(tiles)
    }
}

/// Returns where a surface lies in a view in which it may block, and the corners of a triangle.
fn footprint(
    view: &View,
    surface: SurfaceId,
    tables: &Tables<'_>,
) -> Option<(Footprint, Option<[DVec3; 3]>)> {
    let occluders = tables.occluders;
    if !occluders.is_opaque(surface) {
        return None;
    }
    let Some(corners) = occluders.triangle_positions(surface) else {
        if tables.curved_number(surface) == NONE {
            return None;
        }
        let footprint = Footprint::of_curved(view, tables.frame, occluders, surface)?;
        return Some((footprint, None));
    };
    let corners = corners.map(|corner| tables.frame.point_in_frame(corner));
    let footprint = Footprint::of_polygon(view, Polygon::new(view, corners)?);
    // Seen from its edge it may block nothing: where its plane holds the light.
    let is_narrow = footprint.area().abs() < NARROW;
    if is_narrow && tables.side(surface.0 as usize) == Some(0) {
        return None;
    }
    Some((footprint, Some(corners)))
}

/// Surfaces on their way into columns.
pub(super) struct Gathering<'a> {
    tables: &'a Tables<'a>,
    tiles: &'a [Tile],
    seen: &'a Seen,
    full_from: Vec<f32>,
    placed: Vec<Placed>,
    most: usize,
}

impl<'a> Gathering<'a> {
    /// `None` if so many bytes hold no entry.
    pub(super) fn new(
        tables: &'a Tables<'a>,
        seen: &'a Seen,
        tiles: &'a [Tile],
        most_bytes: u64,
    ) -> Option<Self> {
        let mut full_from = Vec::new();
        for (tile, &tile_full_from) in tiles.iter().zip(&seen.full_from) {
            full_from.extend(std::iter::repeat_n(tile_full_from, tile.column_count()));
        }
        let (surface_count, column_count) = (tables.occluders.surface_count(), full_from.len());
        let others = height_bytes(surface_count, tiles.len(), column_count);
        let most_bytes = most_bytes.checked_sub(others)? as usize;
        let most = most_entries(surface_count, column_count).min(most_bytes / ENTRY_BYTES);
        Some(Self {
            tables,
            tiles,
            seen,
            full_from,
            placed: Vec::with_capacity((3 * (surface_count + column_count) / 2).min(most)),
            most,
        })
    }

    /// Puts all surfaces into their columns; `None` if there are too many entries.
    pub(super) fn add_all(&mut self, views: &Views) -> Option<()> {
        checked(&self.seen.parts).try_for_each(|part| {
            self.add(&views.all[usize::from(part.view)], SurfaceId(part.surface))
        })
    }

    /// Puts a surface into all columns of a view in which it may block; `None` if there are too many entries.
    fn add(&mut self, view: &View, surface: SurfaceId) -> Option<()> {
        let Some((footprint, corners)) = footprint(view, surface, self.tables) else {
            return Some(());
        };
        let is_whole = self.tables.occluders.is_opaque_everywhere(surface);
        let nearest = (footprint.depths[0] - DEPTH_ROOM) as f32;
        let (mut plane, mut is_full) = (None, false);
        footprint.parts(&Window::tiles(view), |Part { at, is_covered: _ }| {
            let tile_number = view.first + at[1] * view.size[0] + at[0];
            if nearest > self.seen.full_from[tile_number] {
                return;
            }
            let tile = self.tiles[tile_number];
            let along = 1 << tile.halvings();
            let window = Window::columns(at, along);
            // Of small ones the whole is about as near as its part in a column.
            let is_small = footprint.part_count_at_most(&window) <= SMALL;
            let plane = match corners {
                Some(corners) if !is_small => {
                    *plane.get_or_insert_with(|| Plane::new(view, corners))
                }
                _ => None,
            };
            let reach = plane.map_or(0.0, |plane| {
                plane.reach(0.5 / along as f64 + footprint.margin, view)
            });
            let first = tile.first() as usize;
            footprint.parts(&window, |Part { at, is_covered }| {
                let column = first + at[1] * along + at[0];
                let mut entry = Entry {
                    nearest,
                    surface: surface.0,
                };
                let full_from = &mut self.full_from[column];
                if let Some(plane) = plane
                    && let Some([near, far]) = plane.depths(view, window.middle(at), reach)
                {
                    entry.nearest = entry.nearest.max((near - DEPTH_ROOM) as f32);
                    if is_covered && is_whole {
                        let far = far.min(footprint.depths[1]) + DEPTH_ROOM;
                        *full_from = full_from.min(far as f32);
                    }
                }
                let has_room = self.placed.len() < self.most;
                is_full |= !has_room;
                if entry.nearest <= *full_from && has_room {
                    self.placed.push(Placed {
                        column: column as u32,
                        entry,
                    });
                }
            });
        });
        (!is_full).then_some(())
    }

    /// Sorts what is needed by column and depth (counting sort, then each list by itself).
    pub(super) fn in_order(self) -> (Box<[Head]>, Vec<Entry>) {
        let is_needed =
            |placed: &&Placed| placed.entry.nearest <= self.full_from[placed.column as usize];
        let mut ends = vec![0_u32; self.full_from.len() + 1];
        for placed in self.placed.iter().filter(is_needed) {
            ends[placed.column as usize + 1] += 1;
        }
        let mut heads = Vec::with_capacity(ends.len());
        let mut sum = 0;
        for (column, end) in ends.iter_mut().enumerate() {
            sum += *end;
            *end = sum;
            heads.push(Head {
                first: sum,
                full_from: self.full_from.get(column).copied().unwrap_or(f32::INFINITY),
            });
        }
        let mut entries = vec![Entry::NOTHING; sum as usize + Columns::SPARE];
        for placed in self.placed.iter().filter(is_needed) {
            let end = &mut ends[placed.column as usize];
            entries[*end as usize] = placed.entry;
            *end += 1;
        }
        for pair in heads.windows(2) {
            let list = &mut entries[pair[0].first as usize..pair[1].first as usize];
            if list.len() > 1 {
                list.sort_unstable_by(|a, b| a.nearest.total_cmp(&b.nearest));
            }
        }
        (heads.into(), entries)
    }
}

/// A triangle's plane in a view: the depth is `-(e + w0 s) / (c + w1 s)` with `s = a u + b v` at the place
/// `(u, v)`. So over a column it is between those at the least and the greatest `s`.
#[derive(Clone, Copy, Debug)]
struct Plane {
    /// The normal along the axes, largest component 1 in the frame.
    normal: DVec3,
    height: f64,
}

/// Denominators of depths are at least so much.
const FLATTEST: f64 = 1.0 / 256.0;
/// Sides of a triangle whose plane is used are at least so long, and its normal at least so much of their
/// product. Corners in the frame err by 2^-53, so the normal errs by `2^-50 / (LEAST_NORMAL LEAST_SIDE)` =
/// 2^-33, the terms of a depth by 8 times that, and depths by 2^-22, a sixteenth of [`BOUND`].
const LEAST_SIDE: f64 = 1.0 / 1024.0;
const LEAST_NORMAL: f64 = 1.0 / 128.0;

impl Plane {
    /// `None` if `f64` does not tell the normal well.
    fn new(view: &View, corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let normal = u.cross(v);
        let size = normal.abs().max_element();
        let sides = [u, v].map(|side| side.abs().max_element());
        let is_good = sides.iter().all(|&side| side > LEAST_SIDE)
            && size > LEAST_NORMAL * sides[0] * sides[1];
        is_good.then(|| {
            let normal = normal / size;
            Self {
                normal: DVec3::from_array(view.axes.map(|axis| normal.dot(axis))),
                height: normal.dot(view.origin - a),
            }
        })
    }

    /// Returns by how much `s` differs within so many tiles along each axis.
    fn reach(&self, tiles: f64, view: &View) -> f64 {
        (self.normal.x.abs() + self.normal.y.abs()) * tiles / view.scale
    }

    /// Returns the least and the greatest depth about a place in tiles, if they are told well.
    #[inline]
    fn depths(&self, view: &View, middle: DVec2, reach: f64) -> Option<[f64; 2]> {
        let place = (middle - view.shift) / view.scale;
        let s = self.normal.x * place.x + self.normal.y * place.y;
        let (low, high) = (s - reach, s + reach);
        let below = |s: f64| self.normal.z + view.w[1] * s;
        let (below_low, below_high) = (below(low), below(high));
        if below_low * below_high <= 0.0
            || below_low.abs() < FLATTEST
            || below_high.abs() < FLATTEST
        {
            return None;
        }
        let depth = |s: f64, below: f64| -(self.height + view.w[0] * s) / below;
        let (one, other) = (depth(low, below_low), depth(high, below_high));
        Some([one.min(other), one.max(other)])
    }
}
