//! Files that are wrong: other people's, and good ones cut, spliced and sprinkled with garbage.

use std::time::{Duration, Instant};

use antumbra_scene::{Loaded, ReadError, ReadOptions, read::read_nff, read_file};

use crate::support::{Random, nff, obj, shared_scenes};

fn read(file: &str) -> Option<Result<Loaded, ReadError>> {
    let path = shared_scenes()?.join("malformed").join(file);
    Some(read_file(&path, &ReadOptions::default()))
}

/// The README of the shared scenes says which outcomes are acceptable; these are ours.
#[test]
fn rejected() {
    for (file, reason) in [
        (
            "obj/assimp/malformed.obj",
            ":28: in `f`: index 0 names no `v`",
        ),
        (
            "obj/magnum/invalid-numbers.obj",
            ":14: in `v`: expected 3 numbers",
        ),
        (
            "obj/tinyobjloader/invalid-relative-vertex-index.obj",
            ":1: in `f`: index -4 names no `v`: only 0 came before",
        ),
        (
            "ply/assimp/payload_JVN42386607.ply",
            ":6: in `element`: `vertex` is declared twice",
        ),
        (
            "ply/magnum/integer-literal-too-large.ply",
            ":5: in `element`: `4294967296` elements are more than 2^32 - 1",
        ),
        (
            "ply/magnum/invalid-signature.ply",
            ":1: expected `ply` on the first line, found ",
        ),
        (
            "ply/magnum/positions-not-all.ply",
            ":3: in `element vertex`: expected a number each for the properties x, y and z",
        ),
    ] {
        let Some(result) = read(file) else { return };
        let error = result.unwrap_err().to_string();
        assert!(error.contains(&format!("{file}{reason}")), "{error}");
    }
}

#[test]
fn loaded_with_warnings() {
    for (file, objects, warning) in [
        (
            "nff/assimp/dodecahedron.nff",
            0,
            ":1: `dod` is not NFF (assimp's addition): skipped",
        ),
        (
            "nff/assimp/positionTest.nff",
            15,
            ":3: `tess` is not NFF (assimp's addition): skipped",
        ),
        (
            "obj/magnum/invalid-keywords.obj",
            0,
            ":2: unknown keyword `bleh`: skipped",
        ),
        (
            "obj/tinyobjloader/invalid-face-definition.obj",
            0,
            ":15: a face has fewer than 3 corners: dropped (2 times; this is the first)",
        ),
        ("obj/trimesh/empty.obj", 0, ": no faces in the file"),
    ] {
        let Some(result) = read(file) else { return };
        let loaded = result.unwrap();
        assert_eq!(loaded.scene.objects.len(), objects, "{file}");
        let said = loaded
            .warnings
            .iter()
            .any(|w| w.to_string().contains(&format!("{file}{warning}")));
        assert!(said, "{:?}", loaded.warnings);
    }
}

#[test]
fn loaded_without_warnings() {
    let Some(result) = read("stl/assimp/triangle_with_empty_solid.stl") else {
        return;
    };
    let loaded = result.unwrap();
    assert_eq!(loaded.warnings, []);
    let names: Vec<_> = loaded.scene.objects.iter().map(|o| &*o.name).collect();
    assert_eq!(names, ["testTriangle"]);
}

#[test]
fn a_git_lfs_pointer_is_no_scene() {
    let Some(folder) = shared_scenes() else {
        return;
    };
    let bytes = std::fs::read(folder.join("malformed/gltf/lfs-pointer/sponza.glb")).unwrap();
    let error = read_nff("sponza.nff".as_ref(), &bytes)
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "sponza.nff: expected a scene, found a git-lfs pointer; \
         help: run `git lfs pull` in the checkout the file comes from"
    );
}

const NFF: &str = "# all of it\nb 0.1 0.2 0.3\nv\nfrom 1 2 3\nat 0 0 0\nup 0 0 1\nangle 45\nhither 1\n\
    resolution 512 512\nl 1 2 3\nl 4 5 6 1 1 1\nf 1 0.5 0.2 1 0.5 100 0.1 1.2 t.png\ns 0 0 0 1\n\
    c 0 0 0 1 0 0 2 1e-1\np 4 0 0 0 1 0 0 1 1 0 0 1 0\ntess 4\n\
    pp 3 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1\n";
const OBJ: &str = "# all of it\nmtllib a.mtl none.mtl\no a\nv 0 0 0\nv 1 0 0 1\nv 0 1 0 1 0 0\nvt 0 0\n\
    vn 0 0 1\ng b c\nusemtl m\ns 1\nf 1 2 3\nf 1/1/1 2/1/1 \\\n3/1/1\nf -1//-1 -2//-1 -3//-1\nl 1 2\n";
const MTL: &str =
    "newmtl m\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 10\nd 0.5\nTf 1 1 1\nNi 1.5\nillum 7\nmap_Kd x.png\n";

/// Every outcome is fine but a panic; what loads is finite and in range.
fn check(loaded: &Loaded) {
    for object in &loaded.scene.objects {
        assert!(object.material < loaded.scene.materials.len());
        let bounds = object.shape.bounds();
        assert!(bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty());
    }
}

#[test]
fn every_prefix_ends_in_order() {
    for end in 0..=NFF.len() {
        let _ = nff(&NFF[..end]).inspect(check);
    }
    for end in 0..=OBJ.len() {
        let _ = obj(&OBJ[..end], MTL).inspect(check);
    }
    for end in 0..=MTL.len() {
        let _ = obj(OBJ, &MTL[..end]).inspect(check);
    }
    check(&nff(NFF).unwrap());
    check(&obj(OBJ, MTL).unwrap());
}

/// Splices pieces of the files and words that have broken parsers before.
#[test]
fn random_splices_end_in_order() {
    const NASTY: [&str; 24] = [
        "nan",
        "1e999",
        "-",
        "+",
        ".",
        "e",
        "#",
        "\\",
        "\\\n",
        "/",
        "//",
        "0",
        "-1",
        "99999999999",
        "-9223372036854775808",
        "1e30",
        "-0",
        "é",
        "\u{0}",
        "\r",
        "v",
        "f 1 1 1",
        "pp 3",
        "5e-324",
    ];
    let mut random = Random(7);
    let mut loaded_count = 0;
    for _ in 0..20_000 {
        let source = [NFF, OBJ, MTL][random.below(3)];
        let mut words: Vec<_> = source
            .split_inclusive(|c: char| c.is_ascii_whitespace())
            .collect();
        for _ in 0..=random.below(4) {
            let at = random.below(words.len());
            match random.below(4) {
                0 => words[at] = NASTY[random.below(NASTY.len())],
                1 => words.insert(at, NASTY[random.below(NASTY.len())]),
                2 if words.len() > 1 => drop(words.remove(at)),
                _ => words.swap(0, at),
            }
        }
        let text = words.concat();
        for loaded in [nff(&text), obj(&text, MTL), obj(OBJ, &text)]
            .iter()
            .flatten()
        {
            check(loaded);
            loaded_count += 1;
        }
    }
    assert!(loaded_count > 1000, "{loaded_count} of the splices load");
}

/// Names are what takes most memory for a byte, so there is an end to them.
#[test]
fn names_are_limited() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let parts = |count: usize| -> String {
        let part = |i| format!("g {i:x}\nf 1 2 3\n");
        (0..count).map(part).collect()
    };
    let error = obj(&(vertices.to_owned() + &parts((1 << 20) + 1)), "").unwrap_err();
    let reason = "in `f`: there are more than 1048576 pairs of name and material";
    assert!(error.to_string().contains(reason), "{error}");
    let library =
        |count: usize| -> String { (0..count).map(|i| format!("newmtl {i}\n")).collect() };
    let scene = format!("mtllib a.mtl\n{vertices}usemtl 7\nf 1 2 3\n");
    assert!(obj(&scene, &library(1 << 16)).is_ok());
    let error = obj(&scene, &library((1 << 16) + 1))
        .unwrap_err()
        .to_string();
    let reason = "a.mtl:65537: in `newmtl`: there are more than 65536 materials";
    assert!(error.contains(reason), "{error}");
}

/// Claims and repetitions that would make a quadratic or trusting reader hang.
#[test]
fn large_nonsense_takes_no_time() {
    let start = Instant::now();
    let many = 200_000;
    assert!(nff(&"p 2000000000 ".repeat(many)).is_err());
    assert!(nff(&"s 0 0 0 0\n".repeat(many)).is_ok());
    assert!(nff(&"f 1 1 1\n".repeat(many)).is_ok());
    assert!(nff(&"1".repeat(many)).is_err());
    assert!(obj(&"\\\n".repeat(many), "").is_ok());
    assert!(obj(&"g a\nusemtl b\n".repeat(many), "").is_ok());
    assert!(obj(&"mtllib a.mtl\n".repeat(many), MTL).is_ok());
    let distinct: String = (0..many)
        .map(|i| format!("k{i}\nusemtl m{i}\nmtllib n{i}\n"))
        .collect();
    let loaded = obj(&distinct, "").unwrap();
    assert!(loaded.warnings.len() < 100);
    let objects: String = (0..many / 4).map(|i| format!("g {i}\nf 1 2 3\n")).collect();
    assert_eq!(
        obj(&format!("{objects}v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "")
            .unwrap()
            .scene
            .objects
            .len(),
        many / 4
    );
    assert!(
        start.elapsed() < Duration::from_secs(10),
        "{:?}",
        start.elapsed()
    );
}
