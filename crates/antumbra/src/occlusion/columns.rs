//! Blocker lists for all that a light sees, made at once: a table of columns of directions from the light.
//!
//! In: the surfaces, a light. Out: for each column of [`Views`] the surfaces that may block a start in it, the
//! nearest to the light first, and the depth behind which one triangle blocks all. Invariant: what blocks a
//! start that is located in a column is in its list, unless the start lies behind that depth. Where voxels
//! say nothing yet, columns answer: they cost some hundred nanoseconds a surface once, and no tree.
//! Absent here: voxels, queries, what a start is.

use antumbra_geometry::{DVec3, LightShape, Occluders, SurfaceId};

use super::footprint::{Footprint, Part, Polygon};
use super::forms::BOUND;
use super::tables::{NONE, Tables};
use super::views::{View, Views, has_faces};
use crate::frame::Frame;

/// The lists of all columns of a light.
#[derive(Debug)]
pub(crate) struct Columns {
    pub(super) views: Views,
    /// One more than there are columns: a list ends where the next begins.
    heads: Box<[Head]>,
    entries: Box<[Entry]>,
}

#[derive(Clone, Copy, Debug)]
struct Head {
    first: u32,
    /// All starts of a greater depth are blocked; infinite where none surely are.
    full_from: f32,
}

/// A surface that may block starts of a column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Starts of a smaller depth it does not block.
    pub(crate) nearest: f32,
    pub(crate) surface: u32,
}

/// What a column tells of a depth.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Told<'a> {
    Shadowed,
    /// The surfaces that may block, and farther ones.
    List(&'a [Entry]),
}

/// An entry and its column.
#[derive(Clone, Copy, Debug)]
struct Placed {
    column: u32,
    entry: Entry,
}

/// Columns for a surface, and the fewest and most of them.
const COLUMNS_EACH: f64 = 3.0;
const COLUMN_COUNT: [f64; 2] = [65_536.0, 524_288.0];
/// In tests many scenes have columns, each of them for a few queries.
const COLUMNS_IN_TESTS: f64 = 2_048.0;
/// Entries for a surface and for a column at most: beyond that columns are made wider.
const MOST_ENTRIES: [usize; 2] = [32, 12];
/// So often they are made wider, four times each.
const TRIES: usize = 4;

/// Surfaces in so many columns are taken as a whole.
const SMALL: usize = 4;
/// Twice the area in columns below which a triangle's plane may hold the light.
const NARROW: f64 = 1e-3;

/// Depths in `f32` that are off by [`BOUND`] are compared with what is so much less or more.
const DEPTH_ROOM: f64 = 2.0 * BOUND as f64;

impl Columns {
    /// Makes the lists; `None` where they would be too long, or no view suits the light.
    pub(crate) fn new(
        occluders: &Occluders,
        tables: &Tables<'_>,
        is_for_tests: bool,
    ) -> Option<Self> {
        let (frame, light) = (tables.frame, tables.light);
        let bounds = occluders.bounds();
        let mut count = if is_for_tests {
            COLUMNS_IN_TESTS
        } else {
            wanted(occluders)
        };
        for _ in 0..TRIES {
            let views = Views::new(&bounds, frame, light, count)?;
            if let Some(columns) = Self::with(views, occluders, tables) {
                return Some(columns);
            }
            count /= 4.0;
        }
        None
    }

    /// Returns about what making them costs, in nanoseconds.
    pub(crate) fn price(occluders: &Occluders, frame: &Frame, light: &LightShape) -> u64 {
        // With the tables that their lists are the first to ask for. Amid large surfaces, columns hold many of
        // them: so much was measured on Lost Empire.
        const SURFACE_NS: [u64; 2] = [500, 2_000];
        let has_faces = has_faces(&occluders.bounds(), frame, light);
        const COLUMN_NS: f64 = 10.0;
        let count = occluders.surface_count() as u64;
        SURFACE_NS[usize::from(has_faces)] * count + (COLUMN_NS * wanted(occluders)) as u64
    }

    /// Returns about how many bytes they will take.
    pub(crate) fn predict_bytes(occluders: &Occluders) -> u64 {
        const USUAL_ENTRIES: u64 = 8;
        let lists = wanted(occluders) as u64 + USUAL_ENTRIES * occluders.surface_count() as u64;
        8 * lists
    }

    fn with(views: Views, occluders: &Occluders, tables: &Tables<'_>) -> Option<Self> {
        let column_count = views.column_count();
        let mut gathering = Gathering {
            occluders,
            tables,
            full_from: vec![f32::INFINITY; column_count],
            placed: Vec::with_capacity(2 * (occluders.surface_count() + column_count)),
            most: MOST_ENTRIES[0] * occluders.surface_count() + MOST_ENTRIES[1] * column_count,
        };
        for view in &views.all {
            for surface in occluders.surfaces() {
                gathering.add(view, surface)?;
            }
        }
        let (heads, entries) = gathering.in_order();
        Some(Self {
            views,
            heads,
            entries,
        })
    }

    /// Returns what is told of a start of this depth in a column.
    #[inline(always)]
    pub(super) fn told(&self, column: u32, depth: f32) -> Told<'_> {
        let head = self.heads[column as usize];
        if depth > head.full_from {
            return Told::Shadowed;
        }
        let end = self.heads[column as usize + 1].first;
        Told::List(&self.entries[head.first as usize..end as usize])
    }

    pub(crate) fn bytes(&self) -> u64 {
        let Self {
            views: _,
            heads,
            entries,
        } = self;
        (size_of_val(&**heads) + size_of_val(&**entries)) as u64
    }
}

/// Returns how many columns there should be.
fn wanted(occluders: &Occluders) -> f64 {
    let wanted = COLUMNS_EACH * occluders.surface_count() as f64;
    wanted.clamp(COLUMN_COUNT[0], COLUMN_COUNT[1])
}

/// Surfaces on their way into columns.
struct Gathering<'a> {
    occluders: &'a Occluders,
    tables: &'a Tables<'a>,
    full_from: Vec<f32>,
    placed: Vec<Placed>,
    most: usize,
}

impl Gathering<'_> {
    /// Puts a surface into all columns of a view in which it may block; `None` if there are too many entries.
    fn add(&mut self, view: &View, surface: SurfaceId) -> Option<()> {
        if !self.occluders.is_opaque(surface) {
            return Some(());
        }
        match self.occluders.triangle_positions(surface) {
            Some(corners) => self.add_triangle(view, surface, corners),
            None => {
                if self.tables.curved_number(surface) == NONE {
                    return Some(());
                }
                match Footprint::of_curved(view, self.tables.frame, self.occluders, surface) {
                    Some(footprint) => self.fill(view, surface, &footprint, None),
                    None => Some(()),
                }
            }
        }
    }

    fn add_triangle(&mut self, view: &View, surface: SurfaceId, corners: [DVec3; 3]) -> Option<()> {
        let frame = self.tables.frame;
        let corners = corners.map(|corner| frame.point_in_frame(corner));
        let Some(polygon) = Polygon::new(view, corners) else {
            return Some(());
        };
        let footprint = Footprint::of_polygon(view, polygon);
        // Seen from its edge it may block nothing: where its plane holds the light.
        if footprint.area().abs() < NARROW && self.tables.side(surface.0 as usize) == Some(0) {
            return Some(());
        }
        // Of small ones the whole is about as near as its part in a column.
        if footprint.part_count_at_most() <= SMALL {
            return self.fill(view, surface, &footprint, None);
        }
        let plane = Plane::new(view, corners);
        let plane = plane.map(|plane| (plane, self.occluders.is_opaque_everywhere(surface)));
        self.fill(view, surface, &footprint, plane)
    }

    /// Puts a surface with a footprint into its columns.
    fn fill(
        &mut self,
        view: &View,
        SurfaceId(surface): SurfaceId,
        footprint: &Footprint,
        plane: Option<(Plane, bool)>,
    ) -> Option<()> {
        let nearest = footprint.depths[0] - DEPTH_ROOM;
        let mut reach = 0.0;
        if let Some((plane, _)) = plane {
            reach = plane.reach(0.5 + footprint.margin, view);
        }
        let (full_from, placed) = (&mut self.full_from, &mut self.placed);
        footprint.parts(view, |Part { at, is_covered }| {
            let column = view.first + at[1] * view.size[0] + at[0];
            let mut entry = Entry {
                nearest: nearest as f32,
                surface,
            };
            if let Some((plane, is_whole)) = plane
                && let Some([near, far]) = plane.depths(view, at, reach)
            {
                entry.nearest = entry.nearest.max((near - DEPTH_ROOM) as f32);
                if is_covered && is_whole {
                    let far = far.min(footprint.depths[1]) + DEPTH_ROOM;
                    let full = &mut full_from[column];
                    *full = full.min(far as f32);
                }
            }
            if entry.nearest <= full_from[column] {
                placed.push(Placed {
                    column: column as u32,
                    entry,
                });
            }
        });
        (self.placed.len() <= self.most).then_some(())
    }

    /// Sorts what is needed by column and depth (counting sort, then each list by itself).
    fn in_order(self) -> (Box<[Head]>, Box<[Entry]>) {
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
        let nothing = Entry {
            nearest: 0.0,
            surface: NONE,
        };
        let mut entries = vec![nothing; sum as usize];
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
        (heads.into(), entries.into())
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

    /// Returns by how much `s` differs within so many columns along each axis.
    fn reach(&self, columns: f64, view: &View) -> f64 {
        (self.normal.x.abs() + self.normal.y.abs()) * columns / view.scale
    }

    /// Returns the least and the greatest depth over a column, if they are told well.
    #[inline]
    fn depths(&self, view: &View, at: [usize; 2], reach: f64) -> Option<[f64; 2]> {
        let rate = 1.0 / view.scale;
        let [u, v] = [0, 1].map(|axis| (at[axis] as f64 + 0.5 - view.shift[axis]) * rate);
        let s = self.normal.x * u + self.normal.y * v;
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
    use super::super::views::NO_COLUMN;
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
                    random.below(view.size[axis] + 1) as f64 + random.pick(&[0.0, 1e-6, -1e-6])
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
            let Some(views) = Views::new(&occluders.bounds(), &frame, &light, count) else {
                continue;
            };
            let Some(columns) = Columns::with(views, &occluders, &tables) else {
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
                    dispatch!(Level::new(), simd => columns.views.locate(simd, &x.map(|x| [x; 8])));
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
                    Told::List(entries) => {
                        let near = entries.iter().take_while(|entry| entry.nearest <= depth);
                        let listed: Vec<u32> = near.map(|entry| entry.surface).collect();
                        left_out_count += occluders.surface_count() - listed.len();
                        for surface in blocking {
                            assert!(
                                listed.contains(&surface.0),
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
