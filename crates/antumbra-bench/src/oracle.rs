//! How much first-pass values could know at best.
//!
//! In: the queries of a frame. Out: the share that lies in voxels of a uniform grid whose surface
//! points all have one answer. A voxel's points are found by rays from random points of it in
//! random directions, which spreads them over its surfaces by area; those that face the light are
//! asked. It is an estimate from above: what no sample found may still differ.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;

use antumbra::{Counters, IndexOptions, LightId, Method, Refine, Refinement, Shadow, ShadowIndex};
use antumbra_baselines::IndexMethod;
use antumbra_geometry::{Bounds, DVec3, Ray, ReceiverPoint};
use antumbra_render::prepare::Prepared;
use antumbra_render::sampler::uniform;
use antumbra_scene::gather::light_shapes;
use antumbra_scene::model::Facing;
use rayon::prelude::*;

use super::record::Recorded;
use super::report::Capped;
use antumbra_cli::failure::Failure;

/// Samples a voxel, and rays to find them: a voxel that a surface barely enters gets fewer.
const SAMPLES: usize = 64;
const MOST_RAYS: u64 = 1024;
/// Queries whose voxels are looked at, spread evenly over the frame.
const QUERIES: usize = 10_000;

/// Why no sample is refused: it is a hit on the index's own surfaces.
const FINE: &str = "a hit is a fine start";

/// Voxels along the longest axis whose ceiling is sampled, and those whose bytes are reported besides.
const SAMPLED: [u32; 2] = [64, 256];
const WEIGHED: u32 = 512;

/// Returns what values alone know, refined no further than some resolutions.
pub(super) fn capped(
    recorder: &Prepared,
    coherent: &Recorded,
) -> Result<BTreeMap<u32, Capped>, Failure> {
    let facing = recorder.scene().facing;
    let mut all = BTreeMap::new();
    for voxels in [SAMPLED[0], SAMPLED[1], WEIGHED] {
        // Where bytes are weighed, lists are kept as they are by default.
        let refinement = if voxels == WEIGHED {
            Refinement {
                resolution: voxels,
                space_resolution: voxels / 2,
                space_list: 16,
                refine: Refine::Eager,
                ..Refinement::default()
            }
        } else {
            Refinement {
                resolution: voxels,
                space_resolution: voxels / 2,
                short_list: 0,
                space_list: 0,
                long_list: 0,
                refine: Refine::Eager,
                ..Refinement::default()
            }
        };
        let options = IndexOptions {
            method: Method::Voxel,
            refinement,
            ..IndexOptions::default()
        };
        let lights = light_shapes(&recorder.scene().lights);
        let index = options.build(recorder.gathered().occluders(), lights)?;
        let value_bytes = index.occlusion_bytes();
        let decisions = IndexMethod::new("voxel", index).decisions(&coherent.batch);
        let query_count = coherent.batch.starts.len().max(1);
        let ceiling = SAMPLED
            .contains(&voxels)
            .then(|| ceiling(recorder.index(), coherent, facing, voxels));
        let capped = Capped {
            ceiling,
            first_pass: decisions.first_pass as f64 / query_count as f64,
            value_bytes,
            dense_share: value_bytes as f64 / (2.0 / 8.0 * f64::from(voxels).powi(3)),
        };
        all.insert(voxels, capped);
    }
    Ok(all)
}

/// Returns the share of queries in voxels of one answer: cubes, so many along the longest axis of the
/// scene's box.
fn ceiling(index: &ShadowIndex, recorded: &Recorded, facing: Facing, voxels_per_axis: u32) -> f64 {
    let bounds = index.occluders().bounds();
    let size = DVec3::splat(bounds.size().max_element() / f64::from(voxels_per_axis));
    let voxel_of = |point: DVec3| {
        let scaled = (point - bounds.min) / size;
        // Casting takes what rounding puts below the box to zero.
        scaled
            .to_array()
            .map(|c| (c as u32).min(voxels_per_axis - 1))
    };

    // All queries count for their voxel's answers, some are asked about.
    let mut voxels: HashMap<[u32; 3], [bool; 2]> = HashMap::new();
    let points = recorded.batch.starts.iter().zip(&recorded.is_shadowed);
    for (start, &is_shadowed) in points {
        voxels.entry(voxel_of(start.point)).or_default()[usize::from(is_shadowed)] = true;
    }
    let query_count = recorded.batch.starts.len();
    let asked = query_count.min(QUERIES);
    let mut weights: HashMap<[u32; 3], usize> = HashMap::new();
    for number in 0..asked {
        let start = &recorded.batch.starts[number * query_count / asked];
        *weights.entry(voxel_of(start.point)).or_default() += 1;
    }

    let one_answer: usize = weights
        .into_par_iter()
        .filter(|(voxel, _)| {
            let min = bounds.min + size * DVec3::from_array(voxel.map(f64::from));
            let bounds = Bounds {
                min,
                max: min + size,
            };
            is_of_one_answer(index, recorded.batch.light, facing, &bounds, voxels[voxel])
        })
        .map(|(_, weight)| weight)
        .sum();
    one_answer as f64 / asked.max(1) as f64
}

/// Samples a voxel until two answers are found, or enough of one.
fn is_of_one_answer(
    index: &ShadowIndex,
    light: usize,
    facing: Facing,
    voxel: &Bounds,
    mut seen: [bool; 2],
) -> bool {
    let key = voxel.min.to_array().map(f64::to_bits);
    let mut counters = Counters::default();
    let mut samples = 0;
    for ray in 0..MOST_RAYS {
        if seen == [true; 2] || samples == SAMPLES {
            break;
        }
        let draw = |number: u64| uniform(&[key[0], key[1], key[2], ray, number]);
        let origin = voxel.min + voxel.size() * DVec3::new(draw(0), draw(1), draw(2));
        let z = 2.0 * draw(3) - 1.0;
        let (sine, cosine) = libm::sincos(TAU * draw(4));
        let across = (1.0 - z * z).max(0.0).sqrt();
        let ray = Ray {
            origin,
            direction: DVec3::new(across * cosine, across * sine, z),
            leaves: None,
        };
        let Some(hit) = index.nearest(&ray, &mut counters) else {
            continue;
        };
        let start = ReceiverPoint {
            point: hit.point,
            surface: Some(hit.surface),
        };
        let side = index
            .light_side(&start, LightId::from_index(light))
            .expect(FINE);
        let is_facing = match facing {
            Facing::Winding => side > 0,
            Facing::Viewer => side != 0,
        };
        if is_facing && voxel.contains(hit.point) {
            samples += 1;
            let answer = index
                .shadow(&start, LightId::from_index(light), &mut counters)
                .expect(FINE);
            seen[usize::from(answer.shadow == Shadow::Shadowed)] = true;
        }
    }
    seen != [true; 2]
}
