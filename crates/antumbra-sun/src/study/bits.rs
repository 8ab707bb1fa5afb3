//! Bits of sensors and directions.

use antumbra::{BatchError, DirectionSet, ShadowIndex};

use crate::sensors::Sensors;

/// Bits of a word.
pub(super) const WORD: usize = 64;

/// Bits of a study: those of a sensor lie together, sensor after sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bits {
    /// Words of a sensor: one for each 64 directions, the last one filled up with zeros.
    pub stride: usize,
    /// Words of all sensors; direction `i` is bit `i % 64`, counted from the lowest, of word `i / 64`.
    pub words: Vec<u64>,
}

impl Bits {
    /// Returns the words of a sensor.
    pub fn of(&self, sensor: usize) -> &[u64] {
        &self.words[sensor * self.stride..][..self.stride]
    }

    /// Returns whether the sun of a direction reaches a sensor.
    pub fn is_sunlit(&self, sensor: usize, direction: usize) -> bool {
        self.of(sensor)[direction / WORD] >> (direction % WORD) & 1 == 1
    }
}

/// Answers some sensors in a row: not occluded, and on the side that the sensor faces.
pub(super) fn sunlit(
    index: &ShadowIndex,
    sensors: &Sensors,
    first: usize,
    suns: &DirectionSet,
    words: &mut [u64],
) -> Result<(), BatchError> {
    let count = words.len() / suns.word_count().max(1);
    let batch = sensors.batch(first..first + count);
    let side_of = |number: usize| sensors.side(first + number);
    index.visible_directions_by(&batch, suns, side_of, words)?;
    Ok(())
}
