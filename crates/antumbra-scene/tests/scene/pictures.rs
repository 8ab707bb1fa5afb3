//! Pictures on OBJ: colors by `map_Kd`, holes by `map_d` or by the alpha of `map_Kd`.

use std::io::{self, Cursor};
use std::path::Path;

use antumbra_scene::{
    Loaded, ReadOptions,
    model::{Alpha, Bump, Color, Mesh, ShadowKind, Shape, Wrap},
    read::read_obj,
    read_file,
};
use image::{ImageFormat, RgbaImage};

const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl m\nf 1/1 2/2 3/3 4/4\n";

/// A PNG of so many texels a side, each as `texel` says by column and row.
fn png(side: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let picture = RgbaImage::from_fn(side, side, |x, y| image::Rgba(texel(x, y)));
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Reads the square with a library and files beside it.
fn read(library: &str, files: &[(&str, Vec<u8>)]) -> Loaded {
    let open = &mut |name: &str| {
        if name == "a.mtl" {
            return Ok(library.into());
        }
        let file = files.iter().find(|(known, _)| *known == name);
        file.map(|(_, bytes)| bytes.clone())
            .ok_or_else(|| io::ErrorKind::NotFound.into())
    };
    read_obj(
        Path::new("a.obj"),
        SQUARE.as_bytes(),
        &ReadOptions::default(),
        open,
    )
    .unwrap()
}

fn mesh(loaded: &Loaded) -> &Mesh {
    match &loaded.scene.objects[0].shape {
        Shape::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn warnings(loaded: &Loaded) -> Vec<String> {
    loaded.warnings.iter().map(|w| w.to_string()).collect()
}

/// The left half is there, the right half is not.
fn left_half(x: u32, _: u32) -> [u8; 4] {
    [255, 0, 0, if x < 2 { 255 } else { 0 }]
}

#[test]
fn the_color_of_map_kd_is_shown() {
    let loaded = read(
        "newmtl m\nmap_Kd a.png\n",
        &[("a.png", png(2, |x, _| [255 * x as u8, 0, 0, 255]))],
    );
    assert_eq!(loaded.warnings, []);
    let material = &loaded.scene.materials[0];
    assert!(material.is_opaque());
    assert_eq!(material.diffuse, Color::ONE, "no `Kd` weakens it");
    assert_eq!(material.diffuse_texture, Some(0));
    // The first row of a picture is its upper one; v of OBJ points up.
    assert_eq!(
        mesh(&loaded).uvs,
        [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]
    );
    let loaded = read(
        "newmtl m\nKd 0.5 0.5 0.5\nmap_Kd a.png\n",
        &[("a.png", png(2, left_half))],
    );
    assert_eq!(loaded.scene.materials[0].diffuse, Color::splat(0.5));
}

#[test]
fn alpha_of_map_kd_cuts_holes() {
    let loaded = read("newmtl m\nmap_Kd a.png\n", &[("a.png", png(4, left_half))]);
    let material = &loaded.scene.materials[0];
    assert_eq!(material.alpha, Alpha::Mask { cutoff: 0.5 });
    assert_eq!(material.shadow_kind(), ShadowKind::AlphaTested);
    assert_eq!(loaded.warnings, []);
}

#[test]
fn map_d_cuts_holes_by_luminance_or_alpha() {
    let grey = |x: u32, _: u32| {
        let value = if x < 2 { 255 } else { 0 };
        [value, value, value, 255]
    };
    let white = |_: u32, _: u32| [255; 4];
    for (options, picture) in [
        ("", png(4, grey)),
        ("", png(4, left_half)),
        ("-imfchan m", png(4, left_half)),
        ("-imfchan r", png(4, grey)),
        ("-clamp on -s 1 1 1", png(4, grey)),
    ] {
        let library = format!("newmtl m\nd 1.0\nmap_Kd c.png\nmap_d {options} d.png\n");
        let files = [("c.png", png(8, white)), ("d.png", picture)];
        let loaded = read(&library, &files);
        assert_eq!(loaded.warnings, [], "{options}");
        let texture = &loaded.scene.textures[0];
        assert_eq!(
            [texture.width, texture.height],
            [4, 4],
            "holes keep their resolution"
        );
        let alphas: Vec<u8> = texture.texels[..4].iter().map(|texel| texel[3]).collect();
        assert_eq!(alphas, [255, 255, 0, 0], "{options}");
        assert_eq!(
            loaded.scene.materials[0].shadow_kind(),
            ShadowKind::AlphaTested
        );
        let is_clamped = options.contains("-clamp on");
        let wrap = if is_clamped {
            Wrap::ClampToEdge
        } else {
            Wrap::Repeat
        };
        assert_eq!(texture.wrap, [wrap; 2]);
    }
    // Values can be turned round.
    let files = [("d.png", png(4, grey))];
    let loaded = read("newmtl m\nmap_d -mm 1 -1 d.png\n", &files);
    let alphas: Vec<u8> = loaded.scene.textures[0].texels[..4]
        .iter()
        .map(|t| t[3])
        .collect();
    assert_eq!(alphas, [0, 0, 255, 255]);
}

#[test]
fn a_picture_that_is_missing_is_a_warning() {
    let loaded = read("newmtl m\nKd 1 0 0\nmap_Kd a.png\nmap_d ..\\b.png\n", &[]);
    assert_eq!(loaded.scene.materials[0].diffuse, Color::X);
    assert!(loaded.scene.materials[0].is_opaque());
    let texts = warnings(&loaded);
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert!(
        texts[0].starts_with("a.obj: cannot read the picture `a.png` of `map_Kd`, plain colors")
    );
    assert!(texts[1].contains("of `map_d`, the surface is whole: "));
    let broken = read(
        "newmtl m\nmap_Kd a.png\n",
        &[("a.png", b"no picture".to_vec())],
    );
    assert_eq!(warnings(&broken).len(), 1);
}

#[test]
fn pictures_lie_in_the_folder_of_the_scene_or_below() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("scene");
    std::fs::create_dir_all(inner.join("tex tures")).unwrap();
    std::fs::write(inner.join("a.obj"), SQUARE).unwrap();
    std::fs::write(inner.join("tex tures/a b.png"), png(4, left_half)).unwrap();
    std::fs::write(folder.path().join("out.png"), png(4, left_half)).unwrap();
    for (name, is_read) in [
        ("tex tures/a b.png", true),
        ("tex tures\\a b.png", true),
        ("../out.png", false),
        ("..\\out.png", false),
    ] {
        std::fs::write(inner.join("a.mtl"), format!("newmtl m\nmap_Kd {name}\n")).unwrap();
        let loaded = read_file(&inner.join("a.obj"), &ReadOptions::default()).unwrap();
        assert_eq!(loaded.scene.textures.len(), usize::from(is_read), "{name}");
        assert_eq!(
            loaded.warnings.is_empty(),
            is_read,
            "{:?}",
            warnings(&loaded)
        );
    }
}

#[test]
fn a_scan_that_is_see_through_by_the_letter_is_said() {
    let loaded = read("newmtl m\nKd 1 1 1\nTr 1.000000\nillum 1\n", &[]);
    assert_eq!(
        warnings(&loaded),
        [
            "a.obj: nothing in this scene casts a shadow: all of it (1 face) is see-through",
            "a.obj: 1 face lets light through: MTL `Tr 1` (material `m`); scanning tools write it for \
             what is opaque: if that is meant, write `d 1` in its place in the material library",
        ]
    );
    let mended = read("newmtl m\nKd 1 1 1\nd 1\nillum 1\n", &[]);
    assert_eq!(mended.warnings, []);
    assert!(mended.scene.materials[0].is_opaque());
}

#[test]
fn a_relief_is_one_of_heights_unless_it_looks_like_normals() {
    let grey = |x: u32, _: u32| [64 * x as u8, 64 * x as u8, 64 * x as u8, 255];
    let blue = |x: u32, _: u32| [120 + 5 * x as u8, 130, 250, 255];
    let color = ("c.png", png(2, |_, _| [255; 4]));
    let files = [color, ("h.png", png(4, grey)), ("n.png", png(4, blue))];
    let heights = |texture, multiplier| Bump::Heights {
        texture,
        multiplier,
    };
    let normals = |texture, scale| Bump::Normals { texture, scale };
    for (library, expected) in [
        ("bump h.png", heights(0, 1.0)),
        ("map_Bump -bm 0.5 h.png", heights(0, 0.5)),
        ("map_Kd c.png\nmap_bump -bm -2 h.png", heights(0, -2.0)),
        ("map_Kd c.png\nmap_bump -bm 2 n.png", normals(0, 2.0)),
        ("norm h.png", normals(0, 1.0)),
    ] {
        let loaded = read(&format!("newmtl m\n{library}\n"), &files);
        assert_eq!(loaded.warnings, [], "{library}");
        let material = &loaded.scene.materials[0];
        assert_eq!(material.bump, Some(expected), "{library}");
        assert!(material.is_opaque());
        assert_eq!(material.diffuse_texture.is_some(), library.contains("Kd"));
        assert_eq!(mesh(&loaded).uvs.len(), 4, "{library}");
    }
}

#[test]
fn a_relief_that_cannot_be_read_leaves_the_surface_smooth() {
    let white = || png(2, |_, _| [255; 4]);
    for (library, reason) in [
        (
            "bump none.png",
            "cannot read the picture `none.png` of a relief, the surface is smooth: ",
        ),
        (
            "map_Kd a.png\nbump -s 2 2 a.png",
            "a relief that lies elsewhere than the other",
        ),
        (
            "bump -bm 1e9 a.png",
            "`-bm` is beyond 1000000: the relief is not read",
        ),
    ] {
        let loaded = read(&format!("newmtl m\n{library}\n"), &[("a.png", white())]);
        assert_eq!(loaded.scene.materials[0].bump, None, "{library}");
        let texts = warnings(&loaded);
        assert!(texts.len() == 1 && texts[0].contains(reason), "{texts:?}");
    }
}
