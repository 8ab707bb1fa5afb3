//! Pictures of a document.
//!
//! In: textures, images and samplers. Out: the scene's textures, each pair of image and sampler
//! once, or the mean color of a picture where the model has no texture. Invariant: a picture that
//! cannot be read is a warning, never an error; one for which there is no room in memory is refused
//! before it is decoded: if shadows depend on it or it is to be seen, with the file.

use std::{borrow::Cow, collections::HashMap};

use crate::{
    error::{Place, ReadErrorKind, quoted},
    model::{Filter, Texture, Wrap},
    room::{OverLimit, Room},
    texture::{PictureError, decode},
    warning::WarningLog,
};

use super::{
    Fault,
    buffers::{Buffers, Open},
    document::{Sampler, TextureUse},
    short_name, uri,
};

/// Reads pictures as they are needed.
pub(super) struct Images<'a, 'w> {
    buffers: &'a Buffers<'a>,
    open: &'w mut Open<'w>,
    room: Room,
    /// The scene's textures so far.
    pub(super) textures: Vec<Texture>,
    known: HashMap<(Source<'a>, [Wrap; 2], Filter), Option<usize>>,
    means: HashMap<Source<'a>, Option<Means>>,
}

/// Where a picture's bytes are: several entries of a document may name one picture.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Source<'a> {
    Uri(&'a str),
    View(usize),
}

/// Mean values of a picture, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Means {
    /// Red, green, blue decoded from sRGB, and alpha.
    pub(super) linear: [f64; 4],
    /// All four as they are stored.
    pub(super) stored: [f64; 4],
}

impl Means {
    /// What stands in for a picture that is missing or cannot be read.
    pub(super) const WHITE: Self = Self {
        linear: [1.0; 4],
        stored: [1.0; 4],
    };
}

impl<'a, 'w> Images<'a, 'w> {
    pub(super) fn new(buffers: &'a Buffers<'a>, open: &'w mut Open<'w>, room: Room) -> Self {
        Self {
            buffers,
            open,
            room,
            textures: Vec::new(),
            known: HashMap::new(),
            means: HashMap::new(),
        }
    }

    /// Returns the index of the scene's texture for a use of a picture, `None` with a warning if
    /// it cannot be read.
    ///
    /// # Errors
    /// There is no room for it.
    pub(super) fn texture(
        &mut self,
        texture: &TextureUse,
        warnings: &mut WarningLog,
    ) -> Result<Option<usize>, Fault> {
        let Some((image, source, sampler)) = self.find(texture, warnings) else {
            return Ok(None);
        };
        let (wrap, filter) = sampler.map_or_else(Default::default, |s| sampling(s, warnings));
        if let Some(&known) = self.known.get(&(source, wrap, filter)) {
            return Ok(known);
        }
        let read = match self.decoded(source) {
            Some(None) => None,
            Some(Some(other)) => {
                let bytes = 4 * self.textures[other].texels.len() as u64;
                let here = || format!("images[{image}]");
                self.room.take(bytes, here).map_err(Fault::over_limit)?;
                Some(self.textures[other].clone())
            }
            None => {
                let mut room = self.room.clone();
                let read = self.decode(image, source, &mut room, warnings);
                self.room = room;
                read.map_err(Fault::over_limit)?
            }
        };
        let number = read.map(|texture| {
            self.textures.push(Texture {
                wrap,
                filter,
                ..texture
            });
            self.textures.len() - 1
        });
        self.known.insert((source, wrap, filter), number);
        Ok(number)
    }

    /// Returns the mean of a picture, `None` with a warning if it cannot be read or, unless it
    /// `decides` about shadows, if there is no room for it.
    ///
    /// # Errors
    /// There is no room for it.
    pub(super) fn means(
        &mut self,
        texture: &TextureUse,
        decides: bool,
        warnings: &mut WarningLog,
    ) -> Result<Option<Means>, Fault> {
        let Some((image, source, _)) = self.find(texture, warnings) else {
            return Ok(None);
        };
        if let Some(&known) = self.means.get(&source) {
            return Ok(known);
        }
        let means = match self.decoded(source) {
            Some(known) => known.map(|texture| means(&self.textures[texture])),
            None => {
                // It is given back at once.
                let mut room = self.room.clone();
                match self.decode(image, source, &mut room, warnings) {
                    Ok(texture) => texture.as_ref().map(means),
                    Err(over) if decides => return Err(Fault::over_limit(over)),
                    Err(over) => {
                        let kind = ReadErrorKind::from(over);
                        let message = format!("images[{image}] is not read: {kind}");
                        warnings.add(Place::Whole, message);
                        None
                    }
                }
            }
        };
        self.means.insert(source, means);
        Ok(means)
    }

    /// Returns the texture of a picture that was decoded for another use, or `None` in it where it
    /// could not be.
    fn decoded(&self, source: Source<'_>) -> Option<Option<usize>> {
        let mut known = self.known.iter();
        known.find_map(|((s, ..), texture)| (*s == source).then_some(*texture))
    }

    /// Returns the index of a texture's image, where that is, and its sampler.
    fn find(
        &self,
        texture: &TextureUse,
        warnings: &mut WarningLog,
    ) -> Option<(usize, Source<'a>, Option<&'a Sampler>)> {
        let document = self.buffers.document();
        let index = texture.index;
        let mut fail = |problem: String| {
            let message = format!("textures[{index}] {problem}: it is not read");
            warnings.add(Place::Whole, message);
            None
        };
        let Some(entry) = document.textures.get(index) else {
            return fail("is not there".into());
        };
        let Some(image) = entry.source else {
            return fail("names no image in a format that is read".into());
        };
        let sampler = match entry.sampler {
            None => None,
            Some(sampler) => match document.samplers.get(sampler) {
                None => return fail(format!("names samplers[{sampler}], which is not there")),
                sampler => sampler,
            },
        };
        let source = match document.images.get(image) {
            None => return fail(format!("names images[{image}], which is not there")),
            Some(entry) => match (&entry.uri, entry.buffer_view) {
                (Some(uri), None) => Source::Uri(uri),
                (None, Some(view)) => Source::View(view),
                _ => {
                    return fail(format!(
                        "names images[{image}]: expected either `uri` or `bufferView` there"
                    ));
                }
            },
        };
        Some((image, source, sampler))
    }

    /// Decodes a picture; `None` with a warning if it cannot be read.
    fn decode(
        &mut self,
        index: usize,
        source: Source<'_>,
        room: &mut Room,
        warnings: &mut WarningLog,
    ) -> Result<Option<Texture>, OverLimit> {
        match self.try_decode(index, source, room) {
            Ok(texture) => Ok(Some(texture)),
            Err(PictureError::OverLimit(over)) => Err(over.inside(&format!("images[{index}]"))),
            Err(PictureError::Unreadable(problem)) => {
                let message = format!(
                    "images[{index}] cannot be read, plain colors are used instead: {problem}"
                );
                warnings.add(Place::Whole, message);
                Ok(None)
            }
        }
    }

    fn try_decode(
        &mut self,
        index: usize,
        source: Source<'_>,
        room: &mut Room,
    ) -> Result<Texture, PictureError> {
        let buffers = self.buffers;
        let mut name = short_name(&buffers.document().images[index].name);
        let bytes: Cow<'_, [u8]> = match source {
            Source::Uri(uri) => match uri::resolve(uri)? {
                uri::Target::Bytes(bytes) => bytes.into(),
                uri::Target::Name(file) => {
                    let read = (self.open)(&file);
                    let bytes = read.map_err(|error| match room.over_limit(&error, &file) {
                        Some(over) => PictureError::OverLimit(over),
                        None => PictureError::Unreadable(format!("{}: {error}", quoted(&file))),
                    })?;
                    if name.is_empty() {
                        name = short_name(&file);
                    }
                    bytes.into()
                }
            },
            Source::View(view) => {
                let bytes = buffers.view(view, || format!("images[{index}].bufferView"));
                bytes.map_err(|fault| fault.kind.to_string())?.into()
            }
        };
        room.check(bytes.len() as u64, || "the file".into())
            .map_err(PictureError::OverLimit)?;
        let texture = decode(&bytes, room)?;
        Ok(Texture { name, ..texture })
    }
}

fn means(texture: &Texture) -> Means {
    let mut sums = [0_u64; 4];
    for texel in &texture.texels {
        for (sum, &byte) in sums.iter_mut().zip(texel) {
            *sum += u64::from(byte);
        }
    }
    let all = 255.0 * texture.texels.len() as f64;
    Means {
        linear: texture.mean(),
        stored: sums.map(|sum| sum as f64 / all),
    }
}

fn sampling(sampler: &Sampler, warnings: &mut WarningLog) -> ([Wrap; 2], Filter) {
    let mut strange = |what: &str, code: u32| {
        let message = format!("{code} is no {what} of textures: the usual one is used");
        warnings.add(Place::Whole, message);
    };
    let wrap = [sampler.wrap_s, sampler.wrap_t].map(|code| match code {
        None | Some(10497) => Wrap::Repeat,
        Some(33648) => Wrap::MirroredRepeat,
        Some(33071) => Wrap::ClampToEdge,
        Some(code) => {
            strange("wrap mode", code);
            Wrap::Repeat
        }
    });
    let filter = match sampler.mag_filter {
        Some(9728) => Filter::Nearest,
        None | Some(9729) => Filter::Linear,
        Some(code) => {
            strange("filter", code);
            Filter::Linear
        }
    };
    (wrap, filter)
}
