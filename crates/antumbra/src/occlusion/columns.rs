//! Blocker lists for all that a light sees, made at once: a table of columns of directions from the light.
//!
//! In: the surfaces, a light. Out: for each column the surfaces that may block a start in it, the nearest to the
//! light first, and the depth behind which one triangle blocks all. The tiles of [`Views`] are cut into
//! columns as fine as surfaces are small there. Invariant: what blocks a start that is located in a column is in
//! its list, unless the start lies behind that depth. Where voxels say nothing yet, columns answer: they
//! cost some hundred nanoseconds a surface once, and no tree. Absent here: voxels, queries, what a start is.

use antumbra_geometry::{LightShape, Occluders};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};

use super::gather::{self, Gathering, Seen};
use super::tables::{NONE, Tables};
use super::views::{Located as InTiles, Views, has_faces, whole};
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
pub(super) struct Tile(u32);

pub(super) const HALVING_BITS: u32 = 3;
pub(super) const MOST_HALVINGS: u32 = 5;

impl Tile {
    pub(super) fn new(first: usize, halvings: u32) -> Self {
        Self((first as u32) << HALVING_BITS | halvings)
    }

    #[inline(always)]
    pub(super) fn first(self) -> u32 {
        self.0 >> HALVING_BITS
    }

    #[inline(always)]
    pub(super) fn halvings(self) -> u32 {
        self.0 & ((1 << HALVING_BITS) - 1)
    }

    pub(super) fn column_count(self) -> usize {
        1 << (2 * self.halvings())
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) first: u32,
    /// All starts of a greater depth are blocked; infinite where none surely are.
    pub(super) full_from: f32,
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
pub(super) struct Entry {
    /// Starts of a smaller depth it does not block.
    pub(super) nearest: f32,
    pub(super) surface: u32,
}

impl Entry {
    pub(super) const NOTHING: Self = Self {
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

/// Tiles for a surface and for a query that is known to come, and the fewest and most of them.
const TILES_EACH: [f64; 2] = [0.5, 1.0 / 16.0];
const TILE_COUNT: [f64; 2] = [4_096.0, 65_536.0];
const TILES_IN_TESTS: f64 = 256.0;
/// Columns for a surface in a tile. Ten times more answer a tenth faster on the larger scenes, and cost three times
/// as much.
const FINENESS: f64 = 0.3;
/// So often they are made wider, four times each.
const TRIES: usize = 3;

/// What a surface costs, with the tables of all triangles. Amid surfaces, columns hold many large ones: so much was
/// measured on Lost Empire.
const SURFACE_NS: [u64; 2] = [600, 1_300];

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
    /// Makes the lists; `None` where they would be too long or take more than so many bytes, or no view suits the light.
    pub(crate) fn new(
        occluders: &Occluders,
        tables: &Tables<'_>,
        wanted: Wanted,
        most_bytes: u64,
    ) -> Option<Self> {
        let (frame, light) = (tables.frame, tables.light);
        let bounds = occluders.bounds();
        let count = wanted.tiles(occluders);
        let mut fineness = FINENESS;
        for _ in 0..TRIES {
            let views = Views::new(&bounds, frame, light, count)?;
            let made = Self::with(views, fineness, occluders, tables, most_bytes);
            if let Some(columns) = made {
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
        let has_faces = has_faces(&occluders.bounds(), frame, light);
        const TILE_NS: f64 = 20.0;
        let count = occluders.surface_count() as u64;
        SURFACE_NS[usize::from(has_faces)] * count + (TILE_NS * wanted.tiles(occluders)) as u64
    }

    /// Returns the least that making them may cost, in nanoseconds.
    pub(crate) fn least_price(occluders: &Occluders) -> u64 {
        SURFACE_NS[0] * occluders.surface_count() as u64
    }

    /// Returns the most bytes that [`Columns::new`] takes at its height.
    pub(crate) fn most_bytes(occluders: &Occluders, wanted: Wanted) -> u64 {
        let surface_count = occluders.surface_count();
        let tile_count = 2 * wanted.tiles(occluders) as usize;
        // As many again by rounding.
        let column_count = tile_count + (2.0 * FINENESS * surface_count as f64) as usize;
        let entries = gather::most_entries(surface_count, column_count);
        gather::height_bytes(surface_count, tile_count, column_count)
            + (entries * gather::ENTRY_BYTES) as u64
    }

    /// Returns about how many bytes they usually take, and at the height of their making.
    pub(crate) fn usual_bytes(occluders: &Occluders, wanted: Wanted) -> [u64; 2] {
        const USUAL_ENTRIES: usize = 5;
        let surface_count = occluders.surface_count();
        let tile_count = wanted.tiles(occluders) as usize;
        let column_count = tile_count + (FINENESS * surface_count as f64) as usize;
        let entries = USUAL_ENTRIES * surface_count;
        let taken = 4 * tile_count + 8 * (column_count + entries);
        let height = gather::height_bytes(surface_count, tile_count, column_count)
            + (entries * gather::ENTRY_BYTES) as u64;
        [taken as u64, height]
    }

    fn with(
        views: Views,
        fineness: f64,
        occluders: &Occluders,
        tables: &Tables<'_>,
        most_bytes: u64,
    ) -> Option<Self> {
        let seen = Seen::new(&views, occluders, tables);
        let tiles = seen.tiles(fineness)?;
        let mut gathering = Gathering::new(tables, &seen, &tiles, most_bytes)?;
        gathering.add_all(&views)?;
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

#[cfg(test)]
mod tests {
    use antumbra_geometry::{Cone, DVec3, Disk, Opacity, Sphere, Start, SurfaceId};
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
            let scene_tables = SceneTables::new(&occluders, &frame);
            let light_tables = LightTables::new(&occluders, &frame, &light);
            let tables = Tables::new(&occluders, &frame, &light, &scene_tables, &light_tables);
            let count = random.pick(&[100.0, 2_000.0, 20_000.0]);
            let fineness = random.pick(&[0.1, 3.0, 50.0]);
            let Some(views) = Views::new(&occluders.bounds(), &frame, &light, count) else {
                continue;
            };
            let Some(columns) = Columns::with(views, fineness, &occluders, &tables, u64::MAX)
            else {
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
