//! One question, one bit: for who wants neither counters nor how an answer was found.

use antumbra_geometry::{LightId, Occluders, ReceiverPoint, SurfaceId};

use super::off_surface::check_surface;
use super::own_rays::{AnyHit, WithRays};
use super::points::Coordinates;
use crate::{Answer, Counters, QueryError, Shadow, ShadowIndex};

impl ShadowIndex {
    /// Returns whether something opaque is between a point on a surface and a light: a shadow ray's answer, without
    /// an offset. `point` is in world space; a triangle or a disk takes it up exactly, wherever rounding to `f32` has left it.
    ///
    /// As [`ShadowIndex::shadow`], which also counts and says how it knew. For many points at once
    /// [`ShadowIndex::occluded`] is several times as fast, and uses all threads.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use antumbra::{LightShape, Occluders, Opacity, ShadowIndex};
    ///
    /// // A small roof over a floor, lit from straight above.
    /// let corners = |size: f64, z: f64| [[-size, -size, z], [size, -size, z], [0.0, size, z]];
    /// let mut surfaces = Occluders::builder();
    /// let floor = surfaces.add_mesh(&corners(9.0, 0.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// surfaces.add_mesh(&corners(1.0, 2.0), &[[0, 1, 2]], Opacity::Opaque)?;
    /// let sun = LightShape::Direction([0.0, 0.0, 1.0].into());
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![sun]).build()?;
    ///
    /// assert!(index.is_occluded([0.0, 0.0, 0.0], floor.start, 0)?);
    /// assert!(!index.is_occluded([3.0, -4.0, 0.0], floor.start, 0)?);
    /// assert!(index.is_occluded_at([0.0, 0.0, 1.0], 0)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The point is not finite or beyond 2^100, its surface or the light does not exist, or the point is farther from its
    /// surface than rounding to `f32` explains.
    pub fn is_occluded(
        &self,
        point: impl Coordinates,
        surface: impl Into<SurfaceId>,
        light: impl Into<LightId>,
    ) -> Result<bool, QueryError> {
        self.is_shadowed(&on_surface(point, surface), light.into())
    }

    /// Returns whether something opaque is between a point of space and a light. A surface that holds the point exactly
    /// does not block; one that the point lies a rounding behind does. For points on surfaces ask
    /// [`ShadowIndex::is_occluded`].
    ///
    /// # Errors
    /// The point is not finite or beyond 2^100, or the light does not exist.
    pub fn is_occluded_at(
        &self,
        point: impl Coordinates,
        light: impl Into<LightId>,
    ) -> Result<bool, QueryError> {
        self.is_shadowed(&in_space(point), light.into())
    }

    #[inline]
    fn is_shadowed(&self, start: &ReceiverPoint, light: LightId) -> Result<bool, QueryError> {
        let answer = self.shadow(start, light, &mut Counters::default());
        bit(answer, self.occluders(), start)
    }
}

impl<R: AnyHit> WithRays<'_, R> {
    /// Answers as [`ShadowIndex::is_occluded`], by what is known, else by the rays.
    ///
    /// # Errors
    /// As [`ShadowIndex::is_occluded`].
    pub fn is_occluded(
        &self,
        point: impl Coordinates,
        surface: impl Into<SurfaceId>,
        light: impl Into<LightId>,
    ) -> Result<bool, QueryError> {
        self.is_shadowed(&on_surface(point, surface), light.into())
    }

    /// Answers as [`ShadowIndex::is_occluded_at`], by what is known, else by the rays.
    ///
    /// # Errors
    /// As [`ShadowIndex::is_occluded_at`].
    pub fn is_occluded_at(
        &self,
        point: impl Coordinates,
        light: impl Into<LightId>,
    ) -> Result<bool, QueryError> {
        self.is_shadowed(&in_space(point), light.into())
    }

    #[inline]
    fn is_shadowed(&self, start: &ReceiverPoint, light: LightId) -> Result<bool, QueryError> {
        let answer = self.shadow(start, light, &mut Counters::default());
        bit(answer, self.index.occluders(), start)
    }
}

/// Returns the bit of an answer, unless the point is not on its surface.
#[inline]
fn bit(
    answer: Result<Answer, QueryError>,
    occluders: &Occluders,
    start: &ReceiverPoint,
) -> Result<bool, QueryError> {
    let answer = answer?;
    check_surface(occluders, start)?;
    Ok(answer.shadow == Shadow::Shadowed)
}

pub(super) fn on_surface(point: impl Coordinates, surface: impl Into<SurfaceId>) -> ReceiverPoint {
    ReceiverPoint {
        point: point.as_f64(),
        surface: Some(surface.into()),
    }
}

pub(super) fn in_space(point: impl Coordinates) -> ReceiverPoint {
    ReceiverPoint {
        point: point.as_f64(),
        surface: None,
    }
}
