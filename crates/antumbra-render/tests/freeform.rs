//! Patches and implicit surfaces in pictures (Paper 9.1): as they are, and polygonised.

mod support;

use antumbra::{Counters, LightId, Method, ReceiverPoint, Shadow};
use antumbra_geometry::DVec3;
use antumbra_render::film::RenderSettings;
use antumbra_scene::generate;
use antumbra_scene::model::Scene;
use support::{ALL_METHODS, assert_golden, bytes, prepared, shot};

#[test]
fn the_teapot_looks_as_it_did() {
    let scene = generate::teapot(6).expect("a size that exists");
    let camera = scene.camera.expect("a camera");
    let render = |method: Method| {
        let prepared = prepared(scene.clone(), method);
        shot(&prepared, &camera, [96, 72], RenderSettings::default())
    };
    let first = render(Method::Auto);
    assert_golden("teapot", &first);
    for method in ALL_METHODS {
        assert_eq!(bytes(&render(method)), bytes(&first), "{method:?}");
    }
}

#[test]
fn implicit_surfaces_look_as_they_did() {
    for (name, scene) in [
        ("knot", generate::knot(24)),
        ("metaballs", generate::metaballs(6)),
        ("gyroid", generate::gyroid(2)),
    ] {
        let scene = scene.expect("a size that exists");
        let camera = scene.camera.expect("a camera");
        let render = |method: Method| {
            let prepared = prepared(scene.clone(), method);
            shot(&prepared, &camera, [48, 36], RenderSettings::default())
        };
        let first = render(Method::Auto);
        assert_golden(name, &first);
        for method in [Method::Voxel, Method::Voxel1990, Method::Naive] {
            assert_eq!(bytes(&render(method)), bytes(&first), "{name} {method:?}");
        }
    }
}

/// Returns for points of the floor whether each is in shadow of each light.
fn shadows_on_the_floor(scene: &Scene) -> Vec<bool> {
    let prepared = prepared(scene.clone(), Method::Bvh);
    let index = prepared.index();
    let mut shadows = Vec::new();
    for number in 0..10_000 {
        let [x, y] = [number % 100, number / 100].map(|i| (f64::from(i) + 0.37) * 0.12 - 6.0);
        let start = ReceiverPoint {
            point: DVec3::new(x, y, 0.0),
            surface: Some(antumbra::SurfaceId(0)),
        };
        for light in 0..index.lights().len() {
            let counters = &mut Counters::default();
            let answer = index.shadow(&start, LightId::from_index(light), counters);
            shadows.push(answer.expect("a fine query").shadow == Shadow::Shadowed);
        }
    }
    shadows
}

#[test]
fn meshes_differ_near_outlines_only_and_less_the_finer_they_are() {
    for scene in [
        generate::teapot(8),
        generate::knot(12),
        generate::metaballs(6),
    ] {
        let scene = scene.expect("a size that exists");
        let exact = shadows_on_the_floor(&scene);
        assert!(exact.iter().filter(|&&shadow| shadow).count() > 500);
        let different = |cells: u32| {
            let mesh = shadows_on_the_floor(&scene.clone().tessellated(cells));
            exact
                .iter()
                .zip(&mesh)
                .filter(|(one, other)| one != other)
                .count()
        };
        let [coarse, fine] = [4, 32].map(different);
        // Of 20 000 answers.
        assert!(coarse > 60 && fine < coarse / 8, "{coarse} {fine}");
    }
}
