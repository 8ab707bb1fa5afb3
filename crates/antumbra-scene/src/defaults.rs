//! What to take where a file is silent: a camera, a sun, the strength of NFF's lights.
//!
//! In: the box of the scene and which way is up. Out: cameras and lights, world space. Invariant:
//! the same bits on every platform (sines and cosines are `libm`'s).
//!
//! Directions of the compass: with +z up, north is +y and east is +x. For any other up vector
//! that frame is turned the shortest way that takes +z to it; so with +y up, north is -z and
//! east is +x, as in glTF. With -z up, north is -y.

use antumbra_geometry::{Bounds, DVec3};

use crate::model::{Camera, Color, Light, LightKind, Material};

/// The ambient light for formats that know none (OBJ): enough to tell shapes in shadow.
pub const AMBIENT: Color = Color::splat(0.2);

/// Returns SPD's suggestion for the intensity of each of `light_count` NFF lights without a
/// color, and of the ambient term: `sqrt(n) / (2 n)`; without any light, as for one.
pub fn nff_intensity(light_count: usize) -> f64 {
    let n = light_count.max(1) as f64;
    n.sqrt() / (2.0 * n)
}

/// Returns what the numbers after NFF's `f` mean: red, green, blue, Kd, Ks, shine, T and index of
/// refraction, none negative. Ks is the weight of highlight and mirror, both white, as in SPD's
/// test procedure; the index counts only where T does not vanish.
pub(crate) fn nff_material(numbers: [f64; 8]) -> Material {
    let [red, green, blue, kd, ks, shininess, transmittance, ior] = numbers;
    Material {
        name: String::new(),
        diffuse: kd * Color::new(red, green, blue),
        specular: Color::splat(ks),
        shininess,
        reflection: Color::splat(ks),
        transmission: Color::splat(transmittance),
        ior: if transmittance > 0.0 && ior > 0.0 {
            ior
        } else {
            1.0
        },
        emission: Color::ZERO,
        ..Material::default()
    }
}

/// Color that a ray sees that hits nothing, for formats that say nothing about it (OBJ, PLY, STL, glTF):
/// a quiet grey-blue, sRGB (166, 176, 189), against which dark and bright things stand out.
pub const SKY: Color = Color::new(0.38, 0.43, 0.51);

/// How much of the picture's width or height the box takes in the view of [`frame_camera`].
pub const FRAMED_SHARE: f64 = 0.9;

/// Returns [`frame_camera_for`] a square picture; any wider one shows the whole box too.
pub fn frame_camera(bounds: &Bounds, up: DVec3) -> Camera {
    frame_camera_for(bounds, up, 1.0)
}

/// Returns a camera that sees the whole box from the south-south-east, 25 degrees above it: a
/// three-quarter view. Full vertical field of view 40 degrees. In a picture `aspect` times as wide
/// as high (above 0), the box's eight corners take [`FRAMED_SHARE`] of the height or of the
/// width, less of the other, and lie in the middle. An empty box, or one that is a point, gets a
/// view of its surroundings.
///
/// `up` is any vector but zero, world space.
pub fn frame_camera_for(bounds: &Bounds, up: DVec3, aspect: f64) -> Camera {
    const VERTICAL_FOV_DEGREES: f64 = 40.0;
    let up = unit(up);
    let towards_eye = compass(150.0, 25.0, up);
    let right = unit(up.cross(towards_eye));
    let above = towards_eye.cross(right);

    let bounds = if bounds.is_empty() {
        Bounds::of_points([DVec3::ZERO])
    } else {
        *bounds
    };
    let center = bounds.center();
    let (sine, cosine) = sin_cos_degrees(VERTICAL_FOV_DEGREES / 2.0);
    let tangent = FRAMED_SHARE * sine / cosine;
    // Along each axis of the picture: a corner at `x`, and `w` towards the eye, is inside if
    // |x - eye_x| <= tangent (distance - w). So x + tangent w has to be at most
    // eye_x + tangent distance, and x - tangent w at least eye_x - tangent distance.
    let offsets = bounds.corners().map(|corner| corner - center);
    let fit = |axis: DVec3, tangent: f64| {
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
        for offset in offsets {
            let (x, w) = (offset.dot(axis), offset.dot(towards_eye));
            most = most.max(x + tangent * w);
            least = least.min(x - tangent * w);
        }
        let distance = 0.5 * (most - least) / tangent;
        (0.5 * (most + least), distance)
    };
    let axes = [(right, aspect * tangent), (above, tangent)];
    let distance = axes
        .map(|(axis, tangent)| fit(axis, tangent).1)
        .into_iter()
        .fold(0.0, f64::max);
    // In the middle is what the narrowest picture that holds it shows from that distance.
    let shifts = axes.map(|(axis, widest)| {
        let (mut low, mut high) = (0.0, widest);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if fit(axis, middle).1 <= distance {
                high = middle;
            } else {
                low = middle;
            }
        }
        fit(axis, high).0 * axis
    });
    let at = center + shifts[0] + shifts[1];
    // A point has no size to go by. Far from the origin the eye must still differ from `at`.
    let smallest = if distance > 0.0 { 0.0 } else { 1.0 };
    let distance = distance
        .max(smallest)
        .max(1e-6 * bounds.largest_coordinate());
    Camera {
        eye: at + distance * towards_eye,
        at,
        up,
        vertical_fov_degrees: VERTICAL_FOV_DEGREES,
        resolution: None,
    }
}

/// Returns a white sun in the south-west, 45 degrees high: to the left behind [`frame_camera`]'s
/// eye, so that what is seen is mostly lit and shadows fall to the right.
pub fn default_sun(up: DVec3) -> Light {
    sun(225.0, 45.0, up)
}

/// Returns a white directional light of intensity 0.8.
///
/// `azimuth_degrees` is where the sun stands, clockwise from north as seen from above;
/// `elevation_degrees` its height over the horizon; `up` any vector but zero, world space. The
/// module header says which way is north.
pub fn sun(azimuth_degrees: f64, elevation_degrees: f64, up: DVec3) -> Light {
    Light {
        name: "sun".into(),
        kind: LightKind::Directional {
            towards_light: towards_sun(azimuth_degrees, elevation_degrees, up),
        },
        color: Color::splat(0.8),
        falls_off: false,
    }
}

/// Returns the unit vector towards a sun, as [`sun`] places it.
pub fn towards_sun(azimuth_degrees: f64, elevation_degrees: f64, up: DVec3) -> DVec3 {
    compass(azimuth_degrees, elevation_degrees, unit(up))
}

/// Returns the unit vector towards a point of the sky. `up` is a unit vector.
fn compass(azimuth_degrees: f64, elevation_degrees: f64, up: DVec3) -> DVec3 {
    let (east, north) = east_and_north(up);
    let (azimuth_sine, azimuth_cosine) = sin_cos_degrees(azimuth_degrees);
    let (elevation_sine, elevation_cosine) = sin_cos_degrees(elevation_degrees);
    let along_ground = azimuth_sine * east + azimuth_cosine * north;
    elevation_cosine * along_ground + elevation_sine * up
}

/// Returns the images of +x and +y under the shortest rotation that takes +z to the unit vector
/// `up` (Rodrigues' formula with axis `z x up`).
fn east_and_north(up: DVec3) -> (DVec3, DVec3) {
    let (a, b, c) = (up.x, up.y, up.z);
    if 1.0 + c <= f64::EPSILON {
        // Half a turn about +x.
        return (DVec3::X, DVec3::NEG_Y);
    }
    let k = 1.0 / (1.0 + c);
    (
        DVec3::new(1.0 - a * a * k, -a * b * k, -a),
        DVec3::new(-a * b * k, 1.0 - b * b * k, -b),
    )
}

/// Returns sine and cosine of an angle in degrees; exact at multiples of 90 degrees, so that a
/// sun due south stands in no neighbouring plane by a rounding error.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turned = degrees % 360.0;
    let quarters = (turned / 90.0).round();
    let rest = (turned - 90.0 * quarters).to_radians();
    let (sine, cosine) = (libm::sin(rest), libm::cos(rest));
    match (quarters as i64).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Returns the vector at length one; scaled first, so that very long and very short ones work.
fn unit(vector: DVec3) -> DVec3 {
    let scaled = vector / vector.abs().max_element();
    scaled / scaled.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn towards(azimuth: f64, elevation: f64, up: DVec3) -> DVec3 {
        match sun(azimuth, elevation, up).kind {
            LightKind::Directional { towards_light } => towards_light,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_compass_is_as_documented() {
        assert_eq!(towards(0.0, 0.0, DVec3::Z), DVec3::Y);
        assert_eq!(towards(90.0, 0.0, DVec3::Z), DVec3::X);
        assert_eq!(towards(180.0, 0.0, DVec3::Z), DVec3::NEG_Y);
        assert_eq!(towards(-90.0, 0.0, DVec3::Z), DVec3::NEG_X);
        assert_eq!(towards(0.0, 0.0, DVec3::Y), DVec3::NEG_Z);
        assert_eq!(towards(90.0, 0.0, DVec3::Y), DVec3::X);
        assert_eq!(towards(450.0, 0.0, 7.0 * DVec3::Y), DVec3::X);
        assert_eq!(towards(0.0, 0.0, DVec3::NEG_Z), DVec3::NEG_Y);
        for up in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Z] {
            assert_eq!(towards(33.0, 90.0, up), up);
        }
        assert!((towards(0.0, 30.0, DVec3::Z).z - 0.5).abs() < 1e-15);
    }

    #[test]
    fn the_camera_sees_every_corner() {
        for (min, max) in [
            ([0.0; 3], [1.0; 3]),
            ([-5.0, 0.0, 2.0], [5.0, 0.0, 2.5]),
            ([1e20, 1e20, 1e20], [1e20, 1e20, 2e20]),
            ([-1e-30; 3], [1e-30; 3]),
        ] {
            let bounds = Bounds {
                min: DVec3::from_array(min),
                max: DVec3::from_array(max),
            };
            for up in [DVec3::Y, DVec3::Z, DVec3::new(-0.8, -0.8, 0.8)] {
                let camera = frame_camera(&bounds, up);
                let forward = unit(camera.at - camera.eye);
                let right = unit(forward.cross(camera.up));
                let above = right.cross(forward);
                let half = (camera.vertical_fov_degrees / 2.0).to_radians().tan();
                for corner in bounds.corners() {
                    let offset = corner - camera.eye;
                    let depth = offset.dot(forward);
                    assert!(depth > 0.0);
                    assert!(offset.dot(right).abs() <= half * depth);
                    assert!(offset.dot(above).abs() <= half * depth);
                }
                assert!((camera.eye - camera.at).dot(up) > 0.0, "from above");
            }
        }
    }

    /// Returns how much of the picture's width and height the box's corners take, and the middle
    /// of what they take, in halves of the picture.
    fn taken(bounds: &Bounds, camera: &Camera, aspect: f64) -> [[f64; 2]; 2] {
        let forward = unit(camera.at - camera.eye);
        let right = unit(forward.cross(camera.up));
        let above = right.cross(forward);
        let half = (camera.vertical_fov_degrees / 2.0).to_radians().tan();
        [(right, half * aspect), (above, half)].map(|(axis, half)| {
            let places = bounds.corners().map(|corner| {
                let offset = corner - camera.eye;
                offset.dot(axis) / (half * offset.dot(forward))
            });
            let [least, most] = [
                places.into_iter().fold(f64::INFINITY, f64::min),
                places.into_iter().fold(f64::NEG_INFINITY, f64::max),
            ];
            [0.5 * (most - least), 0.5 * (most + least)]
        })
    }

    #[test]
    fn the_box_fills_the_picture() {
        for (min, max) in [
            ([0.0; 3], [1.0; 3]),
            ([-5.0, -90.0, 2.0], [5.0, 90.0, 2.5]),
            ([-1.0, -1.0, 0.0], [1.0, 1.0, 70.0]),
            ([1e6, 0.0, 0.0], [1.1e6, 1e5, 1e5]),
        ] {
            let bounds = Bounds {
                min: DVec3::from_array(min),
                max: DVec3::from_array(max),
            };
            for (up, aspect) in [(DVec3::Y, 1.0), (DVec3::Z, 16.0 / 9.0), (DVec3::Z, 0.5)] {
                let camera = frame_camera_for(&bounds, up, aspect);
                let [[width, middle_x], [height, middle_y]] = taken(&bounds, &camera, aspect);
                let case = format!("{min:?} {max:?} {up} {aspect}: {width} x {height}");
                // The side that is tight is filled exactly, and the other not beyond.
                assert!((width.max(height) - FRAMED_SHARE).abs() < 1e-6, "{case}");
                assert!(middle_x.abs().max(middle_y.abs()) < 1e-6, "{case}");
            }
        }
    }

    #[test]
    fn boxes_without_a_size_still_get_a_camera() {
        let far = Bounds::of_points([DVec3::splat(1e25)]);
        for bounds in [Bounds::EMPTY, Bounds::of_points([DVec3::ZERO]), far] {
            let camera = frame_camera(&bounds, DVec3::Z);
            assert!(camera.eye.is_finite() && camera.at.is_finite());
            assert_ne!(camera.eye, camera.at);
        }
    }

    #[test]
    fn nff_lights_are_as_strong_as_spd_suggests() {
        assert_eq!(nff_intensity(0), 0.5);
        assert_eq!(nff_intensity(1), 0.5);
        assert_eq!(nff_intensity(4), 0.25);
    }
}
