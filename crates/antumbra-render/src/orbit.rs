//! The cameras of a fly-around.
//!
//! In: a camera and a number of frames. Out: that many cameras on a circle. The scene stands
//! still, so the shadow index is prepared once for all of them.

use antumbra_geometry::DVec3;
use antumbra_scene::model::Camera;

use crate::vector::unit;

/// Returns the camera of frame `frame` of `frame_count`: the eye turned about the axis `up`
/// through `at`, counter-clockwise seen from above, once round in all frames. Frame 0 is the
/// camera itself, bit for bit.
pub fn camera_of_frame(camera: &Camera, frame: u32, frame_count: u32) -> Camera {
    let Some(axis) = unit(camera.up).filter(|_| frame > 0) else {
        return *camera;
    };
    let angle = std::f64::consts::TAU * f64::from(frame) / f64::from(frame_count.max(1));
    Camera {
        eye: camera.at + turned(camera.eye - camera.at, axis, angle),
        ..*camera
    }
}

/// Turns a vector about a unit axis (Rodrigues).
fn turned(vector: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sine, cosine) = libm::sincos(angle);
    vector * cosine + axis.cross(vector) * sine + axis * (axis.dot(vector) * (1.0 - cosine))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_of_the_way_round_about_z() {
        let camera = Camera {
            eye: DVec3::new(3.0, 1.0, 2.0),
            at: DVec3::new(1.0, 1.0, 1.0),
            up: DVec3::new(0.0, 0.0, 5.0),
            vertical_fov_degrees: 45.0,
            resolution: None,
        };
        assert_eq!(camera_of_frame(&camera, 0, 4), camera);
        let quarter = camera_of_frame(&camera, 1, 4);
        assert!(
            (quarter.eye - DVec3::new(1.0, 3.0, 2.0)).length() < 1e-15,
            "{}",
            quarter.eye
        );
        assert_eq!((quarter.at, quarter.up), (camera.at, camera.up));
        let half = camera_of_frame(&camera, 2, 4);
        assert!(
            (half.eye - DVec3::new(-1.0, 1.0, 2.0)).length() < 1e-15,
            "{}",
            half.eye
        );
    }
}
