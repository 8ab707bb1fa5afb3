//! Why there is no index.

use antumbra_geometry::LightId;

use super::prediction::Prediction;
use crate::file::LoadError;

/// Why an index cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A light is not finite, too large, or a zero direction.
    #[error(
        "light {light}: position or direction must be finite, at most 2^100 and not a zero direction"
    )]
    BadLight {
        /// Number of the light.
        light: LightId,
    },
    /// A grid resolution is out of range.
    #[error(
        "grid resolution {0:?}: each axis takes 1 to 2048 voxels, and all together fewer than 2^32 - 1 \
         (about 1625 an axis)"
    )]
    BadResolution([u32; 3]),
    /// The grid, the tree and the values of the grid would need more memory than allowed.
    #[error("{} bytes are needed, more than the limit of {limit}: {predicted}", predicted.needed())]
    Memory {
        /// What is predicted, without what lights know of [`Method::Voxel`](crate::Method::Voxel): that takes what is left.
        predicted: Prediction,
        /// Allowed bytes.
        limit: u64,
    },
    /// A file of occlusion values is refused.
    #[error(transparent)]
    Occlusion(#[from] LoadError),
}
