//! The table of what blocks suns.

use std::path::Path;

use antumbra_geometry::SurfaceId;
use antumbra_render::prepare::Prepared;
use antumbra_sun::{Blockers, write_blockers};

use super::groups;
use crate::failure::Failure;
use crate::outputs;

/// Writes what each object takes from each sensor.
pub(super) fn write(path: &Path, of: &Blockers<'_>, prepared: &Prepared) -> Result<(), Failure> {
    let objects = groups::objects(prepared.scene());
    let gathered = prepared.gathered();
    let object_of = |surface: SurfaceId| {
        let object = gathered.place_of(surface).object as usize;
        objects.of[object] as usize
    };
    write_blockers(path, of, &objects.names, object_of)
        .map_err(|error| outputs::unwritable(path, error))
}
