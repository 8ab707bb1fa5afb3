//! What is known of all points between two, before any of them is asked.
//!
//! In: two points of space, a light. Out: their one answer, or that it is not known. Invariant: where there is one it is
//! the reference's at every point between. Paper 7.2.

use antumbra_geometry::{DVec3, LightId, ReceiverPoint};

use crate::occlusion::Between;
use crate::{Method, QueryError, Shadow, ShadowIndex, method};

impl ShadowIndex {
    /// Returns the one answer of all points of space between two, both ends included, as far as it is known without asking
    /// any: lit, or in shadow. `None` says that points differ, or that nobody knows.
    ///
    /// For who does not know yet which of these points to ask, and would have to work it out: a point that bumps lift off
    /// a surface ("Bumps" in EXACTNESS.md). Points may lie off the straight way by their rounding: each that is computed as
    /// `p + h n` in `f64` with `h` between those of the two ends is meant.
    ///
    /// Costs one look into the voxels around the way ([`Method::Voxel1990`]), or into the light's map or its finest cell
    /// ([`Method::Auto`], [`Method::Voxel`]) and its list. Makes nothing: where values and maps grow as they are asked, free
    /// queries nearby make them. Other methods, values that were all made before, and scenes with surfaces far off the others
    /// know nothing.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{DVec3, LightId, LightShape, Method, Occluders, Opacity, Shadow, ShadowIndex};
    /// // A plate of 4 x 4 at height 3 over a floor, and the sun in the zenith.
    /// let mut surfaces = Occluders::builder();
    /// for (half, z) in [(6.0, 0.0), (2.0, 3.0)] {
    ///     let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
    ///     surfaces.add_face(&corners.map(|(x, y)| DVec3::new(x, y, z)), Opacity::Opaque)?;
    /// }
    /// let sun = LightShape::Direction(DVec3::Z);
    /// let builder = ShadowIndex::builder(Arc::new(surfaces.build()), vec![sun]);
    /// let index = builder.method(Method::Voxel1990).build()?;
    /// // What is right over the floor?
    /// let above = |x: f64| {
    ///     let at = |z| DVec3::new(x, 0.1, z);
    ///     index.known_between(at(0.001), at(0.1), LightId(0))
    /// };
    /// assert_eq!(above(0.0)?, Some(Shadow::Shadowed));
    /// assert_eq!(above(5.0)?, Some(Shadow::Lit));
    /// assert_eq!(above(2.0)?, None);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A point is not finite or beyond 2^100, or the light does not exist.
    pub fn known_between(
        &self,
        from: DVec3,
        to: DVec3,
        light: LightId,
    ) -> Result<Option<Shadow>, QueryError> {
        for point in [from, to] {
            let start = ReceiverPoint {
                point,
                surface: None,
            };
            self.check_query(&start, light)?;
        }
        let light = light.index();
        if !self.parts.is_whole() {
            return Ok(None);
        }
        let between = || Between::new([from, to], self.lights()[light]);
        let is_shadowed = match (self.method(), self.knowledge()) {
            (Method::Voxel1990, _) => {
                let values = &self.values[light];
                method::known_between(self.occluders(), self.grid(), values, &between())
            }
            (_, Some(values)) => values.known_between(self.occluders(), &between(), light),
            _ => None,
        };
        Ok(is_shadowed.map(|is_shadowed| match is_shadowed {
            true => Shadow::Shadowed,
            false => Shadow::Lit,
        }))
    }
}
