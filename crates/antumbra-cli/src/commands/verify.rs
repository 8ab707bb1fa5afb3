//! `antumbra verify`: every exact method against the reference.
//!
//! In: a scene and a number of queries. Out: each difference, and their number. The queries are a
//! pure function of scene and seed: points as random views see them, points spread over all
//! surfaces, points on edges, vertices, and free points.

mod starts;

use antumbra::{Counters, Shadow, ShadowIndex};
use antumbra_geometry::Start;
use antumbra_render::prepare::{Gathered, PrepareOptions};
use antumbra_scene::model::Scene;
use rayon::prelude::*;

use crate::failure::{Failure, Outcome};
use crate::screen::Screen;
use crate::typed::{Shadows, Verify};
use crate::{load, memory};

/// Queries between two looks of a thread at what is left.
const RUN_QUERIES: u64 = 64;

/// One method that does not give the reference's bit.
struct Difference {
    start: Start,
    light: usize,
    method: Shadows,
    found: Shadow,
    expected: Shadow,
}

/// Builds one index a method, asks, compares.
pub(crate) fn run(typed: &Verify, screen: &Screen) -> Result<Outcome, Failure> {
    let scene = load::lit_scene(&typed.file, &typed.cost, screen)?.scene;
    super::on_threads(&typed.threads, || work(typed, &scene, screen))?
}

fn work(typed: &Verify, scene: &Scene, screen: &Screen) -> Result<Outcome, Failure> {
    let gathered = Gathered::of(scene)?;
    let methods = typed
        .shadows
        .map_or(Shadows::ALL.to_vec(), |only| vec![only]);
    let mut memory_left = memory::limit(typed.cost.memory_limit);
    let mut indices = Vec::new();
    for method in methods {
        let options = PrepareOptions {
            method: method.method(),
            grid: typed.cost.grid.unwrap_or_default(),
            memory_limit: memory_left,
            ..PrepareOptions::default()
        };
        let taken = gathered.predict_bytes(scene.lights.len(), &options)?;
        indices.push((method, gathered.index(&scene.lights, &options)?));
        memory_left = memory_left.saturating_sub(taken);
    }

    let bar = screen.progress(typed.queries, "comparing");
    let run_count = typed.queries.div_ceil(RUN_QUERIES);
    let differences: Vec<Difference> = (0..run_count)
        .into_par_iter()
        .flat_map_iter(|run| {
            let first = run * RUN_QUERIES;
            let end = typed.queries.min(first + RUN_QUERIES);
            let found: Vec<_> = (first..end)
                .flat_map(|query| differences_of(query, typed.seed, scene, &gathered, &indices))
                .collect();
            bar.inc(end - first);
            found
        })
        .collect();
    bar.finish_and_clear();

    for difference in &differences {
        let Difference {
            start,
            light,
            method,
            found,
            expected,
        } = difference;
        let [x, y, z] = start.point.to_array();
        let surface = start
            .surface
            .map_or("free".into(), |id| format!("surface {}", id.0));
        screen.result(format!(
            "difference: point [{x:?}, {y:?}, {z:?}], {surface}, light {light}: {} says {found:?}, \
             the reference {expected:?}",
            method.name()
        ));
    }
    screen.result(format!(
        "{} queries, {} differences",
        typed.queries,
        differences.len()
    ));
    Ok(if differences.is_empty() {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// Asks query number `query` of every method. All lights take turns at each start.
fn differences_of(
    query: u64,
    seed: u64,
    scene: &Scene,
    gathered: &Gathered,
    indices: &[(Shadows, ShadowIndex)],
) -> Vec<Difference> {
    let light_count = scene.lights.len() as u64;
    let light = (query % light_count) as usize;
    let [(_, first), ..] = indices else {
        return Vec::new();
    };
    let start = starts::start(query / light_count, seed, scene, gathered, first);
    let expected = first
        .shadow_by_reference(&start, light)
        .expect("sampled starts lie on surfaces");
    let mut counters = Counters::default();
    indices
        .iter()
        .filter_map(|&(method, ref index)| {
            let answer = index.shadow(&start, light, &mut counters);
            let found = answer.expect("sampled starts lie on surfaces").shadow;
            (found != expected).then_some(Difference {
                start,
                light,
                method,
                found,
                expected,
            })
        })
        .collect()
}
