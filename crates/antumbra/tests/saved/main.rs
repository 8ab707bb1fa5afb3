//! Maps and values that are saved in files: the answers are those of rays whatever was taken from where, what holds no
//! longer is refused with the reason, and nothing that a file may hold does harm.

#[path = "../common/mod.rs"]
mod common;
mod damage;
mod processes;
mod refused;
mod room;
mod world;

use std::fs;
use std::sync::Arc;

use antumbra::{Method, Refine, SavedLight, Volume};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, ReceiverPoint};

use common::Random;
use world::{Folder, METHODS, World, ask, lamps, refinement};

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
    assert!(made.saved_lights().is_empty());
    let saved = made.save(&path).expect("a file");
    assert_eq!(saved.bytes, fs::metadata(&path).expect("a file").len());
    assert_eq!(saved.pending_count, 0);
    assert_eq!(folder.names(), ["all.antumbra"]);

    let starts = world.starts(20_000, 7);
    let expected = world.expected(&starts);
    for refine in [Refine::Eager, Refine::Lazy, Refine::Queried] {
        let world = World {
            refinement: refinement(64, refine),
            ..World::new(64, refine).by(method)
        };
        let taken = world.load(&path).expect("it is taken");
        assert_eq!(taken.saved_lights(), [SavedLight::Loaded; 2]);
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
    for refine in [Refine::Queried, Refine::Lazy] {
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
        assert_eq!(second.saved_lights(), [SavedLight::Loaded; 2]);
        assert_holds_no_more(second.occlusion_bytes(), first.occlusion_bytes(), method);
        second.set_refining(false);
        for light in 0..2 {
            let (found, how) = ask(&second, half, light);
            assert_eq!(found, halves(light));
            if refine == Refine::Queried {
                first.set_refining(false);
                assert_eq!(how.shadow, ask(&first, half, light).1.shadow);
            }
        }
        second.set_refining(true);
        let bytes = second.occlusion_bytes();
        for _ in 0..4 {
            world.assert_right(&second, &starts, &expected);
        }
        if refine == Refine::Queried && method == Method::Voxel {
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
    let world = World::new(64, Refine::Queried).by(Method::Auto);
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
    let world = World::new(256, Refine::Queried).by(method);
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
    use SavedLight::{Absent, Loaded};
    for (lights, expected) in [
        (vec![moved, sun], vec![Absent, Loaded]),
        (vec![sun, lamp], vec![Loaded, Loaded]),
        (vec![sun], vec![Loaded]),
        (vec![sun, moved, sun], vec![Loaded, Absent, Loaded]),
        // As far as another one, in the same direction.
        (vec![LightShape::Direction(position)], vec![Absent]),
        (vec![], vec![]),
    ] {
        let world = World {
            lights,
            ..World::new(64, Refine::Eager).by(method)
        };
        let index = world.load(&path).expect("it is taken");
        assert_eq!(index.saved_lights(), expected);
        world.assert_right(&index, &starts, &world.expected(&starts));
        // Those that were made are as complete as those that were taken.
        let saved = index.save(folder.file("new.antumbra")).expect("a file");
        assert_eq!(saved.pending_count, 0);
        let made = world.index().occlusion_bytes();
        assert_holds_no_more(index.occlusion_bytes(), made, method);
    }
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
            let start = ReceiverPoint {
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
    // Values that were saved say the same.
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
        let start = ReceiverPoint {
            point: DVec3::ZERO,
            surface: None,
        };
        assert_eq!(ask(&index, &[start], 0).0, [false]);
    }
}
