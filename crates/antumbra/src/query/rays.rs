//! Many rays at once: segments between points of the caller's, nearest hits, all hits.
//!
//! In: slices of points and of what they look at. Out: answers in the order of the points, the same for any
//! number of threads. Invariant: whether a surface is met is decided by the exact rule (EXACTNESS.md); where it
//! is met is rounded `f64`. Absent here: occlusion values, which know nothing of arbitrary rays.

use antumbra_geometry::{DVec3, Hit, LightShape, Ray, SurfaceId};
use antumbra_task::checked;

use crate::limits::is_fine;
use crate::query::lists::lists;
use crate::query::run::{Run, check_length, chunk_length};
use crate::threads::prelude::*;
use crate::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, Counters, Shadow, ShadowIndex,
};

/// Targets that each point of a [`Batch`] looks at: an item a point, finite and at most 2^100 in magnitude.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Towards<'a, P = [f64; 3]> {
    /// The ends of segments, world space. A segment holds neither of its ends.
    Points(&'a [P]),
    /// The directions of rays, world space, any length. A zero direction meets nothing.
    Directions(&'a [P]),
}

/// Rays for nearest-hit and all-hit queries.
#[derive(Clone, Copy, Debug)]
pub struct RayBatch<'a, P = [f64; 3]> {
    /// Origins, world space.
    pub origins: &'a [P],
    /// Directions, any length; one that is zero meets nothing. Distances are in units of this length.
    pub directions: &'a [P],
    /// Numbers of the surfaces they leave, which are not met again where they start.
    pub leaves: Option<&'a [u32]>,
}

/// Everything that rays meet.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    /// Ray after ray, each by distance, then by surface.
    pub hits: Vec<Hit>,
    /// End of the hits of each ray in `hits`.
    pub ends: Vec<usize>,
}

impl ShadowIndex {
    /// Answers for every point of a batch whether an opaque surface is between it and what it looks at, and
    /// writes a byte each: 1 where so.
    ///
    /// That is the shadow query of EXACTNESS.md with a light of the point's own, so the segment is open at
    /// both ends: a surface that holds an end exactly is not crossed there. Ends are taken as given, never
    /// moved onto a surface; one that rounding put behind its surface is behind it.
    ///
    /// Values say nothing about other lights than the index's. The ray goes through the tree for
    /// [`Method::Voxel`](crate::Method::Voxel) and [`Method::Bvh`](crate::Method::Bvh), through the grid for
    /// [`Method::Voxel1990`](crate::Method::Voxel1990) and [`Method::Grid`](crate::Method::Grid), and all
    /// surfaces are tested for [`Method::Naive`](crate::Method::Naive); the answers are the same.
    ///
    /// Runs on all threads of the current rayon pool.
    ///
    /// # Errors
    /// As [`ShadowIndex::occluded`], and where an end or a direction is not finite or too large.
    pub fn occluded_towards<P: Coordinates>(
        &self,
        batch: &Batch<P>,
        towards: Towards<P>,
        out: &mut [u8],
    ) -> Result<BatchCounters, BatchError> {
        let run = Run::new(self, batch, &[])?;
        let (what, targets) = match towards {
            Towards::Points(ends) => ("end", ends),
            Towards::Directions(directions) => ("direction", directions),
        };
        check_length("what points look at", batch.points.len(), targets.len())?;
        check_length("bytes of output", batch.points.len(), out.len())?;
        let length = chunk_length(out.len());
        let task = antumbra_task::current();
        let answer = |(chunk, out): (usize, &mut [u8])| {
            let mut counted = BatchCounters::default();
            for (index, is_blocked) in checked((chunk * length..).zip(out)) {
                let start = run.start(index)?;
                let target = fine(what, index, targets[index])?;
                let light = match towards {
                    Towards::Points(_) => LightShape::Point(target),
                    Towards::Directions(_) => LightShape::Direction(target),
                };
                let is_away = match batch.kind {
                    BatchKind::Facing { normals } => {
                        light.side_of(start.point, normals[index].as_f64()) <= 0
                    }
                    _ => false,
                };
                counted.facing_away += u64::from(is_away);
                let is_nowhere = light == LightShape::Direction(DVec3::ZERO);
                *is_blocked = u8::from(
                    is_away
                        || !is_nowhere
                            && self.answer_to(&start, &light, &mut counted.counters).shadow
                                == Shadow::Shadowed,
                );
            }
            Ok(counted)
        };
        let counted: Vec<_> = out
            .par_chunks_mut(length)
            .enumerate()
            .map(|part| task.enter(|| answer(part)))
            .collect();
        let mut sum = BatchCounters::default();
        // The first error is that of the first point at fault.
        for counted in counted {
            let counted = counted?;
            sum.counters.add(&counted.counters);
            sum.facing_away += counted.facing_away;
        }
        Ok(sum)
    }

    /// Finds the nearest surface along every ray, as [`ShadowIndex::nearest`] does; transparent ones count.
    ///
    /// Exact is whether a surface is met (EXACTNESS.md, with a ray for the segment: one that holds the origin
    /// exactly, or the whole ray, is not met). Distances are rounded, so of two surfaces nearer to each other
    /// than rounding either may be the nearest; equal distances go to the lowest id.
    ///
    /// Runs on all threads of the current rayon pool.
    ///
    /// # Errors
    /// Lengths differ, or a ray is not finite, too large or leaves a surface that is not there.
    pub fn nearest_hits<P: Coordinates>(
        &self,
        rays: &RayBatch<P>,
        out: &mut [Option<Hit>],
    ) -> Result<Counters, BatchError> {
        rays.check(self)?;
        check_length("hits of output", rays.origins.len(), out.len())?;
        let length = chunk_length(out.len());
        let task = antumbra_task::current();
        let answer = |(chunk, out): (usize, &mut [Option<Hit>])| {
            let mut counters = Counters::default();
            for (index, hit) in checked((chunk * length..).zip(out)) {
                *hit = match rays.ray(index)? {
                    Some((ray, unit)) => self
                        .nearest(&ray, &mut counters)
                        .map(|hit| in_units(hit, unit)),
                    None => None,
                };
            }
            Ok(counters)
        };
        let counted: Vec<Result<Counters, BatchError>> = out
            .par_chunks_mut(length)
            .enumerate()
            .map(|part| task.enter(|| answer(part)))
            .collect();
        counted
            .into_iter()
            .try_fold(Counters::default(), |mut sum, counted| {
                sum.add(&counted?);
                Ok(sum)
            })
    }

    /// Finds every surface along every ray; transparent ones count.
    ///
    /// Exact is which surfaces are met, as for [`ShadowIndex::nearest_hits`]: a ray through an edge meets the
    /// faces on both sides of it. Their order is that of rounded distances. A curved surface is met
    /// once, where it is entered; the solid that a ray leaves once, where it is left.
    ///
    /// Runs on all threads of the current rayon pool. Takes memory for every hit.
    ///
    /// # Errors
    /// As [`ShadowIndex::nearest_hits`].
    pub fn all_hits<P: Coordinates>(&self, rays: &RayBatch<P>) -> Result<Hits, BatchError> {
        rays.check(self)?;
        let (hits, ends) = lists(rays.origins.len(), |number, hits| {
            let first = hits.len();
            if let Some((ray, unit)) = rays.ray(number)? {
                self.all_crossed(&ray, &mut Counters::default(), |hit| {
                    hits.push(in_units(hit, unit));
                });
            }
            hits[first..].sort_unstable_by(|a, b| {
                let by_distance = a.distance.total_cmp(&b.distance);
                by_distance.then(a.surface.cmp(&b.surface))
            });
            Ok(())
        })?;
        Ok(Hits { hits, ends })
    }
}

impl<P: Coordinates> RayBatch<'_, P> {
    fn check(&self, index: &ShadowIndex) -> Result<(), BatchError> {
        let count = self.origins.len();
        check_length("directions", count, self.directions.len())?;
        let Some(leaves) = self.leaves else {
            return Ok(());
        };
        check_length("surfaces", count, leaves.len())?;
        let surface_count = index.occluders().surface_count();
        match leaves
            .iter()
            .position(|&surface| surface as usize >= surface_count)
        {
            Some(index) => Err(BatchError::UnknownSurface {
                index,
                surface: leaves[index],
            }),
            None => Ok(()),
        }
    }

    /// Returns a ray, and what its distances are to be multiplied by; `None` for one that goes nowhere.
    ///
    /// A tiny direction is made longer by a power of two: its products lose bits.
    fn ray(&self, index: usize) -> Result<Option<(Ray, f64)>, BatchError> {
        let origin = self.origins[index].as_f64();
        if !is_fine(origin) {
            return Err(BatchError::BadPoint {
                index,
                point: origin,
            });
        }
        let given = fine("direction", index, self.directions[index])?;
        if given == DVec3::ZERO {
            return Ok(None);
        }
        let LightShape::Direction(direction) = LightShape::Direction(given).without_underflow()
        else {
            unreachable!("a direction stays one");
        };
        let leaves = self.leaves.map(|leaves| SurfaceId(leaves[index]));
        let ray = Ray {
            origin,
            direction,
            leaves,
        };
        let unit = direction.abs().max_element() / given.abs().max_element();
        Ok(Some((ray, unit)))
    }
}

fn in_units(hit: Hit, unit: f64) -> Hit {
    Hit {
        distance: hit.distance * unit,
        ..hit
    }
}

fn fine<P: Coordinates>(what: &'static str, index: usize, given: P) -> Result<DVec3, BatchError> {
    let found = given.as_f64();
    if is_fine(found) {
        Ok(found)
    } else {
        Err(BatchError::BadTarget { what, index, found })
    }
}
