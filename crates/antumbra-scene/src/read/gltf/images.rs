//! Pictures of a document.
//!
//! In: textures, images and samplers. Out: the scene's textures, each pair of image and sampler
//! once, or the mean colour of a picture where the model has no texture. Invariant: a picture that
//! cannot be read is a warning, never an error; all together take no more than a [`PictureBudget`].

use std::{borrow::Cow, collections::HashMap};

use crate::{
    error::{Place, quoted},
    model::{Filter, Texture, Wrap},
    texture::{PictureBudget, decode},
    warning::WarningLog,
};

use super::{
    buffers::{Buffers, Open},
    document::{Sampler, TextureUse},
    short_name, uri,
};

/// Reads pictures as they are needed.
pub(super) struct Images<'a, 'w> {
    buffers: &'a Buffers<'a>,
    open: &'w mut Open<'w>,
    budget: PictureBudget,
    /// The scene's textures so far.
    pub(super) textures: Vec<Texture>,
    known: HashMap<(usize, [Wrap; 2], Filter), Option<usize>>,
    means: HashMap<usize, Option<Means>>,
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
    pub(super) fn new(buffers: &'a Buffers<'a>, open: &'w mut Open<'w>) -> Self {
        Self {
            buffers,
            open,
            budget: PictureBudget::default(),
            textures: Vec::new(),
            known: HashMap::new(),
            means: HashMap::new(),
        }
    }

    /// Returns the index of the scene's texture for a use of a picture, `None` with a warning if
    /// it cannot be read.
    pub(super) fn texture(
        &mut self,
        texture: &TextureUse,
        warnings: &mut WarningLog,
    ) -> Option<usize> {
        let (image, sampler) = self.find(texture, warnings)?;
        let (wrap, filter) = sampler.map_or_else(Default::default, |s| sampling(s, warnings));
        if let Some(&known) = self.known.get(&(image, wrap, filter)) {
            return known;
        }
        let read = self.decode(image, warnings).map(|texture| {
            self.textures.push(Texture {
                wrap,
                filter,
                ..texture
            });
            self.textures.len() - 1
        });
        self.known.insert((image, wrap, filter), read);
        read
    }

    /// Returns the mean of a picture, `None` with a warning if it cannot be read.
    pub(super) fn means(
        &mut self,
        texture: &TextureUse,
        warnings: &mut WarningLog,
    ) -> Option<Means> {
        let (image, _) = self.find(texture, warnings)?;
        if let Some(&known) = self.means.get(&image) {
            return known;
        }
        let known = self.known.iter().find(|((i, ..), _)| *i == image);
        let means = match known {
            Some((_, texture)) => texture.map(|t| means(&self.textures[t])),
            None => self.decode(image, warnings).as_ref().map(means),
        };
        self.means.insert(image, means);
        means
    }

    /// Returns the index of a texture's image, and its sampler.
    fn find(
        &self,
        texture: &TextureUse,
        warnings: &mut WarningLog,
    ) -> Option<(usize, Option<&'a Sampler>)> {
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
        Some((image, sampler))
    }

    fn decode(&mut self, index: usize, warnings: &mut WarningLog) -> Option<Texture> {
        match self.try_decode(index) {
            Ok(texture) => Some(texture),
            Err(problem) => {
                let message = format!(
                    "images[{index}] cannot be read, plain colours are used instead: {problem}"
                );
                warnings.add(Place::Whole, message);
                None
            }
        }
    }

    fn try_decode(&mut self, index: usize) -> Result<Texture, String> {
        let buffers = self.buffers;
        let Some(image) = buffers.document().images.get(index) else {
            return Err("it is not there".into());
        };
        let mut name = short_name(&image.name);
        let bytes: Cow<'_, [u8]> = match (&image.uri, image.buffer_view) {
            (Some(uri), None) => match uri::resolve(uri)? {
                uri::Target::Bytes(bytes) => bytes.into(),
                uri::Target::Name(file) => {
                    let read = (self.open)(&file);
                    let bytes = read.map_err(|error| format!("{}: {error}", quoted(&file)))?;
                    if name.is_empty() {
                        name = short_name(&file);
                    }
                    bytes.into()
                }
            },
            (None, Some(view)) => {
                let bytes = buffers.view(view, || format!("images[{index}].bufferView"));
                bytes.map_err(|fault| fault.kind.to_string())?.into()
            }
            _ => return Err("expected either `uri` or `bufferView`".into()),
        };
        let texture = decode(&bytes, &mut self.budget)?;
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
