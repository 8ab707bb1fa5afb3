//! Lights as typed: `point:`, `sun:`, `spot:`, and lights with size.
//!
//! In: the text after `--light`. Out: a [`LightValue`], finite and valid. Every error text says what was expected.

use antumbra_geometry::{
    AreaError, AreaShape, DVec3, DiskLight, RectangleLight, SegmentLight, Short, Sky, SphereLight,
    SunDisc,
};
use antumbra_scene::defaults;
use antumbra_scene::model::{AreaLight, Color, Light, LightKind};

use crate::values::{self, PointLight, Sun, number, numbers, triple};

/// The patterns of `--light`.
pub const PATTERNS: &str = "point:X,Y,Z; sun:AZIMUTH,ELEVATION in degrees; spot:X,Y,Z/AXIS/INNER,OUTER with half-angles in degrees; with size \
     area:CENTER/EDGE1/EDGE2, disk:CENTER/NORMAL/RADIUS, sphere:X,Y,Z,RADIUS, segment:END/END, sun:AZIMUTH,ELEVATION,DIAMETER, sky or sky:R,G,B";

/// The kind of light that needs no more than its name.
const SKY: &str = "sky";

/// A light as typed.
#[derive(Clone, Debug, PartialEq)]
pub enum LightValue {
    Point(PointLight),
    Spot {
        kind: LightKind,
        color: Color,
    },
    Area {
        shape: AreaShape,
        color: Color,
    },
    /// Which way is up, the scene says.
    Sky {
        color: Color,
    },
    /// As with the sky.
    Sun {
        sun: Sun,
        color: Color,
    },
}

/// A light as typed where lights of the scene can be chosen.
#[derive(Clone, Debug, PartialEq)]
pub enum LightChoice {
    /// One of the scene's, by name.
    Named(String),
    /// Another.
    Typed(LightValue),
}

/// A light of the scene, of either kind.
pub enum SceneLight {
    Plain(Light),
    Area(AreaLight),
}

impl LightValue {
    /// Returns the light for a scene.
    pub fn into_light(self, name: String, up: DVec3) -> Result<SceneLight, AreaError> {
        let plain = |name, kind, color| {
            SceneLight::Plain(Light {
                name,
                kind,
                color,
                falls_off: false,
            })
        };
        let area = |name, shape, color| {
            SceneLight::Area(AreaLight {
                name,
                shape,
                color,
                falls_off: false,
            })
        };
        Ok(match self {
            Self::Point(PointLight { position, color }) => {
                plain(name, LightKind::Point { position }, color)
            }
            Self::Spot { kind, color } => plain(name, kind, color),
            Self::Area { shape, color } => area(name, shape, color),
            Self::Sky { color } => area(name, AreaShape::Sky(Sky::new(up)?), color),
            Self::Sun { sun, color } => {
                let (azimuth, elevation) = (sun.azimuth_degrees, sun.elevation_degrees);
                let towards_light = defaults::towards_sun(azimuth, elevation, up);
                match sun.diameter_degrees {
                    None => plain(name, LightKind::Directional { towards_light }, color),
                    Some(diameter) => {
                        let disc = SunDisc::new(towards_light, diameter)?;
                        area(name, AreaShape::SunDisc(disc), color)
                    }
                }
            }
        })
    }

    /// Returns whether the light has a size.
    pub fn has_size(&self) -> bool {
        match self {
            Self::Point(_) | Self::Spot { .. } => false,
            Self::Area { .. } | Self::Sky { .. } => true,
            Self::Sun { sun, .. } => sun.diameter_degrees.is_some(),
        }
    }

    /// Returns the sun, if the light is one.
    pub fn sun(&self) -> Option<Sun> {
        match self {
            Self::Sun { sun, .. } => Some(*sun),
            _ => None,
        }
    }
}

/// Reads a light's name, or a light of any kind.
pub fn light_choice(text: &str) -> Result<LightChoice, String> {
    const KINDS: [&str; 8] = [
        "point", "sun", "spot", "area", "disk", "sphere", "segment", SKY,
    ];
    let kind = text.split_once(':').map(|(kind, _)| kind);
    // Names may have colons.
    if kind.is_some_and(|kind| KINDS.contains(&kind)) || text.trim() == SKY {
        return light(text).map(LightChoice::Typed);
    }
    Ok(LightChoice::Named(text.to_owned()))
}

/// Reads a light of any kind.
pub fn light(text: &str) -> Result<LightValue, String> {
    let Some((kind, rest)) = text.split_once(':') else {
        // The only kind that needs nothing else.
        if text.trim() == SKY {
            return Ok(LightValue::Sky { color: Color::ONE });
        }
        return Err(format!("expected {PATTERNS}"));
    };
    let mut parts: Vec<&str> = rest.split('/').collect();
    let kind = kind.trim();
    match kind {
        "point" => return values::light(text).map(LightValue::Point),
        SKY => {
            let color = match rest.trim() {
                "" => Color::ONE,
                color => color_of(color)?,
            };
            return Ok(LightValue::Sky { color });
        }
        _ => {}
    }
    let is_flat = ["area", "disk"].contains(&kind);
    let is_two_sided = is_flat && parts.last().is_some_and(|part| part.trim() == "both");
    if is_two_sided {
        parts.pop();
    }
    let (pattern, needed) = match kind {
        "sun" => ("sun:AZIMUTH,ELEVATION[,DIAMETER][/R,G,B]", 1),
        "spot" => ("spot:X,Y,Z/AXIS/INNER,OUTER[/R,G,B]", 3),
        "area" => ("area:CENTER/EDGE1/EDGE2[/R,G,B][/both]", 3),
        "disk" => ("disk:CENTER/NORMAL/RADIUS[/R,G,B][/both]", 3),
        "sphere" => ("sphere:X,Y,Z,RADIUS[/R,G,B]", 1),
        "segment" => ("segment:END/END[/R,G,B]", 2),
        other => {
            return Err(format!(
                "unknown kind of light `{other}`; expected {PATTERNS}"
            ));
        }
    };
    let color = match parts.len().checked_sub(needed) {
        Some(0) => Color::ONE,
        Some(1) => color_of(parts[needed])?,
        _ => {
            return Err(format!(
                "expected {pattern}, found {} parts in `{text}`",
                parts.len()
            ));
        }
    };
    let shape = match kind {
        "sun" => {
            let sun = values::sun_with_size(parts[0])?;
            return Ok(LightValue::Sun { sun, color });
        }
        "spot" => {
            return Ok(LightValue::Spot {
                kind: spot(&parts)?,
                color,
            });
        }
        "area" => {
            let edges = [triple(parts[1])?, triple(parts[2])?];
            RectangleLight::new(triple(parts[0])?, edges, is_two_sided).map(AreaShape::Rectangle)
        }
        "disk" => {
            let [center, normal] = [triple(parts[0])?, triple(parts[1])?];
            DiskLight::new(center, normal, number(parts[2])?, is_two_sided).map(AreaShape::Disk)
        }
        "sphere" => {
            let [x, y, z, radius] = numbers::<4>(parts[0], "X,Y,Z,RADIUS")?;
            SphereLight::new(DVec3::new(x, y, z), radius).map(AreaShape::Sphere)
        }
        _ => {
            let ends = [triple(parts[0])?, triple(parts[1])?];
            SegmentLight::new(ends).map(AreaShape::Segment)
        }
    };
    let shape = shape.map_err(|error| format!("`{text}` is no light: {error}"))?;
    Ok(LightValue::Area { shape, color })
}

fn color_of(text: &str) -> Result<Color, String> {
    let color = Color::from(numbers::<3>(text, "R,G,B")?);
    if color.min_element() < 0.0 {
        return Err("a light's color must not be negative".into());
    }
    Ok(color)
}

fn spot(parts: &[&str]) -> Result<LightKind, String> {
    let [position, axis] = [triple(parts[0])?, triple(parts[1])?];
    if axis == DVec3::ZERO {
        return Err("the axis of a spot is zero; expected a direction away from the light".into());
    }
    let [inner, outer] = numbers::<2>(parts[2], "INNER,OUTER half-angles in degrees")?;
    if !(outer > 0.0 && outer <= 90.0 && (0.0..=outer).contains(&inner)) {
        return Err(format!(
            "the half-angles are {} and {}; expected 0 <= INNER <= OUTER <= 90 degrees, OUTER above 0",
            Short(inner),
            Short(outer)
        ));
    }
    Ok(LightKind::Spot {
        position,
        axis,
        inner_cosine: libm::cos(inner.to_radians()),
        outer_cosine: libm::cos(outer.to_radians()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_light_is_read() {
        let kind = |text: &str| match light(text).unwrap() {
            LightValue::Area { shape, .. } => shape.kind(),
            LightValue::Sky { .. } => "sky",
            LightValue::Sun { .. } => "sun",
            LightValue::Spot { .. } => "spot",
            LightValue::Point(_) => "point",
        };
        assert_eq!(kind("point:1,2,3/1,0,0"), "point");
        assert_eq!(kind("spot:0,0,4/0,0,-1/20,30"), "spot");
        assert_eq!(kind("area:0,0,4/1,0,0/0,1,0"), "rectangle");
        assert_eq!(kind("area:0,0,4/1,0,0/0,1,0/.5,1,2/both"), "rectangle");
        assert_eq!(kind("disk:0,0,4/0,0,-1/0.5/both"), "disk");
        assert_eq!(kind("sphere:0,0,4,0.5"), "sphere");
        assert_eq!(kind("segment:0,0,4/1,0,4/1,1,0"), "segment");
        assert_eq!(kind("sun:180,45/1,1,0.5"), "sun");
        let has_size = |text: &str| light(text).unwrap().has_size();
        assert!(has_size("sun:180,45,0.53") && !has_size("sun:180,45") && has_size("sky"));
        assert_eq!(kind("sky:"), "sky");
        assert_eq!(light("sky"), light("sky:1,1,1"));
        assert_eq!(kind("sky:.2,.3,.4"), "sky");
        let Ok(LightValue::Area { shape, color }) = light("area:0,0,4/1,0,0/0,1,0/.5,1,2/both")
        else {
            panic!("no light with size");
        };
        assert_eq!(color, Color::new(0.5, 1.0, 2.0));
        assert!(matches!(shape, AreaShape::Rectangle(light) if light.is_two_sided()));
    }

    #[test]
    fn light_choices() {
        let named = |name: &str| Ok(LightChoice::Named(name.to_owned()));
        assert_eq!(light_choice("lamp:1"), named("lamp:1"));
        assert_eq!(light_choice("area"), named("area"));
        for text in ["point:1,2,3", "area:0,0,4/1,0,0/0,1,0", "sky:", "sky"] {
            assert_eq!(light_choice(text), light(text).map(LightChoice::Typed));
        }
        assert!(light_choice("point:1,2").is_err());
        assert!(light_choice("area:0,0,4").is_err());
    }

    #[test]
    fn what_is_no_light_is_refused_with_a_reason() {
        let errors = [
            ("1,2,3", "expected point:X,Y,Z; sun:"),
            (
                "lamp:1,2,3",
                "unknown kind of light `lamp`; expected point:X,Y,Z; sun:",
            ),
            (
                "area:0,0,4/1,0,0",
                "expected area:CENTER/EDGE1/EDGE2[/R,G,B][/both], found 2 parts in `area:0,0,4/1,0,0`",
            ),
            (
                "area:0,0,4/1,0,0/2,0,0",
                "`area:0,0,4/1,0,0/2,0,0` is no light: it has no area: use a point or directional light",
            ),
            (
                "area:0,0,4/1,0,0/0,nan,0",
                "expected a finite number, found `nan`",
            ),
            (
                "sphere:0,0,4,-1",
                "`sphere:0,0,4,-1` is no light: the radius is -1; expected above 0",
            ),
            (
                "sphere:0,0,4",
                "expected X,Y,Z,RADIUS, found 3 numbers in `0,0,4`",
            ),
            (
                "sphere:0,0,1e31,1",
                "`sphere:0,0,1e31,1` is no light: the centre is not finite, or beyond 2^100",
            ),
            (
                "segment:0,0,4/0,0,4",
                "`segment:0,0,4/0,0,4` is no light: its ends are the same point",
            ),
            (
                "sphere:0,0,4,1/both",
                "expected a finite number, found `both`",
            ),
            ("sky:0,-1,0", "a light's color must not be negative"),
            ("spot:0,0,4/0,0,0/1,2", "the axis of a spot is zero"),
            ("spot:0,0,4/0,0,-1/30,20", "the half-angles are 30 and 20"),
        ];
        for (text, expected) in errors {
            let found = light(text).unwrap_err();
            assert!(found.starts_with(expected), "{text}: {found}");
        }
    }
}
