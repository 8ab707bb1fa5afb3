//! Scenes made by rule: those of the Standard Procedural Databases that the paper tests on, and
//! larger ones for measurements.
//!
//! In: a name and a size. Out: for SPD's names the scene that SPD's program of that size writes,
//! object by object, in full precision (SPD rounds to six digits). Invariant: the same bits on
//! every platform; sizes are bounded, so memory is.

mod city;
mod forest;
mod heightfield;
mod random;
mod sine;
mod sphereflake;
mod tetra;

use std::ops::RangeInclusive;

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_intensity,
    model::{Camera, Color, Facing, Light, LightKind, Object, Polygon, Scene, Shape},
};

pub use city::city;
pub use forest::forest;
pub use heightfield::heightfield;
pub use sphereflake::sphereflake;
pub use tetra::tetra;

/// The generators' names, each with its default size: SPD's own, then boxes, leaves, and vertices
/// along a side.
pub const NAMES: [(&str, u32); 5] = [
    ("tetra", 6),
    ("sphereflake", 4),
    ("city", 10_000),
    ("forest", 400_000),
    ("heightfield", 256),
];

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
}

/// Makes the scene of a name in [`NAMES`]; without a size, of its default size.
///
/// # Errors
/// The name is unknown, or the size out of range.
///
/// # Example
/// ```
/// let scene = antumbra_scene::generate::by_name("tetra", Some(3)).unwrap();
/// assert_eq!(scene.objects.len(), 64);
/// ```
pub fn by_name(name: &str, size: Option<u32>) -> Result<Scene, GenerateError> {
    let default = NAMES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|&(_, size)| size);
    match (name, size.or(default)) {
        ("tetra", Some(size)) => tetra(size),
        ("sphereflake", Some(size)) => sphereflake(size),
        ("city", Some(size)) => city(size),
        ("forest", Some(size)) => forest(size),
        ("heightfield", Some(size)) => heightfield(size),
        _ => Err(GenerateError::UnknownName {
            name: name.to_owned(),
        }),
    }
}

/// Refuses sizes out of range.
fn check_size(
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

/// Returns a flat polygon without a name.
fn polygon(vertices: Vec<DVec3>, material: usize) -> Object {
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
fn stage(eye: DVec3, at: DVec3, up: DVec3, lights: &[DVec3]) -> Scene {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_defaults_that_work() {
        for (name, size) in NAMES {
            assert_eq!(
                by_name(name, None).unwrap(),
                by_name(name, Some(size)).unwrap()
            );
        }
        assert_eq!(
            by_name("gears", None).unwrap_err().to_string(),
            "no generator is called `gears`; there are tetra, sphereflake, city, forest, heightfield"
        );
    }

    #[test]
    fn sizes_are_bounded() {
        for (name, smallest, largest) in [
            ("tetra", 1, 11),
            ("sphereflake", 1, 7),
            ("city", 1, 1_000_000),
            ("forest", 1, 4_000_000),
            ("heightfield", 2, 2048),
        ] {
            for size in [0, smallest - 1, largest + 1, u32::MAX] {
                assert_eq!(
                    by_name(name, Some(size)).unwrap_err().to_string(),
                    format!("{name} of size {size}; expected a size from {smallest} to {largest}")
                );
            }
        }
    }
}
