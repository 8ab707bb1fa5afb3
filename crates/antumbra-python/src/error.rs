//! Our errors as Python's: `OSError` for files that the system refuses, `MemoryError` for limits,
//! `ValueError` for the rest.

use antumbra::{BatchError, BuildError, LoadError, OffSurfaces, Refusal, SaveError};
use antumbra_geometry::{DVec3, Short, SurfaceId};
use antumbra_render::camera::CameraError;
use antumbra_render::image_file::ImageFileError;
use antumbra_render::prepare::PrepareError;
use antumbra_scene::gather::GatherError;
use antumbra_scene::{ReadError, ReadErrorKind};
use pyo3::exceptions::{
    PyFileNotFoundError, PyIndexError, PyMemoryError, PyOSError, PyRuntimeError, PyValueError,
};
use pyo3::prelude::*;

/// Our errors, as exceptions of Python.
pub(crate) trait ToPython {
    fn to_python(&self) -> PyErr;
}

impl ToPython for ReadError {
    fn to_python(&self) -> PyErr {
        match &self.kind {
            ReadErrorKind::Io(error) if error.kind() == std::io::ErrorKind::NotFound => {
                PyFileNotFoundError::new_err(self.to_string())
            }
            ReadErrorKind::OverLimit { .. } => PyMemoryError::new_err(self.to_string()),
            ReadErrorKind::Io(_) => PyOSError::new_err(self.to_string()),
            _ => PyValueError::new_err(self.to_string()),
        }
    }
}

impl ToPython for PrepareError {
    fn to_python(&self) -> PyErr {
        match self {
            Self::Gather(error) => error.to_python(),
            Self::Build(error) => error.to_python(),
        }
    }
}

impl ToPython for GatherError {
    fn to_python(&self) -> PyErr {
        PyValueError::new_err(self.to_string())
    }
}

impl ToPython for BuildError {
    fn to_python(&self) -> PyErr {
        match self {
            Self::Memory { .. } => PyMemoryError::new_err(self.to_string()),
            Self::Occlusion(LoadError {
                reason: Refusal::Unreadable(_),
                ..
            }) => PyOSError::new_err(self.to_string()),
            _ => PyValueError::new_err(self.to_string()),
        }
    }
}

impl ToPython for SaveError {
    fn to_python(&self) -> PyErr {
        match self {
            Self::Unwritable { .. } => PyOSError::new_err(self.to_string()),
            _ => PyValueError::new_err(self.to_string()),
        }
    }
}

impl ToPython for CameraError {
    fn to_python(&self) -> PyErr {
        PyValueError::new_err(format!("camera: {self}"))
    }
}

impl ToPython for ImageFileError {
    fn to_python(&self) -> PyErr {
        match self {
            Self::Io { .. } => PyOSError::new_err(self.to_string()),
            Self::Encode { .. } => PyRuntimeError::new_err(self.to_string()),
        }
    }
}

/// Arrays are worked on in blocks: `first` is the place of the block's first point among all.
pub(crate) fn batch_error(error: &BatchError, first: usize) -> PyErr {
    const RANGE: &str = "must be finite and at most 2^100 in magnitude";
    let row = |v: &DVec3| Short(*v);
    match error {
        BatchError::UnknownLight(_) => PyIndexError::new_err(error.to_string()),
        BatchError::BadPoint { index, point } => {
            let (index, point) = (first + index, row(point));
            PyValueError::new_err(format!("points[{index}] is {point}: coordinates {RANGE}"))
        }
        BatchError::BadNormal { index, normal } => {
            let (index, normal) = (first + index, row(normal));
            PyValueError::new_err(format!("normals[{index}] is {normal}: components {RANGE}"))
        }
        BatchError::BadTarget { what, index, found } => {
            let (index, found) = (first + index, row(found));
            PyValueError::new_err(format!("{what}s[{index}] is {found}: coordinates {RANGE}"))
        }
        BatchError::UnknownSurface { index, surface } => {
            let index = first + index;
            PyIndexError::new_err(format!("face_ids[{index}] is {surface}: no such face"))
        }
        BatchError::NoSurface {
            index,
            point,
            nearest,
            allowed,
        } => {
            let (index, point) = (first + index, row(point));
            let said = match nearest {
                Some((SurfaceId(face), distance)) => format!(
                    "on no surface: the nearest, face {face}, is {distance:.3e} away, and {allowed:.3e} is allowed; \
                     give tolerance=, or points as float32 if they were rounded to that; occluded_at answers for \
                     points of space"
                ),
                None => "on no surface: the scene has none".to_owned(),
            };
            PyValueError::new_err(format!("points[{index}] is {point}: {said}"))
        }
        BatchError::OffSurface { first: off } => {
            let off = OffSurfaces {
                count: 1,
                first: *off,
                worst: *off,
            };
            off_surfaces_error(&off)
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Says how many points are not on the faces that they name, and how far the worst is off.
pub(crate) fn off_surfaces_error(off: &OffSurfaces) -> PyErr {
    let OffSurfaces {
        count,
        first,
        worst,
    } = off;
    let many = match count {
        1 => "a point is not on the face that it names".to_owned(),
        count => format!("{count} points are not on the faces that they name"),
    };
    let v = worst.point;
    PyValueError::new_err(format!(
        "face_ids: {many}, the first is points[{}]; the worst, points[{}] = ({}, {}, {}), is {:.3e} off face {}, and \
         {:.3e} is allowed; number the faces as the scene does (trimesh.load(..., process=False) keeps their order), \
         or give tolerance= to accept it",
        first.index, worst.index, v.x, v.y, v.z, worst.distance, worst.surface, worst.allowed
    ))
}
