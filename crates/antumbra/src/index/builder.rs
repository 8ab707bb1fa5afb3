//! From surfaces, lights and settings to an index: what is made, in which order, and what is refused.

use std::path::PathBuf;
use std::sync::Arc;

use antumbra_geometry::{LightId, LightShape, Occluders};

use super::ShadowIndex;
use super::glass::GLASS_SHARE;
use super::needs::{check_light, knowledge, layout, needs_bvh, needs_grid};
use super::predict::Asked;
use super::refused::BuildError;
use crate::accel::bvh::Tree;
use crate::accel::grid::Grid;
use crate::accel::parts::{Parts, Split};
#[cfg(feature = "file")]
use crate::file::SavedFile;
use crate::occlusion::{AdaptiveValues, mark, quick_check};
use crate::{GridResolution, Method, QuickCheck, RayMethod, Refine, Refinement};

/// Collects settings for a [`ShadowIndex`].
#[derive(Clone, Debug)]
pub struct Builder {
    occluders: Arc<Occluders>,
    lights: Vec<LightShape>,
    method: Method,
    rays: RayMethod,
    resolution: GridResolution,
    quick_check: QuickCheck,
    refinement: Refinement,
    has_tree: bool,
    memory_limit: Option<u64>,
    occlusion_file: Option<PathBuf>,
}

impl Builder {
    pub(super) fn new(occluders: Arc<Occluders>, lights: Vec<LightShape>) -> Self {
        Self {
            occluders,
            lights,
            method: Method::default(),
            rays: RayMethod::default(),
            resolution: GridResolution::default(),
            quick_check: QuickCheck::default(),
            refinement: Refinement::default(),
            has_tree: true,
            memory_limit: None,
            occlusion_file: None,
        }
    }

    /// Chooses how shadow queries are answered.
    #[must_use]
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// Chooses what finds nearest hits.
    #[must_use]
    pub fn rays(mut self, rays: RayMethod) -> Self {
        self.rays = rays;
        self
    }

    /// Chooses the grid's resolution.
    #[must_use]
    pub fn grid(mut self, resolution: GridResolution) -> Self {
        self.resolution = resolution;
        self
    }

    /// Chooses what the quick check does.
    #[must_use]
    pub fn quick_check(mut self, quick_check: QuickCheck) -> Self {
        self.quick_check = quick_check;
        self
    }

    /// Chooses how far values are refined.
    #[must_use]
    pub fn refinement(mut self, refinement: Refinement) -> Self {
        self.refinement = refinement;
        self
    }

    /// Keeps no tree, for callers that bring rays of their own ([`ShadowIndex::with_rays`]). Whatever would
    /// have asked the tree walks the grid instead, with the same answers and slower. Values of
    /// [`Method::Voxel`] are made before the first query, while there is a tree to make them with.
    #[must_use]
    pub fn without_tree(mut self) -> Self {
        self.has_tree = false;
        self
    }

    /// Limits the memory of grid, tree and values, in bytes; without it there is no limit. What lights know of
    /// [`Method::Voxel`] takes no more than the others leave, and [`Refinement::memory`] at most: so only the others
    /// may be too much. The surfaces themselves, lights and answers are not counted.
    #[must_use]
    pub fn memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = Some(bytes);
        self
    }

    /// Takes the maps of [`Method::Auto`] or the values of [`Method::Voxel`] that [`ShadowIndex::save`] has written to
    /// a file, instead of making them: those of all lights whose kind and pose are in it, in any order
    /// ([`ShadowIndex::saved_lights`] says which). The others are made as without a file. [`Method::Auto`] takes either,
    /// and becomes [`Method::Voxel`] with a file of values. The file is only read, and not needed any more once the
    /// index is built; what is made later goes on from it.
    ///
    /// Needs the feature `file`, which is on by default.
    #[cfg(feature = "file")]
    #[must_use]
    pub fn occlusion_file(mut self, path: impl Into<PathBuf>) -> Self {
        self.occlusion_file = Some(path.into());
        self
    }

    /// Builds what the settings need of grid, tree and occlusion values, on all threads of the current rayon
    /// pool. Inside [`Task::run`](crate::Task::run) it can be stopped within a second, as every long call can.
    ///
    /// # Errors
    /// A light or a setting is out of range, the memory limit is too small, or the file of
    /// [`Builder::occlusion_file`] is refused: it was cut off or damaged, is something else, or is about another
    /// scene or other settings.
    #[cfg_attr(
        not(feature = "file"),
        expect(
            unused_mut,
            reason = "no file changes the method, and nothing is taken from one"
        )
    )]
    pub fn build(mut self) -> Result<ShadowIndex, BuildError> {
        let has_file = self.occlusion_file.is_some();
        #[cfg(feature = "file")]
        let saved = self.occlusion_file.take();
        #[cfg(feature = "file")]
        let saved = saved.as_deref().map(SavedFile::open).transpose()?;
        #[cfg(feature = "file")]
        if let Some(saved) = &saved {
            self.method = saved.method(self.method)?;
        }
        // What was asked for must be possible before anything is taken.
        for (index, light) in self.lights.iter().enumerate() {
            check_light(LightId::from_index(index), light)?;
        }
        let mut refinement = self.refinement;
        if let Some(limit) = self.memory_limit {
            let predicted = Asked {
                occluders: &self.occluders,
                light_count: self.lights.len(),
                resolution: self.resolution,
                has_grid: self.needs_grid(),
                method: self.method,
                has_tree: self.makes_tree(),
                refinement,
                query_count: None,
            }
            .predict()?;
            let left = limit.checked_sub(predicted.needed());
            let left = left.ok_or(BuildError::Memory { predicted, limit })?;
            refinement.memory = refinement.memory.min(left);
        }
        let has_filters = self.occluders.has_filters();
        let mut glass_refinement = refinement;
        if has_filters {
            glass_refinement.memory /= GLASS_SHARE;
            refinement.memory -= glass_refinement.memory;
        }
        let parts = Parts::new(&self.occluders, self.split());
        let occluders = &*parts.near;
        let layout = layout(occluders, occluders.bounds(), self.resolution)?;
        let grid = self.needs_grid().then(|| Grid::build(occluders, layout));

        // Paper 7.3: perhaps the values are not worth it.
        let verdict = match (self.quick_check, &grid) {
            (QuickCheck::Off, _) | (_, None) => None,
            (QuickCheck::Report | QuickCheck::Obey, Some(grid)) => {
                Some(quick_check(occluders, grid))
            }
        };
        let is_advised_against = self.quick_check == QuickCheck::Obey
            && verdict.is_some_and(|verdict| !verdict.is_advised);
        let method = match self.method {
            Method::Voxel1990 if is_advised_against => Method::Grid,
            method => method,
        };
        let values = match (method, &grid) {
            (Method::Voxel1990, Some(grid)) => self
                .lights
                .iter()
                .map(|light| mark(occluders, grid, light))
                .collect(),
            _ => Vec::new(),
        };
        let lights = &self.lights;
        let knowledge = knowledge(method);
        let mut adaptive = knowledge.map(|knowledge| {
            let mut making = refinement.making(knowledge);
            if !self.has_tree {
                // While there is one.
                making.refine = Refine::Eager;
            }
            AdaptiveValues::new(occluders, lights, &making)
        });
        #[cfg(feature = "file")]
        if let (Some(saved), Some(values)) = (&saved, &adaptive) {
            saved.check(values, &self.occluders)?;
        }
        #[cfg(feature = "file")]
        let topology = saved
            .as_ref()
            .map(|saved| saved.tree(occluders))
            .transpose()?;
        #[cfg(not(feature = "file"))]
        let topology = None;
        let tree = self.makes_tree().then(|| match topology.flatten() {
            // With all values there may never be a ray.
            Some(topology) => Tree::later(topology),
            None => Tree::now(occluders),
        });
        let mut saved_lights = Vec::new();
        if let (Some(values), Some(tree)) = (&mut adaptive, &tree) {
            #[cfg(feature = "file")]
            if let Some(saved) = &saved {
                saved_lights = saved.take(values, occluders, lights)?;
            }
            values.make_first(occluders, || tree.get(occluders), 0..lights.len());
        }
        let tree = tree.filter(|_| self.has_tree);
        Ok(ShadowIndex {
            surface_count: self.occluders.surface_count(),
            occluders: self.occluders,
            parts,
            lights: self.lights,
            method,
            rays: self.rays,
            layout,
            grid,
            tree,
            values,
            adaptive,
            saved_lights,
            all_lights: std::sync::OnceLock::new(),
            whole_lights: std::sync::OnceLock::new(),
            has_filters,
            glass_refinement,
            glass: std::sync::OnceLock::new(),
            quick_check: verdict,
            has_file,
            memory_limit: self.memory_limit,
        })
    }
}

impl Builder {
    fn split(&self) -> Split {
        match self.method {
            Method::Grid | Method::Voxel1990 => Split::Narrow,
            _ if self.needs_grid() => Split::Narrow,
            Method::Auto | Method::Voxel | Method::Bvh | Method::Naive => Split::Wide,
        }
    }

    /// Returns whether anything will walk the grid or look at it.
    fn needs_grid(&self) -> bool {
        needs_grid(self.method, self.rays) || self.quick_check != QuickCheck::Off || !self.has_tree
    }

    /// Returns whether a tree is built: if it is not kept, to compute values with.
    fn makes_tree(&self) -> bool {
        match self.has_tree {
            true => needs_bvh(self.method, self.rays),
            false => self.method == Method::Voxel,
        }
    }
}

impl ShadowIndex {
    /// Starts an index over `occluders` for `lights`; queries name lights by their place here.
    pub fn builder(occluders: Arc<Occluders>, lights: Vec<LightShape>) -> Builder {
        Builder::new(occluders, lights)
    }
}
