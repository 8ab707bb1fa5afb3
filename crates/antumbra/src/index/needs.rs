//! What settings ask for.

use antumbra_geometry::{Bounds, DVec3, LightId, LightShape, Occluders};

use super::refused::BuildError;
use crate::accel::grid::{Layout, affordable_resolution};
use crate::limits::LARGEST;
use crate::occlusion::Knowledge;
use crate::{GridResolution, Method, RayMethod};

/// Returns whether the settings ask for the grid.
pub(super) fn needs_grid(method: Method, rays: RayMethod) -> bool {
    matches!(method, Method::Voxel1990 | Method::Grid)
        || rays == RayMethod::Grid
        || !needs_bvh(method, rays)
}

pub(super) fn check_light(id: LightId, light: &LightShape) -> Result<(), BuildError> {
    let (x, weight) = light.homogeneous();
    let is_fine =
        x.is_finite() && x.abs().max_element() <= LARGEST && (weight != 0.0 || x != DVec3::ZERO);
    if is_fine {
        Ok(())
    } else {
        Err(BuildError::BadLight { light: id })
    }
}

/// Returns whether the settings ask for the tree.
pub(super) fn needs_bvh(method: Method, rays: RayMethod) -> bool {
    matches!(method, Method::Bvh | Method::Voxel | Method::Auto) || rays == RayMethod::Bvh
}

/// Returns what lights know with a method.
pub(super) fn knowledge(method: Method) -> Option<Knowledge> {
    match method {
        Method::Auto => Some(Knowledge::Maps),
        Method::Voxel => Some(Knowledge::Values),
        _ => None,
    }
}

pub(super) fn layout(
    occluders: &Occluders,
    bounds: Bounds,
    resolution: GridResolution,
) -> Result<Layout, BuildError> {
    let resolution = match resolution {
        GridResolution::Automatic => {
            let usual = Layout::automatic_resolution(bounds, occluders.elements().len());
            affordable_resolution(occluders, bounds, usual)
        }
        GridResolution::Fixed(resolution) => resolution,
    };
    // Voxels are numbered in 32 bits. Axes within their range cannot overflow the product.
    let is_fine = resolution.iter().all(|n| (1..=2048).contains(n))
        && resolution.iter().map(|&n| u64::from(n)).product::<u64>() < u64::from(u32::MAX);
    if is_fine {
        Ok(Layout::new(bounds, resolution))
    } else {
        Err(BuildError::BadResolution(resolution))
    }
}
