//! Values of [`Method::Voxel`] that are made while queries are answered: whatever is asked, in whatever order,
//! by however many threads and with however little memory, answers are those of rays.

use std::sync::Arc;

use antumbra::{
    Counters, Decided, LightId, Method, Refine, Refinement, Shadow, ShadowCounters, ShadowIndex,
};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId};
use rayon::prelude::*;

/// SplitMix64: enough for tests, the same everywhere.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// A point of `[-1, 1]^3`.
    fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.real(-1.0, 1.0)))
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for number in (1..items.len()).rev() {
            items.swap(number, self.below(number + 1));
        }
    }
}

/// Hills of many triangles, boulders, loose leaves and panes over them.
fn hills(seed: u64) -> Arc<Occluders> {
    const EDGE: usize = 20;
    let random = &mut Random(seed);
    let mut builder = Occluders::builder();
    let heights: Vec<f64> = (0..(EDGE + 1) * (EDGE + 1))
        .map(|_| random.real(0.0, 0.4))
        .collect();
    let corner = |x: usize, y: usize| {
        let at = |n: usize| 8.0 * n as f64 / EDGE as f64 - 4.0;
        DVec3::new(at(x), at(y), heights[y * (EDGE + 1) + x])
    };
    for (x, y) in (0..EDGE * EDGE).map(|n| (n % EDGE, n / EDGE)) {
        let [a, b, c, d] =
            [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| corner(x, y));
        for corners in [[a, b, c], [a, c, d]] {
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
        }
    }
    for _ in 0..500 {
        let middle = DVec3::new(0.0, 0.0, 1.5) + DVec3::new(3.8, 3.8, 1.2) * random.in_cube();
        let size = random.pick(&[0.05, 0.1, 0.3]);
        let corners = [(); 3].map(|()| middle + size * random.in_cube());
        let opacity = random.pick(&[Opacity::Opaque, Opacity::Opaque, Opacity::Transparent]);
        builder.add_face(&corners, opacity).expect("a face");
    }
    for _ in 0..40 {
        let center = DVec3::new(0.0, 0.0, 1.0) + DVec3::new(3.5, 3.5, 1.0) * random.in_cube();
        let radius = random.real(0.05, 0.3);
        builder
            .add_sphere(Sphere { center, radius }, Opacity::Opaque)
            .expect("a sphere");
    }
    Arc::new(builder.build())
}

fn lamps() -> Vec<LightShape> {
    vec![
        LightShape::Point(DVec3::new(1.5, -1.0, 4.0)),
        LightShape::Direction(DVec3::new(0.4, 0.3, 1.0)),
        // Amid everything.
        LightShape::Point(DVec3::new(0.1, 0.2, 1.3)),
    ]
}

fn index_of(
    occluders: &Arc<Occluders>,
    method: Method,
    refine: Refine,
    memory: Option<u64>,
) -> ShadowIndex {
    let mut refinement = Refinement {
        resolution: 256,
        space_resolution: 128,
        refine,
        ..Refinement::default()
    };
    if let Some(memory) = memory {
        refinement.memory = memory;
    }
    ShadowIndex::builder(Arc::clone(occluders), lamps())
        .method(method)
        .refinement(refinement)
        .build()
        .expect("an index")
}

/// Starts in patches, as pictures ask them: on surfaces, and some in space.
fn starts(occluders: &Occluders, count: usize, random: &mut Random) -> Vec<ReceiverPoint> {
    let mut starts = Vec::with_capacity(count);
    while starts.len() < count {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        let is_free = random.below(5) == 0;
        for _ in 0..1 + random.below(60) {
            let point = match (
                occluders.triangle_positions(surface),
                occluders.sphere(surface),
            ) {
                (Some([a, b, c]), _) => {
                    let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                    let (s, t) = if s + t > 1.0 {
                        (1.0 - s, 1.0 - t)
                    } else {
                        (s, t)
                    };
                    a + s * (b - a) + t * (c - a)
                }
                (None, Some(Sphere { center, radius })) => {
                    center + radius * random.in_cube().normalize()
                }
                (None, None) => occluders.surface_bounds(surface).center(),
            };
            starts.push(if is_free {
                ReceiverPoint {
                    point: point + 0.1 * random.in_cube(),
                    surface: None,
                }
            } else {
                ReceiverPoint {
                    point,
                    surface: Some(surface),
                }
            });
        }
    }
    starts.truncate(count);
    starts
}

/// Bytes of values, lists and tables.
fn all_bytes(index: &ShadowIndex) -> u64 {
    index.occlusion_bytes() + index.table_bytes()
}

/// Starts, and what rays say of them for each light.
struct Questions {
    occluders: Arc<Occluders>,
    starts: Vec<ReceiverPoint>,
    expected: Vec<Vec<bool>>,
}

impl Questions {
    fn new(seed: u64, count: usize) -> Self {
        let occluders = hills(seed);
        let starts = starts(&occluders, count, &mut Random(seed + 1));
        let by_rays = index_of(&occluders, Method::Bvh, Refine::Eager, None);
        let expected: Vec<Vec<bool>> = (0..lamps().len())
            .map(|light| {
                let mut found = vec![false; starts.len()];
                by_rays
                    .shadows(
                        &starts,
                        LightId::from_index(light),
                        &mut found,
                        &mut Counters::default(),
                    )
                    .expect("fine queries");
                found
            })
            .collect();
        for expected in &expected {
            let blocked = expected.iter().filter(|&&is_blocked| is_blocked).count();
            assert!(
                blocked * 10 > count && blocked * 10 < count * 9,
                "{blocked}"
            );
        }
        Self {
            occluders,
            starts,
            expected,
        }
    }

    fn index(&self, refine: Refine, memory: Option<u64>) -> ShadowIndex {
        index_of(&self.occluders, Method::Voxel, refine, memory)
    }

    /// What an index takes before anything is known: tables, columns and empty stores of all lights.
    fn bytes_at_first(&self) -> u64 {
        self.index(Refine::Queried, None).knowledge_bytes()
    }

    /// Asks about a slice at once and checks the answers.
    fn ask(&self, index: &ShadowIndex, light: usize, range: std::ops::Range<usize>) {
        let mut found = vec![false; range.len()];
        index
            .shadows(
                &self.starts[range.clone()],
                LightId::from_index(light),
                &mut found,
                &mut Counters::default(),
            )
            .expect("fine queries");
        let expected = &self.expected[light][range.clone()];
        if let Some(wrong) = (0..found.len()).find(|&at| found[at] != expected[at]) {
            panic!(
                "light {light}, one of {range:?}: not {} at {:?}",
                found[wrong],
                self.starts[range.start + wrong]
            );
        }
    }

    /// Asks one question and checks the answer.
    fn ask_one(&self, index: &ShadowIndex, light: usize, number: usize) -> Decided {
        let start = &self.starts[number];
        let answer = index
            .shadow(start, LightId::from_index(light), &mut Counters::default())
            .expect("a fine query");
        let expected = self.expected[light][number];
        assert_eq!(
            answer.shadow == Shadow::Shadowed,
            expected,
            "light {light}: {start:?} by {:?}",
            answer.decided
        );
        answer.decided
    }

    /// Asks here and there: slices of all lengths that overlap those of other threads, and one by one.
    fn ask_around(&self, index: &ShadowIndex, random: &mut Random) {
        let light = random.below(lamps().len());
        let most = random.pick(&[1, 33, 500, 6_000]).min(self.starts.len());
        let length = 1 + random.below(most);
        // Threads meet at the beginning.
        let first = random.below(self.starts.len() - length + 1) / random.pick(&[1, 8]);
        let range = first..first + length;
        if length <= 33 {
            for number in range {
                self.ask_one(index, light, number);
            }
        } else {
            self.ask(index, light, range);
        }
    }

    /// Asks from all threads of a pool at once.
    fn hammer(&self, index: &ShadowIndex, threads: usize, rounds: u64) {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            (0..rounds).into_par_iter().for_each(|round| {
                self.ask_around(index, &mut Random(1_000 * threads as u64 + round));
            });
        });
    }
}

#[test]
fn threads_that_refine_together_answer_as_rays_do() {
    let questions = Questions::new(1, 12_000);
    for refine in [Refine::Queried, Refine::Lazy] {
        for threads in [1, 2, 7] {
            let index = questions.index(refine, None);
            let before = all_bytes(&index);
            // Until rays have cost enough for something to pay; how long that takes depends on the machine.
            const MOST_TIMES: usize = 40;
            let mut times = 0;
            while all_bytes(&index) == before && times < MOST_TIMES {
                questions.hammer(&index, threads, 250);
                times += 1;
            }
            for light in 0..lamps().len() {
                questions.ask(&index, light, 0..questions.starts.len());
            }
            assert!(all_bytes(&index) > before, "{refine:?}: nothing was made");
            assert_eq!(index.evictions(), 0);
        }
    }
}

/// Room for so many bytes more than what is taken before the first brick, or a share of what would be known; very few
/// leave no tables at all.
#[test]
fn memory_that_is_too_small_changes_no_answer() {
    let questions = Questions::new(2, 6_000);
    let at_first = questions.bytes_at_first();
    let unbounded = questions.index(Refine::Queried, None);
    questions.hammer(&unbounded, 2, 250);
    assert_eq!(unbounded.lights_without_room(), 0);
    let all = unbounded.knowledge_bytes();
    let mut evictions = 0;
    for (refine, memory, rounds) in [
        // No room for edges, and for the last bricks; how much is dropped for those depends on what comes first.
        (Refine::Queried, at_first + 5_000, 60),
        (Refine::Queried, all / 32 * 23, 120),
        (Refine::Queried, all / 32 * 27, 120),
        (Refine::Queried, all / 32 * 28, 250),
        (Refine::Lazy, at_first + 5_000, 250),
        (Refine::Lazy, all / 2, 250),
    ] {
        for threads in [1, 2, 7] {
            let index = questions.index(refine, Some(memory));
            questions.hammer(&index, threads, rounds);
            let label = format!("{refine:?}, {memory} of {all}, {threads} threads");
            assert!(index.knowledge_bytes() <= memory, "{label}");
            if refine == Refine::Queried {
                assert!(index.lights_without_room() > 0, "{label}");
                evictions += index.evictions();
            }
        }
    }
    assert!(evictions > 0, "a full store was never dropped");
    // What comes into no store is left out, and nothing dropped.
    let all = questions.index(Refine::Eager, None);
    assert_eq!(all.lights_without_room(), 0);
    for share in 1..6 {
        let memory = all.knowledge_bytes() * share / 4;
        let index = questions.index(Refine::Eager, Some(memory));
        questions.hammer(&index, 2, 60);
        assert_eq!(index.evictions(), 0);
        assert!(index.knowledge_bytes() <= memory);
        assert!(index.lights_without_room() > 0 || share > 3, "{share}");
        assert!(index.occlusion_bytes() > 0 || share < 3, "{share}");
    }
    for refine in [Refine::Queried, Refine::Lazy, Refine::Eager] {
        for memory in [0, 1, 100, 10_000] {
            let index = questions.index(refine, Some(memory));
            questions.hammer(&index, 2, 40);
            assert_eq!(index.occlusion_bytes(), 0, "{refine:?} {memory}");
            assert_eq!((index.evictions(), index.knowledge_bytes()), (0, 0));
            assert_eq!(questions.ask_one(&index, 0, 0), Decided::Ray);
        }
    }
}

#[test]
fn nothing_is_made_while_refining_is_off() {
    let questions = Questions::new(3, 4_000);
    let index = questions.index(Refine::Queried, None);
    let at_first = (index.occlusion_bytes(), index.table_bytes());
    let bytes = || (index.occlusion_bytes(), index.table_bytes());
    index.set_refining(false);
    questions.hammer(&index, 2, 40);
    assert_eq!(bytes(), at_first);
    index.set_refining(true);
    questions.hammer(&index, 2, 40);
    let after = bytes();
    assert!(after.0 > at_first.0 && after.1 > at_first.1);
    index.set_refining(false);
    questions.hammer(&index, 7, 120);
    assert_eq!(bytes(), after);
    // What is known is used all the same.
    let known = (0..1_000).filter(|&number| questions.ask_one(&index, 0, number) != Decided::Ray);
    assert!(known.count() > 100);
    index.set_refining(true);
    questions.hammer(&index, 2, 120);
    assert!(bytes().0 > after.0);

    let eager = questions.index(Refine::Eager, None);
    let all = (eager.occlusion_bytes(), eager.table_bytes());
    questions.hammer(&eager, 2, 40);
    assert_eq!((eager.occlusion_bytes(), eager.table_bytes()), all);
}

#[test]
fn what_is_forgotten_is_made_again() {
    let questions = Questions::new(4, 4_000);
    for refine in [Refine::Queried, Refine::Lazy] {
        let mut index = questions.index(refine, None);
        let at_first = (index.occlusion_bytes(), index.table_bytes());
        let mut made = Vec::new();
        for _ in 0..3 {
            questions.hammer(&index, 1, 200);
            // Rays must have cost enough for something to pay; how long that takes depends on the machine.
            const MOST_TIMES: usize = 100;
            for _ in 0..MOST_TIMES {
                if index.table_bytes() > at_first.1 {
                    break;
                }
                questions.hammer(&index, 1, 200);
            }
            made.push(index.occlusion_bytes());
            if refine == Refine::Queried {
                assert!(index.occlusion_bytes() > at_first.0);
            }
            assert!(index.table_bytes() > at_first.1, "{refine:?}");
            index.forget_values();
            let now = (index.occlusion_bytes(), index.table_bytes());
            assert_eq!(now, (0, 0), "{refine:?}");
            if refine == Refine::Lazy {
                // As asked, tables are there at first.
                assert_eq!(at_first, now);
            }
            questions.hammer(&index, 2, 20);
            index.forget_values();
        }
        if refine == Refine::Queried {
            // One thread in one order makes the same each time.
            assert_eq!(made[1], made[2]);
        }
    }
    let mut eager = questions.index(Refine::Eager, None);
    let all = (eager.occlusion_bytes(), eager.table_bytes());
    eager.forget_values();
    assert_eq!((eager.occlusion_bytes(), eager.table_bytes()), all);
    questions.hammer(&eager, 2, 20);
}

/// Where every cell is refined that is asked about, the order of questions decides when, not what.
#[test]
fn the_order_of_questions_does_not_matter_in_the_end() {
    let questions = Questions::new(5, 500);
    let settle = |order: &mut dyn FnMut(&mut [usize], usize)| {
        let index = questions.index(Refine::Queried, None);
        let mut numbers: Vec<usize> = (0..questions.starts.len()).collect();
        let (mut settled, mut bytes) = (0, 0);
        let mut round = 0;
        // A cell pays after some dozens of questions.
        while settled < 50 {
            order(&mut numbers, round);
            for &number in &numbers {
                for light in 0..lamps().len() {
                    questions.ask_one(&index, light, number);
                }
            }
            let now = index.occlusion_bytes();
            settled = if now == bytes { settled + 1 } else { 0 };
            bytes = now;
            round += 1;
            assert!(round < 2_000, "it does not settle");
        }
        index.set_refining(false);
        let shares: Vec<ShadowCounters> = (0..lamps().len())
            .map(|light| {
                let mut counters = Counters::default();
                let mut found = vec![false; questions.starts.len()];
                index
                    .shadows(
                        &questions.starts,
                        LightId::from_index(light),
                        &mut found,
                        &mut counters,
                    )
                    .expect("fine queries");
                counters.shadow
            })
            .collect();
        (index.occlusion_bytes(), index.table_bytes(), shares)
    };
    let expected = settle(&mut |_, _| {});
    for counters in &expected.2 {
        assert!(
            counters.first_pass > 50 && counters.blocker_list > 5,
            "{counters:?}"
        );
    }
    assert_eq!(
        settle(&mut |numbers, round| {
            if round == 0 {
                numbers.reverse();
            }
        }),
        expected
    );
    let random = &mut Random(6);
    assert_eq!(settle(&mut |numbers, _| random.shuffle(numbers)), expected);
}

/// Asks one by one about points of a plane across an axis; returns the share that rays did not answer.
fn share_known_on_a_plane(axis: usize, height: f64, place: impl Fn(usize) -> [f64; 2]) -> f64 {
    let mut builder = Occluders::builder();
    let turned = |x: f64, y: f64, z: f64| {
        let mut point = [0.0; 3];
        (point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3]) = (height + z, x, y);
        DVec3::from_array(point)
    };
    let random = &mut Random(9);
    let floor = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| turned(x, y, 0.0));
    builder.add_face(&floor, Opacity::Opaque).expect("a face");
    for _ in 0..300 {
        let [x, y, z] = [(); 3].map(|()| random.real(0.0, 0.9));
        let corners = [(0.0, 0.0), (0.06, 0.0), (0.0, 0.06)];
        let corners = corners.map(|(u, v)| turned(x + u, y + v, 0.1 + z));
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    let light = LightShape::Direction(turned(0.1, 0.2, 1.0) - turned(0.0, 0.0, 0.0));
    let index = ShadowIndex::builder(Arc::new(builder.build()), vec![light])
        .refinement(Refinement {
            resolution: 64,
            // What is known does not depend on times then.
            refine: Refine::Queried,
            space_resolution: 32,
            ..Refinement::default()
        })
        .build()
        .expect("an index");
    const COUNT: usize = 120_000;
    let mut counters = Counters::default();
    for number in 0..COUNT {
        let [x, y] = place(number);
        let start = ReceiverPoint {
            point: turned(x, y, 0.0),
            surface: None,
        };
        index
            .shadow(&start, LightId(0), &mut counters)
            .expect("a fine query");
    }
    1.0 - counters.shadow.rays as f64 / COUNT as f64
}

#[test]
fn points_on_grids_and_planes_across_any_axis_are_learned_alike() {
    let dyadic = |number: usize| [number % 512, number / 512 % 512].map(|n| n as f64 / 512.0);
    let signed = |number: usize| match dyadic(number) {
        [x, y] if x > 0.0 => [x, y],
        // The other zero.
        [_, y] => [-0.0, y],
    };
    let one = |_: usize| [0.4375, 0.3125];
    let row = |number: usize| [(number % 512) as f64 / 512.0, 0.25];
    let places: [&dyn Fn(usize) -> [f64; 2]; 4] = [&dyadic, &signed, &one, &row];
    for height in [0.0, 0.5] {
        for (kind, place) in places.iter().enumerate() {
            let shares = [0, 1, 2].map(|axis| share_known_on_a_plane(axis, height, place));
            for share in shares {
                assert!(share > 0.9, "height {height}, places {kind}: {shares:?}");
            }
        }
    }
}
