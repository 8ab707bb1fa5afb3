//! Textures, holes and blending in small scenes: what is seen, what is shadowed, what is counted.

mod support;

use antumbra::{LightId, Method};
use antumbra_geometry::DVec3;
use antumbra_render::aov::Aovs;
use antumbra_render::film::{RenderSettings, Sampling, Show};
use antumbra_render::integrator::MAX_PASSED;
use antumbra_scene::model::{
    Alpha, Color, Filter, Light, LightKind, Material, Scene, Shape, Texture, Wrap,
};
use support::{METHODS, camera, checker, object, prepared, shot, square, square_with_uvs};

/// What is seen is what the surface sends out by itself.
fn glowing(color: Color) -> Material {
    Material {
        diffuse: Color::ZERO,
        emission: color,
        ..Material::default()
    }
}

fn sun(towards_light: DVec3) -> Light {
    Light {
        name: "sun".into(),
        kind: LightKind::Directional { towards_light },
        color: Color::ONE,
        falls_off: false,
    }
}

/// A floor at height 0 and a sheet at height 3 with 4 x 4 texels, every other one a hole; the sun
/// is straight above.
fn sheet_over_floor(alpha: Alpha) -> Scene {
    Scene {
        materials: vec![
            Material::default(),
            Material {
                diffuse_texture: Some(0),
                alpha,
                ..Material::default()
            },
        ],
        textures: vec![checker(4)],
        objects: vec![
            object(Shape::Mesh(square(8.0, 0.0)), 0),
            object(Shape::Mesh(square_with_uvs(1.0, 3.0)), 1),
        ],
        lights: vec![sun(DVec3::Z)],
        ..Scene::default()
    }
}

const HALF: Alpha = Alpha::Mask { cutoff: 0.5 };

fn with_layers() -> RenderSettings {
    RenderSettings {
        aovs: Aovs {
            shadow: true,
            decided: true,
            fog: false,
        },
        ..RenderSettings::default()
    }
}

#[test]
fn a_texture_lies_as_its_coordinates_say() {
    let quarters = Texture {
        name: String::new(),
        width: 2,
        height: 2,
        texels: vec![
            [255, 0, 0, 255],
            [0, 255, 0, 255],
            [0, 0, 255, 255],
            [255, 255, 255, 255],
        ],
        wrap: [Wrap::ClampToEdge; 2],
        filter: Filter::Nearest,
    };
    let scene = Scene {
        materials: vec![Material {
            diffuse: Color::new(0.5, 0.25, 1.0),
            diffuse_texture: Some(0),
            ..Material::default()
        }],
        textures: vec![quarters],
        objects: vec![object(Shape::Mesh(square_with_uvs(1.0, 0.0)), 0)],
        ambient: Color::ONE,
        ..Scene::default()
    };
    let rendered = shot(
        &prepared(scene, Method::Grid),
        &camera(2.0),
        [4, 4],
        RenderSettings::default(),
    );
    let at = |column: usize, row: usize| rendered.picture.pixels[4 * row + column];
    assert_eq!(at(1, 1), [0.5, 0.0, 0.0]);
    assert_eq!(at(2, 1), [0.0, 0.25, 0.0]);
    assert_eq!(at(1, 2), [0.0, 0.0, 1.0]);
    assert_eq!(at(2, 2), [0.5, 0.25, 1.0]);
}

#[test]
fn colors_of_vertices_are_shown_between_them() {
    let mut mesh = square_with_uvs(1.0, 0.0);
    // Red grows from left to right; green is full, blue absent.
    mesh.colors = [0.0, 1.0, 1.0, 0.0]
        .map(|red| [red, 1.0, 0.0, 1.0])
        .to_vec();
    let scene = Scene {
        materials: vec![Material {
            diffuse: Color::new(1.0, 0.5, 1.0),
            ..Material::default()
        }],
        objects: vec![object(Shape::Mesh(mesh), 0)],
        ambient: Color::ONE,
        ..Scene::default()
    };
    let rendered = shot(
        &prepared(scene, Method::Grid),
        &camera(2.0),
        [4, 4],
        RenderSettings::default(),
    );
    let reds: Vec<f32> = (1..3).map(|c| rendered.picture.pixels[4 + c][0]).collect();
    assert!((reds[0] - 0.25).abs() < 1e-6, "{reds:?}");
    assert!((reds[1] - 0.75).abs() < 1e-6, "{reds:?}");
    let [_, green, blue] = rendered.picture.pixels[5];
    assert!((green - 0.5).abs() < 1e-6 && blue == 0.0, "{green} {blue}");
}

#[test]
fn an_obj_with_a_cut_out_casts_its_hole() {
    // A sheet of two halves: the right one is cut out by its picture.
    let picture = image::RgbaImage::from_fn(2, 1, |x, _| {
        image::Rgba([255, 255, 255, if x == 0 { 255 } else { 0 }])
    });
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let text = "mtllib a.mtl\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
        usemtl leaf\nf 1/1 2/2 3/3 4/4\n";
    let open = &mut |name: &str| match name {
        "a.mtl" => Ok(b"newmtl leaf\nmap_Kd -clamp on leaf.png\n".to_vec()),
        _ => Ok(png.get_ref().clone()),
    };
    let loaded = antumbra_scene::read::read_obj(
        std::path::Path::new("a.obj"),
        text.as_bytes(),
        &Default::default(),
        open,
    );
    let mut scene = loaded.unwrap().scene;
    scene.lights.push(sun(DVec3::Z));
    for method in METHODS {
        let prepared = prepared(scene.clone(), method);
        let is_shadowed = |x: f64| {
            let start = antumbra_geometry::ReceiverPoint {
                point: DVec3::new(x, 0.1, 0.0),
                surface: None,
            };
            let mut counters = Default::default();
            let answer = prepared.index().shadow(&start, LightId(0), &mut counters);
            answer.unwrap().shadow == antumbra::Shadow::Shadowed
        };
        assert!(is_shadowed(-0.7), "{method:?}");
        assert!(!is_shadowed(0.7), "{method:?}");
    }
}

#[test]
fn the_shadow_of_a_mask_has_its_holes_whatever_the_method() {
    // The eye is under the sheet; a pixel's centre sees the floor at (x, y).
    let size = [40, 40];
    let mut first = None;
    for method in METHODS {
        let prepared = prepared(sheet_over_floor(HALF), method);
        let rendered = shot(&prepared, &camera(2.0), size, with_layers());
        let mask = &rendered.layers[0];
        assert_eq!(mask.name, "shadow.sun");
        let mut counts = [0; 2];
        for (pixel, &lit) in mask.channels[0].1.iter().enumerate() {
            let [x, y] = [pixel % 40, pixel / 40].map(|i| (i as f64 + 0.5) / 10.0 - 2.0);
            let is_under = x.abs() < 1.0 && y.abs() < 1.0;
            let texel = |v: f64| ((v + 1.0) * 2.0) as u32;
            // Texel (0, 0) is solid, as all whose numbers have an even sum.
            let is_solid = is_under && (texel(x) + texel(y)) % 2 == 0;
            assert_eq!(lit == 0.0, is_solid, "{method:?} ({x}, {y})");
            counts[usize::from(is_solid)] += 1;
        }
        assert_eq!(counts, [1400, 200]);
        assert_eq!(rendered.tally.counters.shadow.shadowed, 200);
        let (picture, layer) = first.get_or_insert((rendered.picture.clone(), mask.clone()));
        assert!(rendered.picture == *picture && mask == layer, "{method:?}");
    }
}

#[test]
fn the_eye_and_mirrors_look_through_holes() {
    let mut scene = sheet_over_floor(HALF);
    scene.materials[1].emission = Color::ONE;
    let bright_pixels = |scene: &Scene, height| {
        let prepared = prepared(scene.clone(), Method::Voxel1990);
        let rendered = shot(
            &prepared,
            &camera(height),
            [40, 40],
            RenderSettings::default(),
        );
        assert_eq!(rendered.tally.passed, 0, "holes are no surfaces");
        let pixels = rendered.picture.pixels.iter();
        pixels.filter(|pixel| pixel[0] >= 1.0).count()
    };
    // From above the sheet takes 20 x 20 pixels, its holes half of them.
    assert_eq!(bright_pixels(&scene, 5.0), 200);
    // From below, the sheet is mirrored in the floor, 8 x 8 pixels large.
    assert_eq!(bright_pixels(&scene, 2.0), 0);
    scene.materials[0].reflection = Color::ONE;
    assert_eq!(bright_pixels(&scene, 2.0), 32);
}

#[test]
fn a_mask_that_is_nowhere_solid_is_not_there() {
    let mut without = sheet_over_floor(HALF);
    without.objects.truncate(1);
    let expected = shot(
        &prepared(without, Method::Grid),
        &camera(5.0),
        [20, 20],
        with_layers(),
    );
    let mut faint = sheet_over_floor(HALF);
    faint.materials[1].opacity = 0.4;
    let found = shot(
        &prepared(faint, Method::Grid),
        &camera(5.0),
        [20, 20],
        with_layers(),
    );
    assert!(found.picture == expected.picture);
    assert_eq!(found.tally.queries, expected.tally.queries);
    assert_eq!(found.tally.passed, 0);
}

#[test]
fn faces_without_texture_coordinates_are_whole_under_a_mask() {
    let mut scene = sheet_over_floor(HALF);
    scene.objects[1].shape = Shape::Mesh(square(1.0, 3.0));
    let rendered = shot(
        &prepared(scene, Method::Grid),
        &camera(2.0),
        [40, 40],
        with_layers(),
    );
    assert_eq!(rendered.tally.counters.shadow.shadowed, 400);
}

/// Panes one above the other, the lowest at height 1, over nothing.
fn panes(opacities: &[f64]) -> Scene {
    let material = |&opacity: &f64| Material {
        alpha: Alpha::Blend,
        opacity,
        ..glowing(Color::new(1.0, 0.0, 0.0))
    };
    Scene {
        materials: opacities.iter().map(material).collect(),
        objects: (0..opacities.len())
            .map(|i| object(Shape::Mesh(square(50.0, 1.0 + 0.01 * i as f64)), i))
            .collect(),
        background: Color::new(0.0, 1.0, 0.0),
        ..Scene::default()
    }
}

fn one_pixel(scene: Scene, show: Show) -> ([f32; 3], antumbra_render::integrator::Tally) {
    let settings = RenderSettings {
        max_depth: 0,
        show,
        ..RenderSettings::default()
    };
    let rendered = shot(
        &prepared(scene, Method::Grid),
        &camera(9.0),
        [1, 1],
        settings,
    );
    (rendered.picture.pixels[0], rendered.tally)
}

#[test]
fn a_pane_covers_its_share_of_what_is_behind() {
    let (color, tally) = one_pixel(panes(&[0.25]), Show::Scene);
    assert_eq!(color, [0.25, 0.75, 0.0]);
    assert_eq!((tally.primary_hits, tally.passed), (1, 1));
    // The upper one, seen first, covers half.
    let (color, tally) = one_pixel(panes(&[0.25, 0.5]), Show::Scene);
    assert_eq!(color, [0.5 + 0.125, 0.375, 0.0]);
    assert_eq!((tally.primary_hits, tally.passed), (1, 2));
    // What is whole is the end, and what covers nothing is not there at all.
    assert_eq!(one_pixel(panes(&[0.25, 1.0]), Show::Scene).1.passed, 0);
    assert_eq!(one_pixel(panes(&[0.0]), Show::Scene).1.primary_hits, 0);
}

#[test]
fn looking_through_panes_has_an_end() {
    let count = MAX_PASSED as usize + 9;
    let (color, tally) = one_pixel(panes(&vec![0.5; count]), Show::Scene);
    assert_eq!(tally.passed, u64::from(MAX_PASSED));
    assert_eq!(color[1], 0.0, "the last one counts as whole");
}

#[test]
fn panes_block_no_light_and_transparent_texels_are_looked_through() {
    let mut scene = sheet_over_floor(Alpha::Blend);
    let rendered = shot(
        &prepared(scene.clone(), Method::Voxel1990),
        &camera(5.0),
        [40, 40],
        with_layers(),
    );
    assert_eq!(rendered.tally.counters.shadow.shadowed, 0);
    assert_eq!(rendered.tally.passed, 200);
    // One question a shaded hit: a texel that covers nothing is not shaded.
    assert_eq!(rendered.tally.queries, 1600);

    // The false colors look through it too, and ask as often.
    let settings = RenderSettings {
        show: Show::Occlusion,
        ..with_layers()
    };
    let shown = shot(
        &prepared(scene.clone(), Method::Voxel1990),
        &camera(5.0),
        [40, 40],
        settings,
    );
    assert_eq!((shown.tally.passed, shown.tally.queries), (200, 1600));
    assert_eq!(shown.layers, rendered.layers);

    scene.materials[1].opacity = 0.5;
    let half = shot(
        &prepared(scene, Method::Voxel1990),
        &camera(5.0),
        [40, 40],
        with_layers(),
    );
    // Behind the half-covering texels the floor is shaded too.
    assert_eq!((half.tally.passed, half.tally.queries), (400, 1800));
}

#[test]
fn the_back_of_one_sided_things_is_seen_through_but_blocks_light() {
    let of = |change: fn(&mut Material), height| {
        let mut scene = sheet_over_floor(Alpha::Opaque);
        scene.materials[1].is_double_sided = false;
        change(&mut scene.materials[1]);
        // From below the sheet, looking up at its back, and from above.
        let mut camera = camera(height);
        camera.at.z = if height < 3.0 { 9.0 } else { 0.0 };
        shot(
            &prepared(scene, Method::Grid),
            &camera,
            [1, 1],
            RenderSettings::default(),
        )
        .tally
    };
    let plain = |_: &mut Material| ();
    assert_eq!(of(plain, 5.0).passed, 0);
    let behind = of(plain, 2.0);
    assert_eq!((behind.passed, behind.queries), (1, 0));
    assert_eq!(of(|m| m.is_double_sided = true, 2.0).passed, 0);
    // Light that went into glass has to get out at its back.
    assert_eq!(of(|m| m.transmission = Color::ONE, 2.0).passed, 0);

    // Seen from between, the floor is in the sheet's shadow.
    let mut scene = sheet_over_floor(Alpha::Opaque);
    scene.materials[1].is_double_sided = false;
    let below = shot(
        &prepared(scene, Method::Voxel1990),
        &camera(2.0),
        [40, 40],
        with_layers(),
    );
    assert_eq!(below.tally.counters.shadow.shadowed, 400);
}

#[test]
fn a_picture_with_everything_is_the_same_for_every_method_and_thread_count() {
    let mut scene = sheet_over_floor(HALF);
    scene.materials[0].reflection = Color::splat(0.3);
    scene.materials.push(Material {
        alpha: Alpha::Blend,
        opacity: 0.6,
        is_double_sided: false,
        ..scene.materials[1].clone()
    });
    scene
        .objects
        .push(object(Shape::Mesh(square_with_uvs(1.5, 1.0)), 2));
    scene.lights.push(sun(DVec3::new(0.3, 0.2, 1.0)));
    for sampling in [Sampling::Corners, Sampling::Stratified { samples: 3 }] {
        let settings = RenderSettings {
            sampling,
            ..with_layers()
        };
        let naive = shot(
            &prepared(scene.clone(), Method::Naive),
            &camera(6.0),
            [23, 17],
            settings,
        );
        for method in METHODS {
            let prepared = prepared(scene.clone(), method);
            let mut first = None;
            for threads in [1, 3] {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                let found = pool
                    .build()
                    .unwrap()
                    .install(|| shot(&prepared, &camera(6.0), [23, 17], settings));
                assert!(found.picture == naive.picture, "{method:?}");
                assert_eq!(found.metering, naive.metering);
                assert_eq!(found.tally.passed, naive.tally.passed);
                // Masks do not depend on the method; ways to decide do.
                assert_eq!(found.layers[..2], naive.layers[..2], "{method:?}");
                assert_eq!(*first.get_or_insert(found.layers.clone()), found.layers);
            }
        }
    }
}
