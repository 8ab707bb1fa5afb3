//! What generators share: sizes, errors, an empty stage.

use antumbra_geometry::DVec3;
use std::ops::RangeInclusive;

use crate::defaults::nff_intensity;
use crate::model::{Camera, Color, Facing, Light, LightKind, Object, Polygon, Scene, Shape};

/// The generators' names, each with its default size: SPD's own, then boxes, houses, leaves, vertices along a
/// side, panes across, and rooms along a side; a level of patches, rings, balls, and periods along a side. `flakes` is `sphereflake` as the paper has it. The other four of the paper
/// have size 1 only.
pub const NAMES: [(&str, u32); 18] = [
    ("tetra", 6),
    ("sphereflake", 4),
    ("flakes", 2),
    ("graph", 1),
    ("quadric", 1),
    ("dgp", 1),
    ("bars", 1),
    ("rooms", 3),
    ("city", 10_000),
    ("glazed-city", 10_000),
    ("town", 1568),
    ("forest", 400_000),
    ("heightfield", 256),
    ("window", 6),
    ("teapot", 8),
    ("knot", 60),
    ("metaballs", 12),
    ("gyroid", 3),
];

/// How many lights `rooms` has by default.
pub(super) const ROOM_LIGHTS: u32 = 10;

/// Why a scene was not made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GenerateError {
    /// No generator has that name.
    #[error("no generator is called `{name}`; there are {}", NAMES.map(|(name, _)| name).join(", "))]
    UnknownName {
        /// The name asked for.
        name: String,
    },
    /// The scene would be empty or too large for memory.
    #[error("{name} of size {size}; expected a size from {smallest} to {largest}")]
    Size {
        /// The generator.
        name: &'static str,
        /// The size asked for.
        size: u32,
        /// The smallest size.
        smallest: u32,
        /// The largest size.
        largest: u32,
    },
    /// A number of lights was given for a scene that has its own.
    #[error("{name} has lights of its own; only rooms takes a number of lights")]
    OwnLights {
        /// The generator.
        name: String,
    },
    /// There would be no light, or too many.
    #[error("{lights} lights; expected {smallest} to {largest}")]
    Lights {
        /// The number asked for.
        lights: u32,
        /// The least number.
        smallest: u32,
        /// The largest number.
        largest: u32,
    },
}

/// Refuses sizes out of range.
pub(super) fn check_size(
    name: &'static str,
    size: u32,
    allowed: RangeInclusive<u32>,
) -> Result<(), GenerateError> {
    if allowed.contains(&size) {
        Ok(())
    } else {
        let (smallest, largest) = allowed.into_inner();
        Err(GenerateError::Size {
            name,
            size,
            smallest,
            largest,
        })
    }
}

/// Refuses numbers of lights out of range.
pub(super) fn check_lights(lights: u32, allowed: RangeInclusive<u32>) -> Result<(), GenerateError> {
    if allowed.contains(&lights) {
        Ok(())
    } else {
        let (smallest, largest) = allowed.into_inner();
        Err(GenerateError::Lights {
            lights,
            smallest,
            largest,
        })
    }
}

/// Returns a flat polygon without a name.
pub(super) fn polygon(vertices: Vec<DVec3>, material: usize) -> Object {
    Object {
        name: String::new(),
        shape: Shape::Polygon(Polygon {
            vertices,
            normals: Vec::new(),
        }),
        material,
    }
}

/// Returns a scene without objects, as SPD's programs set it up: sky-blue background, a view of
/// 45 degrees and 512 by 512 pixels, point lights of SPD's strength.
pub(super) fn stage(eye: DVec3, at: DVec3, up: DVec3, lights: &[DVec3]) -> Scene {
    let intensity = Color::splat(nff_intensity(lights.len()));
    let lights = lights.iter().enumerate().map(|(i, &position)| Light {
        name: format!("light {}", i + 1),
        kind: LightKind::Point { position },
        color: intensity,
        falls_off: false,
    });
    Scene {
        lights: lights.collect(),
        camera: Some(Camera {
            eye,
            at,
            up,
            vertical_fov_degrees: 45.0,
            resolution: Some([512, 512]),
        }),
        background: Color::new(0.078, 0.361, 0.753),
        ambient: intensity,
        facing: Facing::Winding,
        up,
        ..Scene::default()
    }
}
