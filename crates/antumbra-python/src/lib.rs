//! The extension module `antumbra._antumbra`: what the Python package `antumbra` stands on.
//!
//! In: contiguous NumPy arrays, numbers, text, which the Python side has put in order (`python/antumbra`).
//! Out: new arrays, or Python exceptions. Invariants: no array is copied; the interpreter is free while work is
//! done; nothing is decided here, neither what a query means nor how it is answered.
//!
//! | module | what |
//! |---|---|
//! | `scene` | scenes from files and from arrays |
//! | `lights` | lights from Python's tuples and back |
//! | `area` | lights with size, visible fractions |
//! | `along` | segments of points: where a light reaches them |
//! | `directions` | directions that all points share, as bits |
//! | `sums` | weighted sums of bits |
//! | `index` | the shadow index, its settings and batches |
//! | `hits` | rays that ask what they meet |
//! | `picture` | rendering to arrays, PNG |
//! | `arrays` | NumPy arrays as slices of points |
//! | `work` | threads, Ctrl-C, the interpreter's lock |
//! | `error` | our errors as Python's |

mod along;
mod area;
mod arrays;
mod directions;
mod error;
mod glass;
mod hits;
mod index;
mod lights;
mod picture;
mod scene;
mod sums;
mod work;

use std::ffi::OsString;

use pyo3::prelude::*;

/// The extension module behind the package `antumbra`.
#[pymodule]
mod _antumbra {
    #[pymodule_export]
    use super::along::lit_intervals_along;
    #[pymodule_export]
    use super::area::ambient_occlusion;
    #[pymodule_export]
    use super::area::check_area_light;
    #[pymodule_export]
    use super::area::lit_intervals;
    #[pymodule_export]
    use super::area::sky_view_factor;
    #[pymodule_export]
    use super::area::visible_fraction;
    #[pymodule_export]
    use super::directions::lit_towards;
    #[pymodule_export]
    use super::glass::transmittance;
    #[pymodule_export]
    use super::hits::all_hits;
    #[pymodule_export]
    use super::hits::nearest_hits;
    #[pymodule_export]
    use super::index::ShadowIndex;
    #[pymodule_export]
    use super::lights::towards_sun;
    #[pymodule_export]
    use super::picture::Renderer;
    #[pymodule_export]
    use super::picture::stops_of;
    #[pymodule_export]
    use super::picture::to_srgb;
    #[pymodule_export]
    use super::picture::write_exr;
    #[pymodule_export]
    use super::picture::write_png;
    #[pymodule_export]
    use super::run;
    #[pymodule_export]
    use super::scene::Scene;
    #[pymodule_export]
    use super::sums::weighted_sums;
    #[pymodule_export]
    use super::version;
}

/// Runs the program on a command line, its name first, and returns its exit code. Takes over Ctrl-C.
#[pyfunction]
fn run(py: Python<'_>, command_line: Vec<OsString>) -> u8 {
    py.detach(|| antumbra_cli::run(command_line))
}

/// Returns the version of the package.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
