//! Knowledge that is kept: what an index has found out, in a file for the next process (Paper 7.1).
//!
//! In: an index, or a file and what is asked about. Out: a file, or values that need not be made again.
//! Invariants: a file is whole or the one before; what is not the same scene, settings and light is never
//! taken; whatever is in a file, and whatever becomes of it meanwhile, nothing panics, hangs or reads out of
//! range. A checksum tells damage, not malice: who writes a file with right checksums can make answers wrong.
//! docs/formats.md describes the bytes. The only folder of this crate that touches files.
//!
//! | module | what |
//! |---|---|
//! | `checksum` | whether bytes are what they were |
//! | `identity` | whose values they are, as hashes |
//! | `layout` | the head of a file: where what is, and checksums |
//! | `volume` | values for other programs, in memory |
//! | `words` | words and bytes in a file |

#[cfg(feature = "file")]
mod checksum;
#[cfg(feature = "file")]
mod identity;
#[cfg(feature = "file")]
mod layout;
mod volume;
#[cfg(feature = "file")]
mod words;

#[cfg(feature = "file")]
use std::borrow::Cow;
#[cfg(feature = "file")]
use std::io::{self, Seek as _, SeekFrom, Write as _};
#[cfg(feature = "file")]
use std::path::Path;
use std::path::PathBuf;

#[cfg(feature = "file")]
use antumbra_files::{Place, Writing};
use antumbra_geometry::UnidentifiedCoverage;
#[cfg(feature = "file")]
use antumbra_geometry::{LightShape, Occluders};

#[cfg(feature = "file")]
use crate::bvh::{Bvh, Topology};
#[cfg(feature = "file")]
use crate::occlusion::{AdaptiveValues, KeptValues, Misfit, RUNS};
#[cfg(feature = "file")]
use crate::{Method, ShadowIndex};
#[cfg(feature = "file")]
use checksum::Checksum;
#[cfg(feature = "file")]
use layout::{Head, Kind, LightEntry, Settings, TreeEntry};
#[cfg(feature = "file")]
use words::Parts;

pub use volume::Volume;

/// What became of the values of a light in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeptLight {
    /// They were taken.
    Taken,
    /// The file has none of a light of this kind and pose: it is new or has been moved. Its values are made
    /// as without a file.
    Absent,
    /// They need more memory than [`Refinement::memory`](crate::Refinement::memory) leaves, and are made as
    /// without a file.
    NoRoom,
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Saved {
    /// Length of the file.
    pub bytes: u64,
    /// Voxels and lists, of all lights, in whose place finer voxels may still be made.
    pub pending_count: u64,
}

/// Why a file of occlusion values is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}: {reason}", path.display())]
#[non_exhaustive]
pub struct LoadError {
    /// The file.
    pub path: PathBuf,
    /// Why.
    #[source]
    pub reason: Refusal,
}

/// What is wrong with a file of occlusion values.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The system does not let it be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// It is something else.
    #[error("is no file of occlusion values")]
    Foreign,
    /// It was written by another version of this library.
    #[error("has version {found} of the format; this library reads version {expected}")]
    Version {
        /// Version of the file.
        found: u32,
        /// Version that is read.
        expected: u32,
    },
    /// It has more or fewer bytes than it says.
    #[error("has {found} bytes, and {expected} are due: it was cut off or added to")]
    Length {
        /// Bytes there are.
        found: u64,
        /// Bytes there should be, as far as it can be told.
        expected: u64,
    },
    /// A checksum is wrong.
    #[error("is damaged: the checksum of {0} is wrong")]
    Damaged(Part),
    /// The checksums are right, and it makes no sense.
    #[error("makes no sense in {part}, word {word}: {what}")]
    Malformed {
        /// Where.
        part: Part,
        /// The word of that part.
        word: usize,
        /// What was found.
        what: &'static str,
    },
    /// It is about something else: what changed.
    #[error("is about {0}")]
    Stale(Change),
    /// What the scene is cannot be told.
    #[error(transparent)]
    Unidentified(#[from] UnidentifiedCoverage),
    /// The index keeps nothing: only [`Method::Auto`] and [`Method::Voxel`] do.
    #[error("is of no use to a method that keeps nothing")]
    NoValues,
    /// It holds maps of [`Method::Auto`], and [`Method::Voxel`] is wanted.
    #[error("holds maps of the method auto, not values of the method voxel")]
    OtherMethod,
}

/// A part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Part {
    /// What it is about, and where what is.
    Head,
    /// The tree over the surfaces.
    Tree,
    /// The values of the light of this index.
    Light(usize),
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Head => write!(f, "the head"),
            Self::Tree => write!(f, "the tree"),
            Self::Light(light) => write!(f, "light {light}"),
        }
    }
}

/// What is not as it was when a file was written. A light that changed is no reason to refuse a file
/// ([`KeptLight::Absent`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// A surface, its opacity, its holes, or the order of surfaces.
    Scene,
    /// A setting of [`Refinement`](crate::Refinement), by name; values depend on it.
    Setting {
        /// Which.
        name: &'static str,
        /// As the file has it; of resolutions the power of two.
        found: u32,
        /// As it is wanted.
        expected: u32,
    },
    /// How this library divides space.
    Cells,
}

impl std::fmt::Display for Change {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene => write!(f, "another scene: its surfaces are not these"),
            Self::Setting {
                name,
                found,
                expected,
            } => write!(f, "another {name}: {found}, and {expected} is wanted"),
            Self::Cells => write!(f, "other voxels than this library's"),
        }
    }
}

/// Why values were not saved. What was at the path is untouched.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SaveError {
    /// The index keeps nothing: only [`Method::Auto`] and [`Method::Voxel`] do.
    #[error("the method of this index keeps nothing")]
    NoValues,
    /// What the scene is cannot be told.
    #[error(transparent)]
    Unidentified(#[from] UnidentifiedCoverage),
    /// Something else is at the path, which is not replaced.
    #[error("{}: is no file of occlusion values, and is not replaced", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// The system refuses.
    #[error("cannot write {}: {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
}

#[cfg(feature = "file")]
impl ShadowIndex {
    /// Returns whether [`save`](Self::save) may write at a path: whether nothing is there, or a file of occlusion
    /// values, or an empty one, or a pipe or device that takes bytes.
    ///
    /// # Errors
    /// Something else is there, or the system refuses.
    pub fn check_save(path: impl AsRef<Path>) -> Result<(), SaveError> {
        let path = path.as_ref();
        let unwritable = |error: io::Error| SaveError::unwritable(path, &error);
        let place = Place::of(path).map_err(|refusal| unwritable(refusal.into()))?;
        match place {
            Place::File if !Head::begins(path).map_err(unwritable)? => Err(SaveError::Foreign {
                path: path.to_owned(),
            }),
            _ => Ok(()),
        }
    }

    /// Writes what is known of all lights to a file, for [`Builder::occlusion_file`](crate::Builder). What
    /// was there is replaced at once, when all is written and on the disk; a crash before leaves it whole.
    /// Only a file of occlusion values is replaced, or an empty one. Queries may be answered meanwhile.
    ///
    /// Takes at most as much memory as the values of the largest light, and as long as building the tree besides: how
    /// the tree is made is saved, too.
    ///
    /// # Errors
    /// The index keeps no values, a coverage does not say what it is
    /// ([`Coverage::identify`](antumbra_geometry::Coverage::identify)), something else is at the path
    /// ([`check_save`](Self::check_save)), or the system refuses.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<Saved, SaveError> {
        let path = path.as_ref();
        let values = self.knowledge().ok_or(SaveError::NoValues)?;
        Self::check_save(path)?;
        let scene = identity::of_scene(self.occluders())?;
        let tree = Bvh::topology(&self.parts.near);
        let mut head = Head {
            kind: Kind::of(values),
            settings: Settings::of(values),
            scene,
            cells: identity::of_cells(values),
            tree: TreeEntry {
                checksum: checksum::of_runs([&*tree]),
                word_count: tree.len() as u64,
            },
            lights: Vec::with_capacity(self.lights().len()),
        };
        let mut saved = Saved {
            bytes: 0,
            pending_count: 0,
        };
        let head_bytes = Head::bytes_for(self.lights().len());
        let unwritable = |error| SaveError::unwritable(path, &error);
        let fill = |file: &mut Writing<'_>| {
            // The head comes last, when all checksums are known.
            file.seek(SeekFrom::Start(head_bytes))?;
            words::write(file, tree.into())?;
            for (number, light) in self.lights().iter().enumerate() {
                let KeptValues {
                    runs,
                    pending_count,
                } = values.keep(number);
                head.lights.push(LightEntry {
                    key: identity::of_light(light),
                    checksum: checksum::of_runs(runs.iter().map(|run| &**run)),
                    word_counts: runs.each_ref().map(|run| run.len() as u64),
                    pending_count,
                });
                saved.pending_count += pending_count;
                runs.into_iter()
                    .try_for_each(|run| words::write(file, run))?;
            }
            saved.bytes = head.file_bytes();
            file.rewind()?;
            file.write_all(&head.to_bytes())
        };
        antumbra_files::write(path, |error| error, fill).map_err(unwritable)?;
        Ok(saved)
    }
}

#[cfg(feature = "file")]
impl SaveError {
    fn unwritable(path: &Path, error: &io::Error) -> Self {
        Self::Unwritable {
            path: path.to_owned(),
            reason: error.to_string(),
        }
    }
}

#[cfg(feature = "file")]
impl LoadError {
    fn new(path: &Path, reason: Refusal) -> Self {
        Self {
            path: path.to_owned(),
            reason,
        }
    }
}

#[cfg(feature = "file")]
/// A file of what lights know.
pub(crate) struct Kept<'a> {
    path: &'a Path,
    parts: Parts,
    head: Head,
}

#[cfg(feature = "file")]
impl<'a> Kept<'a> {
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
    ) -> Result<Vec<KeptLight>, LoadError> {
        let take = |(number, light)| {
            let Some((entry, at)) = self.head.find(&identity::of_light(light)) else {
                return Ok(KeptLight::Absent);
            };
            let part = Part::Light(number);
            let runs: [_; RUNS] = self.runs(part, at, entry.word_counts, &entry.checksum)?;
            match values.take(occluders, number, runs.map(Cow::Owned)) {
                Ok(()) => Ok(KeptLight::Taken),
                Err(Misfit::NoRoom) => Ok(KeptLight::NoRoom),
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
