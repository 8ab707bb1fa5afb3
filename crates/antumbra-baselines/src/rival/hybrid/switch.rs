//! From how many shadow polygons on a shadow ray costs less: the paper's `N_th`.
//!
//! In: a hybrid without a limit, and its index. Out: the limit that would have cost least for queries from the
//! middles of some surfaces that face the light. Work counts as cost: a voxel of a shadow ray and a shadow polygon
//! as one, a surface tested as two. Answers do not depend on it.

use antumbra::{Counters, ShadowIndex};
use antumbra_geometry::Start;

use super::{Count, Hybrid};
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
pub(super) fn most_tests(hybrid: &Hybrid, index: &ShadowIndex, light: usize) -> u64 {
    let occluders = index.occluders();
    let step = occluders.surface_count().div_ceil(SAMPLES).max(1);
    let starts = occluders.surfaces().step_by(step).filter_map(|surface| {
        let point = match occluders.triangle_positions(surface) {
            Some([a, b, c]) => a + ((b - a) + (c - a)) / 3.0,
            None => occluders.surface_bounds(surface).center(),
        };
        let start = Start {
            point,
            surface: occluders.triangle_positions(surface).map(|_| surface),
        };
        // Others are not asked about.
        (index.light_side(&start, light) != Ok(-1)).then_some(start)
    });
    let trials: Vec<Trial> = starts
        .filter_map(|start| {
            let mut rays = Counters::default();
            // Middles are finite where their surfaces are; nothing depends on it.
            index.shadow(&start, light, &mut rays).ok()?;
            let segment = occluders.segment(&start, &index.lights()[light]);
            let mut work = Work::default();
            let count = hybrid.by_count(&hybrid.lights[light], &segment, &mut work);
            Some(Trial {
                tests: work.counters.intersections,
                is_known: count != Count::Unknown,
                ray_cost: rays.steps + TEST_COST * rays.intersections,
            })
        })
        .collect();
    let limits = trials.iter().map(|trial| trial.tests).chain([0]);
    let cost = |limit: u64| trials.iter().map(|trial| trial.cost(limit)).sum::<u64>();
    limits
        .min_by_key(|&limit| (cost(limit), limit))
        .unwrap_or(0)
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
        };
        assert_eq!([0, 4, 5, 9].map(|limit| trial.cost(limit)), [10, 14, 5, 5]);
        let in_doubt = Trial {
            is_known: false,
            ..trial
        };
        assert_eq!(in_doubt.cost(9), 15);
    }
}
