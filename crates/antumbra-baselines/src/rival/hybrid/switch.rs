//! From how many shadow polygons on a shadow ray costs less: the paper's `N_th`.
//!
//! In: a hybrid without a limit, and its index. Out: the limit that would have cost least for queries from the
//! middles of some surfaces, on the light's side, each weighted by how large its surface is. Work counts as cost: a
//! voxel of a shadow ray and a shadow polygon as one, a surface tested as two. Answers do not depend on it.

use antumbra::{Counters, LightId, ShadowIndex};
use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, Segment, SurfaceId};

use crate::Work;

/// How many queries are tried.
const SAMPLES: usize = 256;
/// What a surface tested costs beside a voxel or a polygon.
const TEST_COST: u64 = 2;

/// What one query took both ways.
struct Trial {
    /// Polygons until the count was there, or in doubt.
    tests: u64,
    is_known: bool,
    ray_cost: u64,
    /// In proportion to the surface's area, about.
    weight: f64,
}

impl Trial {
    /// Returns what the query costs with a limit.
    fn cost(&self, most_tests: u64) -> u64 {
        if self.is_known && self.tests <= most_tests {
            self.tests
        } else {
            self.tests.min(most_tests) + self.ray_cost
        }
    }
}

/// Returns the limit for one light.
/// `is_counted` counts shadow polygons, and says whether the count was not left in doubt.
pub(super) fn most_tests(
    index: &ShadowIndex,
    light: usize,
    is_counted: impl Fn(&Segment, &mut Work) -> bool,
) -> u64 {
    let occluders = index.occluders();
    let step = occluders.surface_count().div_ceil(SAMPLES).max(1);
    let starts = occluders.surfaces().step_by(step).filter_map(|surface| {
        let start = start_on(occluders, surface, &index.lights()[light]);
        // Others are not asked about.
        (index.light_side(&start, LightId::from_index(light)) != Ok(-1)).then_some((surface, start))
    });
    let trials: Vec<Trial> = starts
        .filter_map(|(surface, start)| {
            let mut rays = Counters::default();
            // Middles are finite where their surfaces are; nothing depends on it.
            index
                .shadow(&start, LightId::from_index(light), &mut rays)
                .ok()?;
            let segment = occluders.segment(&start, &index.lights()[light]);
            let mut work = Work::default();
            let is_known = is_counted(&segment, &mut work);
            Some(Trial {
                tests: work.counters.intersections,
                is_known,
                ray_cost: rays.steps + TEST_COST * rays.intersections,
                weight: occluders.surface_bounds(surface).size().length_squared(),
            })
        })
        .collect();
    let limits = trials.iter().map(|trial| trial.tests).chain([0]);
    let cost = |limit: u64| {
        let costs = trials
            .iter()
            .map(|trial| trial.weight * trial.cost(limit) as f64);
        costs.sum::<f64>()
    };
    limits
        .map(|limit| (cost(limit), limit))
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map_or(0, |(_, limit)| limit)
}

/// Returns a start in the middle of a triangle, on a sphere towards the light, or beside another shape.
fn start_on(occluders: &Occluders, surface: SurfaceId, light: &LightShape) -> ReceiverPoint {
    if let Some([a, b, c]) = occluders.triangle_positions(surface) {
        return ReceiverPoint {
            point: a + ((b - a) + (c - a)) / 3.0,
            surface: Some(surface),
        };
    }
    let bounds = occluders.surface_bounds(surface);
    let middle = bounds.center();
    let towards = light.towards(middle).try_normalize().unwrap_or(DVec3::ZERO);
    match occluders.sphere(surface) {
        Some(sphere) => ReceiverPoint {
            point: sphere.center + sphere.radius * towards,
            surface: Some(surface),
        },
        None => ReceiverPoint {
            point: middle + 0.5 * bounds.size().length() * towards,
            surface: None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_beyond_the_limit_costs_both() {
        let trial = Trial {
            tests: 5,
            is_known: true,
            ray_cost: 10,
            weight: 1.0,
        };
        assert_eq!([0, 4, 5, 9].map(|limit| trial.cost(limit)), [10, 14, 5, 5]);
        let in_doubt = Trial {
            is_known: false,
            ..trial
        };
        assert_eq!(in_doubt.cost(9), 15);
    }
}
