//! Pictures of numbers on surfaces: a color a point, without light.
//!
//! In: a prepared scene, a view, and the color of each point that is seen. Out: a [`Picture`]; edges are thin dark
//! lines. Colors are not shaded, so that each means one number wherever it is seen. Invariant: the same for any number of
//! threads.

use antumbra_geometry::DVec3;
use antumbra_scene::model::Color;
use rayon::prelude::*;

use crate::camera::View;
use crate::film::Picture;
use crate::integrator::{Integrator, SurfacePoint, Tally};
use crate::prepare::Prepared;
use crate::sampler::Sampler;

/// Share of its light that a pixel at an edge keeps.
const EDGE_SHARE: f32 = 0.35;

/// Cosine between the normals of neighbors below which there is an edge.
const FOLD_COSINE: f64 = 0.9;

/// Sine of the angle between a plane and the way to a neighbor above which the neighbor lies on another plane.
const STEP_SINE: f64 = 0.3;

/// Point in the middle of a pixel.
#[derive(Clone, Copy, Debug)]
struct Middle {
    point: DVec3,
    normal: DVec3,
}

/// Returns the picture of what `color` says of the points that are seen first, the mean of so many samples a pixel; where
/// nothing is seen, `background`. Runs on all threads of the current rayon pool; a task that is stopped unwinds.
pub fn value_picture(
    prepared: &Prepared,
    view: &View,
    samples: u32,
    background: Color,
    color: &(dyn Fn(&SurfacePoint<'_>) -> Color + Sync),
) -> Picture {
    let size = view.size();
    let width = size[0] as usize;
    let sampler = Sampler::new(0, samples);
    let task = antumbra_task::current();
    let row_of = |row: usize| {
        let integrator = Integrator::new(prepared, 1).with_bumps(false);
        let mut tally = Tally::default();
        let mut seen = |across: f64, down: f64| {
            antumbra_task::check();
            integrator.first_seen(&view.ray(across, down), &mut tally)
        };
        let pixel = |column: usize| {
            let [across, down] = [column, row].map(|place| place as f64);
            let middle = seen(across + 0.5, down + 0.5).map(|found| Middle {
                point: found.hit.point,
                normal: found.geometric_normal,
            });
            let number = (row * width + column) as u64;
            let sum = (0..sampler.count())
                .map(|sample| {
                    let [right, below] = sampler.offset(number, sample);
                    seen(across + right, down + below).map_or(background, |found| color(&found))
                })
                .fold(Color::ZERO, |sum, color| sum + color);
            let mean = sum / f64::from(sampler.count());
            (mean.as_vec3().to_array(), middle)
        };
        (0..width).map(pixel).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<([f32; 3], Option<Middle>)>> = (0..size[1] as usize)
        .into_par_iter()
        .map(|row| task.enter(|| row_of(row)))
        .collect();
    let (mut pixels, middles): (Vec<_>, Vec<_>) = rows.into_iter().flatten().unzip();
    for (number, pixel) in pixels.iter_mut().enumerate() {
        let right = (number % width + 1 < width).then_some(number + 1);
        let below = Some(number + width).filter(|&below| below < middles.len());
        let mut neighbors = [right, below].into_iter().flatten();
        if neighbors.any(|other| is_edge(middles[number].as_ref(), middles[other].as_ref())) {
            *pixel = pixel.map(|value| EDGE_SHARE * value);
        }
    }
    Picture { size, pixels }
}

/// Returns the bytes that [`value_picture`] takes, before any is taken.
pub fn predict_bytes(size: [u32; 2]) -> u64 {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    // Rows, then what they are taken apart into.
    let both = size_of::<[f32; 3]>() + size_of::<Option<Middle>>();
    pixels * 2 * both as u64
}

/// Returns whether two neighbors lie on surfaces that do not go on in each other.
fn is_edge(one: Option<&Middle>, other: Option<&Middle>) -> bool {
    let (Some(one), Some(other)) = (one, other) else {
        return one.is_some() != other.is_some();
    };
    let way = other.point - one.point;
    one.normal.dot(other.normal).abs() < FOLD_COSINE
        || one.normal.dot(way).abs() > STEP_SINE * way.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folds_steps_and_outlines_are_edges_and_planes_are_none() {
        let at = |point: [f64; 3], normal: DVec3| Middle {
            point: point.into(),
            normal,
        };
        let floor = at([0.0, 0.0, 0.0], DVec3::Z);
        let far = at([90.0, 10.0, 0.0], DVec3::Z);
        let step = at([0.1, 0.0, 1.0], DVec3::Z);
        let wall = at([0.1, 0.0, 0.0], DVec3::X);
        assert!(!is_edge(Some(&floor), Some(&far)));
        assert!(!is_edge(
            Some(&floor),
            Some(&at([0.1, 0.0, 0.0], -DVec3::Z))
        ));
        assert!(is_edge(Some(&floor), Some(&step)));
        assert!(is_edge(Some(&floor), Some(&wall)));
        assert!(is_edge(Some(&floor), None) && is_edge(None, Some(&floor)));
        assert!(!is_edge(None, None));
    }
}
