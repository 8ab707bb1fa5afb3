//! Cameras and lights of a document.
//!
//! In: nodes that carry cameras and lights (KHR_lights_punctual), and their places in the world.
//! Out: the first perspective camera, and all lights. Invariant: directions are unit vectors; a
//! node without one (scaled to nothing) gives a warning and nothing else.

use glam::{DAffine3, DVec3};

use crate::{
    error::{Place, quoted},
    model::{Camera, Color, Light, LightKind, Scene},
    read::text::LARGEST_COORDINATE,
    warning::WarningLog,
};

use super::{
    Fault,
    document::{Document, LightEntry},
    nodes::Hierarchy,
    short_name,
};

/// Adds what the visible nodes carry.
pub(super) fn add(
    document: &Document,
    hierarchy: &Hierarchy,
    scene: &mut Scene,
    warnings: &mut WarningLog,
) -> Result<(), Fault> {
    for &index in &hierarchy.visible {
        let node = &document.nodes[index];
        let world_from_node = &hierarchy.world_from_node[index];
        if let Some(camera) = node.camera {
            let path = || format!("nodes[{index}].camera");
            add_camera(document, camera, path, world_from_node, scene, warnings)?;
        }
        let extensions = node.extensions.as_ref();
        if let Some(named) = extensions.and_then(|e| e.light.as_ref()) {
            let lights = document.extensions.lights.as_ref();
            let lights = lights.map_or(&[][..], |l| &l.lights);
            let Some(entry) = lights.get(named.light) else {
                let path = format!("nodes[{index}].extensions.KHR_lights_punctual.light");
                return Err(Fault::missing(path, "lights", named.light, lights.len()));
            };
            let path = format!("extensions.KHR_lights_punctual.lights[{}]", named.light);
            let kind = kind(entry, &path, world_from_node, warnings)?;
            let color = color(entry, &path)?;
            let Some(kind) = kind else { continue };
            let name = [&entry.name, &node.name]
                .into_iter()
                .find(|n| !n.is_empty());
            scene.lights.push(Light {
                name: name.map_or_else(
                    || format!("light {}", scene.lights.len() + 1),
                    |name| short_name(name),
                ),
                falls_off: !matches!(kind, LightKind::Directional { .. }),
                kind,
                color,
            });
            scene.is_photometric = true;
        }
    }
    Ok(())
}

fn add_camera(
    document: &Document,
    index: usize,
    path: impl Fn() -> String,
    world_from_node: &DAffine3,
    scene: &mut Scene,
    warnings: &mut WarningLog,
) -> Result<(), Fault> {
    let Some(entry) = document.cameras.get(index) else {
        let count = document.cameras.len();
        return Err(Fault::missing(path(), "cameras", index, count));
    };
    if entry.kind == "orthographic" {
        let message = "orthographic cameras are not read";
        warnings.add(Place::Whole, message);
        return Ok(());
    }
    let Some(perspective) = entry.perspective.as_ref() else {
        let problem = format!(
            "expected `perspective`; the type is {}",
            quoted(&entry.kind)
        );
        return Err(Fault::at(format!("cameras[{index}]"), problem, ""));
    };
    let yfov = perspective.yfov;
    if !(yfov > 0.0 && yfov < std::f64::consts::PI) {
        let problem = format!(
            "expected an angle between 0 and pi, found {}",
            antumbra_geometry::Short(yfov)
        );
        let path = format!("cameras[{index}].perspective.yfov");
        return Err(Fault::at(path, problem, ""));
    }
    if scene.camera.is_some() {
        let message = "of several cameras, the first is read";
        warnings.add(Place::Whole, message);
        return Ok(());
    }
    let eye = world_from_node.translation;
    let forward = unit(-world_from_node.matrix3.z_axis);
    let up = unit(world_from_node.matrix3.y_axis);
    // Far from the origin one step is too small to be seen.
    let step = eye.abs().max_element().max(1.0);
    let camera = forward.zip(up).map(|(forward, up)| Camera {
        eye,
        at: eye + forward * step,
        up,
        vertical_fov_degrees: yfov.to_degrees(),
        resolution: None,
    });
    match camera.filter(|c| is_usable(eye) && c.up.cross(c.at - c.eye) != DVec3::ZERO) {
        Some(camera) => scene.camera = Some(camera),
        None => warnings.add(Place::Whole, "a camera has no direction: ignored"),
    }
    Ok(())
}

/// Returns where a light's light comes from. Lights shine along their node's -z axis.
fn kind(
    entry: &LightEntry,
    path: &str,
    world_from_node: &DAffine3,
    warnings: &mut WarningLog,
) -> Result<Option<LightKind>, Fault> {
    let position = world_from_node.translation;
    let towards_light = unit(world_from_node.matrix3.z_axis);
    if entry.range.is_some() {
        let message = "the range of lights is not read: they reach on";
        warnings.add(Place::Whole, message);
    }
    let kind = match &*entry.kind {
        "point" => Some(LightKind::Point { position }),
        "directional" => {
            towards_light.map(|towards_light| LightKind::Directional { towards_light })
        }
        "spot" => {
            let cone = entry.spot.as_ref();
            let inner = cone.and_then(|c| c.inner_cone_angle).unwrap_or(0.0);
            let quarter = std::f64::consts::FRAC_PI_4;
            let outer = cone.and_then(|c| c.outer_cone_angle).unwrap_or(quarter);
            if !(0.0 <= inner && inner <= outer && outer <= 1.571) {
                let problem = format!(
                    "expected 0 <= inner <= outer cone angle <= pi / 2, found {inner} and {outer}"
                );
                return Err(Fault::at(format!("{path}.spot"), problem, ""));
            }
            let inner_cosine = libm::cos(inner);
            towards_light.map(|towards_light| LightKind::Spot {
                position,
                axis: -towards_light,
                inner_cosine,
                outer_cosine: libm::cos(outer).clamp(0.0, inner_cosine),
            })
        }
        other => {
            let problem = format!(
                "expected point, spot or directional, found {}",
                quoted(other)
            );
            return Err(Fault::at(format!("{path}.type"), problem, ""));
        }
    };
    let kind = kind.filter(|_| is_usable(position));
    if kind.is_none() {
        let message = "a light has no direction or is too far away: ignored";
        warnings.add(Place::Whole, message);
    }
    Ok(kind)
}

/// Returns a light's color times its intensity: candela, or lux for directional lights.
fn color(entry: &LightEntry, path: &str) -> Result<Color, Fault> {
    let color = Color::from_array(entry.color.unwrap_or([1.0; 3]));
    let product = color * entry.intensity.unwrap_or(1.0);
    if product.min_element() >= 0.0 && product.is_finite() {
        return Ok(product);
    }
    let problem = format!("color times intensity is {product}; expected no negative channel");
    Err(Fault::at(path, problem, ""))
}

fn is_usable(position: DVec3) -> bool {
    position.is_finite() && position.abs().max_element() <= LARGEST_COORDINATE
}

/// Returns the vector at length one, `None` if it has no direction.
fn unit(vector: DVec3) -> Option<DVec3> {
    let scaled = vector / vector.abs().max_element();
    let unit = scaled / scaled.length();
    unit.is_finite().then_some(unit)
}
