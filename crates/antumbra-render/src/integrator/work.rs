//! Work space of a thread that follows rays: counts, and memory that is used again.

use antumbra::{LightSamples, LightsInTurn};

use super::tally::Tally;

/// Counts of one thread's rays and queries, and its memory.
#[derive(Debug)]
pub struct Work<'a> {
    /// Counts of what was done with it.
    pub tally: Tally,
    pub(super) samples: LightSamples,
    pub(super) at_once: Option<AtOnce<'a>>,
}

/// All lights of a point, asked at once.
#[derive(Debug)]
pub(super) struct AtOnce<'a> {
    pub(super) lights: LightsInTurn<'a>,
    /// Lights that may not shine in all directions.
    pub(super) spots: Vec<usize>,
    /// Those that do not shine on the point, a bit a light.
    pub(super) dark: Vec<u64>,
    /// Whether the point has a lit side at all.
    pub(super) has_side: bool,
}
