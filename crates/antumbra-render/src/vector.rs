//! The one vector helper that everything here needs: lengths that neither overflow nor vanish.

use antumbra_geometry::DVec3;

/// Returns `vector` with length one, or `None` if it is zero or not finite.
///
/// Scaling by the largest coordinate first keeps squares in range for every finite input.
pub(crate) fn unit(vector: DVec3) -> Option<DVec3> {
    let scale = vector.abs().max_element();
    if !(scale > 0.0 && vector.is_finite()) {
        return None;
    }
    let scaled = vector / scale;
    Some(scaled / scaled.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extreme_lengths_have_a_direction_and_zero_has_none() {
        for scale in [f64::MIN_POSITIVE, 1e-200, 1.0, 1e200, f64::MAX] {
            assert_eq!(
                unit(DVec3::new(0.0, -scale, 0.0)),
                Some(DVec3::NEG_Y),
                "{scale}"
            );
        }
        assert_eq!(unit(DVec3::ZERO), None);
        assert_eq!(unit(DVec3::new(f64::NAN, 1.0, 0.0)), None);
        assert_eq!(unit(DVec3::new(f64::INFINITY, 1.0, 0.0)), None);
    }
}
