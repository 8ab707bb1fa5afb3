//! Bounds of the filter's errors.

/// `2^-24`.
pub(super) const U: f64 = 1.0 / (1u64 << 24) as f64;

/// How far boxes are moved outwards beside the margin.
pub(super) const PLANE_ROOM: f64 = 10.01 * U;

/// Error bounds of the filters, for rays whose direction is no worse than usual; derived in `filter`.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilterBounds {
    /// Of the edge signs `ab` and `ca`, times the triangle's reach.
    pub(super) edge: f32,
    /// What scales the third edge sign, `bc`, to the same bound.
    pub(super) third_edge_scale: f32,
    /// Of the start's height over the plane, times the reach squared.
    pub(super) height: f32,
    /// What scales the light's height to the same bound.
    pub(super) light_height_scale: f32,
    /// Of the distance of a sphere's centre from the line, times the direction's length.
    pub(super) line: f32,
}

impl FilterBounds {
    /// `margin` is the frame's, `origin_error` that of the start in lengths of the direction.
    pub(super) fn new(margin: f64, origin_error: f64) -> Self {
        // Of a corner seen from the start, and of a component of the direction.
        let position = 5.0 * U + 1.01 * margin;
        let direction = 2.01 * U + SMALLEST_COMPONENT + origin_error;
        // Two percent more than derived, for the rounding of the bounds themselves.
        let generous = |bound: f64| (bound * 1.02) as f32;
        let edge = 12.0 * direction + 12.0 * position + 136.0 * U;
        let third_edge = 36.0 * direction + 24.0 * position + 576.0 * U;
        let height = 6.0 * position + 80.0 * U;
        let light_height = 6.0 * position + 15.5 * direction + 404.0 * U;
        Self {
            edge: generous(edge),
            third_edge_scale: (0.98 * edge / third_edge) as f32,
            height: generous(height),
            light_height_scale: (0.98 * height / light_height) as f32,
            line: generous(7.0 * direction + 7.0 * position + 100.0 * U),
        }
    }
}

/// `2^-40`.
pub(super) const SMALLEST_COMPONENT: f64 = 1.0 / (1u64 << 40) as f64;
