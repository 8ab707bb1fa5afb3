//! The quick check of Paper 7.3: is voxel occlusion testing worth its preparation?

use antumbra_geometry::Occluders;
use antumbra_task::checked;

use crate::accel::grid::Grid;

/// Verdict of the quick check of Paper 7.3.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct QuickCheckVerdict {
    /// Mean share of the grid's voxels that an element occupies, 0..1.
    pub occupied_share: f64,
    /// The share below which the check advises against.
    pub threshold: f64,
    /// Whether the check advises voxel occlusion testing.
    pub is_advised: bool,
}

/// The share of the grid below which the mean element is too small to darken whole voxels. With it
/// the paper's own loser (Tetra, 4096 small triangles) is advised against and its Flakes, two
/// orders above, are not.
const THRESHOLD: f64 = 1e-4;

/// Evaluates `1 / (n N^3) * sum of the voxels occupied by each element`.
///
/// The paper prints `n N^2`, but calls the result "a percentage of the total volume": only divided
/// by the number of voxels is it one.
pub(crate) fn quick_check(occluders: &Occluders, grid: &Grid) -> QuickCheckVerdict {
    let voxel_count = grid.layout.voxel_count();
    let mut occupied: u64 = 0;
    let mut in_voxel = Vec::new();
    for voxel in checked(0..voxel_count) {
        in_voxel.clear();
        in_voxel.extend(
            grid.surfaces(voxel)
                .iter()
                .map(|&surface| occluders.element_of(surface)),
        );
        in_voxel.sort_unstable();
        in_voxel.dedup();
        occupied += in_voxel.len() as u64;
    }
    let element_count = occluders.elements().len().max(1) as f64;
    let occupied_share = occupied as f64 / (element_count * voxel_count as f64);
    QuickCheckVerdict {
        occupied_share,
        threshold: THRESHOLD,
        is_advised: occupied_share >= THRESHOLD,
    }
}
