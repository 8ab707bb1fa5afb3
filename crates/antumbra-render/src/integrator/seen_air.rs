//! Effect of the air along a ray, and what it took to know it.

use antumbra_scene::model::Color;

/// Effect of the air on what is seen through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Light that it scatters towards the ray's origin.
    pub light: Color,
    /// Share of the light from behind that it leaves.
    pub transmittance: f64,
}

impl Default for Air {
    /// Returns clear air.
    fn default() -> Self {
        Self {
            light: Color::ZERO,
            transmittance: 1.0,
        }
    }
}

/// Counts of what was asked about segments of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AirTally {
    /// One for each segment and light, or sample of a light with size, whose lit stretches were asked.
    pub segments: u64,
    /// Of `segments`, those without a closed form, that were asked part by part.
    pub by_parts: u64,
    /// Lit stretches of all segments.
    pub intervals: u64,
}

impl AirTally {
    pub(super) fn add(&mut self, other: &Self) {
        self.segments += other.segments;
        self.by_parts += other.by_parts;
        self.intervals += other.intervals;
    }
}
