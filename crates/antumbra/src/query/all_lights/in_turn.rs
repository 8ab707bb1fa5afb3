//! All lights of one point after the other, for renderers that follow ray by ray.
//!
//! In: starts, one at a time; which lights are left out. Out: a bit a light for *reaches the point*, *is on the side that is
//! asked about*, *was known*. Invariant: as of the calls for many starts; what was asked before changes no bit.

use antumbra_geometry::{LightId, ReceiverPoint};

use super::{OneReceiver, Work};
use crate::clock::Reading;
use crate::occlusion::{AllLights, LightRows, Place};
use crate::query::beam::WORD;
use crate::{Answer, Counters, Decided, QueryError, ReceiverSide, Refine, Shadow, ShadowIndex};

/// Starts between two looks at whether rows pay.
const LOOK: u32 = 256;
/// One start in so many is timed: reading the clock takes as long as all lights of some starts.
const TIMED: u32 = 32;

/// Asks an index about all lights of one point after the other, and holds the answers of the last. Made once by a thread and
/// asked again and again, so that points cost no memory of their own: [`ShadowIndex::lights_in_turn`].
#[derive(Debug)]
pub struct LightsInTurn<'a> {
    index: &'a ShadowIndex,
    all: &'a AllLights,
    work: Work,
    visible: Vec<u64>,
    on_side: Vec<u64>,
    known: Vec<u64>,
    /// Starts since the ledger was told, those that were timed, and what they took.
    starts: u32,
    timed: u32,
    timed_ns: u64,
}

impl ShadowIndex {
    /// Returns whether all lights of a point are best asked about at once: there are 16 or more, what is known of them is
    /// made while they are asked about ([`Refine::Lazy`]), and nothing was loaded of them one by one.
    ///
    /// Whoever asks one by one nevertheless gets the same answers.
    pub fn asks_all_lights_at_once(&self) -> bool {
        let count = self.lights().len();
        !self.has_file && count >= super::batch::MANY && self.knows_lights_at_once()
    }

    /// Returns what asks about all lights of one point after the other, as [`ShadowIndex::lights_visible_of`] does for
    /// many points together.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{Counters, LightShape, Occluders, Opacity, ReceiverSide, ShadowIndex, ReceiverPoint};
    ///
    /// // A small roof over a floor; three lamps, of which it hides the middle one.
    /// let corners = |size: f64, z: f64| [[-size, -size, z], [size, -size, z], [0.0, size, z]];
    /// let mut surfaces = Occluders::builder();
    /// let floor = surfaces.add_mesh(&corners(9.0, 0.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// surfaces.add_mesh(&corners(1.0, 2.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// let lamps = [-8.0, 0.0, 8.0].map(|x| LightShape::Point([x, 0.0, 4.0].into()));
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), lamps.to_vec()).build()?;
    ///
    /// let mut lights = index.lights_in_turn();
    /// let start = ReceiverPoint { point: [0.0, 0.0, 0.0].into(), surface: Some(floor.start.into()) };
    /// lights.ask(&start, ReceiverSide::Front, &[], &mut Counters::default())?;
    /// assert_eq!(lights.visible(), [0b101]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn lights_in_turn(&self) -> LightsInTurn<'_> {
        let count = self.lights().len();
        let words = || vec![0; count.div_ceil(WORD)];
        let mut work = Work::new(count);
        work.counts_sides = true;
        LightsInTurn {
            index: self,
            all: self.all_lights(),
            work,
            visible: words(),
            on_side: words(),
            known: words(),
            starts: 0,
            timed: 0,
            timed_ns: 0,
        }
    }
}

impl LightsInTurn<'_> {
    /// Asks about the lights on one side of a start, without those whose bit is set in `left_out`, a bit a light as in
    /// [`LightsInTurn::visible`], or empty for none. Free starts without a normal ask about all.
    ///
    /// Counts under `counters.shadow` each light that was asked: under `first_pass` where it was known, under `rays`
    /// where not. Makes rows from time to time, where they pay, with all threads of the current pool.
    ///
    /// # Errors
    /// The start is not finite or beyond 2^100, or its surface does not exist. The answers are those of the start before.
    pub fn ask(
        &mut self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        left_out: &[u64],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        self.index.check_start(start)?;
        if self.visible.is_empty() {
            return Ok(());
        }
        if self.all.refine == Refine::Queried {
            self.index.make_rows(self.all, std::slice::from_ref(start));
        }
        let begin = self.starts.is_multiple_of(TIMED).then(Reading::now);
        self.answer(start, side, left_out, counters);
        if let Some(begin) = begin {
            self.timed += 1;
            self.timed_ns += begin.elapsed_ns();
        }
        self.starts += 1;
        if self.starts == LOOK {
            self.note();
            self.index.make_rows_that_pay(self.all, 0.0);
        }
        Ok(())
    }

    /// Returns which lights reach the point that was asked about last: bit `i % 64`, counted from the lowest, of word
    /// `i / 64` is 1 where light `i` was asked about and nothing opaque is between.
    pub fn visible(&self) -> &[u64] {
        &self.visible
    }

    /// Returns which lights are on the side that was asked about, those left out among them.
    pub fn on_side(&self) -> &[u64] {
        &self.on_side
    }

    /// Returns how a light was answered. It is on the side that was asked about, and was not left out.
    ///
    /// # Panics
    /// There is no such light.
    pub fn answer_of(&self, light: LightId) -> Answer {
        let light = light.index();
        let is = |words: &[u64]| words[light / WORD] >> (light % WORD) & 1 != 0;
        Answer {
            shadow: if is(&self.visible) {
                Shadow::Lit
            } else {
                Shadow::Shadowed
            },
            decided: if is(&self.known) {
                Decided::FirstPass
            } else {
                Decided::Ray
            },
        }
    }

    fn answer(
        &mut self,
        start: &ReceiverPoint,
        side: ReceiverSide,
        left_out: &[u64],
        counters: &mut Counters,
    ) {
        let (index, work) = (self.index, &mut self.work);
        let table = self.all.rows.as_ref().and_then(LightRows::table);
        let place = match &self.all.rows {
            Some(rows) => {
                let starts = std::slice::from_ref(start);
                rows.find(&index.parts.near, table.as_deref(), starts)[0]
            }
            None => Place::Nowhere,
        };
        work.noted.note(place);
        let asked = OneReceiver { start, side, place };
        index.by_what_is_known(&asked, table.as_deref(), &mut self.visible, work);
        self.on_side.copy_from_slice(&work.asked);
        for (word, &left_out) in left_out.iter().enumerate() {
            work.asked[word] &= !left_out;
            work.rest[word] &= !left_out;
            self.visible[word] &= !left_out;
        }
        for (word, known) in self.known.iter_mut().enumerate() {
            *known = work.asked[word] & !work.rest[word];
        }
        work.count_known(&self.visible, counters);
        if work.rest.iter().any(|&word| word != 0) {
            index.by_beam(self.all, start, &mut self.visible, work, counters);
        }
    }

    /// Tells the ledger of the starts since it was told last.
    fn note(&mut self) {
        if let (Some(rows), 1..) = (&self.all.rows, self.timed) {
            let each = self.timed_ns / u64::from(self.timed);
            rows.note(&self.work.noted, each * u64::from(self.starts));
        }
        self.work.noted = Default::default();
        (self.starts, self.timed, self.timed_ns) = (0, 0, 0);
    }
}

impl Drop for LightsInTurn<'_> {
    fn drop(&mut self) {
        self.note();
    }
}
