//! Our methods, as the tables name them.

use std::time::Duration;

use antumbra::{IndexOptions, Method, RayMethod, Refine};
use antumbra_baselines::rival::formulas::{self, PaperMemory};
use antumbra_baselines::{IndexMethod, RivalError};
use antumbra_geometry::DVec3;
use antumbra_scene::gather::{Gathered, light_shapes};
use antumbra_scene::model::Light;

use antumbra_cli::failure::Failure;
use antumbra_cli::memory;
use antumbra_cli::methods::Shadows;
use antumbra_cli::typed::IndexCost;

use super::contender::Contender;
use super::measure::Stopwatch;
use super::report::Preparation;

/// Rows that exist for every scene in the JSON, `null` where there is no such method.
pub(super) const KEYS: [&str; 13] = [
    "auto_warm_ns",
    "auto_cold_ns",
    "voxel_warm_ns",
    "voxel_1990_ns",
    "grid_ns",
    "bvh_ns",
    "light_buffer_ns",
    "hybrid_ns",
    "shadow_volumes_ns",
    "shadow_map_ns",
    "embree_ns",
    "embree8_ns",
    "embree16_ns",
];

/// Returns the methods to measure: those typed, or all of ours that a user would choose for speed.
pub(super) fn chosen(typed: &[Contender]) -> Vec<Contender> {
    if typed.is_empty() {
        let is_for_speed = |method: &Shadows| *method != Shadows::Naive;
        let methods = Shadows::ALL.into_iter().filter(is_for_speed);
        methods.map(Contender::Ours).collect()
    } else {
        typed.to_vec()
    }
}

/// Returns a method's key in the JSON. What `auto` and `voxel` know is there when sets are measured.
pub(super) fn key(name: &str) -> String {
    match name {
        "auto" | "voxel" => format!("{name}_warm_ns"),
        other => format!("{}_ns", other.replace('-', "_")),
    }
}

/// A method of ours or a rival, built.
pub(super) struct Built {
    pub(super) method: IndexMethod,
    pub(super) preparation: Duration,
    /// What the index was predicted to take while it was built.
    pub(super) predicted_bytes: u64,
}

impl Built {
    /// Returns what came before the first query, and what it has grown to by now.
    pub(super) fn preparation(&self) -> Preparation {
        let index = self.method.index();
        Preparation {
            seconds: self.preparation.as_secs_f64(),
            table_bytes: Some(index.table_bytes()),
            value_bytes: Some(index.occlusion_bytes()),
            bytes_per_light: Some(self.method.bytes_per_light()),
            paper: self.paper_memory(),
            predicted_bytes: Some(self.predicted_bytes),
        }
    }
}

impl Built {
    /// Returns what the paper expects it to keep for a light, where it says.
    fn paper_memory(&self) -> Option<PaperMemory> {
        let index = self.method.index();
        match self.method.rival() {
            Some(rival) => rival.paper_memory(index),
            None => (index.method() == Method::Voxel1990)
                .then(|| formulas::voxel_occlusion(index.grid_resolution())),
        }
    }
}

/// Explains that a rival needs more memory than it may take.
pub(super) fn failure(error: RivalError) -> Failure {
    Failure::input(
        error.to_string(),
        "raise --memory-limit, or choose another method",
    )
}

/// Builds the methods one after the other.
pub(super) fn build(
    methods: &[Contender],
    gathered: &Gathered,
    lights: &[Light],
    viewpoint: Option<DVec3>,
    cost: &IndexCost,
    stopwatch: Stopwatch,
) -> Result<Vec<Built>, Failure> {
    let mut memory_left = memory::limit(cost.memory_limit);
    let mut all = Vec::new();
    for contender in methods {
        let options = IndexOptions {
            method: contender.method(),
            // Nobody asks for nearest hits: `bvh` and `voxel` get the tree alone, the others the grid alone.
            rays: match contender.method() {
                Method::Bvh | Method::Voxel => RayMethod::Bvh,
                _ => RayMethod::Grid,
            },
            grid: cost.grid.unwrap_or_default(),
            refinement: cost.refinement(Refine::Lazy),
            memory_limit: memory_left,
            ..IndexOptions::default()
        };
        let predicted_bytes = options
            .predict(gathered.occluders(), lights.len(), None)?
            .total();
        let (method, preparation) = stopwatch.time(|| -> Result<_, Failure> {
            let index = options.build(gathered.occluders(), light_shapes(lights))?;
            let rival = contender.rival(&index, viewpoint, memory_left);
            Ok(match rival.map_err(failure)? {
                Some(rival) => IndexMethod::of_rival(rival, index),
                None => IndexMethod::new(contender.name(), index),
            })
        });
        let method = method?;
        memory_left = memory_left.saturating_sub(predicted_bytes);
        if method.rival().is_some() {
            memory_left = memory_left.saturating_sub(method.bytes_per_light() as u64);
        }
        all.push(Built {
            method,
            preparation,
            predicted_bytes,
        });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use antumbra_baselines::RivalKind;

    use super::*;

    #[test]
    fn every_method_has_a_row() {
        let rivals = RivalKind::ALL.map(Contender::Rival);
        for contender in chosen(&[]).into_iter().chain(rivals) {
            let key = key(contender.name());
            assert!(KEYS.contains(&key.as_str()), "{key}");
        }
        assert_eq!(key("voxel"), "voxel_warm_ns");
        assert_eq!(key("auto"), "auto_warm_ns");
    }
}
