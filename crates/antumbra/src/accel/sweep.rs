//! Whether segments from a box to a light may meet another box, in `f64`.
//!
//! In: the boxes, the light. Out: `false` only where none of the segments meets the box. It serves where boxes lie
//! so far apart that `f32` in a frame of either says nothing.
//!
//! At `s`, from 0 at the starts to 1 at the light `L`, the segments are in the box `(1 - s) B + s L`. It meets a
//! box `N` along an axis where
//!
//! `s (L - min B) <= max N - min B` and `s (L - max B) >= min N - max B`;
//!
//! a light at infinity in direction `D` has `D` in the place of both differences, and `s` no end. Each of the
//! differences errs by less than `2^-52` of the largest coordinate. As `s` is at most 1 where the left ones are
//! rounded, `2^-48` of that coordinate beside the right ones covers all; quotients err by `2^-53` of themselves.

use antumbra_geometry::{Bounds, LightShape};

/// `2^-48`.
const ROOM: f64 = 1.0 / (1_u64 << 48) as f64;

/// Returns whether a segment from a start in a box to the light may meet another box.
#[inline]
pub(crate) fn may_meet(starts: &Bounds, light: &LightShape, bounds: &Bounds) -> bool {
    let light = light.without_underflow();
    let (mut enters, mut leaves) = match light {
        LightShape::Point(_) => (0.0_f64, 1.0_f64),
        LightShape::Direction(_) => (0.0, f64::INFINITY),
    };
    for axis in 0..3 {
        let (low, high) = (starts.min[axis], starts.max[axis]);
        let (min, max) = (bounds.min[axis], bounds.max[axis]);
        let mut size = low.abs().max(high.abs()).max(min.abs()).max(max.abs());
        let (from_low, from_high) = match light {
            LightShape::Point(light) => {
                size = size.max(light[axis].abs());
                (light[axis] - low, light[axis] - high)
            }
            LightShape::Direction(direction) => (direction[axis], direction[axis]),
        };
        let room = ROOM * size + f64::MIN_POSITIVE;
        let (upper, lower) = (max - low + room, min - high - room);
        // What is not a number, as the quotient of boxes without end, bounds nothing.
        if from_low > 0.0 {
            leaves = leaves.min(upper / from_low);
        } else if from_low < 0.0 {
            enters = enters.max(upper / from_low);
        } else if upper < 0.0 {
            return false;
        }
        if from_high > 0.0 {
            enters = enters.max(lower / from_high);
        } else if from_high < 0.0 {
            leaves = leaves.min(lower / from_high);
        } else if lower > 0.0 {
            return false;
        }
    }
    // An entry that overflows is one that is not known.
    enters == f64::INFINITY
        || enters * (1.0 - 8.0 * f64::EPSILON) <= leaves * (1.0 + 8.0 * f64::EPSILON)
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::DVec3;

    use super::*;
    use crate::occlusion::testing::Random;

    #[test]
    fn no_segment_that_meets_a_box_is_said_to_miss_it() {
        let random = &mut Random(9);
        let (mut met_count, mut missed_count) = (0, 0);
        for _ in 0..40_000 {
            let scale = random.pick(&[1e-200, 1.0, 1e8, 1e30]);
            let near = |random: &mut Random, reach: f64| {
                let center = scale * random.pick(&[0.0, 1.0, 1e6]) * random.of_cube();
                let half = DVec3::splat(scale * reach);
                Bounds {
                    min: center - half,
                    max: center + half,
                }
            };
            let reach = random.pick(&[0.0, 1e-3, 1.0]);
            let starts = near(random, reach);
            let bounds = near(random, 1.0);
            let start = starts.center() + 0.5 * starts.size() * random.of_cube();
            // Towards the box, past it, and anywhere.
            let aim =
                bounds.center() + random.pick(&[0.4, 0.5, 0.7]) * bounds.size() * random.of_cube();
            let light = match random.below(4) {
                0 => LightShape::Direction(random.of_cube()),
                1 => LightShape::Direction(aim - start),
                2 => LightShape::Point(aim),
                _ => LightShape::Point(start + 3.0 * (aim - start)),
            };
            let may = may_meet(&starts, &light, &bounds);
            // Points along the segment.
            let meets = (0..200).any(|step| {
                let t = f64::from(step) / 199.0;
                let point = match light {
                    LightShape::Point(light) => start + t * (light - start),
                    LightShape::Direction(direction) => {
                        let way = (aim - start).length() / direction.length().max(1e-300);
                        start + 2.0 * t * way * direction
                    }
                };
                bounds.contains(point)
            });
            assert!(may || !meets, "{starts:?} {light:?} {bounds:?}");
            met_count += u32::from(meets);
            missed_count += u32::from(!may);
        }
        assert!(
            met_count > 5_000 && missed_count > 2_000,
            "{met_count} {missed_count}"
        );
    }
}
