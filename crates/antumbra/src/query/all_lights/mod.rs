//! All lights of a point at once: which of the index's lights reach it, a bit each.
//!
//! In: starts, and on which side of the surface lights are asked about. Out: for each start a word for every 64 lights, 1
//! where a light reaches it. Invariant: a bit is that of [`ShadowIndex::shadow`] for the start and the light, for any
//! method, any number of threads and whatever is known. What rows know (`crates/antumbra/src/occlusion/rows`) is one
//! look-up for all lights; a beam ([`ShadowIndex::occluded_targets`]) answers the rest. Absent here: what lights know
//! one by one.

mod batch;
pub(super) mod in_turn;

use antumbra_geometry::{LightShape, ReceiverPoint, SurfaceId};

use crate::accel::bvh::Memory;
use crate::clock::Reading;
use crate::occlusion::{AllLights, Asked, LightRows, Place, ROW_BLOCK, Row, RowTable, Scene};
use crate::query::beam::{AskedBlock, WORD};
use crate::query::off_surface::check_surface;
use crate::{Coordinates, Counters, QueryError, ReceiverSide, Refine, Shadow, ShadowIndex};

/// As few lights are asked one by one. From a sweep of 3 to 64 in rooms: the lights that rows leave open lie in all
/// directions, where a walk for all of them together is no better than a ray each.
const FEW: u32 = 16;

/// What a thread works with.
#[derive(Debug)]
struct Work {
    memory: Memory,
    /// Lights asked about, in order of groups.
    asked: Vec<u64>,
    rest: Vec<u64>,
    /// Whether lights on the wrong side are told from those that are in shadow, which takes a sign each on curved surfaces.
    counts_sides: bool,
    sides: Sides,
    noted: Asked,
}

/// A start whose lights are asked about, those on one side, and where it looks for what is known.
struct OneReceiver<'a> {
    start: &'a ReceiverPoint,
    side: ReceiverSide,
    place: Place,
}

/// On which sides of some triangles the lights are, so that starts on one triangle ask once.
#[derive(Debug)]
struct Sides {
    /// Of each place the triangle that it speaks of.
    surfaces: Vec<u32>,
    /// Of each place which lights are in front, then which are behind.
    words: Vec<u64>,
}

/// Triangles of which sides are remembered.
const SIDES: usize = 64;

impl Work {
    fn new(light_count: usize) -> Self {
        let word_count = light_count.div_ceil(WORD);
        Self {
            memory: Memory::new(word_count),
            asked: vec![0; word_count],
            rest: vec![0; word_count],
            counts_sides: false,
            sides: Sides {
                surfaces: vec![u32::MAX; SIDES],
                words: vec![0; SIDES * 2 * word_count],
            },
            noted: Asked::default(),
        }
    }

    /// Counts the lights that a row knows.
    #[inline(always)]
    fn count_known(&self, visible: &[u64], counters: &mut Counters) {
        for ((asked, rest), visible) in self.asked.iter().zip(&self.rest).zip(visible) {
            let known = asked & !rest;
            counters.shadow.first_pass += u64::from(known.count_ones());
            counters.shadow.shadowed += u64::from((known & !visible).count_ones());
        }
    }
}

impl ShadowIndex {
    /// Returns which of the index's lights reach a point on a surface: bit `i % 64`, counted from the lowest, of word
    /// `i / 64` is 1 where nothing opaque is between the point and light `i`. Bits beyond the last light are 0.
    ///
    /// Each bit is that of [`ShadowIndex::is_occluded`], turned round. Lights behind the surface are answered as any
    /// other; [`ShadowIndex::lights_visible_of`] leaves them out.
    ///
    /// With [`Method::Auto`](crate::Method) and [`Method::Voxel`](crate::Method), what was proven for a cell and a
    /// triangle is kept in rows of two bits a light, made while points are asked where that pays, or before by
    /// [`ShadowIndex::prepare_lights_visible`].
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{LightShape, Occluders, Opacity, ShadowIndex};
    ///
    /// // A small roof over a floor; three lamps, of which it hides the middle one.
    /// let corners = |size: f64, z: f64| [[-size, -size, z], [size, -size, z], [0.0, size, z]];
    /// let mut surfaces = Occluders::builder();
    /// let floor = surfaces.add_mesh(&corners(9.0, 0.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// surfaces.add_mesh(&corners(1.0, 2.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// let lamps = [-8.0, 0.0, 8.0].map(|x| LightShape::Point([x, 0.0, 4.0].into()));
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), lamps.to_vec()).build()?;
    ///
    /// assert_eq!(index.lights_visible([0.0, 0.0, 0.0], floor.start)?, [0b101]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The point is not finite or beyond 2^100, its surface does not exist, or the point is farther from it than rounding
    /// to `f32` explains.
    pub fn lights_visible(
        &self,
        point: impl Coordinates,
        surface: impl Into<SurfaceId>,
    ) -> Result<Vec<u64>, QueryError> {
        let start = ReceiverPoint {
            point: point.as_f64(),
            surface: Some(surface.into()),
        };
        let visible = self.all_visible(&start)?;
        check_surface(self.occluders(), &start)?;
        Ok(visible)
    }

    /// Returns which of the index's lights reach a point of space, as [`ShadowIndex::lights_visible`] does for points
    /// on surfaces. Each bit is that of [`ShadowIndex::is_occluded_at`], turned round.
    ///
    /// # Errors
    /// The point is not finite or beyond 2^100.
    pub fn lights_visible_at(&self, point: impl Coordinates) -> Result<Vec<u64>, QueryError> {
        let start = ReceiverPoint {
            point: point.as_f64(),
            surface: None,
        };
        self.all_visible(&start)
    }

    fn all_visible(&self, start: &ReceiverPoint) -> Result<Vec<u64>, QueryError> {
        let mut visible = vec![0; self.lights().len().div_ceil(WORD)];
        let starts = std::slice::from_ref(start);
        let counters = &mut Counters::default();
        self.lights_visible_of(starts, ReceiverSide::Both, &mut visible, counters)?;
        Ok(visible)
    }

    /// Answers for each of some starts which lights reach it, as [`ShadowIndex::lights_visible`] does. The words of a
    /// start lie together, start after start.
    ///
    /// `side` says which lights are asked about: those on that side of the start's surface, or of the normal. The bits
    /// of others are 0. Free starts without a normal ask about all. Uses the calling thread, but for rows that pay,
    /// which all threads of the current pool make.
    ///
    /// Counts under `counters.shadow` each light that was asked: under `first_pass` where a row knew it, under `rays`
    /// where not.
    ///
    /// # Errors
    /// A start is not finite or beyond 2^100, or its surface does not exist; the first is named. Nothing is written then.
    ///
    /// # Panics
    /// `visible` does not have `starts.len() * lights.len().div_ceil(64)` words.
    pub fn lights_visible_of(
        &self,
        starts: &[ReceiverPoint],
        side: ReceiverSide,
        visible: &mut [u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        for start in starts {
            self.check_start(start)?;
        }
        let stride = self.lights().len().div_ceil(WORD);
        assert_eq!(visible.len(), stride * starts.len(), "a bit a light");
        let all = self.all_lights();
        if all.refine == Refine::Queried {
            self.make_rows(all, starts);
        }
        // Not of each small call: reading the clock takes as long as some of them.
        let begin = all.is_time_to_look(starts.len()).then(Reading::now);
        let mut work = Work::new(self.lights().len());
        self.answer_all_lights(all, starts, |_| side, visible, &mut work, counters);
        if let Some(begin) = begin {
            self.note_all_lights(all, &work.noted, begin, 0.0);
        }
        Ok(())
    }

    /// Returns the bytes of the rows that [`ShadowIndex::lights_visible`] looks up: what is known of all lights at once.
    /// They are a part of [`ShadowIndex::knowledge_bytes`].
    pub fn row_bytes(&self) -> u64 {
        self.asked_lights().map_or(0, |all| all.row_bytes())
    }

    /// Returns the lowest corner of the cells of rows and their edge, for tests that aim at what is between them.
    #[doc(hidden)]
    pub fn row_planes(&self) -> Option<(antumbra_geometry::DVec3, f64)> {
        self.all_lights()
            .rows
            .as_ref()
            .map(LightRows::planes_between)
    }

    /// Makes the rows of some starts.
    fn make_rows(&self, all: &AllLights, starts: &[ReceiverPoint]) -> usize {
        match (&all.rows, self.scene()) {
            (Some(rows), Some(scene)) => rows.make_for(&scene, self.lights(), starts),
            _ => 0,
        }
    }

    fn scene(&self) -> Option<Scene<'_>> {
        let occluders = &*self.parts.near;
        self.bvh().map(|bvh| Scene { occluders, bvh })
    }

    /// Notes what some starts took, and makes rows where that pays. `more` times as many starts are known to come.
    fn note_all_lights(&self, all: &AllLights, noted: &Asked, begin: Reading, more: f64) {
        let Some(rows) = &all.rows else { return };
        rows.note(noted, begin.elapsed_ns());
        if !noted.is_content() {
            self.make_rows_that_pay(all, more);
        }
    }

    /// Makes the rows that pay, as far as what was asked is noted.
    fn make_rows_that_pay(&self, all: &AllLights, more: f64) {
        let is_refining = self.knowledge().is_some_and(|values| values.is_refining());
        if let (Some(rows), true, Some(scene)) = (&all.rows, is_refining, self.scene()) {
            rows.make_what_pays(&scene, self.lights(), more);
        }
    }

    /// Answers starts that were checked, by rows and beams, and notes what was not known.
    fn answer_all_lights(
        &self,
        all: &AllLights,
        starts: &[ReceiverPoint],
        side_of: impl Fn(usize) -> ReceiverSide,
        visible: &mut [u64],
        work: &mut Work,
        counters: &mut Counters,
    ) {
        let stride = self.lights().len().div_ceil(WORD);
        if stride == 0 {
            return;
        }
        let table = all.rows.as_ref().and_then(LightRows::table);
        let blocks = starts
            .chunks(ROW_BLOCK)
            .zip(visible.chunks_mut(ROW_BLOCK * stride));
        for (number, (starts, visible)) in blocks.enumerate() {
            antumbra_task::check();
            let places = match &all.rows {
                Some(rows) => rows.find(&self.parts.near, table.as_deref(), starts),
                None => [Place::Nowhere; ROW_BLOCK],
            };
            for (at, (start, visible)) in starts.iter().zip(visible.chunks_mut(stride)).enumerate()
            {
                let side = side_of(number * ROW_BLOCK + at);
                let asked = OneReceiver {
                    start,
                    side,
                    place: places[at],
                };
                work.noted.note(places[at]);
                self.by_what_is_known(&asked, table.as_deref(), visible, work);
                work.count_known(visible, counters);
                if work.rest.iter().any(|&word| word != 0) {
                    self.by_beam(all, start, visible, work, counters);
                }
            }
        }
    }

    /// Writes which lights a row says reach a start. Leaves in `work.asked` the lights that are asked about, and in
    /// `work.rest` those of them that the row does not know.
    #[inline(always)]
    fn by_what_is_known(
        &self,
        asked: &OneReceiver<'_>,
        table: Option<&RowTable>,
        visible: &mut [u64],
        work: &mut Work,
    ) {
        match (asked.place, table) {
            (Place::Row(row), Some(table)) if self.is_curved(asked.start) => {
                self.by_curved_row(&table.row(row), asked, visible, work);
            }
            (Place::Row(row), Some(table)) => {
                self.by_row(&table.row(row), asked, visible, work);
            }
            _ => {
                self.mark_sides(asked.start, asked.side, work);
                work.rest.copy_from_slice(&work.asked);
                visible.fill(0);
            }
        }
    }

    #[inline(always)]
    fn by_row(&self, row: &Row<'_>, asked: &OneReceiver<'_>, visible: &mut [u64], work: &mut Work) {
        if matches!(asked.side, ReceiverSide::Normal(_)) {
            self.mark_sides(asked.start, asked.side, work);
        }
        for (word, visible) in visible.iter_mut().enumerate() {
            let asked = match asked.side {
                ReceiverSide::Front => row.front(word),
                ReceiverSide::Back => row.back(word),
                ReceiverSide::Both => self.lights_of_word(word),
                ReceiverSide::Normal(_) => work.asked[word],
            };
            let (lit, dark) = (row.lit(word), row.dark(word));
            *visible = lit & asked;
            work.asked[word] = asked;
            work.rest[word] = asked & !(lit | dark);
        }
    }

    fn is_curved(&self, start: &ReceiverPoint) -> bool {
        let count = self.parts.near.triangle_count();
        start
            .surface
            .is_some_and(|surface| surface.0 as usize >= count)
    }

    /// Does as [`Self::by_row`] does for a start on a surface that is no triangle: rows speak of those that no own rule
    /// shadows, and say nothing of sides. A light that reaches no start is on no side that matters, unless it is counted.
    fn by_curved_row(
        &self,
        row: &Row<'_>,
        &OneReceiver { start, side, .. }: &OneReceiver<'_>,
        visible: &mut [u64],
        work: &mut Work,
    ) {
        let near = &*self.parts.near;
        let own_rule = near.own_rule(start);
        let is_asked = |light: &LightShape| match side {
            ReceiverSide::Both => true,
            ReceiverSide::Front => near.light_side(start, light) > 0,
            ReceiverSide::Back => near.light_side(start, light) < 0,
            ReceiverSide::Normal(normal) => light.side_of(start.point, normal) > 0,
        };
        for (word, visible) in visible.iter_mut().enumerate() {
            let all = self.lights_of_word(word);
            let (lit, dark) = (row.lit(word), row.dark(word) & all);
            let doubtful = if work.counts_sides { all } else { all & !dark };
            let (mut asked, mut rest) = (all & !doubtful, 0);
            *visible = 0;
            for bit in bits(doubtful) {
                let light = &self.lights()[word * WORD + bit];
                if !is_asked(light) {
                    continue;
                }
                asked |= 1 << bit;
                if (lit | dark) >> bit & 1 == 0 {
                    rest |= 1 << bit;
                } else if lit >> bit & 1 != 0 {
                    let is_blocked = own_rule.is_some_and(|rule| rule.hides(light));
                    *visible |= u64::from(!is_blocked) << bit;
                }
            }
            work.asked[word] = asked;
            work.rest[word] = rest;
        }
    }

    /// Asks about the lights in `work.rest` and marks those that reach the start.
    fn by_beam(
        &self,
        all: &AllLights,
        start: &ReceiverPoint,
        visible: &mut [u64],
        work: &mut Work,
        counters: &mut Counters,
    ) {
        let count: u32 = work.rest.iter().map(|word| word.count_ones()).sum();
        if count <= FEW {
            for (word, &rest) in work.rest.iter().enumerate() {
                for bit in bits(rest) {
                    let light = &self.lights()[word * WORD + bit];
                    let answer = self.answer_to(start, light, counters);
                    visible[word] |= u64::from(answer.shadow == Shadow::Lit) << bit;
                }
            }
            return;
        }
        let groups = &all.groups;
        if !groups.is_in_order {
            work.asked.fill(0);
            for (word, &rest) in work.rest.iter().enumerate() {
                for bit in bits(rest) {
                    let place = groups.places[word * WORD + bit] as usize;
                    work.asked[place / WORD] |= 1 << (place % WORD);
                }
            }
        }
        let masks = match groups.is_in_order {
            true => &work.rest,
            false => &work.asked,
        };
        for (number, &mask) in masks.iter().enumerate().filter(|&(_, &mask)| mask != 0) {
            let first = number * WORD;
            let last = groups.lights.len().min(first + WORD);
            let asked = AskedBlock {
                targets: &groups.lights[first..last],
                block: &groups.blocks[number],
                number,
                mask,
                leaves: None,
            };
            let occluded = self.occluded_block(start, &asked, &mut work.memory, counters);
            counters.shadow.rays += u64::from(mask.count_ones());
            counters.shadow.shadowed += u64::from(occluded.count_ones());
            let lit = mask & !occluded;
            if groups.is_in_order {
                visible[number] |= lit;
                continue;
            }
            for bit in bits(lit) {
                let light = groups.numbers[first + bit] as usize;
                visible[light / WORD] |= 1 << (light % WORD);
            }
        }
    }

    /// Leaves in `work.asked` the lights on a side of a start.
    fn mark_sides(&self, start: &ReceiverPoint, side: ReceiverSide, work: &mut Work) {
        let lights = self.lights();
        let mark = |words: &mut [u64], is_asked: &dyn Fn(&LightShape) -> bool| {
            for (word, lights) in words.iter_mut().zip(lights.chunks(WORD)) {
                *word = lights.iter().enumerate().fold(0, |word, (bit, light)| {
                    word | u64::from(is_asked(light)) << bit
                });
            }
        };
        let surface = match (side, start.surface) {
            (ReceiverSide::Normal(normal), _) => {
                return mark(&mut work.asked, &|light| {
                    light.side_of(start.point, normal) > 0
                });
            }
            (ReceiverSide::Both, _) | (_, None) => {
                for (number, word) in work.asked.iter_mut().enumerate() {
                    *word = self.lights_of_word(number);
                }
                return;
            }
            (_, Some(surface)) => surface,
        };
        let sign = if side == ReceiverSide::Back { -1 } else { 1 };
        let side_of = |light: &LightShape| self.occluders().light_side(start, light);
        if surface.0 as usize >= self.occluders().triangle_count() {
            return mark(&mut work.asked, &|light| side_of(light) == sign);
        }
        let length = work.asked.len();
        let place = surface.0 as usize % SIDES;
        let words = &mut work.sides.words[place * 2 * length..][..2 * length];
        if work.sides.surfaces[place] != surface.0 {
            work.sides.surfaces[place] = surface.0;
            mark(&mut words[..length], &|light| side_of(light) > 0);
            mark(&mut words[length..], &|light| side_of(light) < 0);
        }
        let first = if sign > 0 { 0 } else { length };
        work.asked.copy_from_slice(&words[first..first + length]);
    }

    /// Returns a bit for each light of a word.
    #[inline(always)]
    fn lights_of_word(&self, word: usize) -> u64 {
        let count = (self.lights().len() - word * WORD).min(WORD);
        u64::MAX >> (WORD - count)
    }
}

/// The numbers of the bits set.
fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let bit = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            bit
        })
    })
}
