//! NFF, the Neutral File Format of Eric Haines' Standard Procedural Databases (version 3.9).
//!
//! In: the text of a file. Out: a scene whose objects are in the order of the file.
//! Invariant: the file is a stream of words; line ends matter only to end a comment, to find a
//! texture's name after `f` and surplus numbers after `s`.
//!
//! Where the format leaves something open:
//! * two views: the last counts, with a warning; no view is a warning;
//! * lights without a color have the intensity that SPD suggests ([`nff_intensity`]); the ambient
//!   term is that number too, whether or not lights have colors;
//! * objects before the first `f` get the default grey;
//! * `hither` is read and not used.
//!
//! Six keywords are antumbra's own, for patches and implicit surfaces: see docs/formats.md.

mod dialect;
mod freeform;
mod lexer;
mod surface;
mod view;

use std::path::Path;

use antumbra_geometry::{Cone, DVec3, Short, Sphere};

use crate::{
    defaults::nff_intensity,
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{Color, Facing, Light, LightKind, Material, Object, Polygon, Scene, Shape},
    opacity::{self, Cause},
    warning::WarningLog,
};

use super::{
    Loaded,
    area::has_area,
    text::{
        Corners, LARGEST_COORDINATE, begins_like_number, decode, parse_any_number, parse_number,
    },
};
use dialect::{Foreign, foreign};
use lexer::{Lexer, Word};

/// The keywords that begin an entity.
const KEYWORDS: [&str; 8] = ["v", "b", "l", "f", "s", "c", "p", "pp"];
/// The same of antumbra's own.
const OWN_KEYWORDS: [&str; 6] = [
    "bezier",
    "bspline",
    "torus",
    "metaballs",
    "gyroid",
    "polynomial",
];
/// Keywords for messages; antumbra's own are not what people mean.
const KNOWN: &str = "v, b, l, f, s, c, p, pp";

/// Reads NFF from bytes. `file` is only a name for messages.
///
/// Time and memory are linear in the number of bytes.
///
/// # Errors
/// The bytes are no text, the text is no NFF, an entity is incomplete or has no meaning, a
/// coordinate exceeds 2^100; see [`ReadErrorKind`].
///
/// # Example
/// ```
/// use std::path::Path;
/// let loaded = antumbra_scene::read::read_nff(Path::new("a.nff"), b"s 0 0 0 1").unwrap();
/// assert_eq!(loaded.scene.objects.len(), 1);
/// let error = antumbra_scene::read::read_nff(Path::new("a.nff"), b"s 0 0 abc").unwrap_err();
/// assert!(error.to_string().starts_with("a.nff:1: in `s`: expected 4 numbers"));
/// ```
pub fn read_nff(file: &Path, bytes: &[u8]) -> Result<Loaded, ReadError> {
    let mut warnings = WarningLog::new(file);
    let text = decode(file, bytes, &mut warnings)?;
    let mut reader = Reader::new(file, &text, warnings);
    reader.read_entities()?;
    Ok(reader.finish())
}

/// The state between two words.
struct Reader<'a> {
    file: &'a Path,
    lexer: Lexer<'a>,
    warnings: WarningLog,
    scene: Scene,
    /// The surface in force and, once an object uses it, its index in the scene.
    surface: (Material, Option<usize>),
    /// Which lights have no color of their own.
    plain_lights: Vec<usize>,
    /// The entity read last, for messages about what follows it.
    last: &'static str,
}

impl<'a> Reader<'a> {
    fn new(file: &'a Path, text: &'a str, warnings: WarningLog) -> Self {
        Self {
            file,
            lexer: Lexer::new(text),
            warnings,
            scene: Scene {
                facing: Facing::Winding,
                up: DVec3::Z,
                ..Scene::default()
            },
            surface: (Material::default(), None),
            plain_lights: Vec::new(),
            last: "",
        }
    }

    fn read_entities(&mut self) -> Result<(), ReadError> {
        while let Some(keyword) = self.lexer.peek_keyword() {
            antumbra_task::check();
            let mut known = KEYWORDS.into_iter().chain(OWN_KEYWORDS);
            let Some(entity) = known.find(|&k| k == keyword.text) else {
                self.read_foreign(keyword)?;
                continue;
            };
            self.lexer.take(keyword);
            match entity {
                "v" => self.read_view(keyword.line)?,
                "b" => self.scene.background = self.color("b", "3 numbers (red, green, blue)")?,
                "l" => self.read_light()?,
                "f" => self.read_surface()?,
                "s" => self.read_sphere(keyword.line)?,
                "c" => self.read_cone(keyword.line)?,
                "p" | "pp" => self.read_polygon(entity, keyword.line)?,
                _ => self.read_freeform(entity, keyword.line)?,
            }
            self.last = entity;
        }
        Ok(())
    }

    /// Skips or refuses what is no entity of NFF.
    fn read_foreign(&mut self, keyword: Word<'a>) -> Result<(), ReadError> {
        match foreign(keyword.text) {
            Some(Foreign::Skip(name)) => {
                self.lexer.skip_line();
                // `tpp` has its vertices on lines of their own.
                while self
                    .lexer
                    .peek()
                    .is_some_and(|word| parse_number(word.text).is_some())
                {
                    self.lexer.next();
                }
                let message = format!("`{name}` is not NFF (assimp's addition): skipped");
                self.warnings.add(Place::Line(keyword.line), message);
                Ok(())
            }
            Some(Foreign::Refuse(keyword_name, dialect)) => Err(self.error(
                keyword.line,
                ReadErrorKind::Dialect {
                    keyword: keyword_name,
                    dialect,
                },
            )),
            None if begins_like_number(keyword.text) => {
                let kind = ReadErrorKind::Expected {
                    entity: "",
                    expected: match self.last {
                        "" => format!("a keyword ({KNOWN})"),
                        last => format!("a keyword ({KNOWN}) after the numbers of `{last}`"),
                    }
                    .into(),
                    found: quoted(keyword.text).into(),
                    help: "remove the surplus numbers or add the missing keyword",
                };
                Err(self.error(keyword.line, kind))
            }
            None => {
                let whole_word = self.lexer.peek().unwrap_or(keyword);
                let found = quoted(whole_word.text);
                Err(self.error(
                    keyword.line,
                    ReadErrorKind::UnknownKeyword {
                        found,
                        known: KNOWN,
                    },
                ))
            }
        }
    }

    /// `l`: three numbers, and three more if a number follows.
    fn read_light(&mut self) -> Result<(), ReadError> {
        let position = self.point("l", "3 numbers (position), or 6 (position and color)")?;
        let has_color = self
            .lexer
            .peek()
            .is_some_and(|word| begins_like_number(word.text));
        let color = if has_color {
            self.color("l", "3 numbers (position), or 6 (position and color)")?
        } else {
            // Known only when all lights are.
            self.plain_lights.push(self.scene.lights.len());
            Color::ZERO
        };
        self.scene.lights.push(Light {
            name: format!("light {}", self.scene.lights.len() + 1),
            kind: LightKind::Point { position },
            color,
            falls_off: false,
        });
        Ok(())
    }

    fn read_sphere(&mut self, line: u32) -> Result<(), ReadError> {
        let [x, y, z, radius] = self.coordinates("s", "4 numbers (centre and radius)")?;
        // Ellipsoids of another dialect, and assimp's files, go on with radii.
        let last_line = self.lexer.line();
        let mut surplus = false;
        while let Some(word) = self.lexer.peek() {
            if word.line != last_line || parse_number(word.text).is_none() {
                break;
            }
            self.lexer.next();
            surplus = true;
        }
        if surplus {
            let message = "`s` has more than 4 numbers: the rest of the line is ignored";
            self.warnings.add(Place::Line(line), message);
        }
        if radius == 0.0 {
            self.warnings
                .add(Place::Line(line), "`s` has radius 0: skipped");
            return Ok(());
        }
        self.push(Shape::Sphere(Sphere {
            center: DVec3::new(x, y, z),
            radius: radius.abs(),
        }));
        Ok(())
    }

    fn read_cone(&mut self, line: u32) -> Result<(), ReadError> {
        const EXPECTED: &str = "8 numbers (base and its radius, apex and its radius)";
        let [bx, by, bz, base_radius, ax, ay, az, apex_radius] = self.coordinates("c", EXPECTED)?;
        let (base, apex) = (DVec3::new(bx, by, bz), DVec3::new(ax, ay, az));
        if base_radius.min(apex_radius) < 0.0 && base_radius.max(apex_radius) > 0.0 {
            let problem = format!(
                "the radii {} and {} have different signs",
                Short(base_radius),
                Short(apex_radius)
            );
            let help = "both are positive, or both negative for a tube seen from inside";
            return Err(self.invalid(line, "c", problem, help));
        }
        if base == apex {
            self.warnings
                .add(Place::Line(line), "`c` has its base at its apex: skipped");
            return Ok(());
        }
        if base_radius == 0.0 && apex_radius == 0.0 {
            self.warnings
                .add(Place::Line(line), "`c` has two radii of 0: skipped");
            return Ok(());
        }
        self.push(Shape::Cone(Cone {
            base,
            base_radius: base_radius.abs(),
            apex,
            apex_radius: apex_radius.abs(),
            is_closed: false,
        }));
        Ok(())
    }

    /// `p` and `pp`.
    fn read_polygon(&mut self, entity: &'static str, line: u32) -> Result<(), ReadError> {
        let is_patch = entity == "pp";
        let count = self.vertex_count(entity, if is_patch { 6 } else { 3 })?;
        // The count is backed by bytes of the file, so this is bounded by the file.
        let mut vertices = Vec::with_capacity(count);
        let mut normals = Vec::with_capacity(if is_patch { count } else { 0 });
        for _ in 0..count {
            if is_patch {
                const EXPECTED: &str = "6 numbers for each vertex (position and normal)";
                vertices.push(self.vertex(entity, EXPECTED)?);
                let normal = self.vertex(entity, EXPECTED)?;
                if !normal.is_finite() {
                    let message = "a normal is not finite: none is used";
                    self.warnings.add(Place::Line(line), message);
                }
                normals.push(if normal.is_finite() {
                    normal
                } else {
                    DVec3::ZERO
                });
            } else {
                vertices.push(self.vertex(entity, "3 numbers for each vertex")?);
            }
        }
        if !vertices.iter().all(|vertex| vertex.is_finite()) {
            self.warnings.add(Place::Line(line), Corners::NOT_FINITE);
            return Ok(());
        }
        if !has_area(vertices.iter().copied()) {
            self.warnings.add(
                Place::Line(line),
                format!("`{entity}` has no area: skipped"),
            );
            return Ok(());
        }
        self.push(Shape::Polygon(Polygon { vertices, normals }));
        Ok(())
    }

    /// Reads how many vertices follow; the rest of the file must be long enough to hold them.
    fn vertex_count(&mut self, entity: &'static str, numbers: u64) -> Result<usize, ReadError> {
        const HELP: &str = "the count is followed by that many vertices";
        let word = self.lexer.peek();
        let digits = word.map_or("", |w| w.text);
        let unsigned = digits.strip_prefix(['+', '-']).unwrap_or(digits);
        if unsigned.is_empty() || !unsigned.bytes().all(|b| b.is_ascii_digit()) {
            return Err(self.expected(word, entity, "the number of vertices, 3 or more"));
        }
        self.lexer.next();
        let line = self.lexer.line();
        // Only overflow can make this fail.
        let count: i64 = digits.parse().unwrap_or(if digits.starts_with('-') {
            -1
        } else {
            i64::MAX
        });
        if count < 3 {
            let problem = format!("expected 3 vertices or more, found {count}");
            return Err(self.invalid(line, entity, problem, HELP));
        }
        // Every number takes a digit and something before it.
        let bytes_needed = (count as u64).saturating_mul(2 * numbers);
        if bytes_needed > self.lexer.bytes_left() as u64 {
            let problem = format!(
                "{} vertices are announced, but only {} bytes are left in the file",
                quoted(digits),
                self.lexer.bytes_left()
            );
            return Err(self.invalid(line, entity, problem, HELP));
        }
        Ok(count as usize)
    }

    /// Adds an object with the surface in force.
    fn push(&mut self, shape: Shape) {
        let (material, index) = &mut self.surface;
        let materials = &mut self.scene.materials;
        let material = *index.get_or_insert_with(|| {
            materials.push(material.clone());
            materials.len() - 1
        });
        self.scene.objects.push(Object {
            name: String::new(),
            shape,
            material,
        });
    }

    /// Reads a color; negative channels count as 0.
    fn color(&mut self, entity: &'static str, expected: &'static str) -> Result<Color, ReadError> {
        let mut channels = self.numbers::<3>(entity, expected)?;
        self.clamp_negative(self.lexer.line(), entity, &mut channels);
        Ok(Color::from_array(channels))
    }

    fn clamp_negative(&mut self, line: u32, entity: &str, numbers: &mut [f64]) {
        for number in numbers.iter_mut().filter(|number| **number < 0.0) {
            *number = 0.0;
            let message = format!("`{entity}` has a negative color or weight: 0 is used");
            self.warnings.add(Place::Line(line), message);
        }
    }

    /// Reads a position or normal of a polygon, which may not be finite.
    fn vertex(&mut self, entity: &'static str, expected: &'static str) -> Result<DVec3, ReadError> {
        let mut numbers = [0.0; 3];
        for number in &mut numbers {
            let unusual = self
                .lexer
                .peek()
                .and_then(|word| parse_any_number(word.text));
            match unusual.filter(|number| !number.is_finite()) {
                Some(unusual) => {
                    self.lexer.next();
                    *number = unusual;
                }
                None => [*number] = self.coordinates(entity, expected)?,
            }
        }
        Ok(DVec3::from_array(numbers))
    }

    fn point(&mut self, entity: &'static str, expected: &'static str) -> Result<DVec3, ReadError> {
        Ok(DVec3::from_array(self.coordinates(entity, expected)?))
    }

    /// Reads numbers that are places or lengths: at most 2^100 in magnitude.
    fn coordinates<const N: usize>(
        &mut self,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<[f64; N], ReadError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            [*number] = self.numbers(entity, expected)?;
            if number.abs() > LARGEST_COORDINATE {
                let problem = format!("{number:e} exceeds 2^100 (1.27e30), the largest coordinate");
                return Err(self.invalid(
                    self.lexer.line(),
                    entity,
                    problem,
                    "scale the scene down",
                ));
            }
        }
        Ok(numbers)
    }

    fn numbers<const N: usize>(
        &mut self,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<[f64; N], ReadError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let word = self.lexer.peek();
            *number = word
                .and_then(|word| parse_number(word.text))
                .ok_or_else(|| self.expected(word, entity, expected))?;
            self.lexer.next();
        }
        Ok(numbers)
    }

    /// An error at `word`, or at the end of the file.
    fn expected(
        &self,
        word: Option<Word<'_>>,
        entity: &'static str,
        expected: &'static str,
    ) -> ReadError {
        let found = word.map_or_else(|| "the end of the file".into(), |word| quoted(word.text));
        let help = match word {
            None => "the file may be cut short",
            Some(word) if begins_like_number(word.text) => {
                "numbers are decimal, finite and separated by white space"
            }
            Some(_) => "",
        };
        let line = word.map_or(self.lexer.line(), |word| word.line);
        let kind = ReadErrorKind::Expected {
            entity,
            expected: expected.into(),
            found: found.into(),
            help,
        };
        self.error(line, kind)
    }

    fn invalid(
        &self,
        line: u32,
        entity: &'static str,
        problem: impl Into<Box<str>>,
        help: &'static str,
    ) -> ReadError {
        self.error(
            line,
            ReadErrorKind::Invalid {
                entity,
                problem: problem.into(),
                help,
            },
        )
    }

    fn error(&self, line: u32, kind: ReadErrorKind) -> ReadError {
        ReadError {
            file: self.file.to_path_buf(),
            place: Place::Line(line),
            kind,
        }
    }

    /// Settles what only the whole file tells.
    fn finish(self) -> Loaded {
        let Self {
            mut scene,
            mut warnings,
            plain_lights,
            ..
        } = self;
        let intensity = Color::splat(nff_intensity(scene.lights.len()));
        scene.ambient = intensity;
        for light in plain_lights {
            scene.lights[light].color = intensity;
        }
        if scene.camera.is_none() {
            warnings.add(Place::Whole, "no view (`v`) in the file");
        }
        if scene.objects.is_empty() {
            warnings.add(Place::Whole, "no objects in the file");
        }
        let cause = |material: &Material, _| Cause {
            what: format!("`f` with a transmittance T of {}", material.transmission.x),
            advice: "a T of 0 would make them block",
        };
        opacity::settle(&mut scene, cause, &mut warnings);
        Loaded {
            scene,
            warnings: warnings.finish(),
            files: Vec::new(),
            is_up_assumed: false,
        }
    }
}

fn is_keyword(word: &str) -> bool {
    KEYWORDS.contains(&word) || OWN_KEYWORDS.contains(&word)
}
