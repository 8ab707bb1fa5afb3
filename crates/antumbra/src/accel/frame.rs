//! A unit of the scene's own, for `f32`.

use antumbra_geometry::{Bounds, DVec3};

use crate::accel::grid::Layout;

/// The unit of `f32` arithmetic: the scene's box, with room for every rounding, scaled into
/// `[-1, 1]^3`. The scale is a power of two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) center: DVec3,
    pub(crate) scale: f64,
    /// What starts and surfaces may be off, in world units (EXACTNESS.md, "What accelerators may
    /// assume"): the grid's margin.
    pub(crate) margin: f64,
    /// The same in this frame's units.
    pub(crate) margin_in_frame: f64,
}

impl Frame {
    pub(crate) fn new(scene: Bounds) -> Self {
        // The grid knows the margin.
        let margin = Layout::margin_of(&scene);
        let scene = if scene.is_empty() {
            Bounds {
                min: DVec3::ZERO,
                max: DVec3::ZERO,
            }
        } else {
            scene
        };
        let half_size = 0.5 * scene.size().max_element() + 8.0 * margin;
        // The largest power of two that keeps the half size at most 1.
        let scale = 2.0_f64.powi(-(half_size.log2().ceil() as i32));
        let scale = if half_size * scale > 1.0 {
            0.5 * scale
        } else {
            scale
        };
        Self {
            center: scene.center(),
            scale,
            margin,
            margin_in_frame: margin * scale,
        }
    }

    /// Returns everything that it is, bit by bit.
    pub(crate) fn identity(&self) -> [u64; 5] {
        let Self {
            center,
            scale,
            margin,
            ..
        } = *self;
        [center.x, center.y, center.z, scale, margin].map(f64::to_bits)
    }

    /// Returns how far a start may lie from where a ray takes it to be, in world units.
    #[inline(always)]
    pub(crate) fn margin_of_starts(&self) -> f64 {
        0.25 * self.margin
    }

    /// Returns a point in the frame's units.
    pub(crate) fn point_in_frame(&self, point_in_world: DVec3) -> DVec3 {
        (point_in_world - self.center) * self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_holds_the_scene() {
        for (low, size) in [
            (0.0, 1.0),
            (-3.0, 6.0),
            (5e6, 100.0),
            (0.0, 2.0_f64.powi(-400)),
            (-1e30, 2e30),
            (7.0, 0.0),
        ] {
            let min = DVec3::splat(low);
            let max = DVec3::new(low + size, low, low + 0.5 * size);
            let frame = Frame::new(Bounds { min, max });
            for corner in [min, max] {
                let reach =
                    frame.point_in_frame(corner).abs().max_element() + 7.0 * frame.margin_in_frame;
                assert!(reach <= 1.0, "{low} {size}: {reach}");
            }
        }
    }
}
