//! The product's front door: a scene's surfaces and lights, ready for queries.

use std::sync::{Arc, OnceLock};

use antumbra_geometry::{
    DVec3, Hit, LightId, LightShape, Occluders, Ray, ReceiverPoint, Segment, SurfaceId,
};

use crate::accel::bvh::{Bvh, Tree};
use crate::accel::grid::nearest_of;
use crate::accel::grid::{Grid, Layout};
use crate::accel::parts::Parts;
use crate::file::SavedLight;
use crate::limits::LARGEST;
use crate::method::{self, ByVoxel, Rays};
use crate::occlusion::{AdaptiveValues, AllLights, DenseValues, WholeLights};
use crate::{
    Answer, Counters, Decided, Method, QueryError, QuickCheckVerdict, RayMethod, Refinement, Shadow,
};

/// The index's own rays to one light.
struct OwnRays<'a> {
    index: &'a ShadowIndex,
    light: usize,
}

impl Rays for OwnRays<'_> {
    #[inline]
    fn is_blocked(&self, start: &ReceiverPoint, counters: &mut Counters) -> bool {
        let light = &self.index.lights[self.light];
        self.index.by_ray(start, light, counters).shadow == Shadow::Shadowed
    }

    fn are_blocked(
        &self,
        starts: &[ReceiverPoint],
        is_blocked: &mut [bool],
        counters: &mut Counters,
    ) {
        self.index.by_rays(starts, self.light, is_blocked, counters);
    }
}

/// A static scene's surfaces and lights, ready for nearest-hit and shadow queries.
///
/// All answers are the reference's (EXACTNESS.md in the repository), whatever the method, the grid
/// and the number of threads.
///
/// ```
/// use std::sync::Arc;
/// use antumbra::{
///     Counters, DVec3, LightId, LightShape, Occluders, Opacity, Shadow, ShadowIndex, Sphere, ReceiverPoint, SurfaceId,
/// };
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
///     let start = ReceiverPoint { point: DVec3::new(x, 0.1, 0.0), surface: Some(SurfaceId(0)) };
///     index.shadow(&start, LightId(0), &mut counters).map(|answer| answer.shadow)
/// };
/// assert_eq!(shadow_at(0.0)?, Shadow::Shadowed);
/// assert_eq!(shadow_at(3.0)?, Shadow::Lit);
/// assert!(shadow_at(f64::NAN).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ShadowIndex {
    pub(super) occluders: Arc<Occluders>,
    /// Grid, tree and values are over the near ones.
    pub(crate) parts: Parts,
    pub(super) surface_count: usize,
    pub(super) lights: Vec<LightShape>,
    pub(super) method: Method,
    pub(super) rays: RayMethod,
    /// Of the grid, whether it is there or not.
    pub(crate) layout: Layout,
    /// Where the settings ask for it.
    pub(super) grid: Option<Grid>,
    /// Where the settings ask for it.
    pub(super) tree: Option<Tree>,
    /// One store per light, for the methods that keep values.
    pub(crate) values: Vec<DenseValues>,
    pub(super) adaptive: Option<AdaptiveValues>,
    pub(super) saved_lights: Vec<SavedLight>,
    /// What answers all lights of a point at once, once it was asked.
    pub(super) all_lights: OnceLock<Box<AllLights>>,
    /// Values of lights with size, once one was asked about.
    pub(super) whole_lights: OnceLock<Box<WholeLights>>,
    /// Whether there are surfaces that color light.
    pub(super) has_filters: bool,
    /// Settings of what lights know of these.
    pub(super) glass_refinement: Refinement,
    /// Those surfaces alone, once one was asked about.
    pub(super) glass: OnceLock<Box<Self>>,
    pub(super) quick_check: Option<QuickCheckVerdict>,
    /// Whether there was a file of values.
    pub(crate) has_file: bool,
    /// Of grid, tree and values, in bytes.
    pub(super) memory_limit: Option<u64>,
}

impl ShadowIndex {
    /// Returns the surfaces.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Returns the tree, where the settings ask for it.
    #[inline(always)]
    pub(crate) fn bvh(&self) -> Option<&Bvh> {
        self.tree.as_ref().map(|tree| tree.get(&self.parts.near))
    }

    /// Returns the tree, where it is built already.
    pub(crate) fn built_bvh(&self) -> Option<&Bvh> {
        self.tree.as_ref().and_then(Tree::get_built)
    }

    /// Returns what answers all lights of a point at once.
    pub(crate) fn all_lights(&self) -> &AllLights {
        self.all_lights.get_or_init(|| {
            // Far surfaces are asked after the near ones, which alone have values.
            let has_rows = self.parts.is_whole() && self.tree.is_some();
            let knowledge = self.adaptive.as_ref().filter(|_| has_rows);
            let all = AllLights::new(&self.parts.near, &self.lights, knowledge);
            Box::new(all)
        })
    }

    /// Returns what is known of lights with size; `None` for methods that know nothing.
    pub(crate) fn whole_lights(&self) -> Option<&WholeLights> {
        // Far surfaces are asked after the near ones, which alone have values.
        let has_values = self.parts.is_whole() && self.tree.is_some();
        let knowledge = self.adaptive.as_ref().filter(|_| has_values)?;
        let made = self.whole_lights.get_or_init(|| {
            let made = WholeLights::new(&self.parts.near, knowledge);
            Box::new(made)
        });
        Some(made)
    }

    /// Returns what is known of lights with size, if one was asked about before.
    pub(crate) fn asked_whole_lights(&self) -> Option<&WholeLights> {
        self.whole_lights.get().map(|whole| &**whole)
    }

    /// Returns what answers all lights at once, if that was asked before.
    pub(crate) fn asked_lights(&self) -> Option<&AllLights> {
        self.all_lights.get().map(|all| &**all)
    }

    /// Returns whether there is a grid.
    pub(crate) fn has_grid(&self) -> bool {
        self.grid.is_some()
    }

    /// Returns the lights. The place of each is its [`LightId`].
    pub fn lights(&self) -> &[LightShape] {
        &self.lights
    }

    /// Returns the names of all lights, in their order.
    pub fn light_ids(&self) -> impl ExactSizeIterator<Item = LightId> + use<> {
        // Whoever adds a light sees to it that its number fits.
        (0..self.lights.len() as u32).map(LightId)
    }

    /// Returns how shadow queries are answered; not the method asked for where the quick check
    /// advised against that.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Returns the nearest surface along `ray`; transparent ones count. Ties go to the lowest id.
    pub fn nearest(&self, ray: &Ray, counters: &mut Counters) -> Option<Hit> {
        let segment = self.occluders.ray_segment(ray);
        let near = self.nearest_near(&segment, counters);
        let found = self
            .parts
            .nearest(&self.occluders, &segment, near, counters);
        nearest_of(&self.occluders, self.own_parts(ray), &segment, found)
    }

    /// Returns what the own rule of the surface that a ray leaves decides: no walk finds it from points far off.
    fn own_parts(&self, ray: &Ray) -> impl Iterator<Item = SurfaceId> {
        let own = ray.leaves.into_iter();
        own.flat_map(|own| self.occluders.own_parts(own))
    }

    fn nearest_near(&self, segment: &Segment, counters: &mut Counters) -> Option<Hit> {
        let tree = match self.rays {
            RayMethod::Bvh => self.bvh(),
            // It may have to be built yet.
            RayMethod::Grid => None,
        };
        match tree {
            Some(bvh) => bvh.nearest(&self.parts.near, segment, counters),
            None => self.grid().nearest(&self.parts.near, segment, counters),
        }
    }

    /// Returns on which side of its surface the light is, at a receiver point (EXACTNESS.md, "The side of
    /// the light"): positive on the side of the normal, negative behind, zero in the tangent plane
    /// and for points of space.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn light_side(&self, start: &ReceiverPoint, light: LightId) -> Result<i8, QueryError> {
        self.check_query(start, light)?;
        Ok(self
            .occluders
            .light_side(start, &self.lights[light.index()]))
    }

    /// Answers a shadow query exactly. Counts under `counters.shadow`.
    ///
    /// The answer does not depend on the method, however far a point lies from the surface that it names:
    /// EXACTNESS.md defines it for all.
    ///
    /// # Errors
    /// The receiver point is not finite or beyond 2^100, or its surface or the light does not exist.
    pub fn shadow(
        &self,
        start: &ReceiverPoint,
        light: LightId,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        self.check_query(start, light)?;
        let light = light.index();
        let answer = self.near_answer(start, light, counters);
        let answer = self.with_far(answer, start, &self.lights[light], counters);
        counters.shadow.count(answer);
        Ok(answer)
    }

    /// Answers as far as the near surfaces go.
    #[inline]
    fn near_answer(&self, start: &ReceiverPoint, light: usize, counters: &mut Counters) -> Answer {
        let occluders = &*self.parts.near;
        if self.parts.is_far(start) && self.method != Method::Naive {
            return self.by_ray(start, &self.lights[light], counters);
        }
        if let Some(by_voxel) = self.by_voxel(light) {
            return by_voxel.answer_one(start, counters);
        }
        match self.method {
            Method::Voxel1990 => {
                let segment = occluders.segment(start, &self.lights[light]);
                let values = &self.values[light];
                method::by_voxel_1990(occluders, self.grid(), values, &segment, counters)
            }
            Method::Auto | Method::Voxel | Method::Bvh => {
                self.by_ray(start, &self.lights[light], counters)
            }
            Method::Grid | Method::Naive => {
                let segment = occluders.segment(start, &self.lights[light]);
                match self.method {
                    Method::Naive => method::by_reference(&self.occluders, &segment, counters),
                    _ => method::by_grid(occluders, self.grid(), &segment, counters),
                }
            }
        }
    }

    /// Returns what becomes of an answer about the near surfaces by the far ones.
    #[inline]
    pub(crate) fn with_far(
        &self,
        near: Answer,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> Answer {
        let is_blocked = near.shadow == Shadow::Lit
            && self.method != Method::Naive
            && self
                .parts
                .far_blocks(&self.occluders, start, light, counters);
        if is_blocked {
            Answer::new(true, Decided::Ray)
        } else {
            near
        }
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
        starts: &[ReceiverPoint],
        light: LightId,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) -> Result<(), QueryError> {
        assert_eq!(starts.len(), is_shadowed.len(), "one answer a start");
        let number = light.index();
        if number >= self.lights.len() {
            return Err(QueryError::UnknownLight(light));
        }
        if starts.iter().any(|start| self.parts.is_far(start)) {
            // Few, as a rule: one by one.
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                *is_shadowed = self.shadow(start, light, counters)?.shadow == Shadow::Shadowed;
            }
            return Ok(());
        }
        match self.by_voxel(number) {
            Some(by_voxel) => by_voxel.answer(starts, is_shadowed, counters, |start| {
                self.check_query(start, light)
            })?,
            None if self.method == Method::Bvh => {
                starts
                    .iter()
                    .try_for_each(|start| self.check_query(start, light))?;
                self.by_rays(starts, number, is_shadowed, counters);
                let shadowed = is_shadowed.iter().filter(|&&is_shadowed| is_shadowed);
                counters.shadow.shadowed += shadowed.count() as u64;
                counters.shadow.rays += starts.len() as u64;
            }
            None => {
                // A walk through the grid may take a millisecond.
                const LOOK: usize = 16;
                for (number, (start, is_shadowed)) in starts.iter().zip(is_shadowed).enumerate() {
                    if number.is_multiple_of(LOOK) {
                        antumbra_task::check();
                    }
                    *is_shadowed = self.shadow(start, light, counters)?.shadow == Shadow::Shadowed;
                }
                return Ok(());
            }
        }
        let (all, light) = (&*self.occluders, &self.lights[number]);
        let blocked = self
            .parts
            .mark_blocked(all, starts, light, is_shadowed, counters);
        counters.shadow.shadowed += blocked;
        Ok(())
    }

    fn by_voxel(&self, light: usize) -> Option<ByVoxel<'_, OwnRays<'_>>> {
        self.by_voxel_or(light, OwnRays { index: self, light })
    }

    /// `rays` answer what values and lists do not know.
    pub(crate) fn by_voxel_or<R: Rays>(&self, light: usize, rays: R) -> Option<ByVoxel<'_, R>> {
        self.adaptive.as_ref().map(|values| ByVoxel {
            occluders: &self.parts.near,
            // What is all there needs none, and it may have to be built yet.
            bvh: values.packed(light).map_or_else(|| self.bvh(), |_| None),
            values,
            light_number: light,
            rays,
        })
    }

    /// Answers by a ray through the tree, or through the grid where there is no tree, as far as the near surfaces
    /// go.
    #[inline]
    fn by_ray(&self, start: &ReceiverPoint, light: &LightShape, counters: &mut Counters) -> Answer {
        let occluders = &*self.parts.near;
        match self.bvh() {
            Some(bvh) => method::by_bvh(occluders, bvh, start, light, counters),
            None => {
                let segment = occluders.segment(start, light);
                method::by_grid(occluders, self.grid(), &segment, counters)
            }
        }
    }

    /// Answers a query about a light that is none of the index's: without values.
    pub(crate) fn answer_to(
        &self,
        start: &ReceiverPoint,
        light: &LightShape,
        counters: &mut Counters,
    ) -> Answer {
        let occluders = &*self.parts.near;
        let answer = match self.method {
            Method::Auto | Method::Voxel | Method::Bvh => self.by_ray(start, light, counters),
            Method::Voxel1990 | Method::Grid if self.parts.is_far(start) => {
                self.by_ray(start, light, counters)
            }
            Method::Voxel1990 | Method::Grid => {
                let segment = occluders.segment(start, light);
                method::by_grid(occluders, self.grid(), &segment, counters)
            }
            Method::Naive => {
                let segment = occluders.segment(start, light);
                method::by_reference(&self.occluders, &segment, counters)
            }
        };
        let answer = self.with_far(answer, start, light, counters);
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
        let is_own = |surface: SurfaceId| {
            let own = ray.leaves;
            own.is_some_and(|own| self.occluders.have_one_own_rule(own, surface))
        };
        let mut visit_other = |hit: Hit| {
            if !is_own(hit.surface) {
                visit(hit);
            }
        };
        match self.bvh() {
            Some(bvh) => {
                bvh.all(&self.parts.near, &segment, counters, &mut visit_other);
                let all = &self.occluders;
                self.parts.all(all, &segment, counters, &mut visit_other);
            }
            None => {
                counters.intersections += self.surface_count as u64;
                let crossed = |surface: &SurfaceId| self.occluders.crosses(*surface, &segment);
                for surface in self.occluders.surfaces().filter(crossed) {
                    visit_other(self.occluders.hit(surface, &segment));
                }
            }
        }
        // By the own rule all parts are crossed, or none: the solid is left through the nearest.
        if let Some(exit) = nearest_of(&self.occluders, self.own_parts(ray), &segment, None) {
            visit(exit);
        }
    }

    /// Answers as [`ShadowIndex::by_ray`] does.
    fn by_rays(
        &self,
        starts: &[ReceiverPoint],
        light: usize,
        is_shadowed: &mut [bool],
        counters: &mut Counters,
    ) {
        let Some(bvh) = self.bvh() else {
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                *is_shadowed =
                    self.by_ray(start, &self.lights[light], counters).shadow == Shadow::Shadowed;
            }
            return;
        };
        let (occluders, light) = (&*self.parts.near, &self.lights[light]);
        method::many_by_bvh(occluders, bvh, starts, light, is_shadowed, counters);
    }

    /// Answers a shadow query by testing every surface: the reference of EXACTNESS.md.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow_by_reference(
        &self,
        start: &ReceiverPoint,
        light: LightId,
    ) -> Result<Shadow, QueryError> {
        self.check_query(start, light)?;
        let segment = self.occluders.segment(start, &self.lights[light.index()]);
        Ok(method::by_reference(&self.occluders, &segment, &mut Counters::default()).shadow)
    }

    /// Checks that a query has an answer, as [`ShadowIndex::shadow`] does first.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    #[inline]
    pub fn check_query(&self, start: &ReceiverPoint, light: LightId) -> Result<(), QueryError> {
        let ReceiverPoint { point, surface } = *start;
        // Not for NaN.
        let is_fine = point.abs().cmple(DVec3::splat(LARGEST)).all()
            && surface.is_none_or(|surface| (surface.0 as usize) < self.surface_count)
            && light.index() < self.lights.len();
        if is_fine {
            Ok(())
        } else {
            Err(self.refusal(start, light))
        }
    }

    /// Checks a start as [`ShadowIndex::check_query`] does.
    pub(crate) fn check_start(&self, start: &ReceiverPoint) -> Result<(), QueryError> {
        let ReceiverPoint { point, surface } = *start;
        // Not for NaN.
        let is_fine = point.abs().cmple(DVec3::splat(LARGEST)).all()
            && surface.is_none_or(|surface| (surface.0 as usize) < self.surface_count);
        if is_fine {
            Ok(())
        } else {
            Err(self.refusal(start, LightId(0)))
        }
    }

    #[cold]
    fn refusal(&self, start: &ReceiverPoint, light: LightId) -> QueryError {
        let ReceiverPoint { point, surface } = *start;
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

    /// Returns for each light what became of its values in the file of [`Builder::occlusion_file`](crate::Builder::occlusion_file); nothing
    /// without a file.
    pub fn saved_lights(&self) -> &[SavedLight] {
        &self.saved_lights
    }

    /// Returns what lights know, maps or values.
    pub(crate) fn knowledge(&self) -> Option<&AdaptiveValues> {
        self.adaptive.as_ref()
    }

    /// Returns the values of [`Method::Voxel`].
    pub(crate) fn adaptive(&self) -> Option<&AdaptiveValues> {
        self.adaptive.as_ref().filter(|values| !values.has_maps())
    }

    /// Returns the planes between the finest voxels of [`Method::Voxel`], for tests that aim at them:
    /// the lowest corner, the edge of a voxel, and their number along each axis.
    #[doc(hidden)]
    pub fn voxel_planes(&self) -> Option<(DVec3, f64, [u32; 3])> {
        self.adaptive.as_ref().map(AdaptiveValues::planes)
    }

    /// Returns what the quick check found, if it was asked for.
    pub fn quick_check(&self) -> Option<QuickCheckVerdict> {
        self.quick_check
    }
}
