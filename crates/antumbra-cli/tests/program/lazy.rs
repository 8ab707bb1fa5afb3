//! Values that are made while a picture is: nobody must see when, by how many threads and in how much memory.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::{Folder, antumbra, assert_code, count, figures, rendered, text};

/// Little enough that values are thrown away, or are not there at all.
const MEMORIES: [&[&str]; 3] = [
    &[],
    &["--occlusion-memory", "16KiB"],
    &["--occlusion-memory", "1B"],
];

const VIEW: [&str; 10] = [
    "--size",
    "96x72",
    "--spp",
    "2",
    "--light",
    "point:3,-2,5",
    "--light",
    "point:-1,-4,3/0.5,0.6,0.7",
    "--aov",
    "shadow",
];

/// Writes one of the built-in scenes.
fn generated(folder: &Folder, name: &str, size: &str) -> PathBuf {
    let scene = folder.path(&format!("{name}.nff"));
    let arguments = ["scene", name, "--size", size, "-o", text(&scene)];
    assert_code(&antumbra(&arguments), 0);
    scene
}

/// The bytes of a picture and of what lies beside it.
fn layers(folder: &Folder, scene: &Path, more: &[&str]) -> [Vec<u8>; 3] {
    let masks = [1, 2].map(|light| folder.path(&format!("picture.shadow.light-{light}.png")));
    // What an earlier run has left is no mask of this one.
    for mask in &masks {
        let _ = fs::remove_file(mask);
    }
    let picture = rendered(folder, scene, &[&VIEW[..], more].concat());
    let [first, second] = masks.map(|mask| fs::read(mask).unwrap());
    [picture, first, second]
}

#[test]
fn pictures_and_masks_do_not_depend_on_when_values_are_made() {
    let folder = Folder::new();
    for (name, size) in [("tetra", "4"), ("sphereflake", "2")] {
        let scene = generated(&folder, name, size);
        let expected = layers(&folder, &scene, &["--shadows", "bvh"]);
        assert!(expected.iter().all(|layer| layer.starts_with(b"\x89PNG")));
        assert!(expected[1] != expected[2], "lights have masks of their own");
        for refine in ["lazy", "eager"] {
            for threads in ["1", "2", "7"] {
                for memory in MEMORIES {
                    let more = [
                        &["--shadows", "voxel", "--resolution", "32"],
                        &["--refine", refine, "--threads", threads],
                        memory,
                    ]
                    .concat();
                    let found = layers(&folder, &scene, &more);
                    assert!(found == expected, "{name}: {more:?}");
                }
            }
        }
        let found = layers(&folder, &scene, &["--shadows", "voxel"]);
        assert!(found == expected, "{name}: as finely as usual");
    }
}

#[test]
fn figures_of_lazy_values_add_up_and_keep_to_the_memory() {
    let folder = Folder::new();
    let scene = generated(&folder, "tetra", "4");
    let of = |more: &[&str]| {
        let voxel = ["--shadows", "voxel", "--resolution", "32"];
        figures(&folder, &scene, &[&VIEW[..], &voxel, more].concat())
    };
    let expected = figures(
        &folder,
        &scene,
        &[&VIEW[..], &["--shadows", "bvh"]].concat(),
    );
    for (refine, memory, most) in [
        ("lazy", "1B", 0),
        ("lazy", "16KiB", 16 << 10),
        ("lazy", "256MiB", 256 << 20),
        ("eager", "16KiB", 16 << 10),
    ] {
        let found = of(&["--refine", refine, "--occlusion-memory", memory]);
        for path in [
            "/rays/primary",
            "/shadow/queries",
            "/shadow/facing_away",
            "/shadow/shadowed",
        ] {
            assert_eq!(count(&found, path), count(&expected, path), "{path}");
        }
        let decided = ["first_pass", "intermediate", "blocker_list", "rays"];
        let decided = decided.map(|name| count(&found, &format!("/shadow/{name}")));
        let asked = count(&found, "/shadow/queries") - count(&found, "/shadow/facing_away");
        assert_eq!(decided.iter().sum::<u64>(), asked);
        let taken = count(&found, "/memory/occlusion_bytes");
        assert!(taken <= most, "{taken} of {memory}");
        if most == 0 {
            assert_eq!(decided, [0, 0, 0, asked], "only rays are left");
        }
    }
    // All of them are made before, and some do without rays.
    let eager = of(&["--refine", "eager"]);
    assert!(count(&eager, "/shadow/first_pass") > 0);
    assert!(count(&eager, "/shadow/rays") < count(&expected, "/shadow/rays"));
}
