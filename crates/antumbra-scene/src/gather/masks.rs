//! Holes of masked surfaces, in the form in which the geometry asks for them.
//!
//! In: materials with a mask and a texture. Out: one coverage a material. Invariant: a coverage is
//! solid exactly where [`Material::coverage`] says so, and owns what it needs: the texture is
//! copied once for all materials that share it.

use std::collections::HashMap;
use std::sync::Arc;

use crate::model::{Alpha, Filter, Material, Scene, Texture, Wrap};
use antumbra_geometry::{Coverage, CoverageId, OccludersBuilder};

/// A masked material over its texture.
#[derive(Debug)]
struct MaskedTexture {
    texture: Arc<Texture>,
    material: Material,
    /// The least and greatest alpha of the whole texture.
    alphas: [u8; 2],
}

impl MaskedTexture {
    /// Returns whether a place is there where the texture's alpha is a byte's, and so for all that mixing bytes no
    /// less (or no greater) can give, rounding counted.
    fn is_solid_for(&self, alpha: u8, slack: f64) -> bool {
        self.material.coverage(f64::from(alpha) / 255.0 + slack) > 0.0
    }
}

impl Coverage for MaskedTexture {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        self.material.coverage(self.texture.sample_alpha(uv)) > 0.0
    }

    fn is_solid_throughout(&self, low: [f64; 2], high: [f64; 2]) -> Option<bool> {
        /// Far more than filtering rounds, far less than a step of a byte.
        const ROUNDING: f64 = 1e-9;
        let [least, greatest] = self.texture.alphas_in(low, high, self.alphas)?;
        if self.is_solid_for(least, -ROUNDING) {
            Some(true)
        } else if !self.is_solid_for(greatest, ROUNDING) {
            Some(false)
        } else {
            None
        }
    }

    fn identify(&self, write: &mut dyn FnMut(&[u8])) -> bool {
        let Texture {
            name: _,
            width,
            height,
            texels,
            wrap,
            filter,
        } = &*self.texture;
        let Alpha::Mask { cutoff } = self.material.alpha else {
            // Nothing else has holes.
            return false;
        };
        for number in [self.material.opacity, cutoff] {
            write(&number.to_le_bytes());
        }
        for side in [width, height] {
            write(&side.to_le_bytes());
        }
        write(&wrap.map(|wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::MirroredRepeat => 1,
            Wrap::ClampToEdge => 2,
        }));
        write(&[match filter {
            Filter::Nearest => 0,
            Filter::Linear => 1,
        }]);
        // The color of a place does not say whether it is there.
        let alphas: Vec<u8> = texels.iter().map(|&[.., alpha]| alpha).collect();
        write(&alphas);
        true
    }
}

/// The coverages made so far.
#[derive(Default)]
pub(super) struct Masks {
    textures: HashMap<usize, Arc<Texture>>,
    coverages: HashMap<usize, CoverageId>,
}

impl Masks {
    /// Returns the coverage of material number `material`, made at the first call; `None` if the
    /// material has no texture that is there.
    pub(super) fn coverage(
        &mut self,
        scene: &Scene,
        material: usize,
        builder: &mut OccludersBuilder,
    ) -> Option<CoverageId> {
        if let Some(&known) = self.coverages.get(&material) {
            return Some(known);
        }
        let look = scene.materials.get(material)?;
        let number = look.diffuse_texture?;
        let texture = scene.textures.get(number)?;
        let shared = self
            .textures
            .entry(number)
            .or_insert_with(|| Arc::new(texture.clone()));
        let coverage = builder.add_coverage(Arc::new(MaskedTexture {
            texture: Arc::clone(shared),
            material: look.clone(),
            alphas: texture.alphas(),
        }));
        self.coverages.insert(material, coverage);
        Some(coverage)
    }
}
