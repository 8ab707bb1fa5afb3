//! Reliefs that are no geometry: in shading, and where shadows end (Paper 7.2).

mod support;

use antumbra::Method;
use antumbra_geometry::DVec3;
use antumbra_render::aov::Aovs;
use antumbra_render::film::{RenderSettings, Rendered, Sampling};
use antumbra_scene::generate;
use antumbra_scene::model::{
    Bump, Camera, Color, Filter, Light, LightKind, Material, Scene, Shape, Texture, Wrap,
};
use support::{ALL_METHODS, assert_golden, bytes, camera, object, prepared, shot, square};

fn sun(towards_light: DVec3) -> Light {
    Light {
        name: String::new(),
        kind: LightKind::Directional { towards_light },
        color: Color::ONE,
        falls_off: false,
    }
}

fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> Texture {
    let texel = |i: u32| {
        let [r, g, b] = texel(i % width, i / width);
        [r, g, b, 255]
    };
    Texture {
        name: String::new(),
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
    }
}

/// A white floor of 40 x 40 with a relief, and at the height 30 a plate of 4 x 4.
fn floor_with(bump: Option<Bump>, pictures: Vec<Texture>) -> Scene {
    let floor = Material {
        diffuse: Color::ONE,
        bump,
        ..Material::default()
    };
    Scene {
        materials: vec![floor, Material::default()],
        textures: pictures,
        objects: vec![
            object(Shape::Mesh(support::square_with_uvs(20.0, 0.0)), 0),
            object(Shape::Mesh(square(2.0, 30.0)), 1),
        ],
        lights: vec![sun(DVec3::new(0.5, 0.0, 1.0))],
        ..Scene::default()
    }
}

fn settings(bumps: bool) -> RenderSettings {
    RenderSettings {
        bumps,
        aovs: Aovs {
            shadow: true,
            ..Aovs::default()
        },
        ..RenderSettings::default()
    }
}

/// Pebbles and cracks of no order.
fn rough(x: u32, y: u32) -> [u8; 3] {
    let mixed =
        (x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77)).wrapping_mul(0xc2b2_ae3d);
    let [_, a, b, c] = mixed.to_be_bytes();
    [a, b, 128 | c >> 1]
}

/// Scenes with every kind of relief, and views of them.
fn scenes() -> Vec<(&'static str, Scene, Camera)> {
    let in_space = |scene: Scene, bump: Bump| {
        let materials = scene.materials.into_iter();
        Scene {
            materials: materials
                .map(|material| Material {
                    bump: Some(bump),
                    ..material
                })
                .collect(),
            ..scene
        }
    };
    let noise = Bump::Noise {
        height: 0.08,
        size: 0.3,
    };
    let ripples = Bump::Ripples {
        height: 0.2,
        size: 0.8,
    };
    let heights = Bump::Heights {
        texture: 0,
        multiplier: -1.5,
    };
    let normals = Bump::Normals {
        texture: 0,
        scale: 8.0,
    };
    let picture = || vec![texture(64, 64, rough)];
    let window = generate::window(6).expect("a window");
    let quadric = generate::quadric();
    let view = |scene: &Scene| scene.camera.expect("a camera");
    let (of_window, of_quadric) = (view(&window), view(&quadric));
    vec![
        ("noise", in_space(window, noise), of_window),
        ("ripples", in_space(quadric, ripples), of_quadric),
        (
            "heights",
            floor_with(Some(heights), picture()),
            camera(20.0),
        ),
        (
            "normals",
            floor_with(Some(normals), picture()),
            camera(20.0),
        ),
    ]
}

#[test]
fn answers_in_full_and_null_regions_are_those_of_the_perturbed_reference() {
    let mut known = [0_u64; 2];
    for (name, scene, view) in scenes() {
        let of = |method| {
            shot(
                &prepared(scene.clone(), method),
                &view,
                [96, 72],
                settings(true),
            )
        };
        let reference = of(Method::Naive);
        let bumps = reference.tally.bumps;
        assert!(
            bumps.queries > 1000 && bumps.perturbed == bumps.queries,
            "{name} {bumps:?}"
        );
        for method in ALL_METHODS {
            let rendered = of(method);
            let layers = rendered.layers.iter().zip(&reference.layers);
            let planes = layers.flat_map(|(a, b)| a.channels.iter().zip(&b.channels));
            let pixels = planes.flat_map(|((_, a), (_, b))| a.iter().zip(b));
            let differences = pixels.filter(|(a, b)| a != b).count();
            assert_eq!(differences, 0, "{name} {method:?}");
            assert_eq!(rendered.picture, reference.picture, "{name} {method:?}");
            let found = rendered.tally.bumps;
            assert_eq!(found.queries, bumps.queries, "{name} {method:?}");
            let all = found.known_lit + found.known_shadowed + found.perturbed;
            assert_eq!(all, found.queries, "{name} {method:?}");
            if method == Method::Voxel1990 {
                known[0] += found.known_lit;
                known[1] += found.known_shadowed;
            }
        }
        let smooth = shot(
            &prepared(scene.clone(), Method::Auto),
            &view,
            [96, 72],
            settings(false),
        );
        assert_eq!(smooth.tally.bumps.queries, 0, "{name}");
        let shadow = |rendered: &Rendered| rendered.layers[0].channels[0].1.clone();
        assert_ne!(
            shadow(&smooth),
            shadow(&reference),
            "{name} changes no shadow"
        );
    }
    assert!(known.iter().all(|&count| count > 1000), "{known:?}");
}

/// The columns of a row that the shadow's border is between.
fn shadow_in_row(rendered: &Rendered, row: usize) -> [usize; 2] {
    let width = rendered.picture.size[0] as usize;
    let plane = &rendered.layers[0].channels[0].1;
    let row = &plane[row * width..(row + 1) * width];
    let first = row.iter().position(|&lit| lit == 0.0).expect("a shadow");
    let last = row.iter().rposition(|&lit| lit == 0.0).expect("a shadow");
    [first, last]
}

#[test]
fn a_shadow_ends_where_it_would_on_the_relief() {
    // Black above, white below; the picture is 40 long on the floor, so white is 2 high.
    let heights = texture(1, 2, |_, y| [if y == 0 { 0 } else { 255 }; 3]);
    for (multiplier, [above, below]) in [(3.2, [2.0 / 64.0, 2.0]), (-3.2, [2.0, 2.0 / 64.0])] {
        let bump = Bump::Heights {
            texture: 0,
            multiplier,
        };
        for method in ALL_METHODS {
            let scene = floor_with(Some(bump), vec![heights.clone()]);
            let view = camera(20.0);
            let rendered = shot(&prepared(scene, method), &view, [320, 320], settings(true));
            // Eight pixels to a unit. At the height h the plate's shadow is half as far to +x.
            for (row, height) in [(152, above), (168, below)] {
                let [from, to] = [-2.0, 2.0].map(|x: f64| 160.0 + 8.0 * (x - 15.0 + 0.5 * height));
                let [first, last] = shadow_in_row(&rendered, row);
                let label = format!("{multiplier} {method:?} {row}: {first} {last}, {from} {to}");
                assert!((first as f64 - from).abs() <= 1.0, "{label}");
                assert!((last as f64 + 1.0 - to).abs() <= 1.0, "{label}");
            }
        }
    }
}

#[test]
fn a_flat_picture_of_normals_changes_nothing_and_a_leaning_one_turns_light_away() {
    let shade = |texel: Option<[u8; 3]>| {
        let bump = texel.map(|_| Bump::Normals {
            texture: 0,
            scale: 1.0,
        });
        let pictures = texel.map(|texel| texture(1, 1, |_, _| texel));
        let scene = floor_with(bump, pictures.into_iter().collect());
        let rendered = shot(
            &prepared(scene, Method::Auto),
            &camera(20.0),
            [9, 9],
            settings(true),
        );
        f64::from(rendered.picture.pixels[9 * 4 + 8][0])
    };
    // Light comes from +x, which is to the right in the picture and along u.
    let smooth = shade(None);
    assert!((shade(Some([128, 128, 255])) - smooth).abs() < 0.01);
    assert!(shade(Some([200, 128, 230])) > smooth + 0.03);
    assert!(shade(Some([56, 128, 230])) < smooth - 0.1);
    // To either side of the light, alike.
    let [up, down] = [[128, 200, 230], [128, 55, 230]].map(|texel| shade(Some(texel)));
    assert!((up - down).abs() < 0.01, "{up} {down}");
}

#[test]
fn odd_reliefs_are_none_or_bounded() {
    let smooth = {
        let scene = floor_with(None, Vec::new());
        bytes(&shot(
            &prepared(scene, Method::Auto),
            &camera(20.0),
            [32, 32],
            settings(true),
        ))
    };
    let mut odd = Vec::new();
    for number in [0.0, f64::NAN, f64::INFINITY, 1e300, 1e-300] {
        odd.push(Bump::Heights {
            texture: 0,
            multiplier: number,
        });
        odd.push(Bump::Normals {
            texture: 0,
            scale: number,
        });
        odd.push(Bump::Noise {
            height: number,
            size: 1.0,
        });
    }
    for bump in odd {
        let scene = floor_with(Some(bump), vec![texture(4, 4, rough)]);
        let rendered = shot(
            &prepared(scene, Method::Auto),
            &camera(20.0),
            [32, 32],
            settings(true),
        );
        assert_eq!(bytes(&rendered), smooth, "{bump:?}");
        assert_eq!(rendered.tally.bumps.queries, 0, "{bump:?}");
    }
    // Without places in the picture, or with all in one.
    for is_bare in [true, false] {
        let bump = Bump::Normals {
            texture: 0,
            scale: 1.0,
        };
        let mut scene = floor_with(Some(bump), vec![texture(4, 4, rough)]);
        let mut mesh = match is_bare {
            true => square(20.0, 0.0),
            false => support::square_with_uvs(20.0, 0.0),
        };
        for uv in &mut mesh.uvs {
            *uv = [0.25; 2];
        }
        scene.objects[0].shape = Shape::Mesh(mesh);
        let rendered = shot(
            &prepared(scene, Method::Auto),
            &camera(20.0),
            [32, 32],
            settings(true),
        );
        assert_eq!(bytes(&rendered), smooth, "{is_bare}");
    }
}

#[test]
fn bumps_look_as_they_did() {
    let (_, scene, view) = scenes().swap_remove(0);
    let settings = RenderSettings {
        sampling: Sampling::Stratified { samples: 4 },
        ..RenderSettings::default()
    };
    let rendered = shot(&prepared(scene, Method::Auto), &view, [96, 72], settings);
    assert_golden("bumps", &rendered);
}
