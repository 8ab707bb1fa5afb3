//! Queries as a frame asks them, of one light.
//!
//! In: a prepared scene, a camera. Out: batches with the answers of the prepared index. A query is
//! recorded where the integrator asks one about what a pixel shows first: the surface faces the
//! light and the light shines there.

use antumbra::{LightId, Shadow};
use antumbra_baselines::Batch;
use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};
use antumbra_render::camera::View;
use antumbra_render::integrator::{Integrator, LightQuery, Tally};
use antumbra_render::prepare::Prepared;
use antumbra_render::sampler::uniform;
use rayon::prelude::*;

/// Queries and their answers.
#[derive(Clone, Debug)]
pub(super) struct Recorded {
    pub(super) batch: Batch,
    pub(super) is_shadowed: Vec<bool>,
}

/// Where in its pixel an eye ray goes through.
#[derive(Clone, Copy, Debug)]
pub(super) enum Aim {
    /// The middle: the queries that are timed.
    Middle,
    /// Elsewhere, by a seed: the queries that values come from.
    Jittered(u64),
}

impl Aim {
    /// Returns where in a pixel an eye ray goes through, from 0 to 1.
    fn at(self, column: u32, row: u32) -> [f64; 2] {
        match self {
            Self::Middle => [0.5; 2],
            // Not the middle itself, which is timed.
            Self::Jittered(seed) => [0, 1].map(|axis| {
                let key = [seed, axis, row.into(), column.into()];
                0.45 * uniform(&key) + 0.5 * ((seed >> axis) & 1) as f64 + 0.025
            }),
        }
    }
}

/// Free points lie this far off surfaces, scene units.
const FREE_DISTANCES: [f64; 2] = [0.01, 0.1];

/// Why no query is refused: starts are hits, or lie a little off them.
const FINE: &str = "starts are finite and the scene has the light";

/// Records the queries of a frame, row after row.
pub(super) fn frame(prepared: &Prepared, view: &View, light: usize, aim: Aim) -> Recorded {
    let integrator = Integrator::new(prepared, 1);
    let [width, height] = view.size();
    let rows: Vec<Vec<_>> = (0..height)
        .into_par_iter()
        .map(|row| {
            let mut tally = Tally::default();
            let pixels = (0..width).filter_map(|column| {
                let [across, down] = aim.at(column, row);
                let ray = view.ray(f64::from(column) + across, f64::from(row) + down);
                let point = integrator.first_seen(&ray, &mut tally)?;
                let LightQuery::Asked { answer, .. } = integrator.ask(&point, light, &mut tally)
                else {
                    return None;
                };
                let start = ReceiverPoint {
                    point: point.hit.point,
                    surface: Some(point.hit.surface),
                };
                let side = f64::from(
                    prepared
                        .index()
                        .light_side(&start, LightId::from_index(light))
                        .expect(FINE),
                );
                let normal = point.geometric_normal * side;
                Some((start, normal, answer.shadow == Shadow::Shadowed))
            });
            pixels.collect()
        })
        .collect();
    let mut recorded = empty(prepared, light, true);
    for (start, normal, is_shadowed) in rows.into_iter().flatten() {
        recorded.batch.starts.push(start);
        recorded.batch.normals.push(normal);
        recorded.is_shadowed.push(is_shadowed);
    }
    recorded
}

/// Returns what the pixels of a frame show first, row after row, as far as its surface has its front towards the eye, each
/// with its unit normal on that side.
pub(super) fn seen(
    prepared: &Prepared,
    view: &View,
    eye: DVec3,
    aim: Aim,
) -> (Vec<ReceiverPoint>, Vec<DVec3>) {
    let integrator = Integrator::new(prepared, 1);
    let [width, height] = view.size();
    let rows: Vec<Vec<_>> = (0..height)
        .into_par_iter()
        .map(|row| {
            let mut tally = Tally::default();
            let pixels = (0..width).filter_map(|column| {
                let [across, down] = aim.at(column, row);
                let ray = view.ray(f64::from(column) + across, f64::from(row) + down);
                let point = integrator.first_seen(&ray, &mut tally)?;
                let start = ReceiverPoint {
                    point: point.hit.point,
                    surface: Some(point.hit.surface),
                };
                let occluders = prepared.gathered().occluders();
                let side = occluders.light_side(&start, &LightShape::Point(eye));
                (side > 0).then_some((start, point.geometric_normal))
            });
            pixels.collect()
        })
        .collect();
    rows.into_iter().flatten().unzip()
}

fn empty(prepared: &Prepared, light: usize, is_coherent: bool) -> Recorded {
    Recorded {
        batch: Batch {
            light,
            light_shape: prepared.index().lights()[light],
            starts: Vec::new(),
            normals: Vec::new(),
            is_coherent,
        },
        is_shadowed: Vec::new(),
    }
}

/// Returns the same queries in random order.
pub(super) fn shuffled(recorded: &Recorded, seed: u64) -> Recorded {
    let mut order: Vec<usize> = (0..recorded.is_shadowed.len()).collect();
    for place in (1..order.len()).rev() {
        let other = (uniform(&[seed, place as u64]) * (place + 1) as f64) as usize;
        order.swap(place, other.min(place));
    }
    let Recorded { batch, is_shadowed } = recorded;
    Recorded {
        batch: Batch {
            starts: order.iter().map(|&i| batch.starts[i]).collect(),
            normals: order.iter().map(|&i| batch.normals[i]).collect(),
            is_coherent: false,
            ..*batch
        },
        is_shadowed: order.iter().map(|&i| is_shadowed[i]).collect(),
    }
}

/// Returns free queries a little off the recorded points, on the light's side, in the same order.
pub(super) fn free(prepared: &Prepared, recorded: &Recorded, seed: u64) -> Recorded {
    let light = recorded.batch.light;
    let mut free = empty(prepared, light, true);
    let points = recorded.batch.starts.iter().zip(&recorded.batch.normals);
    free.batch.starts = points
        .enumerate()
        .map(|(number, (start, &normal))| {
            let [near, far] = FREE_DISTANCES;
            let distance = near + (far - near) * uniform(&[seed, number as u64]);
            ReceiverPoint {
                point: start.point + distance * normal,
                surface: None,
            }
        })
        .collect();
    free.batch.normals = vec![DVec3::ZERO; free.batch.starts.len()];
    free.is_shadowed = answers(prepared, &free.batch);
    free
}

fn answers(prepared: &Prepared, batch: &Batch) -> Vec<bool> {
    let ask = |start| {
        let mut counters = antumbra::Counters::default();
        let answer =
            prepared
                .index()
                .shadow(start, LightId::from_index(batch.light), &mut counters);
        answer.expect(FINE).shadow == Shadow::Shadowed
    };
    batch.starts.par_iter().map(ask).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra::IndexOptions;

    #[test]
    fn sets_hold_the_same_queries_and_free_points_lie_off_surfaces() {
        let scene = antumbra_scene::generate::tetra(3).unwrap();
        let view = View::new(&scene.camera.unwrap(), [40, 30]).unwrap();
        let prepared = Prepared::new(scene, &IndexOptions::default()).unwrap();
        let timed = frame(&prepared, &view, 0, Aim::Middle);
        assert!(timed.is_shadowed.contains(&true) && timed.is_shadowed.contains(&false));

        let mixed = shuffled(&timed, 1);
        assert_ne!(mixed.batch.starts, timed.batch.starts);
        let sorted = |recorded: &Recorded| {
            let points = recorded.batch.starts.iter().zip(&recorded.is_shadowed);
            let mut points: Vec<_> = points
                .map(|(start, is_shadowed)| {
                    (start.point.to_array().map(f64::to_bits), *is_shadowed)
                })
                .collect();
            points.sort_unstable();
            points
        };
        assert_eq!(sorted(&mixed), sorted(&timed));

        let free = free(&prepared, &timed, 2);
        for (on, off) in timed.batch.starts.iter().zip(&free.batch.starts) {
            let distance = (on.point - off.point).length();
            assert!((0.0099..0.1001).contains(&distance), "{distance}");
            assert_eq!(off.surface, None);
        }
    }

    #[test]
    fn values_never_come_from_timed_points() {
        let scene = antumbra_scene::generate::tetra(2).unwrap();
        let view = View::new(&scene.camera.unwrap(), [16, 16]).unwrap();
        let prepared = Prepared::new(scene, &IndexOptions::default()).unwrap();
        let timed = frame(&prepared, &view, 0, Aim::Middle);
        for seed in 0..4 {
            let warm = frame(&prepared, &view, 0, Aim::Jittered(seed));
            assert!(!warm.batch.starts.is_empty());
            assert!(
                !warm
                    .batch
                    .starts
                    .iter()
                    .any(|start| timed.batch.starts.contains(start))
            );
        }
    }
}
