//! What was found: the layout of `--json`, which tables and report are made of.

use std::collections::BTreeMap;

use antumbra_baselines::rival::formulas::PaperMemory;
use serde::Serialize;

use super::scenes::PaperRow;
use crate::head::Head;

/// Everything.
#[derive(Debug, Serialize)]
pub(super) struct Figures {
    #[serde(flatten)]
    pub(super) head: Head,
    /// Whether nothing is missing: not after Ctrl-C.
    pub(super) is_complete: bool,
    pub(super) scenes: Vec<SceneFigures>,
    pub(super) sweeps: Vec<Sweep>,
}

/// One scene at the paper's grid.
#[derive(Debug, Serialize)]
pub(super) struct SceneFigures {
    pub(super) name: String,
    pub(super) objects: usize,
    pub(super) lights: usize,
    /// Voxels along each axis.
    pub(super) grid: u32,
    /// Shadow rays among all rays with plain traversal, 0..1.
    pub(super) shadow_ray_share: f64,
    /// Shadow queries asked in one picture: those of surfaces that face away are not.
    pub(super) queries: u64,
    /// Of `queries`, those found in shadow, 0..1.
    pub(super) shadowed_share: f64,
    /// The same picture of the scene without lights: eye rays and mirrored rays alone.
    pub(super) without_lights_s: f64,
    /// Pictures that were not, byte for byte, the plain grid's. Must be 0.
    pub(super) different_pictures: u32,
    pub(super) quick_check: Option<QuickCheckFigures>,
    /// By the method's name.
    pub(super) methods: BTreeMap<String, MethodFigures>,
    pub(super) paper: PaperRow,
}

/// The quick check of Paper 7.3.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct QuickCheckFigures {
    /// Mean share of the voxels that an element occupies, 0..1.
    pub(super) occupied_share: f64,
    /// The share below which it advises against.
    pub(super) threshold: f64,
    /// Whether it advises voxel occlusion testing as published.
    pub(super) is_advised: bool,
    /// Whether that was faster, just if it was advised.
    pub(super) is_right: bool,
}

/// One method on one scene. Times are medians over the rounds, in seconds of one core.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct MethodFigures {
    /// Preparing and rendering, cold.
    pub(super) total_s: f64,
    pub(super) prepare_s: f64,
    pub(super) render_s: f64,
    /// `total_s` less that of the picture without lights.
    pub(super) shadow_s: f64,
    /// The middle half of the rounds' totals over the median.
    pub(super) spread: f64,
    /// Time of plain traversal over this method's, median of the rounds' ratios.
    pub(super) speedup: f64,
    /// Queries that needed no shadow ray, by the start's voxel or a blocker list, 0..1; for `voxel` with
    /// all values made before.
    pub(super) known_share: f64,
    /// Of those, the queries for which no surface was tested either, 0..1 of all.
    pub(super) value_share: f64,
    /// `known_share` in the picture that is timed, whose values are made meanwhile.
    pub(super) first_known_share: f64,
    /// Queries decided by the value of a voxel on the way.
    pub(super) intermediate: u64,
    /// Voxels and nodes entered, all rays.
    pub(super) steps: u64,
    /// Surfaces tested, all rays.
    pub(super) intersections: u64,
    /// `steps` of plain traversal less these; negative where there are more.
    pub(super) steps_saved: i64,
    pub(super) intersections_saved: i64,
    /// What is kept for shadow queries.
    pub(super) bytes_per_light: f64,
    /// What the paper expects, where it says.
    pub(super) paper_memory: Option<PaperMemory>,
    /// Rendering the same picture with all values made before, for `voxel`.
    pub(super) second_render_s: Option<f64>,
}

/// How the times change with one setting.
#[derive(Debug, Serialize)]
pub(super) struct Sweep {
    /// `grid`, `size`, `lights`, or `rooms` for lights of another scene.
    pub(super) of: &'static str,
    pub(super) scene: String,
    pub(super) points: Vec<SweepPoint>,
}

/// All methods at one value of the setting.
#[derive(Debug, Serialize)]
pub(super) struct SweepPoint {
    pub(super) at: u32,
    /// Preparing and rendering, by the method's name.
    pub(super) total_s: BTreeMap<String, f64>,
}
