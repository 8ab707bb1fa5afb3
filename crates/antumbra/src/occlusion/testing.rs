//! What tests draw from.

use antumbra_geometry::{Bounds, DVec3, LightShape};

/// SplitMix64: enough for tests, the same everywhere.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number of `low..high`.
    pub(crate) fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// A point of `[-1, 1]^3`.
    pub(crate) fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.real(-1.0, 1.0)))
    }

    /// A corner of `[-1, 1]^3`, or any point of it.
    pub(crate) fn of_cube(&mut self) -> DVec3 {
        let inside = self.in_cube();
        if self.below(2) == 0 {
            inside.signum()
        } else {
            inside
        }
    }

    /// A point of a box.
    pub(crate) fn in_box(&mut self, bounds: &Bounds) -> DVec3 {
        bounds.center() + 0.5 * bounds.size() * self.in_cube()
    }

    /// A light around a box, in it, far away or at infinity.
    pub(crate) fn light(&mut self, bounds: &Bounds) -> LightShape {
        let size = bounds.size().max_element();
        match self.below(4) {
            0 => LightShape::Direction(self.in_cube()),
            1 => LightShape::Point(bounds.center() + 1e4 * size * self.in_cube()),
            2 => LightShape::Point(self.in_box(bounds)),
            _ => LightShape::Point(bounds.center() + 2.0 * size * self.in_cube()),
        }
    }

    /// The box of a scene: of any size, somewhere, often much longer than wide.
    pub(crate) fn scene(&mut self) -> Bounds {
        let size = 2f64.powf(self.real(-9.0, 9.0));
        let center = size * self.pick(&[0.0, 1.0, 100.0]) * self.in_cube();
        let half = DVec3::from_array(std::array::from_fn(|_| size * self.pick(&[1.0, 0.7, 0.01])));
        Bounds {
            min: center - half,
            max: center + half,
        }
    }
}
