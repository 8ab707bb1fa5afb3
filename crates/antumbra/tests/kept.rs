//! Values that are kept in files: the answers are those of rays whatever was taken from where, what holds no
//! longer is refused with the reason, and nothing that a file may hold does harm.

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::Arc;
use std::time::{Duration, Instant};

use antumbra::{
    BuildError, Change, Counters, KeptLight, Method, Part, Refine, Refinement, Refusal, SaveError,
    ShadowIndex, Volume,
};
use antumbra_geometry::{
    Coverage, DVec3, LightShape, Occluders, Opacity, Sphere, Start, SurfaceId,
};
use twox_hash::XxHash3_128;

use common::Random;

/// A floor of many triangles, leaves over it, and a ball. `nudge` moves one corner of one leaf.
fn scene(edge: usize, leaf_count: usize, nudge: f64) -> Arc<Occluders> {
    let random = &mut Random(1);
    let mut builder = Occluders::builder();
    let corner = |x: usize, y: usize, random: &mut Random| {
        let at = |n: usize| 8.0 * n as f64 / edge as f64 - 4.0;
        DVec3::new(at(x), at(y), random.real(0.0, 0.2))
    };
    let mut corners = Vec::new();
    for number in 0..(edge + 1) * (edge + 1) {
        corners.push(corner(number % (edge + 1), number / (edge + 1), random));
    }
    for (x, y) in (0..edge * edge).map(|n| (n % edge, n / edge)) {
        let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
            .map(|(x, y)| corners[y * (edge + 1) + x]);
        for corners in [[a, b, c], [a, c, d]] {
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
        }
    }
    for number in 0..leaf_count {
        let middle = DVec3::new(0.0, 0.0, 1.5) + DVec3::new(3.5, 3.5, 1.0) * random.in_cube();
        let mut corners = [(); 3].map(|()| middle + 0.4 * random.in_cube());
        if number == 0 {
            corners[0].x += nudge;
        }
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    let ball = Sphere {
        center: DVec3::new(0.0, 0.0, 1.2),
        radius: 0.6,
    };
    builder.add_sphere(ball, Opacity::Opaque).expect("a ball");
    Arc::new(builder.build())
}

fn lamps() -> Vec<LightShape> {
    vec![
        LightShape::Point(DVec3::new(1.5, -1.0, 4.0)),
        LightShape::Direction(DVec3::new(0.4, 0.3, 1.0)),
    ]
}

fn refinement(resolution: u32, refine: Refine) -> Refinement {
    Refinement {
        resolution,
        space_resolution: resolution / 2,
        refine,
        memory: 128 << 20,
        ..Refinement::default()
    }
}

struct World {
    occluders: Arc<Occluders>,
    lights: Vec<LightShape>,
    refinement: Refinement,
}

impl World {
    fn new(resolution: u32, refine: Refine) -> Self {
        Self {
            occluders: scene(12, 60, 0.0),
            lights: lamps(),
            refinement: refinement(resolution, refine),
        }
    }

    fn tiny() -> Self {
        Self {
            occluders: scene(1, 2, 0.0),
            lights: lamps()[..1].to_vec(),
            refinement: refinement(8, Refine::Eager),
        }
    }

    fn builder(&self) -> antumbra::Builder {
        ShadowIndex::builder(Arc::clone(&self.occluders), self.lights.clone())
            .method(Method::Voxel)
            .refinement(self.refinement)
    }

    fn index(&self) -> ShadowIndex {
        self.builder().build().expect("an index")
    }

    fn load(&self, path: &Path) -> Result<ShadowIndex, BuildError> {
        self.builder().occlusion_file(path).build()
    }

    /// Returns why a file is refused.
    fn refusal(&self, path: &Path) -> Refusal {
        match self.load(path) {
            Err(BuildError::Occlusion(error)) => {
                assert_eq!(error.path, path);
                let text = error.to_string();
                assert!(text.starts_with(&path.display().to_string()), "{text}");
                error.reason
            }
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("{} is taken", path.display()),
        }
    }

    /// Starts on surfaces and in space.
    fn starts(&self, count: usize, seed: u64) -> Vec<Start> {
        let random = &mut Random(seed);
        let occluders = &self.occluders;
        let start = |_| {
            let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
            let point = match occluders.triangle_positions(surface) {
                Some([a, b, c]) => {
                    let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                    let (s, t) = if s + t > 1.0 {
                        (1.0 - s, 1.0 - t)
                    } else {
                        (s, t)
                    };
                    a + s * (b - a) + t * (c - a)
                }
                None => {
                    let ball = occluders.sphere(surface).expect("a ball");
                    ball.center + ball.radius * random.in_cube().normalize()
                }
            };
            if random.below(4) == 0 {
                Start {
                    point: point + 0.2 * random.in_cube(),
                    surface: None,
                }
            } else {
                Start {
                    point,
                    surface: Some(surface),
                }
            }
        };
        (0..count).map(start).collect()
    }

    /// What rays say of starts, for each light.
    fn expected(&self, starts: &[Start]) -> Vec<Vec<bool>> {
        let index = self
            .builder()
            .method(Method::Bvh)
            .build()
            .expect("an index");
        (0..self.lights.len())
            .map(|light| ask(&index, starts, light).0)
            .collect()
    }

    fn assert_right(&self, index: &ShadowIndex, starts: &[Start], expected: &[Vec<bool>]) {
        for (light, expected) in expected.iter().enumerate() {
            let (found, _) = ask(index, starts, light);
            let wrong = (0..starts.len()).find(|&n| found[n] != expected[n]);
            assert_eq!(wrong.map(|n| starts[n]), None, "light {light}");
        }
    }
}

fn ask(index: &ShadowIndex, starts: &[Start], light: usize) -> (Vec<bool>, Counters) {
    let mut found = vec![false; starts.len()];
    let mut counters = Counters::default();
    index
        .shadows(starts, light, &mut found, &mut counters)
        .expect("fine queries");
    (found, counters)
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a folder");
        let name = |entry: std::io::Result<fs::DirEntry>| {
            let name = entry.expect("an entry").file_name();
            name.to_string_lossy().into_owned()
        };
        let mut names: Vec<String> = entries.map(name).collect();
        names.sort();
        names
    }
}

#[test]
fn eager_values_come_back_whole() {
    let world = World::new(64, Refine::Eager);
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
            ..World::new(64, refine)
        };
        let taken = world.load(&path).expect("it is taken");
        assert_eq!(taken.kept_lights(), [KeptLight::Taken; 2]);
        // Whether it pays or not.
        taken.set_refining(false);
        // What is known is what was known: bytes, if they are packed as well, and how each query is decided.
        let bytes = taken.occlusion_bytes();
        if refine == Refine::Eager {
            assert_eq!(bytes, made.occlusion_bytes());
        }
        for light in 0..2 {
            let (by_made, made_how) = ask(&made, &starts, light);
            let (by_taken, taken_how) = ask(&taken, &starts, light);
            assert!(by_made == by_taken && by_taken == expected[light]);
            // Columns, which are in no file, may answer in place of rays.
            let [made_how, taken_how] = [made_how.shadow, taken_how.shadow];
            assert_eq!(made_how.first_pass, taken_how.first_pass, "{refine:?}");
            assert!(taken_how.rays <= made_how.rays, "{refine:?}");
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
    for refine in [Refine::Asked, Refine::Lazy] {
        let world = World::new(256, refine);
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
        assert!(saved.pending_count > 0);
        let file = fs::read(&path).expect("a file");

        let second = world.load(&path).expect("it is taken");
        assert_eq!(second.kept_lights(), [KeptLight::Taken; 2]);
        assert_eq!(second.occlusion_bytes(), first.occlusion_bytes());
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
        if refine == Refine::Asked {
            assert!(second.occlusion_bytes() > bytes, "nothing was made");
        }
        // The file was not changed by that; another one may be written, in its place, too.
        assert!(fs::read(&path).expect("a file") == file);
        second.save(&path).expect("a file");
        let third = world.load(&path).expect("it is taken");
        assert_eq!(third.occlusion_bytes(), second.occlusion_bytes());
        world.assert_right(&third, &starts, &expected);

        // What is pending is made by who wants everything before the first query.
        let eager = World::new(256, Refine::Eager);
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
fn values_are_saved_while_they_are_made() {
    let world = World::new(256, Refine::Asked);
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
    let world = World::new(64, Refine::Eager);
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
            ..World::new(64, Refine::Eager)
        };
        let index = world.load(&path).expect("it is taken");
        assert_eq!(index.kept_lights(), expected);
        world.assert_right(&index, &starts, &world.expected(&starts));
        // Those that were made are as complete as those that were taken.
        let saved = index.save(folder.file("new.antumbra")).expect("a file");
        assert_eq!(saved.pending_count, 0);
        assert_eq!(index.occlusion_bytes(), world.index().occlusion_bytes());
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
        error.to_string().ends_with("values that are kept"),
        "{error}"
    );
}

#[test]
fn what_is_no_such_file_is_refused() {
    let world = World::tiny();
    let folder = Folder::new();
    let path = folder.file("file");
    assert!(matches!(world.refusal(&path), Refusal::Unreadable(_)));
    assert!(matches!(
        world.refusal(folder.0.path()),
        Refusal::Unreadable(_)
    ));
    for foreign in [&b""[..], b"\x93NUMPY\x01\x00", b"antumbra", &[0; 5000]] {
        fs::write(&path, foreign).expect("a file");
        assert_eq!(world.refusal(&path), Refusal::Foreign);
        // Nor is it replaced, unless nothing is lost by that.
        let saved = world.index().save(&path);
        if foreign.is_empty() {
            saved.expect("an empty file is no loss");
            continue;
        }
        let path = path.clone();
        assert_eq!(saved, Err(SaveError::Foreign { path: path.clone() }));
        assert_eq!(fs::read(&path).expect("a file"), foreign);
    }
    fs::remove_file(&path).expect("a file");
    world.index().save(&path).expect("a file");
    let mut bytes = fs::read(&path).expect("a file");
    bytes[8] = 99;
    fs::write(&path, &bytes).expect("a file");
    let (found, expected) = (99, 3);
    assert_eq!(world.refusal(&path), Refusal::Version { found, expected });
}

#[test]
fn no_byte_can_be_changed_unnoticed() {
    let world = World::tiny();
    let folder = Folder::new();
    let path = folder.file("file");
    world.index().save(&path).expect("a file");
    let whole = fs::read(&path).expect("a file");
    assert!((500..40_000).contains(&whole.len()), "{}", whole.len());
    let mut refusals = std::collections::HashMap::new();
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&path, &bytes).expect("a file");
        let refusal = world.refusal(&path);
        *refusals.entry(format!("{refusal:?}")).or_insert(0) += 1;
        let is_head = at < HEAD;
        match refusal {
            Refusal::Damaged(Part::Light(0) | Part::Tree) => assert!(!is_head, "{at}"),
            Refusal::Foreign => assert!(at < 8, "{at}"),
            Refusal::Version { .. } => assert!((8..12).contains(&at), "{at}"),
            Refusal::Length { .. } => assert!((12..16).contains(&at), "{at}"),
            Refusal::Damaged(Part::Head) => assert!(is_head, "{at}"),
            other => panic!("{at}: {other}"),
        }
    }
    assert!(refusals.len() >= 6, "{refusals:?}");
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).expect("a file");
        match world.refusal(&path) {
            Refusal::Foreign => assert_eq!(length, 0),
            Refusal::Length { found, expected } => {
                assert_eq!(found, length as u64);
                assert!(expected > found && expected <= whole.len() as u64);
            }
            other => panic!("{length}: {other}"),
        }
    }
    let mut longer = whole.clone();
    longer.push(0);
    fs::write(&path, &longer).expect("a file");
    assert!(matches!(world.refusal(&path), Refusal::Length { .. }));
    fs::write(&path, &whole).expect("a file");
    assert!(world.load(&path).is_ok());
}

/// Bytes before the entries of lights, of an entry, and of all that with a checksum, for one light.
const FIXED: usize = 132;
const ENTRY: usize = 56 + 4 * 8;
const HEAD: usize = FIXED + ENTRY + 16;

/// Where the words of the tree end.
fn tree_end(bytes: &[u8]) -> usize {
    let count = bytes[FIXED - 8..FIXED].try_into().expect("a number");
    HEAD + 4 * u64::from_le_bytes(count) as usize
}

/// Writes a file's checksums anew, so that what it says is looked at.
fn with_checksums(mut bytes: Vec<u8>) -> Vec<u8> {
    let values = tree_end(&bytes).min(bytes.len());
    let hash = |bytes: &[u8]| XxHash3_128::oneshot(bytes).to_le_bytes();
    let (of_tree, of_values) = (hash(&bytes[HEAD..values]), hash(&bytes[values..]));
    bytes[FIXED - 24..FIXED - 8].copy_from_slice(&of_tree);
    bytes[FIXED + 32..FIXED + 48].copy_from_slice(&of_values);
    let of_head = hash(&bytes[..HEAD - 16]);
    bytes[HEAD - 16..HEAD].copy_from_slice(&of_head);
    bytes
}

#[test]
fn right_checksums_over_nonsense_do_no_harm() {
    // All values, and some of them.
    for refine in [Refine::Eager, Refine::Asked] {
        let one_light = |refine| World {
            lights: lamps()[..1].to_vec(),
            ..World::new(32, refine)
        };
        let world = one_light(Refine::Lazy);
        let folder = Folder::new();
        let path = folder.file("file");
        let starts = world.starts(400, 11);
        let before = one_light(refine).index();
        ask(&before, &starts[..100], 0);
        let pending_count = before.save(&path).expect("a file").pending_count;
        assert_eq!(pending_count == 0, refine == Refine::Eager);
        spoil(&world, &folder, &starts);
    }
}

fn spoil(world: &World, folder: &Folder, starts: &[Start]) {
    let path = folder.file("file");
    let whole = fs::read(&path).expect("a file");
    assert_eq!(with_checksums(whole.clone()), whole);
    let random = &mut Random(13);
    let (mut taken, mut refused) = (0, std::collections::HashMap::new());
    for round in 0..3_000 {
        let mut bytes = whole.clone();
        let first = if round % 8 == 0 {
            HEAD
        } else {
            tree_end(&whole)
        };
        for _ in 0..1 + random.below(4) {
            let word = first + 4 * random.below((whole.len() - first) / 4);
            let new = match random.below(4) {
                0 => random.bits() as u32,
                1 => (random.below(4) as u32) << 30 | random.below(70) as u32,
                2 => u32::MAX >> random.below(32),
                _ => {
                    let bytes = bytes[word..word + 4].try_into().expect("a word");
                    u32::from_le_bytes(bytes) ^ 1 << random.below(32)
                }
            };
            bytes[word..word + 4].copy_from_slice(&new.to_le_bytes());
        }
        fs::write(&path, with_checksums(bytes)).expect("a file");
        match world.load(&path) {
            // It may answer wrongly, and nothing worse.
            Ok(index) => {
                taken += 1;
                for refining in [false, true] {
                    index.set_refining(refining);
                    ask(&index, starts, 0);
                }
                index.save(folder.file("again")).expect("a file");
            }
            Err(error) => {
                let BuildError::Occlusion(error) = error else {
                    panic!("{error}")
                };
                let Refusal::Malformed { what, .. } = error.reason else {
                    panic!("{error}")
                };
                *refused.entry(what).or_insert(0) += 1;
            }
        }
    }
    assert!(taken > 100 && refused.len() >= 5, "{taken} {refused:?}");
    // Parts that are longer than the file, in words that overflow.
    for count in [u64::MAX, u64::MAX / 4, 1 << 62, 1 << 40] {
        for at in [FIXED - 8, FIXED + 48, FIXED + 72] {
            let mut bytes = whole.clone();
            bytes[at..at + 8].copy_from_slice(&count.to_le_bytes());
            let checksum = XxHash3_128::oneshot(&bytes[..HEAD - 16]).to_le_bytes();
            bytes[HEAD - 16..HEAD].copy_from_slice(&checksum);
            fs::write(&path, bytes).expect("a file");
            let refusal = world.refusal(&path);
            let is_in_head = matches!(
                refusal,
                Refusal::Malformed {
                    part: Part::Head,
                    ..
                }
            );
            assert!(is_in_head, "{refusal}");
        }
    }
}

#[test]
fn values_without_room_are_left_out() {
    let world = World::new(128, Refine::Eager);
    let folder = Folder::new();
    let path = folder.file("file");
    let whole = world.index();
    whole.save(&path).expect("a file");
    let starts = world.starts(10_000, 15);
    let expected = world.expected(&starts);
    let bytes = whole.knowledge_bytes();
    let mut seen = Vec::new();
    for share in [0, 4, 8, 12, 30] {
        let mut world = World::new(128, Refine::Lazy);
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
    let world = World::new(64, Refine::Eager);
    let folder = Folder::new();
    let path = folder.file("part");
    let starts = world.starts(10_000, 16);
    let expected = world.expected(&starts);
    let whole = world.index().knowledge_bytes();
    let (mut part_count, mut is_any_partly_made) = (0, false);
    for share in [0, 2, 4, 8, 12, 16, 20, 24, 28, 32, 36, 40, 50, 60] {
        let mut small = World::new(64, Refine::Eager);
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
    let world = World::new(64, Refine::Lazy);
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
    let eager = World::new(64, Refine::Eager);
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
            ..World::new(32, Refine::Lazy)
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

/// What a child process does, and the file it does it to.
const CHILD: &str = "ANTUMBRA_TEST_CHILD";

/// Starts this test again, in another process, to do something to a file until it is killed.
fn start_child(does: &str, path: &Path) -> Child {
    Command::new(std::env::current_exe().expect("this program"))
        .args(["child", "--exact", "--ignored", "--nocapture"])
        .env(CHILD, format!("{does}:{}", path.display()))
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("another process")
}

/// Worlds that differ by a light: a file of one is whole, of both it is not.
fn worlds() -> [World; 2] {
    let world = |x| World {
        lights: vec![LightShape::Point(DVec3::new(x, -1.0, 4.0)); 1],
        ..World::new(64, Refine::Eager)
    };
    [world(1.5), world(-1.5)]
}

#[test]
#[ignore = "other tests start it in processes of their own"]
fn child() {
    let Ok(task) = std::env::var(CHILD) else {
        return;
    };
    let (does, path) = task.split_once(':').expect("a task");
    let path = Path::new(path);
    let worlds = worlds();
    match does {
        "write" => {
            let indices = worlds.map(|world| world.index());
            for index in indices.iter().cycle() {
                index.save(path).expect("a file");
            }
        }
        "read" => loop {
            let taken = worlds.each_ref().map(|world| {
                let index = world.load(path).expect("a whole file");
                index.kept_lights()[0]
            });
            // Between two looks the writer may have written again.
            assert!(taken.iter().all(|kept| *kept != KeptLight::NoRoom));
        },
        other => panic!("{other}"),
    }
}

/// How often a file is replaced by another one within some time, by its number.
#[cfg(unix)]
fn changes_of(path: &Path, time: Duration) -> usize {
    use std::os::unix::fs::MetadataExt as _;
    let begin = Instant::now();
    let (mut last, mut changes) = (0, 0);
    while begin.elapsed() < time {
        let now = fs::metadata(path).expect("always a file").ino();
        changes += usize::from(now != last);
        last = now;
    }
    changes
}

#[test]
#[cfg(unix)]
fn a_writer_that_is_killed_leaves_a_whole_file() {
    let worlds = worlds();
    let folder = Folder::new();
    let path = folder.file("file");
    worlds[0].index().save(&path).expect("a file");
    let random = &mut Random(17);
    let starts = worlds[0].starts(500, 19);
    let expected = worlds.each_ref().map(|world| world.expected(&starts));
    let (mut partial_count, mut seen) = (0, [false; 2]);
    for _ in 0..12 {
        let mut child = start_child("write", &path);
        // Until it writes, and a little longer.
        while changes_of(&path, Duration::from_millis(20)) < 2 {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
        }
        std::thread::sleep(Duration::from_micros(random.below(8_000) as u64));
        child.kill().expect("it is killed");
        child.wait().expect("it has ended");
        partial_count += folder.names().len() - 1;
        for name in folder.names().iter().filter(|name| *name != "file") {
            fs::remove_file(folder.file(name)).expect("what was left is gone");
        }
        // Whole, with the one light or the other.
        for (number, world) in worlds.iter().enumerate() {
            let index = world.load(&path).expect("a whole file");
            seen[number] |= index.kept_lights() == [KeptLight::Taken];
            world.assert_right(&index, &starts, &expected[number]);
        }
    }
    assert!(partial_count > 0, "it was never killed while it wrote");
    assert_eq!(seen, [true; 2]);
}

/// Without it, a page of a mapped file that is gone ended the process by a signal.
#[test]
fn a_file_that_is_cut_off_while_it_is_opened_is_an_error() {
    let worlds = worlds();
    let folder = Folder::new();
    let path = folder.file("file");
    worlds[0].index().save(&path).expect("a file");
    let whole = fs::read(&path).expect("a file");
    let is_done = std::sync::atomic::AtomicBool::new(false);
    let mut refusals = 0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let random = &mut Random(23);
            while !is_done.load(std::sync::atomic::Ordering::Relaxed) {
                fs::write(&path, &whole).expect("a file");
                let pause = Duration::from_micros(random.below(300) as u64);
                std::thread::sleep(pause);
                let length = random.below(whole.len()) as u64;
                let file = fs::OpenOptions::new().write(true).open(&path);
                let cut = file.and_then(|file| file.set_len(length));
                cut.expect("it is cut off");
            }
        });
        let begin = Instant::now();
        for _ in 0..400 {
            let loaded = worlds[0].load(&path);
            refusals += usize::from(loaded.is_err());
            if begin.elapsed() > Duration::from_secs(60) {
                break;
            }
        }
        is_done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    assert!(refusals > 0, "it was never cut off");
}

#[test]
#[cfg(unix)]
fn two_processes_read_while_one_writes() {
    let folder = Folder::new();
    let path = folder.file("file");
    worlds()[0].index().save(&path).expect("a file");
    let mut readers = [(); 2].map(|()| start_child("read", &path));
    let mut writer = start_child("write", &path);
    let mut changes = 0;
    let begin = Instant::now();
    while changes < 20 {
        changes += changes_of(&path, Duration::from_millis(100)).saturating_sub(1);
        for child in readers.iter_mut().chain([&mut writer]) {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
        }
        assert!(
            begin.elapsed() < Duration::from_secs(300),
            "nothing is written"
        );
    }
    for child in readers.iter_mut().chain([&mut writer]) {
        child.kill().expect("it is killed");
        child.wait().expect("it has ended");
    }
}
