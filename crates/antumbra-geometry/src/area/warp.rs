//! From the unit square to round things, area for area.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DVec2, DVec3};

/// Returns a point of the unit disk: squares around the middle become circles around the middle (Shirley and
/// Chiu 1997), so that samples that are well spread over the square are well spread over the disk.
pub(super) fn disk(u: f64, v: f64) -> DVec2 {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if x == 0.0 && y == 0.0 {
        return DVec2::ZERO;
    }
    let (radius, angle) = if x.abs() > y.abs() {
        (x, FRAC_PI_4 * (y / x))
    } else {
        (y, FRAC_PI_2 - FRAC_PI_4 * (x / y))
    };
    // The platform's sines differ in their last bits; libm's do not.
    DVec2::new(radius * libm::cos(angle), radius * libm::sin(angle))
}

/// Returns a unit vector of the cap around +z, uniformly by solid angle: Lambert's equal-area map of a disk of radius
/// `sqrt(2 (1 - cos))`. `height` is `1 - cos` of the cap's half-angle: 1 for the half sphere.
pub(super) fn cap(u: f64, v: f64, height: f64) -> DVec3 {
    let place = disk(u, v) * (2.0 * height).sqrt();
    let square = place.length_squared();
    let flat = place * (1.0 - 0.25 * square).max(0.0).sqrt();
    flat.extend(1.0 - 0.5 * square)
}

/// Returns the weights of a triangle's second and third corner.
pub(super) fn triangle(u: f64, v: f64) -> [f64; 2] {
    let root = u.sqrt();
    [root * (1.0 - v), root * v]
}
