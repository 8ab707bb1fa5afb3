//! The memory limit: what it is, and who needs how much of it.
//!
//! In: predictions, made before anything is taken. Out: a refusal that names each part.

use std::fmt;
use std::fs;
use std::path::Path;

use crate::failure::Failure;
use crate::machine;
use crate::values::format_bytes;

/// What to allow where the system does not say how much there is.
const UNKNOWN_MACHINE: u64 = 4 << 30;

/// Returns the limit in bytes: as typed, or three quarters of the machine's memory.
pub(crate) fn limit(typed: Option<u64>) -> u64 {
    typed.unwrap_or_else(|| machine::memory_bytes().map_or(UNKNOWN_MACHINE, |all| all / 4 * 3))
}

/// Refuses a scene file that is larger than all memory that may be taken, before it is read.
pub(crate) fn check_file(path: &Path, limit: u64) -> Result<(), Failure> {
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
pub(crate) struct Need {
    pub(crate) scene: u64,
    pub(crate) surfaces: u64,
    /// Film, layers and file.
    pub(crate) picture: u64,
    /// Arrays of points, normals and answers.
    pub(crate) arrays: u64,
    /// Grid and occlusion values.
    pub(crate) index: u64,
}

impl Need {
    fn parts(&self) -> [(&'static str, u64, &'static str); 5] {
        [
            ("scene", self.scene, "raise --memory-limit"),
            ("surfaces", self.surfaces, "raise --memory-limit"),
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
                "grid and occlusion values",
                self.index,
                "give --grid fewer voxels, or raise --memory-limit",
            ),
        ]
    }

    /// Returns the sum of all parts.
    pub(crate) fn total(&self) -> u64 {
        let add = |sum: u64, (_, bytes, _): (_, u64, _)| sum.saturating_add(bytes);
        self.parts().into_iter().fold(0, add)
    }

    /// Refuses what exceeds the limit; advises by the largest part.
    pub(crate) fn check(&self, limit: u64) -> Result<(), Failure> {
        if self.total() <= limit {
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
        write!(f, "about {}", format_bytes(self.total()))?;
        let parts = self.parts().into_iter().filter(|&(_, bytes, _)| bytes > 0);
        for (i, (name, bytes, _)) in parts.enumerate() {
            let before = if i == 0 { " (" } else { ", " };
            write!(f, "{before}{name} {}", format_bytes(bytes))?;
        }
        write!(f, ")")
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
            index: 20,
        };
        assert_eq!(need.check(2078), Ok(()));
        let expected = Failure::input(
            "more memory is needed than the limit of 2.0 KiB: about 2.0 KiB (scene 10 B, picture \
             2.0 KiB, grid and occlusion values 20 B)",
            "give a smaller --size or fewer layers with --aov, or raise --memory-limit",
        );
        assert_eq!(need.check(2077), Err(expected));
        let endless = Need {
            index: u64::MAX,
            ..need
        };
        assert!(endless.check(u64::MAX - 1).is_err());
        assert!(limit(None) > 0);
    }
}
