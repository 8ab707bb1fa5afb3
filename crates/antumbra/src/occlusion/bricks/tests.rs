use std::collections::HashMap;

use fearless_simd::{Level, dispatch};

use super::super::testing::Random;
use super::*;
use crate::accel::frame::Frame;

const ROOT_PRICE: u32 = 3;
const PRICE: u32 = 5;
const ROOM: u64 = 32 << 20;

/// What was written in place of cells.
type Written = HashMap<(u32, [u32; 3]), Box<Decisions>>;

fn list(random: &mut Random) -> Decision {
    let first = random.below(3) as u32;
    let entries = (first..first + 1 + random.below(4) as u32).collect();
    Decision::List(entries)
}

/// A brick's cells: of every kind, or of so few that they may agree.
fn decisions(random: &mut Random) -> Box<Decisions> {
    let known = Decision::Known(random.below(2) == 0);
    let kinds = match random.below(8) {
        0 => vec![Decision::Nobody, known],
        1 => vec![Decision::Nobody, Decision::Ray],
        2 => vec![Decision::Nobody],
        3 => vec![known, Decision::Ray],
        _ => vec![
            Decision::Nobody,
            Decision::Known(false),
            Decision::Known(true),
            Decision::Ray,
            Decision::Pending,
            Decision::Pending,
            list(random),
            list(random),
            list(random),
        ],
    };
    Box::new(std::array::from_fn(|_| {
        kinds[random.below(kinds.len())].clone()
    }))
}

fn may_be_finer(decision: &Decision) -> bool {
    *decision == Decision::Pending
}

/// Writes bricks in place of a cell and of some that are finer.
fn write_below(
    store: &Store,
    random: &mut Random,
    finest: u32,
    (cell, place): (Cell, u32),
    written: &mut Written,
) {
    let decisions = decisions(random);
    let link = store.write(&decisions, PRICE).expect("room");
    store.publish(place, link);
    if let Some(brick) = link.brick() {
        let unfinished = store.unfinished(brick);
        let numbers: Vec<u32> = unfinished.iter().map(|&(_, number)| number).collect();
        let expected: Vec<u32> = (0..64)
            .filter(|&number| may_be_finer(&decisions[number as usize]))
            .collect();
        assert_eq!(numbers, expected);
        for (place, number) in unfinished {
            let finer = cell_in_brick(cell, number);
            if finer.level < finest && random.below(12) == 0 {
                write_below(store, random, finest, (finer, place), written);
            }
        }
    }
    written.insert((cell.level, cell.at), decisions);
}

/// Goes down what was written to a code; returns what must be found and the level of its cell.
fn expected(written: &Written, lattice: &Lattice, code: Code) -> (Decision, u32) {
    let mut cell = code.cell(lattice.root_level);
    let mut found = None;
    while let Some(cells) = written.get(&(cell.level, cell.at)) {
        if let Some(link) = agreed(cells) {
            let decision = match link.answer() {
                Some(is_shadowed) => Decision::Known(is_shadowed),
                None => Decision::Ray,
            };
            return (decision, cell.level);
        }
        cell = code.cell(cell.level + 2);
        let number = Code::place_of(cell.at.map(|at| at & 3));
        found = Some(cells[number].clone());
    }
    // Nothing was written.
    (found.unwrap_or(Decision::Pending), cell.level)
}

fn assert_says(store: &Store, link: Link, expected: &Decision, price: u32) {
    match expected {
        Decision::Nobody => assert_eq!(link, Link::LIT),
        Decision::Known(is_shadowed) => assert_eq!(link, Link::known(*is_shadowed)),
        Decision::Ray => assert_eq!(link, Link::RAY),
        Decision::Pending => assert_eq!(link, Link::pending(price)),
        Decision::Finer(finer) => assert_eq!(link, *finer),
        Decision::List(entries) => {
            let place = link.list().expect("a list");
            assert_eq!(store.surfaces(place), *entries);
        }
    }
}

fn assert_found(store: &Store, leaf: Leaf, expected: &Decision, price: u32) {
    let link = leaf.link;
    assert_says(store, link, expected, price);
    if leaf.place == 0 {
        assert!(link.answer().is_some(), "{leaf:?}");
    } else {
        assert_eq!(read(store.word(leaf.place)), link);
    }
}

#[test]
fn what_is_written_is_found() {
    let random = &mut Random(1);
    let (mut found_count, mut deepest, mut kinds) = (0, 0, [0; 5]);
    for _ in 0..40 {
        let scene = random.scene();
        let frame = Frame::new(scene);
        let finest: [u32; 3] = std::array::from_fn(|_| 2 + random.below(11) as u32);
        let lattices = finest.map(|finest| Lattice::new(&scene, &frame, finest));
        let room = Room::new(u64::MAX);
        let stores =
            [(); 2].map(|()| Store::new(&room, ROOM, &lattices, ROOT_PRICE).expect("room"));
        // Light and receiver class by light and receiver class.
        let mut all = Vec::new();
        for store in &stores {
            for class in ReceiverClass::ALL {
                let lattice = &lattices[class as usize];
                let finder = store.finder(class, lattice);
                let mut written = Written::new();
                let roots: Vec<Cell> = lattice.root_bricks().collect();
                for _ in 0..random.below(6) {
                    let cell = random.pick(&roots);
                    let target = (cell, finder.place_in_root(cell));
                    if !written.contains_key(&(cell.level, cell.at)) {
                        let finest = finest[class as usize];
                        write_below(store, random, finest, target, &mut written);
                    }
                }
                all.push((store, class, roots, written));
            }
        }
        for (store, class, roots, written) in &all {
            let lattice = &lattices[*class as usize];
            let finder = store.finder(*class, lattice);
            let mut near: Vec<Cell> = written
                .keys()
                .map(|&(level, at)| Cell { level, at })
                .collect();
            near.sort_unstable_by_key(|cell| (cell.level, cell.at));
            near.push(random.pick(roots));
            for _ in 0..300 {
                let cell = random.pick(&near);
                let point = random.in_box(&lattice.inflated(cell));
                let x = frame.point_in_frame(point).to_array().map(|x| x as f32);
                let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
                let leaf = finder.find(code);
                let root = code.place_in_root(lattice.root_shift());
                if root >= lattice.root_places() {
                    assert_eq!(leaf, Leaf::OUTSIDE);
                    continue;
                }
                if !lattice.is_inside(code.cell(lattice.root_level)) {
                    assert_eq!(leaf.link, Link::OUTSIDE);
                    continue;
                }
                let (decision, level) = expected(written, lattice, code);
                let is_root = level == lattice.root_level;
                let price = if is_root { ROOT_PRICE } else { PRICE };
                assert_found(store, leaf, &decision, price);
                assert_eq!(finder.level_of(code, lattice), level);
                found_count += 1;
                deepest = deepest.max(level);
                kinds[match decision {
                    Decision::Nobody => 0,
                    Decision::Known(_) => 1,
                    Decision::Ray => 2,
                    Decision::Pending | Decision::Finer(_) => 3,
                    Decision::List(_) => 4,
                }] += 1;
            }
        }
    }
    assert!(found_count > 20_000 && deepest >= 10, "{deepest}");
    assert!(kinds.iter().all(|&count| count > 500), "{kinds:?}");
}

#[test]
fn cells_of_a_brick_are_those_of_codes() {
    let random = &mut Random(2);
    let scene = random.scene();
    let frame = Frame::new(scene);
    for finest in 2..=12 {
        let lattice = Lattice::new(&scene, &frame, finest);
        for _ in 0..200 {
            let point = random.in_box(&scene);
            let x = frame.point_in_frame(point).to_array().map(|x| x as f32);
            let code = dispatch!(Level::new(), simd => lattice.code_of(simd, x));
            let (mut level, mut shift) = (lattice.root_level, lattice.coarsest_shift());
            while level < finest {
                let number = code.place_in_brick(shift);
                let cell = cell_in_brick(code.cell(level), number);
                assert_eq!(cell, code.cell(level + 2));
                level += 2;
                shift = shift.wrapping_sub(6);
            }
        }
    }
}

fn small_store(room_beside_roots: u64) -> (Store, Lattice) {
    let scene = Random(3).scene();
    let lattices = [2; 3].map(|finest| Lattice::new(&scene, &Frame::new(scene), finest));
    let room = Room::new(u64::MAX);
    let all = Store::new(&room, ROOM, &lattices, ROOT_PRICE).expect("room");
    // The first words of an arena are no one's.
    let roots = all.bytes().0 + 64;
    assert!(Store::new(&room, roots - 1, &lattices, ROOT_PRICE).is_none());
    let store = Store::new(&room, roots + room_beside_roots, &lattices, ROOT_PRICE);
    (store.expect("room"), lattices[0])
}

#[test]
fn a_brick_keeps_a_list_once() {
    let list = |entries: &[u32]| Decision::List(entries.into());
    let mut cells: Box<Decisions> = Box::new([const { Decision::Nobody }; 64]);
    for (number, cell) in cells.iter_mut().enumerate() {
        *cell = match number % 4 {
            0 => list(&[7, 9]),
            1 => list(&[7]),
            2 => list(&[7, 9, 11]),
            _ => Decision::Ray,
        };
    }
    let (store, _) = small_store(ROOM);
    let before = store.bytes();
    let brick = |store: &Store| {
        let link = store.write(&cells, PRICE).expect("room");
        link.brick().expect("a brick")
    };
    let first = brick(&store);
    let after = store.bytes();
    // Lists of one, two and three entries and their lengths, in words by fours.
    assert_eq!(after.1 - before.1, 4 * (4 + 4 + 4));
    assert_eq!(after.0 - before.0, 4 * (PLANES as u64 + 64));
    let lists = |brick: usize| -> Vec<Option<usize>> {
        let word = |number| store.word((brick + PLANES + number) as u32);
        (0..64).map(|number| read(word(number)).list()).collect()
    };
    let places = lists(first);
    for (number, place) in places.iter().enumerate() {
        assert_eq!(place.is_some(), number % 4 != 3);
        assert_eq!(*place, places[number % 4]);
    }
    assert!(places[0] != places[1] && places[1] != places[2]);
    // Another brick has lists of its own.
    let others = lists(brick(&store));
    assert!(others[..3].iter().all(|other| !places.contains(other)));
}

#[test]
fn cells_that_agree_need_no_brick() {
    use Decision::{Known, Nobody, Pending, Ray};
    let of = |kinds: &[Decision]| {
        let cell = |number: usize| kinds[number % kinds.len()].clone();
        agreed(&std::array::from_fn(cell))
    };
    let list = Decision::List([1].into());
    let finer = |link| Decision::Finer(link);
    assert_eq!(of(&[Nobody]), Some(Link::LIT));
    assert_eq!(of(&[Known(true)]), Some(Link::SHADOWED));
    assert_eq!(of(&[Nobody, Known(true)]), Some(Link::SHADOWED));
    assert_eq!(of(&[Known(false), Nobody]), Some(Link::LIT));
    assert_eq!(of(&[Nobody, Nobody, Ray]), Some(Link::RAY));
    // So do finer cells that need none.
    let shadowed = [finer(Link::SHADOWED), Nobody, Known(true)];
    assert_eq!(of(&shadowed), Some(Link::SHADOWED));
    assert_eq!(of(&[Ray, finer(Link::RAY)]), Some(Link::RAY));
    for kinds in [
        [Known(true), Known(false)],
        [Known(true), Ray],
        [Nobody, Pending],
        [Pending, Pending],
        [list.clone(), list],
        [finer(Link::to_brick(4)), finer(Link::to_brick(4))],
        [finer(Link::LIT), Known(true)],
    ] {
        assert_eq!(of(&kinds), None, "{kinds:?}");
    }
    // One cell of 64 is enough.
    for odd in 0..64 {
        let mut cells = [const { Known(true) }; 64];
        cells[odd] = Known(false);
        assert_eq!(agreed(&cells), None, "{odd}");
    }
}

#[test]
fn a_full_store_keeps_what_it_has() {
    let random = &mut Random(4);
    let (store, lattice) = small_store(40_000);
    let finder = store.finder(ReceiverClass::Front, &lattice);
    let roots: Vec<Cell> = lattice.root_bricks().collect();
    let place = finder.place_in_root(roots[0]);
    let pending: Box<Decisions> = Box::new(std::array::from_fn(|number| match number {
        0 => Decision::Known(true),
        _ => Decision::Pending,
    }));
    let link = store.write(&pending, PRICE).expect("room");
    store.publish(place, link);
    let links = store.unfinished(link.brick().expect("a brick"));
    // Until there is no room for the least brick, list or link.
    let mut refused_count = 0;
    let mut kept = Vec::new();
    for _ in 0..2_000 {
        let decisions = decisions(random);
        match store.write(&decisions, PRICE) {
            Some(link) => kept.push((link, decisions)),
            None => refused_count += 1,
        }
    }
    assert!(refused_count > 100 && kept.len() > 100);
    let long: Vec<u32> = (0..10_000).collect();
    assert_eq!(store.put_list(&long), None);
    assert_eq!(store.write(&pending, PRICE), None);
    // Answers need no room.
    let rays = [const { Decision::Ray }; 64];
    assert_eq!(store.write(&rays, PRICE), Some(Link::RAY));
    assert_eq!(store.unfinished(link.brick().expect("a brick")), links);
    for (link, decisions) in kept {
        let Some(brick) = link.brick() else {
            assert_eq!(Some(link), agreed(&decisions));
            continue;
        };
        store.publish(place, link);
        for (number, decision) in decisions.iter().enumerate() {
            let number = number as u32;
            let (value, before) = value_of(store.arena.words_from(brick), number);
            let leaf = match value.of_surface_point() {
                Some(is_shadowed) => Leaf::of(is_shadowed),
                None => {
                    let place = brick + PLANES + before;
                    Leaf {
                        link: read(store.word(place as u32)),
                        place: place as u32,
                    }
                }
            };
            assert_found(&store, leaf, decision, PRICE);
        }
    }
}

#[test]
fn a_brick_leads_to_finer_ones_that_were_made_before_it() {
    let (store, _) = small_store(ROOM);
    let cells: Box<Decisions> = Box::new(std::array::from_fn(|number| {
        Decision::Known(number % 3 == 0)
    }));
    let below = store.write(&cells, PRICE).expect("room");
    let finer = [below, Link::LIT, Link::SHADOWED, Link::RAY];
    let cells: Box<Decisions> = Box::new(std::array::from_fn(|number| {
        Decision::Finer(finer[number % 4])
    }));
    let brick = store.write(&cells, PRICE).expect("room");
    let brick = brick.brick().expect("a brick");
    assert_eq!(store.cells(brick).as_slice(), [finer; 16].as_flattened());
    // Answers and rays need nothing more.
    let unfinished: Vec<u32> = store.unfinished(brick).iter().map(|&(_, n)| n).collect();
    assert_eq!(unfinished, (0..64).step_by(4).collect::<Vec<u32>>());
}
