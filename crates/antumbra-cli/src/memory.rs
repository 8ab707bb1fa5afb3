//! The memory limit: what it is, and who needs how much of it.
//!
//! In: predictions, made before anything is taken. Out: a refusal that names each part.

use std::fmt;
use std::fs;
use std::path::Path;

use antumbra::Prediction;

use crate::failure::Failure;
use crate::machine;
use crate::values::format_bytes;

/// What to allow where the system does not say how much there is.
const UNKNOWN_MACHINE: u64 = 4 << 30;

/// Returns the limit in bytes: as typed, or three quarters of the machine's memory.
pub fn limit(typed: Option<u64>) -> u64 {
    typed.unwrap_or_else(|| machine::memory_bytes().map_or(UNKNOWN_MACHINE, |all| all / 4 * 3))
}

/// Refuses a scene file that is larger than all memory that may be taken, before it is read.
pub fn check_file(path: &Path, limit: u64) -> Result<(), Failure> {
    // A file that is not there is the reader's to tell.
    let bytes = fs::metadata(path).map_or(0, |file| file.len());
    if bytes <= limit {
        return Ok(());
    }
    Err(Failure::input(
        format!(
            "{}: the file alone takes {}, more than the limit of {}",
            path.display(),
            format_bytes(bytes),
            format_bytes(limit)
        ),
        "raise --memory-limit",
    ))
}

/// Bytes needed, by who needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Need {
    pub scene: u64,
    pub surfaces: u64,
    /// Film, layers and file.
    pub picture: u64,
    /// Arrays of points, normals and answers.
    pub arrays: u64,
    /// Grid, tree and occlusion values. What lights know takes what is left of the limit, and is never too much.
    pub index: Prediction,
}

const RAISE: &str = "raise --memory-limit";

impl Need {
    /// Returns what cannot be done without, each with its name and how to need less of it.
    fn parts(&self) -> [(&'static str, u64, &'static str); 7] {
        [
            ("scene", self.scene, RAISE),
            ("surfaces", self.surfaces, RAISE),
            (
                "picture",
                self.picture,
                "give a smaller --size or fewer layers with --aov, or raise --memory-limit",
            ),
            (
                "points and answers",
                self.arrays,
                "ask about fewer points at a time, or raise --memory-limit",
            ),
            (
                "grid",
                self.index.grid,
                "give --grid fewer voxels, or raise --memory-limit",
            ),
            (
                "tree",
                self.index.tree,
                "raise --memory-limit, or use a scene of fewer surfaces",
            ),
            (
                "values of the grid",
                self.index.values,
                "give --grid fewer voxels, ask about fewer lights, choose --shadows bvh, or raise --memory-limit",
            ),
        ]
    }

    /// Returns what cannot be done without.
    pub fn needed(&self) -> u64 {
        let add = |sum: u64, (_, bytes, _): (_, u64, _)| sum.saturating_add(bytes);
        self.parts().into_iter().fold(0, add)
    }

    /// Returns the sum of all, of which lights know no more than fits.
    pub fn total(&self, limit: u64) -> u64 {
        let all = self.needed().saturating_add(self.index.knowledge);
        all.min(limit.max(self.needed()))
    }

    /// Takes what is known once surfaces are gathered: what they take now instead of what gathering took, as far as that
    /// was not more than all that comes after it; and what the index will take.
    pub fn set_index(&mut self, surfaces: u64, index: Prediction) {
        let height = self.surfaces.saturating_sub(index.total());
        self.surfaces = surfaces.max(height);
        self.index = index;
    }

    /// Returns what an index may take.
    pub fn left_for_index(&self, limit: u64) -> u64 {
        let others = self.needed() - self.index.needed();
        limit.saturating_sub(others)
    }

    /// Refuses what exceeds the limit; advises by the largest part.
    pub fn check(&self, limit: u64) -> Result<(), Failure> {
        if self.needed() <= limit {
            return Ok(());
        }
        let largest = self.parts().into_iter().max_by_key(|&(_, bytes, _)| bytes);
        Err(Failure::input(
            format!(
                "more memory is needed than the limit of {}: {self}",
                format_bytes(limit)
            ),
            largest.map_or("", |(.., advice)| advice),
        ))
    }
}

impl fmt::Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "about {}", format_bytes(self.needed()))?;
        let parts = self.parts().into_iter().filter(|&(_, bytes, _)| bytes > 0);
        for (i, (name, bytes, _)) in parts.enumerate() {
            let before = if i == 0 { " (" } else { ", " };
            write!(f, "{before}{name} {}", format_bytes(bytes))?;
        }
        match self.index.knowledge {
            0 => write!(f, ")"),
            most => write!(
                f,
                "); what lights know takes up to {} of the rest",
                format_bytes(most)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_every_part_and_advises_by_the_largest() {
        let need = Need {
            scene: 10,
            surfaces: 0,
            picture: 2048,
            arrays: 0,
            index: Prediction {
                grid: 20,
                knowledge: 4096,
                ..Prediction::default()
            },
        };
        // What lights know takes what is left.
        assert_eq!(need.check(2078), Ok(()));
        assert_eq!(
            [2078, 3000, 1 << 20].map(|limit| need.total(limit)),
            [2078, 3000, 6174]
        );
        assert_eq!(need.left_for_index(3000), 3000 - 2058);
        let expected = Failure::input(
            "more memory is needed than the limit of 2.0 KiB: about 2.0 KiB (scene 10 B, picture \
             2.0 KiB, grid 20 B); what lights know takes up to 4.0 KiB of the rest",
            "give a smaller --size or fewer layers with --aov, or raise --memory-limit",
        );
        assert_eq!(need.check(2077), Err(expected));
        let endless = Need {
            index: Prediction {
                tree: u64::MAX,
                ..need.index
            },
            ..need
        };
        assert!(endless.check(u64::MAX - 1).is_err());
        assert!(limit(None) > 0);
    }

    #[test]
    fn what_gathering_took_counts_only_where_it_is_the_height() {
        let index = Prediction {
            tree: 500,
            ..Prediction::default()
        };
        for (gathering, expected) in [(900, 400), (300, 200)] {
            let mut need = Need {
                surfaces: gathering,
                ..Need::default()
            };
            need.set_index(200, index);
            assert_eq!(need.surfaces, expected);
            assert_eq!(need.needed(), expected + 500);
        }
    }
}
