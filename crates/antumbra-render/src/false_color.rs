//! The picture of how shadow queries were decided: `--show occlusion`.
//!
//! In: what an eye ray saw first. Out: linear RGB. That surface is the first that is there at all:
//! holes and transparent texels are looked through, a pane that covers a little is not. Its
//! queries are colored and averaged over the lights:
//!
//! | color (sRGB) | query |
//! |---|---|
//! | green `#009e73` | first pass: the value of the start's voxel |
//! | blue `#56b4e9` | intermediate: the value of a voxel on the way |
//! | yellow `#f0e442` | blocker list |
//! | vermilion `#d55e00` | ray: a full walk with intersections |
//! | grey `#7a7a7a` | not asked: facing away |
//! | violet `#cc79a7` | not asked: outside the spot's cone |
//! | nearly black `#14141e` | the eye ray hits nothing |
//! | white | the scene has no light |
//! | light grey `#e6e6e6` | light with size: wholly visible |
//! | orange `#e69f00` | light with size: penumbra, some samples reach the point |
//! | dark blue `#0072b2` | light with size: umbra, none does |
//!
//! A light with size is looked at above the surface's own plane only: where the light rises through that plane
//! nothing is occluded.
//!
//! Shadowed points have a third of the brightness, so shadows stay visible. The hues are those of
//! Okabe and Ito, which readers with any color vision distinguish.

use antumbra::Shadow;
use antumbra_scene::model::Color;

use crate::aov::DecidedBy;
use crate::integrator::{AreaQuery, LightQuery, Region, Seen};

const FIRST_PASS: u32 = 0x009e73;
const INTERMEDIATE: u32 = 0x56b4e9;
const BLOCKER_LIST: u32 = 0xf0e442;
const RAY: u32 = 0xd55e00;
const FACING_AWAY: u32 = 0x7a7a7a;
const OUT_OF_CONE: u32 = 0xcc79a7;
const NO_HIT: u32 = 0x14141e;
const WHOLE: u32 = 0xe6e6e6;
const PENUMBRA: u32 = 0xe69f00;
const UMBRA: u32 = 0x0072b2;
const SHADOWED_SHARE: f64 = 1.0 / 3.0;

/// Returns the color of what an eye ray saw.
pub fn occlusion(seen: &Seen) -> Color {
    if !seen.is_surface {
        return linear(NO_HIT);
    }
    let count = seen.queries.len() + seen.areas.len();
    if count == 0 {
        return Color::ONE;
    }
    let sum = seen
        .queries
        .iter()
        .map(color_of)
        .chain(seen.areas.iter().map(color_of_area))
        .fold(Color::ZERO, |sum, color| sum + color);
    sum / count as f64
}

fn color_of_area(query: &AreaQuery) -> Color {
    linear(match query.region() {
        Region::FacingAway => FACING_AWAY,
        Region::Umbra => UMBRA,
        Region::Penumbra => PENUMBRA,
        Region::Lit => WHOLE,
    })
}

/// Returns the color of a way to decide, as of lit points.
pub fn decided_color(way: DecidedBy) -> Color {
    linear(match way {
        DecidedBy::BlockerList => BLOCKER_LIST,
        DecidedBy::FacingAway => FACING_AWAY,
        DecidedBy::FirstPass => FIRST_PASS,
        DecidedBy::Intermediate => INTERMEDIATE,
        DecidedBy::NoHit => NO_HIT,
        DecidedBy::OutOfCone => OUT_OF_CONE,
        DecidedBy::Ray => RAY,
    })
}

fn color_of(query: &LightQuery) -> Color {
    let color = decided_color(query.into());
    match query {
        LightQuery::Asked { answer, .. } if answer.shadow == Shadow::Shadowed => {
            SHADOWED_SHARE * color
        }
        _ => color,
    }
}

/// Returns the linear value of an sRGB color `0xRRGGBB`.
pub(crate) fn linear(srgb: u32) -> Color {
    let channel = |shift: u32| {
        let encoded = f64::from((srgb >> shift) & 0xff) / 255.0;
        if encoded <= 0.04045 {
            encoded / 12.92
        } else {
            libm::pow((encoded + 0.055) / 1.055, 2.4)
        }
    };
    Color::new(channel(16), channel(8), channel(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image_file::srgb_byte;

    #[test]
    fn colors_come_out_of_the_image_file_as_documented() {
        for srgb in [
            FIRST_PASS,
            INTERMEDIATE,
            BLOCKER_LIST,
            RAY,
            FACING_AWAY,
            OUT_OF_CONE,
            NO_HIT,
            WHOLE,
            PENUMBRA,
            UMBRA,
        ] {
            let bytes = linear(srgb).to_array().map(srgb_byte);
            let expected = [16, 8, 0].map(|shift| ((srgb >> shift) & 0xff) as u8);
            assert_eq!(bytes, expected, "{srgb:06x}");
        }
    }

    #[test]
    fn shadowed_is_darker_than_lit_for_every_way_of_deciding() {
        use antumbra::{Answer, Decided};
        for decided in [
            Decided::FirstPass,
            Decided::Intermediate,
            Decided::BlockerList,
            Decided::Ray,
        ] {
            let of = |shadow| {
                color_of(&LightQuery::Asked {
                    answer: Answer { shadow, decided },
                    cone_share: 1.0,
                })
            };
            assert!(of(Shadow::Shadowed).element_sum() < 0.5 * of(Shadow::Lit).element_sum());
        }
    }
}
