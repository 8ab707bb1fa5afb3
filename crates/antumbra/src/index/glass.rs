//! Glass: an index of the surfaces that filter light.
//!
//! In: an index. Out: an index of its filtering surfaces alone, as if they were opaque, made at the first query that wants
//! it. Invariant: its lights are those of the index that holds it. Paper 6.3.

use std::sync::Arc;

use super::ShadowIndex;
use crate::{Method, threads};

/// Of the memory of what lights know, this share is for what they know of glass.
pub(super) const GLASS_SHARE: u64 = 4;

impl ShadowIndex {
    /// Returns whether there are surfaces that color the light that goes through them
    /// ([`Opacity::Filtering`](crate::Opacity::Filtering)). Without, what reaches a point is all of a light or nothing.
    pub fn has_glass(&self) -> bool {
        self.has_filters
    }

    /// Returns the index of the filtering surfaces, if there are any; built now if it is not there.
    pub(crate) fn glass(&self) -> Option<&Self> {
        if !self.has_filters {
            return None;
        }
        // Threads of a batch wait for it.
        let build = || Box::new(threads::apart(|| self.build_glass()));
        Some(self.glass.get_or_init(build))
    }

    fn build_glass(&self) -> Self {
        let surfaces = Arc::new(self.occluders.filters_alone());
        let index = Self::builder(surfaces, self.lights.clone())
            // Voxel by voxel nothing is known of points on surfaces that are left out; a map knows of all.
            .method(match self.method {
                Method::Voxel => Method::Auto,
                method => method,
            })
            .rays(self.rays)
            .refinement(self.glass_refinement)
            .build();
        index.expect("what builds all surfaces builds some of them")
    }

    /// Returns the index of the filtering surfaces, if it was built.
    pub(super) fn built_glass(&self) -> Option<&Self> {
        self.glass.get().map(|index| &**index)
    }

    pub(super) fn built_glass_mut(&mut self) -> Option<&mut Self> {
        self.glass.get_mut().map(|index| &mut **index)
    }
}
