//! Patches and implicit surfaces on the command line.

use std::fs;

use super::support::{Folder, antumbra, assert_code, rendered, stderr, stdout, text};

#[test]
fn curved_scenes_are_written_read_and_agree_under_attack() {
    for (name, size) in [
        ("teapot", "4"),
        ("knot", "6"),
        ("metaballs", "5"),
        ("gyroid", "1"),
    ] {
        let folder = Folder::new();
        let scene = folder.path("scene.nff");
        let made = antumbra(&["scene", name, "--size", size, "-o", text(&scene), "-q"]);
        assert_code(&made, 0);
        let verified = antumbra(&[
            "verify",
            text(&scene),
            "--queries",
            "3000",
            "--attack",
            "--resolution",
            "128",
        ]);
        assert_code(&verified, 0);
        let said = stdout(&verified);
        assert!(
            said.contains("0 differences") || said.contains(" 0 "),
            "{said}"
        );
    }
}

#[test]
fn curved_shapes_leave_as_meshes_where_asked() {
    let folder = Folder::new();
    let scene = folder.path("scene.nff");
    let curved = "v\nfrom 4 4 4\nat 0 0 0\nup 0 0 1\nangle 40\nl 5 5 9\nf 1 1 1 1 0 1 0 1\ns 0 0 0 1\nc 2 0 0 .5 2 0 1 .25\n\
                  torus -2 0 0 0 0 1 .5 .2\n";
    fs::write(&scene, curved).unwrap();
    for ending in ["obj", "ply", "glb"] {
        let out = folder.path(&format!("scene.{ending}"));
        let refused = antumbra(&["convert", text(&scene), text(&out)]);
        assert_code(&refused, 2);
        assert!(
            stderr(&refused).contains("a sphere"),
            "{}",
            stderr(&refused)
        );
        assert!(
            stderr(&refused).contains("--tessellate"),
            "{}",
            stderr(&refused)
        );
        let done = antumbra(&["convert", text(&scene), text(&out), "--tessellate", "16"]);
        assert_code(&done, 0);
        assert!(fs::metadata(&out).unwrap().len() > 10_000);
    }
    // A picture of meshes is another one, and nearly the same.
    let exact = rendered(&folder, &scene, &["--size", "40x30"]);
    let meshes = rendered(&folder, &scene, &["--size", "40x30", "--tessellate", "64"]);
    assert!(exact != meshes);
    let refused = antumbra(&["render", text(&scene), "--tessellate", "0"]);
    assert_code(&refused, 2);
}
