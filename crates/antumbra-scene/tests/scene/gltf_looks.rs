//! glTF by small documents of our own: materials, pictures, lights, cameras.

use std::io::Cursor;

use antumbra_geometry::DVec3;
use antumbra_scene::{
    Loaded, ReadOptions, Warning,
    model::{Alpha, Bump, Color, Filter, LightKind, Material, ShadowKind, Shape, Wrap},
    read::read_gltf,
};
use image::{ImageFormat, RgbaImage};

use crate::gltf::{document, floats, gltf};

/// A triangle with coordinates in the picture, then a picture of 2 x 1 texels.
fn bytes(texels: [[u8; 4]; 2]) -> Vec<u8> {
    let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    bytes.extend(floats(&[0., 0., 1., 0., 0., 1.]));
    let image = RgbaImage::from_raw(2, 1, texels.concat()).unwrap();
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    bytes.extend(png.into_inner());
    bytes
}

fn read(material: &str, rest: &str, texels: [[u8; 4]; 2]) -> Loaded {
    let bytes = bytes(texels);
    let length = bytes.len();
    let accessors = r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}"#;
    let primitive = r#""attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0"#;
    let rest = format!(
        r#", "bufferViews": [{{"buffer": 0, "byteLength": 36}},
        {{"buffer": 0, "byteOffset": 36, "byteLength": 24}},
        {{"buffer": 0, "byteOffset": 60, "byteLength": {}}}],
        "images": [{{"bufferView": 2}}, {{"uri": "none.png"}}],
        "textures": [{{"source": 0}}, {{"source": 1}}, {{"source": 0, "sampler": 0}}],
        "samplers": [{{"magFilter": 9728, "wrapS": 33648, "wrapT": 33071}}],
        "materials": [{{{material}}}] {rest}"#,
        length - 60
    );
    gltf(&document(length, accessors, primitive, &rest), &bytes).unwrap()
}

const NODE: &str = r#", "nodes": [{"mesh": 0}]"#;
const GREY: [[u8; 4]; 2] = [[255, 255, 255, 255], [255, 255, 255, 0]];

fn look(material: &str) -> Material {
    read(material, NODE, GREY).scene.materials[0].clone()
}

#[test]
fn metal_roughness_and_glass() {
    let plain = look("");
    assert_eq!(plain.diffuse, Color::ONE, "rough metal scatters");
    assert!(plain.is_opaque() && !plain.is_double_sided);
    let plastic = look(
        r#""doubleSided": true, "pbrMetallicRoughness":
        {"baseColorFactor": [0.5, 0.25, 0, 1], "metallicFactor": 0, "roughnessFactor": 0.5}"#,
    );
    assert_eq!(plastic.diffuse, Color::new(0.5, 0.25, 0.0));
    assert_eq!(plastic.reflection, Color::ZERO);
    assert_eq!(plastic.shininess, 7.5);
    assert!(plastic.is_double_sided);
    let mirror = look(
        r#""pbrMetallicRoughness":
        {"baseColorFactor": [0.5, 0.25, 0, 1], "metallicFactor": 1, "roughnessFactor": 0}"#,
    );
    assert_eq!(mirror.diffuse, Color::ZERO);
    assert_eq!(mirror.reflection, Color::new(0.5, 0.25, 0.0));
    let glass = |volume: &str| {
        look(&format!(
            r#""pbrMetallicRoughness": {{"metallicFactor": 0, "roughnessFactor": 0}},
            "extensions": {{"KHR_materials_transmission": {{"transmissionFactor": 0.75}},
            "KHR_materials_ior": {{"ior": 1.25}} {volume}}}"#
        ))
    };
    let sheet = glass("");
    assert_eq!(sheet.shadow_kind(), ShadowKind::Transparent);
    assert_eq!(sheet.transmission, Color::splat(0.75));
    assert_eq!(sheet.diffuse, Color::splat(0.25));
    assert_eq!(sheet.ior, 1.0, "a sheet does not refract");
    let body = glass(r#", "KHR_materials_volume": {"thicknessFactor": 1}"#);
    assert_eq!(body.ior, 1.25);
}

#[test]
fn what_shines_by_itself() {
    let lamp = look(
        r#""emissiveFactor": [1, 0.5, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}}"#,
    );
    assert_eq!(lamp.emission, Color::new(4.0, 2.0, 0.0));
    let unlit = look(
        r#""pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 1, 1]},
        "extensions": {"KHR_materials_unlit": {}}"#,
    );
    assert_eq!(unlit.emission, Color::new(0.5, 0.5, 1.0));
    assert_eq!(unlit.diffuse, Color::ZERO);
}

#[test]
fn alpha_modes() {
    let texture = r#""pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#;
    let masked = look(&format!(r#""alphaMode": "MASK", {texture}"#));
    assert_eq!(masked.alpha, Alpha::Mask { cutoff: 0.5 });
    assert_eq!(masked.shadow_kind(), ShadowKind::AlphaTested);
    let blended = look(&format!(r#""alphaMode": "BLEND", {texture}"#));
    assert_eq!(blended.shadow_kind(), ShadowKind::Transparent);
    // Without a hole in the picture there is nothing to test.
    let whole = read(
        &format!(r#""alphaMode": "MASK", {texture}"#),
        NODE,
        [[9, 9, 9, 255]; 2],
    );
    assert!(whole.scene.materials[0].is_opaque());
    let gone = look(
        r#""alphaMode": "MASK", "alphaCutoff": 0.6,
        "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}"#,
    );
    assert_eq!(gone.shadow_kind(), ShadowKind::Transparent);
    assert_eq!(gone.coverage(1.0), 0.0);
}

#[test]
fn textures_are_laid_as_the_file_says() {
    let plain = read(
        r#""pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#,
        NODE,
        GREY,
    );
    let texture = &plain.scene.textures[0];
    assert_eq!(
        (texture.wrap, texture.filter),
        ([Wrap::Repeat; 2], Filter::Linear)
    );
    assert_eq!(texture.texels, GREY);
    let moved = read(
        r#""pbrMetallicRoughness": {"baseColorTexture": {"index": 2, "texCoord": 5, "extensions":
        {"KHR_texture_transform": {"offset": [10, 20], "scale": [2, 4], "texCoord": 0,
        "rotation": 1.5707963267948966}}}}"#,
        NODE,
        GREY,
    );
    let texture = &moved.scene.textures[0];
    assert_eq!(texture.wrap, [Wrap::MirroredRepeat, Wrap::ClampToEdge]);
    assert_eq!(texture.filter, Filter::Nearest);
    let Shape::Mesh(mesh) = &moved.scene.objects[0].shape else {
        panic!("{:?}", moved.scene.objects);
    };
    // Counter-clockwise as seen: right becomes up, which is where v falls.
    let expected = [[10.0, 20.0], [10.0, 18.0], [14.0, 20.0]];
    for (found, expected) in mesh.uvs.iter().zip(expected) {
        let off = (found[0] - expected[0]).abs() + (found[1] - expected[1]).abs();
        assert!(off < 1e-14, "{found:?}");
    }
}

/// What cannot be read costs the texture, not the scene.
#[test]
fn pictures_that_cannot_be_read() {
    for (index, reason) in [
        (
            1,
            "images[1] cannot be read, plain colors are used instead: `none.png`",
        ),
        (7, "textures[7] is not there: it is not read"),
    ] {
        let material = format!(
            r#""alphaMode": "MASK", "pbrMetallicRoughness": {{"baseColorTexture": {{"index": {index}}}}}"#
        );
        let loaded = read(&material, NODE, GREY);
        assert!(loaded.scene.textures.is_empty());
        assert!(loaded.scene.materials[0].is_opaque());
        let warnings = &loaded.warnings;
        assert!(
            warnings.iter().any(|w| w.message.contains(reason)),
            "{warnings:?}"
        );
    }
}

#[test]
fn lights_and_the_first_camera() {
    let rest = r#", "extensions": {"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 40, "color": [1, 0.5, 0]},
        {"type": "directional", "name": "sun"},
        {"type": "spot", "spot": {"outerConeAngle": 1.0471975511965976}}]}},
        "cameras": [{"type": "orthographic"}, {"type": "perspective", "perspective": {"yfov": 0.5}}],
        "nodes": [{"children": [1, 2, 3, 4], "translation": [1, 2, 3]},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"extensions": {"KHR_lights_punctual": {"light": 1}}, "rotation": [0, 1, 0, 0]},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}, "camera": 0},
        {"camera": 1}]"#;
    let loaded = read("", rest, GREY);
    let scene = &loaded.scene;
    assert!(scene.is_photometric);
    assert_eq!(scene.ambient, Color::ZERO);
    let position = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(scene.lights[0].kind, LightKind::Point { position });
    assert_eq!(scene.lights[0].color, Color::new(40.0, 20.0, 0.0));
    assert_eq!(scene.lights[1].name, "sun");
    let LightKind::Directional { towards_light } = scene.lights[1].kind else {
        panic!("{:?}", scene.lights[1]);
    };
    assert_eq!(
        towards_light,
        DVec3::NEG_Z,
        "the node is turned by half a turn"
    );
    let LightKind::Spot {
        axis,
        inner_cosine,
        outer_cosine,
        ..
    } = scene.lights[2].kind
    else {
        panic!("{:?}", scene.lights[2]);
    };
    assert_eq!((axis, inner_cosine), (DVec3::NEG_Z, 1.0));
    assert!((outer_cosine - 0.5).abs() < 1e-15);
    let camera = scene.camera.unwrap();
    assert_eq!(camera.eye, position);
    assert!((camera.at - camera.eye).dot(DVec3::NEG_Z) > 0.0);
    assert_eq!(camera.up, DVec3::Y);
    assert_eq!(camera.vertical_fov_degrees, 0.5_f64.to_degrees());
    assert_eq!(
        loaded.warnings[0].message,
        "orthographic cameras are not read"
    );
}

#[test]
fn a_material_that_blends_with_an_alpha_of_one_blocks() {
    for (texture, texels, factor, expected) in [
        ("", [[9, 9, 9, 255]; 2], 1.0, ShadowKind::Opaque),
        ("", [[9, 9, 9, 255]; 2], 0.5, ShadowKind::Transparent),
        (
            r#""baseColorTexture": {"index": 0},"#,
            [[9, 9, 9, 255]; 2],
            1.0,
            ShadowKind::Opaque,
        ),
        (
            r#""baseColorTexture": {"index": 0},"#,
            [[9, 9, 9, 255], [9, 9, 9, 254]],
            1.0,
            ShadowKind::Transparent,
        ),
    ] {
        let material = format!(
            r#""alphaMode": "BLEND", "pbrMetallicRoughness":
            {{{texture} "baseColorFactor": [1, 1, 1, {factor}]}}"#
        );
        let loaded = read(&material, NODE, texels);
        let kind = loaded.scene.materials[0].shadow_kind();
        assert_eq!(kind, expected, "{material}");
        let is_said = |w: &Warning| {
            w.message
                .contains("`alphaMode` BLEND with an alpha below 1")
        };
        let is_clear = expected == ShadowKind::Transparent;
        assert_eq!(loaded.warnings.iter().any(is_said), is_clear);
    }
}

#[test]
fn values_and_not_modes_decide_what_blocks() {
    // An opaque material's alpha is nothing.
    let opaque = look(r#""pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}"#);
    assert!(opaque.is_opaque());
    for (factor, expected) in [(0.0, ShadowKind::Opaque), (0.5, ShadowKind::Transparent)] {
        let material = look(&format!(
            r#""pbrMetallicRoughness": {{"metallicFactor": 0}},
            "extensions": {{"KHR_materials_transmission": {{"transmissionFactor": {factor}}}}}"#
        ));
        assert_eq!(material.shadow_kind(), expected, "{factor}");
    }
}

#[test]
fn specular_glossiness_gives_color_and_alpha() {
    let glossy = |more: &str, inner: &str| {
        format!(
            r#"{more} "pbrMetallicRoughness": {{"baseColorFactor": [1, 0, 0, 1]}},
            "extensions": {{"KHR_materials_pbrSpecularGlossiness": {{{inner}}}}}"#
        )
    };
    let plain = look(&glossy(
        "",
        r#""diffuseFactor": [0.5, 0.25, 0, 1], "specularFactor": [0.25, 0.5, 0], "glossinessFactor": 0"#,
    ));
    assert_eq!(plain.diffuse, Color::new(0.25, 0.125, 0.0));
    assert!(plain.is_opaque());
    let mirror = look(&glossy(
        "",
        r#""diffuseFactor": [0, 0, 0, 1], "glossinessFactor": 1"#,
    ));
    assert_eq!(mirror.reflection, Color::ONE);
    // Alpha is the diffuse one's, and decides as any other.
    let blend = r#""alphaMode": "BLEND","#;
    let clear = look(&glossy(blend, r#""diffuseFactor": [1, 1, 1, 0.25]"#));
    assert_eq!(clear.shadow_kind(), ShadowKind::Transparent);
    assert_eq!(clear.opacity, 0.25);
    let whole = look(&glossy(blend, r#""diffuseFactor": [1, 1, 1, 1]"#));
    assert_eq!(whole.shadow_kind(), ShadowKind::Opaque);
    let mask = r#""alphaMode": "MASK","#;
    let holes = look(&glossy(mask, r#""diffuseTexture": {"index": 0}"#));
    assert_eq!(holes.shadow_kind(), ShadowKind::AlphaTested);
}

/// A document whose vertices have colors of two 8-bit shares and one more, and perhaps alpha.
fn colored(alpha_mode: &str, colors: &[[u8; 4]; 3], shape: &str) -> Loaded {
    let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    bytes.extend(colors.iter().flatten());
    let accessors = format!(
        r#"{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}},
        {{"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "{shape}"}}"#
    );
    let primitive = r#""attributes": {"POSITION": 0, "COLOR_0": 1}, "material": 0"#;
    let rest = format!(
        r#", "bufferViews": [{{"buffer": 0, "byteLength": 36}},
        {{"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4}}],
        "materials": [{{"alphaMode": "{alpha_mode}"}}] {NODE}"#
    );
    gltf(&document(48, &accessors, primitive, &rest), &bytes).unwrap()
}

#[test]
fn vertex_colors_are_read_and_their_alpha_decides_where_it_blends() {
    let half = [[255, 51, 0, 255], [0, 0, 255, 51], [255, 255, 255, 255]];
    let loaded = colored("BLEND", &half, "VEC4");
    let mesh = loaded.scene.objects[0].shape.mesh().unwrap();
    let expected = [[1.0, 0.2, 0.0, 1.0], [0.0, 0.0, 1.0, 0.2], [1.0; 4]];
    assert_eq!(mesh.colors, expected);
    assert!(!loaded.scene.materials[0].is_opaque());
    assert!(colored("OPAQUE", &half, "VEC4").scene.materials[0].is_opaque());
    let opaque = colored("BLEND", &half, "VEC3");
    let mesh = opaque.scene.objects[0].shape.mesh().unwrap();
    assert_eq!(
        mesh.colors[1],
        [0.0, 0.0, 1.0, 1.0],
        "without alpha it is 1"
    );
    assert!(opaque.scene.materials[0].is_opaque());
}

/// The beginning of a PNG of so many texels a side: its size is there, its texels are not.
fn promised_png(side: u32) -> Vec<u8> {
    let image = RgbaImage::new(1, 1);
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    let mut png = png.into_inner();
    png[16..20].copy_from_slice(&side.to_be_bytes());
    png[20..24].copy_from_slice(&side.to_be_bytes());
    // The checksum of the header.
    let checksum = png[12..29].iter().fold(u32::MAX, |sum, &byte| {
        (0..8).fold(sum ^ u32::from(byte), |sum, _| {
            (sum >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(sum & 1))
        })
    });
    png[29..33].copy_from_slice(&(!checksum).to_be_bytes());
    png
}

#[test]
fn a_picture_that_does_not_fit_is_refused_by_its_header() {
    let png = promised_png(16384);
    let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    bytes.extend(floats(&[0., 0., 1., 0., 0., 1.]));
    let accessors = r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}"#;
    let primitive = r#""attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0"#;
    let json = |material: &str| {
        let rest = format!(
            r#", "bufferViews": [{{"buffer": 0, "byteLength": 36}},
            {{"buffer": 0, "byteOffset": 36, "byteLength": 24}}],
            "images": [{{"uri": "big.png"}}], "textures": [{{"source": 0}}],
            "materials": [{{{material}}}] {NODE}"#
        );
        document(60, accessors, primitive, &rest)
    };
    let read = |material: &str, memory_limit: u64| {
        let open = &mut |name: &str| {
            Ok(if name == "big.png" {
                png.clone()
            } else {
                bytes.clone()
            })
        };
        let options = ReadOptions {
            memory_limit,
            ..ReadOptions::default()
        };
        read_gltf("a.gltf".as_ref(), json(material).as_bytes(), &options, open)
    };
    let limit = 100_000_000;
    for material in [
        r#""alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#,
        r#""pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}"#,
        r#""extensions": {"KHR_materials_transmission":
            {"transmissionFactor": 1, "transmissionTexture": {"index": 0}}}"#,
    ] {
        let error = read(material, limit).unwrap_err().to_string();
        let reason = "images[0], a picture of 16384 x 16384 texels needs 1024 MiB in memory";
        assert!(
            error.contains(reason) && error.contains("96 MiB"),
            "{error}"
        );
        assert!(error.contains("raise the memory limit"), "{error}");
        // With room for it, it turns out to be cut off.
        let loaded = read(material, 2 << 30).unwrap();
        let message = &loaded.warnings[0].message;
        assert!(message.starts_with("images[0] cannot be read"), "{message}");
    }
    // Looks alone are not worth a refusal, and what nothing uses is not opened.
    let dim = read(
        r#""emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}"#,
        limit,
    );
    assert!(
        dim.unwrap().warnings[0]
            .message
            .starts_with("images[0] is not read")
    );
    assert_eq!(read("", limit).unwrap().warnings, []);
    let smooth = read(r#""normalTexture": {"index": 0}"#, limit).unwrap();
    let message = &smooth.warnings[0].message;
    assert!(
        message.starts_with("normals are not read: images[0], a picture of 16384"),
        "{message}"
    );
    assert_eq!(smooth.scene.materials[0].bump, None);
}

#[test]
fn normals_are_a_relief_where_the_base_color_lies() {
    let base = |rest: &str| {
        format!(r#""pbrMetallicRoughness": {{"baseColorTexture": {{"index": 0 {rest}}}}}, "#)
    };
    let moved = r#", "extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}"#;
    let normals = |rest: &str| format!(r#""normalTexture": {{"index": 0 {rest}}}"#);
    let relief = |scale| Some(Bump::Normals { texture: 0, scale });
    for (material, expected) in [
        (normals(""), relief(1.0)),
        (normals(r#", "scale": -0.5"#), relief(-0.5)),
        (normals(moved), relief(1.0)),
        (base("") + &normals(r#", "scale": 2"#), relief(2.0)),
        (base(moved) + &normals(moved), relief(1.0)),
    ] {
        let loaded = read(&material, NODE, GREY);
        assert_eq!(loaded.warnings, [], "{material}");
        assert_eq!(loaded.scene.materials[0].bump, expected, "{material}");
        let Shape::Mesh(mesh) = &loaded.scene.objects[0].shape else {
            panic!("a mesh");
        };
        let shift = if material.contains("offset") {
            0.5
        } else {
            0.0
        };
        assert_eq!(mesh.uvs[0][0], shift, "{material}");
    }
    let elsewhere = read(&(base("") + &normals(moved)), NODE, GREY);
    assert_eq!(elsewhere.scene.materials[0].bump, None);
    let message = &elsewhere.warnings[0].message;
    assert_eq!(
        message,
        "normals that lie elsewhere than the base color are not read"
    );
    // It is not there.
    let missing = read(r#""normalTexture": {"index": 1}"#, NODE, GREY);
    assert_eq!(missing.scene.materials[0].bump, None);
    assert!(
        missing.warnings[0]
            .message
            .starts_with("images[1] cannot be read")
    );
}

#[test]
fn normals_and_colors_that_cannot_be_used_are_left_out_and_told_of() {
    let accessors = r#"{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 0, "componentType": 5126, "count": 2, "type": "VEC3"},
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC2"}"#;
    let views = r#", "bufferViews": [{"buffer": 0, "byteLength": 36}], "nodes": [{"mesh": 0}]"#;
    let bytes = floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    // Too few, of another shape, beyond the buffer, not there.
    for (attribute, wrong) in [
        ("NORMAL", 1),
        ("NORMAL", 2),
        ("NORMAL", 9),
        ("COLOR_0", 1),
        ("COLOR_0", 2),
    ] {
        let primitive = format!(r#""attributes": {{"POSITION": 0, "{attribute}": {wrong}}}"#);
        let loaded = gltf(&document(36, accessors, &primitive, views), &bytes)
            .unwrap_or_else(|error| panic!("{attribute} {wrong}: {error}"));
        let Shape::Mesh(mesh) = &loaded.scene.objects[0].shape else {
            panic!("a mesh");
        };
        assert_eq!(mesh.face_ends.len(), 1);
        let told = |warning: &Warning| {
            warning
                .message
                .starts_with(&format!("`{attribute}` is not used: "))
        };
        assert!(
            loaded.warnings.iter().any(told),
            "{attribute} {wrong}: {:?}",
            loaded.warnings
        );
    }
    // Positions are what shadows depend on.
    let primitive = r#""attributes": {"POSITION": 9}"#;
    assert!(gltf(&document(36, accessors, primitive, views), &bytes).is_err());
}
