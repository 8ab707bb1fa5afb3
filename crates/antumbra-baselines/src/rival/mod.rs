//! The rivals of the paper's time, each from its own paper.
//!
//! In: a [`ShadowIndex`] (its surfaces, lights and, for those who walk, its grid). Out: one [`Rival`] for
//! all lights, which answers query by query.
//!
//! | rival | from | module |
//! |---|---|---|
//! | `light-buffer` | Haines and Greenberg 1986, Paper 5.1 | `light_buffer` |
//! | `hybrid` | Eo and Kyung 1989, Paper 5.2 | `hybrid` |
//! | `shadow-volumes` | Crow 1977 | `shadow_volumes` |
//! | `shadow-map` | Williams 1978 | `shadow_map` |
//!
//! Invariant: all but `shadow-map` give the reference's bit (EXACTNESS.md). What a rival keeps only says
//! which surfaces need not be asked, or that signs decide which are certain; whatever is in doubt is asked
//! of `Occluders::blocks`. Rounding is allowed for in two places and nowhere else: `forms`, with an error
//! bound for each sign, and `projection`, with margins around cells.
//!
//! How a rival decides is told in the words of [`Decided`](antumbra::Decided): `FirstPass` without testing a surface (an empty
//! or fully occluded cell, a shadow count, a depth), `BlockerList` by testing candidates, `Ray` by a shadow
//! ray after all.

mod forms;
pub mod formulas;
mod hybrid;
mod kind;
mod light_buffer;
mod plane;
mod projected;
mod projection;
mod shadow_map;
mod shadow_volumes;

use antumbra::ShadowIndex;
pub use hybrid::Hybrid;
pub use kind::{Rival, RivalError, RivalKind, RivalOptions, Work};
use kind::{answer, any_blocks, by_all};
pub use light_buffer::LightBuffer;
pub use shadow_map::ShadowMap;
pub use shadow_volumes::ShadowVolumes;

impl RivalKind {
    /// Prepares the rival for all lights of `index`, on the thread that calls.
    ///
    /// # Errors
    /// It needs more memory than it may take.
    pub fn build(
        self,
        index: &ShadowIndex,
        options: &RivalOptions,
    ) -> Result<Box<dyn Rival>, RivalError> {
        Ok(match self {
            Self::LightBuffer => Box::new(LightBuffer::new(index, options)?),
            Self::Hybrid => Box::new(Hybrid::new(index, options)?),
            Self::ShadowVolumes => Box::new(ShadowVolumes::new(index, options)?),
            Self::ShadowMap => Box::new(ShadowMap::new(index, options)?),
        })
    }
}
