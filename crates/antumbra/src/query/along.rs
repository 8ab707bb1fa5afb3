//! Which points of a segment a light reaches: exact intervals, one walk for each segment.
//!
//! In: segments of points in space, a light without size. Out: lit intervals, as shares of each segment's length.
//! Invariants: which surfaces are shown to [`SegmentShadows`] is a superset of those that matter, and it decides exactly, so
//! the answer is a function of segment, light and surfaces alone (EXACTNESS.md, "Lit intervals along a segment"). Absent
//! here: what a surface shades, which geometry knows. Paper 9.4.

use std::ops::ControlFlow;

use antumbra_geometry::{
    DVec3, KnownStretch, LightShape, ReceiverPoint, SegmentShadows, Short, SurfaceId,
};

use crate::accel::bvh::{Bvh, Region, Visitor, WEDGES};
use crate::accel::frame::Frame;
use crate::limits::is_fine;
use crate::query::lists::lists;
use crate::{Coordinates, Counters, Method, ShadowIndex, method};

/// Boxes of the tree reach at most so far from the middle of its frame, in its units.
const REACH: f64 = 2.0;

/// No point within [`REACH`] is above a height that is less than this below the middle.
const LOWEST: f64 = -8.0;

/// Stretches of segments that a light reaches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LitIntervals {
    /// Begin and end of each, as shares of the length from the segment's origin, 0 to 1. Segment after segment, those of
    /// one in order.
    pub intervals: Vec<[f64; 2]>,
    /// End of the intervals of each segment in `intervals`.
    pub ends: Vec<usize>,
}

impl LitIntervals {
    /// Returns the lit intervals of a segment, named by its place in the batch.
    ///
    /// # Panics
    /// There is no such segment.
    pub fn of(&self, segment: usize) -> &[[f64; 2]] {
        let begin = segment.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.intervals[begin..self.ends[segment]]
    }
}

/// Why segments have no lit intervals. Where several are at fault the first is named.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LitIntervalsError {
    /// An end of a segment is NaN, infinite or beyond 2^100.
    #[error("{what} {segment} is {}: coordinates must be finite and at most 2^100 in magnitude", Short(*found))]
    BadEnd {
        /// Name of the end: `"origin"` or `"end"`.
        what: &'static str,
        /// Place of the segment in the batch.
        segment: usize,
        /// Number that was given.
        found: DVec3,
    },
    /// The light is NaN, infinite or beyond 2^100, or a direction of no length.
    #[error("light {}: coordinates must be finite and at most 2^100 in magnitude, and a direction not zero", Short(*.0))]
    BadLight(DVec3),
    /// There are more origins than ends, or fewer.
    #[error("ends of segments: expected {expected}, found {found}")]
    Length {
        /// Number of origins.
        expected: usize,
        /// Number of ends.
        found: usize,
    },
    /// An alpha-tested triangle that may shade some of a segment has no closed form.
    #[error(
        "segment {segment}: surface {} may shade some of it and is alpha-tested; its shadow has no closed form here",
        surface.0
    )]
    NoClosedForm {
        /// Place of the segment in the batch.
        segment: usize,
        /// Surface with the lowest number that is in the way.
        surface: SurfaceId,
    },
}

impl ShadowIndex {
    /// Returns the lit intervals of a segment from an origin to an end: where a light reaches points of space on it, as
    /// shares of its length from the origin, in order. Shafts of light in fog are where view rays are lit.
    ///
    /// Exact is how many there are and between which shadows; each end is the `f64` nearest to the exact crossing
    /// (EXACTNESS.md, "Lit intervals along a segment"). Points are asked as points of space, those at both ends, too. The
    /// light need not be one of the index's. A segment without length is lit as a whole, or not at all.
    ///
    /// Costs one walk of the tree, and about 0.15 microseconds for each triangle near the plane through segment and light,
    /// some microseconds for each sphere, disk or cone;
    /// [`Method::Grid`] and [`Method::Naive`] test every surface, and so does [`Method::Voxel1990`] where the values of the voxels
    /// that the segment crosses leave any of it open. Makes no values.
    /// [`ShadowIndex::lit_intervals`] asks the reverse: what part of a linear light one point sees.
    ///
    /// ```
    /// # use std::sync::Arc;
    /// # use antumbra::{DVec3, LightShape, Occluders, Opacity, ShadowIndex};
    /// // A plate of 2 x 2 at height 1, and the sun in the zenith.
    /// let mut surfaces = Occluders::builder();
    /// let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    /// surfaces.add_face(&corners.map(|(x, y)| DVec3::new(x, y, 1.0)), Opacity::Opaque)?;
    /// let index = ShadowIndex::builder(Arc::new(surfaces.build()), Vec::new()).build()?;
    /// let sun = LightShape::Direction(DVec3::Z);
    /// let (origin, end) = (DVec3::new(-4.0, 0.0, 0.0), DVec3::new(4.0, 0.0, 0.0));
    /// assert_eq!(index.lit_intervals_along(origin, end, &sun)?, [[0.0, 0.375], [0.625, 1.0]]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A number is not finite or beyond 2^100, the light's direction is zero, or an alpha-tested surface may shade some of
    /// the segment.
    pub fn lit_intervals_along(
        &self,
        origin: DVec3,
        end: DVec3,
        light: &LightShape,
    ) -> Result<Vec<[f64; 2]>, LitIntervalsError> {
        check_light(light)?;
        let mut intervals = Vec::new();
        let mut counters = Counters::default();
        self.add_lit_intervals(0, [origin, end], light, &mut intervals, &mut counters)?;
        Ok(intervals)
    }

    /// Returns the lit intervals of many segments, each as [`ShadowIndex::lit_intervals_along`] has them; `origins` and
    /// `ends` have an item for each, world space.
    ///
    /// Runs on all threads of the current rayon pool. Answers and errors do not depend on them.
    ///
    /// # Errors
    /// As [`ShadowIndex::lit_intervals_along`], or lengths differ; the first segment at fault is named.
    pub fn lit_intervals_of_segments<P: Coordinates>(
        &self,
        origins: &[P],
        ends: &[P],
        light: &LightShape,
    ) -> Result<LitIntervals, LitIntervalsError> {
        check_light(light)?;
        let count = origins.len();
        if ends.len() != count {
            return Err(LitIntervalsError::Length {
                expected: count,
                found: ends.len(),
            });
        }
        let (intervals, ends) = lists(count, |segment, intervals| {
            let points = [origins[segment].as_f64(), ends[segment].as_f64()];
            self.add_lit_intervals(segment, points, light, intervals, &mut Counters::default())
        })?;
        Ok(LitIntervals { intervals, ends })
    }

    fn add_lit_intervals(
        &self,
        segment: usize,
        points: [DVec3; 2],
        light: &LightShape,
        intervals: &mut Vec<[f64; 2]>,
        counters: &mut Counters,
    ) -> Result<(), LitIntervalsError> {
        for (what, found) in ["origin", "end"].into_iter().zip(points) {
            if !is_fine(found) {
                return Err(LitIntervalsError::BadEnd {
                    what,
                    segment,
                    found,
                });
            }
        }
        let shadows = self.shadows_along(points, light, counters);
        let finished = shadows.finish(intervals);
        finished.map_err(|surface| LitIntervalsError::NoClosedForm { segment, surface })
    }

    /// Returns a segment with the shadows of all surfaces that may shade some of it.
    fn shadows_along(
        &self,
        points: [DVec3; 2],
        light: &LightShape,
        counters: &mut Counters,
    ) -> SegmentShadows<'_> {
        let occluders = self.occluders();
        let tree = match self.method() {
            Method::Auto | Method::Voxel | Method::Bvh => self.bvh(),
            Method::Voxel1990 | Method::Grid | Method::Naive => None,
        };
        let mut shadows = SegmentShadows::new(occluders, points, light);
        if let Some(known) = self.known_along(points, light, counters) {
            shadows = shadows.knowing(known);
        }
        let mut shown = Shown {
            shadows,
            // Something without a closed form is to be named even where all that it may shade is dark.
            frame: tree
                .filter(|_| occluders.triangle_count() == occluders.surface_count())
                .map(Bvh::frame),
            version: 0,
            counters,
        };
        let region = tree.and_then(|tree| region_of(tree, &shown.shadows));
        let walked = match (tree, region) {
            (Some(tree), Some(mut region)) => {
                tree.visit_wedge(&mut region, &mut Vec::new(), &mut shown)
            }
            (Some(_), None) => ControlFlow::Continue(()),
            (None, _) => {
                let mut surfaces = self.parts.near.present_surfaces();
                match shown.shadows.is_all_known() {
                    true => ControlFlow::Continue(()),
                    false => surfaces.try_for_each(|surface| shown.visit(surface)),
                }
            }
        };
        if walked.is_continue() {
            // Broken off where nothing is left to shade.
            let mut surfaces = self.parts.far_surfaces();
            let _ = surfaces.try_for_each(|surface| shown.visit(surface));
        }
        shown.shadows
    }

    /// Returns what values of voxels know of a segment, if there are any that speak of all surfaces.
    fn known_along(
        &self,
        [origin, end]: [DVec3; 2],
        light: &LightShape,
        counters: &mut Counters,
    ) -> Option<Vec<KnownStretch>> {
        let has_values = self.method() == Method::Voxel1990;
        let speaks_of_all = || {
            let occluders = self.occluders();
            self.parts.is_whole() && occluders.are_whole() && occluders.first_freeform().is_none()
        };
        if !has_values || origin == end || !speaks_of_all() {
            return None;
        }
        let light = self.lights().iter().position(|own| own == light)?;
        let start = ReceiverPoint {
            point: origin,
            surface: None,
        };
        let segment = self.occluders().segment(&start, &LightShape::Point(end));
        let (known, voxels) = method::known_along(self.grid(), &self.values[light], &segment);
        counters.steps += voxels;
        Some(known)
    }
}

/// A segment that surfaces are shown to.
struct Shown<'a, 'b> {
    shadows: SegmentShadows<'a>,
    /// Frame of the tree, if what is dark may be left out of it.
    frame: Option<&'a Frame>,
    version: u32,
    counters: &'b mut Counters,
}

impl Visitor for Shown<'_, '_> {
    fn visit(&mut self, surface: SurfaceId) -> ControlFlow<()> {
        self.counters.intersections += 1;
        self.shadows.meet(surface);
        if self.shadows.is_all_dark() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn narrow(&mut self, region: &mut Region) {
        self.counters.steps += 1;
        let (Some(frame), version) = (self.frame, self.shadows.dark_version()) else {
            return;
        };
        if self.version == version {
            return;
        }
        self.version = version;
        let pairs = self
            .shadows
            .dark_sides_over::<WEDGES>(frame.center, REACH / frame.scale);
        let in_frame = |(normal, height): (DVec3, f64)| (normal, height * frame.scale);
        region.leave_out(pairs.map(|pair| pair.map(|side| side.map(in_frame))));
    }
}

/// Returns the part of a tree's frame in which surfaces matter; `None` if that is none.
fn region_of(tree: &Bvh, shadows: &SegmentShadows<'_>) -> Option<Region> {
    let frame = tree.frame();
    let heights = shadows.heights_over(frame.center, REACH / frame.scale);
    let heights = heights.map(|(normal, height)| (normal, height * frame.scale));
    if heights.clone().any(|(_, height)| height < LOWEST) {
        return None;
    }
    Some(Region::of_heights(heights))
}

fn check_light(light: &LightShape) -> Result<(), LitIntervalsError> {
    let (place, _) = light.homogeneous();
    if is_fine(place) && *light != LightShape::Direction(DVec3::ZERO) {
        Ok(())
    } else {
        Err(LitIntervalsError::BadLight(place))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use antumbra_geometry::{Occluders, Opacity};

    use super::*;

    /// A plate of 4 x 4 at height 3 over a floor of 12 x 12, and a lamp far above.
    fn index(method: Method) -> ShadowIndex {
        let mut surfaces = Occluders::builder();
        for (half, z) in [(6.0, 0.0), (2.0, 3.0)] {
            let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
            let corners = corners.map(|(x, y)| DVec3::new(x, y, z));
            surfaces.add_face(&corners, Opacity::Opaque).unwrap();
        }
        let lamp = LightShape::Point(DVec3::new(0.5, 0.25, 40.0));
        ShadowIndex::builder(Arc::new(surfaces.build()), vec![lamp])
            .method(method)
            .build()
            .unwrap()
    }

    #[test]
    fn values_of_1990_answer_whole_segments_and_parts_of_others() {
        let [by_values, by_tree] = [Method::Voxel1990, Method::Bvh].map(index);
        let light = by_values.lights()[0];
        let at = DVec3::new;
        // Each: a segment, and whether values know all of it.
        let cases = [
            ([at(-1.0, -1.0, 1.0), at(1.2, 0.9, 1.7)], true),
            ([at(-5.0, -5.0, 1.0), at(-5.0, 5.0, 1.7)], true),
            ([at(-5.0, 0.1, 1.0), at(5.0, 0.3, 1.5)], false),
            ([at(0.0, 0.0, -9.0), at(0.3, 0.4, 99.0)], false),
            ([at(-3.0, 0.1, 1.0), at(1.0, 0.3, 1.5)], false),
            ([at(1.0, 1.0, 1.0); 2], false),
        ];
        for (ends, is_known) in cases {
            let ask = |index: &ShadowIndex| {
                let (mut intervals, mut counters) = (Vec::new(), Counters::default());
                let asked = index.add_lit_intervals(0, ends, &light, &mut intervals, &mut counters);
                asked.map(|()| (intervals, counters.intersections)).unwrap()
            };
            let (intervals, tested) = ask(&by_values);
            assert_eq!(intervals, ask(&by_tree).0, "{ends:?}");
            assert_eq!(tested == 0, is_known, "{ends:?}");
        }
    }
}
