//! Maps and values that are kept in files: the answers are those of rays whatever was taken from where, what holds no
//! longer is refused with the reason, and nothing that a file may hold does harm.

#[path = "../common/mod.rs"]
mod common;
mod damage;
mod processes;
mod world;

use std::fs;
use std::sync::Arc;

use antumbra::{Change, KeptLight, Method, Refine, Refinement, Refusal, SaveError, Volume};
use antumbra_geometry::{Coverage, DVec3, LightShape, Occluders, Opacity, Start};

use common::Random;
use world::{Folder, METHODS, World, ask, lamps, refinement, scene};

#[test]
fn eager_values_come_back_whole() {
    METHODS
        .into_iter()
        .for_each(check_eager_values_come_back_whole);
}

fn check_eager_values_come_back_whole(method: Method) {
    let world = World::new(64, Refine::Eager).by(method);
    let folder = Folder::new();
    let path = folder.file("all.antumbra");
    let made = world.index();
    assert!(made.kept_lights().is_empty());
    let saved = made.save(&path).expect("a file");
    assert_eq!(saved.bytes, fs::metadata(&path).expect("a file").len());
    assert_eq!(saved.pending_count, 0);
    assert_eq!(folder.names(), ["all.antumbra"]);

    let starts = world.starts(20_000, 7);
    let expected = world.expected(&starts);
    for refine in [Refine::Eager, Refine::Lazy, Refine::Asked] {
        let world = World {
            refinement: refinement(64, refine),
            ..World::new(64, refine).by(method)
        };
        let taken = world.load(&path).expect("it is taken");
        assert_eq!(taken.kept_lights(), [KeptLight::Taken; 2]);
        // Whether it pays or not.
        taken.set_refining(false);
        // What is known is what was known: bytes, if they are packed as well, and how each query is decided.
        let bytes = taken.occlusion_bytes();
        if refine == Refine::Eager {
            assert_holds_no_more(bytes, made.occlusion_bytes(), method);
        }
        for light in 0..2 {
            let (by_made, made_how) = ask(&made, &starts, light);
            let (by_taken, taken_how) = ask(&taken, &starts, light);
            assert!(by_made == by_taken && by_taken == expected[light]);
            let [made_how, taken_how] = [made_how.shadow, taken_how.shadow];
            assert_eq!(made_how.first_pass, taken_how.first_pass, "{refine:?}");
            assert_eq!(taken_how.rays, made_how.rays, "{refine:?}");
            if refine == Refine::Eager {
                assert_eq!(made_how, taken_how);
            }
        }
        // Nothing more was made, and nothing is lost by saving again.
        assert_eq!(taken.occlusion_bytes(), bytes);
        let again = folder.file("again.antumbra");
        taken.save(&again).expect("a file");
        assert!(fs::read(&again).expect("a file") == fs::read(&path).expect("a file"));
    }
}

#[test]
fn growing_values_are_saved_half_way_and_go_on() {
    METHODS
        .into_iter()
        .for_each(check_growing_values_are_saved_half_way_and_go_on);
}

/// What was taken holds as much as what was saved; maps no room for more, and nothing that was made anew since.
fn assert_holds_no_more(taken: u64, saved: u64, method: Method) {
    match method {
        Method::Auto => assert!((saved / 2..=saved).contains(&taken), "{taken} of {saved}"),
        _ => assert_eq!(taken, saved),
    }
}

fn check_growing_values_are_saved_half_way_and_go_on(method: Method) {
    for refine in [Refine::Asked, Refine::Lazy] {
        let world = World::new(256, refine).by(method);
        let folder = Folder::new();
        let path = folder.file("half.antumbra");
        let starts = world.starts(60_000, 3);
        let expected = world.expected(&starts);
        let first = world.index();
        let (half, halves) = (&starts[..20_000], |light: usize| {
            expected[light][..20_000].to_vec()
        });
        for round in 0..6 {
            // Only the first light is asked about in the first rounds.
            for light in 0..=usize::from(round > 3) {
                assert_eq!(ask(&first, half, light).0, halves(light));
            }
        }
        let saved = first.save(&path).expect("a file");
        // The few tiles of so few triangles may all be made.
        assert!(saved.pending_count > 0 || method == Method::Auto);
        let file = fs::read(&path).expect("a file");

        let second = world.load(&path).expect("it is taken");
        assert_eq!(second.kept_lights(), [KeptLight::Taken; 2]);
        assert_holds_no_more(second.occlusion_bytes(), first.occlusion_bytes(), method);
        second.set_refining(false);
        for light in 0..2 {
            let (found, how) = ask(&second, half, light);
            assert_eq!(found, halves(light));
            if refine == Refine::Asked {
                first.set_refining(false);
                assert_eq!(how.shadow, ask(&first, half, light).1.shadow);
            }
        }
        second.set_refining(true);
        let bytes = second.occlusion_bytes();
        for _ in 0..4 {
            world.assert_right(&second, &starts, &expected);
        }
        if refine == Refine::Asked && method == Method::Voxel {
            assert!(second.occlusion_bytes() > bytes, "nothing was made");
        }
        // The file was not changed by that; another one may be written, in its place, too.
        assert!(fs::read(&path).expect("a file") == file);
        second.save(&path).expect("a file");
        let third = world.load(&path).expect("it is taken");
        assert_holds_no_more(third.occlusion_bytes(), second.occlusion_bytes(), method);
        world.assert_right(&third, &starts, &expected);

        // What is pending is made by who wants everything before the first query.
        let eager = World::new(256, Refine::Eager).by(method);
        let fourth = eager.load(&path).expect("it is taken");
        assert_eq!(
            fourth
                .save(folder.file("all.antumbra"))
                .expect("a file")
                .pending_count,
            0
        );
        world.assert_right(&fourth, &starts, &expected);
        assert_eq!(
            ask(&fourth, &starts, 0).1.shadow.rays,
            ask(&eager.index(), &starts, 0).1.shadow.rays
        );
    }
}

#[test]
fn maps_of_which_tiles_are_missing_go_on() {
    let world = World::new(64, Refine::Asked).by(Method::Auto);
    let folder = Folder::new();
    let path = folder.file("half.antumbra");
    let (left, right): (Vec<_>, Vec<_>) = world
        .starts(20_000, 29)
        .into_iter()
        .partition(|start| start.point.x < -1.0);
    let first = world.index();
    world.assert_right(&first, &left, &world.expected(&left));
    let saved = first.save(&path).expect("a file");
    assert!(saved.pending_count > 10, "{}", saved.pending_count);
    let second = world.load(&path).expect("it is taken");
    let bytes = second.occlusion_bytes();
    // The file knows the one half, and the other one is made.
    for (starts, is_known) in [(left, true), (right, false)] {
        world.assert_right(&second, &starts, &world.expected(&starts));
        assert_eq!(second.occlusion_bytes() == bytes, is_known);
        assert_eq!(ask(&second, &starts, 0).1.shadow.rays, 0);
    }
    let whole = second.save(&path).expect("a file");
    assert!(whole.pending_count < saved.pending_count && whole.bytes > saved.bytes);
}

#[test]
fn values_are_saved_while_they_are_made() {
    METHODS
        .into_iter()
        .for_each(check_values_are_saved_while_they_are_made);
}

fn check_values_are_saved_while_they_are_made(method: Method) {
    let world = World::new(256, Refine::Asked).by(method);
    let folder = Folder::new();
    let starts = world.starts(40_000, 5);
    let expected = world.expected(&starts);
    let index = world.index();
    std::thread::scope(|scope| {
        let asking = [0, 1].map(|light| {
            let (index, starts, expected) = (&index, &starts, &expected);
            scope.spawn(move || {
                for _ in 0..3 {
                    for (starts, expected) in starts.chunks(500).zip(expected[light].chunks(500)) {
                        assert_eq!(ask(index, starts, light).0, expected);
                    }
                }
            })
        });
        let mut count = 0;
        while count == 0 || !asking.iter().all(|thread| thread.is_finished()) {
            let path = folder.file(&format!("{count}.antumbra"));
            index.save(&path).expect("a file");
            count += 1;
        }
    });
    for name in folder.names() {
        let taken = world.load(&folder.file(&name)).expect("it is taken");
        world.assert_right(&taken, &starts[..5_000], &world.expected(&starts[..5_000]));
    }
}

#[test]
fn one_light_that_changes_leaves_the_others() {
    METHODS
        .into_iter()
        .for_each(check_one_light_that_changes_leaves_the_others);
}

fn check_one_light_that_changes_leaves_the_others(method: Method) {
    let world = World::new(64, Refine::Eager).by(method);
    let folder = Folder::new();
    let path = folder.file("lights.antumbra");
    world.index().save(&path).expect("a file");
    let starts = world.starts(10_000, 9);
    let [lamp, sun] = lamps().try_into().expect("two lights");
    let LightShape::Point(position) = lamp else {
        panic!("a lamp")
    };
    let moved = LightShape::Point(DVec3::new(position.x.next_up(), position.y, position.z));
    use KeptLight::{Absent, Taken};
    for (lights, expected) in [
        (vec![moved, sun], vec![Absent, Taken]),
        (vec![sun, lamp], vec![Taken, Taken]),
        (vec![sun], vec![Taken]),
        (vec![sun, moved, sun], vec![Taken, Absent, Taken]),
        // As far as another one, in the same direction.
        (vec![LightShape::Direction(position)], vec![Absent]),
        (vec![], vec![]),
    ] {
        let world = World {
            lights,
            ..World::new(64, Refine::Eager).by(method)
        };
        let index = world.load(&path).expect("it is taken");
        assert_eq!(index.kept_lights(), expected);
        world.assert_right(&index, &starts, &world.expected(&starts));
        // Those that were made are as complete as those that were taken.
        let saved = index.save(folder.file("new.antumbra")).expect("a file");
        assert_eq!(saved.pending_count, 0);
        let made = world.index().occlusion_bytes();
        assert_holds_no_more(index.occlusion_bytes(), made, method);
    }
}

#[test]
fn stale_files_are_refused_with_the_reason() {
    let world = World::new(64, Refine::Lazy);
    let folder = Folder::new();
    let path = folder.file("old.antumbra");
    world.index().save(&path).expect("a file");
    let other = |nudge| World {
        occluders: scene(12, 60, nudge),
        ..World::new(64, Refine::Lazy)
    };
    assert!(other(0.0).load(&path).is_ok());
    assert_eq!(other(1e-9).refusal(&path), Refusal::Stale(Change::Scene));
    // The box of the scene is part of it, too.
    assert!(matches!(
        World {
            occluders: scene(13, 60, 0.0),
            ..World::new(64, Refine::Lazy)
        }
        .refusal(&path),
        Refusal::Stale(Change::Scene | Change::Cells)
    ));

    let usual = world.refinement;
    let setting = |name, found, expected| {
        Refusal::Stale(Change::Setting {
            name,
            found,
            expected,
        })
    };
    for (refinement, reason) in [
        (
            Refinement {
                resolution: 128,
                ..usual
            },
            setting("resolution", 64, 128),
        ),
        (
            Refinement {
                space_resolution: 64,
                ..usual
            },
            setting("resolution for points of space", 32, 64),
        ),
        (
            Refinement {
                short_list: 2,
                ..usual
            },
            setting("short list", 1, 2),
        ),
        (
            Refinement {
                space_list: 2,
                ..usual
            },
            setting("list for points of space", 8, 2),
        ),
        (
            Refinement {
                long_list: 2,
                ..usual
            },
            setting("long list", 32, 2),
        ),
    ] {
        let world = World {
            refinement,
            ..World::new(64, Refine::Lazy)
        };
        assert_eq!(world.refusal(&path), reason);
    }
    let by_rays = world.builder().method(Method::Bvh).occlusion_file(&path);
    let error = by_rays.build().expect_err("no values");
    assert!(
        error.to_string().ends_with("a method that keeps nothing"),
        "{error}"
    );
}

#[test]
fn stale_maps_are_refused_and_settings_of_voxels_are_none_of_theirs() {
    let maps = |nudge| World {
        occluders: scene(12, 60, nudge),
        ..World::new(64, Refine::Eager).by(Method::Auto)
    };
    let world = maps(0.0);
    let folder = Folder::new();
    let path = folder.file("maps.antumbra");
    world.index().save(&path).expect("a file");
    assert_eq!(maps(1e-9).refusal(&path), Refusal::Stale(Change::Scene));
    let finer = World {
        refinement: refinement(256, Refine::Eager),
        ..maps(0.0)
    };
    let index = finer.load(&path).expect("it is taken");
    assert_eq!(index.kept_lights(), [KeptLight::Taken; 2]);
}

#[test]
fn a_file_says_by_which_method_it_is_used() {
    let folder = Folder::new();
    let starts = World::new(64, Refine::Lazy).starts(2_000, 23);
    for saved in METHODS {
        let world = World::new(64, Refine::Eager).by(saved);
        let path = folder.file("file");
        world.index().save(&path).expect("a file");
        // The usual method takes what there is.
        let auto = World::new(64, Refine::Eager).by(Method::Auto);
        let index = auto.load(&path).expect("it is taken");
        assert_eq!(index.method(), saved);
        auto.assert_right(&index, &starts, &auto.expected(&starts));
        let voxel = World::new(64, Refine::Eager).by(Method::Voxel);
        match saved {
            Method::Auto => assert_eq!(voxel.refusal(&path), Refusal::OtherMethod),
            _ => assert_eq!(voxel.load(&path).expect("taken").method(), saved),
        }
        let by_rays = World::new(64, Refine::Eager).by(Method::Bvh);
        assert_eq!(by_rays.refusal(&path), Refusal::NoValues);
    }
}

#[test]
fn values_without_room_are_left_out() {
    METHODS
        .into_iter()
        .for_each(check_values_without_room_are_left_out);
}

fn check_values_without_room_are_left_out(method: Method) {
    let world = World::new(128, Refine::Eager).by(method);
    let folder = Folder::new();
    let path = folder.file("file");
    let whole = world.index();
    whole.save(&path).expect("a file");
    let starts = world.starts(10_000, 15);
    let expected = world.expected(&starts);
    let bytes = whole.knowledge_bytes();
    let mut seen = Vec::new();
    for share in [0, 4, 8, 12, 30] {
        let mut world = World::new(128, Refine::Lazy).by(method);
        world.refinement.memory = bytes * share / 10;
        let index = world
            .load(&path)
            .expect("it is taken as far as there is room");
        world.assert_right(&index, &starts, &expected);
        assert!(index.knowledge_bytes() <= world.refinement.memory);
        seen.extend(index.kept_lights().to_vec());
    }
    assert!(seen.contains(&KeptLight::Taken) && seen.contains(&KeptLight::NoRoom));
    assert_eq!(seen[..2], [KeptLight::NoRoom; 2]);
    assert_eq!(seen[8..], [KeptLight::Taken; 2]);
}

#[test]
fn what_found_no_room_may_still_be_made() {
    METHODS
        .into_iter()
        .for_each(check_what_found_no_room_may_still_be_made);
}

fn check_what_found_no_room_may_still_be_made(method: Method) {
    let world = World::new(64, Refine::Eager).by(method);
    let folder = Folder::new();
    let path = folder.file("part");
    let starts = world.starts(10_000, 16);
    let expected = world.expected(&starts);
    let whole = world.index().knowledge_bytes();
    let (mut part_count, mut is_any_partly_made) = (0, false);
    for share in [0, 2, 4, 8, 12, 16, 20, 24, 28, 32, 36, 40, 50, 60] {
        let mut small = World::new(64, Refine::Eager).by(method);
        small.refinement.memory = whole * share / 20;
        let index = small.index();
        small.assert_right(&index, &starts, &expected);
        let is_part = index.save(&path).expect("a file").pending_count > 0;
        part_count += u32::from(is_part);
        is_any_partly_made |= is_part && index.occlusion_bytes() > 0;
        // Who has room makes the rest.
        let index = world.load(&path).expect("it is taken");
        world.assert_right(&index, &starts, &expected);
        let pending_count = index.save(&path).expect("a file").pending_count;
        assert_eq!(pending_count, 0, "{share} {:?}", index.kept_lights());
    }
    assert!(part_count > 2 && is_any_partly_made, "{part_count}");
}

#[test]
fn lights_that_nobody_asked_take_no_words_and_are_made_later() {
    METHODS
        .into_iter()
        .for_each(check_lights_that_nobody_asked_take_no_words_and_are_made_later);
}

fn check_lights_that_nobody_asked_take_no_words_and_are_made_later(method: Method) {
    let world = World::new(64, Refine::Lazy).by(method);
    let folder = Folder::new();
    let path = folder.file("nothing");
    let saved = world.index().save(&path).expect("a file");
    assert!(saved.pending_count > 0 && saved.bytes < 1 << 20);
    let loaded = world.load(&path).expect("it is taken");
    assert_eq!(loaded.kept_lights(), [KeptLight::Taken; 2]);
    assert_eq!(loaded.knowledge_bytes(), 0);
    let starts = world.starts(2_000, 17);
    let expected = world.expected(&starts);
    world.assert_right(&loaded, &starts, &expected);
    // Whoever makes all makes these.
    let eager = World::new(64, Refine::Eager).by(method);
    let made = eager.load(&path).expect("it is taken");
    eager.assert_right(&made, &starts, &expected);
    assert_eq!(made.save(&path).expect("a file").pending_count, 0);
}

#[test]
fn a_volume_says_what_holds_in_all_of_a_cell() {
    let world = World::new(64, Refine::Eager);
    let index = world.index();
    let by_rays = world
        .builder()
        .method(Method::Bvh)
        .build()
        .expect("an index");
    let random = &mut Random(21);
    let scene = world.occluders.bounds();
    for resolution in [1, 2, 5, 8, 16, 32, 64] {
        let volume = index.volume(resolution).expect("values");
        let Volume {
            cells,
            min,
            edge,
            light_count,
            ref values,
        } = volume;
        assert_eq!(light_count, 2);
        assert_eq!(
            values.len() as u64,
            index.volume_bytes(resolution).expect("values")
        );
        let count: u32 = cells.iter().product();
        assert_eq!(values.len(), 2 * count as usize);
        assert_eq!(
            *cells.iter().max().expect("axes"),
            resolution.next_power_of_two()
        );
        // The cells hold the scene, and no layer of them is empty.
        let sizes = DVec3::from_array(cells.map(f64::from)) * edge;
        assert!((min.cmple(scene.min) & (min + sizes).cmpge(scene.max)).all());
        assert!((min + sizes - edge).cmple(scene.max).all());

        let mut asked = [0; 3];
        let mut mixed = [[false; 2]; 2];
        for _ in 0..4_000 {
            let at = cells.map(|count| random.below(count as usize));
            let inside = 0.5 * (random.in_cube() + 1.0);
            let corner = DVec3::from_array(at.map(|at| at as f64));
            let start = Start {
                point: min + edge * (corner + inside),
                surface: None,
            };
            for light in 0..2 {
                let place = (at[0] * cells[1] as usize + at[1]) * cells[2] as usize + at[2];
                let value = values[2 * place + light];
                let is_shadowed = ask(&by_rays, &[start], light).0[0];
                match value {
                    Volume::LIT => assert!(!is_shadowed, "{start:?}"),
                    Volume::SHADOWED => assert!(is_shadowed, "{start:?}"),
                    Volume::MIXED => mixed[light][usize::from(is_shadowed)] = true,
                    other => panic!("{other}"),
                }
                asked[usize::from(value)] += 1;
            }
        }
        if resolution >= 32 {
            assert!(asked.iter().all(|&count| count > 20), "{asked:?}");
        }
        assert_eq!(mixed, [[true; 2]; 2]);
    }
    // Values that were kept say the same.
    let folder = Folder::new();
    let path = folder.file("file");
    index.save(&path).expect("a file");
    let taken = world.load(&path).expect("it is taken");
    assert_eq!(taken.volume(32), index.volume(32));
    // Nothing is known, and nothing is made.
    let lazy = World::new(64, Refine::Lazy).index();
    let values = lazy.volume(8).expect("values").values;
    assert!(values.iter().all(|&value| value == Volume::MIXED));
    assert_eq!(by_rays.volume(8), None);
}

#[derive(Debug)]
struct Holes {
    is_told: bool,
    edge: f64,
}

impl Coverage for Holes {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        uv[0] > self.edge
    }

    fn identify(&self, write: &mut dyn FnMut(&[u8])) -> bool {
        write(&self.edge.to_le_bytes());
        self.is_told
    }
}

#[test]
fn holes_are_part_of_the_scene() {
    let world = |is_told, edge| {
        let mut builder = Occluders::builder();
        let holes = builder.add_coverage(Arc::new(Holes { is_told, edge }));
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let uvs = corners.map(|corner| [corner.x, corner.y]);
        builder
            .add_alpha_tested_face(&corners, &uvs, holes)
            .expect("a face");
        World {
            occluders: Arc::new(builder.build()),
            ..World::new(32, Refine::Lazy)
        }
    };
    let folder = Folder::new();
    let path = folder.file("file");
    world(true, 0.5).index().save(&path).expect("a file");
    assert!(world(true, 0.5).load(&path).is_ok());
    let refusal = world(true, 0.25).refusal(&path);
    assert_eq!(refusal, Refusal::Stale(Change::Scene));
    let refusal = world(false, 0.5).refusal(&path);
    assert!(matches!(refusal, Refusal::Unidentified(_)));
    let error = world(false, 0.5).index().save(&path);
    assert!(matches!(error, Err(SaveError::Unidentified(_))));
    // What cannot be told is not written over what can.
    assert!(world(true, 0.5).load(&path).is_ok());
    let by_rays = world(true, 0.5).builder().method(Method::Bvh).build();
    let error = by_rays.expect("an index").save(&path);
    assert_eq!(error, Err(SaveError::NoValues));
}

#[test]
fn scenes_without_values_are_kept_too() {
    METHODS
        .into_iter()
        .for_each(check_scenes_without_values_are_kept_too);
}

fn check_scenes_without_values_are_kept_too(method: Method) {
    let folder = Folder::new();
    let path = folder.file("file");
    // Nothing at all; and numbers that no values are made of.
    let empty = Arc::new(Occluders::builder().build());
    let mut far = Occluders::builder();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| corner * 1e29);
    far.add_face(&corners, Opacity::Opaque).expect("a face");
    for occluders in [empty, Arc::new(far.build())] {
        let world = World {
            occluders,
            ..World::new(32, Refine::Lazy).by(method)
        };
        world.index().save(&path).expect("a file");
        let index = world.load(&path).expect("it is taken");
        let start = Start {
            point: DVec3::ZERO,
            surface: None,
        };
        assert_eq!(ask(&index, &[start], 0).0, [false]);
    }
}
