//! Scenes made by rule: the six of the paper, and larger ones for measurements.
//!
//! In: a name and a size. Out: for the names of the Standard Procedural Databases the scene that SPD's
//! program of that size writes, object by object, in full precision (SPD rounds to six digits). The paper's
//! other four scenes are lost; those of their names have its counts of objects and lights. Invariant: the
//! same bits on every platform; sizes are bounded, so memory is.
//!
//! *Objects* are counted as SPD's files count them: each polygon, sphere, and cone or cylinder is one. So
//! Tetra has 4096, one a triangle, and a box six.

mod bars;
mod city;
mod dgp;
mod forest;
mod glazed_city;
mod graph;
mod heightfield;
mod implicit;
mod parts;
mod quadric;
mod random;
mod rooms;
mod sine;
mod sphereflake;
mod stage;
mod teapot;
mod tetra;
mod town;
mod window;

use crate::model::Scene;

pub use bars::bars;
pub use city::city;
pub use dgp::dgp;
pub use forest::forest;
pub use glazed_city::glazed_city;
pub use graph::graph;
pub use heightfield::heightfield;
pub use implicit::{gyroid, knot, metaballs};
pub use quadric::quadric;
pub use rooms::rooms;
pub use sphereflake::sphereflake;
pub use stage::{GenerateError, NAMES};
use stage::{ROOM_LIGHTS, check_lights, check_size, polygon, stage};
pub use teapot::teapot;
pub use tetra::tetra;
pub use town::town;
pub use window::window;

/// Makes the scene of a name in [`NAMES`]; without a size, of its default size. A number of lights is for
/// `rooms`, which has 10 by default.
///
/// # Errors
/// The name is unknown, the size or the number of lights is out of range, or the scene has lights of its own.
///
/// # Example
/// ```
/// use antumbra_scene::generate::by_name;
/// assert_eq!(by_name("tetra", Some(3), None)?.objects.len(), 64);
/// assert_eq!(by_name("rooms", None, Some(100))?.lights.len(), 100);
/// # Ok::<(), antumbra_scene::generate::GenerateError>(())
/// ```
pub fn by_name(name: &str, size: Option<u32>, lights: Option<u32>) -> Result<Scene, GenerateError> {
    let default = NAMES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|&(_, size)| size);
    if lights.is_some() && default.is_some() && name != "rooms" {
        return Err(GenerateError::OwnLights {
            name: name.to_owned(),
        });
    }
    let only = |name, size, scene: fn() -> Scene| check_size(name, size, 1..=1).map(|()| scene());
    match (name, size.or(default)) {
        ("tetra", Some(size)) => tetra(size),
        ("sphereflake" | "flakes", Some(size)) => sphereflake(size),
        ("graph", Some(size)) => only("graph", size, graph),
        ("quadric", Some(size)) => only("quadric", size, quadric),
        ("dgp", Some(size)) => only("dgp", size, dgp),
        ("bars", Some(size)) => only("bars", size, bars),
        ("rooms", Some(size)) => rooms(size, lights.unwrap_or(ROOM_LIGHTS)),
        ("city", Some(size)) => city(size),
        ("glazed-city", Some(size)) => glazed_city(size),
        ("town", Some(size)) => town(size),
        ("forest", Some(size)) => forest(size),
        ("heightfield", Some(size)) => heightfield(size),
        ("window", Some(size)) => window(size),
        ("teapot", Some(size)) => teapot(size),
        ("knot", Some(size)) => knot(size),
        ("metaballs", Some(size)) => metaballs(size),
        ("gyroid", Some(size)) => gyroid(size),
        _ => Err(GenerateError::UnknownName {
            name: name.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_defaults_that_work() {
        for (name, size) in NAMES {
            assert_eq!(
                by_name(name, None, None).unwrap(),
                by_name(name, Some(size), None).unwrap()
            );
        }
        assert_eq!(
            by_name("gears", None, None).unwrap_err().to_string(),
            "no generator is called `gears`; there are tetra, sphereflake, flakes, graph, quadric, \
             dgp, bars, rooms, city, glazed-city, town, forest, heightfield, window, teapot, knot, metaballs, \
             gyroid"
        );
    }

    #[test]
    fn sizes_are_bounded() {
        for (name, smallest, largest) in [
            ("tetra", 1, 11),
            ("sphereflake", 1, 7),
            ("city", 1, 1_000_000),
            ("town", 1, 1_000_000),
            ("forest", 1, 4_000_000),
            ("heightfield", 2, 2048),
            ("window", 1, 256),
            ("teapot", 1, 12),
            ("knot", 3, 4096),
            ("metaballs", 1, 256),
            ("gyroid", 1, 64),
            ("graph", 1, 1),
            ("quadric", 1, 1),
            ("dgp", 1, 1),
            ("bars", 1, 1),
            ("rooms", 1, 12),
        ] {
            for size in [0, smallest - 1, largest + 1, u32::MAX] {
                assert_eq!(
                    by_name(name, Some(size), None).unwrap_err().to_string(),
                    format!("{name} of size {size}; expected a size from {smallest} to {largest}")
                );
            }
        }
    }
}
