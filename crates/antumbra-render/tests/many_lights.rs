//! Many lights: pictures are the same whether all lights of a point are asked at once or one by one.

use antumbra::{IndexOptions, Method};
use antumbra_geometry::DVec3;
use antumbra_render::aov::Aovs;
use antumbra_render::camera::View;
use antumbra_render::film::{RenderSettings, Rendered, Sampling, Show, Watch, render};
use antumbra_render::integrator::Tally;
use antumbra_render::prepare::Prepared;
use antumbra_scene::generate::rooms;
use antumbra_scene::model::{Color, Facing, Light, LightKind, Scene};
use antumbra_task::Task;

fn prepared(scene: Scene, method: Method) -> Prepared {
    let options = IndexOptions {
        method,
        ..IndexOptions::default()
    };
    Prepared::new(scene, &options).unwrap()
}

fn shot(prepared: &Prepared, threads: usize, show: Show) -> Rendered {
    let settings = RenderSettings {
        sampling: Sampling::Stratified { samples: 2 },
        show,
        aovs: Aovs {
            shadow: true,
            decided: false,
            fog: false,
        },
        ..RenderSettings::default()
    };
    let view = View::new(&prepared.scene().camera.unwrap(), [64, 48]).unwrap();
    let task = Task::default();
    let watch = Watch {
        task: &task,
        progress: &|_| {},
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| render(prepared, &view, &settings, watch))
}

/// Rooms with lamps, spots and suns, and mirrors.
fn flat(light_count: u32) -> Scene {
    let mut scene = rooms(2, light_count).unwrap();
    for (number, light) in scene.lights.iter_mut().enumerate() {
        light.kind = match (number % 5, light.kind) {
            (1, LightKind::Point { position }) => LightKind::Spot {
                position,
                axis: DVec3::new(0.3, 0.2, -1.0),
                inner_cosine: 0.9,
                outer_cosine: 0.7,
            },
            (2, _) => LightKind::Directional {
                towards_light: DVec3::new(number as f64 - 9.0, 4.0, 9.0),
            },
            (_, kind) => kind,
        };
    }
    for material in &mut scene.materials {
        material.reflection = Color::splat(0.2);
        material.specular = Color::splat(0.3);
        material.shininess = 5.0;
    }
    scene
}

/// Counts that do not depend on who answered.
fn of_geometry(tally: &Tally) -> [u64; 8] {
    let shadow = &tally.counters.shadow;
    let by = shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays;
    [
        tally.primary,
        tally.primary_hits,
        tally.reflection,
        tally.queries,
        tally.facing_away,
        tally.out_of_cone,
        by,
        shadow.shadowed,
    ]
}

#[test]
fn pictures_and_masks_are_the_same_at_once_and_one_by_one() {
    for (light_count, facing) in [(24, Facing::Winding), (70, Facing::Viewer)] {
        let scene = Scene {
            facing,
            ..flat(light_count)
        };
        let one_by_one = prepared(scene.clone(), Method::Auto).with_lights_one_by_one();
        assert!(!one_by_one.asks_lights_at_once());
        let expected = shot(&one_by_one, 1, Show::Scene);
        let [
            _,
            _,
            reflection,
            queries,
            facing_away,
            out_of_cone,
            asked,
            shadowed,
        ] = of_geometry(&expected.tally);
        assert!(reflection > 0 && facing_away > 0 && out_of_cone > 0 && shadowed > 0);
        assert_eq!(asked, queries - facing_away - out_of_cone);
        for method in [Method::Auto, Method::Voxel] {
            let at_once = prepared(scene.clone(), method);
            assert!(at_once.asks_lights_at_once());
            for threads in [1, 2, 7] {
                // The second time more is known.
                for round in 0..2 {
                    let label = format!("{light_count} {method:?} {threads} {round}");
                    let found = shot(&at_once, threads, Show::Scene);
                    assert!(found.picture == expected.picture, "{label}");
                    assert!(found.layers == expected.layers, "{label}");
                    assert_eq!(
                        of_geometry(&found.tally),
                        of_geometry(&expected.tally),
                        "{label}"
                    );
                }
            }
            let seen = shot(&at_once, 2, Show::Occlusion);
            assert!(seen.layers == expected.layers);
        }
    }
}

#[test]
fn few_lights_and_methods_that_know_nothing_are_asked_one_by_one() {
    for (count, method, is_at_once) in [
        (15, Method::Auto, false),
        (16, Method::Auto, true),
        (16, Method::Voxel, true),
        (70, Method::Bvh, false),
        (70, Method::Grid, false),
        (70, Method::Voxel1990, false),
        (70, Method::Naive, false),
    ] {
        let prepared = prepared(rooms(1, count).unwrap(), method);
        assert_eq!(
            prepared.asks_lights_at_once(),
            is_at_once,
            "{count} {method:?}"
        );
    }
}

#[test]
fn lights_in_the_plane_of_a_surface_reach_it_neither_way() {
    let mut scene = rooms(1, 16).unwrap();
    let along = |number: u32| LightKind::Directional {
        towards_light: DVec3::new(f64::from(number) + 1.0, 2.0, 0.0),
    };
    scene.lights = (0..16)
        .map(|number| Light {
            name: String::new(),
            kind: along(number),
            color: Color::ONE,
            falls_off: false,
        })
        .collect();
    let at_once = prepared(scene.clone(), Method::Auto);
    let one_by_one = prepared(scene, Method::Auto).with_lights_one_by_one();
    assert!(at_once.asks_lights_at_once());
    let [found, expected] = [&at_once, &one_by_one].map(|it| shot(it, 1, Show::Scene));
    assert!(found.picture == expected.picture && found.layers == expected.layers);
    assert_eq!(of_geometry(&found.tally), of_geometry(&expected.tally));
}
