//! Files of people that stand where the program would write under a name that it makes itself.

use std::fs;

use crate::support::{Folder, antumbra, assert_code, stderr, text};

/// Names that follow from what was typed: the user has not said that those files may be replaced.
#[test]
fn what_antumbra_did_not_write_is_not_replaced_under_a_name_that_nobody_gave() {
    let (folder, scene) = Folder::with_scene();
    let path = |name: &str| text(&folder.path(name)).to_owned();
    let names = || {
        let entries = fs::read_dir(folder.path("")).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
        names.sort();
        names
    };
    let scene = text(&scene);
    let picture = path("p.png");
    let layers = ["render", scene, "--size", "8x8", "--aov", "shadow,decided"];
    let layers = [&layers[..], &["-o", &picture]].concat();
    let orbit = |out| vec!["render", scene, "--size", "8x8", "--orbit", "2", "-o", out];
    let [frames, floats] = ["f.png", "f.exr"].map(path);
    let mesh = path("mesh.ply");
    let triangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                    property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                    end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::write(&mesh, triangle).unwrap();
    let obj = path("mesh.obj");
    // A page that only speaks of antumbra is somebody's, too.
    let foreign = b"<html><title>My notes on antumbra</title>";
    for (command, name) in [
        (layers.clone(), "p.decided-by.png"),
        (orbit(&frames), "f-0002.png"),
        (orbit(&floats), "f-0001.exr"),
        (vec!["convert", &mesh, &obj], "mesh.mtl"),
    ] {
        let at = path(name);
        fs::write(&at, foreign).unwrap();
        let before = names();
        let refused = antumbra(&command);
        assert_code(&refused, 2);
        let said = stderr(&refused).replace('\n', " ");
        assert!(said.contains("did not write"), "{name}: {said}");
        assert_eq!(fs::read(&at).unwrap(), foreign, "{name}");
        assert_eq!(names(), before, "{name}: refused before it worked");
        // What is empty is nobody's, and what antumbra wrote it replaces.
        fs::write(&at, "").unwrap();
        for _ in 0..2 {
            assert_code(&antumbra(&command), 0);
            assert!(
                fs::metadata(&at).unwrap().len() > foreign.len() as u64 / 2,
                "{name}"
            );
        }
    }
}
