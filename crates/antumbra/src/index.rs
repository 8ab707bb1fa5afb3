//! The product's front door: a scene's surfaces and lights, ready for queries.

use std::path::PathBuf;
use std::sync::Arc;

use antumbra_geometry::{DVec3, Hit, LightShape, Occluders, Ray, Start, SurfaceId};

use crate::Counters;
use crate::bvh::Bvh;
use crate::grid::{Grid, Layout};
use crate::kept::{Kept, KeptLight, LoadError};
use crate::occlusion::{AdaptiveValues, DenseValues, Depth, Making, mark, quick_check};
use crate::own_rays::{AnyHit, WithRays};
use crate::shadow::{self, ByVoxel, Rays};

/// How shadow queries are answered. Every method gives the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Voxel occlusion testing as published in 1990.
    Voxel1990,
    /// Values that are exact on meshes, in voxels refined where surfaces are; blocker lists; rays for
    /// the rest.
    #[default]
    Voxel,
    /// A walk through the uniform grid for each query.
    Grid,
    /// A ray through the bounding volume hierarchy for each query.
    Bvh,
    /// Every surface is tested: the reference.
    Naive,
}

/// How rays that ask for the nearest hit find it. Both give the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayMethod {
    /// The bounding volume hierarchy.
    #[default]
    Bvh,
    /// The uniform grid.
    Grid,
}

/// How fine the uniform grid is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridResolution {
    /// Woo's rule, from the number of surfaces.
    #[default]
    Automatic,
    /// Voxels along x, y and z: each 1 to 2048, their product below 2^32 - 1.
    Fixed([u32; 3]),
}

/// How far the values of [`Method::Voxel`] are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refinement {
    /// Finest voxels along the longest axis of the scene, where surfaces are: rounded up to a power
    /// of two, 4 to 4096.
    pub resolution: u32,
    /// The same for points of space near surfaces.
    pub space_resolution: u32,
    /// As few possible blockers are listed instead of finer voxels; 0 lists none.
    pub short_list: usize,
    /// The same for points of space.
    pub space_list: usize,
    /// As few are listed in the finest voxels; 0 lists none.
    pub long_list: usize,
    /// When values are made.
    pub refine: Refine,
    /// Bytes that values and lists may take, for all lights together, 4 GiB at most. Where that is too little,
    /// values that are made while queries are answered are thrown away and made again; answers do not
    /// change. Tables of the surfaces come beside: about 120 bytes each, and 200 for each light.
    pub memory: u64,
}

impl Default for Refinement {
    fn default() -> Self {
        Self {
            resolution: 2048,
            space_resolution: 2048,
            short_list: 1,
            space_list: 8,
            long_list: 32,
            refine: Refine::default(),
            memory: 512 << 20,
        }
    }
}

impl Refinement {
    fn making(self) -> Making {
        Making {
            depth: self.depth(),
            refine: self.refine,
            most_bytes: self.memory,
        }
    }

    fn depth(self) -> Depth {
        let level = |resolution: u32| resolution.clamp(4, 4096).next_power_of_two().ilog2();
        Depth {
            surfaces: level(self.resolution),
            space: level(self.space_resolution),
            short_list: self.short_list,
            space_list: self.space_list,
            early_list: match self.refine {
                Refine::Lazy | Refine::Asked if self.long_list > 0 => EARLY_LIST,
                Refine::Lazy | Refine::Asked | Refine::Eager => 0,
            },
            long_list: self.long_list,
        }
    }
}

/// As few blockers are listed for a voxel until finer ones are made.
const EARLY_LIST: usize = 8;

/// When the values of [`Method::Voxel`] are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Refine {
    /// While queries are answered, where it pays.
    #[default]
    Lazy,
    /// Before the first query, all of them.
    Eager,
    /// For each voxel at the first queries that fall into it, whether it pays or not: for tests and
    /// studies.
    Asked,
}

/// What to do with the quick check of Paper 7.3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QuickCheck {
    /// Do not evaluate it.
    #[default]
    Off,
    /// Evaluate it and say what it advises.
    Report,
    /// Evaluate it and leave voxel occlusion testing out where it advises so.
    Obey,
}

/// What the quick check of Paper 7.3 found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuickCheckVerdict {
    /// Mean share of the grid's voxels that an element occupies, 0..1.
    pub occupied_share: f64,
    /// The share below which the check advises against.
    pub threshold: f64,
    /// Whether the check advises voxel occlusion testing.
    pub is_advised: bool,
}

/// Whether a light reaches a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shadow {
    /// Nothing opaque is between.
    Lit,
    /// Something is.
    Shadowed,
}

/// How a query was decided; for statistics, never part of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decided {
    /// By the value of the start's voxel.
    FirstPass,
    /// By the value of a voxel on the way.
    Intermediate,
    /// By a blocker list.
    BlockerList,
    /// By a full walk.
    Ray,
}

/// The answer to a shadow query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The bit.
    pub shadow: Shadow,
    /// How it was found.
    pub decided: Decided,
}

/// Why an index cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    /// The grid, the tree and the values would need more memory than allowed.
    #[error(
        "grid and occlusion values need about {needed} bytes, more than the limit of {limit}; lower the grid resolution"
    )]
    Memory {
        /// Predicted bytes.
        needed: u64,
        /// Allowed bytes.
        limit: u64,
    },
    /// A file of occlusion values is refused.
    #[error(transparent)]
    Occlusion(#[from] LoadError),
}

/// Why a query has no answer.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum QueryError {
    /// The start's point is NaN, infinite or beyond 2^100.
    #[error("start {0}: coordinates must be finite and at most 2^100 in magnitude")]
    BadPoint(DVec3),
    /// The start names a surface that is not there.
    #[error("surface {0} does not exist")]
    UnknownSurface(u32),
    /// The query names a light that is not there.
    #[error("light {0} does not exist")]
    UnknownLight(usize),
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

    /// Limits the memory of grid, tree and values, in bytes; without it there is no limit.
    #[must_use]
    pub fn memory_limit(mut self, bytes: u64) -> Self {
        self.memory_limit = Some(bytes);
        self
    }

    /// Takes the values of [`Method::Voxel`] that [`ShadowIndex::save`] has written to a file, instead of
    /// making them: those of all lights whose kind and pose are in it, in any order
    /// ([`ShadowIndex::kept_lights`] tells which). The others are made as without a file. The file is only
    /// read, and not needed any more once the index is built; values that are made later go on from it.
    #[must_use]
    pub fn occlusion_file(mut self, path: impl Into<PathBuf>) -> Self {
        self.occlusion_file = Some(path.into());
        self
    }

    /// Builds what the settings need of grid, tree and occlusion values, on all threads of the current rayon
    /// pool.
    ///
    /// # Errors
    /// A light or a setting is out of range, the memory limit is too small, or the file of
    /// [`Builder::occlusion_file`] is refused: it was cut off or damaged, is something else, or is about another
    /// scene or other settings.
    pub fn build(self) -> Result<ShadowIndex, BuildError> {
        // What was asked for must be possible before anything is taken.
        for (index, light) in self.lights.iter().enumerate() {
            check_light(index, light)?;
        }
        if let Some(limit) = self.memory_limit {
            let needed = predict_bytes(
                &self.occluders,
                self.lights.len(),
                self.resolution,
                self.method,
                self.has_tree && needs_bvh(self.method, self.rays),
            )?;
            if needed > limit {
                return Err(BuildError::Memory { needed, limit });
            }
        }
        let layout = layout(&self.occluders, self.resolution)?;
        let grid = self
            .needs_grid()
            .then(|| Grid::build(&self.occluders, layout));

        // Paper 7.3: perhaps the values are not worth it.
        let verdict = match (self.quick_check, &grid) {
            (QuickCheck::Off, _) | (_, None) => None,
            (QuickCheck::Report | QuickCheck::Obey, Some(grid)) => {
                Some(quick_check(&self.occluders, grid))
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
                .map(|light| mark(&self.occluders, grid, light))
                .collect(),
            _ => Vec::new(),
        };
        let (occluders, lights) = (&*self.occluders, &self.lights);
        let adaptive = (method == Method::Voxel).then(|| {
            let mut making = self.refinement.making();
            if !self.has_tree {
                // While there is one.
                making.refine = Refine::Eager;
            }
            AdaptiveValues::new(occluders, lights, &making)
        });
        let kept = match (&self.occlusion_file, &adaptive) {
            (None, _) => None,
            (Some(path), Some(values)) => Some(Kept::open(path, values, occluders)?),
            (Some(path), None) => return Err(LoadError::no_values(path).into()),
        };
        let bvh = if needs_bvh(self.method, self.rays) {
            let tree = kept.as_ref().map(|kept| kept.tree(occluders)).transpose()?;
            let tree = tree.flatten();
            Some(tree.unwrap_or_else(|| Bvh::build(occluders)))
        } else {
            None
        };
        let mut kept_lights = Vec::new();
        if let (Some(values), Some(bvh)) = (&adaptive, &bvh) {
            if let Some(kept) = &kept {
                kept_lights = kept.take(values, occluders, lights)?;
            }
            values.make_first(occluders, bvh);
        }
        let bvh = bvh.filter(|_| self.has_tree);
        Ok(ShadowIndex {
            surface_count: self.occluders.surface_count(),
            occluders: self.occluders,
            lights: self.lights,
            method,
            rays: self.rays,
            layout,
            grid,
            bvh,
            values,
            adaptive,
            kept_lights,
            quick_check: verdict,
        })
    }
}

impl Builder {
    /// Returns whether anything will walk the grid or look at it.
    fn needs_grid(&self) -> bool {
        matches!(self.method, Method::Voxel1990 | Method::Grid)
            || self.rays == RayMethod::Grid
            || self.quick_check != QuickCheck::Off
            || !self.has_tree
            || !needs_bvh(self.method, self.rays)
    }
}

/// The index's own rays to one light.
struct OwnRays<'a> {
    index: &'a ShadowIndex,
    light: usize,
}

impl Rays for OwnRays<'_> {
    #[inline]
    fn is_blocked(&self, start: &Start, counters: &mut Counters) -> bool {
        let light = &self.index.lights[self.light];
        self.index.by_ray(start, light, counters).shadow == Shadow::Shadowed
    }

    fn are_blocked(&self, starts: &[Start], is_blocked: &mut [bool], counters: &mut Counters) {
        self.index.by_rays(starts, self.light, is_blocked, counters);
    }
}

/// 2^100, as for geometry.
pub(crate) const LARGEST: f64 = 1.2676506002282294e30;

fn check_light(index: usize, light: &LightShape) -> Result<(), BuildError> {
    let (x, weight) = light.homogeneous();
    let is_fine =
        x.is_finite() && x.abs().max_element() <= LARGEST && (weight != 0.0 || x != DVec3::ZERO);
    if is_fine {
        Ok(())
    } else {
        Err(BuildError::BadLight { light: index })
    }
}

fn predict_bytes(
    occluders: &Occluders,
    light_count: usize,
    resolution: GridResolution,
    method: Method,
    has_tree: bool,
) -> Result<u64, BuildError> {
    let layout = layout(occluders, resolution)?;
    let grid = Grid::predict_bytes(occluders, &layout);
    let values = match method {
        // While they are marked, values take a byte each, and umbrae some hundred.
        Method::Voxel1990 => {
            DenseValues::bytes_for(layout.voxel_count()) * light_count as u64
                + layout.voxel_count() as u64
                + 600 * occluders.elements().len() as u64
        }
        // The tables of every surface, and values, lists and the octrees that they are packed from: measured
        // on meshes of all kinds, and doubled.
        Method::Voxel => {
            (occluders.surface_count() as u64 + 4096) * (300 + 3000 * light_count as u64)
        }
        Method::Grid | Method::Bvh | Method::Naive => 0,
    };
    let bvh = if has_tree {
        Bvh::predict_bytes(occluders.surface_count())
    } else {
        0
    };
    Ok(grid + values + bvh)
}

/// Returns whether the settings ask for the tree.
fn needs_bvh(method: Method, rays: RayMethod) -> bool {
    matches!(method, Method::Bvh | Method::Voxel) || rays == RayMethod::Bvh
}

fn layout(occluders: &Occluders, resolution: GridResolution) -> Result<Layout, BuildError> {
    let bounds = occluders.bounds();
    let resolution = match resolution {
        GridResolution::Automatic => {
            Layout::automatic_resolution(bounds, occluders.elements().len())
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

/// A static scene's surfaces and lights, ready for nearest-hit and shadow queries.
///
/// All answers are the reference's (EXACTNESS.md in the repository), whatever the method, the grid
/// and the number of threads.
///
/// ```
/// use std::sync::Arc;
/// use antumbra::{Counters, Shadow, ShadowIndex};
/// use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, Sphere, Start, SurfaceId};
///
/// // A ball over a square floor, lit from above.
/// let mut builder = Occluders::builder();
/// let floor = [(-4.0, -4.0), (4.0, -4.0), (4.0, 4.0), (-4.0, 4.0)];
/// builder.add_face(&floor.map(|(x, y)| DVec3::new(x, y, 0.0)), Opacity::Opaque)?;
/// let ball = Sphere { center: DVec3::new(0.0, 0.0, 2.0), radius: 1.0 };
/// builder.add_sphere(ball, Opacity::Opaque)?;
/// let lamp = LightShape::Point(DVec3::new(0.0, 0.0, 9.0));
/// let index = ShadowIndex::builder(Arc::new(builder.build()), vec![lamp]).build()?;
///
/// let mut counters = Counters::default();
/// let mut shadow_at = |x: f64| {
///     let start = Start { point: DVec3::new(x, 0.1, 0.0), surface: Some(SurfaceId(0)) };
///     index.shadow(&start, 0, &mut counters).map(|answer| answer.shadow)
/// };
/// assert_eq!(shadow_at(0.0)?, Shadow::Shadowed);
/// assert_eq!(shadow_at(3.0)?, Shadow::Lit);
/// assert!(shadow_at(f64::NAN).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ShadowIndex {
    occluders: Arc<Occluders>,
    surface_count: usize,
    lights: Vec<LightShape>,
    method: Method,
    rays: RayMethod,
    /// Of the grid, whether it is there or not.
    pub(crate) layout: Layout,
    /// Where the settings ask for it.
    grid: Option<Grid>,
    /// Where the settings ask for it.
    pub(crate) bvh: Option<Bvh>,
    /// One store per light, for the methods that keep values.
    pub(crate) values: Vec<DenseValues>,
    adaptive: Option<AdaptiveValues>,
    kept_lights: Vec<KeptLight>,
    quick_check: Option<QuickCheckVerdict>,
}

impl ShadowIndex {
    /// Starts an index over `occluders` for `lights`; queries name lights by their place here.
    pub fn builder(occluders: Arc<Occluders>, lights: Vec<LightShape>) -> Builder {
        Builder {
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

    /// Returns the same index with a renderer's own rays in place of ours.
    pub fn with_rays<'a, R: AnyHit>(&'a self, rays: &'a R) -> WithRays<'a, R> {
        WithRays { index: self, rays }
    }

    /// Returns the surfaces.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Returns the lights.
    pub fn lights(&self) -> &[LightShape] {
        &self.lights
    }

    /// Returns how shadow queries are answered; not the method asked for where the quick check
    /// advised against that.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Returns the nearest surface along `ray`; transparent ones count. Ties go to the lowest id.
    pub fn nearest(&self, ray: &Ray, counters: &mut Counters) -> Option<Hit> {
        let segment = self.occluders.ray_segment(ray);
        match (self.rays, &self.bvh) {
            (RayMethod::Bvh, Some(bvh)) => bvh.nearest(&self.occluders, &segment, counters),
            _ => self.grid().nearest(&self.occluders, &segment, counters),
        }
    }

    /// Returns on which side of its surface the light is, at the start (EXACTNESS.md, "The side of
    /// the light"): positive on the side of the normal, negative behind, zero in the tangent plane
    /// and for free starts.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn light_side(&self, start: &Start, light: usize) -> Result<i8, QueryError> {
        self.check_query(start, light)?;
        Ok(self.occluders.light_side(start, &self.lights[light]))
    }

    /// Answers a shadow query exactly. Counts under `counters.shadow`.
    ///
    /// The answer does not depend on the method. A start on a surface is expected to lie on it up
    /// to rounding, 2^-40 of the scene's size.
    ///
    /// # Errors
    /// The start is not finite or beyond 2^100, or its surface or the light does not exist.
    pub fn shadow(
        &self,
        start: &Start,
        light: usize,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        self.check_query(start, light)?;
        let occluders = &*self.occluders;
        if let Some(by_voxel) = self.by_voxel(light) {
            let answer = by_voxel.answer_one(start, counters);
            counters.shadow.count(answer);
            return Ok(answer);
        }
        let answer = match self.method {
            Method::Voxel1990 => {
                let segment = occluders.segment(start, &self.lights[light]);
                let values = &self.values[light];
                shadow::by_voxel_1990(occluders, self.grid(), values, &segment, counters)
            }
            Method::Voxel | Method::Bvh => self.by_ray(start, &self.lights[light], counters),
            Method::Grid | Method::Naive => {
                let segment = occluders.segment(start, &self.lights[light]);
                match self.method {
                    Method::Naive => shadow::by_reference(occluders, &segment, counters),
                    _ => shadow::by_grid(occluders, self.grid(), &segment, counters),
                }
            }
        };
        counters.shadow.count(answer);
        Ok(answer)
    }

    /// Answers shadow queries of one light, each as [`ShadowIndex::shadow`] does, and writes whether
    /// the light is blocked. Faster than one by one.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`], for the first query that has no answer; those before may be written.
    ///
    /// # Panics
    /// `is_shadowed` is not as long as `starts`.
    pub fn shadows(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        assert_eq!(starts.len(), is_shadowed.len(), "one answer a start");
        if light >= self.lights.len() {
            return Err(QueryError::UnknownLight(light));
        }
        match self.by_voxel(light) {
            Some(by_voxel) => by_voxel.answer(starts, is_shadowed, counters, |start| {
                self.check_query(start, light)
            }),
            None if self.method == Method::Bvh => {
                starts
                    .iter()
                    .try_for_each(|start| self.check_query(start, light))?;
                self.by_rays(starts, light, is_shadowed, counters);
                let shadowed = is_shadowed.iter().filter(|&&is_shadowed| is_shadowed);
                counters.shadow.shadowed += shadowed.count() as u64;
                counters.shadow.rays += starts.len() as u64;
                Ok(())
            }
            None => {
                for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                    *is_shadowed = self.shadow(start, light, counters)?.shadow == Shadow::Shadowed;
                }
                Ok(())
            }
        }
    }

    fn by_voxel(&self, light: usize) -> Option<ByVoxel<'_, OwnRays<'_>>> {
        self.by_voxel_or(light, OwnRays { index: self, light })
    }

    /// `rays` answer what values and lists do not know.
    pub(crate) fn by_voxel_or<R: Rays>(&self, light: usize, rays: R) -> Option<ByVoxel<'_, R>> {
        self.adaptive.as_ref().map(|values| ByVoxel {
            occluders: &self.occluders,
            bvh: self.bvh.as_ref(),
            values,
            light_number: light,
            rays,
        })
    }

    /// Answers by a ray through the tree, or through the grid where there is no tree.
    #[inline]
    fn by_ray(&self, start: &Start, light: &LightShape, counters: &mut Counters) -> Answer {
        let occluders = &*self.occluders;
        match &self.bvh {
            Some(bvh) => shadow::by_bvh(occluders, bvh, start, light, counters),
            None => {
                let segment = occluders.segment(start, light);
                shadow::by_grid(occluders, self.grid(), &segment, counters)
            }
        }
    }

    /// Answers a query about a light that is none of the index's: without values.
    pub(crate) fn answer_to(
        &self,
        start: &Start,
        light: &LightShape,
        counters: &mut Counters,
    ) -> Answer {
        let occluders = &*self.occluders;
        let answer = match self.method {
            Method::Voxel | Method::Bvh => self.by_ray(start, light, counters),
            Method::Voxel1990 | Method::Grid => {
                let segment = occluders.segment(start, light);
                shadow::by_grid(occluders, self.grid(), &segment, counters)
            }
            Method::Naive => {
                let segment = occluders.segment(start, light);
                shadow::by_reference(occluders, &segment, counters)
            }
        };
        counters.shadow.count(answer);
        answer
    }

    /// Visits every surface that a ray crosses, in any order.
    pub(crate) fn all_crossed(
        &self,
        ray: &Ray,
        counters: &mut Counters,
        mut visit: impl FnMut(Hit),
    ) {
        let segment = self.occluders.ray_segment(ray);
        if let Some(bvh) = &self.bvh {
            return bvh.all(&self.occluders, &segment, counters, visit);
        }
        counters.intersections += self.surface_count as u64;
        for surface in self.occluders.surfaces() {
            if self.occluders.crosses(surface, &segment) {
                visit(self.occluders.hit(surface, &segment));
            }
        }
    }

    /// Answers by rays through the tree, or through the grid where there is no tree.
    fn by_rays(
        &self,
        starts: &[Start],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        let Some(bvh) = &self.bvh else {
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                *is_shadowed =
                    self.by_ray(start, &self.lights[light], counters).shadow == Shadow::Shadowed;
            }
            return;
        };
        let (occluders, light) = (&*self.occluders, &self.lights[light]);
        shadow::many_by_bvh(occluders, bvh, starts, light, is_shadowed, counters);
    }

    /// Answers a shadow query by testing every surface: the reference of EXACTNESS.md.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow_by_reference(&self, start: &Start, light: usize) -> Result<Shadow, QueryError> {
        self.check_query(start, light)?;
        let segment = self.occluders.segment(start, &self.lights[light]);
        Ok(shadow::by_reference(&self.occluders, &segment, &mut Counters::default()).shadow)
    }

    /// Checks that a query has an answer, as [`ShadowIndex::shadow`] does first.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    #[inline]
    pub fn check_query(&self, start: &Start, light: usize) -> Result<(), QueryError> {
        let Start { point, surface } = *start;
        // Not for NaN.
        let is_fine = point.abs().cmple(DVec3::splat(LARGEST)).all()
            && surface.is_none_or(|surface| (surface.0 as usize) < self.surface_count)
            && light < self.lights.len();
        if is_fine {
            Ok(())
        } else {
            Err(self.refusal(start, light))
        }
    }

    #[cold]
    fn refusal(&self, start: &Start, light: usize) -> QueryError {
        let Start { point, surface } = *start;
        if !point.is_finite() || point.abs().max_element() > LARGEST {
            return QueryError::BadPoint(point);
        }
        match surface {
            Some(SurfaceId(surface)) if surface as usize >= self.surface_count => {
                QueryError::UnknownSurface(surface)
            }
            _ => QueryError::UnknownLight(light),
        }
    }

    /// Returns the grid's voxels along x, y and z.
    pub fn grid_resolution(&self) -> [u32; 3] {
        self.layout.resolution
    }

    /// Returns the grid; whatever walks it was among the settings.
    pub(crate) fn grid(&self) -> &Grid {
        self.grid.as_ref().expect("settings that walk it build it")
    }

    /// Stops or resumes making values while queries are answered. Answers do not change.
    ///
    /// Every index makes values unless told otherwise. Without, queries cost a little less where nothing is
    /// known yet, and what is known stays as it is: for measurements.
    pub fn set_refining(&self, is_refining: bool) {
        if let Some(adaptive) = &self.adaptive {
            adaptive.set_refining(is_refining);
        }
    }

    /// Forgets all values of [`Method::Voxel`] that were made while queries were answered, and all tables for
    /// them, as if the index were new.
    pub fn forget_values(&mut self) {
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.forget();
        }
    }

    /// Returns for each light what became of its values in the file of [`Builder::occlusion_file`]; nothing
    /// without a file.
    pub fn kept_lights(&self) -> &[KeptLight] {
        &self.kept_lights
    }

    pub(crate) fn adaptive(&self) -> Option<&AdaptiveValues> {
        self.adaptive.as_ref()
    }

    /// Returns how often the values of [`Method::Voxel`] were thrown away because they took all memory that they
    /// may take.
    pub fn evictions(&self) -> u64 {
        self.adaptive.as_ref().map_or(0, AdaptiveValues::evictions)
    }

    /// Returns the bytes of all occlusion values: two bits per voxel and light.
    pub fn occlusion_bytes(&self) -> u64 {
        let adaptive = self
            .adaptive
            .as_ref()
            .map_or(0, AdaptiveValues::value_bytes);
        adaptive + self.values.iter().map(DenseValues::bytes).sum::<u64>()
    }

    /// Returns the bytes of blocker lists, their planes and the tables that queries read beside values.
    pub fn table_bytes(&self) -> u64 {
        self.adaptive
            .as_ref()
            .map_or(0, AdaptiveValues::table_bytes)
    }

    /// Returns the planes between the finest voxels of [`Method::Voxel`], for tests that aim at them:
    /// the lowest corner, the edge of a voxel, and their number along each axis.
    #[doc(hidden)]
    pub fn voxel_planes(&self) -> Option<(DVec3, f64, [u32; 3])> {
        self.adaptive.as_ref().map(AdaptiveValues::planes)
    }

    /// Returns about how many bytes building the index takes at its height, before any is taken.
    ///
    /// # Errors
    /// The resolution is out of range.
    pub fn predict_bytes(
        occluders: &Occluders,
        light_count: usize,
        resolution: GridResolution,
        method: Method,
        rays: RayMethod,
    ) -> Result<u64, BuildError> {
        let has_tree = needs_bvh(method, rays);
        predict_bytes(occluders, light_count, resolution, method, has_tree)
    }

    /// Returns the resolution that a setting means for a scene.
    ///
    /// # Errors
    /// The resolution is out of range.
    pub fn resolve_grid(
        occluders: &Occluders,
        resolution: GridResolution,
    ) -> Result<[u32; 3], BuildError> {
        Ok(layout(occluders, resolution)?.resolution)
    }

    /// Returns what the quick check found, if it was asked for.
    pub fn quick_check(&self) -> Option<QuickCheckVerdict> {
        self.quick_check
    }
}
