//! Files of more than there is room for, and what is made later.

use antumbra::{Method, Refine, SavedLight};

use crate::world::{Folder, METHODS, World};

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
        seen.extend(index.saved_lights().to_vec());
    }
    assert!(seen.contains(&SavedLight::Loaded) && seen.contains(&SavedLight::NoRoom));
    assert_eq!(seen[..2], [SavedLight::NoRoom; 2]);
    assert_eq!(seen[8..], [SavedLight::Loaded; 2]);
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
        assert_eq!(pending_count, 0, "{share} {:?}", index.saved_lights());
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
    assert_eq!(loaded.saved_lights(), [SavedLight::Loaded; 2]);
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
