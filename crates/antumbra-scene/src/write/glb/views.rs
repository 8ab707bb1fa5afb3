//! Lights and the camera as glTF says them: nodes that look along their -z axis.
//!
//! In: a scene. Out: JSON entries and their nodes. Invariant: lights are one for one; directions
//! are the last column of a node's matrix, unrounded but for their length.

use antumbra_geometry::DVec3;
use serde_json::{Value, json};

use crate::model::{LightKind, Scene};

/// Adds a node for each light; returns the lights.
pub(super) fn lights(scene: &Scene, nodes: &mut Vec<Value>, notes: &mut Vec<String>) -> Vec<Value> {
    if !scene.lights.is_empty() && !scene.is_photometric {
        notes
            .push("the lights' strengths have no unit: they are written as candela and lux".into());
    }
    let mut constant = 0;
    let mut entries = Vec::new();
    for light in &scene.lights {
        let strength = light.color.max_element();
        let color = match strength > 0.0 {
            true => light.color / strength,
            false => DVec3::ZERO,
        };
        let mut entry = json!({
            "name": light.name,
            "color": color.to_array(),
            "intensity": strength.max(0.0),
        });
        let is_directional = matches!(light.kind, LightKind::Directional { .. });
        constant += usize::from(!is_directional && !light.falls_off);
        let (kind, matrix) = match light.kind {
            LightKind::Point { position } => ("point", frame(DVec3::Z, DVec3::Y, position)),
            LightKind::Directional { towards_light } => {
                ("directional", frame(towards_light, DVec3::Y, DVec3::ZERO))
            }
            LightKind::Spot {
                position,
                axis,
                inner_cosine,
                outer_cosine,
            } => {
                let outer = libm::acos(outer_cosine.clamp(0.0, 1.0));
                let inner = libm::acos(inner_cosine.clamp(0.0, 1.0)).min(outer);
                entry["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
                ("spot", frame(-axis, DVec3::Y, position))
            }
        };
        entry["type"] = kind.into();
        nodes.push(json!({
            "name": light.name,
            "matrix": matrix,
            "extensions": {"KHR_lights_punctual": {"light": entries.len()}},
        }));
        entries.push(entry);
    }
    if constant > 0 {
        notes.push(format!(
            "{constant} lights do not weaken with distance: in glTF they do"
        ));
    }
    entries
}

/// Adds a node for the camera; returns the cameras, none or one.
pub(super) fn cameras(scene: &Scene, nodes: &mut Vec<Value>) -> Vec<Value> {
    let Some(camera) = &scene.camera else {
        return Vec::new();
    };
    let distance = (camera.at - camera.eye).length();
    let mut perspective = json!({
        "yfov": camera.vertical_fov_degrees.to_radians(),
        // Required by the format; readers of ours do not use it.
        "znear": (distance * 1e-3).max(f64::MIN_POSITIVE),
    });
    if let Some([width, height]) = camera.resolution {
        perspective["aspectRatio"] = (f64::from(width) / f64::from(height.max(1))).into();
    }
    let matrix = frame(camera.eye - camera.at, camera.up, camera.eye);
    nodes.push(json!({"name": "camera", "matrix": matrix, "camera": 0}));
    vec![json!({"type": "perspective", "perspective": perspective})]
}

/// Returns the matrix, column by column, of a node whose z axis is `z` and whose y axis is near
/// `up`, where it can be.
fn frame(z: DVec3, up: DVec3, position: DVec3) -> [f64; 16] {
    let z = unit(z).unwrap_or(DVec3::Z);
    let up = unit(up).unwrap_or(DVec3::Y);
    let any = if z.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
    let x = unit(up.cross(z))
        .or_else(|| unit(any.cross(z)))
        .unwrap_or(DVec3::X);
    let y = z.cross(x);
    [
        x.x, x.y, x.z, 0.0, y.x, y.y, y.z, 0.0, z.x, z.y, z.z, 0.0, position.x, position.y,
        position.z, 1.0,
    ]
}

fn unit(vector: DVec3) -> Option<DVec3> {
    let scaled = vector / vector.abs().max_element();
    let unit = scaled / scaled.length();
    unit.is_finite().then_some(unit)
}
