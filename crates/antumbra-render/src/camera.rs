//! Eye rays.
//!
//! In: a `Camera` and a picture size. Out: rays through points of the picture. Right-handed:
//! picture right is `forward x up`. The field of view is the full angle over the picture's
//! height; pixels are square, so a picture that is not square sees `width / height` times the
//! tangent across. Rays through pixel corners hit the outermost samples exactly on the sides of
//! the view frustum, as the SPD test procedure asks.

use antumbra_geometry::{DVec3, Ray, Short};
use antumbra_scene::model::Camera;

use crate::vector::unit;

/// Why a camera sees nothing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// Eye and aim coincide or are not finite.
    #[error("the camera's eye and the point it looks at must be finite and different")]
    NoDirection,
    /// The up vector is zero, not finite or along the view direction.
    #[error("the camera's up vector must be finite, not zero and not along the view direction")]
    BadUp,
    /// The angle is out of range.
    #[error("the field of view is {} degrees; it must be above 0 and below 180", Short(*.0))]
    BadAngle(f64),
}

/// A camera made ready for a picture size.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    tangent: f64,
    size: [u32; 2],
}

impl View {
    /// Prepares a camera for a picture of `size` pixels (width, height; at least 1 each).
    ///
    /// # Errors
    /// The camera has no direction, no up, or an impossible angle.
    pub fn new(camera: &Camera, size: [u32; 2]) -> Result<Self, CameraError> {
        if !camera.eye.is_finite() {
            return Err(CameraError::NoDirection);
        }
        let forward = unit(camera.at - camera.eye).ok_or(CameraError::NoDirection)?;
        let across = forward.cross(unit(camera.up).ok_or(CameraError::BadUp)?);
        // Below this sine, what is left of two unit vectors' cross product is rounding.
        if across.length() < 1e-12 {
            return Err(CameraError::BadUp);
        }
        let right = unit(across).ok_or(CameraError::BadUp)?;
        let angle = camera.vertical_fov_degrees;
        let tangent = libm::tan(0.5 * angle.to_radians());
        if !(angle > 0.0 && angle < 180.0 && tangent.is_finite() && tangent > 0.0) {
            return Err(CameraError::BadAngle(angle));
        }
        let size = size.map(|n| n.max(1));
        Ok(Self {
            eye: camera.eye,
            forward,
            right,
            up: right.cross(forward),
            tangent,
            size,
        })
    }

    /// Returns the picture's width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Returns the ray through a point of the picture, in pixels from the top left corner: pixel
    /// `(i, j)` has its centre at `(i + 0.5, j + 0.5)` and its corners at whole numbers.
    pub fn ray(&self, across_in_pixels: f64, down_in_pixels: f64) -> Ray {
        let [width, height] = self.size.map(f64::from);
        let x = self.tangent * (width / height) * (2.0 * across_in_pixels / width - 1.0);
        let y = -(self.tangent * (2.0 * down_in_pixels / height - 1.0));
        let direction = self.forward + x * self.right + y * self.up;
        Ray {
            origin: self.eye,
            direction,
            leaves: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            eye: DVec3::new(0.0, -5.0, 0.0),
            at: DVec3::ZERO,
            up: DVec3::Z,
            vertical_fov_degrees: 90.0,
            resolution: None,
        }
    }

    #[test]
    fn right_is_forward_cross_up_and_rows_run_down() {
        let view = View::new(&camera(), [4, 4]).unwrap();
        let top_left = view.ray(0.0, 0.0).direction;
        assert!(
            (top_left - DVec3::new(-1.0, 1.0, 1.0)).length() < 1e-15,
            "{top_left}"
        );
        let bottom_right = view.ray(4.0, 4.0).direction;
        assert!(
            (bottom_right - DVec3::new(1.0, 1.0, -1.0)).length() < 1e-15,
            "{bottom_right}"
        );
        assert_eq!(view.ray(2.0, 2.0).direction, DVec3::Y);
    }

    #[test]
    fn the_angle_is_vertical_and_pixels_are_square() {
        let view = View::new(&camera(), [8, 4]).unwrap();
        let corner = view.ray(8.0, 0.0).direction;
        assert!(
            (corner - DVec3::new(2.0, 1.0, 1.0)).length() < 1e-15,
            "{corner}"
        );
    }

    #[test]
    fn cameras_without_a_view_are_refused() {
        let refused = |change: fn(&mut Camera)| {
            let mut bad = camera();
            change(&mut bad);
            View::new(&bad, [4, 4]).unwrap_err()
        };
        assert_eq!(refused(|c| c.at = c.eye), CameraError::NoDirection);
        assert_eq!(refused(|c| c.eye.x = f64::NAN), CameraError::NoDirection);
        assert_eq!(
            refused(|c| c.eye.x = f64::INFINITY),
            CameraError::NoDirection
        );
        assert_eq!(refused(|c| c.up = DVec3::ZERO), CameraError::BadUp);
        assert_eq!(refused(|c| c.up = DVec3::Y), CameraError::BadUp);
        assert_eq!(
            refused(|c| c.vertical_fov_degrees = 180.0),
            CameraError::BadAngle(180.0)
        );
        assert_eq!(
            refused(|c| c.vertical_fov_degrees = 0.0),
            CameraError::BadAngle(0.0)
        );
    }
}
