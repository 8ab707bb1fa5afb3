//! Numbers, directions and small moves from a seed.
//!
//! In: a seed and a number. Out: a stream that is a pure function of both.

use std::f64::consts::TAU;

use antumbra_geometry::{Bounds, DVec3};
use antumbra_render::sampler::uniform;

/// A stream of numbers in `0..1`.
pub(super) struct Random {
    seed: u64,
    number: u64,
    drawn: u64,
}

impl Random {
    pub(super) fn new(seed: u64, number: u64) -> Self {
        Self {
            seed,
            number,
            drawn: 0,
        }
    }

    pub(super) fn draw(&mut self) -> f64 {
        self.drawn += 1;
        uniform(&[self.seed, self.number, self.drawn])
    }

    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.draw() * count as f64) as usize).min(count.saturating_sub(1))
    }

    pub(super) fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub(super) fn in_box(&mut self, bounds: &Bounds) -> DVec3 {
        bounds.min + bounds.size() * DVec3::new(self.draw(), self.draw(), self.draw())
    }

    pub(super) fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.draw() - 1.0;
        let (sine, cosine) = libm::sincos(TAU * self.draw());
        let across = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(across * cosine, across * sine, z)
    }

    /// Returns a unit vector at a right angle to `axis`.
    pub(super) fn around(&mut self, axis: DVec3) -> Option<DVec3> {
        let unit = (axis / axis.abs().max_element()).try_normalize()?;
        let (first, second) = unit.any_orthonormal_pair();
        let (sine, cosine) = libm::sincos(TAU * self.draw());
        Some(cosine * first + sine * second)
    }

    /// Returns a power of ten between two, spread evenly over the exponents.
    pub(super) fn power_of_ten(&mut self, low: f64, high: f64) -> f64 {
        libm::exp10(low + self.draw() * (high - low))
    }

    /// Returns the point with every coordinate moved by at most two neighbouring numbers.
    pub(super) fn by_ulps(&mut self, point: DVec3) -> DVec3 {
        DVec3::from_array(point.to_array().map(|x| {
            let steps = self.below(5) as i32 - 2;
            next(x, steps)
        }))
    }
}

/// Returns the number so many numbers further up.
pub(super) fn next(x: f64, steps: i32) -> f64 {
    (0..steps.abs()).fold(x, |x, _| {
        if steps > 0 {
            x.next_up()
        } else {
            x.next_down()
        }
    })
}

/// Returns the point with every coordinate moved to the neighbouring number towards `aim`.
pub(super) fn next_towards(point: DVec3, aim: DVec3) -> DVec3 {
    let mut moved = point;
    for axis in 0..3 {
        let steps = (aim[axis] > point[axis]) as i32 - (aim[axis] < point[axis]) as i32;
        moved[axis] = next(point[axis], steps);
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_are_functions_of_seed_and_number() {
        let first = |seed, number| Random::new(seed, number).draw();
        assert_eq!(first(1, 2), first(1, 2));
        assert_ne!(first(1, 2), first(1, 3));
        assert_ne!(first(1, 2), first(2, 2));
    }

    #[test]
    fn moves_are_small_and_stop_where_they_aim() {
        assert_eq!(next(1.0, -2), 1.0 - f64::EPSILON);
        let point = DVec3::new(1.0, 2.0, 3.0);
        let moved = next_towards(point, DVec3::new(9.0, 2.0, -9.0));
        assert!(moved.x > 1.0 && moved.y == 2.0 && moved.z < 3.0);
        let moved = Random::new(3, 4).by_ulps(point);
        assert!((moved - point).abs().max_element() < 1e-14);
    }
}
