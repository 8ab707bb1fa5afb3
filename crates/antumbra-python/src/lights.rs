//! Lights from Python's tuples and back.

use antumbra_geometry::DVec3;
use antumbra_scene::defaults;
use antumbra_scene::model::{Color, Light, LightKind};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Kind, name, place or direction towards the light, axis, cosines of the inner and outer half-angle, color,
/// whether it falls off. What a kind has no use for is zero.
pub(crate) type LightTuple = (String, String, [f64; 3], [f64; 3], [f64; 2], [f64; 3], bool);

/// Makes lights; their numbers are checked where an index is built.
pub(crate) fn from_tuples(tuples: Vec<LightTuple>) -> PyResult<Vec<Light>> {
    tuples.into_iter().map(from_tuple).collect()
}

fn from_tuple(
    (kind, name, place, axis, [inner_cosine, outer_cosine], color, falls_off): LightTuple,
) -> PyResult<Light> {
    let place = DVec3::from_array(place);
    let kind = match kind.as_str() {
        "point" => LightKind::Point { position: place },
        "directional" => LightKind::Directional {
            towards_light: place,
        },
        "spot" => LightKind::Spot {
            position: place,
            axis: DVec3::from_array(axis),
            inner_cosine,
            outer_cosine,
        },
        _ => return Err(PyValueError::new_err(format!("no light is `{kind}`"))),
    };
    let color = Color::from_array(color);
    Ok(Light {
        name,
        kind,
        color,
        falls_off,
    })
}

/// The other way.
pub(crate) fn to_tuple(light: &Light) -> LightTuple {
    let (kind, place, axis, cosines) = match light.kind {
        LightKind::Point { position } => ("point", position, DVec3::ZERO, [0.0; 2]),
        LightKind::Directional { towards_light } => {
            ("directional", towards_light, DVec3::ZERO, [0.0; 2])
        }
        LightKind::Spot {
            position,
            axis,
            inner_cosine,
            outer_cosine,
        } => ("spot", position, axis, [inner_cosine, outer_cosine]),
    };
    (
        kind.to_owned(),
        light.name.clone(),
        place.to_array(),
        axis.to_array(),
        cosines,
        light.color.to_array(),
        light.falls_off,
    )
}

/// Returns the direction towards a sun, as the program's `--sun` means it, in a scene with that axis up.
#[pyfunction]
pub(crate) fn towards_sun(azimuth_degrees: f64, elevation_degrees: f64, up: [f64; 3]) -> [f64; 3] {
    let up = DVec3::from_array(up);
    match defaults::sun(azimuth_degrees, elevation_degrees, up).kind {
        LightKind::Directional { towards_light } => towards_light.to_array(),
        LightKind::Point { position } | LightKind::Spot { position, .. } => position.to_array(),
    }
}
