//! Lights with size from Python's tuples, and visible fractions.
//!
//! In: tuples, arrays of points. Out: lights, or errors that name what is wrong; arrays of fractions.

use std::sync::Arc;

use antumbra::{Batch, BatchError, BatchKind, Coordinates, LightSampling, ReceiverSide};
use antumbra_geometry::{
    AreaError, AreaShape, DVec3, DiskLight, PolygonLight, RectangleLight, SegmentLight, Sky,
    SphereLight, SunDisc,
};
use antumbra_scene::model::{AreaLight, Color};
use numpy::{Element, PyArray1, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{Rows, rows};
use crate::error::{batch_error, off_surfaces_error};
use crate::index::ShadowIndex;
use crate::work::stoppable;

/// Kind, name, vectors, radius or degrees, whether both sides shine, color, whether it falls off.
pub(crate) type AreaTuple = (String, String, Vec<[f64; 3]>, f64, bool, [f64; 3], bool);

/// Makes a light.
pub(crate) fn area_light(
    (kind, name, vectors, number, is_two_sided, color, falls_off): AreaTuple,
) -> PyResult<AreaLight> {
    let vectors: Vec<DVec3> = vectors.into_iter().map(DVec3::from_array).collect();
    let shape = shape_of(&kind, &vectors, number, is_two_sided)
        .ok_or_else(|| PyValueError::new_err(format!("no light with size is `{kind}`")))?;
    Ok(AreaLight {
        name,
        shape: shape.map_err(|error| PyValueError::new_err(error.to_string()))?,
        color: Color::from_array(color),
        falls_off,
    })
}

fn shape_of(
    kind: &str,
    vectors: &[DVec3],
    number: f64,
    is_two_sided: bool,
) -> Option<Result<AreaShape, AreaError>> {
    Some(match (kind, vectors) {
        ("rectangle", &[center, first, second]) => {
            RectangleLight::new(center, [first, second], is_two_sided).map(AreaShape::Rectangle)
        }
        ("polygon", corners) => PolygonLight::new(corners.to_vec(), is_two_sided)
            .map(|polygon| AreaShape::Polygon(Arc::new(polygon))),
        ("disk", &[center, normal]) => {
            DiskLight::new(center, normal, number, is_two_sided).map(AreaShape::Disk)
        }
        ("sphere", &[center]) => SphereLight::new(center, number).map(AreaShape::Sphere),
        ("segment", &[start, end]) => SegmentLight::new([start, end]).map(AreaShape::Segment),
        ("sun", &[direction]) => SunDisc::new(direction, number).map(AreaShape::SunDisc),
        ("sky", &[up]) => Sky::new(up).map(AreaShape::Sky),
        _ => return None,
    })
}

/// Refuses what is no light.
#[pyfunction]
pub(crate) fn check_area_light(light: AreaTuple) -> PyResult<()> {
    area_light(light).map(|_| ())
}

/// How a light is looked at.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FractionSettings {
    side: String,
    samples: u32,
    seed: u64,
    tolerance: Option<f64>,
    threads: usize,
}

/// The share of a light that each point sees: float32, shape (points,).
#[pyfunction]
pub(crate) fn visible_fraction<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    normals: Option<Rows<'py>>,
    light: AreaTuple,
    settings: FractionSettings,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let light = area_light(light)?.shape;
    let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
    match (&points, &normals) {
        (Rows::Double(points), None) => {
            fractions(py, index, points, surfaces, None, &light, &settings)
        }
        (Rows::Double(points), Some(Rows::Double(normals))) => fractions(
            py,
            index,
            points,
            surfaces,
            Some(normals),
            &light,
            &settings,
        ),
        (Rows::Single(points), None) => {
            fractions(py, index, points, surfaces, None, &light, &settings)
        }
        (Rows::Single(points), Some(Rows::Single(normals))) => fractions(
            py,
            index,
            points,
            surfaces,
            Some(normals),
            &light,
            &settings,
        ),
        _ => Err(PyTypeError::new_err(
            "points and normals: expected one dtype for both",
        )),
    }
}

fn fractions<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: &PyReadonlyArray2<'py, T>,
    surfaces: Option<&[u32]>,
    normals: Option<&PyReadonlyArray2<'py, T>>,
    light: &AreaShape,
    settings: &FractionSettings,
) -> PyResult<Bound<'py, PyArray1<f32>>>
where
    [T; 3]: Coordinates,
{
    let points = rows::<T, 3>(points, "points")?;
    let normals = normals
        .map(|normals| rows::<T, 3>(normals, "normals"))
        .transpose()?;
    let kind = match (surfaces, normals) {
        (Some(surfaces), _) => BatchKind::OnSurfaces {
            surfaces,
            tolerance: settings.tolerance,
        },
        (None, Some(normals)) => BatchKind::Facing { normals },
        (None, None) => BatchKind::Free,
    };
    let batch = Batch { points, kind };
    let side = match settings.side.as_str() {
        "front" => ReceiverSide::Front,
        "back" => ReceiverSide::Back,
        "both" => ReceiverSide::Both,
        other => {
            let message = format!("side is {other:?}: expected \"front\", \"back\" or \"both\"");
            return Err(PyValueError::new_err(message));
        }
    };
    let sampling = LightSampling {
        samples: settings.samples,
        seed: settings.seed,
        light: 0,
    };
    let out = PyArray1::<f32>::zeros(py, points.len(), false);
    let mut writable = out.readwrite();
    let fractions = writable.as_slice_mut()?;
    let counted = stoppable(py, settings.threads, |_| {
        index
            .index
            .visible_fractions(&batch, side, light, &sampling, fractions)
    })?;
    counted.map_err(|error| match error {
        BatchError::OffSurface { .. } => match index.index.off_surfaces(&batch) {
            Some(off) => off_surfaces_error(&off),
            None => batch_error(&error, 0),
        },
        error => batch_error(&error, 0),
    })?;
    drop(writable);
    Ok(out)
}
