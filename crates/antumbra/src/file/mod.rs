//! Knowledge that is saved: what an index has found out, in a file for the next process (Paper 7.1).
//!
//! In: surfaces, lights and what these know, or a file. Out: a file, or values that need not be computed again.
//! Invariants: a file is whole or the one before; what is not the same scene, settings and light is never
//! taken; whatever is in a file, and whatever becomes of it meanwhile, nothing panics, hangs or reads out of
//! range. A checksum detects damage, not malice: who writes a file with right checksums can make answers wrong.
//! docs/formats.md describes the bytes. The only folder of this crate that touches files.
//!
//! | module | what |
//! |---|---|
//! | `checksum` | whether bytes are what they were |
//! | `identity` | whose values they are, as hashes |
//! | `layout` | the head of a file: where what is, and checksums |
//! | `refused` | what was taken of a file, and why one is refused |
//! | `save` | what is written |
//! | `words` | words and bytes in a file |

#[cfg(feature = "file")]
mod checksum;
#[cfg(feature = "file")]
mod identity;
#[cfg(feature = "file")]
mod layout;
mod refused;
#[cfg(feature = "file")]
mod save;
#[cfg(feature = "file")]
mod words;

#[cfg(feature = "file")]
use std::borrow::Cow;
#[cfg(feature = "file")]
use std::io;
#[cfg(feature = "file")]
use std::path::Path;

#[cfg(feature = "file")]
use antumbra_geometry::{LightId, LightShape, Occluders};

#[cfg(feature = "file")]
use crate::Method;
#[cfg(feature = "file")]
use crate::accel::bvh::Topology;
#[cfg(feature = "file")]
use crate::occlusion::{AdaptiveValues, Misfit, RUNS};
#[cfg(feature = "file")]
use checksum::Checksum;
#[cfg(feature = "file")]
use layout::{Head, Settings, TreeEntry};
#[cfg(feature = "file")]
use words::Parts;

pub use refused::{Change, LoadError, Part, Refusal, SaveError, Saved, SavedLight};

#[cfg(feature = "file")]
pub(crate) use save::{check_save, save};

/// A file of what lights know.
#[cfg(feature = "file")]
pub(crate) struct SavedFile<'a> {
    path: &'a Path,
    parts: Parts,
    head: Head,
}

#[cfg(feature = "file")]
impl<'a> SavedFile<'a> {
    /// Opens a file.
    pub(crate) fn open(path: &'a Path) -> Result<Self, LoadError> {
        let open = || {
            let parts = Parts::open(path).map_err(unreadable)?;
            let head = Head::read(&parts)?;
            Ok(Self { path, parts, head })
        };
        open().map_err(|reason| LoadError::new(path, reason))
    }

    /// Returns the method that answers with the file where one is wanted.
    pub(crate) fn method(&self, wanted: Method) -> Result<Method, LoadError> {
        let found = self.head.kind.method();
        match wanted {
            Method::Auto => Ok(found),
            Method::Voxel if found == Method::Voxel => Ok(found),
            Method::Voxel => Err(self.refused(Refusal::OtherMethod)),
            _ => Err(self.refused(Refusal::NoValues)),
        }
    }

    /// Refuses the file if it is about something else.
    pub(crate) fn check(
        &self,
        values: &AdaptiveValues,
        occluders: &Occluders,
    ) -> Result<(), LoadError> {
        let check = || {
            // Cheap ones first.
            self.head.settings.check(&Settings::of(values))?;
            if self.head.scene != identity::of_scene(occluders)? {
                return Err(Refusal::Stale(Change::Scene));
            }
            if self.head.cells != identity::of_cells(values) {
                return Err(Refusal::Stale(Change::Cells));
            }
            Ok(())
        };
        check().map_err(|reason| self.refused(reason))
    }

    /// Returns how the file has the tree built; none if it does not say.
    pub(crate) fn tree(&self, occluders: &Occluders) -> Result<Option<Topology>, LoadError> {
        let TreeEntry {
            checksum,
            word_count,
        } = self.head.tree;
        let counts = [word_count];
        let [words] = self.runs(Part::Tree, self.head.tree_at(), counts, &checksum)?;
        if words.is_empty() {
            return Ok(None);
        }
        let tree = Topology::new(words, occluders);
        let what = "no tree over the surfaces";
        tree.map(Some)
            .ok_or_else(|| self.malformed(Part::Tree, 0, what))
    }

    /// Takes what the file knows of some lights.
    pub(crate) fn take(
        &self,
        values: &AdaptiveValues,
        occluders: &Occluders,
        lights: &[LightShape],
    ) -> Result<Vec<SavedLight>, LoadError> {
        let take = |(number, light)| {
            let Some((entry, at)) = self.head.find(&identity::of_light(light)) else {
                return Ok(SavedLight::Absent);
            };
            let part = Part::Light(LightId::from_index(number));
            let runs: [_; RUNS] = self.runs(part, at, entry.word_counts, &entry.checksum)?;
            match values.take(occluders, number, runs.map(Cow::Owned)) {
                Ok(()) => Ok(SavedLight::Loaded),
                Err(Misfit::NoRoom) => Ok(SavedLight::NoRoom),
                Err(Misfit::At(word, what)) => Err(self.malformed(part, word, what)),
            }
        };
        lights.iter().enumerate().map(take).collect()
    }

    /// Returns copies of runs of words that make a part, which is checked and which nobody can change any more.
    fn runs<const N: usize>(
        &self,
        part: Part,
        mut at: u64,
        counts: [u64; N],
        checksum: &Checksum,
    ) -> Result<[Vec<u32>; N], LoadError> {
        let mut runs = [const { Vec::new() }; N];
        for (run, count) in runs.iter_mut().zip(counts) {
            let words = self.parts.words(at, count);
            *run = words.map_err(|error| LoadError::new(self.path, unreadable(error)))?;
            at += 4 * count;
        }
        if checksum::of_runs(runs.each_ref().map(Vec::as_slice)) == *checksum {
            Ok(runs)
        } else {
            Err(LoadError::new(self.path, Refusal::Damaged(part)))
        }
    }

    fn malformed(&self, part: Part, word: usize, what: &'static str) -> LoadError {
        self.refused(Refusal::Malformed { part, word, what })
    }

    fn refused(&self, reason: Refusal) -> LoadError {
        LoadError::new(self.path, reason)
    }
}

#[cfg(feature = "file")]
fn unreadable(error: io::Error) -> Refusal {
    Refusal::Unreadable(error.to_string())
}
