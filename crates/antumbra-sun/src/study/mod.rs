//! The study: sensors times directions, as bits, and as shares where suns have a size or shine through glass.
//!
//! In: an index, sensors, [`Questions`]. Out: a bit each, 1 where the sun reaches the sensor: it stands strictly on the
//! side that the sensor faces, and no opaque surface is between (EXACTNESS.md). Invariants: the bits are those of the
//! rule, for any number of threads, and whether the study ran at once or was stopped and resumed; so are shares. Beside
//! the result it takes some mebibytes a thread. Absent here: what bits and shares amount to.
//!
//! | module | what |
//! |---|---|
//! | `questions` | what is asked |
//! | `bits` | bits of sensors in a row |
//! | `shares` | visible shares of discs, what glass lets through |
//! | `factors` | sky view factors |
//! | `kept` | chunks that are done, in files |

mod bits;
mod factors;
mod kept;
mod questions;
mod shares;

use std::ops::Range;
use std::path::PathBuf;

use antumbra::{BatchError, DirectionSet, ShadowIndex};
use antumbra_geometry::{AreaError, DVec3, Occluders, UnidentifiedCoverage};
use antumbra_task::Steps;

use crate::error::BadSetting;
use crate::sensors::{Facing, Sensors};
pub use bits::Bits;
use bits::{WORD, sunlit};
use kept::Kept;
pub(crate) use kept::le_bytes;
pub use kept::{PartError, Parts};
pub use questions::{Dome, LARGEST_SUN, Light, Questions};
use shares::{Discs, Glass};

/// Answers that a chunk of sensors has at most: some seconds of work, which is what a stop loses.
const CHUNK_BITS: usize = 1 << 25;

/// Shares of discs that a chunk has at most: each takes about as long as 30 bits.
const CHUNK_DISCS: usize = 1 << 20;

/// Answers, and how they came about.
#[derive(Clone, Debug)]
pub struct Answered {
    /// Bits of all sensors; of suns with a size those of their middles.
    pub bits: Bits,
    /// Shares of all sensors' suns, 0 to 1, sensor after sensor, if [`Light::has_shares`].
    pub shares: Option<Vec<f32>>,
    /// Sky view factors, if a dome is asked about and sensors have normals.
    pub sky_view_factor: Option<Vec<f64>>,
    /// Number of shares of discs that samples answered, for want of a closed form.
    pub sampled: u64,
    /// Sensors that an earlier run had answered, and all.
    pub resumed: [usize; 2],
}

/// Why a study has no answers.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] BadSetting),
    /// A sun has no disc.
    #[error("a sun has no disc: {0}")]
    Disc(#[from] AreaError),
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

/// Answers all questions about all sensors.
///
/// With `parts`, chunks that are done are kept in that folder, and those that an earlier run of the same study left
/// there are taken. The caller removes them by [`Parts::remove`] once the result is safe. Studies of one chunk keep
/// nothing. What glass lets through is not kept: colors of glass are no part of what surfaces say that they are.
///
/// # Errors
/// A sensor or a direction has no answer, a setting is out of range, or parts cannot be written.
pub fn answer(
    index: &ShadowIndex,
    sensors: &Sensors,
    questions: &Questions<'_>,
    parts: Option<&Parts>,
) -> Result<Answered, StudyError> {
    let length = match questions.light.sun_diameter {
        Some(_) => CHUNK_DISCS,
        None => CHUNK_BITS,
    };
    answer_in_chunks(index, sensors, questions, parts, length)
}

/// Answers as [`answer`] does, in chunks of so many answers: for tests of what is kept.
///
/// # Errors
/// As [`answer`].
#[doc(hidden)]
pub fn answer_in_chunks(
    index: &ShadowIndex,
    sensors: &Sensors,
    questions: &Questions<'_>,
    parts: Option<&Parts>,
    chunk_bits: usize,
) -> Result<Answered, StudyError> {
    questions.light.check()?;
    let directions = questions.directions;
    let (count, suns) = (sensors.count(), directions.len());
    let asked = Asked {
        index,
        sensors,
        questions,
        discs: match questions.light.sun_diameter {
            Some(degrees) => Some(Discs::new(directions, degrees)?),
            None => None,
        },
        suns: DirectionSet::new(directions)?,
        glass: match questions.light.through_glass {
            true => Glass::of(index),
            false => None,
        },
        dome: match questions.dome.filter(|_| sensors.facing != Facing::All) {
            Some(dome) => Some((dome, DirectionSet::new(&dome.directions)?)),
            None => None,
        },
    };
    let stride = asked.suns.word_count();
    let mut words = vec![0_u64; stride * count];
    let share_count = match questions.light.has_shares() {
        true => suns * count,
        false => 0,
    };
    let mut shares = vec![0.0_f32; share_count];
    let mut factors = vec![0.0_f64; asked.dome.as_ref().map_or(0, |_| count)];
    let (mut sampled, mut resumed) = (0, [0, count]);
    if stride > 0 && count > 0 {
        let length = (chunk_bits / (stride * WORD)).max(WORD);
        let chunk_count = count.div_ceil(length);
        let kept = match parts.filter(|_| chunk_count > 1) {
            Some(parts) => {
                let identity = identity(index.occluders(), sensors, questions)?;
                Some(Kept::new(parts, identity)?)
            }
            None => None,
        };
        let steps = Steps::new("sun", chunk_count as u64);
        for chunk in 0..chunk_count {
            let range = chunk * length..count.min((chunk + 1) * length);
            let mut part = Part {
                words: &mut words[range.start * stride..range.end * stride],
                shares: of_range(&mut shares, &range, suns),
                factors: of_range(&mut factors, &range, 1),
                sampled: 0,
            };
            let is_kept = kept
                .as_ref()
                .is_some_and(|kept| part.load(kept, chunk, &asked));
            if is_kept {
                resumed[0] += range.len();
            }
            steps.step(|| -> Result<(), StudyError> {
                if !is_kept {
                    asked.keepable(&range, &mut part)?;
                    if let Some(kept) = &kept {
                        kept.save(chunk, &part.packed(&asked))?;
                    }
                }
                Ok(asked.filtered(&range, &mut part)?)
            })?;
            sampled += part.sampled;
        }
    }
    Ok(Answered {
        bits: Bits { stride, words },
        shares: questions.light.has_shares().then_some(shares),
        sky_view_factor: asked.dome.as_ref().map(|_| factors),
        sampled,
        resumed,
    })
}

/// Returns the rows of a range; nothing of a list that is empty.
fn of_range<'a, T>(list: &'a mut [T], range: &Range<usize>, width: usize) -> &'a mut [T] {
    match list.is_empty() {
        true => list,
        false => &mut list[range.start * width..range.end * width],
    }
}

/// Directions and lights, prepared for the index.
struct Asked<'a> {
    index: &'a ShadowIndex,
    sensors: &'a Sensors,
    questions: &'a Questions<'a>,
    suns: DirectionSet,
    discs: Option<Discs>,
    glass: Option<Glass>,
    dome: Option<(&'a Dome, DirectionSet)>,
}

/// Answers of some sensors in a row; lists that are not asked for are empty.
struct Part<'a> {
    words: &'a mut [u64],
    shares: &'a mut [f32],
    factors: &'a mut [f64],
    sampled: u64,
}

impl Asked<'_> {
    /// Answers what does not depend on glass.
    fn keepable(&self, range: &Range<usize>, part: &mut Part<'_>) -> Result<(), StudyError> {
        let (index, sensors) = (self.index, self.sensors);
        sunlit(index, sensors, range.start, &self.suns, part.words)?;
        if let Some(discs) = &self.discs {
            part.sampled = discs.shares(index, sensors, range.start, part.shares);
        }
        if self.glass.is_none() {
            self.factors(range, part)?;
        }
        Ok(())
    }

    /// Answers what depends on glass.
    fn filtered(&self, range: &Range<usize>, part: &mut Part<'_>) -> Result<(), BatchError> {
        let directions = self.questions.directions;
        if self.discs.is_none() && !part.shares.is_empty() {
            shares::of_bits(part.words, directions.len(), part.shares);
        }
        let Some(glass) = &self.glass else {
            return Ok(());
        };
        let suns = (directions, &self.suns);
        glass.filter(self.index, self.sensors, range.clone(), suns, part.shares)?;
        self.factors(range, part)
    }

    fn factors(&self, range: &Range<usize>, part: &mut Part<'_>) -> Result<(), BatchError> {
        let Some((dome, set)) = &self.dome else {
            return Ok(());
        };
        let (index, glass) = (self.index, self.glass.as_ref());
        let dome = (*dome, set);
        factors::sky_view_factors(index, glass, self.sensors, range.start, dome, part.factors)
    }
}

impl Part<'_> {
    /// Returns the numbers of what is kept: words, pairs of shares, factors.
    fn lengths(&self, asked: &Asked<'_>) -> [usize; 3] {
        let shares = asked.discs.as_ref().map_or(0, |_| self.shares.len());
        let factors = match asked.glass {
            None => self.factors.len(),
            Some(_) => 0,
        };
        [self.words.len(), shares.div_ceil(2), factors]
    }

    /// Returns what is kept as words.
    fn packed(&self, asked: &Asked<'_>) -> Vec<u64> {
        let [_, pairs, factors] = self.lengths(asked);
        let bits = |share: Option<&f32>| u64::from(share.copied().unwrap_or_default().to_bits());
        let shares = self.shares.chunks(2).take(pairs);
        let shares = shares.map(|pair| bits(pair.first()) | bits(pair.get(1)) << 32);
        let factors = self.factors.iter().take(factors);
        let words = self.words.iter().copied().chain(shares);
        let words = words.chain(factors.map(|factor| factor.to_bits()));
        let sampled = asked.discs.as_ref().map(|_| self.sampled);
        words.chain(sampled).collect()
    }

    /// Takes what an earlier run kept. Returns whether it did.
    fn load(&mut self, kept: &Kept, chunk: usize, asked: &Asked<'_>) -> bool {
        let [words, pairs, factors] = self.lengths(asked);
        let mut packed = vec![0; words + pairs + factors + usize::from(asked.discs.is_some())];
        if !kept.load(chunk, &mut packed) {
            return false;
        }
        let (own, rest) = packed.split_at(words);
        let (own_shares, rest) = rest.split_at(pairs);
        let (own_factors, rest) = rest.split_at(factors);
        self.words.copy_from_slice(own);
        for (pair, word) in self.shares.chunks_mut(2).zip(own_shares) {
            for (share, half) in pair.iter_mut().zip([*word as u32, (*word >> 32) as u32]) {
                *share = f32::from_bits(half);
            }
        }
        for (factor, word) in self.factors.iter_mut().zip(own_factors) {
            *factor = f64::from_bits(*word);
        }
        self.sampled = rest.first().copied().unwrap_or_default();
        true
    }
}

/// Returns a hash of all that kept answers depend on; glass apart, whose answers are not kept.
///
/// # Errors
/// The holes of alpha-tested faces do not say what they are.
pub fn identity(
    occluders: &Occluders,
    sensors: &Sensors,
    questions: &Questions<'_>,
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
    let rows = |list: &[DVec3]| list.iter().map(|to| to.to_array()).collect::<Vec<_>>();
    numbers(1, &rows(questions.directions));
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
    let Light {
        sun_diameter,
        through_glass,
    } = questions.light;
    if let Some(degrees) = sun_diameter {
        hash.update(&[6]);
        hash.update(&degrees.to_le_bytes());
    }
    if let Some(dome) = questions.dome {
        // Factors through glass are not kept.
        hash.update(&[7, u8::from(through_glass)]);
        for (to, weight) in dome.directions.iter().zip(&dome.weights) {
            for number in to.to_array().into_iter().chain([*weight]) {
                hash.update(&number.to_le_bytes());
            }
        }
        for number in dome.up.to_array() {
            hash.update(&number.to_le_bytes());
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
