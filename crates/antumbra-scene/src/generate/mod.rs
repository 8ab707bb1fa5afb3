//! Scenes made by rule: those of the Standard Procedural Databases that the paper tests on.
//!
//! In: a name and a size. Out: the scene that SPD's program of that size writes, object by
//! object, in full precision (SPD rounds to six digits). Invariant: the same bits on every
//! platform; sizes are bounded, so memory is.

mod sine;
mod sphereflake;
mod tetra;

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_intensity,
    model::{Camera, Color, Facing, Light, LightKind, Scene},
};

pub use sphereflake::sphereflake;
pub use tetra::tetra;

/// The generators' names, each with the size that SPD takes by default.
pub const NAMES: [(&str, u32); 2] = [("tetra", 6), ("sphereflake", 4)];

/// Why a scene was not made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GenerateError {
    /// No generator has that name.
    #[error("no generator is called `{name}`; there are tetra and sphereflake")]
    UnknownName {
        /// The name asked for.
        name: String,
    },
    /// The scene would be empty or too large for memory.
    #[error("{name} of size {size}; expected a size from 1 to {largest}")]
    Size {
        /// The generator.
        name: &'static str,
        /// The size asked for.
        size: u32,
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
        _ => Err(GenerateError::UnknownName {
            name: name.to_owned(),
        }),
    }
}

/// Refuses sizes out of range.
fn check_size(name: &'static str, size: u32, largest: u32) -> Result<(), GenerateError> {
    if (1..=largest).contains(&size) {
        Ok(())
    } else {
        Err(GenerateError::Size {
            name,
            size,
            largest,
        })
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
            "no generator is called `gears`; there are tetra and sphereflake"
        );
    }

    #[test]
    fn sizes_are_bounded() {
        for (name, largest) in [("tetra", 11), ("sphereflake", 7)] {
            for size in [0, largest + 1, u32::MAX] {
                assert_eq!(
                    by_name(name, Some(size)).unwrap_err().to_string(),
                    format!("{name} of size {size}; expected a size from 1 to {largest}")
                );
            }
        }
    }
}
