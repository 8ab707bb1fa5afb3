//! What an index knows, saved to a file.

use std::path::Path;

use super::ShadowIndex;
use crate::file::{self, SaveError, Saved};

impl ShadowIndex {
    /// Returns whether [`save`](Self::save) may write at a path: whether nothing is there, or a file of occlusion
    /// values, or an empty one, or a pipe or device that takes bytes.
    ///
    /// # Errors
    /// Something else is there, or the system refuses.
    pub fn check_save(path: impl AsRef<Path>) -> Result<(), SaveError> {
        file::check_save(path.as_ref())
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
        let values = self.knowledge().ok_or(SaveError::NoValues)?;
        let surfaces = (self.occluders(), &*self.parts.near);
        file::save(path.as_ref(), surfaces, self.lights(), values)
    }
}
