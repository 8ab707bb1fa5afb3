//! Pictures of a scene, packed into the page.

use antumbra_render::film::Picture;
use antumbra_render::image_file::srgb_bytes;
use base64::Engine as _;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

use crate::measure::Stopwatch;
use antumbra_cli::failure::Failure;

use super::super::scenes::PaperScene;
use super::super::shot::Subject;
use super::super::{VOXEL, VOXEL_1990};

/// Sharp enough for edges of shadows; eighteen pictures stay below a megabyte.
const QUALITY: u8 = 85;

/// One scene's pictures as data URIs.
pub(super) struct ScenePictures {
    pub(super) name: &'static str,
    pub(super) size: [u32; 2],
    pub(super) plain: String,
    /// How queries were decided by `voxel-1990`.
    pub(super) by_1990: String,
    /// The same by `voxel` with all values made before.
    pub(super) by_voxel: String,
}

impl ScenePictures {
    /// Renders and packs.
    pub(super) fn take(paper_scene: &PaperScene, size: [u32; 2]) -> Result<Self, Failure> {
        let subject = Subject::new(paper_scene.make()?, size, paper_scene.paper.grid)?;
        let (plain, _) = subject.shoot(VOXEL, false, Stopwatch::new(1))?;
        Ok(Self {
            name: paper_scene.name,
            size,
            plain: packed(&plain.picture)?,
            by_1990: packed(&subject.decided_by(VOXEL_1990, false)?)?,
            by_voxel: packed(&subject.decided_by(VOXEL, true)?)?,
        })
    }
}

/// Returns a picture as a data URI.
pub(super) fn packed(picture: &Picture) -> Result<String, Failure> {
    let [width, height] = picture.size;
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
        .encode(
            &srgb_bytes(picture, 0.0),
            width,
            height,
            ExtendedColorType::Rgb8,
        )
        .map_err(|error| Failure::system(format!("cannot encode a picture: {error}")))?;
    let text = base64::engine::general_purpose::STANDARD.encode(jpeg);
    Ok(format!("data:image/jpeg;base64,{text}"))
}
