//! The study: sensors times directions, as bits.
//!
//! In: an index, sensors, directions. Out: a bit each, 1 where the sun reaches the sensor: it stands strictly on the
//! side that the sensor faces, and no opaque surface is between (EXACTNESS.md). Invariants: the bits are those of the
//! rule, for any number of threads, and whether the study ran at once or was stopped and resumed; beside the result
//! it takes some mebibytes a thread. Absent here: what bits amount to.

mod kept;

use std::path::PathBuf;

use antumbra::{Batch, BatchError, BatchKind, DirectionSet, ReceiverSide, ShadowIndex};
use antumbra_geometry::{DVec3, Occluders, UnidentifiedCoverage};
use antumbra_task::Steps;

use crate::sensors::{Facing, Sensors};
use kept::Kept;
pub(crate) use kept::le_bytes;
pub use kept::{PartError, Parts};

/// Answers that a chunk of sensors has at most: some seconds of work, which is what a stop loses.
const CHUNK_BITS: usize = 1 << 25;

/// Bits of a word.
const WORD: usize = 64;

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

/// Answers, and how they came about.
#[derive(Clone, Debug)]
pub struct Answered {
    /// Bits of all sensors.
    pub bits: Bits,
    /// Sensors that an earlier run had answered, and all.
    pub resumed: [usize; 2],
}

/// Why a study has no answers.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A sensor or a direction has no answer.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// Parts that are done cannot be kept.
    #[error(transparent)]
    Part(#[from] PartError),
    /// Parts are to be kept of a scene that does not say what it is.
    #[error(transparent)]
    Unidentified(#[from] UnidentifiedCoverage),
}

/// Answers all sensors for all directions (towards the suns, any length but zero).
///
/// With `parts`, chunks that are done are kept in that folder, and those that an earlier run of the same study left
/// there are taken. The caller removes them by [`Parts::remove`] once the result is safe. Studies of one chunk keep
/// nothing.
///
/// # Errors
/// A sensor or a direction has no answer, or parts cannot be written.
pub fn answer(
    index: &ShadowIndex,
    sensors: &Sensors,
    directions: &[DVec3],
    parts: Option<&Parts>,
) -> Result<Answered, StudyError> {
    answer_in_chunks(index, sensors, directions, parts, CHUNK_BITS)
}

/// Answers as [`answer`] does, in chunks of so many bits: for tests of what is kept.
///
/// # Errors
/// As [`answer`].
#[doc(hidden)]
pub fn answer_in_chunks(
    index: &ShadowIndex,
    sensors: &Sensors,
    directions: &[DVec3],
    parts: Option<&Parts>,
    chunk_bits: usize,
) -> Result<Answered, StudyError> {
    let stride = directions.len().div_ceil(WORD);
    let count = sensors.count();
    let mut words = vec![0_u64; stride * count];
    let mut resumed = [0, count];
    if stride == 0 || count == 0 {
        let bits = Bits { stride, words };
        return Ok(Answered { bits, resumed });
    }
    let suns = DirectionSet::new(directions)?;
    let length = (chunk_bits / (stride * WORD)).max(WORD);
    let chunk_count = count.div_ceil(length);
    let kept = match parts.filter(|_| chunk_count > 1) {
        Some(parts) => {
            let identity = identity(index.occluders(), sensors, directions)?;
            Some(Kept::new(parts, identity)?)
        }
        None => None,
    };
    let steps = Steps::new("sun", chunk_count as u64);
    for (chunk, words) in words.chunks_mut(length * stride).enumerate() {
        let first = chunk * length;
        let is_kept = kept.as_ref().is_some_and(|kept| kept.load(chunk, words));
        if is_kept {
            resumed[0] += words.len() / stride;
        }
        steps.step(|| -> Result<(), StudyError> {
            if is_kept {
                return Ok(());
            }
            sunlit(index, sensors, first, &suns, words)?;
            if let Some(kept) = &kept {
                kept.save(chunk, words)?;
            }
            Ok(())
        })?;
    }
    let bits = Bits { stride, words };
    Ok(Answered { bits, resumed })
}

/// Answers some sensors in a row: not occluded, and on the side that the sensor faces.
fn sunlit(
    index: &ShadowIndex,
    sensors: &Sensors,
    first: usize,
    suns: &DirectionSet,
    words: &mut [u64],
) -> Result<(), BatchError> {
    let count = words.len() / suns.word_count();
    let points = &sensors.points[first..][..count];
    let kind = match &sensors.surfaces {
        Some(surfaces) => BatchKind::OnSurfaces {
            surfaces: &surfaces[first..][..count],
            // They were made for these surfaces, or looked for.
            tolerance: Some(f64::INFINITY),
        },
        None => BatchKind::Free,
    };
    let side_of = |number: usize| match &sensors.facing {
        Facing::All => ReceiverSide::Both,
        Facing::Sides(sides) if sides[first + number] < 0 => ReceiverSide::Back,
        Facing::Sides(_) => ReceiverSide::Front,
        Facing::Normals(normals) => ReceiverSide::Normal(normals[first + number].into()),
    };
    let batch = Batch { points, kind };
    index.visible_directions_by(&batch, suns, side_of, words)?;
    Ok(())
}

/// Returns a hash of all that the bits depend on.
///
/// # Errors
/// The holes of alpha-tested faces do not say what they are.
pub fn identity(
    occluders: &Occluders,
    sensors: &Sensors,
    directions: &[DVec3],
) -> Result<[u8; 32], UnidentifiedCoverage> {
    let mut hash = blake3::Hasher::new();
    hash.update(b"antumbra sun 1");
    occluders.identify(&mut |bytes| {
        hash.update(bytes);
    })?;
    let mut numbers = |kind: u8, rows: &[[f64; 3]]| {
        hash.update(&[kind]);
        hash.update(&(rows.len() as u64).to_le_bytes());
        for row in antumbra_task::checked(rows) {
            for number in row {
                hash.update(&number.to_le_bytes());
            }
        }
    };
    let directions: Vec<[f64; 3]> = directions.iter().map(|to| to.to_array()).collect();
    numbers(1, &directions);
    numbers(2, &sensors.points);
    if let Facing::Normals(normals) = &sensors.facing {
        numbers(3, normals);
    }
    if let Facing::Sides(sides) = &sensors.facing {
        hash.update(&[4]);
        for side in antumbra_task::checked(sides) {
            hash.update(&side.to_le_bytes());
        }
    }
    if let Some(surfaces) = &sensors.surfaces {
        hash.update(&[5]);
        for surface in antumbra_task::checked(surfaces) {
            hash.update(&surface.to_le_bytes());
        }
    }
    Ok(*hash.finalize().as_bytes())
}

/// Returns the folder beside an output that parts of its study are kept in.
pub fn parts_beside(output: &std::path::Path) -> Parts {
    let mut name = output.as_os_str().to_owned();
    name.push(".parts");
    Parts {
        folder: PathBuf::from(name),
    }
}
