//! Small scenes, rendered whole: what is asked, what is counted, what may not matter.

use antumbra::{IndexOptions, Method};
use antumbra_geometry::{DVec3, Sphere};
use antumbra_render::camera::View;
use antumbra_render::film::{RenderSettings, Rendered, Sampling, Show, Watch, render};
use antumbra_render::prepare::{PrepareError, Prepared};
use antumbra_scene::gather::GatherError;
use antumbra_scene::model::{
    Camera, Color, Corner, Facing, Light, LightKind, Material, Mesh, Object, Polygon, Scene, Shape,
};
use antumbra_task::Task;

fn object(shape: Shape, material: usize) -> Object {
    Object {
        name: String::new(),
        shape,
        material,
    }
}

fn square(half: f64, z: f64) -> Polygon {
    let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, z);
    Polygon {
        vertices: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        normals: Vec::new(),
    }
}

fn light(kind: LightKind) -> Light {
    Light {
        name: String::new(),
        kind,
        color: Color::ONE,
        falls_off: false,
    }
}

/// A ball over a square floor that fills the view from above.
fn ball_on_floor() -> Scene {
    Scene {
        materials: vec![
            Material::default(),
            Material {
                reflection: Color::splat(0.5),
                ..Material::default()
            },
        ],
        objects: vec![
            object(Shape::Polygon(square(10.0, 0.0)), 0),
            object(
                Shape::Sphere(Sphere {
                    center: DVec3::new(0.0, 0.0, 1.0),
                    radius: 0.5,
                }),
                1,
            ),
        ],
        lights: vec![
            light(LightKind::Point {
                position: DVec3::new(3.0, 1.0, 6.0),
            }),
            light(LightKind::Directional {
                towards_light: DVec3::new(-1.0, -1.0, 2.0),
            }),
        ],
        ..Scene::default()
    }
}

fn above() -> Camera {
    Camera {
        eye: DVec3::new(0.1, -0.2, 7.0),
        at: DVec3::ZERO,
        up: DVec3::Y,
        vertical_fov_degrees: 50.0,
        resolution: None,
    }
}

fn below() -> Camera {
    Camera {
        eye: DVec3::new(0.1, -0.2, -7.0),
        ..above()
    }
}

fn prepared(scene: Scene, method: Method) -> Prepared {
    Prepared::new(
        scene,
        &IndexOptions {
            method,
            ..IndexOptions::default()
        },
    )
    .unwrap()
}

fn shot(prepared: &Prepared, camera: &Camera, settings: RenderSettings) -> Rendered {
    let view = View::new(camera, [40, 30]).unwrap();
    let task = Task::default();
    render(
        prepared,
        &view,
        &settings,
        Watch {
            task: &task,
            progress: &|_| {},
        },
    )
}

fn quick(scene: Scene, camera: &Camera) -> Rendered {
    shot(
        &prepared(scene, Method::Grid),
        camera,
        RenderSettings::default(),
    )
}

#[test]
fn every_hit_asks_every_light_once() {
    for method in [Method::Voxel1990, Method::Grid, Method::Naive] {
        for show in [Show::Scene, Show::Occlusion] {
            let settings = RenderSettings {
                max_depth: 0,
                show,
                ..RenderSettings::default()
            };
            let tally = shot(&prepared(ball_on_floor(), method), &above(), settings).tally;
            assert_eq!(tally.primary, 1200);
            assert_eq!(tally.primary_hits, 1200);
            assert_eq!(tally.queries, 2 * tally.primary_hits);
            let shadow = tally.counters.shadow;
            assert_eq!(
                shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays,
                tally.queries - tally.facing_away - tally.out_of_cone
            );
            assert!(shadow.shadowed > 0);
        }
    }
}

#[test]
fn the_picture_depends_neither_on_the_method_nor_on_threads() {
    for sampling in [Sampling::Corners, Sampling::Stratified { samples: 5 }] {
        let settings = RenderSettings {
            sampling,
            ..RenderSettings::default()
        };
        let expected = shot(
            &prepared(ball_on_floor(), Method::Naive),
            &above(),
            settings,
        );
        assert_eq!(expected.picture.pixels.len(), 1200);
        for method in [Method::Voxel1990, Method::Grid, Method::Naive] {
            let prepared = prepared(ball_on_floor(), method);
            for threads in [1, 2, 7] {
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .unwrap();
                let found = pool.install(|| shot(&prepared, &above(), settings));
                assert!(
                    found.picture == expected.picture,
                    "{method:?}, {threads} threads"
                );
                assert_eq!(found.tally.queries, expected.tally.queries);
            }
        }
    }
}

#[test]
fn seen_from_behind_a_wound_surface_keeps_its_front_and_a_plain_one_turns() {
    let of = |facing, camera: &Camera| {
        let mut scene = Scene {
            facing,
            ..ball_on_floor()
        };
        scene.objects.truncate(1);
        quick(scene, camera).tally
    };
    // The lights are above: in front for who looks from above.
    assert_eq!(of(Facing::Viewer, &above()).facing_away, 0);
    assert_eq!(of(Facing::Winding, &above()).facing_away, 0);
    // From below, the side that is looked at is dark; the side that is wound is as it was.
    let turned = of(Facing::Viewer, &below());
    assert_eq!(turned.facing_away, turned.queries);
    let wound = of(Facing::Winding, &below());
    assert!(wound.queries > 0);
    assert_eq!(wound.facing_away, 0);
}

#[test]
fn a_light_in_the_plane_of_a_surface_is_not_in_front() {
    let mut scene = ball_on_floor();
    scene.objects.truncate(1);
    scene.lights = vec![light(LightKind::Directional {
        towards_light: DVec3::new(1.0, 2.0, 0.0),
    })];
    let tally = quick(scene, &above()).tally;
    assert_eq!(tally.facing_away, tally.queries);
}

#[test]
fn outside_a_spots_cone_nothing_is_asked() {
    let mut scene = ball_on_floor();
    scene.lights = vec![light(LightKind::Spot {
        position: DVec3::new(0.0, 0.0, 5.0),
        axis: DVec3::NEG_Z,
        inner_cosine: 0.98,
        outer_cosine: 0.95,
    })];
    let tally = quick(scene, &above()).tally;
    let asked = tally.queries - tally.facing_away - tally.out_of_cone;
    assert!(tally.out_of_cone > 0 && asked > 0, "{tally:?}");
    assert!(tally.counters.shadow.shadowed > 0);
}

#[test]
fn mirrors_add_rays_up_to_the_depth() {
    let prepared = prepared(ball_on_floor(), Method::Grid);
    let reflection = |max_depth| {
        let settings = RenderSettings {
            max_depth,
            ..RenderSettings::default()
        };
        shot(&prepared, &above(), settings).tally.reflection
    };
    assert_eq!(reflection(0), 0);
    assert_eq!(reflection(1), 0);
    assert!(reflection(2) > 0);
    // The ball reflects floor and sky, neither of which reflects.
    assert_eq!(reflection(5), reflection(2));
}

#[test]
fn glass_blocks_no_light_and_lets_the_ground_be_seen() {
    let mut scene = ball_on_floor();
    scene.materials[1] = Material {
        transmission: Color::splat(0.9),
        ior: 1.5,
        ..Material::default()
    };
    let tally = quick(scene, &above()).tally;
    assert_eq!(tally.counters.shadow.shadowed, 0);
    assert!(tally.refraction > 0);
}

#[test]
fn shading_normals_move_no_shadow_and_no_query() {
    let flat = quick(ball_on_floor(), &above());
    let mut scene = ball_on_floor();
    scene.objects[0].shape = Shape::Polygon(Polygon {
        // Leaning, reversed, zero and absent.
        normals: vec![DVec3::new(3.0, 0.0, 1.0), DVec3::NEG_Z, DVec3::ZERO],
        ..square(10.0, 0.0)
    });
    let leaning = quick(scene, &above());
    assert_eq!(leaning.tally, flat.tally);
    assert!(leaning.picture != flat.picture);
}

#[test]
fn a_mesh_looks_like_its_polygons() {
    let floor = square(10.0, 0.0);
    let corners = [0, 1, 2, 3].map(Corner::at);
    let mesh = Mesh {
        positions: floor.vertices,
        corners: corners.to_vec(),
        face_ends: vec![4],
        ..Mesh::default()
    };
    let mut scene = ball_on_floor();
    scene.objects[0].shape = Shape::Mesh(mesh.clone());
    assert!(quick(scene, &above()).picture == quick(ball_on_floor(), &above()).picture);

    let mut broken = ball_on_floor();
    broken.objects[0].shape = Shape::Mesh(Mesh {
        face_ends: vec![9],
        ..mesh
    });
    let error = Prepared::new(broken, &IndexOptions::default()).unwrap_err();
    assert!(
        matches!(
            error,
            PrepareError::Gather(GatherError::BadIndex { object: 0, .. })
        ),
        "{error}"
    );
}

#[test]
fn an_empty_scene_shows_its_background() {
    let scene = Scene {
        background: Color::new(0.25, 0.5, 1.0),
        ..Scene::default()
    };
    let rendered = quick(scene, &above());
    assert!(
        rendered
            .picture
            .pixels
            .iter()
            .all(|&pixel| pixel == [0.25, 0.5, 1.0])
    );
    assert_eq!(rendered.tally.queries, 0);
}

#[test]
fn a_cancelled_picture_says_so_and_counts_finished_tiles_only() {
    let prepared = prepared(ball_on_floor(), Method::Grid);
    let view = View::new(&above(), [100, 100]).unwrap();
    let task = Task::default();
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let progress = |_| task.stop();
    let rendered = pool.install(|| {
        let watch = Watch {
            task: &task,
            progress: &progress,
        };
        render(&prepared, &view, &RenderSettings::default(), watch)
    });
    assert!(!rendered.is_complete);
    assert_eq!(rendered.tally.primary, 1024);
    let black = rendered
        .picture
        .pixels
        .iter()
        .filter(|&&pixel| pixel == [0.0; 3])
        .count();
    assert_eq!(black, 10_000 - 1024);
}
