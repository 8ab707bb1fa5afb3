//! Statement by statement.

use super::*;

fn read(text: &str) -> Library {
    read_mtl(Path::new("a.obj"), "a.mtl", text.as_bytes()).unwrap()
}

fn refusal(text: &str) -> String {
    read_mtl(Path::new("a.obj"), "a.mtl", text.as_bytes())
        .unwrap_err()
        .to_string()
}

#[test]
fn every_statement_that_is_used() {
    let library = read(
        "newmtl glass of water\n Kd 0.1 0.2 0.3 # x\nKs 0.5\nNs 32\nKe 1 2 3\nd 0.25\n\
         Tf 1 0.5 0\nNi 1.5\nillum 7\nKa 1 1 1\n",
    );
    let expected = Material {
        name: "glass of water".into(),
        diffuse: Color::new(0.1, 0.2, 0.3),
        specular: Color::splat(0.5),
        shininess: 32.0,
        reflection: Color::splat(0.5),
        transmission: Color::new(0.75, 0.375, 0.0),
        ior: 1.5,
        emission: Color::new(1.0, 2.0, 3.0),
        ..Material::default()
    };
    assert_eq!(library.materials["glass of water"].material, expected);
    assert_eq!(library.warnings, []);
}

#[test]
fn illumination_models_decide_about_the_mirror() {
    for (model, mirrors) in [
        (0, false),
        (1, false),
        (2, false),
        (3, true),
        (4, false),
        (5, true),
    ] {
        let library = read(&format!("newmtl a\nKs 1 1 1\nillum {model}"));
        let expected = if mirrors { Color::ONE } else { Color::ZERO };
        assert_eq!(
            library.materials["a"].material.reflection, expected,
            "illum {model}"
        );
    }
}

#[test]
fn dissolve_wins_over_transparency() {
    let transmission = |text: &str| read(text).materials["a"].material.transmission;
    assert_eq!(transmission("newmtl a\nd 1\nTr 1"), Color::ZERO);
    assert_eq!(transmission("newmtl a\nTr 0.25"), Color::splat(0.25));
    assert_eq!(transmission("newmtl a\nd -halo 0.5"), Color::splat(0.5));
    assert_eq!(transmission("newmtl a\nd 7"), Color::ZERO);
}

#[test]
fn values_and_not_the_illumination_model_decide_what_passes_light() {
    let transmission = |text: &str| {
        let text = format!("newmtl a\n{text}");
        read(&text).materials["a"].material.transmission
    };
    for model in [4, 6, 7, 9] {
        let with = |text: &str| transmission(&format!("illum {model}\n{text}"));
        assert_eq!(with(""), Color::ZERO);
        assert_eq!(with("Tf 1 0 0"), Color::X);
        assert_eq!(with("Tf 0 0 0"), Color::ZERO);
        assert_eq!(with("Tf 1 1 1\nNi 1.5"), Color::ONE);
        assert_eq!(with("Tf 1 0 0\nd 1"), Color::ZERO);
        assert_eq!(with("Tf 1 0 0\nTr 0"), Color::ZERO);
        assert_eq!(with("Tf 1 0 0\nd 0.5"), Color::new(0.5, 0.0, 0.0));
        // Maya writes this for what is opaque.
        assert_eq!(
            with("Kd 0.5 0.5 0.5\nTf 1.00 1.00 1.00\nNi 1.00"),
            Color::ZERO
        );
    }
    for model in [0, 1, 2, 3, 5, 8] {
        let with = |text: &str| transmission(&format!("illum {model}\n{text}"));
        assert_eq!(with("Tf 1 0 0"), Color::ZERO);
        assert_eq!(with("d 0.5"), Color::splat(0.5));
    }
}

#[test]
fn looks_that_are_not_finite_are_ignored() {
    let library = read("newmtl a\nKd nan 0 0\nKd nan nan nan\nNs inf\nKs -1.#IND 0 0\nNi nan");
    assert_eq!(
        library.materials["a"].material,
        Material {
            name: "a".into(),
            ..Material::default()
        }
    );
    let texts: Vec<_> = library.warnings.iter().map(Warning::to_string).collect();
    assert_eq!(
        texts,
        [
            "a.mtl:2: `Kd` is not finite: ignored (2 times; this is the first)",
            "a.mtl:4: `Ns` is not finite: ignored",
            "a.mtl:5: `Ks` is not finite: ignored",
            "a.mtl:6: `Ni` is not finite: ignored",
        ]
    );
    // These decide about shadows.
    assert!(refusal("newmtl a\nTf nan 0 0").contains("found `nan`"));
    assert!(refusal("newmtl a\nTr nan").contains("found `nan`"));
}

#[test]
fn what_is_not_used_is_said_once() {
    let library = read(
        "Kd 1 1 1\nnewmtl a\nmap_Kd a.png\nmap_Ks a.png\ndisp -mm 0 1 b.png\nPr 0.5\nPr 0.5\n\
         Kd -1 0 0\nNs -5\nd 7\nKs xyz 1 1 1\nnewmtl a",
    );
    let texts: Vec<_> = library.warnings.iter().map(Warning::to_string).collect();
    assert_eq!(
        texts,
        [
            "a.mtl:1: statements before the first `newmtl` are ignored",
            "a.mtl:6: `Pr` is not read (2 times; this is the first)",
            "a.mtl:8: `Kd` has a negative channel: 0 is used",
            "a.mtl:9: `Ns` is not positive: ignored",
            "a.mtl:11: `Ks` as a spectral curve or as xyz is not read",
            "a.mtl:2: `d` or `Tr` is not between 0 and 1: the nearer one is used",
            "a.mtl:12: a material is defined twice: the last one counts",
            "a.mtl:4: 2 textures are not read: they are no `map_Kd`, `map_d`, `bump` or `norm`",
        ]
    );
}

#[test]
fn garbled_numbers_that_pass_light_are_refused_with_their_line() {
    assert!(
        refusal("newmtl a\nTf 1 x 1")
            .starts_with("a.mtl:2: in `Tf`: expected 3 numbers (red, green, blue), found `x`")
    );
    assert!(refusal("newmtl a\nTf 1 1").contains("found the end of the line"));
    assert!(refusal("newmtl a\n\nNi").starts_with("a.mtl:3: in `Ni`: expected a number"));
    assert!(refusal("d nan").starts_with("a.mtl:1: in `d`: expected a number, found `nan`"));
    assert!(refusal("illum x").starts_with("a.mtl:1: in `illum`: expected a number"));
}

/// A scan's comma for a point, a name for a color: no reason to refuse a scene.
#[test]
fn garbled_looks_are_told_and_ignored() {
    let library = read("newmtl a\nKd 0,8 0,8 0,8\nKs red\nKe 1 1\nNs\nKd\nNs x\n");
    let plain = Material {
        name: "a".into(),
        ..Material::default()
    };
    assert_eq!(library.materials["a"].material, plain);
    let said: Vec<String> = library.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        said,
        [
            "a.mtl:2: `Kd` is not 3 numbers (red, green, blue): ignored (2 times; this is the first)",
            "a.mtl:3: `Ks` is not 3 numbers (red, green, blue): ignored",
            "a.mtl:4: `Ke` is not 3 numbers (red, green, blue): ignored",
            "a.mtl:5: `Ns` is not a number: ignored (2 times; this is the first)",
        ]
    );
}

#[test]
fn reliefs_keep_their_kind_and_their_multiplier() {
    let library = read(
        "newmtl a\nmap_Bump -bm 0.25 a.png\nnewmtl b\nbump b.png\nnewmtl c\nnorm -s 2 c.png\n\
         newmtl d\nmap_bump -bm -2 d e.png\nnewmtl e\nbump\nnewmtl f\nKd 1 1 1",
    );
    let relief = |name: &str| {
        let relief = library.materials[name].pictures.relief.as_ref()?;
        Some((&*relief.map.name, relief.map.multiplier, relief.is_normals))
    };
    assert_eq!(relief("a"), Some(("a.png", 0.25, false)));
    assert_eq!(relief("b"), Some(("b.png", 1.0, false)));
    assert_eq!(relief("c"), Some(("c.png", 1.0, true)));
    assert_eq!(relief("d"), Some(("d e.png", -2.0, false)));
    assert_eq!(relief("e"), None);
    assert_eq!(relief("f"), None);
    assert!(library.materials["a"].has_picture() && !library.materials["f"].has_picture());
    let warnings: Vec<_> = library.warnings.iter().map(Warning::to_string).collect();
    assert_eq!(warnings, ["a.mtl:10: `bump` names no picture: ignored"]);
}
