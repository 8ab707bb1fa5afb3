//! Pictures as files: OpenEXR, 32-bit float, linear.
//!
//! In: a picture and its layers. Out: one file, a part a layer: `beauty` with channels `B`, `G`
//! and `R` (Rec. 709 primaries, the scene's own units, no exposure), then the layers of
//! [`crate::aov`] by their names. Channels are sorted by name, as the format asks. Invariant:
//! equal pictures give equal bytes, whatever the number of threads: compression runs on one.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, Vec2, WritableImage as _,
};

use crate::aov;
use crate::film::Picture;
use crate::image_file::{ImageFileError, SOFTWARE};

/// The name of the part with the picture itself.
pub const BEAUTY: &str = "beauty";

/// Returns the bytes that [`write_exr`] takes beside picture and layers, before any is taken.
pub fn predict_bytes(size: [u32; 2], layer_channel_count: usize) -> u64 {
    let samples = u64::from(size[0]) * u64::from(size[1]) * (3 + layer_channel_count as u64);
    samples * size_of::<f32>() as u64
}

/// Writes a picture and its layers as OpenEXR to `path`, replacing what was there.
///
/// # Errors
/// The file cannot be written or renamed; what was at `path` is then untouched.
pub fn write_exr(
    path: &Path,
    picture: &Picture,
    layers: &[aov::Layer],
) -> Result<(), ImageFileError> {
    let [width, height] = picture.size.map(|n| n as usize);
    let size = Vec2(width, height);
    let part = |name: &str, channels: Vec<(&str, Vec<f32>)>| {
        let channels = channels
            .into_iter()
            .map(|(name, values)| AnyChannel::new(name, FlatSamples::F32(values)))
            .collect();
        let attributes = LayerAttributes {
            software_name: Some(SOFTWARE.into()),
            ..LayerAttributes::named(name)
        };
        Layer::new(
            size,
            attributes,
            Encoding::SMALL_FAST_LOSSLESS,
            AnyChannels::sort(channels),
        )
    };
    let plane = |channel: usize| picture.pixels.iter().map(|pixel| pixel[channel]).collect();
    let beauty = part(
        BEAUTY,
        vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))],
    );
    let others = layers
        .iter()
        .map(|layer| part(&layer.name, layer.channels.clone()));
    let parts: Vec<_> = std::iter::once(beauty).chain(others).collect();
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let image = Image::from_layers(attributes, parts);

    antumbra_files::write(path, ImageFileError::of(path), |file| {
        let written = image.write().non_parallel().to_buffered(file);
        written.map_err(|source| ImageFileError::Encode {
            path: path.to_owned(),
            source: Box::new(source),
        })
    })
}
