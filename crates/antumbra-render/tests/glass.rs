//! Light through see-through surfaces: its color, in pictures (Paper 6.3).

mod support;

use antumbra::Method;
use antumbra_geometry::{AreaShape, DVec3, RectangleLight, SunDisc};
use antumbra_render::film::{RenderSettings, Rendered, Sampling};
use antumbra_scene::generate;
use antumbra_scene::model::{
    Alpha, AreaLight, Camera, Color, Light, LightKind, Material, Scene, Shape,
};
use support::{ALL_METHODS, assert_golden, bytes, camera, checker, object, prepared, shot, square};

const RED: Color = Color::new(0.5, 0.125, 0.25);

fn sun(towards_light: DVec3) -> Light {
    Light {
        name: String::new(),
        kind: LightKind::Directional { towards_light },
        color: Color::ONE,
        falls_off: false,
    }
}

fn glass(transmission: Color) -> Material {
    Material {
        diffuse: Color::ZERO,
        transmission,
        ..Material::default()
    }
}

/// A white floor, and at the height 30, above the camera, a pane of a material, which shades its middle.
fn under(pane: Material) -> Scene {
    let floor = Material {
        diffuse: Color::ONE,
        ..Material::default()
    };
    Scene {
        materials: vec![floor, pane],
        objects: vec![
            object(Shape::Mesh(square(20.0, 0.0)), 0),
            object(Shape::Mesh(square(2.0, 30.0)), 1),
        ],
        ..Scene::default()
    }
}

/// Looks down from below the pane; the picture's middle pixel is behind it, its corner is not.
fn look(scene: Scene, method: Method, settings: RenderSettings) -> [Color; 2] {
    let rendered = shot(&prepared(scene, method), &camera(10.0), [9, 9], settings);
    let pixel = |x: usize, y: usize| {
        let [r, g, b] = rendered.picture.pixels[9 * y + x];
        Color::new(r.into(), g.into(), b.into())
    };
    [pixel(4, 4), pixel(0, 0)]
}

fn assert_close(found: Color, expected: Color, label: &str) {
    assert!(
        (found - expected).length() < 1e-6,
        "{label}: {found} is not {expected}"
    );
}

#[test]
fn a_pane_colors_the_sun_and_can_be_told_not_to() {
    for method in ALL_METHODS {
        for is_colored in [true, false] {
            let mut scene = under(glass(RED));
            scene.lights.push(sun(DVec3::Z));
            let settings = RenderSettings {
                colored_shadows: is_colored,
                ..RenderSettings::default()
            };
            let [behind, beside] = look(scene, method, settings);
            let expected = if is_colored { RED } else { Color::ONE };
            let label = format!("{method:?} {is_colored}");
            assert_close(behind, expected, &label);
            assert_close(beside, Color::ONE, &label);
        }
    }
}

#[test]
fn what_blends_leaves_the_rest_and_textures_say_where() {
    let half = Material {
        alpha: Alpha::Blend,
        opacity: 0.25,
        ..Material::default()
    };
    let mut scene = under(half);
    scene.lights.push(sun(DVec3::Z));
    let [behind, _] = look(scene, Method::Auto, RenderSettings::default());
    assert_close(behind, Color::splat(0.75), "alpha");

    // A texture whose first texel, the upper left, is whole, and whose neighbours are holes.
    let textured = Material {
        alpha: Alpha::Blend,
        opacity: 0.5,
        diffuse_texture: Some(0),
        ..Material::default()
    };
    let mut scene = under(textured);
    scene.textures.push(checker(2));
    scene.objects[1].shape = Shape::Mesh(support::square_with_uvs(2.0, 30.0));
    scene.lights.push(sun(DVec3::Z));
    // Five pixels to 5 units: pixels beside the middle are under single texels.
    let rendered = shot(
        &prepared(scene, Method::Auto),
        &camera(2.5),
        [4, 4],
        RenderSettings::default(),
    );
    let red = |x: usize, y: usize| f64::from(rendered.picture.pixels[4 * y + x][0]);
    for (x, y, expected) in [(1, 1, 0.5), (2, 1, 1.0), (1, 2, 1.0), (2, 2, 0.5)] {
        assert!(
            (red(x, y) - expected).abs() < 1e-6,
            "{x} {y}: {}",
            red(x, y)
        );
    }
}

#[test]
fn lights_with_size_are_colored_sample_by_sample() {
    let disc = AreaShape::SunDisc(SunDisc::new(DVec3::Z, 1.0).unwrap());
    let edges = [DVec3::X, DVec3::Y].map(|edge| edge * 0.5);
    let lamp = RectangleLight::new(DVec3::new(0.0, 0.0, 60.0), edges, true).unwrap();
    for shape in [disc, AreaShape::Rectangle(lamp)] {
        for exact_fractions in [false, true] {
            let shot_of = |material: Option<Material>| {
                let mut scene = under(material.unwrap_or_default());
                if scene.materials[1].is_opaque() {
                    scene.objects.pop();
                }
                scene.area_lights.push(AreaLight {
                    name: String::new(),
                    shape: shape.clone(),
                    color: Color::ONE,
                    falls_off: false,
                });
                let settings = RenderSettings {
                    exact_fractions,
                    ..RenderSettings::default()
                };
                look(scene, Method::Auto, settings)
            };
            let [clear, _] = shot_of(None);
            let [behind, _] = shot_of(Some(glass(RED)));
            assert!(clear.min_element() > 0.5, "{shape:?}: {clear}");
            assert_close(behind, clear * RED, &format!("{shape:?} {exact_fractions}"));
        }
    }
}

fn window(method: Method, colored_shadows: bool) -> Rendered {
    let scene = generate::window(6).unwrap();
    let view: Camera = scene.camera.unwrap();
    let settings = RenderSettings {
        sampling: Sampling::Stratified { samples: 4 },
        colored_shadows,
        ..RenderSettings::default()
    };
    shot(&prepared(scene, method), &view, [96, 72], settings)
}

#[test]
fn stained_glass_looks_as_it_did_for_every_method() {
    let rendered = window(Method::Auto, true);
    assert_golden("stained-glass", &rendered);
    for method in ALL_METHODS {
        assert_eq!(bytes(&window(method, true)), bytes(&rendered), "{method:?}");
    }
    assert_ne!(bytes(&window(Method::Auto, false)), bytes(&rendered));
}
