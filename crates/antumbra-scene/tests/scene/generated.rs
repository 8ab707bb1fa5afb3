//! The generators against SPD's own files, word by word.

use antumbra_scene::{
    generate::{
        bars, by_name, city, dgp, forest, graph, heightfield, quadric, rooms, sphereflake, tetra,
    },
    model::{Scene, Shape},
    write::{Precision, write_nff},
};

use crate::support::{nff, shared_scenes};

fn text_of(scene: &Scene) -> String {
    let mut text = Vec::new();
    write_nff(scene, Precision::SixDigits, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// Compares line by line. Two numbers have no place in the model and are left out: `hither`,
/// and the index of refraction of what is opaque.
#[test]
fn the_same_words_as_spd() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for (name, scene) in [
        ("tetra_3", tetra(3).unwrap()),
        ("tetra_6", tetra(6).unwrap()),
        ("balls_2", sphereflake(2).unwrap()),
        ("balls_3", sphereflake(3).unwrap()),
    ] {
        let theirs = std::fs::read_to_string(folder.join(format!("nff/spd/{name}.nff"))).unwrap();
        let ours = text_of(&scene);
        assert_eq!(ours.lines().count(), theirs.lines().count(), "{name}");
        for (i, (ours, theirs)) in ours.lines().zip(theirs.lines()).enumerate() {
            let mut ours: Vec<_> = ours.split(' ').collect();
            let mut theirs: Vec<_> = theirs.split(' ').collect();
            if ours[0] == "hither" && theirs[0] == "hither" {
                continue;
            }
            if ours[0] == "f" && ours[7] == "0" {
                ours.pop();
                theirs.pop();
            }
            assert_eq!(ours, theirs, "{name}, line {}", i + 1);
        }
    }
}

#[test]
fn counts_follow_the_formula() {
    for size in 1..=5 {
        assert_eq!(tetra(size).unwrap().objects.len(), 4_usize.pow(size));
    }
    assert_eq!(sphereflake(1).unwrap().objects.len(), 11);
    assert_eq!(sphereflake(2).unwrap().objects.len(), 92);
    assert_eq!(sphereflake(3).unwrap().objects.len(), 821);
    for boxes in [1u32, 2, 17, 100] {
        // A ground, five faces each, a bottom for every fourth.
        let expected = 1 + 5 * boxes as usize + boxes.div_ceil(4) as usize;
        assert_eq!(city(boxes).unwrap().objects.len(), expected);
    }
    for (leaves, trees) in [(1, 1), (500, 1), (501, 2), (2000, 4)] {
        assert_eq!(
            forest(leaves).unwrap().objects.len(),
            1 + 6 * trees + leaves as usize
        );
    }
    for side in [2, 3, 66] {
        let cells = side as usize - 1;
        assert_eq!(heightfield(side).unwrap().objects.len(), 2 * cells * cells);
    }
}

/// The paper's Table 1: lights and objects.
#[test]
fn the_papers_scenes_have_its_counts() {
    for (name, lights, objects) in [
        ("graph", 2, 12),
        ("quadric", 3, 15),
        ("dgp", 1, 21),
        ("bars", 1, 88),
        ("flakes", 3, 92),
        ("tetra", 1, 4096),
    ] {
        let scene = by_name(name, None, None).unwrap();
        assert_eq!(scene.lights.len(), lights, "{name}");
        assert_eq!(scene.objects.len(), objects, "{name}");
    }
    let is_quadric = |shape: &Shape| matches!(shape, Shape::Sphere(_) | Shape::Cone(_));
    assert!(quadric().objects.iter().all(|o| is_quadric(&o.shape)));
}

#[test]
fn rooms_have_as_many_lights_as_asked_for_and_the_same_furniture() {
    for lights in [1, 10, 100] {
        let scene = by_name("rooms", None, Some(lights)).unwrap();
        assert_eq!(scene.lights.len(), lights as usize);
        assert_eq!(scene.objects, rooms(3, 1).unwrap().objects);
    }
    let refused = |lights, name| by_name(name, None, Some(lights)).unwrap_err().to_string();
    assert_eq!(refused(0, "rooms"), "0 lights; expected 1 to 10000");
    assert_eq!(
        refused(2, "tetra"),
        "tetra has lights of its own; only rooms takes a number of lights"
    );
    assert!(refused(2, "gears").contains("no generator"));
}

fn coord(point: antumbra_geometry::DVec3) -> robust::Coord3D<f64> {
    let [x, y, z] = point.to_array();
    robust::Coord3D { x, y, z }
}

/// The polygons; whatever is round is left out.
fn faces(scene: &Scene) -> impl Iterator<Item = &[antumbra_geometry::DVec3]> {
    scene
        .objects
        .iter()
        .filter_map(|object| match &object.shape {
            Shape::Polygon(polygon) => Some(&polygon.vertices[..]),
            _ => None,
        })
}

fn vertices(scene: &Scene) -> impl Iterator<Item = &[antumbra_geometry::DVec3]> {
    scene.objects.iter().map(|object| match &object.shape {
        Shape::Polygon(polygon) => &polygon.vertices[..],
        other => panic!("{other:?}"),
    })
}

/// Boxes stand exactly on the ground, and six digits change nothing of any size up to the default.
#[test]
fn measured_scenes_survive_six_digits() {
    for scene in [
        city(10_000).unwrap(),
        forest(30_000).unwrap(),
        heightfield(256).unwrap(),
    ] {
        let loaded = nff(&text_of(&scene)).unwrap();
        assert_eq!(loaded.warnings, []);
        assert_eq!(loaded.scene.objects, scene.objects);
        assert!(scene.camera.is_some());
        assert_eq!(scene.lights.len(), 1);
    }
    for scene in [
        graph(),
        quadric(),
        dgp(),
        bars(),
        rooms(3, 100).unwrap(),
        rooms(12, 2).unwrap(),
    ] {
        let loaded = nff(&text_of(&scene)).unwrap();
        assert_eq!(loaded.warnings, []);
        // Colors are products in the file, and may lose a digit.
        let shapes = |scene: &Scene| {
            scene
                .objects
                .iter()
                .map(|o| o.shape.clone())
                .collect::<Vec<_>>()
        };
        assert_eq!(shapes(&loaded.scene), shapes(&scene));
        let places = |scene: &Scene| {
            scene
                .lights
                .iter()
                .map(|light| light.kind)
                .collect::<Vec<_>>()
        };
        assert_eq!(places(&loaded.scene), places(&scene));
    }
}

#[test]
fn every_face_is_planar_and_none_is_empty() {
    for scene in [
        city(300).unwrap(),
        forest(3000).unwrap(),
        heightfield(40).unwrap(),
        graph(),
        dgp(),
        bars(),
        rooms(2, 1).unwrap(),
    ] {
        for face in faces(&scene) {
            let normal = (face[1] - face[0]).cross(face[2] - face[0]);
            assert!(normal.length() > 0.0, "{face:?}");
            let [a, b, c] = [0, 1, 2].map(|corner| coord(face[corner]));
            for &vertex in face {
                assert_eq!(robust::orient3d(a, b, c, coord(vertex)), 0.0, "{face:?}");
            }
        }
    }
}

#[test]
fn what_is_made_stays_over_its_ground() {
    for scene in [city(500).unwrap(), forest(5000).unwrap()] {
        let mut faces = vertices(&scene);
        let ground = faces.next().unwrap();
        let (low, high) = (ground[0], ground[2]);
        for vertex in faces.flatten() {
            assert!(vertex.x > low.x && vertex.y > low.y, "{vertex}");
            assert!(vertex.x < high.x && vertex.y < high.y, "{vertex}");
            assert!(vertex.z >= -0.5, "{vertex}");
        }
        assert!(vertices(&scene).flatten().any(|vertex| vertex.z > 5.0));
    }
}

/// What a generator makes is what its file says, so both give the same picture.
#[test]
fn the_exact_text_of_a_generated_scene_reads_back_equal() {
    for scene in [
        tetra(4).unwrap(),
        sphereflake(2).unwrap(),
        city(50).unwrap(),
        forest(700).unwrap(),
        heightfield(20).unwrap(),
    ] {
        let mut text = Vec::new();
        write_nff(&scene, Precision::Exact, &mut text).unwrap();
        let loaded = nff(std::str::from_utf8(&text).unwrap()).unwrap();
        assert_eq!(loaded.scene, scene);
        assert_eq!(loaded.warnings, []);
    }
}

/// The file names a material anew wherever it comes back, so that materials are compared by object.
#[test]
fn scenes_whose_materials_come_back_read_back_as_they_look() {
    for scene in [graph(), quadric(), dgp(), bars(), rooms(3, 10).unwrap()] {
        let mut text = Vec::new();
        write_nff(&scene, Precision::Exact, &mut text).unwrap();
        let loaded = nff(std::str::from_utf8(&text).unwrap()).unwrap();
        assert_eq!(loaded.warnings, []);
        let looks = |scene: &Scene| -> Vec<_> {
            let objects = scene.objects.iter();
            let look = |object: &antumbra_scene::model::Object| {
                (
                    object.shape.clone(),
                    scene.materials[object.material].clone(),
                )
            };
            objects.map(look).collect()
        };
        assert_eq!(looks(&loaded.scene), looks(&scene));
        let bare = |mut scene: Scene| {
            scene.objects.clear();
            scene.materials.clear();
            scene
        };
        assert_eq!(bare(loaded.scene), bare(scene));
    }
}

/// The same bits on every platform, also where SPD's files are not at hand: FNV-1a of the text.
/// SPD's values were taken when `the_same_words_as_spd` passed.
#[test]
fn the_text_never_changes() {
    let digest = |scene: &Scene, precision| {
        let mut text = Vec::new();
        write_nff(scene, precision, &mut text).unwrap();
        text.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    };
    for (scene, six_digits, exact) in [
        (
            tetra(6).unwrap(),
            0x6871_26f9_942f_bb1c,
            0x72bb_539a_f63e_3835,
        ),
        (
            sphereflake(3).unwrap(),
            0x6cf9_b73a_eb24_b856,
            0xda3b_6290_03b4_509d,
        ),
        (
            city(200).unwrap(),
            0xe898_13f3_1644_1e6d,
            0x7751_00fb_c6e9_b0fe,
        ),
        (
            forest(1200).unwrap(),
            0x888f_a7a0_7425_af4b,
            0x168e_0a0e_4868_d586,
        ),
        (
            heightfield(70).unwrap(),
            0x9187_b482_b9a0_9599,
            0x0926_31e2_5f2d_96b8,
        ),
    ] {
        let found = (
            digest(&scene, Precision::SixDigits),
            digest(&scene, Precision::Exact),
        );
        assert_eq!(found, (six_digits, exact), "{found:#x?}");
    }
    // Their numbers have at most six digits.
    for (name, six_digits) in [
        ("graph", 0x36b3_92e5_85b5_e49a),
        ("quadric", 0xd07e_e42a_2074_0c67),
        ("dgp", 0xe8bb_c443_3371_48dd),
        ("bars", 0x5495_641f_bed9_7cf8),
        ("rooms", 0x4eef_d3e7_81ca_06cc),
    ] {
        let found = digest(&by_name(name, None, None).unwrap(), Precision::SixDigits);
        assert_eq!(found, six_digits, "{name}: {found:#x}");
    }
}
