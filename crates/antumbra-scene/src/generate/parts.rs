//! Pieces that several generators put scenes together from.
//!
//! In: a scene, places, a material. Out: one more object, or a few. Invariant: fronts are outside,
//! and vertical and level faces are exactly planar.

use antumbra_geometry::{Cone, DVec3, Sphere};

use crate::{
    defaults::nff_material,
    model::{Color, Object, Scene, Shape},
};

use super::polygon;

/// Adds a matt material and returns its number.
pub(super) fn matt(scene: &mut Scene, color: [f64; 3]) -> usize {
    glossy(scene, color, 0.0)
}

/// Adds a material that mirrors a share of the light, and returns its number.
pub(super) fn glossy(scene: &mut Scene, [r, g, b]: [f64; 3], mirrored: f64) -> usize {
    let material = nff_material([r, g, b, 1.0, mirrored, 40.0, 0.0, 1.0]);
    scene.materials.push(material);
    scene.materials.len() - 1
}

/// Gives the lights of a scene their colors, those of SPD being grey, and its camera a narrower view.
pub(super) fn set_look(scene: &mut Scene, colors: &[[f64; 3]], fov_degrees: f64) {
    for (light, &color) in scene.lights.iter_mut().zip(colors) {
        light.color = Color::from_array(color);
    }
    if let Some(camera) = &mut scene.camera {
        camera.vertical_fov_degrees = fov_degrees;
    }
}

/// Adds a polygon over corners that are counter-clockwise seen from its front.
pub(super) fn face(scene: &mut Scene, corners: &[[f64; 3]], material: usize) {
    let corners = corners.iter().copied().map(DVec3::from_array).collect();
    scene.objects.push(polygon(corners, material));
}

/// Adds a level rectangle, front upwards.
pub(super) fn floor(
    scene: &mut Scene,
    [west, south]: [f64; 2],
    [east, north]: [f64; 2],
    z: f64,
    material: usize,
) {
    let corners = [[west, south], [east, south], [east, north], [west, north]];
    face(scene, &corners.map(|[x, y]| [x, y, z]), material);
}

/// Adds the six faces of a box.
pub(super) fn closed_box(scene: &mut Scene, low: [f64; 3], high: [f64; 3], material: usize) {
    let ([x, y, z], [u, v, w]) = (low, high);
    for corners in [
        [[x, y, z], [x, v, z], [u, v, z], [u, y, z]],
        [[x, y, w], [u, y, w], [u, v, w], [x, v, w]],
        [[x, y, z], [u, y, z], [u, y, w], [x, y, w]],
        [[u, v, z], [x, v, z], [x, v, w], [u, v, w]],
        [[x, v, z], [x, y, z], [x, y, w], [x, v, w]],
        [[u, y, z], [u, v, z], [u, v, w], [u, y, w]],
    ] {
        face(scene, &corners, material);
    }
}

/// Adds a sphere.
pub(super) fn ball(scene: &mut Scene, center: [f64; 3], radius: f64, material: usize) {
    let center = DVec3::from_array(center);
    push(scene, Shape::Sphere(Sphere { center, radius }), material);
}

/// Adds an open tube; radii may differ.
pub(super) fn tube(
    scene: &mut Scene,
    (base, base_radius): ([f64; 3], f64),
    (apex, apex_radius): ([f64; 3], f64),
    material: usize,
) {
    let cone = Cone {
        base: DVec3::from_array(base),
        base_radius,
        apex: DVec3::from_array(apex),
        apex_radius,
        is_closed: false,
    };
    push(scene, Shape::Cone(cone), material);
}

fn push(scene: &mut Scene, shape: Shape, material: usize) {
    scene.objects.push(Object {
        name: String::new(),
        shape,
        material,
    });
}
