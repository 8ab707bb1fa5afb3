//! What lights know, written to a file.
//!
//! In: surfaces, lights and what these know. Out: a file, whole or the one before.

use std::io::{self, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use antumbra_files::{Place, Writing};
use antumbra_geometry::{LightShape, Occluders};

use super::layout::{Head, Kind, LightEntry, Settings, TreeEntry};
use super::refused::{SaveError, Saved};
use super::{checksum, identity, words};
use crate::accel::bvh::Bvh;
use crate::occlusion::{AdaptiveValues, KeptValues};

/// Returns whether a file may be written at a path ([`crate::ShadowIndex::check_save`]).
pub(crate) fn check_save(path: &Path) -> Result<(), SaveError> {
    let unwritable = |error: io::Error| SaveError::unwritable(path, &error);
    let place = Place::of(path).map_err(|refusal| unwritable(refusal.into()))?;
    match place {
        Place::File if !Head::begins(path).map_err(unwritable)? => Err(SaveError::Foreign {
            path: path.to_owned(),
        }),
        _ => Ok(()),
    }
}

/// Writes what is known of all lights. `near` are the surfaces that a tree is built over.
pub(crate) fn save(
    path: &Path,
    (occluders, near): (&Occluders, &Occluders),
    lights: &[LightShape],
    values: &AdaptiveValues,
) -> Result<Saved, SaveError> {
    check_save(path)?;
    let scene = identity::of_scene(occluders)?;
    let tree = Bvh::topology(near);
    let mut head = Head {
        kind: Kind::of(values),
        settings: Settings::of(values),
        scene,
        cells: identity::of_cells(values),
        tree: TreeEntry {
            checksum: checksum::of_runs([&*tree]),
            word_count: tree.len() as u64,
        },
        lights: Vec::with_capacity(lights.len()),
    };
    let mut saved = Saved {
        bytes: 0,
        pending_count: 0,
    };
    let head_bytes = Head::bytes_for(lights.len());
    let unwritable = |error| SaveError::unwritable(path, &error);
    let fill = |file: &mut Writing<'_>| {
        // The head comes last, when all checksums are known.
        file.seek(SeekFrom::Start(head_bytes))?;
        words::write(file, tree.into())?;
        for (number, light) in lights.iter().enumerate() {
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
