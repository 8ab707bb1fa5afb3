//! From samples to a picture, on all threads.
//!
//! In: a prepared scene, a view, settings. Out: a [`Picture`] and a [`Tally`]. A *tile* is a run of
//! consecutive samples in reading order. Invariants: the picture and its layers are pure functions
//! of scene, view and settings: each sample is, pixels add their samples in order, tiles are added
//! in order, and counts are integers. A cancelled picture holds every finished tile and black
//! elsewhere.

use antumbra::LightId;
use antumbra_scene::model::Color;
use antumbra_task::{Task, check};
use rayon::prelude::*;

pub use crate::aov::light_count;
use crate::aov::{Aovs, Layer};
use crate::camera::View;
use crate::exposure::Metering;
use crate::false_color;
use crate::fog::Fog;
use crate::integrator::{DEFAULT_LIGHT_SAMPLES, Integrator, Seen, Tally, Work};
use crate::prepare::Prepared;
use crate::sampler::Sampler;

/// More samples than a pixel has: all samples of a picture have numbers of their own.
const MAX_SPP: u32 = 1 << 16;

/// Samples between two looks of a thread at what is left: enough to hide the hand-over, few
/// enough that a small picture still feeds many threads.
const TILE_SAMPLES: usize = 1024;

/// Places in a pixel that rays go through.
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

/// Subject of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// The shaded scene.
    #[default]
    Scene,
    /// How the shadow queries of each primary hit were decided ([`crate::false_color`]).
    Occlusion,
}

/// Everything but the camera that a picture depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderSettings {
    /// Places in a pixel that rays go through.
    pub sampling: Sampling,
    /// The longest chain of rays, the eye ray counted ([`Integrator::new`]).
    pub max_depth: u32,
    /// Samples of each light with size for each hit, 1 to
    /// [`MAX_LIGHT_SAMPLES`](antumbra_geometry::MAX_LIGHT_SAMPLES); each of the pixel's samples has others.
    pub light_samples: u32,
    /// Whether lights with size have their exact visible fraction where that has a closed form; samples answer elsewhere.
    pub exact_fractions: bool,
    /// Whether see-through surfaces color the light that reaches others through them; it passes unchanged otherwise.
    pub colored_shadows: bool,
    /// Whether surfaces have the reliefs of their materials: in their shading, and where shadows end on them.
    pub bumps: bool,
    /// The medium between surfaces, if there is one.
    pub fog: Option<Fog>,
    /// Changes the jitter, and the samples of lights with size.
    pub seed: u64,
    /// Subject of the picture.
    pub show: Show,
    /// Which layers to make beside it.
    pub aovs: Aovs,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            sampling: Sampling::Stratified { samples: 1 },
            max_depth: 5,
            light_samples: DEFAULT_LIGHT_SAMPLES,
            exact_fractions: false,
            colored_shadows: true,
            bumps: true,
            fog: None,
            seed: 0,
            show: Show::Scene,
            aovs: Aovs::default(),
        }
    }
}

/// How the caller watches and stops the work.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Stop it to get the picture as far as it is. Whatever task the caller works for otherwise is not looked
    /// at meanwhile.
    pub task: &'a Task,
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

/// A rectangle of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the first pixel, from the top left.
    pub first: [u32; 2],
    /// Width and height in pixels.
    pub size: [u32; 2],
}

/// Result of [`render`].
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture, or the window of it.
    pub picture: Picture,
    /// The layers asked for.
    pub layers: Vec<Layer>,
    /// How bright the samples are that hit something.
    pub metering: Metering,
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

/// Announces to the index that [`render`] will be called so often for such pictures, so that it makes at once what pays for all of
/// them.
pub fn expect(prepared: &Prepared, size: [u32; 2], sampling: Sampling, frames: u64) {
    let samples = match sampling {
        Sampling::Corners => 1,
        Sampling::Stratified { samples } => u64::from(samples),
    };
    // What lights know one by one is not asked then.
    if prepared.asks_lights_at_once() {
        return;
    }
    // About as many samples see something that faces a light.
    let queries = frames * work(size, sampling) * samples / 2;
    for light in 0..prepared.scene().lights.len() {
        prepared
            .index()
            .expect_queries(LightId::from_index(light), queries);
    }
}

/// Returns the bytes that [`render`] takes for the picture and its layers, before any is taken.
pub fn predict_bytes(size: [u32; 2], sampling: Sampling, aovs: Aovs, light_count: usize) -> u64 {
    // The layers are there twice while they are sorted into planes.
    let layers = 2 * aovs.channel_count(light_count) * size_of::<f32>();
    work(size, sampling) * (size_of::<[f32; 3]>() + layers) as u64
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
    let whole = Window {
        first: [0; 2],
        size: view.size(),
    };
    render_window(prepared, view, whole, settings, watch)
}

/// Renders the pixels of a window as [`render`] does: each has the bits that it has in the whole picture.
pub fn render_window(
    prepared: &Prepared,
    view: &View,
    window: Window,
    settings: &RenderSettings,
    watch: Watch<'_>,
) -> Rendered {
    let Window {
        first: corner,
        size,
    } = window;
    let scene = prepared.scene();
    // Samples have the numbers of the whole picture.
    let [columns, _] = lattice(view.size(), settings.sampling);
    let [across, _] = lattice(size, settings.sampling);
    let sample_count = work(size, settings.sampling) as usize;
    let stride = settings.aovs.channel_count(light_count(scene));
    expect(prepared, size, settings.sampling, 1);
    let mut pixels = vec![[0.0f32; 3]; sample_count];
    let mut shares = vec![0.0f32; stride * sample_count];

    // Fill tile by tile; a tile that is cut short counts as not begun.
    let runs: Vec<_> = pixels
        .chunks_mut(TILE_SAMPLES)
        .zip(runs_of(&mut shares, stride))
        .enumerate()
        .collect();
    let tiles: Vec<Option<(Tally, Metering)>> = runs
        .into_par_iter()
        .map(|(number, (pixels, shares))| {
            let first = (number * TILE_SAMPLES) as u64;
            let mut tile = Tile::new(prepared, view, settings);
            let done = watch.task.run(|| {
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    let nth = first + i as u64;
                    let place = [
                        u64::from(corner[0]) + nth % across,
                        u64::from(corner[1]) + nth / across,
                    ];
                    let number = place[1] * columns + place[0];
                    *pixel = tile.pixel(number, place, &mut shares[i * stride..][..stride]);
                }
            });
            if done.is_err() {
                pixels.fill([0.0; 3]);
                shares.fill(0.0);
                return None;
            }
            (watch.progress)(pixels.len() as u64);
            Some((tile.work.tally, tile.metering))
        })
        .collect();

    // Put together what is there.
    let mut tally = Tally::default();
    let mut metering = Metering::default();
    for (of_tile, bright) in tiles.iter().flatten() {
        tally.add(of_tile);
        metering.add(bright);
    }
    if settings.sampling == Sampling::Corners {
        let pixel_count = size[0] as usize * size[1] as usize;
        average_corners(pixels.as_flattened_mut(), size, 3);
        pixels.truncate(pixel_count);
        average_corners(&mut shares, size, stride);
        shares.truncate(stride * pixel_count);
    }
    Rendered {
        picture: Picture { size, pixels },
        layers: settings.aovs.layers(scene, &shares),
        metering,
        tally,
        is_complete: tiles.iter().all(Option::is_some),
    }
}

/// Cuts numbers, `stride` a sample, into one run a tile; into empty runs without end if there are
/// none.
fn runs_of(shares: &mut [f32], stride: usize) -> impl Iterator<Item = &mut [f32]> {
    let chunk = (stride * TILE_SAMPLES).max(1);
    let empty = std::iter::repeat_with(Default::default);
    shares
        .chunks_mut(chunk)
        .chain(empty.take(if stride == 0 { usize::MAX } else { 0 }))
}

/// A tile at work.
struct Tile<'a> {
    integrator: Integrator<'a>,
    view: &'a View,
    settings: &'a RenderSettings,
    seen: Seen,
    sums: Vec<f64>,
    work: Work<'a>,
    metering: Metering,
}

impl<'a> Tile<'a> {
    fn new(prepared: &'a Prepared, view: &'a View, settings: &'a RenderSettings) -> Self {
        let light_count = light_count(prepared.scene());
        let integrator = Integrator::new(prepared, settings.max_depth)
            .with_light_samples(settings.light_samples, settings.seed)
            .with_exact_fractions(settings.exact_fractions)
            .with_colored_shadows(settings.colored_shadows)
            .with_bumps(settings.bumps)
            .with_fog(settings.fog);
        Self {
            work: integrator.work(),
            integrator,
            view,
            settings,
            seen: Seen::default(),
            sums: vec![0.0; settings.aovs.channel_count(light_count)],
            metering: Metering::default(),
        }
    }

    /// Returns the color of one pixel or pixel corner, and its shares for the layers.
    fn pixel(&mut self, number: u64, [column, row]: [u64; 2], shares: &mut [f32]) -> [f32; 3] {
        let [column, row] = [column as f64, row as f64];
        self.sums.fill(0.0);
        let mut sum = Color::ZERO;
        let mut is_surface = false;
        let sampler = match self.settings.sampling {
            Sampling::Corners => Sampler::new(0, 1),
            Sampling::Stratified { samples } => Sampler::new(self.settings.seed, samples),
        };
        for i in 0..sampler.count() {
            let [across, down] = match self.settings.sampling {
                Sampling::Corners => [0.0; 2],
                Sampling::Stratified { .. } => sampler.offset(number, i),
            };
            // A pixel may have thousands.
            check();
            let number = number * u64::from(MAX_SPP) + u64::from(i);
            sum += self.sample(number, column + across, row + down);
            is_surface |= self.seen.is_surface;
            let scene = self.integrator.scene();
            let counts = [scene.lights.len(), scene.area_lights.len()];
            self.settings
                .aovs
                .add_sample(&self.seen, counts, &mut self.sums);
        }

        let count = f64::from(sampler.count());
        for (share, &sum) in shares.iter_mut().zip(&self.sums) {
            *share = (sum / count) as f32;
        }
        let pixel = (sum / count).as_vec3().to_array();
        if is_surface {
            self.metering.add_pixel(pixel);
        }
        pixel
    }

    /// Returns what is seen through one point of the picture.
    fn sample(&mut self, number: u64, across: f64, down: f64) -> Color {
        let ray = self.view.ray(across, down);
        let integrator = self.integrator.at_sample(number);
        let Self { seen, work, .. } = self;
        match self.settings.show {
            Show::Scene => integrator.radiance(&ray, work, seen),
            Show::Occlusion => {
                integrator.look_only(&ray, work, seen);
                false_color::occlusion(seen)
            }
        }
    }
}

/// Turns `(width + 1) * (height + 1)` corners into `width * height` pixels of `stride` numbers, in
/// place: a pixel is written at or before the place of its top left corner, which no later pixel
/// reads. What is behind the last pixel is left over.
fn average_corners(values: &mut [f32], size: [u32; 2], stride: usize) {
    let [width, height] = size.map(|n| n as usize);
    for row in 0..height {
        for column in 0..width {
            let top = row * (width + 1) + column;
            let bottom = top + width + 1;
            for channel in 0..stride {
                let sum: f64 = [top, top + 1, bottom, bottom + 1]
                    .map(|corner| f64::from(values[corner * stride + channel]))
                    .iter()
                    .sum();
                values[(row * width + column) * stride + channel] = (0.25 * sum) as f32;
            }
        }
    }
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
            predict_bytes([16_384, 16_384], Sampling::Corners, Aovs::default(), 9),
            16_385 * 16_385 * 12
        );
        let aovs = Aovs {
            shadow: true,
            decided: true,
            fog: false,
        };
        let one = Sampling::Stratified { samples: 1 };
        assert_eq!(predict_bytes([2, 1], one, aovs, 3), 2 * (12 + 2 * 4 * 10));
    }

    #[test]
    fn pixels_are_the_mean_of_their_four_corners() {
        let (width, height) = (3, 2);
        let corner = |column: usize, row: usize| [(column * 10 + row) as f32, column as f32, 1.0];
        let mut pixels: Vec<_> = (0..=height)
            .flat_map(|row| (0..=width).map(move |column| corner(column, row)))
            .collect();
        average_corners(pixels.as_flattened_mut(), [width as u32, height as u32], 3);
        pixels.truncate(width * height);
        let expected: Vec<_> = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column as f32, row as f32)))
            .map(|(column, row)| [(column + 0.5) * 10.0 + row + 0.5, column + 0.5, 1.0])
            .collect();
        assert_eq!(pixels, expected);
    }
}
