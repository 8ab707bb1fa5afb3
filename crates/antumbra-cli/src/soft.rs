//! How the visible part of lights with size is found, and which other shares are asked for, as typed.

use antumbra::{LightSampling, ReceiverSide};
use clap::{Args, ValueEnum};

use crate::values;

/// How the visible part of a light with size is found.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Scene and lights")]
pub struct SoftShadows {
    /// How lights with size are answered: exact, by their exact visible fraction where few triangles are in the way and by
    /// samples elsewhere; or N, by so many samples, as --light-samples
    #[arg(long, value_name = "exact|N", value_parser = soft)]
    soft: Option<Soft>,

    /// Samples of each light with size at each point; in a picture each of --spp takes others. Powers of two are
    /// spread best [default: 16; 64 with --soft exact]
    #[arg(long = "light-samples", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: Option<u32>,
}

/// What follows `--soft`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Soft {
    /// The exact visible fraction.
    Exact,
    /// So many samples.
    Samples(u32),
}

/// Samples where exact fractions have no closed form.
const SAMPLES_BESIDE_EXACT: u32 = 64;

impl SoftShadows {
    /// Returns whether exact visible fractions are wanted.
    pub fn is_exact(&self) -> bool {
        self.soft == Some(Soft::Exact)
    }

    /// Returns how many samples of a light a point takes.
    pub fn samples(&self) -> u32 {
        match (self.samples, self.soft) {
            (Some(samples), _) | (None, Some(Soft::Samples(samples))) => samples,
            (None, Some(Soft::Exact)) => SAMPLES_BESIDE_EXACT,
            (None, None) => antumbra_render::integrator::DEFAULT_LIGHT_SAMPLES,
        }
    }
}

fn soft(text: &str) -> Result<Soft, String> {
    if text == "exact" {
        return Ok(Soft::Exact);
    }
    let samples = text.parse().ok();
    let samples = samples.filter(|samples| (1..=65_536).contains(samples));
    samples
        .map(Soft::Samples)
        .ok_or_else(|| format!("expected exact, or 1 to 65536 samples, found `{text}`"))
}

/// Shares that are asked for, and how.
#[derive(Args, Debug)]
#[command(next_help_heading = "Shares")]
pub struct Shares {
    /// Answer ambient occlusion in place of lights: the share of directions in which nothing is near, weighted by the cosine
    /// to the surface or normal; 1 is open. float32, shape (n,). Points of space look all around
    #[arg(long)]
    pub ambient_occlusion: bool,

    /// Answer sky view factors in place of lights: the share that a surface gets of an equally bright sky; points of space
    /// are level ground. float32, shape (n,)
    #[arg(long, conflicts_with = "ambient_occlusion")]
    pub sky_view_factor: bool,

    /// Distance up to which things count for --ambient-occlusion, in the scene's unit [default: any]
    #[arg(long, value_name = "DISTANCE", requires = "ambient_occlusion", value_parser = values::distance)]
    pub distance: Option<f64>,

    /// Directions for each point of --ambient-occlusion and --sky-view-factor; powers of two are spread best
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub directions: u32,

    /// Side that points look to, for shares: that of the surface's front as wound, its back, or both
    #[arg(long, value_enum, default_value_t, value_name = "SIDE")]
    pub side: Side,

    /// Seed of samples and directions
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// A side of surfaces.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum Side {
    /// The front, as the winding says
    #[default]
    Front,
    /// The back
    Back,
    /// Both sides
    Both,
}

impl Shares {
    /// Returns whether something else than lights is asked about.
    pub fn replace_lights(&self) -> bool {
        self.ambient_occlusion || self.sky_view_factor
    }

    /// Returns the side that points look to.
    pub fn receiver_side(&self) -> ReceiverSide {
        match self.side {
            Side::Front => ReceiverSide::Front,
            Side::Back => ReceiverSide::Back,
            Side::Both => ReceiverSide::Both,
        }
    }

    /// Returns how a light is sampled, or directions as light 0.
    pub fn sampling(&self, samples: u32, light: usize) -> LightSampling {
        LightSampling {
            samples,
            seed: self.seed,
            light: light as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn soft_is_exact_or_a_number_of_samples() {
        assert_eq!(soft("exact"), Ok(Soft::Exact));
        assert_eq!(soft("64"), Ok(Soft::Samples(64)));
        for bad in ["0", "65537", "-1", "Exact", "", "1.5"] {
            assert!(
                soft(bad)
                    .unwrap_err()
                    .starts_with("expected exact, or 1 to"),
                "{bad}"
            );
        }
        let of = |soft, samples| SoftShadows { soft, samples }.samples();
        assert_eq!(of(None, None), 16);
        assert_eq!(of(Some(Soft::Exact), None), 64);
        assert_eq!(of(Some(Soft::Exact), Some(9)), 9);
        assert_eq!(of(Some(Soft::Samples(5)), None), 5);
    }
}
