//! Answers of maps against all surfaces, one by one, for starts where answers are delicate.

use antumbra_geometry::{
    Cone, DVec3, Disk, Occluders, OccludersBuilder, Opacity, ReceiverPoint, Sphere, SurfaceId,
};
use fearless_simd::{Level, dispatch};

use super::super::forms::START_ROOM;
use super::super::room::Room;
use super::super::tables::{LightTables, SceneTables};
use super::super::testing::Random;
use super::facet::{Depths, Facet};
use super::words::{HEAD, SLANT_WORDS, entry_counts};
use super::*;

/// Triangles of all sizes that share corners, panes, balls, a cone, a disk; numbers are whole half the time.
fn scene(random: &mut Random) -> Occluders {
    let mut builder = Occluders::builder();
    let is_whole = random.below(2) == 0;
    let point = |random: &mut Random| {
        let point = 3.0 * random.in_cube();
        if is_whole { point.round() } else { point }
    };
    let mut pool: Vec<DVec3> = (0..7).map(|_| point(random)).collect();
    for _ in 0..5 {
        let near = pool[random.below(pool.len())];
        pool.push(near + random.pick(&[1e-6, 0.01, 0.1]) * random.in_cube());
    }
    let opacity = |random: &mut Random| match random.below(6) {
        0 => Opacity::Transparent,
        _ => Opacity::Opaque,
    };
    for _ in 0..1 + random.below(12) {
        let corners = [(); 3].map(|()| pool[random.below(pool.len())]);
        builder.add_face(&corners, opacity(random)).expect("a face");
    }
    match random.below(4) {
        0 => heightfield(&mut builder, random),
        1 => wound_fan(&mut builder, random),
        _ => {}
    }
    for _ in 0..random.below(4) {
        let center = point(random);
        let radius = random.pick(&[0.01, 0.2, 0.5, 1.0]);
        let sphere = Sphere { center, radius };
        builder
            .add_sphere(sphere, opacity(random))
            .expect("a sphere");
    }
    if random.below(3) == 0 {
        let disk = Disk {
            center: point(random),
            normal: random.in_cube(),
            radius: 0.7,
        };
        builder.add_disk(disk, Opacity::Opaque).expect("a disk");
        let cone = Cone {
            base: DVec3::ZERO,
            base_radius: 0.5,
            apex: DVec3::new(0.3, 1.0, 0.2),
            apex_radius: 0.2,
            is_closed: random.below(2) == 0,
        };
        builder.add_cone(cone, Opacity::Opaque).expect("a cone");
    }
    builder.build()
}

/// A field of triangles, smooth or rough, with holes and double faces.
fn heightfield(builder: &mut OccludersBuilder, random: &mut Random) {
    let count = 3 + random.below(6);
    let rough = random.pick(&[0.0, 0.02, 0.3, 2.0]);
    let height: Vec<f64> = (0..=count * (count + 1) + count)
        .map(|_| rough * random.real(-1.0, 1.0))
        .collect();
    let step = 4.0 / count as f64;
    let at = |i: usize, j: usize| {
        let z = height[i * (count + 1) + j];
        DVec3::new(step * i as f64 - 2.0, step * j as f64 - 2.0, z)
    };
    for i in 0..count {
        for j in 0..count {
            let square = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let mut face = corners.map(|corner| square[corner]);
                match random.below(24) {
                    0 => continue,
                    1 => face.swap(0, 1),
                    2 => {
                        let twin = [face[1], face[0], face[2]];
                        builder.add_face(&twin, Opacity::Opaque).expect("a face");
                    }
                    _ => {}
                }
                let opacity = match random.below(40) {
                    0 => Opacity::Transparent,
                    _ => Opacity::Opaque,
                };
                builder.add_face(&face, opacity).expect("a face");
            }
        }
    }
}

/// Triangles about a corner that they wind round once or more often, seen from above.
fn wound_fan(builder: &mut OccludersBuilder, random: &mut Random) {
    let turns = random.pick(&[1.0, 2.0, 3.0]);
    let count = 5 + 4 * turns as usize;
    let is_closed = random.below(3) > 0;
    let tip = random.pick(&[0.0, 0.3, -0.3]);
    let rim: Vec<DVec3> = (0..count)
        .map(|number| {
            let angle = turns * std::f64::consts::TAU * number as f64 / count as f64;
            let height = random.pick(&[0.0, 0.1, 0.5]) * random.real(-1.0, 1.0);
            DVec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), height)
        })
        .collect();
    for number in 0..count - usize::from(!is_closed) {
        let face = [
            DVec3::new(0.01, 0.02, tip),
            rim[number],
            rim[(number + 1) % count],
        ];
        builder.add_face(&face, Opacity::Opaque).expect("a face");
    }
}

/// A start anywhere, on a surface, at the border of a shadow or of a column.
fn start(
    occluders: &Occluders,
    frame: &Frame,
    light: &LightShape,
    views: &Views,
    random: &mut Random,
) -> ReceiverPoint {
    let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
    let corners = occluders.triangle_positions(surface);
    let on_surface = |random: &mut Random| match (corners, occluders.sphere(surface)) {
        (Some([a, b, c]), _) => {
            let (s, t) = random.pick(&[(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.5, 0.0)]);
            let (s, t) = match random.below(3) {
                0 => (s, t),
                _ => (random.real(0.0, 1.0), random.real(0.0, 1.0)),
            };
            a + s * (b - a) + t * (1.0 - s) * (c - a)
        }
        (None, Some(sphere)) => {
            sphere.center + sphere.radius * random.in_cube().normalize_or_zero()
        }
        (None, None) => random.in_box(&occluders.surface_bounds(surface)),
    };
    let has_place = corners.is_some() || occluders.sphere(surface).is_some();
    let point = match random.below(4) {
        0 if has_place => {
            return ReceiverPoint {
                point: on_surface(random),
                surface: Some(surface),
            };
        }
        1 => {
            let edge = on_surface(random);
            let away = -light.towards(edge).normalize_or_zero();
            edge + random.pick(&[1e-6, 1e-3, 1.0]) * random.real(0.0, 2.0) * away
        }
        2 => {
            let view = views.all[random.below(views.all.len())];
            let place = [0, 1].map(|axis| {
                let tile = random.below(view.size[axis] + 1) as f64;
                tile + random.pick(&[0.0, 0.0, 0.25, 1.0 / 32.0]) + random.pick(&[0.0, 1e-6, -1e-6])
                    - view.shift[axis]
            });
            let depth = random.real(-1.0, 1.0);
            let weight = view.weight(depth) / view.scale;
            let seen = view.axes[0] * place[0] * weight
                + view.axes[1] * place[1] * weight
                + view.axes[2] * depth;
            frame.center + (view.origin + seen) / frame.scale
        }
        _ => random.in_box(&occluders.bounds()),
    };
    ReceiverPoint {
        point,
        surface: None,
    }
}

/// A light anywhere, or on a triangle but for rounding, or close to it.
fn light(occluders: &Occluders, random: &mut Random) -> LightShape {
    let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
    match occluders.triangle_positions(surface) {
        Some([a, b, c]) if random.below(3) == 0 => {
            let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
            let off = random.pick(&[0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3]);
            let on_triangle = a + s * (b - a) + t * (1.0 - s) * (c - a);
            LightShape::Point(on_triangle + off * random.in_cube())
        }
        _ => random.light(&occluders.bounds()),
    }
}

#[test]
fn what_a_map_tells_is_what_surfaces_do() {
    let random = &mut Random(1);
    let (mut lit, mut full, mut listed, mut unknown) = (0, 0, 0, 0);
    let (mut slanted, mut free, mut wide) = (0, 0, 0);
    let (mut lit_faces, mut full_faces) = (0, 0);
    for _ in 0..1_000 {
        let occluders = scene(random);
        if occluders.bounds().size().max_element() < 0.1 {
            continue;
        }
        let frame = Frame::new(occluders.bounds());
        let light = light(&occluders, random);
        let scene_tables = SceneTables::new(&occluders, &frame, true);
        let room = Room::new(1 << 30);
        scene_tables.make_mesh(&occluders, &room, false);
        let light_tables = LightTables::new(&occluders, &frame, &light);
        let tables = Tables::new(&occluders, &frame, &light, &scene_tables, &light_tables);
        let count = random.pick(&[30.0, 400.0, 3_000.0]);
        let Some(map) = Map::with_tiles(&occluders, &tables, 1 << 28, count) else {
            continue;
        };
        let is_lazy = random.below(3) == 0;
        if !is_lazy {
            map.make_all(&tables, random.pick(&[1e2, 1e4, 1e9]));
        }
        for _ in 0..150 {
            let given = start(&occluders, &frame, &light, &map.views, random);
            let room = START_ROOM / frame.scale;
            let mut moved = given;
            if given.surface.is_none() {
                moved.point += room * random.of_cube();
            }
            let segment = occluders.segment(&moved, &light);
            let x = frame
                .point_in_frame(given.point)
                .to_array()
                .map(|x| x as f32);
            // As far as starts are asked about that are where they seem to be.
            let off = (segment.origin() - given.point).abs().max_element();
            if x.iter().any(|x| x.abs() > 1.25) || off > room {
                continue;
            }
            let located = dispatch!(Level::new(), simd => map.locate(simd, &x.map(|x| [x; 8])));
            if located.tiles[0] == NOWHERE {
                continue;
            }
            let is_listed = given.surface.is_some_and(|surface| {
                tables
                    .side(surface.0 as usize)
                    .is_some_and(|side| side != 0)
                    && occluders.is_opaque(surface)
            });
            let (mut words, mut cells) = dispatch!(Level::new(), simd => map.words(simd, &located));
            if is_lazy {
                // Whoever asks in vain makes a tile; a list that was asked too often is cut.
                if Word(words[0]).is_list() {
                    map.test(words[0], i32::MAX.cast_unsigned());
                }
                let each = random.pick(&[1.0, 1e2, 1e5]);
                let free = if is_listed { 0 } else { FREE };
                let place = (located.tiles[0], located.codes[0] | free);
                map.make_for(&tables, &[place], each, 1e6);
                (words, cells) = dispatch!(Level::new(), simd => map.words(simd, &located));
            }
            let blocking: Vec<SurfaceId> = occluders
                .surfaces()
                .filter(|&surface| occluders.blocks(surface, &segment))
                .collect();
            let depth = located.depths[0];
            slanted += usize::from(Word(words[0]).is_slant());
            wide += usize::from(tile_word(&map, located.tiles[0] as usize).is_wide());
            match map.told((&located, 0), (words[0], cells[0]), is_listed) {
                Told::Is(is_shadowed) => {
                    assert_eq!(
                        !blocking.is_empty(),
                        is_shadowed,
                        "{light:?} {given:?} {moved:?}"
                    );
                    *(if is_shadowed { &mut full } else { &mut lit }) += 1;
                }
                Told::Unknown => unknown += 1,
                Told::List(word) => {
                    let list = map.list(located.tiles[0], word);
                    if depth > list.full {
                        assert!(!blocking.is_empty(), "{light:?} {given:?} {moved:?}");
                        full += 1;
                        continue;
                    }
                    let near: Vec<SurfaceId> = (0..list.counts[usize::from(!is_listed)])
                        .map(|number| list.entry(number, rough_depth(depth)))
                        .filter(|(_, may_block)| *may_block)
                        .map(|(surface, _)| surface)
                        .collect();
                    let mesh = tables.joined();
                    // In place of one that repeats another, that.
                    let is_repeated = |surface: SurfaceId| {
                        tables.side(surface.0 as usize).is_some()
                            && mesh.is_some_and(|mesh| mesh.is_repeated(surface))
                    };
                    let is_there = |surface| near.contains(surface) || is_repeated(*surface);
                    assert!(
                        blocking.is_empty() || blocking.iter().any(is_there),
                        "{blocking:?} {light:?} {given:?} {moved:?}"
                    );
                    listed += usize::from(!blocking.is_empty());
                    free += usize::from(!Word(words[0]).is_list());
                }
            }
        }
        let [more_lit, more_full] = attack_faces(&map, &occluders, &light, random);
        lit_faces += more_lit;
        full_faces += more_full;
    }
    assert!(
        lit_faces > 1_000 && full_faces > 1_000,
        "{lit_faces} {full_faces}"
    );
    assert!(
        full > 8_000
            && lit > 20_000
            && listed > 2_000
            && slanted > 1_000
            && free > 1_000
            && wide > 1_000,
        "{full} {lit} {listed} {unknown} {slanted} {free} {wide}"
    );
}

fn tile_word(map: &Map, tile: usize) -> Word {
    Word(map.tiles[tile].load(Ordering::Relaxed))
}

/// A floor of triangles that alternate in height, with holes: hardly a cell of it is told by its tile.
fn rubble() -> Occluders {
    let mut builder = Occluders::builder();
    let height = |x: usize, y: usize| (7 * x + 11 * y) as f64 % 5.0;
    for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
        let corner = |dx: f64, dy: f64| DVec3::new(x as f64 + dx, y as f64 + dy, height(x, y));
        let face = [corner(0.0, 0.0), corner(1.2, 0.1), corner(0.2, 1.3)];
        builder.add_face(&face, Opacity::Opaque).expect("a face");
    }
    builder.build()
}

#[test]
fn a_map_that_was_saved_tells_the_same() {
    let occluders = rubble();
    let frame = Frame::new(occluders.bounds());
    let light = LightShape::Direction(DVec3::new(0.3, 0.2, 1.0));
    let scene_tables = SceneTables::new(&occluders, &frame, true);
    let room = Room::new(1 << 30);
    scene_tables.make_mesh(&occluders, &room, false);
    let light_tables = LightTables::new(&occluders, &frame, &light);
    let tables = Tables::new(&occluders, &frame, &light, &scene_tables, &light_tables);
    for queries in [1e5, 1e7, 1e9] {
        let map = Map::new(&occluders, &tables, 1 << 28).expect("a map");
        map.make_all(&tables, queries);
        let (runs, pending_count) = map.runs();
        assert_eq!(pending_count, 0);
        let read = Map::of_runs(runs.clone(), &occluders, &tables, 1 << 28).expect("a map");
        assert_eq!(read.runs().0, runs);
        let count = |is_one: fn(Word) -> bool| {
            let tiles = (0..map.tiles.len()).map(|tile| tile_word(&map, tile));
            tiles.filter(|word| is_one(*word)).count()
        };
        let wide = count(Word::is_wide);
        let narrow = count(Word::is_node) - wide;
        assert!(queries < 1e9 || wide > 5 && narrow > 5, "{wide} {narrow}");
        for tile in 0..map.tiles.len() {
            for code in 0..1 << 12 {
                let of = |map: &Map| {
                    let (word, (_, slot)) = map.cell(tile, code);
                    let free = map.free(tile as u32, slot.unwrap_or(0) as u32);
                    [word, free].map(|word| word_of(map, word))
                };
                assert_eq!(of(&map), of(&read), "{tile} {code}");
            }
        }
    }
}

/// A word without places: what it leads to in place of them.
fn word_of(map: &Map, word: Word) -> Vec<u32> {
    let words = |count| {
        let words = map.arena.slice(word.place(), count);
        words.iter().map(|word| word.load(Ordering::Relaxed))
    };
    if word.is_list() {
        let [_, count] = entry_counts(map.arena.read(word.place() + COUNTS));
        return words(HEAD + count).collect();
    }
    match word.is_slant() {
        true => words(SLANT_WORDS).collect(),
        false => vec![word.0],
    }
}

/// Asks starts on all faces that are told as a whole, at corners, on edges, inside, from points anywhere; returns how
/// many faces are lit and in shadow.
fn attack_faces(
    map: &Map,
    occluders: &Occluders,
    light: &LightShape,
    random: &mut Random,
) -> [usize; 2] {
    let mut counts = [0; 2];
    for surface in occluders.surfaces() {
        let start = |point| ReceiverPoint {
            point,
            surface: Some(surface),
        };
        let Some(is_shadowed) = map.face_of(&start(DVec3::ZERO)) else {
            continue;
        };
        let [a, b, c] = occluders.triangle_positions(surface).expect("a triangle");
        counts[usize::from(is_shadowed)] += 1;
        for number in 0..16 {
            let share = |random: &mut Random| {
                let inside = random.real(0.0, 1.0);
                random.pick(&[0.0, 1.0, 0.5, inside, inside, 1e-9, 1.0 - 1e-9])
            };
            let (s, t) = (share(random), share(random));
            let mut point = a + s * (b - a) + t * (1.0 - s) * (c - a);
            match number {
                0 => point = a,
                1 => point = b,
                2 => point = c,
                3 => point = random.in_box(&occluders.bounds()),
                4 => point += random.pick(&[1e-12, 1e-6, 0.1]) * random.of_cube(),
                _ => {}
            }
            let segment = occluders.segment(&start(point), light);
            let blocking = occluders
                .surfaces()
                .find(|&other| occluders.blocks(other, &segment));
            assert_eq!(
                blocking.is_some(),
                is_shadowed,
                "{light:?} {surface:?} {point} {blocking:?}"
            );
        }
    }
    counts
}

fn map_of<T>(
    occluders: &Occluders,
    light: &LightShape,
    tell: impl FnOnce(&Tables<'_>, Option<Map>) -> T,
) -> T {
    let frame = Frame::new(occluders.bounds());
    let scene_tables = SceneTables::new(occluders, &frame, false);
    scene_tables.make_mesh(occluders, &Room::new(1 << 30), false);
    let light_tables = LightTables::new(occluders, &frame, light);
    let tables = Tables::new(occluders, &frame, light, &scene_tables, &light_tables);
    tell(&tables, Map::new(occluders, &tables, 1 << 28))
}

#[test]
fn heaps_that_no_cut_takes_apart_cost_no_more_than_they_are_asked() {
    let random = &mut Random(2);
    let mut builder = Occluders::builder();
    const COUNT: usize = 400;
    for _ in 0..COUNT {
        let ends = [(); 2].map(|()| 2.0 * random.in_cube());
        let needle = [ends[0], ends[1], ends[0] + 1e-3 * random.in_cube()];
        builder.add_face(&needle, Opacity::Opaque).expect("a face");
    }
    let occluders = builder.build();
    let light = LightShape::Direction(DVec3::new(0.1, 0.2, 1.0));
    map_of(&occluders, &light, |tables, map| {
        let map = map.expect("a map");
        assert!(map.surfaces.len() <= most_entries(COUNT, map.tiles.len()));
        let longest = (0..map.tiles.len()).map(|tile| map.surfaces_of(tile).len());
        assert!(longest.max() > Some(60));
        let taken_for = |queries: f32| {
            let before = map.arena.taken();
            map.make_all(tables, queries);
            map.arena.taken() - before
        };
        let (few, many) = (taken_for(1e2), taken_for(1e7));
        assert!(20 * few < many, "{few} {many}");
    });
}

#[test]
fn a_map_keeps_to_its_share() {
    let random = &mut Random(3);
    let mut builder = Occluders::builder();
    heightfield(&mut builder, random);
    wound_fan(&mut builder, random);
    let occluders = builder.build();
    let light = LightShape::Direction(DVec3::new(0.3, 0.2, 1.0));
    map_of(&occluders, &light, |tables, map| {
        let map = map.expect("a map");
        let room = Room::new(map.bytes() + 256);
        let share = room.take(map.bytes()).expect("a share");
        let map = map.keep(share);
        map.make_all(tables, 1e9);
        assert!(
            map.is_full() && map.bytes() <= room.most(),
            "{}",
            map.bytes()
        );
        assert_eq!(room.taken(), map.bytes());
    });
    // Where its own words come to an end first.
    map_of(&occluders, &light, |tables, map| {
        let bytes = map.expect("a map").bytes();
        let map = Map::new(&occluders, tables, 512).expect("a map");
        let room = Room::new(10 * bytes);
        let share = room.take(map.bytes()).expect("a share");
        let map = map.keep(share);
        map.make_all(tables, 1e9);
        assert!(map.is_full() && room.taken() == map.bytes());
    });
}

/// Tiles once took room in the order in which threads were done.
#[test]
#[cfg(feature = "parallel")]
fn where_the_room_of_a_whole_map_ends_does_not_depend_on_threads() {
    let random = &mut Random(5);
    let mut builder = Occluders::builder();
    heightfield(&mut builder, random);
    wound_fan(&mut builder, random);
    let occluders = builder.build();
    let light = LightShape::Direction(DVec3::new(0.3, 0.2, 1.0));
    map_of(&occluders, &light, |tables, map| {
        let map = map.expect("a map");
        map.make_all(tables, 1e9);
        let all = map.runs().0[0].len() as u64;
        let by = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().expect("threads").install(|| {
                let map = Map::new(&occluders, tables, 2 * all).expect("a map");
                map.make_all(tables, 1e9);
                assert!(map.is_full());
                map.runs().0[0].to_vec()
            })
        };
        let by_one = by(1);
        assert!(by_one.len() > 1_000);
        for threads in [2, 4, 7, 7, 7] {
            assert!(by(threads) == by_one, "{threads} threads");
        }
    });
}

#[test]
fn triangles_whose_corners_are_many_tiles_off_are_not_said_to_lie_apart() {
    let v = DVec3::new;
    let sides = [v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(-0.5, 0.5, 0.0)];
    let others = [v(0.1, 0.0, 0.1), v(0.6, 0.0, 0.1), v(0.6, 1.0, 0.1)];
    let mut builder = Occluders::builder();
    for face in [sides, others] {
        builder.add_face(&face, Opacity::Opaque).expect("a face");
    }
    let occluders = builder.build();
    let light = LightShape::Direction(DVec3::Z);
    map_of(&occluders, &light, |tables, _| {
        // In many tiles `f32` does not tell on which side of a line a corner is.
        for (tile_count, is_known) in [(9.0, true), (10_000.0, false)] {
            let bounds = occluders.bounds();
            let views = Views::new(&bounds, tables.frame, &light, tile_count).expect("a view");
            let view = &views.all[0];
            let inside = tables.frame.point_in_frame(v(0.05, 0.5, 0.0));
            let middle = view.place(view.project(inside));
            let facet = |number| {
                let surface = SurfaceId(number);
                let facet = Facet::new(view, Depths::of(view), middle, surface, tables);
                facet.expect("it is seen").0
            };
            let told = facet(0).parts_from(&facet(1), [&sides, &others]);
            assert_eq!(told, is_known, "{tile_count}");
        }
    });
}
