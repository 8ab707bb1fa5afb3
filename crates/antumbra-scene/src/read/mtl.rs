//! MTL, the material libraries of OBJ.
//!
//! In: the text of a library. Out: materials by name. Invariant: weights are finite and not
//! negative; textures are counted and not read.
//!
//! How MTL's model becomes ours: `Kd` diffuse, `Ks` highlight, `Ns` its exponent, `Ke` emission;
//! `illum` 3 and 5 to 9 make `Ks` the mirror's weight too. Transmission is `1 - d` (or `Tr` where
//! there is no `d`) times `Tf`; under the glass models, `illum` 4, 6, 7 and 9, a `Tf` without
//! transparency transmits by itself: that is how glass and water are written in practice. `Ni` is
//! the index of refraction. `Ka` is not used: ambient light is the scene's.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use crate::{
    error::{Place, ReadError, ReadErrorKind, quoted},
    model::{Color, Material},
    warning::{Warning, WarningLog},
};

use super::{
    statements::{Statement, Statements},
    text::{decode, parse_number},
};

/// The most materials of a library. One takes half a kilobyte and as little as 9 bytes of text; no
/// real library comes near this number.
const MOST_MATERIALS: usize = 1 << 16;

/// A material library and what was not used of it.
#[derive(Debug)]
pub(super) struct Library {
    /// The materials by name.
    pub(super) materials: HashMap<String, Material>,
    /// What was ignored or repaired.
    pub(super) warnings: Vec<Warning>,
}

/// Reads a material library. `file` is only a name for messages.
///
/// # Errors
/// The bytes are no text, a number is none, or there are too many materials.
pub(super) fn read_mtl(file: &Path, bytes: &[u8]) -> Result<Library, ReadError> {
    let text = decode(file, bytes)?;
    let mut reader = Reader {
        file,
        warnings: WarningLog::new(file),
        materials: HashMap::new(),
        draft: None,
        textures: HashSet::new(),
        first_texture: 0,
    };
    for statement in Statements::new(text) {
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
    /// `Tf`.
    filter: Option<Color>,
}

struct Reader<'a> {
    file: &'a Path,
    warnings: WarningLog,
    materials: HashMap<String, Material>,
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
            });
            return Ok(());
        }
        let lower = keyword.to_ascii_lowercase();
        if lower.starts_with("map_")
            || matches!(&*lower, "bump" | "disp" | "decal" | "refl" | "norm")
        {
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
            "Ns" => Some(N(self.number(statement, "Ns")?)),
            "Ni" => Some(N(self.number(statement, "Ni")?)),
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
            ("Kd", C(color)) => draft.material.diffuse = color,
            ("Ks", C(color)) => draft.material.specular = color,
            ("Ke", C(color)) => draft.material.emission = color,
            ("Tf", C(color)) => draft.filter = Some(color),
            ("Ns", N(exponent)) if exponent >= 0.0 => draft.material.shininess = exponent,
            ("Ni", N(ior)) if ior > 0.0 => draft.material.ior = ior,
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
        let filter = draft.filter.unwrap_or(Color::ONE);
        let is_glass = matches!(draft.illumination, Some(4 | 6 | 7 | 9));
        material.transmission = match draft.filter {
            Some(filter) if is_glass && transparency == 0.0 => filter,
            _ => transparency * filter,
        };
        if material.transmission == Color::ZERO {
            material.ior = 1.0;
        }
        let name = material.name.clone();
        if self.materials.insert(name, draft.material).is_some() {
            self.warnings
                .add(place, "a material is defined twice: the last one counts");
        }
    }

    /// Reads three numbers, or one for all three channels. A spectral curve or CIE coordinates
    /// are not read: `None`.
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
        let mut channels = [0.0; 3];
        let mut count = 0;
        for (channel, word) in channels.iter_mut().zip(statement.arguments()) {
            *channel = self.parse(statement, word, entity, EXPECTED)?;
            count += 1;
        }
        match count {
            1 => channels = [channels[0]; 3],
            3 => {}
            _ => return Err(self.ended(statement, entity, EXPECTED)),
        }
        if channels.iter().any(|&c| c < 0.0) {
            self.warnings.add(
                place,
                format!("`{entity}` has a negative channel: 0 is used"),
            );
        }
        Ok(Some(Color::from_array(channels.map(|c| c.max(0.0)))))
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
                1 => "1 texture is not read; the plain colours are used".to_owned(),
                count => format!("{count} textures are not read; the plain colours are used"),
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
mod tests {
    use super::*;

    fn read(text: &str) -> Library {
        read_mtl(Path::new("a.mtl"), text.as_bytes()).unwrap()
    }

    fn refusal(text: &str) -> String {
        read_mtl(Path::new("a.mtl"), text.as_bytes())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn every_statement_that_is_used() {
        let library = read(
            "newmtl glass of water\n Kd 0.1 0.2 0.3 # x\nKs 0.5\nNs 32\nKe 1 2 3\nd 0.25\n\
             Tf 1 0.5 0\nNi 1.5\nillum 7\nKa 1 1 1\n",
        );
        let expected = Material {
            name: "glass of water".into(),
            diffuse: Color::new(0.1, 0.2, 0.3),
            specular: Color::splat(0.5),
            shininess: 32.0,
            reflection: Color::splat(0.5),
            transmission: Color::new(0.75, 0.375, 0.0),
            ior: 1.5,
            emission: Color::new(1.0, 2.0, 3.0),
            ..Material::default()
        };
        assert_eq!(library.materials["glass of water"], expected);
        assert_eq!(library.warnings, []);
    }

    #[test]
    fn illumination_models_decide_about_the_mirror() {
        for (model, mirrors) in [
            (0, false),
            (1, false),
            (2, false),
            (3, true),
            (4, false),
            (5, true),
        ] {
            let library = read(&format!("newmtl a\nKs 1 1 1\nillum {model}"));
            let expected = if mirrors { Color::ONE } else { Color::ZERO };
            assert_eq!(library.materials["a"].reflection, expected, "illum {model}");
        }
    }

    #[test]
    fn dissolve_wins_over_transparency() {
        let transmission = |text: &str| read(text).materials["a"].transmission;
        assert_eq!(transmission("newmtl a\nd 1\nTr 1"), Color::ZERO);
        assert_eq!(transmission("newmtl a\nTr 0.25"), Color::splat(0.25));
        assert_eq!(transmission("newmtl a\nd -halo 0.5"), Color::splat(0.5));
        assert_eq!(transmission("newmtl a\nTf 1 1 1\nillum 2"), Color::ZERO);
        assert_eq!(
            transmission("newmtl a\nTf 1 1 0\nillum 7\nd 1"),
            Color::new(1.0, 1.0, 0.0)
        );
        assert_eq!(transmission("newmtl a\nTf 1 0 0\nillum 4"), Color::X);
        assert_eq!(transmission("newmtl a\nillum 4"), Color::ZERO);
        assert_eq!(transmission("newmtl a\nd 7"), Color::ZERO);
    }

    #[test]
    fn what_is_not_used_is_said_once() {
        let library = read(
            "Kd 1 1 1\nnewmtl a\nmap_Kd a.png\nmap_Ks a.png\nbump -bm 1 b.png\nPr 0.5\nPr 0.5\n\
             Kd -1 0 0\nNs -5\nd 7\nKs xyz 1 1 1\nnewmtl a",
        );
        let texts: Vec<_> = library.warnings.iter().map(Warning::to_string).collect();
        assert_eq!(
            texts,
            [
                "a.mtl:1: statements before the first `newmtl` are ignored",
                "a.mtl:6: `Pr` is not read (2 times; this is the first)",
                "a.mtl:8: `Kd` has a negative channel: 0 is used",
                "a.mtl:9: `Ns` is not positive: ignored",
                "a.mtl:11: `Ks` as a spectral curve or as xyz is not read",
                "a.mtl:2: `d` or `Tr` is not between 0 and 1: the nearer one is used",
                "a.mtl:12: a material is defined twice: the last one counts",
                "a.mtl:3: 2 textures are not read; the plain colours are used",
            ]
        );
    }

    #[test]
    fn garbled_numbers_are_refused_with_their_line() {
        assert!(
            refusal("newmtl a\nKd 1 x 1")
                .starts_with("a.mtl:2: in `Kd`: expected 3 numbers (red, green, blue), found `x`")
        );
        assert!(refusal("newmtl a\nKd 1 1").contains("found the end of the line"));
        assert!(refusal("newmtl a\n\nNs").starts_with("a.mtl:3: in `Ns`: expected a number"));
        assert!(refusal("d nan").starts_with("a.mtl:1: in `d`: expected a number, found `nan`"));
    }
}
