//! Embree against antumbra on scenes without doubtful queries. Where Embree is not there, that is
//! said and nothing is tested.

use std::sync::Arc;

use antumbra::{Method, ShadowIndex};
use antumbra_baselines::embree::{Embree, Geometry};
use antumbra_baselines::{Batch, IndexMethod, ShadowMethod};
use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};
use antumbra_scene::model::{Material, Object, Polygon, Scene, Shape};

fn embree() -> Option<Embree> {
    match Embree::load(1) {
        Ok(embree) => Some(embree),
        Err(error) => {
            antumbra_testkit::absent::skip("embree", &error.to_string());
            None
        }
    }
}

/// A ball and a square side by side over nothing.
fn scene() -> Scene {
    let square = [(2.0, -1.0), (4.0, -1.0), (4.0, 1.0), (2.0, 1.0)];
    let square = Polygon {
        vertices: square.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec(),
        normals: Vec::new(),
    };
    let ball = antumbra_geometry::Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
    };
    let object = |shape| Object {
        name: String::new(),
        shape,
        material: 0,
    };
    Scene {
        materials: vec![Material::default()],
        objects: vec![object(Shape::Polygon(square)), object(Shape::Sphere(ball))],
        ..Scene::default()
    }
}

fn occluders(scene: &Scene) -> antumbra_geometry::Occluders {
    use antumbra_geometry::{Occluders, Opacity};
    let mut builder = Occluders::builder();
    for object in &scene.objects {
        match &object.shape {
            Shape::Polygon(polygon) => builder.add_face(&polygon.vertices, Opacity::Opaque),
            Shape::Sphere(sphere) => builder.add_sphere(*sphere, Opacity::Opaque),
            other => panic!("{other:?}"),
        }
        .unwrap();
    }
    builder.build()
}

/// Starts in rows under both, the sun straight above; 37 is no multiple of 8.
fn batch() -> Batch {
    let starts: Vec<_> = (0..37)
        .map(|i| ReceiverPoint {
            point: DVec3::new(-2.03 + 0.19 * f64::from(i), 0.11, -3.0),
            surface: None,
        })
        .collect();
    Batch {
        light: 0,
        light_shape: LightShape::Point(DVec3::new(0.0, 0.0, 1000.0)),
        normals: vec![DVec3::ZERO; starts.len()],
        starts,
        is_coherent: true,
    }
}

#[test]
fn all_methods_answer_alike_where_nothing_is_doubtful() {
    let Some(embree) = embree() else {
        return;
    };
    let scene = scene();
    let occluders = Arc::new(occluders(&scene));
    let geometry = Geometry::of(&scene, &occluders);
    assert_eq!(geometry.primitive_counts(), [2, 1]);
    let batch = batch();
    let index = ShadowIndex::builder(Arc::clone(&occluders), vec![batch.light_shape])
        .method(Method::Grid)
        .build()
        .unwrap();
    let own = IndexMethod::new("grid", index);
    let answers = |method: &dyn ShadowMethod| {
        let mut answers = vec![false; batch.starts.len()];
        let loaded = method.load(&batch);
        let (first, rest) = answers.split_at_mut(16);
        loaded.answer(0, first);
        loaded.answer(16, rest);
        answers
    };
    let expected = answers(&own);
    assert!(expected.contains(&true) && expected.contains(&false));
    assert_eq!(
        own.decisions(&batch).shadowed,
        expected.iter().filter(|&&is_shadowed| is_shadowed).count() as u64
    );
    for is_robust in [false, true] {
        let built = embree.build(&geometry, is_robust).unwrap();
        for method in built.methods() {
            assert_eq!(answers(&method), expected, "{}", method.name());
        }
    }
}
