//! Blocker lists for all that a light sees, made at once: a table of columns of directions from the light.
//!
//! In: the surfaces, a light. Out: for each column the surfaces that may block a start in it, the nearest to the
//! light first, and the depth behind which one triangle blocks all. The tiles of [`Views`] are cut into
//! columns as fine as surfaces are small there. Invariant: what blocks a start that is located in a column is in
//! its list, unless the start lies behind that depth. Where voxels say nothing yet, columns answer: they
//! cost some hundred nanoseconds a surface once, and no tree. Absent here: voxels, queries, what a start is.

use antumbra_geometry::{DVec2, DVec3, LightShape, Occluders, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use super::footprint::{Footprint, Part, Polygon, Window};
use super::forms::BOUND;
use super::tables::{NONE, Tables};
use super::views::{Located as InTiles, View, Views, has_faces, whole};
use crate::frame::Frame;

/// The lists of all columns of a light.
#[derive(Debug)]
pub(crate) struct Columns {
    pub(super) views: Views,
    tiles: Box<[Tile]>,
    /// One more than there are columns: a list ends where the next begins.
    heads: Box<[Head]>,
    /// The entries of all lists, and some more to be read in vain.
    nearest: Box<[f32]>,
    surfaces: Box<[u32]>,
}

/// The columns of a tile, row by row: the number of the first, and in the last bits how often the tile's sides are
/// halved.
#[derive(Clone, Copy, Debug)]
struct Tile(u32);

const HALVING_BITS: u32 = 3;
const MOST_HALVINGS: u32 = 5;

impl Tile {
    fn new(first: usize, halvings: u32) -> Self {
        Self((first as u32) << HALVING_BITS | halvings)
    }

    #[inline(always)]
    fn first(self) -> u32 {
        self.0 >> HALVING_BITS
    }

    #[inline(always)]
    fn halvings(self) -> u32 {
        self.0 & ((1 << HALVING_BITS) - 1)
    }

    fn column_count(self) -> usize {
        1 << (2 * self.halvings())
    }
}

#[derive(Clone, Copy, Debug)]
struct Head {
    first: u32,
    /// All starts of a greater depth are blocked; infinite where none surely are.
    full_from: f32,
}

/// Where some starts are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Located<const N: usize> {
    /// Numbers of columns, [`NO_COLUMN`] for none.
    pub(super) columns: [u32; N],
    pub(super) depths: [f32; N],
}

pub(super) const NO_COLUMN: u32 = u32::MAX;

/// A surface that may block starts of a column.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Starts of a smaller depth it does not block.
    nearest: f32,
    surface: u32,
}

impl Entry {
    const NOTHING: Self = Self {
        nearest: f32::INFINITY,
        surface: NONE,
    };
}

/// What a column tells of a depth.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Told<'a> {
    Shadowed,
    List(List<'a>),
}

/// The surfaces of a column, the nearest to the light first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct List<'a> {
    nearest: &'a [f32],
    surfaces: &'a [u32],
}

impl<'a> List<'a> {
    /// Returns the surfaces that may block a start of this depth.
    #[inline(always)]
    pub(super) fn near(self, depth: f32) -> impl Iterator<Item = u32> {
        let entries = self.nearest.iter().zip(self.surfaces);
        let near = entries.take_while(move |&(&nearest, _)| nearest <= depth);
        near.map(|(_, &surface)| surface)
    }

    /// Returns the same together.
    pub(super) fn all_near(self, depth: f32) -> &'a [u32] {
        let count = self.nearest.partition_point(|&nearest| nearest <= depth);
        &self.surfaces[..count]
    }
}

/// An entry and its column.
#[derive(Clone, Copy, Debug)]
struct Placed {
    column: u32,
    entry: Entry,
}

/// Tiles for a surface and for a query that is known to come, and the fewest and most of them.
const TILES_EACH: [f64; 2] = [0.5, 1.0 / 16.0];
const TILE_COUNT: [f64; 2] = [4_096.0, 65_536.0];
const TILES_IN_TESTS: f64 = 256.0;
/// Columns for a surface in a tile. Ten times more answer a tenth faster on the larger scenes, and cost three times
/// as much.
const FINENESS: f64 = 0.3;
/// Entries for a surface and for a column at most: beyond that columns are made wider.
const MOST_ENTRIES: [usize; 2] = [32, 12];
/// So often they are made wider, four times each.
const TRIES: usize = 3;

/// Surfaces in so many columns of a tile are taken as a whole.
const SMALL: usize = 4;
/// Those in so many tiles may cover some.
const LARGE: usize = 9;
/// Twice the area in tiles below which a triangle's plane may hold the light.
const NARROW: f64 = 1e-4;

/// Depths in `f32` that are off by [`BOUND`] are compared with what is so much less or more.
const DEPTH_ROOM: f64 = 2.0 * BOUND as f64;

/// How fine columns are to be.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Wanted {
    /// As fine as pays, with so many queries known to come.
    For(u64),
    /// For tests, where many scenes have columns, each of them for a few queries.
    Few,
}

impl Wanted {
    fn tiles(self, occluders: &Occluders) -> f64 {
        match self {
            Self::For(queries) => {
                let for_surfaces = TILES_EACH[0] * occluders.surface_count() as f64;
                let for_queries = TILES_EACH[1] * queries as f64;
                for_surfaces
                    .max(for_queries)
                    .clamp(TILE_COUNT[0], TILE_COUNT[1])
            }
            Self::Few => TILES_IN_TESTS,
        }
    }
}

impl Columns {
    /// Makes the lists; `None` where they would be too long, or no view suits the light.
    pub(crate) fn new(occluders: &Occluders, tables: &Tables<'_>, wanted: Wanted) -> Option<Self> {
        let (frame, light) = (tables.frame, tables.light);
        let bounds = occluders.bounds();
        let count = wanted.tiles(occluders);
        let mut fineness = FINENESS;
        for _ in 0..TRIES {
            let views = Views::new(&bounds, frame, light, count)?;
            if let Some(columns) = Self::with(views, fineness, occluders, tables) {
                return Some(columns);
            }
            fineness /= 4.0;
        }
        None
    }

    /// Returns about what making them costs, in nanoseconds.
    pub(crate) fn price(
        occluders: &Occluders,
        frame: &Frame,
        light: &LightShape,
        wanted: Wanted,
    ) -> u64 {
        // With the tables of all triangles. Amid surfaces, columns hold many large ones: so much was measured on
        // Lost Empire.
        const SURFACE_NS: [u64; 2] = [600, 1_300];
        let has_faces = has_faces(&occluders.bounds(), frame, light);
        const TILE_NS: f64 = 20.0;
        let count = occluders.surface_count() as u64;
        SURFACE_NS[usize::from(has_faces)] * count + (TILE_NS * wanted.tiles(occluders)) as u64
    }

    /// Returns about how many bytes they will take.
    pub(crate) fn predict_bytes(occluders: &Occluders) -> u64 {
        const USUAL_ENTRIES: f64 = 5.0;
        let lists = (USUAL_ENTRIES + FINENESS) * occluders.surface_count() as f64;
        (8.0 * lists + 12.0 * TILE_COUNT[1]) as u64
    }

    fn with(
        views: Views,
        fineness: f64,
        occluders: &Occluders,
        tables: &Tables<'_>,
    ) -> Option<Self> {
        let seen = Seen::new(&views, occluders, tables);
        let tiles = seen.tiles(fineness)?;
        let mut full_from = Vec::new();
        for (tile, &tile_full_from) in tiles.iter().zip(&seen.full_from) {
            full_from.extend(std::iter::repeat_n(tile_full_from, tile.column_count()));
        }
        let column_count = full_from.len();
        let mut gathering = Gathering {
            tables,
            tiles: &tiles,
            tiles_full_from: &seen.full_from,
            full_from,
            placed: Vec::with_capacity(3 * (occluders.surface_count() + column_count) / 2),
            most: MOST_ENTRIES[0] * occluders.surface_count() + MOST_ENTRIES[1] * column_count,
        };
        for part in &seen.parts {
            gathering.add(&views.all[usize::from(part.view)], SurfaceId(part.surface))?;
        }
        let (heads, entries) = gathering.in_order();
        Some(Self {
            views,
            tiles: tiles.into(),
            heads,
            nearest: entries.iter().map(|entry| entry.nearest).collect(),
            surfaces: entries.iter().map(|entry| entry.surface).collect(),
        })
    }

    /// Returns in which columns starts within the scene's box are, given coordinate by coordinate.
    #[inline(always)]
    pub(super) fn locate<S: Simd, const N: usize>(
        &self,
        simd: S,
        places: &[[f32; N]; 3],
    ) -> Located<N> {
        let InTiles {
            mut tiles,
            within,
            depths,
        } = self.views.locate(simd, places);
        for tile in &mut tiles {
            // Of none, a number that no tile has.
            *tile = self
                .tiles
                .get(*tile as usize)
                .map_or(NO_COLUMN, |&Tile(tile)| tile);
        }
        let mut columns = [0; N];
        for first in (0..N).step_by(8) {
            let tile = u32x8::from_slice(simd, &tiles[first..first + 8]);
            let halvings = tile & ((1 << HALVING_BITS) - 1);
            // Two to that power.
            let along = f32x8::from_bits((halvings + 127) << 23);
            let u = f32x8::from_slice(simd, &within[0][first..first + 8]);
            let v = f32x8::from_slice(simd, &within[1][first..first + 8]);
            let last = along - 0.5;
            let column = whole((u * along).max(f32x8::splat(simd, 0.0)).min(last));
            let row = whole((v * along).max(f32x8::splat(simd, 0.0)).min(last));
            // The whole part of a number and a quarter is the number.
            let in_tile = row * whole(along + 0.25) + column;
            let is_there = tile.simd_lt(NO_COLUMN);
            let column = is_there.select(
                (tile >> HALVING_BITS) + in_tile,
                u32x8::splat(simd, NO_COLUMN),
            );
            columns[first..first + 8].copy_from_slice(column.as_slice());
        }
        Located { columns, depths }
    }

    /// Returns what is told of a start of this depth in a column.
    #[inline(always)]
    pub(super) fn told(&self, column: u32, depth: f32) -> Told<'_> {
        let (full_from, first, end) = self.list_of(column);
        if depth > full_from {
            return Told::Shadowed;
        }
        let all = first as usize..end as usize;
        Told::List(List {
            nearest: &self.nearest[all.clone()],
            surfaces: &self.surfaces[all],
        })
    }

    /// So many entries may be read at once from where a list starts.
    pub(super) const SPARE: usize = 8;

    /// Returns the depth behind which all starts of a column are blocked, where its list starts and ends.
    #[inline(always)]
    pub(super) fn list_of(&self, column: u32) -> (f32, u32, u32) {
        let Head { first, full_from } = self.heads[column as usize];
        (full_from, first, self.heads[column as usize + 1].first)
    }

    /// Returns some entries from a number on, of whatever lists: how near they are, and the surfaces.
    #[inline(always)]
    pub(super) fn entries_from(&self, first: u32) -> (&[f32], &[u32]) {
        let some = first as usize..first as usize + Self::SPARE;
        (&self.nearest[some.clone()], &self.surfaces[some])
    }

    pub(crate) fn bytes(&self) -> u64 {
        let Self {
            views: _,
            tiles,
            heads,
            nearest,
            surfaces,
        } = self;
        (size_of_val(&**tiles)
            + size_of_val(&**heads)
            + size_of_val(&**nearest)
            + size_of_val(&**surfaces)) as u64
    }
}

/// What a view shows of surfaces.
struct Seen {
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
    fn new(views: &Views, occluders: &Occluders, tables: &Tables<'_>) -> Self {
        let mut seen = Self {
            full_from: vec![f32::INFINITY; views.tile_count()],
            parts: Vec::with_capacity(occluders.surface_count()),
        };
        for (number, view) in views.all.iter().enumerate() {
            let window = Window::tiles(view);
            for surface in occluders.surfaces() {
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
    fn tiles(&self, fineness: f64) -> Option<Vec<Tile>> {
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
struct Gathering<'a> {
    tables: &'a Tables<'a>,
    tiles: &'a [Tile],
    tiles_full_from: &'a [f32],
    full_from: Vec<f32>,
    placed: Vec<Placed>,
    most: usize,
}

impl Gathering<'_> {
    /// Puts a surface into all columns of a view in which it may block; `None` if there are too many entries.
    fn add(&mut self, view: &View, surface: SurfaceId) -> Option<()> {
        let Some((footprint, corners)) = footprint(view, surface, self.tables) else {
            return Some(());
        };
        let is_whole = self.tables.occluders.is_opaque_everywhere(surface);
        let nearest = (footprint.depths[0] - DEPTH_ROOM) as f32;
        let mut plane = None;
        footprint.parts(&Window::tiles(view), |Part { at, is_covered: _ }| {
            let tile_number = view.first + at[1] * view.size[0] + at[0];
            if nearest > self.tiles_full_from[tile_number] {
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
                if entry.nearest <= *full_from {
                    self.placed.push(Placed {
                        column: column as u32,
                        entry,
                    });
                }
            });
        });
        (self.placed.len() <= self.most).then_some(())
    }

    /// Sorts what is needed by column and depth (counting sort, then each list by itself).
    fn in_order(self) -> (Box<[Head]>, Vec<Entry>) {
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

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Cone, Disk, Opacity, Sphere, Start};
    use fearless_simd::{Level, dispatch};

    use super::super::forms::START_ROOM;
    use super::super::tables::{LightTables, SceneTables};
    use super::super::testing::Random;
    use super::*;

    /// Triangles of all sizes that share corners, panes, balls, a cone, a disk; numbers are whole half the time.
    fn scene(random: &mut Random) -> Occluders {
        let mut builder = Occluders::builder();
        let is_whole = random.below(2) == 0;
        let point = |random: &mut Random| {
            let point = 3.0 * random.in_cube();
            if is_whole { point.round() } else { point }
        };
        let mut pool: Vec<DVec3> = (0..7).map(|_| point(random)).collect();
        for _ in 0..5 {
            let near = pool[random.below(pool.len())];
            pool.push(near + random.pick(&[1e-6, 0.01, 0.1]) * random.in_cube());
        }
        let opacity = |random: &mut Random| match random.below(6) {
            0 => Opacity::Transparent,
            _ => Opacity::Opaque,
        };
        for _ in 0..1 + random.below(12) {
            let corners = [(); 3].map(|()| pool[random.below(pool.len())]);
            builder.add_face(&corners, opacity(random)).expect("a face");
        }
        for _ in 0..random.below(4) {
            let center = point(random);
            let radius = random.pick(&[0.01, 0.2, 0.5, 1.0]);
            let sphere = Sphere { center, radius };
            builder
                .add_sphere(sphere, opacity(random))
                .expect("a sphere");
        }
        if random.below(3) == 0 {
            let disk = Disk {
                center: point(random),
                normal: random.in_cube(),
                radius: 0.7,
            };
            builder.add_disk(disk, Opacity::Opaque).expect("a disk");
            let cone = Cone {
                base: DVec3::ZERO,
                base_radius: 0.5,
                apex: DVec3::new(0.3, 1.0, 0.2),
                apex_radius: 0.2,
                is_closed: random.below(2) == 0,
            };
            builder.add_cone(cone, Opacity::Opaque).expect("a cone");
        }
        builder.build()
    }

    /// A start anywhere, on a surface, at the border of a shadow or of a column.
    fn start(
        occluders: &Occluders,
        frame: &Frame,
        light: &LightShape,
        views: &Views,
        random: &mut Random,
    ) -> Start {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        let corners = occluders.triangle_positions(surface);
        let on_surface = |random: &mut Random| match (corners, occluders.sphere(surface)) {
            (Some([a, b, c]), _) => {
                let (s, t) = random.pick(&[(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.5, 0.0)]);
                let (s, t) = match random.below(3) {
                    0 => (s, t),
                    _ => (random.real(0.0, 1.0), random.real(0.0, 1.0)),
                };
                a + s * (b - a) + t * (1.0 - s) * (c - a)
            }
            (None, Some(sphere)) => {
                sphere.center + sphere.radius * random.in_cube().normalize_or_zero()
            }
            (None, None) => random.in_box(&occluders.surface_bounds(surface)),
        };
        let has_place = corners.is_some() || occluders.sphere(surface).is_some();
        let point = match random.below(4) {
            0 if has_place => {
                return Start {
                    point: on_surface(random),
                    surface: Some(surface),
                };
            }
            1 => {
                let edge = on_surface(random);
                let away = -light.towards(edge).normalize_or_zero();
                edge + random.pick(&[1e-6, 1e-3, 1.0]) * random.real(0.0, 2.0) * away
            }
            2 => {
                let view = views.all[random.below(views.all.len())];
                let place = [0, 1].map(|axis| {
                    let tile = random.below(view.size[axis] + 1) as f64;
                    tile + random.pick(&[0.0, 0.0, 0.25, 1.0 / 32.0])
                        + random.pick(&[0.0, 1e-6, -1e-6])
                        - view.shift[axis]
                });
                let depth = random.real(-1.0, 1.0);
                let weight = view.weight(depth) / view.scale;
                let seen = view.axes[0] * place[0] * weight
                    + view.axes[1] * place[1] * weight
                    + view.axes[2] * depth;
                frame.center + (view.origin + seen) / frame.scale
            }
            _ => random.in_box(&occluders.bounds()),
        };
        Start {
            point,
            surface: None,
        }
    }

    /// A light anywhere, or on a triangle but for rounding, or close to it.
    fn light(occluders: &Occluders, random: &mut Random) -> LightShape {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        match occluders.triangle_positions(surface) {
            Some([a, b, c]) if random.below(3) == 0 => {
                let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                let off = random.pick(&[0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3]);
                let on_triangle = a + s * (b - a) + t * (1.0 - s) * (c - a);
                LightShape::Point(on_triangle + off * random.in_cube())
            }
            _ => random.light(&occluders.bounds()),
        }
    }

    #[test]
    fn what_blocks_is_listed_and_full_is_blocked() {
        let random = &mut Random(1);
        let (mut full_count, mut listed_count, mut left_out_count) = (0, 0, 0);
        for _ in 0..1_500 {
            let occluders = scene(random);
            if occluders.bounds().size().max_element() < 0.1 {
                continue;
            }
            let frame = Frame::new(occluders.bounds());
            let light = light(&occluders, random);
            let scene_tables = SceneTables::new(&occluders);
            let light_tables = LightTables::new(&occluders, &frame, &light);
            let tables = Tables::new(&occluders, &frame, &light, &scene_tables, &light_tables);
            let count = random.pick(&[100.0, 2_000.0, 20_000.0]);
            let fineness = random.pick(&[0.1, 3.0, 50.0]);
            let Some(views) = Views::new(&occluders.bounds(), &frame, &light, count) else {
                continue;
            };
            let Some(columns) = Columns::with(views, fineness, &occluders, &tables) else {
                continue;
            };
            for _ in 0..150 {
                let given = start(&occluders, &frame, &light, &columns.views, random);
                let room = START_ROOM / frame.scale;
                let mut moved = given;
                if given.surface.is_none() {
                    moved.point += room * random.of_cube();
                }
                let segment = occluders.segment(&moved, &light);
                let x = frame
                    .point_in_frame(given.point)
                    .to_array()
                    .map(|x| x as f32);
                // As far as starts are asked about that are where they seem to be.
                let off = (segment.origin() - given.point).abs().max_element();
                if x.iter().any(|x| x.abs() > 1.25) || off > room {
                    continue;
                }
                let located =
                    dispatch!(Level::new(), simd => columns.locate(simd, &x.map(|x| [x; 8])));
                let (column, depth) = (located.columns[0], located.depths[0]);
                if column == NO_COLUMN {
                    continue;
                }
                let blocking: Vec<SurfaceId> = occluders
                    .surfaces()
                    .filter(|&surface| occluders.blocks(surface, &segment))
                    .collect();
                match columns.told(column, depth) {
                    Told::Shadowed => {
                        assert!(!blocking.is_empty(), "{light:?} {given:?} {moved:?}");
                        full_count += 1;
                    }
                    Told::List(listed) => {
                        left_out_count += occluders.surface_count() - listed.all_near(depth).len();
                        for surface in blocking {
                            assert!(
                                listed.all_near(depth).contains(&surface.0),
                                "{surface:?} {light:?} {given:?} {moved:?}"
                            );
                            listed_count += 1;
                        }
                    }
                }
            }
        }
        assert!(
            full_count > 3_000 && listed_count > 10_000 && left_out_count > 100_000,
            "{full_count} {listed_count} {left_out_count}"
        );
    }
}
