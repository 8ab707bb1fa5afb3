//! Lights in a JSON file, with size and without.
//!
//! In: a path, which way is up. Out: [`Lights`], or a [`ReadError`] that names the light and its field. Invariant:
//! numbers are finite and shapes are valid, as [`crate::model`] promises. The format is described in `docs/lights.md`.

use std::path::Path;
use std::sync::Arc;

use antumbra_geometry::{
    AreaError, AreaShape, DVec3, DiskLight, PolygonLight, RectangleLight, SegmentLight, Short, Sky,
    SphereLight, SunDisc, TriangleLight,
};
use serde::Deserialize;

use super::read_bytes;
use crate::{
    defaults,
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{AreaLight, Color, Light, LightKind},
};

/// Lights of a file, in its order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    /// Those without size.
    pub lights: Vec<Light>,
    /// Those with size.
    pub area_lights: Vec<AreaLight>,
    /// Whether one of them is a sky, or a sun by azimuth and elevation: such lights go by which way is up.
    pub depend_on_up: bool,
}

/// The largest magnitude of a coordinate.
const LARGEST: f64 = (1_u128 << 100) as f64;

const HELP: &str = "docs/lights.md describes the file";

const TYPES: &str =
    "point, directional, spot, segment, rectangle, triangle, polygon, disk, sphere, sun or sky";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    lights: Vec<Entry>,
}

/// A light as the file has it: which fields it needs depends on its type.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    r#type: String,
    name: Option<String>,
    color: Option<[f64; 3]>,
    falls_off: Option<bool>,
    two_sided: Option<bool>,
    position: Option<[f64; 3]>,
    towards_light: Option<[f64; 3]>,
    axis: Option<[f64; 3]>,
    inner_degrees: Option<f64>,
    outer_degrees: Option<f64>,
    ends: Option<[[f64; 3]; 2]>,
    center: Option<[f64; 3]>,
    edges: Option<[[f64; 3]; 2]>,
    corners: Option<Vec<[f64; 3]>>,
    normal: Option<[f64; 3]>,
    radius: Option<f64>,
    azimuth_degrees: Option<f64>,
    elevation_degrees: Option<f64>,
    diameter_degrees: Option<f64>,
}

/// Fault of a light: the field, if it is one field's, and the reason.
struct Fault(&'static str, String);

impl From<AreaError> for Fault {
    fn from(error: AreaError) -> Self {
        Self("", error.to_string())
    }
}

/// Reads a file of lights. `up` is the direction that suns and skies go by, any length but zero.
///
/// Time and memory grow with the file; it may have any number of lights. At most `memory_limit` bytes are read.
///
/// # Errors
/// The file cannot be read, is no such JSON, or a light has no meaning; the error names the light and its field.
pub fn read_lights(path: &Path, up: DVec3, memory_limit: u64) -> Result<Lights, ReadError> {
    let bytes = read_bytes(path, memory_limit.min(super::MAX_FILE_BYTES))?;
    lights_of(path, &bytes, up)
}

fn lights_of(path: &Path, bytes: &[u8], up: DVec3) -> Result<Lights, ReadError> {
    let refuse = |place, path_inside: String, problem: String| ReadError {
        file: path.to_path_buf(),
        place,
        kind: ReadErrorKind::Element {
            path: path_inside.into(),
            problem: problem.into(),
            help: HELP,
        },
    };
    let file: File = parse(bytes).map_err(|(place, inside, text)| refuse(place, inside, text))?;
    let mut lights = Lights::default();
    for (number, entry) in file.lights.into_iter().enumerate() {
        antumbra_task::check();
        entry
            .add_to(&mut lights, up)
            .map_err(|Fault(field, text)| {
                let inside = match field {
                    "" => format!("lights[{number}]"),
                    field => format!("lights[{number}].{field}"),
                };
                refuse(Place::Whole, inside, text)
            })?;
    }
    Ok(lights)
}

/// Parses the JSON; what is wrong comes with its line and its path.
fn parse(bytes: &[u8]) -> Result<File, (Place, String, String)> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let (inside, error) = match serde_path_to_error::deserialize(&mut json) {
        Ok(file) => match json.end() {
            Ok(()) => return Ok(file),
            Err(error) => ("lights".to_owned(), error),
        },
        Err(error) => (error.path().to_string(), error.into_inner()),
    };
    let line = u32::try_from(error.line()).unwrap_or(u32::MAX);
    let text = error.to_string();
    // The place is said already.
    let suffix = format!(" at line {} column {}", error.line(), error.column());
    let text = text.strip_suffix(&suffix).unwrap_or(&text).to_owned();
    Err((Place::Line(line), inside, text))
}

impl Entry {
    fn add_to(mut self, lights: &mut Lights, up: DVec3) -> Result<(), Fault> {
        let kind = self.r#type.clone();
        let color = self.color.take().map_or(Color::ONE, Color::from_array);
        if !(color.is_finite() && color.min_element() >= 0.0) {
            let text = "expected three finite numbers that are not negative";
            return Err(Fault("color", text.into()));
        }
        let name = self.name.take().unwrap_or_default();
        let falls_off = self.falls_off.take().unwrap_or(false);
        lights.depend_on_up |= kind == "sky" || self.azimuth_degrees.is_some();
        match self.shape(&kind, up)? {
            Shape::Plain(kind) => lights.lights.push(Light {
                name,
                kind,
                color,
                falls_off,
            }),
            Shape::Area(shape) => lights.area_lights.push(AreaLight {
                name,
                shape,
                color,
                falls_off,
            }),
        }
        self.refuse_what_is_left(&kind)
    }

    fn shape(&mut self, kind: &str, up: DVec3) -> Result<Shape, Fault> {
        let is_two_sided = match kind {
            "rectangle" | "triangle" | "polygon" | "disk" => self.two_sided.take() == Some(true),
            _ => false,
        };
        Ok(Shape::Area(match kind {
            "point" => {
                let position = place(due(&mut self.position, "position")?, "position")?;
                return Ok(Shape::Plain(LightKind::Point { position }));
            }
            "directional" => {
                let towards_light = due(&mut self.towards_light, "towards_light")?;
                let towards_light = direction(towards_light, "towards_light")?;
                return Ok(Shape::Plain(LightKind::Directional { towards_light }));
            }
            "spot" => return self.spot().map(Shape::Plain),
            "segment" => {
                let ends = due(&mut self.ends, "ends")?.map(DVec3::from_array);
                AreaShape::Segment(SegmentLight::new(ends)?)
            }
            "rectangle" => {
                let center = due(&mut self.center, "center")?.into();
                let edges = due(&mut self.edges, "edges")?.map(DVec3::from_array);
                AreaShape::Rectangle(RectangleLight::new(center, edges, is_two_sided)?)
            }
            "triangle" => {
                let corners = self.corners()?;
                let count = corners.len();
                let corners: [DVec3; 3] = corners
                    .try_into()
                    .map_err(|_| Fault("corners", format!("expected 3 corners, found {count}")))?;
                AreaShape::Triangle(TriangleLight::new(corners, is_two_sided)?)
            }
            "polygon" => {
                let polygon = PolygonLight::new(self.corners()?, is_two_sided)?;
                AreaShape::Polygon(Arc::new(polygon))
            }
            "disk" => {
                let center = due(&mut self.center, "center")?.into();
                let normal = due(&mut self.normal, "normal")?.into();
                let radius = due(&mut self.radius, "radius")?;
                AreaShape::Disk(DiskLight::new(center, normal, radius, is_two_sided)?)
            }
            "sphere" => {
                let center = due(&mut self.center, "center")?.into();
                let radius = due(&mut self.radius, "radius")?;
                AreaShape::Sphere(SphereLight::new(center, radius)?)
            }
            "sun" => {
                let towards_light = self.sun(up)?;
                let Some(diameter) = self.diameter_degrees.take() else {
                    let kind = LightKind::Directional { towards_light };
                    return Ok(Shape::Plain(kind));
                };
                AreaShape::SunDisc(SunDisc::new(towards_light, diameter)?)
            }
            "sky" => AreaShape::Sky(Sky::new(up)?),
            other => {
                let text = format!("unknown type {}; expected {TYPES}", quoted(other));
                return Err(Fault("type", text));
            }
        }))
    }

    fn corners(&mut self) -> Result<Vec<DVec3>, Fault> {
        let corners = due(&mut self.corners, "corners")?;
        Ok(corners.into_iter().map(DVec3::from_array).collect())
    }

    /// Returns the direction towards the sun: as given, or by its place in the sky.
    fn sun(&mut self, up: DVec3) -> Result<DVec3, Fault> {
        if let Some(towards_light) = self.towards_light.take() {
            return direction(towards_light, "towards_light");
        }
        let azimuth = due(&mut self.azimuth_degrees, "azimuth_degrees")?;
        let elevation = due(&mut self.elevation_degrees, "elevation_degrees")?;
        if azimuth.abs().is_nan() || azimuth.abs() > 3600.0 {
            let text = format!("{} is not from -3600 to 3600", Short(azimuth));
            return Err(Fault("azimuth_degrees", text));
        }
        if !(-90.0..=90.0).contains(&elevation) {
            let text = format!("{} is not from -90 to 90", Short(elevation));
            return Err(Fault("elevation_degrees", text));
        }
        Ok(defaults::towards_sun(azimuth, elevation, up))
    }

    fn spot(&mut self) -> Result<LightKind, Fault> {
        let position = place(due(&mut self.position, "position")?, "position")?;
        let axis = direction(due(&mut self.axis, "axis")?, "axis")?;
        let outer = due(&mut self.outer_degrees, "outer_degrees")?;
        let inner = self.inner_degrees.take().unwrap_or(0.0);
        if !(outer > 0.0 && outer <= 90.0) {
            let text = format!("{} is not above 0, at most 90", Short(outer));
            return Err(Fault("outer_degrees", text));
        }
        if !(0.0..=outer).contains(&inner) {
            let text = format!("{} is not from 0 to outer_degrees", Short(inner));
            return Err(Fault("inner_degrees", text));
        }
        Ok(LightKind::Spot {
            position,
            axis,
            inner_cosine: libm::cos(inner.to_radians()),
            outer_cosine: libm::cos(outer.to_radians()),
        })
    }

    /// Refuses fields that the type does not have: they would be dropped in silence.
    fn refuse_what_is_left(&self, kind: &str) -> Result<(), Fault> {
        let left = [
            ("two_sided", self.two_sided.is_some()),
            ("position", self.position.is_some()),
            ("towards_light", self.towards_light.is_some()),
            ("axis", self.axis.is_some()),
            ("inner_degrees", self.inner_degrees.is_some()),
            ("outer_degrees", self.outer_degrees.is_some()),
            ("ends", self.ends.is_some()),
            ("center", self.center.is_some()),
            ("edges", self.edges.is_some()),
            ("corners", self.corners.is_some()),
            ("normal", self.normal.is_some()),
            ("radius", self.radius.is_some()),
            ("azimuth_degrees", self.azimuth_degrees.is_some()),
            ("elevation_degrees", self.elevation_degrees.is_some()),
            ("diameter_degrees", self.diameter_degrees.is_some()),
        ];
        match left.into_iter().find(|&(_, is_left)| is_left) {
            Some((field, _)) => Err(Fault(field, format!("a light of type {kind} has none"))),
            None => Ok(()),
        }
    }
}

enum Shape {
    Plain(LightKind),
    Area(AreaShape),
}

/// Takes a field that the type needs.
fn due<T>(field: &mut Option<T>, name: &'static str) -> Result<T, Fault> {
    field.take().ok_or_else(|| Fault(name, "is missing".into()))
}

fn place(point: [f64; 3], name: &'static str) -> Result<DVec3, Fault> {
    let point = DVec3::from_array(point);
    // Not for NaN.
    if point.abs().cmple(DVec3::splat(LARGEST)).all() {
        Ok(point)
    } else {
        Err(Fault(name, "is beyond 2^100".into()))
    }
}

fn direction(direction: [f64; 3], name: &'static str) -> Result<DVec3, Fault> {
    let direction = place(direction, name)?;
    if direction == DVec3::ZERO {
        return Err(Fault(name, "is zero; expected a direction".into()));
    }
    Ok(direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Lights, String> {
        let path = Path::new("l.json");
        lights_of(path, text.as_bytes(), DVec3::Z).map_err(|error| error.to_string())
    }

    #[test]
    fn every_type_of_light_is_read() {
        let lights = read(
            r#"{"lights": [
            {"type": "point", "position": [1, 2, 3], "name": "lamp", "color": [1, 0.5, 0], "falls_off": true},
            {"type": "directional", "towards_light": [0, 0, 2]},
            {"type": "spot", "position": [0, 0, 4], "axis": [0, 0, -1], "inner_degrees": 20, "outer_degrees": 30},
            {"type": "segment", "ends": [[0, 0, 1], [1, 0, 1]]},
            {"type": "rectangle", "center": [0, 0, 4], "edges": [[1, 0, 0], [0, 1, 0]], "two_sided": true},
            {"type": "triangle", "corners": [[0, 0, 4], [1, 0, 4], [0, 1, 4]]},
            {"type": "polygon", "corners": [[0, 0, 4], [1, 0, 4], [1, 1, 4], [0, 1, 4]]},
            {"type": "disk", "center": [0, 0, 4], "normal": [0, 0, -1], "radius": 0.5},
            {"type": "sphere", "center": [0, 0, 4], "radius": 0.5},
            {"type": "sun", "azimuth_degrees": 180, "elevation_degrees": 30, "diameter_degrees": 0.53},
            {"type": "sun", "towards_light": [0, 1, 1], "diameter_degrees": 6},
            {"type": "sky", "color": [0.2, 0.3, 0.4]}
        ]}"#,
        )
        .unwrap();
        assert_eq!(lights.lights.len(), 3);
        assert_eq!(lights.lights[0].name, "lamp");
        assert!(lights.lights[0].falls_off);
        let kinds: Vec<_> = lights.area_lights.iter().map(|l| l.shape.kind()).collect();
        let expected = "segment rectangle triangle polygon disk sphere sun sun sky";
        assert_eq!(kinds.join(" "), expected);
        assert_eq!(lights.area_lights[8].color, Color::new(0.2, 0.3, 0.4));
    }

    #[test]
    fn errors_say_which_light_and_which_field() {
        let one = |light: &str| read(&format!("{{\"lights\": [{light}]}}")).unwrap_err();
        let help = "; help: docs/lights.md describes the file";
        let cases = [
            (
                r#"{"type": "blob"}"#,
                "l.json: lights[0].type: unknown type `blob`; expected point, directional, spot, segment, rectangle, triangle, polygon, disk, sphere, sun or sky",
            ),
            (
                r#"{"type": "sphere", "center": [0, 0, 0]}"#,
                "l.json: lights[0].radius: is missing",
            ),
            (
                r#"{"type": "sphere", "center": [0, 0, 0], "radius": 0}"#,
                "l.json: lights[0]: its radius is zero: use a point or directional light for a light without size",
            ),
            (
                r#"{"type": "sky", "radius": 1}"#,
                "l.json: lights[0].radius: a light of type sky has none",
            ),
            (
                r#"{"type": "point", "position": [0, 0, 1e31]}"#,
                "l.json: lights[0].position: is beyond 2^100",
            ),
            (
                r#"{"type": "sky", "color": [0, -1, 0]}"#,
                "l.json: lights[0].color: expected three finite numbers that are not negative",
            ),
            (
                r#"{"type": "sun", "azimuth_degrees": 1, "elevation_degrees": 91, "diameter_degrees": 1}"#,
                "l.json: lights[0].elevation_degrees: 91 is not from -90 to 90",
            ),
            (
                r#"{"type": "spot", "position": [0, 0, 4], "axis": [0, 0, 0], "outer_degrees": 30}"#,
                "l.json: lights[0].axis: is zero; expected a direction",
            ),
            (
                r#"{"type": "triangle", "corners": [[0, 0, 0]]}"#,
                "l.json: lights[0].corners: expected 3 corners, found 1",
            ),
            (
                r#"{"type": "polygon", "corners": [[0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]]}"#,
                "l.json: lights[0]: the polygon is not convex at corner 2; cut it into convex ones, or into triangles",
            ),
            (
                r#"{"type": "disk", "center": [0, 0, 0], "normal": [0, 0, 0], "radius": 1}"#,
                "l.json: lights[0]: the normal is zero; expected a direction",
            ),
            (
                r#"{"type": "disk", "center": [0, 0, "x"]}"#,
                "l.json:1: lights[0].center[2]: invalid type: string \"x\", expected f64",
            ),
            (
                r#"{"type": "disk", "tint": [0, 0, 1]}"#,
                "l.json:1: lights[0].tint: unknown field `tint`",
            ),
        ];
        for (light, expected) in cases {
            let found = one(light);
            assert!(found.starts_with(expected), "{found}");
            assert!(found.ends_with(help), "{found}");
        }
        assert!(read("[]").is_err() && read("").is_err() && read("{\"lights\": [").is_err());
        assert!(read("{\"lights\": []} x").is_err());
        assert_eq!(read("{\"lights\": []}"), Ok(Lights::default()));
    }

    #[test]
    fn a_hundred_thousand_lights_are_read() {
        let one = r#"{"type": "sphere", "center": [0, 0, 4], "radius": 0.5}"#;
        let all = vec![one; 100_000].join(",");
        let lights = read(&format!("{{\"lights\": [{all}]}}")).unwrap();
        assert_eq!(lights.area_lights.len(), 100_000);
    }
}
