//! MTL, the material libraries of OBJ.
//!
//! In: the text of a library. Out: materials by name, each with the pictures it names. Invariant:
//! weights are finite and not negative.
//!
//! How MTL's model becomes ours: `Kd` diffuse, `Ks` highlight, `Ns` its exponent, `Ke` emission;
//! `illum` 3 and 5 to 9 make `Ks` the mirror's weight too. `Ni` is the index of refraction. `Ka` is not
//! used: ambient light is the scene's.
//!
//! What light passes is decided by values, never by the number of `illum` alone:
//!
//! | the material says | share of light that passes |
//! |---|---|
//! | `d` | `1 - d`, times `Tf` |
//! | `Tr`, and no `d` | `Tr`, times `Tf` |
//! | neither, `illum` 4, 6, 7 or 9, and a `Tf` | `Tf`: so glass and water are written in practice |
//! | the same with `Tf` 1 1 1 and no `Ni` other than 1 | none: so Maya writes what is opaque |
//! | anything else | none |

pub(super) mod map;

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{Color, Material},
    opacity::Cause,
    warning::{Warning, WarningLog},
};

use map::{Maps, Relief, parse_map};

use super::{
    statements::{Statement, Statements},
    text::{decode, parse_any_number, parse_number},
};

/// The most materials of a library. One takes half a kilobyte and as little as 9 bytes of text; no
/// real library comes near this number.
const MOST_MATERIALS: usize = 1 << 16;

/// A material library and what was not used of it.
#[derive(Debug)]
pub(super) struct Library {
    /// The materials by name.
    pub(super) materials: HashMap<String, Entry>,
    /// What was ignored or repaired.
    pub(super) warnings: Vec<Warning>,
}

/// A material, and what it needs besides its own numbers.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Without its pictures.
    pub(super) material: Material,
    /// Why it lets light through, if it does.
    pub(super) cause: Cause,
    /// The pictures that are read.
    pub(super) pictures: Maps,
}

impl Entry {
    /// A material that no library defines.
    pub(super) fn plain(material: Material) -> Self {
        Self {
            material,
            cause: Cause::default(),
            pictures: Maps::default(),
        }
    }

    /// Returns whether places in a picture matter.
    pub(super) fn has_picture(&self) -> bool {
        let Maps {
            color,
            alpha,
            relief,
            ..
        } = &self.pictures;
        color.is_some() || alpha.is_some() || relief.is_some()
    }
}

/// Reads a material library. `name` is the one that the OBJ `file` gives it: for messages, and for where
/// its pictures are.
///
/// # Errors
/// The bytes are no text, a number is none, or there are too many materials.
pub(super) fn read_mtl(file: &Path, name: &str, bytes: &[u8]) -> Result<Library, ReadError> {
    let file = &file.parent().unwrap_or(Path::new("")).join(name);
    let mut warnings = WarningLog::new(file);
    let text = decode(file, bytes, &mut warnings)?;
    let folder = name.rfind(['/', '\\']).map_or("", |end| &name[..=end]);
    let mut reader = Reader {
        file,
        folder,
        warnings,
        materials: HashMap::new(),
        draft: None,
        textures: HashSet::new(),
        first_texture: 0,
    };
    for statement in Statements::new(&text) {
        reader.read(&statement)?;
    }
    Ok(reader.finish())
}

/// A material as its statements come in.
struct Draft {
    material: Material,
    line: u32,
    illumination: Option<i64>,
    /// `d` and `Tr`.
    dissolve: Option<f64>,
    transparency: Option<f64>,
    /// `Tf` and `Ni`.
    filter: Option<Color>,
    ior: Option<f64>,
    has_color: bool,
    maps: Maps,
}

struct Reader<'a> {
    file: &'a Path,
    /// Where the library is, seen from the OBJ, up to the last `/`; or empty.
    folder: &'a str,
    warnings: WarningLog,
    materials: HashMap<String, Entry>,
    draft: Option<Draft>,
    textures: HashSet<String>,
    first_texture: u32,
}

impl Reader<'_> {
    fn read(&mut self, statement: &Statement<'_>) -> Result<(), ReadError> {
        let keyword = statement.keyword();
        let place = Place::Line(statement.line);
        if keyword == "newmtl" {
            self.close();
            if self.materials.len() == MOST_MATERIALS {
                let kind = ReadErrorKind::Invalid {
                    entity: "newmtl",
                    problem: format!("there are more than {MOST_MATERIALS} materials").into(),
                    help: "remove those that are not used",
                };
                return Err(ReadError {
                    file: self.file.to_path_buf(),
                    place,
                    kind,
                });
            }
            let material = Material {
                name: statement.name().to_owned(),
                ..Material::default()
            };
            self.draft = Some(Draft {
                material,
                line: statement.line,
                illumination: None,
                dissolve: None,
                transparency: None,
                filter: None,
                ior: None,
                has_color: false,
                maps: Maps {
                    folder: self.folder.into(),
                    ..Maps::default()
                },
            });
            return Ok(());
        }
        let lower = keyword.to_ascii_lowercase();
        if matches!(&*lower, "map_kd" | "map_d" | "bump" | "map_bump" | "norm") {
            self.read_map(statement, &lower);
            return Ok(());
        }
        if lower.starts_with("map_") || matches!(&*lower, "disp" | "decal" | "refl") {
            if self.textures.is_empty() {
                self.first_texture = statement.line;
            }
            self.textures
                .insert(statement.arguments().last().unwrap_or_default().to_owned());
            return Ok(());
        }
        // Numbers are read before the material is looked up, so that garbage is always told.
        enum Value {
            Color(Color),
            Number(f64),
        }
        use Value::{Color as C, Number as N};
        let value = match keyword {
            "Kd" => self.color(statement, "Kd")?.map(C),
            "Ks" => self.color(statement, "Ks")?.map(C),
            "Ke" => self.color(statement, "Ke")?.map(C),
            "Tf" => self.color(statement, "Tf")?.map(C),
            "Ns" => self.look(statement, "Ns")?.map(N),
            "Ni" => self.look(statement, "Ni")?.map(N),
            "d" => Some(N(self.number(statement, "d")?)),
            "Tr" => Some(N(self.number(statement, "Tr")?)),
            "illum" => Some(N(self.number(statement, "illum")?)),
            "Ka" | "sharpness" => None,
            _ => {
                self.warnings
                    .add(place, format!("{} is not read", quoted(keyword)));
                None
            }
        };
        let Some(value) = value else { return Ok(()) };
        let Some(draft) = &mut self.draft else {
            self.warnings
                .add(place, "statements before the first `newmtl` are ignored");
            return Ok(());
        };
        match (keyword, value) {
            ("Kd", C(color)) => {
                draft.material.diffuse = color;
                draft.has_color = true;
            }
            ("Ks", C(color)) => draft.material.specular = color,
            ("Ke", C(color)) => draft.material.emission = color,
            ("Tf", C(color)) => draft.filter = Some(color),
            ("Ns", N(exponent)) if exponent >= 0.0 => draft.material.shininess = exponent,
            ("Ni", N(ior)) if ior > 0.0 => draft.ior = Some(ior),
            ("d", N(d)) => draft.dissolve = Some(d),
            ("Tr", N(tr)) => draft.transparency = Some(tr),
            ("illum", N(model)) => draft.illumination = Some(model as i64),
            (keyword, _) => {
                let message = format!("`{keyword}` is not positive: ignored");
                self.warnings.add(place, message);
            }
        }
        Ok(())
    }

    /// Finishes the material that was being read.
    fn close(&mut self) {
        let Some(mut draft) = self.draft.take() else {
            return;
        };
        let place = Place::Line(draft.line);
        let material = &mut draft.material;
        if matches!(draft.illumination, Some(3 | 5..=9)) {
            material.reflection = material.specular;
        }
        let opacity = draft
            .dissolve
            .or(draft.transparency.map(|tr| 1.0 - tr))
            .unwrap_or(1.0);
        if !(0.0..=1.0).contains(&opacity) {
            self.warnings.add(
                place,
                "`d` or `Tr` is not between 0 and 1: the nearer one is used",
            );
        }
        let transparency = 1.0 - opacity.clamp(0.0, 1.0);
        // The table in the header of this file.
        material.transmission = match (draft.dissolve.or(draft.transparency), draft.filter) {
            (Some(_), filter) => transparency * filter.unwrap_or(Color::ONE),
            (None, Some(filter)) if matches!(draft.illumination, Some(4 | 6 | 7 | 9)) => {
                let refracts = draft.ior.is_some_and(|ior| ior != 1.0);
                let is_said = filter != Color::ONE || refracts;
                if is_said { filter } else { Color::ZERO }
            }
            (None, _) => Color::ZERO,
        };
        material.ior = match draft.ior {
            Some(ior) if material.transmission != Color::ZERO => ior,
            _ => 1.0,
        };
        if draft.maps.color.is_some() && !draft.has_color {
            material.diffuse = Color::ONE;
        }
        let cause = match (draft.dissolve, draft.transparency) {
            (Some(d), _) => Cause {
                what: format!("MTL `d {d}`"),
                advice: "`d 1` would make them block",
            },
            (None, Some(tr)) if tr >= 1.0 => Cause {
                what: format!("MTL `Tr {tr}`"),
                advice: "scanning tools write it for what is opaque: if that is meant, write `d 1` \
                    in its place in the material library",
            },
            (None, Some(tr)) => Cause {
                what: format!("MTL `Tr {tr}`"),
                advice: "`d 1` in its place would make them block",
            },
            (None, None) => Cause {
                what: format!("MTL `Tf` with `illum {}`", draft.illumination.unwrap_or(0)),
                advice: "`d 1` beside it would make them block",
            },
        };
        let entry = Entry {
            material: draft.material,
            cause,
            pictures: draft.maps,
        };
        let name = entry.material.name.clone();
        if self.materials.insert(name, entry).is_some() {
            self.warnings
                .add(place, "a material is defined twice: the last one counts");
        }
    }

    /// `map_Kd`, `map_d`, `bump` or `norm`: options, then the name of a picture.
    fn read_map(&mut self, statement: &Statement<'_>, keyword: &str) {
        let place = Place::Line(statement.line);
        let Some(draft) = &mut self.draft else {
            let message = "statements before the first `newmtl` are ignored";
            self.warnings.add(place, message);
            return;
        };
        let Some(map) = parse_map(statement.name()) else {
            let message = format!("{} names no picture: ignored", quoted(statement.keyword()));
            self.warnings.add(place, message);
            return;
        };
        let maps = &mut draft.maps;
        match keyword {
            "map_d" => maps.alpha = Some(map),
            "map_kd" => maps.color = Some(map),
            _ => {
                let is_normals = keyword == "norm";
                maps.relief = Some(Relief { map, is_normals });
            }
        }
    }

    /// Reads a number that only looks depend on, or mostly: `None`, with a warning, if it is not finite, or no number
    /// and no light passes by it.
    fn look(
        &mut self,
        statement: &Statement<'_>,
        entity: &'static str,
    ) -> Result<Option<f64>, ReadError> {
        let word = statement.arguments().next();
        if word
            .and_then(parse_any_number)
            .is_some_and(|n| !n.is_finite())
        {
            self.not_finite(statement, entity);
            return Ok(None);
        }
        match self.number(statement, entity) {
            // What passes light is not guessed: `Ni` tells glass.
            Err(error) if entity == "Ni" => Err(error),
            Err(_) => {
                self.unread(statement, entity, "a number");
                Ok(None)
            }
            Ok(number) => Ok(Some(number)),
        }
    }

    /// Warns of a statement that makes no sense, where no shadow depends on it.
    fn unread(&mut self, statement: &Statement<'_>, entity: &str, expected: &str) {
        let message = format!("`{entity}` is not {expected}: ignored");
        self.warnings.add(Place::Line(statement.line), message);
    }

    fn not_finite(&mut self, statement: &Statement<'_>, entity: &str) {
        let message = format!("`{entity}` is not finite: ignored");
        self.warnings.add(Place::Line(statement.line), message);
    }

    /// Reads three numbers, or one for all three channels. A spectral curve, CIE coordinates, and what is no color but
    /// would change no shadow are not read: `None`, with a warning.
    fn color(
        &mut self,
        statement: &Statement<'_>,
        entity: &'static str,
    ) -> Result<Option<Color>, ReadError> {
        const EXPECTED: &str = "3 numbers (red, green, blue)";
        let place = Place::Line(statement.line);
        if matches!(statement.arguments().next(), Some("spectral" | "xyz")) {
            self.warnings.add(
                place,
                format!("`{entity}` as a spectral curve or as xyz is not read"),
            );
            return Ok(None);
        }
        let is_odd = |word| parse_any_number(word).is_some_and(|n| !n.is_finite());
        // What passes light is not guessed.
        if entity != "Tf" && statement.arguments().any(is_odd) {
            self.not_finite(statement, entity);
            return Ok(None);
        }
        let channels = match self.channels(statement, entity, EXPECTED) {
            Err(_) if entity != "Tf" => {
                self.unread(statement, entity, EXPECTED);
                return Ok(None);
            }
            channels => channels?,
        };
        if channels.iter().any(|&c| c < 0.0) {
            self.warnings.add(
                place,
                format!("`{entity}` has a negative channel: 0 is used"),
            );
        }
        Ok(Some(Color::from_array(channels.map(|c| c.max(0.0)))))
    }

    fn channels(
        &self,
        statement: &Statement<'_>,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<[f64; 3], ReadError> {
        let mut channels = [0.0; 3];
        let mut count = 0;
        for (channel, word) in channels.iter_mut().zip(statement.arguments()) {
            *channel = self.parse(statement, word, entity, expected)?;
            count += 1;
        }
        match count {
            1 => Ok([channels[0]; 3]),
            3 => Ok(channels),
            _ => Err(self.ended(statement, entity, expected)),
        }
    }

    /// Reads one number; `-halo` before it is skipped.
    fn number(&self, statement: &Statement<'_>, entity: &'static str) -> Result<f64, ReadError> {
        let mut words = statement.arguments().filter(|&word| word != "-halo");
        let word = words
            .next()
            .ok_or_else(|| self.ended(statement, entity, "a number"))?;
        self.parse(statement, word, entity, "a number")
    }

    fn parse(
        &self,
        statement: &Statement<'_>,
        word: &str,
        entity: &'static str,
        expected: &'static str,
    ) -> Result<f64, ReadError> {
        parse_number(word).ok_or_else(|| self.error(statement, entity, expected, quoted(word)))
    }

    fn ended(
        &self,
        statement: &Statement<'_>,
        entity: &'static str,
        expected: &'static str,
    ) -> ReadError {
        self.error(statement, entity, expected, "the end of the line".into())
    }

    fn error(
        &self,
        statement: &Statement<'_>,
        entity: &'static str,
        expected: &'static str,
        found: String,
    ) -> ReadError {
        let kind = ReadErrorKind::Expected {
            entity,
            expected: expected.into(),
            found: found.into(),
            help: "correct the line in the material library",
        };
        ReadError {
            file: self.file.to_path_buf(),
            place: Place::Line(statement.line),
            kind,
        }
    }

    fn finish(mut self) -> Library {
        self.close();
        let Self {
            mut warnings,
            materials,
            textures,
            first_texture,
            ..
        } = self;
        if !textures.is_empty() {
            let message = match textures.len() {
                1 => {
                    "1 texture is not read: it is no `map_Kd`, `map_d`, `bump` or `norm`".to_owned()
                }
                count => format!(
                    "{count} textures are not read: they are no `map_Kd`, `map_d`, `bump` or `norm`"
                ),
            };
            warnings.add(Place::Line(first_texture), message);
        }
        Library {
            materials,
            warnings: warnings.finish(),
        }
    }
}

#[cfg(test)]
mod tests;
