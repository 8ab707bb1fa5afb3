use antumbra_geometry::{
    Bounds, DVec3, LightShape, Occluders, Opacity, ReceiverPoint, SamplePattern, Sphere, SurfaceId,
};

use super::super::adaptive::Scene;
use super::super::lattice::Lattice;
use super::super::testing::Random;
use super::hull::{LightHull, any_light};
use super::maker::Maker;
use super::making::sides;
use super::table::{Key, Value};
use crate::accel::bvh::Bvh;
use crate::accel::frame::Frame;

/// Triangles that share corners, doubled ones, panes, closed boxes, balls; numbers are whole half the time.
fn scene(random: &mut Random) -> Occluders {
    let mut builder = Occluders::builder();
    let is_whole = random.below(2) == 0;
    let point = |random: &mut Random| {
        let point = 4.0 * random.in_cube();
        if is_whole { point.round() } else { point }
    };
    let pool: Vec<DVec3> = (0..8).map(|_| point(random)).collect();
    let opacity = |random: &mut Random| match random.below(6) {
        0 => Opacity::Transparent,
        _ => Opacity::Opaque,
    };
    // A floor that is cut into cells, some of them lifted.
    if random.below(2) == 0 {
        let lift = random.pick(&[0.0, 0.0, 0.3, 1.0]);
        let heights: Vec<f64> = (0..36)
            .map(|_| (lift * random.real(-1.0, 1.0) * 8.0).round() / 8.0)
            .collect();
        let at = |i: usize, j: usize| {
            DVec3::new(
                2.0 * i as f64 - 5.0,
                2.0 * j as f64 - 5.0,
                -3.0 + heights[6 * i + j],
            )
        };
        for i in 0..5 {
            for j in 0..5 {
                for corners in [
                    [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                    [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
                ] {
                    builder.add_face(&corners, Opacity::Opaque).expect("a face");
                }
            }
        }
    }
    for _ in 0..random.below(3) {
        let (middle, half) = (point(random), random.pick(&[0.25, 1.0, 2.0]) * DVec3::ONE);
        let bounds = Bounds {
            min: middle - half,
            max: middle + half,
        };
        let c = bounds.corners();
        for [a, b, d, e] in [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ] {
            builder
                .add_face(&[c[a], c[b], c[d], c[e]], Opacity::Opaque)
                .expect("a face");
        }
    }
    for _ in 0..1 + random.below(8) {
        let corners = [(); 3].map(|()| pool[random.below(pool.len())]);
        builder.add_face(&corners, opacity(random)).expect("a face");
    }
    for _ in 0..random.below(3) / 2 {
        let sphere = Sphere {
            center: point(random),
            radius: random.pick(&[0.2, 1.0]),
        };
        builder
            .add_sphere(sphere, opacity(random))
            .expect("a sphere");
    }
    builder.build()
}

/// Places of a light: corners and edges of its square of numbers, and any.
fn places(random: &mut Random) -> Vec<[f64; 2]> {
    let most = 1.0 - f64::EPSILON / 2.0;
    let mut places = vec![
        [0.0, 0.0],
        [most, 0.0],
        [0.0, most],
        [most, most],
        [0.5, 0.5],
    ];
    let pattern = SamplePattern {
        seed: random.bits(),
    };
    let scramble = pattern.scramble(1, 0);
    places.extend((0..11).map(|number| SamplePattern::place(scramble, number)));
    places
}

/// What is decided of a key against the exact rule, from starts at corners of the patch and between, to samples at corners
/// of the light and between.
#[test]
fn what_is_known_of_a_whole_light_holds() {
    let rounds =
        std::env::var("ANTUMBRA_WHOLE_ROUNDS").map_or(500, |n| n.parse().expect("a number"));
    let random = &mut Random(
        std::env::var("ANTUMBRA_WHOLE_SEED").map_or(11, |n| n.parse().expect("a number")),
    );
    let (mut lit, mut dark, mut listed, mut curved) = (0_u64, 0_u64, 0_u64, 0_u64);
    for round in 0..rounds {
        let occluders = scene(random);
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        if bounds.size().max_element() <= 0.0 {
            continue;
        }
        let level = 3 + random.below(6) as u32;
        let lattice = Lattice::new(&bounds, &frame, level);
        let bvh = Bvh::build(&occluders);
        let about = random.pick(&[1.0, 1.0, 3.0]) * 4.0 * random.in_cube();
        let about = if random.below(3) == 0 {
            about.round()
        } else {
            about
        };
        let size = random.pick(&[0.05, 0.5, 2.0]);
        let shape = any_light(random, about, size);
        let Some(hull) = LightHull::new(&shape, &frame) else {
            continue;
        };
        let mesh = antumbra_geometry::Mesh::without_edges(&occluders);
        let sides = sides(&occluders, &frame, &hull);
        let maker = Maker {
            scene: Scene {
                occluders: &occluders,
                bvh: &bvh,
            },
            frame: &frame,
            lattice: &lattice,
            level,
            hull: &hull,
            sides: &sides,
            mesh: &mesh,
        };
        // Keys about points of triangles.
        let mut asked: Vec<(Key, ReceiverPoint)> = Vec::new();
        for _ in 0..40 {
            let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
            let (point, surface) = match occluders.triangle_positions(surface) {
                Some([a, b, c]) => {
                    let (u, v) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                    let shift = random.pick(&[1.0, 1.0, 1.0, 0.0]);
                    let point = a + shift * u * (b - a) + shift * (1.0 - u) * v * (c - a);
                    (point, (random.below(8) != 0).then_some(surface))
                }
                None => {
                    let about = occluders.surface_bounds(surface).center() + random.in_cube();
                    (occluders.start_on(surface, about).point, Some(surface))
                }
            };
            let is_curved = surface.is_some_and(|s| occluders.triangle_positions(s).is_none());
            let (corner, edge) = lattice.corner_and_edge();
            let cell_edge = edge / f64::from(1_u32 << level);
            let at = ((point - corner) / cell_edge).floor();
            let number = (0..level).fold(0_u64, |number, bit| {
                (0..3).fold(number, |number, axis| {
                    let coordinate = at[axis].max(0.0) as u64;
                    number | (coordinate >> bit & 1) << (3 * bit + axis as u32)
                })
            });
            let is_behind = random.below(2) == 0;
            asked.push((
                Key::new(
                    number,
                    surface,
                    is_behind && surface.is_some() && !is_curved,
                ),
                ReceiverPoint { point, surface },
            ));
        }
        let mut keys: Vec<Key> = asked.iter().map(|(key, _)| *key).collect();
        keys.sort_unstable();
        keys.dedup();
        let (entries, _) = maker.make(&keys);
        assert_eq!(entries.known.len(), keys.len());
        for &(key, known) in &entries.known {
            let cell = super::super::lattice::Cell::of_number(key.cell_number(), level);
            let within = lattice.inflated(cell);
            let mut starts: Vec<ReceiverPoint> = asked
                .iter()
                .filter(|(other, _)| *other == key)
                .map(|(_, start)| *start)
                .collect();
            let surface = key.surface();
            let own = surface.filter(|&surface| occluders.has_own_rule(surface));
            let is_curved = surface.is_some_and(|s| occluders.triangle_positions(s).is_none());
            let points: Vec<DVec3> = match surface {
                Some(surface) if is_curved => (0..8)
                    .map(|_| {
                        let about = occluders.surface_bounds(surface).center() + random.in_cube();
                        occluders.start_on(surface, about).point
                    })
                    .collect(),
                None => within.corners().to_vec(),
                Some(surface) => {
                    // Corners of the patch, and points of its border and inside.
                    let light = LightShape::Direction(DVec3::new(0.1, 0.2, 1.0));
                    let side = occluders.light_side_of(surface, &light);
                    let patch =
                        occluders.patch(surface, &within, &light, if side == 0 { 1 } else { side });
                    let corners: Vec<DVec3> =
                        patch.iter().flat_map(|patch| patch.corners()).collect();
                    let mut points = corners.clone();
                    if !corners.is_empty() {
                        for _ in 0..4 {
                            let [a, b] = [(); 2].map(|()| corners[random.below(corners.len())]);
                            points.push(a + random.real(0.0, 1.0) * (b - a));
                        }
                    }
                    points
                }
            };
            starts.extend(
                points
                    .into_iter()
                    .filter(|point| within.contains(*point))
                    .map(|point| ReceiverPoint { point, surface }),
            );
            for start in starts {
                for place in places(random) {
                    let sample = shape.sample(start.point, place);
                    let Some(sample) = sample else {
                        assert!(
                            !known.are_all_asked() || !lattice.inflated(cell).contains(start.point),
                            "{round} {shape:?} {start:?}"
                        );
                        continue;
                    };
                    let side = match surface {
                        Some(surface) if !is_curved => {
                            occluders.light_side_of(surface, &sample.target)
                        }
                        _ => 1,
                    };
                    if side != key.side() {
                        assert!(!known.are_all_asked(), "{round} {shape:?} {start:?}");
                        continue;
                    }
                    let segment = occluders.segment(&start, &sample.target);
                    let blocking: Vec<SurfaceId> = occluders
                        .surfaces()
                        .filter(|&s| Some(s) != own && occluders.blocks(s, &segment))
                        .collect();
                    let context = || {
                        format!(
                            "round {round} {shape:?} {key:?} {cell:?} {start:?} {:?} {blocking:?}",
                            sample.target
                        )
                    };
                    match known.value() {
                        Value::Lit => {
                            lit += 1;
                            assert!(blocking.is_empty(), "lit: {}", context());
                        }
                        Value::Dark => {
                            dark += 1;
                            assert!(!blocking.is_empty(), "dark: {}", context());
                        }
                        Value::Open => {}
                        Value::Listed(first) => {
                            let count = entries.lists[first as usize] as usize;
                            let leaves = &entries.lists[first as usize + 1..][..count];
                            for surface in blocking {
                                listed += 1;
                                curved += u64::from(is_curved);
                                assert!(
                                    leaves.iter().any(|&leaf| bvh.leaf_holds(leaf, surface)),
                                    "list: {surface:?} round {round} {shape:?} {start:?}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
    assert!(
        lit > 20_000 && dark > 5_000 && listed > 20_000 && curved > 500,
        "{lit} {dark} {listed} {curved}"
    );
}
