//! Subdivisions of the sky into patches of about equal solid angle.
//!
//! In: which subdivision. Out: the middles of its patches with their solid angles, from the horizon up, in each row from
//! north clockwise. Reinhart's subdivision of factor 1 is Tregenza's; rows and azimuths are those of Radiance's
//! `rh_init`, whose patch 0, the ground, is left out.

use std::f64::consts::PI;

use crate::suns::{Sun, SunKind, Suns};

/// Patches of the seven rows below the zenith (Tregenza, 1987).
const ROWS: [u32; 7] = [30, 30, 24, 24, 18, 12, 6];

/// Largest factor of Reinhart's subdivision: 36,865 patches.
pub const MOST_FACTOR: u32 = 16;

/// Returns the patches of Tregenza's sky, 145 of them.
pub fn tregenza() -> Suns {
    reinhart(1)
}

/// Returns the patches of Reinhart's sky: 144 times the square of `factor`, and one at the zenith. For 4, 2305.
///
/// # Panics
/// `factor` is 0 or above [`MOST_FACTOR`].
pub fn reinhart(factor: u32) -> Suns {
    assert!((1..=MOST_FACTOR).contains(&factor), "a factor in range");
    let mut sky = Suns::new(SunKind::Sky);
    // The cap around the zenith has half the height of a row.
    let height = 90.0 / (f64::from(ROWS.len() as u32 * factor) + 0.5);
    let sine = |rows: f64| (height * rows).to_radians().sin();
    for row in 0..ROWS.len() as u32 * factor {
        let count = ROWS[(row / factor) as usize] * factor;
        let low = f64::from(row);
        let solid = 2.0 * PI * (sine(low + 1.0) - sine(low)) / f64::from(count);
        for patch in 0..count {
            sky.push(Sun {
                azimuth: 360.0 * f64::from(patch) / f64::from(count),
                elevation: height * (low + 0.5),
                weight: solid,
                time: None,
                direct_normal: None,
            });
        }
    }
    let top = f64::from(ROWS.len() as u32 * factor);
    sky.push(Sun {
        azimuth: 0.0,
        elevation: 90.0,
        weight: 2.0 * PI * (1.0 - sine(top)),
        time: None,
        direct_normal: None,
    });
    sky
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_cover_the_hemisphere_once() {
        for (factor, count) in [(1, 145), (2, 577), (4, 2305), (16, 36_865)] {
            let sky = reinhart(factor);
            assert_eq!((sky.list.len(), sky.below_horizon), (count, 0));
            let solid: f64 = sky.list.iter().map(|patch| patch.weight).sum();
            assert!((solid - 2.0 * PI).abs() < 1e-10, "{factor}: {solid}");
            // A horizontal surface sees pi of projected solid angle; the middles know it up to their rows.
            let seen = |patch: &Sun| patch.weight * patch.elevation.to_radians().sin();
            let projected: f64 = sky.list.iter().map(seen).sum();
            let due = 0.01 / f64::from(factor * factor);
            assert!((projected / PI - 1.0).abs() < due, "{factor}: {projected}");
        }
    }

    #[test]
    fn rows_of_tregenza_lie_where_they_were_published() {
        let sky = tregenza();
        let row = |at: usize| (sky.list[at].azimuth, sky.list[at].elevation);
        assert_eq!(row(0), (0.0, 6.0));
        assert_eq!(row(1), (12.0, 6.0));
        assert_eq!(row(30), (0.0, 18.0));
        assert_eq!(row(61), (15.0, 30.0));
        assert_eq!(row(143), (300.0, 78.0));
        assert_eq!(row(144), (0.0, 90.0));
    }
}
