//! The generators against SPD's own files, word by word.

use antumbra_scene::{
    generate::{sphereflake, tetra},
    model::Scene,
    write::{Precision, write_nff},
};

use crate::support::{nff, shared_scenes};

fn text_of(scene: &Scene) -> String {
    let mut text = Vec::new();
    write_nff(scene, Precision::SixDigits, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// Compares line by line. Two numbers have no place in the model and are left out: `hither`,
/// and the index of refraction of what is opaque.
#[test]
fn the_same_words_as_spd() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    for (name, scene) in [
        ("tetra_3", tetra(3).unwrap()),
        ("tetra_6", tetra(6).unwrap()),
        ("balls_2", sphereflake(2).unwrap()),
        ("balls_3", sphereflake(3).unwrap()),
    ] {
        let theirs = std::fs::read_to_string(folder.join(format!("nff/spd/{name}.nff"))).unwrap();
        let ours = text_of(&scene);
        assert_eq!(ours.lines().count(), theirs.lines().count(), "{name}");
        for (i, (ours, theirs)) in ours.lines().zip(theirs.lines()).enumerate() {
            let mut ours: Vec<_> = ours.split(' ').collect();
            let mut theirs: Vec<_> = theirs.split(' ').collect();
            if ours[0] == "hither" && theirs[0] == "hither" {
                continue;
            }
            if ours[0] == "f" && ours[7] == "0" {
                ours.pop();
                theirs.pop();
            }
            assert_eq!(ours, theirs, "{name}, line {}", i + 1);
        }
    }
}

#[test]
fn counts_follow_the_formula() {
    for size in 1..=5 {
        assert_eq!(tetra(size).unwrap().objects.len(), 4_usize.pow(size));
    }
    assert_eq!(sphereflake(1).unwrap().objects.len(), 11);
    assert_eq!(sphereflake(2).unwrap().objects.len(), 92);
    assert_eq!(sphereflake(3).unwrap().objects.len(), 821);
}

/// What a generator makes is what its file says, so both give the same picture.
#[test]
fn the_exact_text_of_a_generated_scene_reads_back_equal() {
    for scene in [tetra(4).unwrap(), sphereflake(2).unwrap()] {
        let mut text = Vec::new();
        write_nff(&scene, Precision::Exact, &mut text).unwrap();
        let loaded = nff(std::str::from_utf8(&text).unwrap()).unwrap();
        assert_eq!(loaded.scene, scene);
        assert_eq!(loaded.warnings, []);
    }
}

/// The same bits on every platform, also where SPD's files are not at hand: FNV-1a of the text.
/// The values were taken when `the_same_words_as_spd` passed.
#[test]
fn the_text_never_changes() {
    let digest = |scene: &Scene, precision| {
        let mut text = Vec::new();
        write_nff(scene, precision, &mut text).unwrap();
        text.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    };
    for (scene, six_digits, exact) in [
        (
            tetra(6).unwrap(),
            0x6871_26f9_942f_bb1c,
            0x72bb_539a_f63e_3835,
        ),
        (
            sphereflake(3).unwrap(),
            0x6cf9_b73a_eb24_b856,
            0xda3b_6290_03b4_509d,
        ),
    ] {
        let found = (
            digest(&scene, Precision::SixDigits),
            digest(&scene, Precision::Exact),
        );
        assert_eq!(found, (six_digits, exact), "{found:#x?}");
    }
}
