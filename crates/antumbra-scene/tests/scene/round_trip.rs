//! Laws: what is written exactly reads back equal.

use antumbra_geometry::{Cone, DVec3, Disk, Sphere};
use antumbra_scene::{
    model::{Color, Corner, Light, LightKind, Material, Mesh, Object, Polygon, Scene, Shape},
    write::{Precision, write_nff},
};

use crate::support::{Random, files_below, nff, shared_scenes};

fn text_of(scene: &Scene, precision: Precision) -> String {
    let mut text = Vec::new();
    write_nff(scene, precision, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// Makes NFF text with random numbers of all sizes.
fn random_nff(random: &mut Random) -> String {
    fn numbers(random: &mut Random, count: usize) -> String {
        (0..count)
            .map(|_| format!(" {:?}", random.number()))
            .collect()
    }
    let mut text = String::new();
    if random.below(2) == 0 {
        text += &format!("v from{} at 1 2 3 up 1 2 4 angle 33.3", numbers(random, 3));
    }
    for _ in 0..random.below(12) {
        text += &match random.below(12) {
            0 => format!("\nb{}", numbers(random, 3)),
            1 => format!("\nl{}", numbers(random, 3)),
            2 => format!("\nl{}", numbers(random, 6)),
            3 => format!("\nf{}", numbers(random, 8)),
            4 => format!("\ns{}", numbers(random, 4)),
            5 => format!("\np 4{}", numbers(random, 12)),
            6 => format!("\nbezier {}{}", random.below(13), numbers(random, 48)),
            7 => format!("\ntorus{} 0.5 0.25", numbers(random, 6)),
            8 => format!(
                "\nmetaballs 2 0.5 -1 -2 -3 4 5 6{} 1.5 2{} 0.5 -1",
                numbers(random, 3),
                numbers(random, 3)
            ),
            9 => format!("\ngyroid{} 2.5 0.125 -1 -2 -3 4 5 6", numbers(random, 3)),
            10 => format!(
                "\npolynomial 2{} 0.5 -1 -2 -3 4 5 6 1.5 2 0 3 -0.25 0 0 12",
                numbers(random, 3)
            ),
            _ => format!("\npp 3{}", numbers(random, 18)),
        };
    }
    text
}

#[test]
fn read_write_read_changes_nothing() {
    let mut random = Random(1);
    let mut objects = 0;
    for _ in 0..3000 {
        let text = random_nff(&mut random);
        let Ok(first) = nff(&text) else { continue };
        let written = text_of(&first.scene, Precision::Exact);
        let second = nff(&written).unwrap_or_else(|error| panic!("{error}\n{written}"));
        assert_eq!(first.scene, second.scene, "{text}\n--\n{written}");
        objects += first.scene.objects.len();
    }
    assert!(objects > 5000, "{objects}");
}

#[test]
fn other_peoples_files_survive_too() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for path in files_below(&folder.join("nff"), "nff") {
        let text = std::fs::read_to_string(&path).unwrap();
        let first = nff(&text).unwrap().scene;
        assert_eq!(
            nff(&text_of(&first, Precision::Exact)).unwrap().scene,
            first
        );
    }
}

#[test]
fn meshes_become_polygons_and_patches() {
    let corner = |position, normal| Corner {
        normal,
        ..Corner::at(position)
    };
    let mesh = Mesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        normals: vec![DVec3::Z],
        corners: vec![
            corner(0, Corner::NONE),
            corner(1, Corner::NONE),
            corner(2, Corner::NONE),
            corner(0, 0),
            corner(2, Corner::NONE),
            corner(1, 0),
        ],
        face_ends: vec![3, 6],
        ..Mesh::default()
    };
    let scene = one(Shape::Mesh(mesh), Material::default());
    assert_eq!(
        text_of(&scene, Precision::SixDigits),
        "b 0 0 0\nf 1 1 1 0.8 0 1 0 1\np 3\n0 0 0\n1 0 0\n0 1 0\n\
         pp 3\n0 0 0 0 0 1\n0 1 0 0 0 0\n1 0 0 0 0 1\n"
    );
}

fn one(shape: Shape, material: Material) -> Scene {
    Scene {
        materials: vec![material],
        objects: vec![Object {
            name: "thing".into(),
            shape,
            material: 0,
        }],
        ..Scene::default()
    }
}

#[test]
fn what_nff_cannot_say_is_refused_by_name() {
    let refusal = |scene: &Scene| {
        write_nff(scene, Precision::Exact, &mut Vec::new())
            .unwrap_err()
            .to_string()
    };
    let ball = || {
        Shape::Sphere(Sphere {
            center: DVec3::ZERO,
            radius: 1.0,
        })
    };
    let grey = Material::default();
    let cone = Cone {
        base: DVec3::ZERO,
        base_radius: 1.0,
        apex: DVec3::Z,
        apex_radius: 1.0,
        is_closed: true,
    };
    assert_eq!(
        refusal(&one(Shape::Cone(cone), grey.clone())),
        "NFF cannot say a closed cone or cylinder (number 0, `thing`)"
    );
    let disk = Disk {
        center: DVec3::ZERO,
        normal: DVec3::Z,
        radius: 1.0,
    };
    assert!(refusal(&one(Shape::Disk(disk), grey.clone())).contains("a disk (number 0"));
    for (material, reason) in [
        (
            Material {
                emission: Color::ONE,
                ..grey.clone()
            },
            "sends out light",
        ),
        (
            Material {
                specular: Color::ONE,
                ..grey.clone()
            },
            "different weights",
        ),
        (
            Material {
                specular: Color::X,
                reflection: Color::X,
                ..grey.clone()
            },
            "colored",
        ),
        (
            Material {
                transmission: Color::X,
                ..grey.clone()
            },
            "colored",
        ),
    ] {
        assert!(refusal(&one(ball(), material)).contains(reason));
    }
    let point = LightKind::Point {
        position: DVec3::ZERO,
    };
    let spot = LightKind::Spot {
        position: DVec3::ZERO,
        axis: DVec3::Z,
        inner_cosine: 0.9,
        outer_cosine: 0.8,
    };
    for (kind, falls_off, reason) in [
        (
            LightKind::Directional {
                towards_light: DVec3::Z,
            },
            false,
            "a directional light",
        ),
        (spot, false, "a spot light"),
        (point, true, "a light that falls off with distance"),
    ] {
        let light = Light {
            name: "lamp".into(),
            kind,
            color: Color::ONE,
            falls_off,
        };
        let scene = Scene {
            lights: vec![light],
            ..Scene::default()
        };
        assert_eq!(
            refusal(&scene),
            format!("NFF cannot say {reason} (number 0, `lamp`)")
        );
    }
}

#[test]
fn polygons_without_normals_are_plain() {
    let polygon = Polygon {
        vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
        normals: vec![],
    };
    let scene = one(Shape::Polygon(polygon), Material::default());
    let text = text_of(&scene, Precision::Exact);
    assert_eq!(
        text,
        "b 0 0 0\nf 0.8 0.8 0.8 1 0 1 0 1\np 3\n0 0 0\n1 0 0\n0 1 0\n"
    );
}
