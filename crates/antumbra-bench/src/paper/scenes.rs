//! The six scenes of the paper, and what its two tables say of each (Paper 8.1).

use antumbra_scene::model::Scene;
use serde::Serialize;

use antumbra_cli::failure::Failure;
use antumbra_cli::scene_source;

/// A scene of the paper.
#[derive(Debug)]
pub(super) struct PaperScene {
    /// As `antumbra scene` knows it.
    pub(super) name: &'static str,
    pub(super) paper: PaperRow,
}

/// A row of Table 1 and the row of the same name in Table 2, as printed.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct PaperRow {
    pub(super) lights: usize,
    /// Voxels along each axis.
    pub(super) grid: u32,
    pub(super) objects: usize,
    /// Seconds with voxel traversal.
    pub(super) voxel_s: f64,
    /// Seconds with voxel occlusion testing.
    pub(super) occlusion_s: f64,
    /// Shadow rays among all rays.
    pub(super) shadow_percent: u32,
    /// Queries that needed no shadow ray.
    pub(super) known_percent: u32,
    /// Traversals saved.
    pub(super) traversals: u64,
    /// Intersection tests saved.
    pub(super) intersections: u64,
    /// Queries decided on the way.
    pub(super) intermediate: u64,
}

impl PaperRow {
    /// Returns how much faster the paper's method was than voxel traversal.
    pub(super) fn speedup(&self) -> f64 {
        self.voxel_s / self.occlusion_s
    }
}

impl PaperScene {
    /// Makes the scene.
    pub(super) fn make(&self) -> Result<Scene, Failure> {
        // Tetra's default size is the paper's.
        scene_source::generate(self.name, None, None)
    }
}

/// All of them, in the order of the paper's tables.
#[rustfmt::skip]
pub(super) const ALL: [PaperScene; 6] = [
    scene("graph",   [2, 40, 12],   [1518.2, 1220.3], [63, 58], [11_209_198, 347_883, 129_073]),
    scene("quadric", [3, 50, 15],   [1057.2, 880.6],  [54, 67], [7_071_098, 333_625, 44_227]),
    scene("dgp",     [1, 20, 21],   [797.5, 658.7],   [41, 74], [7_016_086, 174_635, 13_138]),
    scene("bars",    [1, 30, 88],   [1419.6, 1052.6], [49, 68], [662_781, 14_314_895, 16_099]),
    scene("flakes",  [3, 50, 92],   [3234.7, 2970.9], [70, 36], [1_066_370, 21_094_921, 214_037]),
    scene("tetra",   [1, 40, 4096], [747.5, 985.1],   [10, 1],  [12_872, 97_692, 10_756]),
];

const fn scene(
    name: &'static str,
    [lights, grid, objects]: [u32; 3],
    [voxel_s, occlusion_s]: [f64; 2],
    [shadow_percent, known_percent]: [u32; 2],
    [traversals, intersections, intermediate]: [u64; 3],
) -> PaperScene {
    PaperScene {
        name,
        paper: PaperRow {
            lights: lights as usize,
            grid,
            objects: objects as usize,
            voxel_s,
            occlusion_s,
            shadow_percent,
            known_percent,
            traversals,
            intersections,
            intermediate,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_scenes() {
        assert_eq!(ALL.map(|scene| scene.name), crate::typed::PAPER_SCENES);
    }

    #[test]
    fn the_scenes_have_the_papers_counts() {
        for paper_scene in &ALL {
            let scene = paper_scene.make().unwrap();
            let PaperRow {
                lights, objects, ..
            } = paper_scene.paper;
            let found = (scene.objects.len(), scene.lights.len());
            assert_eq!(found, (objects, lights), "{}", paper_scene.name);
        }
    }
}
