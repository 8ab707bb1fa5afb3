//! Pictures on the materials of an OBJ.
//!
//! In: what a material library names as `map_Kd` and `map_d`, and a way to open files. Out: textures,
//! each pair of pictures once. Invariant: what decides where holes are, the alpha, keeps the resolution
//! of its own picture; a picture that cannot be read is a warning, one for which there is no room in
//! memory an error, before it is decoded.
//!
//! Alpha is that of `map_d`: its alpha channel if it has one, else its luminance, unless `-imfchan` says
//! which. Without `map_d` it is that of `map_Kd`. Where alpha is below 1/2 there is a hole, as with
//! glTF's MASK.
//!
//! A relief is a picture of heights (`bump`, `map_Bump`) or of normals (`norm`). Exporters write pictures of normals as
//! `map_Bump`, too: one whose mean color is that of normals is taken for that.

use std::{collections::HashMap, io};

use crate::{
    error::{Place, ReadErrorKind, quoted},
    model::{Alpha, Bump, Material, Texture, Wrap},
    room::{OverLimit, Room},
    texture::{PictureError, decode},
    warning::WarningLog,
};

use super::super::mtl::map::{Map, Maps, Relief};

/// Opens files that an OBJ names.
pub(super) type Open<'a> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'a;

/// The least alpha that is there.
const CUTOFF: f64 = 0.5;

/// Reliefs that are higher by their multiplier are none.
const LARGEST_MULTIPLIER: f64 = 1e6;

/// Reads pictures as they are needed.
pub(super) struct Pictures {
    room: Room,
    /// The texture of each pair of pictures that was asked for.
    known: HashMap<String, Option<usize>>,
    /// That of each picture of a relief, and whether it is one of normals.
    reliefs: HashMap<String, Option<(usize, bool)>>,
}

impl Pictures {
    pub(super) fn new(room: Room) -> Self {
        Self {
            room,
            known: HashMap::new(),
            reliefs: HashMap::new(),
        }
    }

    /// Gives a material its texture, and its alpha test if that has holes.
    ///
    /// # Errors
    /// There is no room for a picture.
    pub(super) fn put_on(
        &mut self,
        material: &mut Material,
        maps: &Maps,
        textures: &mut Vec<Texture>,
        open: &mut Open<'_>,
        warnings: &mut WarningLog,
    ) -> Result<(), OverLimit> {
        material.bump = self.relief(maps, textures, open, warnings);
        let key = format!("{} {:?} {:?}", maps.folder, maps.color, maps.alpha);
        let texture = match self.known.get(&key) {
            Some(&known) => known,
            None => {
                let texture = self.texture(maps, open, warnings)?.map(|texture| {
                    textures.push(texture);
                    textures.len() - 1
                });
                self.known.insert(key, texture);
                texture
            }
        };
        let Some(number) = texture else {
            return Ok(());
        };
        material.diffuse_texture = Some(number);
        if textures[number].texels.iter().any(|texel| texel[3] < 255) {
            material.alpha = Alpha::Mask { cutoff: CUTOFF };
        }
        Ok(())
    }

    /// Returns the relief that a material has, if its picture can be read.
    fn relief(
        &mut self,
        maps: &Maps,
        textures: &mut Vec<Texture>,
        open: &mut Open<'_>,
        warnings: &mut WarningLog,
    ) -> Option<Bump> {
        let Relief { map, is_normals } = maps.relief.as_ref()?;
        if map.place != maps.place() {
            let message = "a relief that lies elsewhere than the other pictures is not read";
            warnings.add(Place::Whole, message);
            return None;
        }
        let multiplier = map.multiplier;
        if multiplier.abs() > LARGEST_MULTIPLIER {
            let message = format!("`-bm` is beyond {LARGEST_MULTIPLIER}: the relief is not read");
            warnings.add(Place::Whole, message);
            return None;
        }
        let key = format!("{} {} {}", maps.folder, map.is_clamped, map.name);
        let known = match self.reliefs.get(&key) {
            Some(&known) => known,
            None => {
                let what = "of a relief, the surface is smooth";
                let read = self.read_or_warn(maps, Some(map), what, open, warnings);
                // Looks alone are not worth a refusal.
                let read = read.unwrap_or_else(|over| {
                    let kind = ReadErrorKind::from(over);
                    let message = format!("a picture {what}: {kind}");
                    warnings.add(Place::Whole, message);
                    None
                });
                let read = read.map(|(mut texture, map)| {
                    if map.is_clamped {
                        texture.wrap = [Wrap::ClampToEdge; 2];
                    }
                    let is_normals = has_color_of_normals(&texture);
                    textures.push(texture);
                    (textures.len() - 1, is_normals)
                });
                self.reliefs.insert(key, read);
                read
            }
        };
        known.map(|(texture, looks_so)| match *is_normals || looks_so {
            true => Bump::Normals {
                texture,
                scale: multiplier,
            },
            false => Bump::Heights {
                texture,
                multiplier,
            },
        })
    }

    fn texture(
        &mut self,
        maps: &Maps,
        open: &mut Open<'_>,
        warnings: &mut WarningLog,
    ) -> Result<Option<Texture>, OverLimit> {
        let mut read = |map, what| self.read_or_warn(maps, map, what, open, warnings);
        let color = read(maps.color.as_ref(), "of `map_Kd`, plain colors are used")?;
        let alpha = read(maps.alpha.as_ref(), "of `map_d`, the surface is whole")?;
        let is_clamped = [&color, &alpha]
            .into_iter()
            .flatten()
            .any(|(_, map)| map.is_clamped);
        let mut texture = match (color, alpha) {
            (None, None) => return Ok(None),
            (Some((color, _)), None) => color,
            (color, Some((alpha, map))) => with_alpha(color.map(|(color, _)| color), alpha, map),
        };
        if is_clamped {
            texture.wrap = [Wrap::ClampToEdge; 2];
        }
        Ok(Some(texture))
    }

    fn read_or_warn<'m>(
        &mut self,
        maps: &Maps,
        map: Option<&'m Map>,
        what: &str,
        open: &mut Open<'_>,
        warnings: &mut WarningLog,
    ) -> Result<Option<(Texture, &'m Map)>, OverLimit> {
        let Some(map) = map else {
            return Ok(None);
        };
        match self.read(maps, map, open) {
            Ok(texture) => Ok(Some((texture, map))),
            Err(PictureError::OverLimit(over)) => Err(over.inside(&quoted(&map.name))),
            Err(PictureError::Unreadable(problem)) => {
                let name = quoted(&map.name);
                let message = format!("cannot read the picture {name} {what}: {problem}");
                warnings.add(Place::Whole, message);
                Ok(None)
            }
        }
    }

    /// Reads one picture: beside the library, or else beside the OBJ.
    fn read(
        &mut self,
        maps: &Maps,
        map: &Map,
        open: &mut Open<'_>,
    ) -> Result<Texture, PictureError> {
        let beside_library = format!("{}{}", maps.folder, map.name);
        let bytes = match open(&beside_library) {
            Err(error)
                if !maps.folder.is_empty() && error.kind() != io::ErrorKind::FileTooLarge =>
            {
                open(&map.name)
            }
            result => result,
        };
        let bytes = bytes.map_err(|error| match self.room.over_limit(&error, "the file") {
            Some(over) => PictureError::OverLimit(over),
            None => PictureError::Unreadable(error.to_string()),
        })?;
        let texture = decode(&bytes, &mut self.room)?;
        Ok(Texture {
            name: map.name.chars().take(80).collect(),
            ..texture
        })
    }
}

/// Returns whether the mean color of a picture is that of normals which stand up from a surface.
fn has_color_of_normals(texture: &Texture) -> bool {
    let mut sums = [0_u64; 3];
    for texel in &texture.texels {
        for (sum, &byte) in sums.iter_mut().zip(texel) {
            *sum += u64::from(byte);
        }
    }
    let [red, green, blue] = sums.map(|sum| sum as f64 / (255.0 * texture.texels.len() as f64));
    let is_half = |mean: f64| (mean - 0.5).abs() < 0.1;
    is_half(red) && is_half(green) && blue > 0.75
}

/// Puts the alpha of one picture on the colors of another, or on white. The result has the
/// resolution of the alpha, so that holes are where its picture says.
fn with_alpha(color: Option<Texture>, mut alpha: Texture, map: &Map) -> Texture {
    let channel = match map.channel {
        Some(b'r') => Channel::Stored(0),
        Some(b'g') => Channel::Stored(1),
        Some(b'b') => Channel::Stored(2),
        Some(b'm') => Channel::Stored(3),
        Some(_) => Channel::Luminance,
        None if alpha.texels.iter().any(|texel| texel[3] < 255) => Channel::Stored(3),
        None => Channel::Luminance,
    };
    let [base, gain] = map.base_and_gain;
    let value = |texel: [u8; 4]| {
        let stored = match channel {
            Channel::Stored(index) => texel[index],
            Channel::Luminance => luminance(texel),
        };
        if [base, gain] == [0.0, 1.0] {
            return stored;
        }
        // Not a number becomes 0.
        (255.0 * base + gain * f64::from(stored)).round() as u8
    };
    let Texture { width, height, .. } = alpha;
    let mut texels = std::mem::take(&mut alpha.texels);
    for (number, texel) in (0..).zip(&mut texels) {
        let [red, green, blue] = color.as_ref().map_or([255; 3], |color| {
            // The texel in whose place the middle of this one lies.
            let along = |index: u64, size: u32, of: u32| {
                (2 * index + 1) * u64::from(of) / (2 * u64::from(size))
            };
            let column = along(number % u64::from(width), width, color.width);
            let row = along(number / u64::from(width), height, color.height);
            let index = row * u64::from(color.width) + column;
            let [red, green, blue, _] = color.texels[index as usize];
            [red, green, blue]
        });
        *texel = [red, green, blue, value(*texel)];
    }
    Texture { texels, ..alpha }
}

enum Channel {
    Stored(usize),
    Luminance,
}

/// Returns the luminance of stored values (Rec. 709, in whole numbers so that grey stays as it is).
fn luminance([red, green, blue, _]: [u8; 4]) -> u8 {
    let sum = 2126 * u32::from(red) + 7152 * u32::from(green) + 722 * u32::from(blue);
    ((sum + 5000) / 10_000) as u8
}
