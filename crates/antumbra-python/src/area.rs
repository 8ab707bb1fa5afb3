//! Lights with size from Python's tuples; visible fractions, ambient occlusion, sky view factors, lit intervals.
//!
//! In: tuples, arrays of points. Out: lights, or errors that name what is wrong; arrays of shares.

use std::sync::Arc;

use antumbra::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, FractionBy, LightSampling,
    ReceiverSide, VisibleFraction,
};
use antumbra_geometry::{
    AreaError, AreaShape, DVec3, DiskLight, PolygonLight, RectangleLight, SegmentLight, Sky,
    SphereLight, SunDisc,
};
use antumbra_scene::model::{AreaLight, Color};
use numpy::{Element, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
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

/// How shares are asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct FractionSettings {
    side: String,
    samples: u32,
    seed: u64,
    tolerance: Option<f64>,
    threads: usize,
}

/// What is asked for.
enum Asked {
    /// The share of a light that is seen, by samples.
    Light(AreaShape),
    /// The same, exact where it has a closed form: the second array is 1 there.
    Exact(AreaShape),
    /// What is open up to a distance.
    Ambient(Option<f64>),
    /// What is seen of the sky.
    Sky(Sky),
}

/// Shares, and for exact fractions which of them are.
type Answered<'py> = (
    Bound<'py, PyArray1<f64>>,
    Option<Bound<'py, PyArray1<bool>>>,
);

/// Points as Python gives them.
struct Points<'a, 'py> {
    points: &'a Rows<'py>,
    surfaces: Option<&'a [u32]>,
    normals: Option<&'a Rows<'py>>,
}

/// The share of a light that each point sees: float64, shape (points,), and where it is exact.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
pub(crate) fn visible_fraction<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    normals: Option<Rows<'py>>,
    light: AreaTuple,
    is_exact: bool,
    settings: FractionSettings,
) -> PyResult<Answered<'py>> {
    let light = area_light(light)?.shape;
    let asked = if is_exact {
        Asked::Exact(light)
    } else {
        Asked::Light(light)
    };
    let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
    let points = Points {
        points: &points,
        surfaces,
        normals: normals.as_ref(),
    };
    shares(py, index, &points, &asked, &settings)
}

/// The share of what is around each point that is open: float64, shape (points,).
#[pyfunction]
pub(crate) fn ambient_occlusion<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    normals: Option<Rows<'py>>,
    distance: Option<f64>,
    settings: FractionSettings,
) -> PyResult<Answered<'py>> {
    let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
    let points = Points {
        points: &points,
        surfaces,
        normals: normals.as_ref(),
    };
    shares(py, index, &points, &Asked::Ambient(distance), &settings)
}

/// The share of the sky's light that each point gets: float64, shape (points,).
#[pyfunction]
pub(crate) fn sky_view_factor<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: Rows<'py>,
    face_ids: Option<PyReadonlyArray1<'py, u32>>,
    normals: Option<Rows<'py>>,
    up: [f64; 3],
    settings: FractionSettings,
) -> PyResult<Answered<'py>> {
    let sky = Sky::new(up.into()).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
    let points = Points {
        points: &points,
        surfaces,
        normals: normals.as_ref(),
    };
    shares(py, index, &points, &Asked::Sky(sky), &settings)
}

/// The lit intervals of a segment for one point, as shares of its length; `None` without a closed form.
#[pyfunction]
pub(crate) fn lit_intervals(
    index: &ShadowIndex,
    point: [f64; 3],
    face_id: Option<u32>,
    light: AreaTuple,
    side: &str,
) -> PyResult<Option<Vec<[f64; 2]>>> {
    let AreaShape::Segment(light) = area_light(light)?.shape else {
        return Err(PyValueError::new_err(
            "only linear lights have lit intervals",
        ));
    };
    let start = antumbra::ReceiverPoint {
        point: point.into(),
        surface: face_id.map(antumbra::SurfaceId),
    };
    let mut counters = antumbra::Counters::default();
    let found = index
        .index
        .lit_intervals(&start, side_of(side)?, &light, &mut counters);
    found.map_err(|error| PyValueError::new_err(error.to_string()))
}

pub(crate) fn side_of(side: &str) -> PyResult<ReceiverSide> {
    match side {
        "front" => Ok(ReceiverSide::Front),
        "back" => Ok(ReceiverSide::Back),
        "both" => Ok(ReceiverSide::Both),
        other => {
            let message = format!("side is {other:?}: expected \"front\", \"back\" or \"both\"");
            Err(PyValueError::new_err(message))
        }
    }
}

fn shares<'py>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: &Points<'_, 'py>,
    asked: &Asked,
    settings: &FractionSettings,
) -> PyResult<Answered<'py>> {
    let Points {
        points,
        surfaces,
        normals,
    } = *points;
    match (points, normals) {
        (Rows::Double(points), None) => {
            shares_of(py, index, points, surfaces, None, asked, settings)
        }
        (Rows::Double(points), Some(Rows::Double(normals))) => {
            shares_of(py, index, points, surfaces, Some(normals), asked, settings)
        }
        (Rows::Single(points), None) => {
            shares_of(py, index, points, surfaces, None, asked, settings)
        }
        (Rows::Single(points), Some(Rows::Single(normals))) => {
            shares_of(py, index, points, surfaces, Some(normals), asked, settings)
        }
        _ => Err(PyTypeError::new_err(
            "points and normals: expected one dtype for both",
        )),
    }
}

fn shares_of<'py, T: Element>(
    py: Python<'py>,
    index: &ShadowIndex,
    points: &PyReadonlyArray2<'py, T>,
    surfaces: Option<&[u32]>,
    normals: Option<&PyReadonlyArray2<'py, T>>,
    asked: &Asked,
    settings: &FractionSettings,
) -> PyResult<Answered<'py>>
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
    let side = side_of(&settings.side)?;
    let sampling = LightSampling {
        samples: settings.samples,
        seed: settings.seed,
        light: 0,
    };
    let found = stoppable(py, settings.threads, |_| {
        ask(&index.index, &batch, side, asked, &sampling)
    })?;
    let (values, are_exact) = found.map_err(|error| match error {
        BatchError::OffSurface { .. } => match index.index.off_surfaces(&batch) {
            Some(off) => off_surfaces_error(&off),
            None => batch_error(&error, 0),
        },
        error => batch_error(&error, 0),
    })?;
    let are_exact = are_exact.map(|are_exact| PyArray1::from_vec(py, are_exact));
    Ok((PyArray1::from_vec(py, values), are_exact))
}

/// Returns shares, and for exact fractions which of them are.
fn ask<P: Coordinates>(
    index: &antumbra::ShadowIndex,
    batch: &Batch<P>,
    side: ReceiverSide,
    asked: &Asked,
    sampling: &LightSampling,
) -> Result<(Vec<f64>, Option<Vec<bool>>), BatchError> {
    let count = batch.points.len();
    let rounded = |answer: &dyn Fn(&mut [f32]) -> Result<BatchCounters, BatchError>| {
        let mut shares = vec![0.0_f32; count];
        answer(&mut shares)?;
        Ok((shares.into_iter().map(f64::from).collect(), None))
    };
    match asked {
        Asked::Light(light) => {
            rounded(&|out| index.visible_fractions(batch, side, light, sampling, out))
        }
        Asked::Ambient(distance) => {
            rounded(&|out| index.ambient_occlusion(batch, side, *distance, sampling, out))
        }
        Asked::Sky(sky) => rounded(&|out| index.sky_view_factor(batch, side, sky, sampling, out)),
        Asked::Exact(light) => {
            let mut found = vec![VisibleFraction::default(); count];
            index.exact_visible_fractions(batch, side, light, sampling, &mut found)?;
            let are_exact = found.iter().map(|found| found.by == FractionBy::Exact);
            let are_exact = Some(are_exact.collect());
            Ok((
                found.iter().map(|found| found.fraction).collect(),
                are_exact,
            ))
        }
    }
}
