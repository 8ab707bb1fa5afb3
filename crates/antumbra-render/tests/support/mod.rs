//! Shared by the tests: scenes of squares, a camera that looks straight down, a shot.

#![allow(dead_code, reason = "each file of tests uses some of it")]

use std::path::Path;

use antumbra::{IndexOptions, Method};
use antumbra_geometry::DVec3;
use antumbra_render::camera::View;
use antumbra_render::film::{RenderSettings, Rendered, Watch, render};
use antumbra_render::image_file::srgb_byte;
use antumbra_render::prepare::Prepared;
use antumbra_scene::model::{Camera, Corner, Filter, Mesh, Object, Scene, Shape, Texture, Wrap};
use antumbra_task::Task;

pub(crate) const ALL_METHODS: [Method; 6] = [
    Method::Naive,
    Method::Auto,
    Method::Voxel,
    Method::Voxel1990,
    Method::Grid,
    Method::Bvh,
];

pub(crate) const METHODS: [Method; 3] = [Method::Voxel1990, Method::Grid, Method::Naive];

pub(crate) fn object(shape: Shape, material: usize) -> Object {
    Object {
        name: String::new(),
        shape,
        material,
    }
}

/// A square in the plane at height `z`, its front above.
pub(crate) fn square(half: f64, z: f64) -> Mesh {
    let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, z);
    Mesh {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        corners: (0..4).map(Corner::at).collect(),
        face_ends: vec![4],
        ..Mesh::default()
    }
}

/// [`square`], with its whole texture once on it: upper left in the picture of [`camera`].
pub(crate) fn square_with_uvs(half: f64, z: f64) -> Mesh {
    let mut mesh = square(half, z);
    mesh.uvs = vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    for (uv, corner) in (0..).zip(&mut mesh.corners) {
        corner.uv = uv;
    }
    mesh
}

/// White texels; those whose numbers have an odd sum are holes.
pub(crate) fn checker(count: u32) -> Texture {
    let texel = |i: u32| {
        let is_hole = (i % count + i / count) % 2 == 1;
        [255, 255, 255, if is_hole { 0 } else { 255 }]
    };
    Texture {
        name: String::new(),
        width: count,
        height: count,
        texels: (0..count * count).map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }
}

/// A camera that looks straight down from a height, with +y up in the picture; at height `h` it
/// sees the floor from `-h` to `h` over the picture's height.
pub(crate) fn camera(height: f64) -> Camera {
    Camera {
        eye: DVec3::new(0.0, 0.0, height),
        at: DVec3::ZERO,
        up: DVec3::Y,
        vertical_fov_degrees: 90.0,
        resolution: None,
    }
}

pub(crate) fn prepared(scene: Scene, method: Method) -> Prepared {
    let options = IndexOptions {
        method,
        ..IndexOptions::default()
    };
    Prepared::new(scene, &options).unwrap()
}

pub(crate) fn shot(
    prepared: &Prepared,
    camera: &Camera,
    size: [u32; 2],
    settings: RenderSettings,
) -> Rendered {
    let view = View::new(camera, size).unwrap();
    let task = Task::default();
    let watch = Watch {
        task: &task,
        progress: &|_| {},
    };
    render(prepared, &view, &settings, watch)
}

/// A picture's bytes, as a PNG has them.
pub(crate) fn bytes(rendered: &Rendered) -> Vec<u8> {
    let channels = rendered.picture.pixels.iter().flatten();
    channels
        .map(|&channel| srgb_byte(f64::from(channel)))
        .collect()
}

/// Compares a picture with the one that was looked at. `ANTUMBRA_BLESS=1` writes it instead.
pub(crate) fn assert_golden(name: &str, rendered: &Rendered) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"));
    let [width, height] = rendered.picture.size;
    let found = bytes(rendered);
    if std::env::var_os("ANTUMBRA_BLESS").is_some() {
        image::save_buffer(&path, &found, width, height, image::ColorType::Rgb8).unwrap();
        return;
    }
    let expected = image::open(&path)
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        .to_rgb8();
    assert_eq!(expected.dimensions(), (width, height));
    let differing = found.iter().zip(expected.as_raw()).filter(|(a, b)| a != b);
    assert_eq!(differing.count(), 0, "bytes of {name} that differ");
}
