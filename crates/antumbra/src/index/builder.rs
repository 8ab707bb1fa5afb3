//! From surfaces, lights and settings to an index: what is made, in which order, and what is refused.

use std::path::PathBuf;
use std::sync::Arc;

use antumbra_geometry::{Bounds, DVec3, LightShape, Occluders};

use super::predict::{Asked, Prediction};
use super::settings::{GridResolution, Method, QuickCheck, RayMethod, Refine, Refinement};
use super::{LARGEST, ShadowIndex};
use crate::bvh::Tree;
use crate::grid::{Grid, Layout, affordable_resolution};
#[cfg(feature = "file")]
use crate::kept::Kept;
use crate::kept::LoadError;
use crate::occlusion::{AdaptiveValues, Knowledge, mark, quick_check};
use crate::parts::{Parts, Split};

/// Why an index cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A light is not finite, too large, or a zero direction.
    #[error(
        "light {light}: position or direction must be finite, at most 2^100 and not a zero direction"
    )]
    BadLight {
        /// Index of the light.
        light: usize,
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
        /// What is predicted, without what lights know of [`Method::Voxel`]: that takes what is left.
        predicted: Prediction,
        /// Allowed bytes.
        limit: u64,
    },
    /// A file of occlusion values is refused.
    #[error(transparent)]
    Occlusion(#[from] LoadError),
}

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
    /// ([`ShadowIndex::kept_lights`] tells which). The others are made as without a file. [`Method::Auto`] takes either,
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
        let kept = self.occlusion_file.take();
        #[cfg(feature = "file")]
        let kept = kept.as_deref().map(Kept::open).transpose()?;
        #[cfg(feature = "file")]
        if let Some(kept) = &kept {
            self.method = kept.method(self.method)?;
        }
        // What was asked for must be possible before anything is taken.
        for (index, light) in self.lights.iter().enumerate() {
            check_light(index, light)?;
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
        if let (Some(kept), Some(values)) = (&kept, &adaptive) {
            kept.check(values, &self.occluders)?;
        }
        #[cfg(feature = "file")]
        let topology = kept.as_ref().map(|kept| kept.tree(occluders)).transpose()?;
        #[cfg(not(feature = "file"))]
        let topology = None;
        let tree = self.makes_tree().then(|| match topology.flatten() {
            // With all values there may never be a ray.
            Some(topology) => Tree::later(topology),
            None => Tree::now(occluders),
        });
        let mut kept_lights = Vec::new();
        if let (Some(values), Some(tree)) = (&mut adaptive, &tree) {
            #[cfg(feature = "file")]
            if let Some(kept) = &kept {
                kept_lights = kept.take(values, occluders, lights)?;
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
            kept_lights,
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

    /// Returns whether a tree is built: if it is not kept, to make values with.
    fn makes_tree(&self) -> bool {
        match self.has_tree {
            true => needs_bvh(self.method, self.rays),
            false => self.method == Method::Voxel,
        }
    }
}

/// Returns whether the settings ask for the grid.
pub(super) fn needs_grid(method: Method, rays: RayMethod) -> bool {
    matches!(method, Method::Voxel1990 | Method::Grid)
        || rays == RayMethod::Grid
        || !needs_bvh(method, rays)
}

pub(super) fn check_light(index: usize, light: &LightShape) -> Result<(), BuildError> {
    let (x, weight) = light.homogeneous();
    let is_fine =
        x.is_finite() && x.abs().max_element() <= LARGEST && (weight != 0.0 || x != DVec3::ZERO);
    if is_fine {
        Ok(())
    } else {
        Err(BuildError::BadLight { light: index })
    }
}

/// Returns whether the settings ask for the tree.
pub(super) fn needs_bvh(method: Method, rays: RayMethod) -> bool {
    matches!(method, Method::Bvh | Method::Voxel | Method::Auto) || rays == RayMethod::Bvh
}

/// Returns what lights know with a method.
pub(super) fn knowledge(method: Method) -> Option<Knowledge> {
    match method {
        Method::Auto => Some(Knowledge::Maps),
        Method::Voxel => Some(Knowledge::Values),
        _ => None,
    }
}

pub(super) fn layout(
    occluders: &Occluders,
    bounds: Bounds,
    resolution: GridResolution,
) -> Result<Layout, BuildError> {
    let resolution = match resolution {
        GridResolution::Automatic => {
            let usual = Layout::automatic_resolution(bounds, occluders.elements().len());
            affordable_resolution(occluders, bounds, usual)
        }
        GridResolution::Fixed(resolution) => resolution,
    };
    // Voxels are numbered in 32 bits. Axes within their range cannot overflow the product.
    let is_fine = resolution.iter().all(|n| (1..=2048).contains(n))
        && resolution.iter().map(|&n| u64::from(n)).product::<u64>() < u64::from(u32::MAX);
    if is_fine {
        Ok(Layout::new(bounds, resolution))
    } else {
        Err(BuildError::BadResolution(resolution))
    }
}
