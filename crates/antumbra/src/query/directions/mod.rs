//! Many directions of light from afar, which many points share: the suns of a year, the patches of a sky.
//!
//! In: a batch of points, [`DirectionSet`]. Out: a bit a pair, 1 where light arrives. Invariant: every bit is that of
//! [`ShadowIndex::shadow`] for the point and a light in that direction, for any method, any number of threads, and
//! however points and directions are grouped. Points are taken in tiles, directions in cells: what a tile and a cell may
//! meet of the tree is found once (`accel/bvh/beam/sheaf.rs`), and often is nothing. Absent here: where suns stand, and
//! what hours are made of bits.

mod bits;
mod cells;
mod tiles;

use antumbra_geometry::{Occluders, ReceiverPoint, SurfaceId, sides_of_normal};

use super::beam::{AskedBlock, WORD, word_count};
use super::run::{Run, check_length};
use crate::accel::bvh::{Asked, AskedDirection, Bvh, Cut, Memory, OfTile, Reach, Sheaf, Tile};
use crate::limits::is_fine;
use crate::threads::{self, prelude::*};
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, Method, ReceiverSide,
    ShadowIndex,
};
use bits::transpose;
use cells::Cell;

/// Fewest and most starts that a thread takes at a time.
const CHUNK: [usize; 2] = [256, 16_384];

/// Chunks a thread, so that threads that are done early find more.
const CHUNKS_A_THREAD: usize = 4;

/// Tiles of more starts go direction by direction, smaller ones start by start.
const FEW: usize = tiles::FEW;

/// For fewer directions, starts on several triangles are not told what lies below them: it would cost more than it spares.
const MANY_DIRECTIONS: usize = 1024;

/// Largest side of a tile of many starts, in the largest of the scene's box.
const NEAR: f64 = 1.0 / 24.0;

/// Directions towards light from afar, prepared for [`ShadowIndex::visible_directions`].
///
/// Any number, any lengths; the same direction may be there twice. Takes some 90 bytes a direction.
#[derive(Clone, Debug)]
pub struct DirectionSet {
    count: usize,
    cells: Vec<Cell>,
}

impl DirectionSet {
    /// Prepares directions towards the light.
    ///
    /// # Errors
    /// A direction is not finite or beyond 2^100: [`BatchError::BadTarget`] names the first.
    pub fn new<P: Coordinates>(directions: &[P]) -> Result<Self, BatchError> {
        let directions: Vec<_> = directions
            .iter()
            .map(|direction| direction.as_f64())
            .collect();
        if let Some(index) = directions.iter().position(|&direction| !is_fine(direction)) {
            return Err(BatchError::BadTarget {
                what: "direction",
                index,
                found: directions[index],
            });
        }
        Ok(Self {
            count: directions.len(),
            cells: cells::cells(&directions),
        })
    }

    /// Returns how many there are.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the numbers of all directions in an order in which neighbors in the sky follow each other.
    pub fn order(&self) -> impl Iterator<Item = u32> {
        self.cells
            .iter()
            .flat_map(|cell| cell.numbers.iter().copied())
    }

    /// Returns the words that the bits of a point take: one for each 64 directions, the last one for the rest.
    pub fn word_count(&self) -> usize {
        word_count(self.count)
    }
}

impl ShadowIndex {
    /// Answers from which of many directions light arrives at every point of a batch: bit `i % 64`, counted from the
    /// lowest, of word `i / 64` of a point is 1 where nothing opaque is between the point and a light far away in direction
    /// `i`. Bits beyond the last direction are 0. The words of a point lie together, point after point,
    /// [`DirectionSet::word_count`] each.
    ///
    /// `side` says which directions are asked about: those on that side of the point's surface, or of the normal, by the
    /// exact sign. The bits of others are 0. Points with normals that face ([`BatchKind::Facing`]) are asked about what is
    /// on the normal's side, whatever `side` says; points of space without a normal about all.
    ///
    /// Needs no values, whatever the method, and changes none. Points may come in any order; it is faster where the points
    /// of some thousand in a row are near each other. Runs on all threads of the current rayon pool; answers and errors do
    /// not depend on them. Under `counters.shadow`, `first_pass` counts the pairs that were answered for a group of points
    /// at once, and `rays` the others.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{Batch, DirectionSet, Occluders, Opacity, ReceiverSide, ShadowIndex};
    ///
    /// // A wall in the west of a yard, and three suns: in the east, in the zenith, low in the west.
    /// let mut surfaces = Occluders::builder();
    /// let yard = [[0.0, -9.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0_f64]];
    /// let yard = surfaces.add_mesh(&yard, &[[0, 1, 2]], Opacity::Opaque)?;
    /// let wall = [[0.0, -9.0, 0.0], [0.0, 9.0, 0.0], [0.0, 0.0, 9.0_f64]];
    /// surfaces.add_mesh(&wall, &[[0, 1, 2]], Opacity::Opaque)?;
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), Vec::new()).build()?;
    ///
    /// let suns = DirectionSet::new(&[[1.0, 0.0, 0.2], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.2]])?;
    /// let points = [[1.0, 0.0, 0.0]];
    /// let mut visible = [0];
    /// let on_yard = [yard.start];
    /// let batch = Batch::on_surfaces(&points, &on_yard);
    /// index.visible_directions(&batch, &suns, ReceiverSide::Front, &mut visible)?;
    /// assert_eq!(visible, [0b011]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Lengths do not fit, or a point has no answer; of several the first is named. `visible` may be written in parts
    /// then.
    pub fn visible_directions<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        directions: &DirectionSet,
        side: ReceiverSide,
        visible: &mut [u64],
    ) -> Result<BatchCounters, BatchError> {
        self.visible_directions_by(batch, directions, |_| side, visible)
    }

    /// Answers as [`ShadowIndex::visible_directions`] does, with a side for each point, told by its number.
    ///
    /// # Errors
    /// As [`ShadowIndex::visible_directions`].
    pub fn visible_directions_by<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        directions: &DirectionSet,
        side_of: impl Fn(usize) -> ReceiverSide + Sync,
        visible: &mut [u64],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        let count = batch.points.len();
        let stride = directions.word_count();
        let expected = count.saturating_mul(stride);
        check_length("words of output", expected, visible.len())?;
        let mut sum = BatchCounters::default();
        if stride == 0 {
            for index in 0..count {
                run.start(index)?;
            }
            return Ok(sum);
        }
        let share = count / (CHUNKS_A_THREAD * threads::count());
        let length = share.clamp(CHUNK[0], CHUNK[1]);
        let near = NEAR * self.occluders().bounds().size().max_element();
        let task = antumbra_task::current();
        let answer = |work: &mut Work, first: usize, visible: &mut [u64]| {
            let count = visible.len() / stride;
            let (mut starts, mut sides) = (Vec::with_capacity(count), Vec::with_capacity(count));
            for index in first..first + count {
                antumbra_task::check();
                starts.push(run.start(index)?);
                sides.push(match batch.kind {
                    BatchKind::Facing { normals } => ReceiverSide::Normal(normals[index].as_f64()),
                    _ => side_of(index),
                });
            }
            let mut counted = BatchCounters::default();
            tiles::tiles(&starts, &sides, near, |tile, is_one| {
                antumbra_task::check();
                let numbers = || tile.iter().map(|&number| number as usize);
                work.starts.clear();
                work.starts.extend(numbers().map(|number| starts[number]));
                work.sides.clear();
                work.sides.extend(numbers().map(|number| sides[number]));
                let asked = work.answer(is_one, &mut counted.counters);
                if let BatchKind::Facing { .. } = batch.kind {
                    let pairs = (tile.len() * directions.count) as u64;
                    counted.facing_away += pairs - asked;
                }
                work.write(|place| tile[place] as usize, visible);
            });
            Ok(counted)
        };
        let counted: Vec<Result<BatchCounters, BatchError>> = visible
            .par_chunks_mut(length * stride)
            .enumerate()
            .map_init(
                || Work::new(self, directions),
                |work, (number, visible)| task.enter(|| answer(work, number * length, visible)),
            )
            .collect();
        // The first error is that of the first point at fault.
        for counted in counted {
            let counted = counted?;
            sum.counters.add(&counted.counters);
            sum.facing_away += counted.facing_away;
        }
        Ok(sum)
    }
}

/// What a thread works with.
struct Work<'a> {
    index: &'a ShadowIndex,
    directions: &'a DirectionSet,
    /// The tree, if starts can share walks in it.
    bvh: Option<&'a Bvh>,
    /// One for each cell.
    sheaves: Vec<Sheaf>,
    memory: Memory,
    /// What is remembered of each direction, and not of each cell.
    by_direction: Memory,
    tile: Tile,
    cut: Cut,
    /// The starts of the tile, and on which side each is asked.
    starts: Vec<ReceiverPoint>,
    sides: Vec<ReceiverSide>,
    /// The triangle that each start is on and the only side asked about; of one start alone likewise.
    one_sides: Vec<Option<(SurfaceId, i8)>>,
    /// Which directions of each cell are asked about, start after start; of one start alone where they are the same for all.
    asked: Vec<u64>,
    /// For each direction the starts that it reaches.
    columns: Vec<u64>,
}

impl<'a> Work<'a> {
    fn new(index: &'a ShadowIndex, directions: &'a DirectionSet) -> Self {
        let is_walked = match index.method() {
            Method::Auto | Method::Voxel | Method::Bvh => index.parts.is_whole(),
            Method::Voxel1990 | Method::Grid | Method::Naive => false,
        };
        let bvh = index.bvh().filter(|bvh| is_walked && bvh.takes_sheaves());
        let cells = &directions.cells;
        let sheaves = bvh.map(|bvh| cells.iter().map(|cell| Sheaf::new(bvh, &cell.block)));
        Self {
            index,
            directions,
            bvh,
            sheaves: sheaves.into_iter().flatten().collect(),
            memory: Memory::new(cells.len()),
            by_direction: Memory::new(directions.count),
            tile: Tile::new(),
            cut: Cut::default(),
            starts: Vec::with_capacity(WORD),
            sides: Vec::with_capacity(WORD),
            one_sides: Vec::with_capacity(WORD),
            asked: Vec::new(),
            columns: vec![0; directions.word_count() * WORD],
        }
    }

    /// Answers the starts of a tile into the columns; `is_one` says that all are on one triangle and are asked about the
    /// same side. Returns how many pairs were asked about.
    fn answer(&mut self, is_one: bool, counters: &mut Counters) -> u64 {
        let cells = &self.directions.cells;
        let occluders = self.index.occluders();
        let own = self.starts[0].surface;
        let is_one = is_one && own.is_some_and(|own| (own.0 as usize) < occluders.triangle_count());
        let starts = if is_one { 1 } else { self.starts.len() };
        self.asked.clear();
        for place in 0..starts {
            let (start, side) = (&self.starts[place], self.sides[place]);
            for cell in cells {
                self.asked.push(on_side(occluders, start, side, cell));
            }
        }
        if let Some(bvh) = self.bvh {
            self.one_sides.clear();
            let side_of = |(start, side): (&ReceiverPoint, &ReceiverSide)| match side {
                ReceiverSide::Front => Some((start.surface?, 1)),
                ReceiverSide::Back => Some((start.surface?, -1)),
                ReceiverSide::Both | ReceiverSide::Normal(_) => None,
            };
            let sides = self.starts.iter().zip(&self.sides).take(starts);
            let sides = sides.map(side_of);
            if is_one || self.directions.count >= MANY_DIRECTIONS {
                self.one_sides.extend(sides);
            }
            self.tile
                .hold(bvh, &self.index.parts.near, &self.starts, &self.one_sides);
        }
        self.columns.fill(0);
        let near = &*self.index.parts.near;
        let has_own_rule =
            |start: &ReceiverPoint| start.surface.is_some_and(|own| near.has_own_rule(own));
        let are_plain = !self.starts.iter().any(has_own_rule);
        let is_many = are_plain && self.starts.len() > FEW;
        let all_starts = u64::MAX >> (WORD - self.starts.len());
        let mut pairs = 0;
        for (number, cell) in cells.iter().enumerate() {
            let asked = |place: usize| self.asked[place % starts * cells.len() + number];
            let mut words: [u64; WORD] = [0; WORD];
            let mut count = 0;
            for (place, word) in words.iter_mut().enumerate().take(self.starts.len()) {
                *word = asked(place);
                count += u64::from(word.count_ones());
            }
            if count == 0 {
                continue;
            }
            pairs += count;
            let mut sheaf = self.bvh.zip(self.sheaves.get_mut(number));
            let mut is_clear = false;
            if let Some((bvh, sheaf)) = &sheaf {
                bvh.cut(near, &mut self.tile, sheaf, &mut self.cut, counters);
                is_clear = are_plain
                    && self.cut.is_empty()
                    && sheaf.fit_starts(&self.tile) == all_starts
                    && sheaf.fit() == cell.block.asked();
            }
            if is_clear {
                counters.shadow.first_pass += count;
                transpose(&mut words);
            } else if let (Some((bvh, sheaf)), true) = (sheaf.as_mut(), is_many) {
                counters.shadow.rays += count;
                if self.cut.has_near() {
                    for (place, (start, word)) in self.starts.iter().zip(&mut words).enumerate() {
                        if *word == 0 {
                            continue;
                        }
                        let asked = Asked {
                            occluders: near,
                            start,
                            targets: &cell.targets,
                            mask: *word & cell.block.asked(),
                            number,
                        };
                        let of = OfTile {
                            tile: &mut self.tile,
                            place,
                        };
                        let ways = (&self.cut, Reach::Near, of);
                        let memory = &mut self.memory;
                        let blocked = bvh.any_hit_sheaf(&asked, sheaf, ways, memory, counters);
                        counters.shadow.shadowed += u64::from(blocked.count_ones());
                        *word &= !blocked;
                    }
                }
                transpose(&mut words);
                for (lane, word) in words.iter_mut().enumerate().take(cell.targets.len()) {
                    // Towards nowhere nothing is met.
                    if *word == 0 || cell.block.asked() >> lane & 1 == 0 {
                        continue;
                    }
                    let asked = AskedDirection {
                        occluders: near,
                        starts: &self.starts,
                        mask: *word,
                        target: &cell.targets[lane],
                        lane,
                        number: cell.numbers[lane] as usize,
                    };
                    let ways = (&**sheaf, &self.cut);
                    let memory = &mut self.by_direction;
                    let blocked =
                        bvh.any_hit_column(&asked, &mut self.tile, ways, memory, counters);
                    counters.shadow.shadowed += u64::from(blocked.count_ones());
                    *word &= !blocked;
                }
            } else {
                let mut one = OneCell {
                    index: self.index,
                    number,
                    cell,
                    sheaf,
                    cut: &self.cut,
                };
                for (place, (start, word)) in self.starts.iter().zip(&mut words).enumerate() {
                    if *word != 0 {
                        let of = OfTile {
                            tile: &mut self.tile,
                            place,
                        };
                        let blocked = one.blocked(start, *word, of, &mut self.memory, counters);
                        counters.shadow.shadowed += u64::from(blocked.count_ones());
                        *word &= !blocked;
                    }
                }
                counters.shadow.rays += count;
                transpose(&mut words);
            }
            for (&direction, word) in cell.numbers.iter().zip(words) {
                self.columns[direction as usize] = word;
            }
        }
        pairs
    }

    /// Writes what the columns hold into the words of all starts. `row` says where the words of a start are.
    fn write(&self, row: impl Fn(usize) -> usize, visible: &mut [u64]) {
        let stride = self.directions.word_count();
        for (number, columns) in self.columns.chunks_exact(WORD).enumerate() {
            let mut words = [0; WORD];
            words.copy_from_slice(columns);
            transpose(&mut words);
            for (place, word) in words.into_iter().enumerate().take(self.starts.len()) {
                visible[row(place) * stride + number] = word;
            }
        }
    }
}

/// Returns which directions of a cell a start is asked about.
fn on_side(occluders: &Occluders, start: &ReceiverPoint, side: ReceiverSide, cell: &Cell) -> u64 {
    let (directions, count) = (cell.block.coordinates(), cell.targets.len());
    let sign = match (side, start.surface) {
        (ReceiverSide::Normal(normal), _) => {
            return sides_of_normal(normal, directions, count)[0];
        }
        (ReceiverSide::Both, _) | (_, None) => return cell.all(),
        (ReceiverSide::Front, _) => 1,
        (ReceiverSide::Back, _) => -1,
    };
    match start.surface {
        Some(own) if (own.0 as usize) < occluders.triangle_count() => {
            let [front, behind] = occluders.sides_of_directions(own, directions, count);
            if sign > 0 { front } else { behind }
        }
        _ => {
            let targets = cell.targets.iter().enumerate();
            targets.fold(0, |word, (bit, target)| {
                let is_asked = occluders.light_side(start, target) == sign;
                word | u64::from(is_asked) << bit
            })
        }
    }
}

/// A cell that starts of a tile are asked about.
struct OneCell<'a> {
    index: &'a ShadowIndex,
    number: usize,
    cell: &'a Cell,
    sheaf: Option<(&'a Bvh, &'a mut Sheaf)>,
    cut: &'a Cut,
}

impl OneCell<'_> {
    /// Returns which directions of a mask are occluded.
    fn blocked(
        &mut self,
        start: &ReceiverPoint,
        mask: u64,
        of: OfTile<'_>,
        memory: &mut Memory,
        counters: &mut Counters,
    ) -> u64 {
        let near = &*self.index.parts.near;
        let has_own_rule = start.surface.is_some_and(|own| near.has_own_rule(own));
        if let (Some((bvh, sheaf)), false) = (&mut self.sheaf, has_own_rule) {
            let asked = Asked {
                occluders: near,
                start,
                targets: &self.cell.targets,
                mask: mask & self.cell.block.asked(),
                number: self.number,
            };
            let ways = (self.cut, Reach::All, of);
            return bvh.any_hit_sheaf(&asked, sheaf, ways, memory, counters);
        }
        let asked = AskedBlock {
            targets: &self.cell.targets,
            block: &self.cell.block,
            number: self.number,
            mask,
            leaves: None,
        };
        self.index.occluded_block(start, &asked, memory, counters)
    }
}
