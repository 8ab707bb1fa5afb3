//! From samples to a picture, on all threads.
//!
//! In: a prepared scene, a view, settings. Out: a [`Picture`] and a [`Tally`]. A *tile* is a run of
//! consecutive samples in reading order. Invariants: the picture is a pure function of scene, view
//! and settings: each sample is, pixels add their samples in order, and counts are integers. A
//! cancelled picture holds every finished tile and black elsewhere.

use std::sync::atomic::{AtomicBool, Ordering};

use antumbra_scene::model::Color;
use rayon::prelude::*;

use crate::camera::View;
use crate::false_colour;
use crate::integrator::{Integrator, Tally};
use crate::prepare::Prepared;
use crate::sampler::Sampler;

/// Samples between two looks of a thread at what is left: enough to hide the hand-over, few
/// enough that a small picture still feeds many threads.
const TILE_SAMPLES: usize = 1024;

/// Where the rays of a pixel go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// So many stratified samples a pixel; one is the centre.
    Stratified {
        /// Samples a pixel, at least 1.
        samples: u32,
    },
    /// One ray a pixel corner, each shared by up to four pixels: the SPD test procedure.
    Corners,
}

/// What the picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// The shaded scene.
    #[default]
    Scene,
    /// How the shadow queries of each primary hit were decided ([`crate::false_colour`]).
    Occlusion,
}

/// Everything but the camera that a picture depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderSettings {
    /// Where rays go.
    pub sampling: Sampling,
    /// The longest chain of rays, the eye ray counted ([`Integrator::new`]).
    pub max_depth: u32,
    /// Changes the jitter.
    pub seed: u64,
    /// What to show.
    pub show: Show,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            sampling: Sampling::Stratified { samples: 1 },
            max_depth: 5,
            seed: 0,
            show: Show::Scene,
        }
    }
}

/// How the caller watches and stops the work.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Set it to stop soon.
    pub cancel: &'a AtomicBool,
    /// Called from any thread with the number of samples just finished, out of [`work`].
    pub progress: &'a (dyn Fn(u64) + Sync),
}

/// A picture in linear RGB, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// `width * height` values.
    pub pixels: Vec<[f32; 3]>,
}

/// What [`render`] gives back.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture.
    pub picture: Picture,
    /// The work of all finished tiles.
    pub tally: Tally,
    /// Whether nothing is missing.
    pub is_complete: bool,
}

/// Returns how many samples [`render`] reports as finished in the end: pixels, or pixel corners.
pub fn work(size: [u32; 2], sampling: Sampling) -> u64 {
    let [columns, rows] = lattice(size, sampling);
    columns * rows
}

/// Returns the bytes that [`render`] takes for the picture, before any is taken.
pub fn predict_bytes(size: [u32; 2], sampling: Sampling) -> u64 {
    work(size, sampling) * size_of::<[f32; 3]>() as u64
}

fn lattice(size: [u32; 2], sampling: Sampling) -> [u64; 2] {
    let more = u64::from(sampling == Sampling::Corners);
    size.map(|n| u64::from(n) + more)
}

/// Renders a picture on the threads of the current rayon pool.
pub fn render(
    prepared: &Prepared,
    view: &View,
    settings: &RenderSettings,
    watch: Watch<'_>,
) -> Rendered {
    let size = view.size();
    let [columns, _] = lattice(size, settings.sampling);
    let mut pixels = vec![[0.0f32; 3]; work(size, settings.sampling) as usize];

    // Fill tile by tile; a tile that is cut short counts as not begun.
    let tallies: Vec<Option<Tally>> = pixels
        .par_chunks_mut(TILE_SAMPLES)
        .enumerate()
        .map(|(tile, run)| {
            let mut tally = Tally::default();
            let first = (tile * TILE_SAMPLES) as u64;
            for (number, pixel) in (first..).zip(run.iter_mut()) {
                if watch.cancel.load(Ordering::Relaxed) {
                    run.fill([0.0; 3]);
                    return None;
                }
                let place = [number % columns, number / columns];
                *pixel = sample(prepared, view, settings, number, place, &mut tally)
                    .as_vec3()
                    .to_array();
            }
            (watch.progress)(run.len() as u64);
            Some(tally)
        })
        .collect();

    // Put together what is there.
    if settings.sampling == Sampling::Corners {
        average_corners(&mut pixels, size);
    }
    let mut tally = Tally::default();
    tallies.iter().flatten().for_each(|part| tally.add(part));
    let is_complete = tallies.iter().all(Option::is_some);
    Rendered {
        picture: Picture { size, pixels },
        tally,
        is_complete,
    }
}

/// Returns the colour of one pixel or pixel corner.
fn sample(
    prepared: &Prepared,
    view: &View,
    settings: &RenderSettings,
    number: u64,
    [column, row]: [u64; 2],
    tally: &mut Tally,
) -> Color {
    let integrator = Integrator::new(prepared, settings.max_depth);
    let mut see = |across: f64, down: f64| {
        let ray = view.ray(across, down);
        match settings.show {
            Show::Scene => integrator.radiance(&ray, tally),
            Show::Occlusion => false_colour::occlusion(&integrator, prepared, &ray, tally),
        }
    };
    let [column, row] = [column as f64, row as f64];
    match settings.sampling {
        Sampling::Corners => see(column, row),
        Sampling::Stratified { samples } => {
            let sampler = Sampler::new(settings.seed, samples);
            let sum: Color = (0..sampler.count())
                .map(|i| {
                    let [across, down] = sampler.offset(number, i);
                    see(column + across, row + down)
                })
                .fold(Color::ZERO, |sum, color| sum + color);
            sum / f64::from(sampler.count())
        }
    }
}

/// Turns `(width + 1) * (height + 1)` corners into `width * height` pixels, in place: a pixel is
/// written at or before the place of its top left corner, which no later pixel reads.
fn average_corners(pixels: &mut Vec<[f32; 3]>, size: [u32; 2]) {
    let [width, height] = size.map(|n| n as usize);
    for row in 0..height {
        for column in 0..width {
            let top = row * (width + 1) + column;
            let bottom = top + width + 1;
            let corners = [top, top + 1, bottom, bottom + 1].map(|corner| pixels[corner]);
            pixels[row * width + column] = std::array::from_fn(|channel| {
                let sum: f64 = corners
                    .iter()
                    .map(|corner| f64::from(corner[channel]))
                    .sum();
                (0.25 * sum) as f32
            });
        }
    }
    pixels.truncate(width * height);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corner_rays_are_one_more_each_way() {
        assert_eq!(work([512, 512], Sampling::Corners), 263_169);
        assert_eq!(
            work([512, 512], Sampling::Stratified { samples: 9 }),
            262_144
        );
        assert_eq!(
            predict_bytes([16_384, 16_384], Sampling::Corners),
            16_385 * 16_385 * 12
        );
    }

    #[test]
    fn pixels_are_the_mean_of_their_four_corners() {
        let (width, height) = (3, 2);
        let corner = |column: usize, row: usize| [(column * 10 + row) as f32, column as f32, 1.0];
        let mut pixels: Vec<_> = (0..=height)
            .flat_map(|row| (0..=width).map(move |column| corner(column, row)))
            .collect();
        average_corners(&mut pixels, [width as u32, height as u32]);
        let expected: Vec<_> = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column as f32, row as f32)))
            .map(|(column, row)| [(column + 0.5) * 10.0 + row + 0.5, column + 0.5, 1.0])
            .collect();
        assert_eq!(pixels, expected);
    }
}
