//! PLY files that are wrong: each error names its line or byte.

use crate::ply::{XYZ, plain, ply, refusal, triangle, warnings};

#[test]
fn header_errors_name_their_line() {
    for (header, reason) in [
        ("", "a.ply:3: expected an element `vertex`, found none"),
        (
            "format ascii 1.0\n",
            "a.ply:3: in `format`: the format is given twice",
        ),
        (
            "elements\n",
            "a.ply:3: unknown keyword `elements`; expected one of format, comment",
        ),
        (
            "property float x\n",
            "a.ply:3: in `property`: it belongs to no element",
        ),
        (
            "element vertex\n",
            "a.ply:3: in `element`: expected a name and how many there are, found the end",
        ),
        (
            "element vertex -1\n",
            "a.ply:3: in `element`: expected a name and how many there are, found `-1`",
        ),
        (
            "element vertex 4294967296\n",
            "a.ply:3: in `element`: `4294967296` elements are more than 2^32 - 1",
        ),
        ("element vertex 1e3\n", "found `1e3`"),
        (
            "element a 1\nelement a 1\n",
            "a.ply:4: in `element`: `a` is declared twice",
        ),
        (
            "element vertex 1\nproperty real x\n",
            "a.ply:4: in `property`: expected a type (char, uchar",
        ),
        (
            "element vertex 1\nproperty float\n",
            "a.ply:4: in `property`: expected a type and a name",
        ),
        (
            "element vertex 1\nproperty float x\nproperty int x\n",
            "a.ply:5: in `property`: `x` is declared twice",
        ),
        (
            "element vertex 1\nproperty list float int x\n",
            "a.ply:4: in `property`: the count of a list has to be an integer",
        ),
        (
            "element vertex 1\nproperty float x\nproperty float y\n",
            "a.ply:3: in `element vertex`: expected a number each for the properties x, y and z, found none for `z`",
        ),
        (
            "element vertex 1\nproperty float x\nproperty float y\nproperty list char int z\n",
            "found none for `z`",
        ),
        (
            &format!("element vertex 1\n{XYZ}element face 1\n"),
            "a.ply:7: in `element face`: expected a list of integers `vertex_indices`",
        ),
        (
            &format!("element vertex 1\n{XYZ}element face 1\nproperty int vertex_indices\n"),
            "a.ply:7: in `element face`",
        ),
        (
            &format!(
                "element vertex 1\n{XYZ}element face 1\nproperty list int float vertex_indices\n"
            ),
            "a.ply:7: in `element face`",
        ),
        (
            &format!("element vertex 1\n{XYZ}element tristrips 1\nproperty int vertex_indices\n"),
            "a.ply:7: in `element tristrips`: expected a list of integers `vertex_indices`",
        ),
    ] {
        let error = refusal(triangle(header, ""));
        assert!(error.contains(reason), "{header}: {error}");
    }
    for (text, reason) in [
        (
            "",
            "a.ply:1: expected `ply` on the first line, found an empty line",
        ),
        (
            "plx\n",
            "a.ply:1: expected `ply` on the first line, found `plx`",
        ),
        (
            "ply\nelement vertex 0\n",
            "a.ply:2: expected `end_header`, found the end of the file",
        ),
        (
            "ply\nend_header\n",
            "a.ply:2: expected a `format` line before `end_header`, found none",
        ),
        (
            "ply\nformat text 1.0\n",
            "a.ply:2: in `format`: expected `ascii`, `binary_little_endian` or",
        ),
        (
            "ply\nformat ascii 2.0\n",
            "a.ply:2: in `format`: expected version 1.0, found `2.0`",
        ),
    ] {
        let error = refusal(text);
        assert!(error.contains(reason), "{text}: {error}");
    }
    assert!(refusal(b"ply\nelement \xff 1").starts_with("a.ply:2: expected UTF-8 text"));
    let many: String = (0..2000).map(|i| format!("element e{i} 0\n")).collect();
    assert!(
        refusal(triangle(&many, "")).contains("a.ply:1027: in `element`: there are more than 1024")
    );
    let lfs = refusal("version https://git-lfs.github.com/spec/v1\noid");
    assert!(lfs.contains("git lfs pull"));
}

#[test]
fn body_errors_in_text_name_their_line() {
    for (body, reason) in [
        (
            "0 0 0\n1 0 x\n",
            "a.ply:11: in `vertex`: expected a number for `z` of `vertex` 2 of 3, found `x`",
        ),
        (
            "0 0 0\n1 0 2e30\n0 1 0\n3 0 1 2\n",
            "a.ply:13: in `face`: 2.0000000",
        ),
        (
            "0 0 0\n1 0 0 0\n",
            "a.ply:11: in `vertex`: expected the end of the line after `vertex` 2 of 3, found `0`; help: check the properties",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n",
            "a.ply:13: in `face`: expected the length of a list for `vertex_indices` of `face` 1 of 1, found the end of the file; help: the file may be cut short",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n3 0 1\n",
            "a.ply:14: in `face`: expected an index for `vertex_indices` of `face` 1 of 1, found the end of the file",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n",
            "a.ply:13: in `face`: `vertex_indices`: index 3 names no vertex: the file has 3",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n",
            "a.ply:13: in `face`: `vertex_indices`: index -1 names no vertex",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n3 0 1 1.5\n",
            "a.ply:13: in `face`: expected an index for `vertex_indices` of `face` 1 of 1, found `1.5`",
        ),
        (
            "0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n",
            "a.ply:13: in `face`: `vertex_indices`: a list has the length -3; expected 0 or more",
        ),
    ] {
        let error = refusal(plain(body));
        assert!(error.contains(reason), "{body}: {error}");
    }
    assert!(
        refusal([plain("0 0 ").as_bytes(), b"\xff\n"].concat()).contains("a.ply:10: in `vertex`")
    );
}

#[test]
fn body_errors_in_bytes_name_their_byte() {
    let header = plain("").replace("ascii", "binary_little_endian");
    let start = header.len();
    let floats = |numbers: [f32; 9]| {
        numbers
            .iter()
            .flat_map(|n| n.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let good = floats([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let corners = |count: u8, indices: [i32; 3]| {
        let indices = indices.iter().flat_map(|i| i.to_le_bytes());
        [count].into_iter().chain(indices).collect::<Vec<_>>()
    };
    for (body, offset, reason) in [
        (
            good[..30].to_vec(),
            28,
            "in `vertex`: expected a number for `y` of `vertex` 3 of 3, found the end of the file",
        ),
        (
            [&good[..], &corners(3, [0, 1, 3])].concat(),
            45,
            "in `face`: `vertex_indices`: index 3 names no vertex",
        ),
        (
            [&good[..], &corners(255, [0, 1, 2])].concat(),
            49,
            "in `face`: expected an index for `vertex_indices` of `face` 1 of 1, found the end",
        ),
    ] {
        let error = refusal([header.as_bytes(), &body].concat());
        let place = format!("a.ply: byte {}: {reason}", start + offset);
        assert!(error.contains(&place), "{place}: {error}");
    }
    let whole = [header.as_bytes(), &good, &corners(3, [0, 1, 2])].concat();
    assert_eq!(ply(&whole).unwrap().warnings, []);
    let loaded = ply([&whole[..], b"\n"].concat()).unwrap();
    let place = format!("a.ply: byte {}: there is more after", whole.len());
    assert!(warnings(&loaded)[0].starts_with(&place));
}

/// Counts are claims: none of these may take time or memory.
#[test]
fn announced_counts_are_not_believed() {
    let most = u32::MAX;
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let header = format!("ply\nformat {encoding} 1.0\nelement vertex {most}\n{XYZ}");
        let error = refusal(format!("{header}end_header\n"));
        assert!(
            error.contains(&format!("`vertex` 1 of {most}, found the end")),
            "{error}"
        );
        let face =
            format!("element face {most}\nproperty list uint uint vertex_indices\nend_header\n");
        let error = refusal(format!("{header}{face}").replace("vertex 4294967295", "vertex 0"));
        assert!(error.contains("`face` 1 of"), "{error}");
        let other =
            format!("element a {most}\nproperty list uint double l\nelement vertex 0\n{XYZ}");
        let header = format!("ply\nformat {encoding} 1.0\n{other}end_header\n");
        assert!(refusal([header.as_bytes(), &[0xff; 16]].concat()).contains("expected"));
    }
}
