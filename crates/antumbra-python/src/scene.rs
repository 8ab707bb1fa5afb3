//! Scenes from files and from arrays.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use antumbra_geometry::{DVec3, Short, SurfaceId};
use antumbra_scene::gather::Gathered;
use antumbra_scene::model::{self, Corner, Material, Mesh, Object, Shape};
use antumbra_scene::{ReadOptions, UpAxis, defaults, read_file};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Rows, rows};
use crate::error::ToPython as _;
use crate::lights::{LightTuple, to_tuple};
use crate::work::stoppable;

/// Scenes that another version wrote may have other parts.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A static scene and its numbered surfaces.
#[pyclass(frozen, module = "antumbra._antumbra")]
pub(crate) struct Scene {
    pub(crate) model: Arc<model::Scene>,
    pub(crate) gathered: Gathered,
    warnings: Vec<String>,
    files: Vec<PathBuf>,
    is_up_assumed: bool,
}

#[pymethods]
impl Scene {
    /// Reads a scene file; its ending says the format.
    #[staticmethod]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        up: Option<&str>,
        memory_limit: Option<u64>,
    ) -> PyResult<Self> {
        let up = match up {
            None => None,
            Some("y") => Some(UpAxis::Y),
            Some("z") => Some(UpAxis::Z),
            Some(up) => {
                let message = format!("up is {up:?}: expected \"y\", \"z\" or None");
                return Err(PyValueError::new_err(message));
            }
        };
        stoppable(py, 0, move |_| {
            let memory_limit = memory_limit.unwrap_or_else(antumbra_cli::default_memory_limit);
            let options = ReadOptions { up, memory_limit };
            let loaded = read_file(&path, &options).map_err(|e| e.to_python())?;
            let mut model = loaded.scene;
            if has_no_background(&path) && !model.is_photometric {
                model.background = defaults::SKY;
            }
            let mut scene = Self::of(model)?;
            scene.files = loaded.files;
            scene.is_up_assumed = loaded.is_up_assumed;
            scene.warnings = loaded.warnings.iter().map(ToString::to_string).collect();
            Ok(scene)
        })?
    }

    /// Makes a scene of one mesh, opaque and grey; surfaces have the numbers of its faces.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        vertices: Rows<'_>,
        faces: PyReadonlyArray2<'_, u32>,
        up: [f64; 3],
    ) -> PyResult<Self> {
        let faces: &[[u32; 3]] = rows(&faces, "faces")?;
        match &vertices {
            Rows::Double(vertices) => {
                let vertices: &[[f64; 3]] = rows(vertices, "vertices")?;
                let positions = || vertices.iter().map(|&x| DVec3::from_array(x)).collect();
                stoppable(py, 0, |_| Self::of_mesh(positions(), faces, up))?
            }
            Rows::Single(vertices) => {
                let vertices: &[[f32; 3]] = rows(vertices, "vertices")?;
                let in_double = |x: &[f32; 3]| DVec3::from_array(x.map(f64::from));
                let positions = || vertices.iter().map(in_double).collect();
                stoppable(py, 0, |_| Self::of_mesh(positions(), faces, up))?
            }
        }
    }

    /// Everything that the scene is, for `of_bytes`.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = stoppable(py, 0, |_| {
            postcard::to_allocvec(&(VERSION, &*self.model, &self.warnings, self.is_up_assumed))
        })?;
        let bytes = bytes.map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Makes the scene again whose bytes these are.
    #[staticmethod]
    fn of_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        let refused = |what: String| PyValueError::new_err(format!("no scene's bytes: {what}"));
        stoppable(py, 0, move |_| {
            let (version, rest) = postcard::take_from_bytes::<String>(bytes)
                .map_err(|error| refused(error.to_string()))?;
            if version != VERSION {
                return Err(refused(format!(
                    "antumbra {version} wrote them, and this is {VERSION}"
                )));
            }
            let (model, warnings, is_up_assumed) =
                postcard::from_bytes(rest).map_err(|error| refused(error.to_string()))?;
            let mut scene = Self::of(model)?;
            scene.warnings = warnings;
            scene.is_up_assumed = is_up_assumed;
            Ok(scene)
        })?
    }

    /// What the reader ignored, repaired or guessed.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// The files that it was read from.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.files.clone()
    }

    /// Triangles, spheres, walls and caps of cones, and disks.
    #[getter]
    fn surface_count(&self) -> usize {
        self.gathered.occluders().surface_count()
    }

    /// Their numbers come first.
    #[getter]
    fn triangle_count(&self) -> usize {
        self.gathered.occluders().triangle_count()
    }

    /// Least and greatest coordinates; `None` for an empty scene.
    #[getter]
    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let bounds = self.gathered.occluders().bounds();
        (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()])
    }

    /// The lights of the file.
    #[getter]
    fn lights(&self) -> Vec<LightTuple> {
        self.model.lights.iter().map(to_tuple).collect()
    }

    /// Eye, at, up and vertical field of view in degrees, and the picture's size, if the file says so.
    #[getter]
    #[expect(clippy::type_complexity, reason = "a tuple for Python")]
    fn camera(&self) -> Option<([f64; 3], [f64; 3], [f64; 3], f64, Option<[u32; 2]>)> {
        self.model.camera.map(|camera| {
            (
                camera.eye.to_array(),
                camera.at.to_array(),
                camera.up.to_array(),
                camera.vertical_fov_degrees,
                camera.resolution,
            )
        })
    }

    /// Whether neither the file nor the caller says which way is up.
    #[getter]
    fn is_up_assumed(&self) -> bool {
        self.is_up_assumed
    }

    /// Which way is up.
    #[getter]
    fn up(&self) -> [f64; 3] {
        self.model.up.to_array()
    }

    /// The corners of all triangles: shape (triangles, 9), float64.
    fn triangles<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let occluders = self.gathered.occluders();
        let count = occluders.triangle_count();
        let mut corners = Vec::with_capacity(9 * count);
        for surface in (0..count as u32).map(SurfaceId) {
            let positions = occluders.triangle_positions(surface).into_iter().flatten();
            corners.extend(positions.flat_map(|x| x.to_array()));
        }
        let array = PyArray1::from_vec(py, corners);
        numpy::PyArrayMethods::reshape(&array, [count, 9]).expect("nine numbers a triangle")
    }
}

impl Scene {
    fn of(model: model::Scene) -> PyResult<Self> {
        let gathered = Gathered::of(&model).map_err(|error| error.to_python())?;
        Ok(Self {
            model: Arc::new(model),
            gathered,
            warnings: Vec::new(),
            files: Vec::new(),
            is_up_assumed: false,
        })
    }

    fn of_mesh(mut positions: Vec<DVec3>, faces: &[[u32; 3]], up: [f64; 3]) -> PyResult<Self> {
        // What the scene model promises: a message in the caller's terms.
        const LARGEST: f64 = 1.2676506002282294e30; // 2^100
        let count = positions.len();
        let is_bad = |face: &[u32; 3]| face.iter().any(|&vertex| vertex as usize >= count);
        if let Some(number) = faces.iter().position(is_bad) {
            let [a, b, c] = faces[number];
            let message = format!("faces[{number}] is ({a}, {b}, {c}): there are {count} vertices");
            return Err(PyIndexError::new_err(message));
        }
        let is_good = |x: &DVec3| x.abs().cmple(DVec3::splat(LARGEST)).all();
        if !positions.iter().all(is_good) {
            let mut is_used = vec![false; count];
            for &vertex in faces.as_flattened() {
                is_used[vertex as usize] = true;
            }
            // What no face uses may be anything; it stands where something is.
            let stand_in = faces
                .first()
                .map_or(DVec3::ZERO, |face| positions[face[0] as usize]);
            for (number, x) in positions.iter_mut().enumerate() {
                if is_good(x) {
                    continue;
                }
                if is_used[number] {
                    let message = format!(
                        "vertices[{number}] is {}: coordinates must be finite and at most 2^100 in magnitude",
                        Short(*x)
                    );
                    return Err(PyValueError::new_err(message));
                }
                *x = stand_in;
            }
        }
        if u32::try_from(3 * faces.len()).is_err() {
            let message = format!("{} faces: expected fewer than 2^32 / 3", faces.len());
            return Err(PyValueError::new_err(message));
        }
        let mesh = Mesh {
            positions,
            corners: faces
                .as_flattened()
                .iter()
                .map(|&v| Corner::at(v))
                .collect(),
            face_ends: (1..=faces.len() as u32).map(|n| 3 * n).collect(),
            ..Mesh::default()
        };
        Self::of(model::Scene {
            materials: vec![Material::default()],
            objects: vec![Object {
                name: String::new(),
                shape: Shape::Mesh(mesh),
                material: 0,
            }],
            background: defaults::SKY,
            up: DVec3::from_array(up),
            ..model::Scene::default()
        })
    }
}

/// Whether the format has no word for what is behind everything.
fn has_no_background(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| {
        ["obj", "gltf", "glb", "ply", "stl"].contains(&ending.to_string_lossy().as_ref())
    })
}
