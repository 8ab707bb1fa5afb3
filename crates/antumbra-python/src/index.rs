//! The shadow index and its batches.
//!
//! In: a scene, lights, settings; then arrays of points. Out: arrays of answers. Ctrl-C stops every call that may
//! take long.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use antumbra::{
    Batch, BatchCounters, BatchError, BatchKind, Coordinates, GridResolution, IndexOptions,
    LightId, Method, Nearness, Refine, Refinement, SavedLight, Towards,
};
use antumbra_geometry::Precision;
use antumbra_scene::gather::light_shapes;
use numpy::{
    Element, PyArray1, PyArray2, PyArray4, PyArrayMethods as _, PyReadonlyArray1, PyReadonlyArray2,
};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Rows, rows};
use crate::error::{ToPython as _, batch_error, off_surfaces_error};
use crate::lights::{LightTuple, from_tuples, to_tuple};
use crate::scene::Scene;
use crate::work::{Progress, stoppable, watched};

/// Blocks of points, of which a call reports that they are done, and the points of one at least.
const BLOCKS: usize = 64;
const SMALLEST_BLOCK: usize = 1 << 16;

/// Returns the points of a block: a multiple of 8, so that no two share a byte of bits.
fn block_length(count: usize) -> usize {
    let length = count.div_ceil(BLOCKS).max(SMALLEST_BLOCK);
    length.next_multiple_of(8)
}

/// How an index is made.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Settings {
    method: String,
    refine: String,
    resolution: u32,
    space_resolution: u32,
    memory: u64,
    memory_limit: Option<u64>,
    grid: Option<[u32; 3]>,
    pub(crate) threads: usize,
}

impl Settings {
    pub(crate) fn options(&self) -> PyResult<IndexOptions> {
        let method = match self.method.as_str() {
            "auto" => Method::Auto,
            "voxel" => Method::Voxel,
            "voxel-1990" => Method::Voxel1990,
            "grid" => Method::Grid,
            "bvh" => Method::Bvh,
            "naive" => Method::Naive,
            other => {
                let known = "\"auto\", \"voxel\", \"voxel-1990\", \"grid\", \"bvh\" or \"naive\"";
                let message = format!("method is {other:?}: expected {known}");
                return Err(PyValueError::new_err(message));
            }
        };
        let refine = match self.refine.as_str() {
            "lazy" => Refine::Lazy,
            "queried" => Refine::Queried,
            "eager" => Refine::Eager,
            other => {
                let message =
                    format!("refine is {other:?}: expected \"lazy\", \"queried\" or \"eager\"");
                return Err(PyValueError::new_err(message));
            }
        };
        Ok(IndexOptions {
            method,
            grid: self
                .grid
                .map_or(GridResolution::Automatic, GridResolution::Fixed),
            refinement: Refinement {
                resolution: self.resolution,
                space_resolution: self.space_resolution,
                refine,
                memory: self.memory,
                ..Refinement::default()
            },
            memory_limit: self.memory_limit.unwrap_or(u64::MAX),
            ..IndexOptions::default()
        })
    }
}

fn method_name(method: Method) -> &'static str {
    match method {
        Method::Voxel => "voxel",
        Method::Voxel1990 => "voxel-1990",
        Method::Grid => "grid",
        Method::Bvh => "bvh",
        Method::Naive => "naive",
        _ => "auto",
    }
}

/// A scene and lights, ready for queries.
#[pyclass(frozen, module = "antumbra._antumbra")]
pub(crate) struct ShadowIndex {
    pub(crate) index: antumbra::ShadowIndex,
    lights: Vec<LightTuple>,
    prepare_seconds: f64,
    counted: Mutex<BatchCounters>,
}

/// What the points of a question are besides points.
pub(crate) struct Meant<'a, T> {
    normals: Option<&'a [[T; 3]]>,
    surfaces: Option<&'a [u32]>,
    on_surface: bool,
    nearness: Nearness,
}

impl<'a, T: Element> Meant<'a, T>
where
    [T; 3]: Coordinates,
{
    pub(crate) fn new(
        normals: Option<&'a [[T; 3]]>,
        surfaces: Option<&'a [u32]>,
        on_surface: bool,
        nearness: Nearness,
    ) -> Self {
        Self {
            normals,
            surfaces,
            on_surface,
            nearness,
        }
    }

    /// Returns the same of some of the points.
    pub(crate) fn part(&self, part: Range<usize>) -> Self {
        Self {
            normals: self.normals.map(|normals| &normals[part.clone()]),
            surfaces: self.surfaces.map(|surfaces| &surfaces[part]),
            ..*self
        }
    }

    /// Returns the batch of the points.
    pub(crate) fn batch(&self, points: &'a [[T; 3]]) -> Batch<'a, [T; 3]> {
        let kind = match (self.surfaces, self.normals) {
            (Some(surfaces), _) => BatchKind::OnSurfaces {
                surfaces,
                tolerance: self.nearness.tolerance,
            },
            (None, normals) if self.on_surface => BatchKind::OnNearest {
                normals,
                nearness: self.nearness,
            },
            (None, Some(normals)) => BatchKind::Facing { normals },
            (None, None) => BatchKind::Free,
        };
        Batch { points, kind }
    }

    /// Says what is wrong with the points, in the block that begins with the point `first`; of surfaces that points are
    /// off, what is wrong with all.
    pub(crate) fn error(
        &self,
        index: &antumbra::ShadowIndex,
        points: &'a [[T; 3]],
        (first, error): (usize, &BatchError),
    ) -> PyErr {
        if matches!(error, BatchError::OffSurface { .. })
            && let Some(off) = index.off_surfaces(&self.batch(points))
        {
            return off_surfaces_error(&off);
        }
        batch_error(error, first)
    }
}

#[pymethods]
impl ShadowIndex {
    #[new]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        lights: Vec<LightTuple>,
        settings: Settings,
        occlusion: Option<PathBuf>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let lights = from_tuples(lights)?;
        let options = settings.options()?;
        let begin = Instant::now();
        let progress = Progress::new(progress);
        let index = watched(py, settings.threads, &progress, |_| {
            let shapes = light_shapes(&lights);
            options.build_from(scene.gathered.occluders(), shapes, occlusion.as_deref())
        })?;
        Ok(Self {
            index: index.map_err(|error| error.to_python())?,
            lights: lights.iter().map(to_tuple).collect(),
            prepare_seconds: begin.elapsed().as_secs_f64(),
            counted: Mutex::default(),
        })
    }

    #[getter]
    fn lights(&self) -> Vec<LightTuple> {
        self.lights.clone()
    }

    /// Answers: uint8, shape (points, lights), or as bits (lights, bytes).
    #[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        points: Rows<'py>,
        lights: Vec<u32>,
        normals: Option<Rows<'py>>,
        face_ids: Option<PyReadonlyArray1<'py, u32>>,
        on_surface: bool,
        tolerance: Option<f64>,
        was_single: bool,
        is_packed: bool,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let precision = match was_single {
            true => Precision::Single,
            false => Precision::Double,
        };
        let ask = Ask {
            index: self,
            lights: LightId::from_numbers(&lights),
            surfaces: face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?,
            on_surface,
            nearness: Nearness {
                precision,
                tolerance,
            },
            is_packed,
            threads,
            progress: Progress::new(progress),
        };
        match (&points, &normals) {
            (Rows::Double(points), None) => ask.occluded(py, points, None),
            (Rows::Double(points), Some(Rows::Double(normals))) => {
                ask.occluded(py, points, Some(normals))
            }
            (Rows::Single(points), None) => ask.occluded(py, points, None),
            (Rows::Single(points), Some(Rows::Single(normals))) => {
                ask.occluded(py, points, Some(normals))
            }
            _ => Err(of_two_types("points and normals")),
        }
    }

    /// Answers for segments: uint8, shape (points,).
    #[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
    fn occluded_segments<'py>(
        &self,
        py: Python<'py>,
        a: Rows<'py>,
        b: Rows<'py>,
        face_ids: Option<PyReadonlyArray1<'py, u32>>,
        tolerance: Option<f64>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
        let named = Named {
            surfaces,
            tolerance,
            progress: Progress::new(progress),
        };
        match (&a, &b) {
            (Rows::Double(a), Rows::Double(b)) => self.towards(py, a, b, &named, true, threads),
            (Rows::Single(a), Rows::Single(b)) => self.towards(py, a, b, &named, true, threads),
            _ => Err(of_two_types("a and b")),
        }
    }

    /// Answers for rays: uint8, shape (rays,).
    #[expect(clippy::too_many_arguments, reason = "named arguments in Python")]
    fn occluded_rays<'py>(
        &self,
        py: Python<'py>,
        origins: Rows<'py>,
        directions: Rows<'py>,
        face_ids: Option<PyReadonlyArray1<'py, u32>>,
        tolerance: Option<f64>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<u8>>> {
        let surfaces = face_ids.as_ref().map(|ids| ids.as_slice()).transpose()?;
        let named = Named {
            surfaces,
            tolerance,
            progress: Progress::new(progress),
        };
        match (&origins, &directions) {
            (Rows::Double(origins), Rows::Double(directions)) => {
                self.towards(py, origins, directions, &named, false, threads)
            }
            (Rows::Single(origins), Rows::Single(directions)) => {
                self.towards(py, origins, directions, &named, false, threads)
            }
            _ => Err(of_two_types("origins and directions")),
        }
    }

    /// How many of some points, spread over all, lie on a surface, and how many were looked at; `None` where that
    /// is as it should be for points of space.
    fn suspicious_share(
        &self,
        py: Python<'_>,
        points: Rows<'_>,
    ) -> PyResult<Option<(usize, usize)>> {
        let sample = match &points {
            Rows::Double(points) => {
                let points = rows::<f64, 3>(points, "points")?;
                py.detach(|| self.index.sample_on_surfaces(points))
            }
            Rows::Single(points) => {
                let points = rows::<f32, 3>(points, "points")?;
                py.detach(|| self.index.sample_on_surfaces(points))
            }
        };
        Ok(sample
            .is_suspicious()
            .then_some((sample.on_surface, sample.looked_at)))
    }

    /// Writes what is known of all lights; returns the bytes of the file, and how many voxels may still be
    /// refined.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<(u64, u64)> {
        let saved = stoppable(py, 0, |_| self.index.save(path))?;
        let saved = saved.map_err(|error| error.to_python())?;
        Ok((saved.bytes, saved.pending_count))
    }

    /// What the file of the index had of each light; empty without a file.
    #[getter]
    fn saved_lights(&self) -> Vec<&'static str> {
        let name = |saved: &SavedLight| match saved {
            SavedLight::Loaded => "loaded",
            SavedLight::Absent => "absent",
            SavedLight::NoRoom => "no room",
        };
        self.index.saved_lights().iter().map(name).collect()
    }

    /// What values know of points of space, in cells: uint8, shape (x, y, z, lights), with the lowest corner of
    /// all cells and their edge. `None` where there are no values.
    #[expect(clippy::type_complexity, reason = "a tuple for Python")]
    fn volume<'py>(
        &self,
        py: Python<'py>,
        resolution: u32,
    ) -> PyResult<Option<(Bound<'py, PyArray4<u8>>, [f64; 3], f64)>> {
        const MOST_BYTES: u64 = 4 << 30;
        let bytes = self.index.volume_bytes(resolution).unwrap_or(0);
        if bytes > MOST_BYTES {
            let message = format!("a volume of {bytes} bytes: expected at most {MOST_BYTES}");
            return Err(PyMemoryError::new_err(message));
        }
        let Some(volume) = stoppable(py, 0, |_| self.index.volume(resolution))? else {
            return Ok(None);
        };
        let [x, y, z] = volume.cells.map(|cells| cells as usize);
        let values = PyArray1::from_vec(py, volume.values);
        let values = values.reshape([x, y, z, volume.light_count])?;
        Ok(Some((values, volume.min.to_array(), volume.edge)))
    }

    /// What the index is and what was asked of it.
    fn stats<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let index = &self.index;
        let counted = *self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        let shadow = counted.counters.shadow;
        let decided = shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays;
        let stats = PyDict::new(py);
        stats.set_item("method", method_name(index.method()))?;
        stats.set_item("surfaces", index.occluders().surface_count())?;
        stats.set_item("lights", index.lights().len())?;
        stats.set_item("grid", index.grid_resolution())?;
        stats.set_item("prepare_seconds", self.prepare_seconds)?;
        stats.set_item("value_bytes", index.occlusion_bytes())?;
        stats.set_item("table_bytes", index.table_bytes())?;
        stats.set_item("memory_bytes", index.knowledge_bytes())?;
        stats.set_item("evictions", index.evictions())?;
        stats.set_item("lights_without_room", index.lights_without_room())?;
        stats.set_item("queries", decided + counted.facing_away)?;
        stats.set_item("facing_away", counted.facing_away)?;
        stats.set_item("first_pass", shadow.first_pass)?;
        stats.set_item("intermediate", shadow.intermediate)?;
        stats.set_item("blocker_list", shadow.blocker_list)?;
        stats.set_item("rays", shadow.rays)?;
        stats.set_item("shadowed", shadow.shadowed + counted.facing_away)?;
        Ok(stats)
    }
}

fn of_two_types(what: &str) -> PyErr {
    PyTypeError::new_err(format!("{what}: expected one dtype for both"))
}

impl ShadowIndex {
    pub(crate) fn count(&self, counted: &BatchCounters) {
        let mut sum = self.counted.lock().unwrap_or_else(PoisonError::into_inner);
        sum.counters.add(&counted.counters);
        sum.facing_away += counted.facing_away;
    }

    fn towards<'py, T: Element>(
        &self,
        py: Python<'py>,
        points: &PyReadonlyArray2<'py, T>,
        targets: &PyReadonlyArray2<'py, T>,
        named: &Named<'_>,
        are_ends: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray1<u8>>>
    where
        [T; 3]: Coordinates,
    {
        let (points, targets) = (rows(points, "a")?, rows::<T, 3>(targets, "b")?);
        let meant = Meant {
            normals: None,
            surfaces: named.surfaces,
            on_surface: false,
            nearness: Nearness {
                precision: <[T; 3]>::PRECISION,
                tolerance: named.tolerance,
            },
        };
        let out = PyArray1::<u8>::zeros(py, points.len(), false);
        let mut writable = out.readwrite();
        let answers = writable.as_slice_mut()?;
        let progress = &named.progress;
        let block = match progress.is_reported() {
            true => block_length(points.len()),
            false => points.len().max(1),
        };
        let answered = watched(py, threads, progress, |_| {
            let mut sum = BatchCounters::default();
            for (number, answers) in answers.chunks_mut(block).enumerate() {
                let part = number * block..number * block + answers.len();
                let towards = match are_ends {
                    true => Towards::Points(&targets[part.clone()]),
                    false => Towards::Directions(&targets[part.clone()]),
                };
                let (first, end) = (part.start, part.end);
                let meant = meant.part(part.clone());
                let batch = meant.batch(&points[part]);
                let counted = self.index.occluded_towards(&batch, towards, answers);
                let counted = counted.map_err(|error| (first, error))?;
                sum.counters.add(&counted.counters);
                sum.facing_away += counted.facing_away;
                progress.note("answering", end as u64, points.len() as u64);
            }
            Ok(sum)
        })?;
        let counted = answered.map_err(|(first, error): (usize, BatchError)| {
            meant.error(&self.index, points, (first, &error))
        })?;
        self.count(&counted);
        drop(writable);
        Ok(out)
    }
}

/// A question about points and lights of the index.
struct Ask<'a> {
    index: &'a ShadowIndex,
    lights: &'a [LightId],
    surfaces: Option<&'a [u32]>,
    on_surface: bool,
    nearness: Nearness,
    is_packed: bool,
    threads: usize,
    progress: Progress,
}

/// The surfaces that the starts of segments and rays name, perhaps.
struct Named<'a> {
    surfaces: Option<&'a [u32]>,
    tolerance: Option<f64>,
    progress: Progress,
}

impl Ask<'_> {
    /// Answers block by block and reports how far that is. Of a bad point, says in which block it is.
    fn in_blocks<T: Element>(
        &self,
        meant: &Meant<'_, T>,
        points: &[[T; 3]],
        answers: &mut [u8],
    ) -> Result<BatchCounters, (usize, BatchError)>
    where
        [T; 3]: Coordinates,
    {
        let index = &self.index.index;
        let (count, light_count) = (points.len(), self.lights.len());
        let block = block_length(count);
        let mut sum = BatchCounters::default();
        for first in (0..count).step_by(block) {
            let end = count.min(first + block);
            let part = meant.part(first..end);
            let batch = part.batch(&points[first..end]);
            let counted = if self.is_packed {
                let (bytes, stride) = ((end - first).div_ceil(8), count.div_ceil(8));
                let mut bits = vec![0; bytes * light_count];
                let counted = index.occluded_bits(&batch, self.lights, &mut bits);
                for light in 0..light_count {
                    answers[light * stride + first / 8..][..bytes]
                        .copy_from_slice(&bits[light * bytes..][..bytes]);
                }
                counted
            } else {
                let answers = &mut answers[first * light_count..end * light_count];
                index.occluded(&batch, self.lights, answers)
            };
            let counted = counted.map_err(|error| (first, error))?;
            sum.counters.add(&counted.counters);
            sum.facing_away += counted.facing_away;
            self.progress.note("answering", end as u64, count as u64);
        }
        Ok(sum)
    }

    fn occluded<'py, T: Element>(
        &self,
        py: Python<'py>,
        points: &PyReadonlyArray2<'py, T>,
        normals: Option<&PyReadonlyArray2<'py, T>>,
    ) -> PyResult<Bound<'py, PyArray2<u8>>>
    where
        [T; 3]: Coordinates,
    {
        let points = rows(points, "points")?;
        let normals = normals.map(|normals| rows(normals, "normals"));
        let meant = Meant::new(
            normals.transpose()?,
            self.surfaces,
            self.on_surface,
            self.nearness,
        );
        let light_count = self.lights.len();
        let shape = if self.is_packed {
            [light_count, points.len().div_ceil(8)]
        } else {
            [points.len(), light_count]
        };
        let out = PyArray2::<u8>::zeros(py, shape, false);
        let mut writable = out.readwrite();
        let answers = writable.as_slice_mut()?;
        let batch = meant.batch(points);
        let counted = watched(py, self.threads, &self.progress, |_| {
            let index = &self.index.index;
            if self.progress.is_reported() {
                self.in_blocks(&meant, points, answers)
            } else if self.is_packed {
                let counted = index.occluded_bits(&batch, self.lights, answers);
                counted.map_err(|error| (0, error))
            } else {
                let counted = index.occluded(&batch, self.lights, answers);
                counted.map_err(|error| (0, error))
            }
        })?;
        let counted = counted
            .map_err(|(first, error)| meant.error(&self.index.index, points, (first, &error)))?;
        self.index.count(&counted);
        drop(writable);
        Ok(out)
    }
}
