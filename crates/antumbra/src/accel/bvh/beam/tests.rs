//! Walks of many targets against the rule, in scenes whose trees are deep and whose bounds are met.

use antumbra_geometry::{Cone, DVec3, Disk, Opacity, Sphere};

use super::*;
use crate::accel::grid::any_hit_by_reference;
use crate::occlusion::testing::Random;

/// Triangles of all sizes, some of them in one plane, balls, disks and cones.
fn scene(random: &mut Random) -> Occluders {
    let within = random.scene();
    let size = within.size().max_element();
    let mut builder = Occluders::builder();
    let most = random.pick(&[30, 150, 700]);
    for number in 0..2 + random.below(most) {
        let middle = random.in_box(&within);
        let reach = size * random.pick(&[0.001, 0.01, 0.03, 0.1, 0.4]);
        let flat = random.below(6);
        let corners = [(); 3].map(|()| {
            let mut corner = middle + reach * random.of_cube();
            if flat < 3 {
                corner[flat] = within.center()[flat];
            }
            corner
        });
        let opacity = match number % 5 {
            0 => Opacity::Transparent,
            _ => Opacity::Opaque,
        };
        let (center, radius) = (middle, reach);
        let added = match random.below(14) {
            0 | 1 => builder.add_sphere(Sphere { center, radius }, opacity),
            2 => builder.add_disk(
                Disk {
                    center,
                    normal: random.in_cube(),
                    radius,
                },
                opacity,
            ),
            3 => builder.add_cone(
                Cone {
                    base: center,
                    base_radius: radius,
                    apex: corners[0],
                    apex_radius: 0.5 * radius,
                    is_closed: flat < 3,
                },
                opacity,
            ),
            _ => builder.add_face(&corners, opacity),
        };
        drop(added);
    }
    builder.build()
}

/// A start on a surface, at its very corner now and then, in space, or outside.
fn start(occluders: &Occluders, random: &mut Random) -> ReceiverPoint {
    let bounds = occluders.bounds();
    let size = bounds.size().max_element();
    let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
    let corners = occluders.triangle_positions(surface);
    match (random.below(5), corners) {
        (0, _) => ReceiverPoint {
            point: random.in_box(&bounds),
            surface: None,
        },
        (1, _) => ReceiverPoint {
            point: bounds.center() + size * random.pick(&[1.0, 30.0, 1e7]) * random.in_cube(),
            surface: None,
        },
        (_, Some([a, b, c])) => {
            let (u, v) = (random.pick(&[0.0, 0.2, 0.7]), random.real(0.0, 0.3));
            ReceiverPoint {
                point: a + (b - a) * u + (c - a) * v,
                surface: Some(surface).filter(|_| random.below(8) > 0),
            }
        }
        (_, None) => ReceiverPoint {
            point: occluders.surface_bounds(surface).center(),
            surface: None,
        },
    }
}

/// Samples of a light of some size, near or far, together or all around.
fn targets(occluders: &Occluders, start: &ReceiverPoint, random: &mut Random) -> Vec<LightShape> {
    let bounds = occluders.bounds();
    let size = bounds.size().max_element();
    let count = random.pick(&[1, 3, 16, 40, 64, 64, 64]);
    let middle = match random.below(4) {
        0 => random.in_box(&bounds),
        1 => bounds.center() + 1e4 * size * random.in_cube(),
        // Along an axis of the start.
        2 => start.point + size * random.pick(&[DVec3::X, -DVec3::Y, DVec3::Z]),
        _ => bounds.center() + 2.0 * size * random.in_cube(),
    };
    let reach = random.pick(&[0.0, 1e-12, 1e-3, 0.02, 0.1, 0.5, 3.0]);
    let distance = (middle - start.point).length();
    let is_afar = random.below(4) == 0;
    let corner = |random: &mut Random| {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        occluders.triangle_positions(surface).map(|[a, _, _]| a)
    };
    let targets = (0..count).map(|_| {
        let at = middle + reach * distance * random.of_cube();
        // Some aim at corners, where bounds tell nothing.
        let at = match corner(random) {
            Some(corner) if random.below(12) == 0 => {
                start.point + random.pick(&[1.0, 1.5, 2.0]) * (corner - start.point)
            }
            _ => at,
        };
        if is_afar {
            LightShape::Direction(at - start.point)
        } else {
            LightShape::Point(at)
        }
    });
    targets.collect()
}

#[test]
fn many_targets_are_answered_as_each() {
    let random = &mut Random(7);
    let (mut blocked_count, mut count, mut steps, mut each_steps) = (0, 0, 0, 0);
    for _ in 0..160 {
        let occluders = scene(random);
        if occluders.surface_count() == 0 {
            continue;
        }
        let bvh = Bvh::build(&occluders);
        let mut memory = Memory::new(1);
        for _ in 0..12 {
            let start = start(&occluders, random);
            let targets = targets(&occluders, &start, random);
            let block = Block::new(&targets);
            let asked = Asked {
                occluders: &occluders,
                start: &start,
                targets: &targets,
                mask: random.pick(&[u64::MAX, u64::MAX, 0x5555_5555_5555_5555]),
                number: 0,
            };
            let (mut together, mut each) = (Counters::default(), Counters::default());
            let found = bvh.any_hit_targets(&asked, &block, &mut memory, &mut together);
            assert_eq!(found & !(asked.mask & block.asked()), 0);
            for (number, target) in targets.iter().enumerate() {
                if asked.mask & block.asked() & 1 << number == 0 {
                    continue;
                }
                let segment = occluders.segment(&start, target);
                let expected = any_hit_by_reference(&occluders, &segment);
                // Own rules are asked before.
                if occluders.own_rule_blocks(&segment) {
                    continue;
                }
                let is_blocked = found >> number & 1 != 0;
                assert_eq!(is_blocked, expected, "{number} of {targets:?} {start:?}");
                blocked_count += u32::from(expected);
                count += 1;
                bvh.any_hit(&occluders, &start, target, &mut each);
            }
            steps += together.steps;
            each_steps += each.steps;
        }
    }
    assert!(
        blocked_count > 10_000 && count - blocked_count > 10_000,
        "{blocked_count} of {count}"
    );
    assert!(2 * steps < each_steps, "{steps} of {each_steps}");
}

/// Most of what is in a pyramid is parted before it ends: small triangles everywhere.
#[test]
fn targets_whose_walks_cost_too_much_are_answered_as_each() {
    let random = &mut Random(11);
    let mut builder = Occluders::builder();
    for _ in 0..4_000 {
        let middle = random.in_cube();
        let corners = [(); 3].map(|()| middle + 0.06 * random.in_cube());
        builder
            .add_face(&corners, Opacity::Opaque)
            .expect("fine numbers");
    }
    let occluders = builder.build();
    let bvh = Bvh::build(&occluders);
    let mut blocked_count = 0;
    for spread in [0.0, 1e-6, 0.05, 0.5, 2.0] {
        for _ in 0..12 {
            let start = ReceiverPoint {
                point: random.in_cube() - 1.2 * DVec3::Z,
                surface: None,
            };
            let middle = 0.5 * random.in_cube() + 2.0 * DVec3::Z;
            let targets: Vec<_> = (0..64)
                .map(|_| LightShape::Point(middle + spread * random.in_cube()))
                .collect();
            let asked = Asked {
                occluders: &occluders,
                start: &start,
                targets: &targets,
                mask: u64::MAX,
                number: 0,
            };
            let (block, counters) = (Block::new(&targets), &mut Counters::default());
            let found = bvh.any_hit_targets(&asked, &block, &mut Memory::new(1), counters);
            for (number, target) in targets.iter().enumerate() {
                let segment = occluders.segment(&start, target);
                let expected = any_hit_by_reference(&occluders, &segment);
                assert_eq!(
                    found >> number & 1 != 0,
                    expected,
                    "{number} of {targets:?}"
                );
                blocked_count += u32::from(expected);
            }
        }
    }
    assert!((800..3_000).contains(&blocked_count), "{blocked_count}");
}

#[test]
fn parts_are_smaller_and_hold_all() {
    let random = &mut Random(13);
    let mut builder = Occluders::builder();
    builder
        .add_face(&[-DVec3::ONE, DVec3::ONE, DVec3::X], Opacity::Opaque)
        .expect("fine numbers");
    let bvh = Bvh::build(&builder.build());
    dispatch!(bvh.level, simd => {
        for spread in [0.0, 0.3] {
            let targets: Vec<_> = (0..64)
                .map(|_| LightShape::Point(3.0 * DVec3::Z + spread * random.in_cube()))
                .collect();
            let segments = Segments::new(simd, &bvh, (DVec3::ZERO, 0.0), &Block::new(&targets), u64::MAX);
            assert_eq!(segments.fit, u64::MAX);
            let (face, all) = Faces::of(simd, &segments).shared_by_most(u64::MAX);
            assert_eq!(all, u64::MAX);
            let pyramid = Pyramid::new(simd, &segments, face, all);
            for among in [u64::MAX, 0b1011 << 20, 0x8000_0000_0000_0001, 0b110] {
                let parts: Vec<u64> = pyramid.quarters(simd, &segments, among).collect();
                assert!(parts.iter().all(|&part| part != 0 && part != among), "{among:x} {parts:x?}");
                assert_eq!(parts.iter().fold(0, |all, part| all ^ part), among);
                assert_eq!(parts.iter().map(|part| part.count_ones()).sum::<u32>(), among.count_ones());
            }
        }
    });
}

/// Of triangles over a floor, few starts are in doubt, and what is sure is the rule's.
#[test]
fn most_starts_of_a_tile_are_told_without_the_rule() {
    let v = DVec3::new;
    let mut builder = Occluders::builder();
    let random = &mut Random(4);
    for _ in 0..400 {
        let middle = v(
            random.real(-40.0, 40.0),
            random.real(-40.0, 40.0),
            random.real(2.0, 30.0),
        );
        let corners = [(); 3].map(|()| middle + 6.0 * random.of_cube());
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    let floor = [v(-50.0, -50.0, 0.0), v(50.0, -50.0, 0.0), v(0.0, 80.0, 0.0)];
    builder.add_face(&floor, Opacity::Opaque).expect("a face");
    let occluders = builder.build();
    let bvh = Bvh::build(&occluders);
    let starts: Vec<ReceiverPoint> = (0..TARGETS)
        .map(|i| ReceiverPoint {
            point: v((i % 8) as f64, (i / 8) as f64, 0.0),
            surface: Some(SurfaceId(400)),
        })
        .collect();
    let targets: Vec<LightShape> = (0..TARGETS)
        .map(|i| LightShape::Direction(v(0.05 * (i % 8) as f64, 0.04 * (i / 8) as f64, 0.7)))
        .collect();
    let block = Block::new(&targets);
    let mut sheaf = sheaf::Sheaf::new(&bvh, &block);
    let (mut tile, mut cut) = (tile::Tile::new(), sheaf::Cut::default());
    let counters = &mut Counters::default();
    tile.hold(&bvh, &occluders, &starts, &[Some((SurfaceId(400), 1))]);
    bvh.cut(&occluders, &mut tile, &sheaf, &mut cut, counters);
    let mut memory = Memory::new(TARGETS);
    // What is near is asked start by start.
    let near: Vec<u64> = (0..TARGETS)
        .map(|place| {
            let asked = Asked {
                occluders: &occluders,
                start: &starts[place],
                targets: &targets,
                mask: u64::MAX,
                number: 0,
            };
            let of = tile::OfTile {
                tile: &mut tile,
                place,
            };
            let ways = (&cut, sheaf::Reach::Near, of);
            bvh.any_hit_sheaf(&asked, &mut sheaf, ways, &mut memory, counters)
        })
        .collect();
    let mut blocked = 0;
    for (lane, target) in targets.iter().enumerate() {
        let is_near = |place: usize| near[place] >> lane & 1 != 0;
        let before = (0..TARGETS).fold(0, |mask, i| mask | u64::from(is_near(i)) << i);
        let asked = column::AskedDirection {
            occluders: &occluders,
            starts: &starts,
            mask: !before,
            target,
            lane,
            number: lane,
        };
        let found =
            before | bvh.any_hit_column(&asked, &mut tile, (&sheaf, &cut), &mut memory, counters);
        for (number, start) in starts.iter().enumerate() {
            let truth = any_hit_by_reference(&occluders, &occluders.segment(start, target));
            assert_eq!(found >> number & 1 != 0, truth);
        }
        blocked += found.count_ones();
    }
    assert!((500..3500).contains(&blocked), "{blocked}");
    // A walk a direction, and few triangles of each for all starts.
    assert!(
        counters.steps < 1000 && counters.intersections < 1500,
        "{counters:?}"
    );
}
