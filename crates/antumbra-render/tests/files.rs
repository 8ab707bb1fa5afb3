//! Exposure and files of small scenes: OpenEXR read back, masks as PNG.

mod support;

use std::fs;
use std::path::Path;

use antumbra_geometry::{DVec3, Sphere};
use antumbra_render::aov::{Aovs, DECIDED_LAYER, DecidedBy};
use antumbra_render::exr_file::{BEAUTY, write_exr};
use antumbra_render::film::{RenderSettings, Rendered, Sampling};
use antumbra_render::image_file::write_mask_png;
use antumbra_scene::model::{Alpha, Color, Light, LightKind, Material, Scene, Shape};
use exr::prelude::{
    AnyChannels, FlatSamples, Image, Layer, ReadChannels as _, ReadLayers as _, read,
};
use support::{METHODS, camera, checker, object, prepared, shot, square, square_with_uvs};

const SIZE: [u32; 2] = [21, 13];

/// Two lights of one name over a floor that leaves a border, a ball and a sheet with holes.
fn scene(brightness: f64) -> Scene {
    let light = |kind| Light {
        name: "lamp".into(),
        kind,
        color: Color::splat(brightness),
        falls_off: false,
    };
    Scene {
        materials: vec![
            Material::default(),
            Material {
                diffuse_texture: Some(0),
                alpha: Alpha::Mask { cutoff: 0.5 },
                ..Material::default()
            },
        ],
        textures: vec![checker(4)],
        objects: vec![
            object(Shape::Mesh(square(4.0, 0.0)), 0),
            object(
                Shape::Sphere(Sphere {
                    center: DVec3::new(-2.0, 0.0, 1.0),
                    radius: 0.7,
                }),
                0,
            ),
            object(Shape::Mesh(square_with_uvs(1.0, 2.0)), 1),
        ],
        lights: vec![
            light(LightKind::Point {
                position: DVec3::new(1.0, 2.0, 5.0),
            }),
            light(LightKind::Directional {
                towards_light: DVec3::new(-1.0, 1.0, 2.0),
            }),
        ],
        ..Scene::default()
    }
}

fn settings() -> RenderSettings {
    RenderSettings {
        sampling: Sampling::Stratified { samples: 2 },
        aovs: Aovs {
            shadow: true,
            decided: true,
            fog: false,
        },
        ..RenderSettings::default()
    }
}

fn rendered(scene: Scene) -> Rendered {
    shot(&prepared(scene, METHODS[0]), &camera(6.0), SIZE, settings())
}

#[test]
fn automatic_exposure_goes_with_the_lights_and_not_with_the_background() {
    let expected = rendered(scene(1.0)).metering.stops();
    assert!(expected.is_finite());
    let brighter = rendered(scene(4.0)).metering.stops();
    assert!((brighter - (expected - 2.0)).abs() < 1e-6, "{brighter}");
    let sky = Scene {
        background: Color::splat(100.0),
        ..scene(1.0)
    };
    // Only pixels whose samples all miss are background; those of the border are not.
    let mut one = settings();
    one.sampling = Sampling::Stratified { samples: 1 };
    let of = |scene| {
        shot(&prepared(scene, METHODS[1]), &camera(6.0), SIZE, one)
            .metering
            .stops()
    };
    assert_eq!(of(sky), of(scene(1.0)));
    let empty = Scene {
        objects: Vec::new(),
        ..scene(1.0)
    };
    assert_eq!(of(empty), 0.0);
}

#[test]
fn layers_are_shares_that_add_up() {
    let rendered = rendered(scene(1.0));
    let names: Vec<_> = rendered.layers.iter().map(|l| l.name.as_str()).collect();
    assert_eq!(names, ["shadow.lamp", "shadow.lamp-2", DECIDED_LAYER]);
    let decided = &rendered.layers[2].channels;
    for pixel in 0..rendered.picture.pixels.len() {
        let sum: f32 = decided.iter().map(|(_, shares)| shares[pixel]).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
        let no_hit = decided[DecidedBy::NoHit as usize].1[pixel];
        for mask in &rendered.layers[..2] {
            let lit = mask.channels[0].1[pixel];
            assert!(lit >= no_hit && lit <= 1.0);
        }
    }
    // Nothing was asked twice.
    let plain = RenderSettings {
        aovs: Aovs::default(),
        ..settings()
    };
    let without = shot(&prepared(scene(1.0), METHODS[0]), &camera(6.0), SIZE, plain);
    assert_eq!(without.tally, rendered.tally);
    assert!(without.picture == rendered.picture && without.layers.is_empty());
}

/// Reads all parts, with all channels as they are stored.
fn read_parts(path: &Path) -> Vec<Layer<AnyChannels<FlatSamples>>> {
    let image: Image<_> = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap();
    image.layer_data.to_vec()
}

#[test]
fn openexr_holds_every_part_channel_and_number() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let rendered = rendered(scene(1000.0));
    write_exr(&path, &rendered.picture, &rendered.layers).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

    let parts = read_parts(&path);
    let name = |layer: &Layer<_>| layer.attributes.layer_name.clone().unwrap().to_string();
    let names: Vec<_> = parts.iter().map(name).collect();
    assert_eq!(
        names,
        [BEAUTY, "shadow.lamp", "shadow.lamp-2", DECIDED_LAYER]
    );
    for part in &parts {
        assert_eq!([part.size.0, part.size.1], SIZE.map(|n| n as usize));
        let names = part.channel_data.list.iter().map(|c| c.name.to_string());
        assert!(names.is_sorted());
    }

    let values = |part: usize, name: &str| -> Vec<f32> {
        let list = &parts[part].channel_data.list;
        let channel = list.iter().find(|c| c.name.to_string() == name).unwrap();
        assert!(matches!(channel.sample_data, FlatSamples::F32(_)));
        channel.sample_data.values_as_f32().collect()
    };
    for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
        let expected = rendered.picture.pixels.iter().map(|pixel| pixel[i]);
        assert!(values(0, name).into_iter().eq(expected), "{name}");
    }
    assert!(values(0, "R").iter().any(|&red| red > 100.0), "no exposure");
    for (number, layer) in (1..).zip(&rendered.layers) {
        assert_eq!(parts[number].channel_data.list.len(), layer.channels.len());
        for (name, expected) in &layer.channels {
            assert_eq!(&values(number, name), expected, "{name}");
        }
    }
}

#[test]
fn equal_pictures_are_equal_files_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let bytes_on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let rendered = rendered(scene(1.0));
            write_exr(&path, &rendered.picture, &rendered.layers).unwrap();
        });
        fs::read(&path).unwrap()
    };
    let expected = bytes_on(1);
    assert!(bytes_on(2) == expected && bytes_on(7) == expected);
}

#[test]
fn a_mask_is_written_without_a_transfer_function() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mask.png");
    write_mask_png(&path, [4, 1], &[0.0, 0.5, 1.0, 2.0]).unwrap();
    let read = image::open(&path).unwrap();
    assert_eq!(read.color(), image::ColorType::L8);
    assert_eq!(read.as_bytes(), [0, 128, 255, 255]);

    let nowhere = folder.path().join("missing/picture.exr");
    let rendered = rendered(scene(1.0));
    let error = write_exr(&nowhere, &rendered.picture, &[]).unwrap_err();
    assert!(error.to_string().contains("picture.exr"), "{error}");
}
