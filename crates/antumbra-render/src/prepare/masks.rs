//! Holes of masked surfaces, in the form in which the geometry asks for them.
//!
//! In: materials with a mask and a texture. Out: one coverage a material. Invariant: a coverage is
//! solid exactly where [`Material::coverage`] says so, and owns what it needs: the texture is
//! copied once for all materials that share it.

use std::collections::HashMap;
use std::sync::Arc;

use antumbra_geometry::{Coverage, CoverageId, OccludersBuilder};
use antumbra_scene::model::{Material, Scene, Texture};

/// A masked material over its texture.
#[derive(Debug)]
struct MaskedTexture {
    texture: Arc<Texture>,
    material: Material,
}

impl Coverage for MaskedTexture {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        let [.., alpha] = self.texture.sample(uv);
        self.material.coverage(alpha) > 0.0
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
        }));
        self.coverages.insert(material, coverage);
        Some(coverage)
    }
}
