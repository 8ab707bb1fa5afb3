//! `antumbra inspect`: what a scene holds and what its index would cost.

use antumbra::{IndexOptions, Method, Refine};
use antumbra_geometry::{AreaShape, Element, ElementKind, Opacity, Short};
use antumbra_scene::gather::{Gathered, scene_bytes, surface_bytes};
use antumbra_scene::model::LightKind;

use crate::failure::{Failure, Outcome};
use crate::load::{self, Lighting, LitScene};
use crate::memory;
use crate::memory::Need;
use crate::outputs::Outputs;
use crate::screen::Screen;
use crate::typed::{Inspect, Shadows};
use crate::values::format_bytes;

/// Reads, counts, predicts; builds nothing.
pub fn run(typed: &Inspect, screen: &Screen) -> Result<Outcome, Failure> {
    let none = Outputs::none();
    let lit = load::any_lit_scene(
        &typed.file,
        None,
        Lighting::Listed,
        &typed.cost,
        &none,
        screen,
    )?;
    let scene = &lit.scene;
    let limit = memory::limit(typed.cost.memory_limit);
    let [scene_bytes, surface_bytes] = [scene_bytes(scene), surface_bytes(scene)];
    let need = Need {
        scene: scene_bytes,
        surfaces: surface_bytes,
        ..Need::default()
    };
    need.check(limit)?;
    let gathered = Gathered::of(scene)?;
    let options = |method| IndexOptions {
        method,
        grid: typed.cost.grid.unwrap_or_default(),
        refinement: typed.cost.refinement(Refine::Eager),
        memory_limit: limit,
        ..IndexOptions::default()
    };
    contents(&lit, &gathered, screen);

    // Predicted before any of it is taken.
    row(screen, "memory, scene", format_bytes(scene_bytes));
    row(screen, "memory, surfaces", format_bytes(surface_bytes));
    for shadows in Shadows::ALL {
        let options = options(shadows.method());
        let predicted = options.predict(gathered.occluders(), scene.lights.len(), None)?;
        let bytes = predicted.total();
        row(
            screen,
            &format!("memory, {}", shadows.name()),
            format_bytes(bytes),
        );
    }
    row(screen, "memory limit", format_bytes(limit));

    let [x, y, z] = options(Method::default()).resolve_grid(gathered.occluders())?;
    row(screen, "grid", format!("{x} x {y} x {z}"));
    Ok(Outcome::Done)
}

fn row(screen: &Screen, name: &str, value: impl std::fmt::Display) {
    screen.result(format!("{name:<22} {value}"));
}

fn contents(lit: &LitScene, gathered: &Gathered, screen: &Screen) {
    let scene = &lit.scene;
    let occluders = gathered.occluders();
    row(screen, "objects", scene.objects.len());
    row(screen, "elements", occluders.elements().len());
    for (kind, name) in [
        (ElementKind::Face, "  faces"),
        (ElementKind::Sphere, "  spheres"),
        (ElementKind::OpenCone, "  open cones"),
        (ElementKind::ClosedCone, "  closed cones"),
        (ElementKind::Disk, "  disks"),
        (ElementKind::Patch, "  patches"),
        (ElementKind::Implicit, "  implicit surfaces"),
    ] {
        let count = occluders
            .elements()
            .iter()
            .filter(|element| element.kind == kind)
            .count();
        if count > 0 {
            row(screen, name, count);
        }
    }
    row(screen, "surfaces", occluders.surface_count());
    row(screen, "triangles", occluders.triangle_count());
    row(screen, "materials", scene.materials.len());
    let masked = |e: &&Element| matches!(e.opacity, Opacity::AlphaTested(_));
    let see_through =
        |e: &&Element| matches!(e.opacity, Opacity::Transparent | Opacity::Filtering(_));
    let elements = occluders.elements();
    for (count, name) in [
        (scene.textures.len(), "textures"),
        (elements.iter().filter(masked).count(), "  with holes"),
        (
            elements.iter().filter(see_through).count(),
            "  seen through",
        ),
    ] {
        if count > 0 {
            row(screen, name, count);
        }
    }
    row(screen, "lights", scene.lights.len());
    for (number, light) in scene.lights.iter().enumerate() {
        let what = match light.kind {
            LightKind::Point { position } => format!("point at {}", Short(position)),
            LightKind::Spot { position, .. } => format!("spot at {}", Short(position)),
            LightKind::Directional { towards_light } => {
                format!("direction, towards {}", Short(towards_light))
            }
        };
        let invented = match lit.is_sun_invented {
            true => "; invented, as neither the file nor an option has a light",
            false => "",
        };
        row(screen, &format!("  light {number}"), what + invented);
    }
    if !scene.area_lights.is_empty() {
        // They take no memory of the index.
        row(screen, "lights with size", scene.area_lights.len());
    }
    for (number, light) in scene.area_lights.iter().enumerate() {
        let (kind, size) = (light.shape.kind(), Short(light.shape.size()));
        let what = match light.shape {
            AreaShape::Segment(_) => format!("{kind}, length {size}"),
            AreaShape::SunDisc(_) | AreaShape::Sky(_) => format!("{kind}, {size} steradians"),
            _ => format!("{kind}, area {size}"),
        };
        row(screen, &format!("  light {number}"), what);
    }
    row(
        screen,
        "camera",
        if scene.camera.is_some() {
            "in the file"
        } else {
            "none"
        },
    );
    let assumed = match lit.up.is_assumed {
        true => "; assumed, as the file does not say it (see --up)",
        false => "",
    };
    row(
        screen,
        "up",
        format!("{}{assumed}", Short(lit.up.direction)),
    );
    let bounds = occluders.bounds();
    if bounds.is_empty() {
        row(screen, "bounds", "empty");
    } else {
        let [min, max] = [bounds.min, bounds.max].map(Short);
        row(screen, "bounds", format!("{min} to {max}"));
    }
}
