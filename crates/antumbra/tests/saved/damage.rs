//! Files that are something else, were damaged, or say nonsense.

use std::fs;

use antumbra::{BuildError, LightId, Part, Refine, Refusal, SaveError};
use antumbra_geometry::ReceiverPoint;
use twox_hash::XxHash3_128;

use crate::common::Random;
use crate::world::{Folder, METHODS, World, ask, lamps};

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
    let (found, expected) = (99, 6);
    assert_eq!(world.refusal(&path), Refusal::Version { found, expected });
}

#[test]
fn no_byte_can_be_changed_unnoticed() {
    METHODS
        .into_iter()
        .for_each(|method| check_every_byte(&World::tiny().by(method)));
}

fn check_every_byte(world: &World) {
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
            Refusal::Damaged(Part::Light(LightId(0)) | Part::Tree) => assert!(!is_head, "{at}"),
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
const FIXED: usize = 136;
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
    let all = METHODS.map(|method| [Refine::Eager, Refine::Queried].map(|refine| (method, refine)));
    for (method, refine) in all.into_iter().flatten() {
        let one_light = |refine| World {
            lights: lamps()[..1].to_vec(),
            ..World::new(32, refine).by(method)
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

fn spoil(world: &World, folder: &Folder, starts: &[ReceiverPoint]) {
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
