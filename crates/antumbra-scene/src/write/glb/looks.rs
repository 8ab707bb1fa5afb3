//! Materials and textures as glTF says them.
//!
//! In: a scene. Out: JSON entries, and PNG pictures in the buffer. Invariant: what decides about
//! shadows (alpha, transmission, textures) is written as it is; what our reader makes of diffuse
//! color and transmission is what the scene has, up to rounding.

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use serde_json::{Value, json};

use crate::model::{Alpha, Bump, Color, Filter, Material, Scene, Wrap};

use super::buffer::Buffer;

/// Returns the extensions that the materials need.
pub(super) fn extensions(scene: &Scene) -> Vec<&'static str> {
    let mut names = Vec::new();
    if scene
        .materials
        .iter()
        .any(|m| m.transmission != Color::ZERO)
    {
        names.push("KHR_materials_transmission");
    }
    if scene.materials.iter().any(is_refracting) {
        names.extend(["KHR_materials_ior", "KHR_materials_volume"]);
    }
    if scene
        .materials
        .iter()
        .any(|m| m.emission.max_element() > 1.0)
    {
        names.push("KHR_materials_emissive_strength");
    }
    names
}

fn is_refracting(material: &Material) -> bool {
    material.transmission != Color::ZERO && material.ior != 1.0
}

/// Returns all materials, in their order.
pub(super) fn materials(scene: &Scene, notes: &mut Vec<String>) -> Vec<Value> {
    let materials = &scene.materials;
    let has_gloss = |m: &Material| m.specular != Color::ZERO || m.reflection != Color::ZERO;
    if materials.iter().any(has_gloss) {
        notes
            .push("highlights and mirrors are written only roughly, as roughness and metal".into());
    }
    let is_lost = |m: &Material| m.bump.is_some_and(|b| !matches!(b, Bump::Normals { .. }));
    if materials.iter().any(is_lost) {
        notes.push("reliefs by heights are not written: glTF has normals only".into());
    }
    let mut clamped = 0;
    let entries = materials
        .iter()
        .map(|m| material(m, &mut clamped))
        .collect();
    if clamped > 0 {
        notes.push(format!(
            "{clamped} materials scatter or let through more light than they get: 1 is written"
        ));
    }
    entries
}

/// With metalness `m`, base color `b` and transmission `t`, diffuse is `b (1 - m) (1 - t)` and
/// transmission `b t (1 - m)`: so `b` is their sum where there is no metal.
fn material(material: &Material, clamped: &mut usize) -> Value {
    let sum = material.diffuse + material.transmission;
    let is_mirror =
        material.reflection.max_element() > 0.25 && material.transmission == Color::ZERO;
    let (base, metalness) = if is_mirror {
        (material.reflection, 1.0)
    } else {
        (sum, 0.0)
    };
    let clear = base.clamp(Color::ZERO, Color::ONE);
    *clamped += usize::from(base != clear);
    let roughness = if material.reflection != Color::ZERO {
        0.0
    } else if material.specular != Color::ZERO {
        // A Phong exponent s is a GGX lobe of width sqrt(2 / (4 s + 2)), the roughness squared.
        (2.0 / (4.0 * material.shininess + 2.0))
            .sqrt()
            .sqrt()
            .min(1.0)
    } else {
        1.0
    };
    let [r, g, b] = clear.to_array();
    let mut pbr = json!({
        "baseColorFactor": [r, g, b, material.opacity.clamp(0.0, 1.0)],
        "metallicFactor": metalness,
        "roughnessFactor": roughness,
    });
    if let Some(texture) = material.diffuse_texture {
        pbr["baseColorTexture"] = json!({"index": texture});
    }
    let mut entry = json!({
        "name": material.name,
        "pbrMetallicRoughness": pbr,
        "doubleSided": material.is_double_sided,
    });
    if let Some(Bump::Normals { texture, scale }) = material.bump {
        entry["normalTexture"] = json!({"index": texture, "scale": scale});
    }
    match material.alpha {
        Alpha::Opaque => {}
        Alpha::Blend => entry["alphaMode"] = "BLEND".into(),
        Alpha::Mask { cutoff } => {
            entry["alphaMode"] = "MASK".into();
            entry["alphaCutoff"] = cutoff.into();
        }
    }
    let mut extensions = serde_json::Map::new();
    if material.emission != Color::ZERO {
        let strength = material.emission.max_element().max(1.0);
        entry["emissiveFactor"] = json!((material.emission / strength).to_array());
        if strength > 1.0 {
            extensions.insert(
                "KHR_materials_emissive_strength".into(),
                json!({"emissiveStrength": strength}),
            );
        }
    }
    if material.transmission != Color::ZERO {
        let share = material.transmission.element_sum() / sum.element_sum();
        extensions.insert(
            "KHR_materials_transmission".into(),
            json!({"transmissionFactor": share}),
        );
    }
    if is_refracting(material) {
        let ior = json!({"ior": material.ior});
        extensions.insert("KHR_materials_ior".into(), ior);
        let volume = json!({"thicknessFactor": 1.0});
        extensions.insert("KHR_materials_volume".into(), volume);
    }
    if !extensions.is_empty() {
        entry["extensions"] = Value::Object(extensions);
    }
    entry
}

/// Returns textures, images and samplers, each as many as the scene has textures.
pub(super) fn textures(
    scene: &Scene,
    buffer: &mut Buffer,
    notes: &mut Vec<String>,
) -> (Vec<Value>, Vec<Value>, Vec<Value>) {
    let mut lists = (Vec::new(), Vec::new(), Vec::new());
    for (index, texture) in scene.textures.iter().enumerate() {
        let png = png(texture.width, texture.height, &texture.texels).unwrap_or_else(|| {
            notes.push(format!("texture {index} is no picture: white is written"));
            png(1, 1, &[[255; 4]]).unwrap_or_default()
        });
        let view = buffer.view(&png);
        lists.0.push(json!({"sampler": index, "source": index}));
        lists.1.push(json!({
            "name": texture.name,
            "bufferView": view,
            "mimeType": "image/png",
        }));
        let filter = match texture.filter {
            Filter::Nearest => 9728,
            Filter::Linear => 9729,
        };
        let [wrap_s, wrap_t] = texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 10497,
            Wrap::MirroredRepeat => 33648,
            Wrap::ClampToEdge => 33071,
        });
        lists.2.push(json!({
            "magFilter": filter, "minFilter": filter, "wrapS": wrap_s, "wrapT": wrap_t,
        }));
    }
    lists
}

/// Returns a picture as PNG, `None` if its size is not that of its texels.
fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Option<Vec<u8>> {
    let count = u64::from(width) * u64::from(height);
    if count == 0 || texels.len() as u64 != count {
        return None;
    }
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(
            texels.as_flattened(),
            width,
            height,
            ExtendedColorType::Rgba8,
        )
        .ok()?;
    Some(bytes)
}
