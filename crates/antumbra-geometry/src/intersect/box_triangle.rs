//! Conservative overlap of a triangle and a box.

use glam::DVec3;

use crate::Bounds;

/// Returns whether a triangle may meet the closed box: never `false` if it does, up to rounding
/// that the caller covers by inflating the box.
///
/// Separating axes: the box's three, the triangle's normal, and the nine products of edges.
pub(crate) fn box_meets_triangle(bounds: &Bounds, corners: [DVec3; 3]) -> bool {
    if !bounds.overlaps(&Bounds::of_points(corners)) {
        return false;
    }
    let center = bounds.center();
    let half = 0.5 * bounds.size();
    let seen = corners.map(|corner| corner - center);
    let edges = [seen[1] - seen[0], seen[2] - seen[1], seen[0] - seen[2]];
    let is_separating = |axis: DVec3| {
        let reach = half.dot(axis.abs());
        let heights = seen.map(|corner| corner.dot(axis));
        let low = heights[0].min(heights[1]).min(heights[2]);
        let high = heights[0].max(heights[1]).max(heights[2]);
        low > reach || high < -reach
    };
    if is_separating(edges[0].cross(edges[1])) {
        return false;
    }
    !edges.iter().any(|&edge| {
        [DVec3::X, DVec3::Y, DVec3::Z]
            .iter()
            .any(|&side| is_separating(side.cross(edge)))
    })
}
