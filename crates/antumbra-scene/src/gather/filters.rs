//! Filters of see-through surfaces, in the form in which the geometry asks for them.
//!
//! In: materials that transmit or blend. Out: one filter a material. Invariant: a filter lets through what
//! [`Material::transmittance`] says, and owns what it needs. Absent here: refraction; light goes straight on. Paper 6.3.

use std::collections::HashMap;
use std::sync::Arc;

use antumbra_geometry::{Filter, FilterId, OccludersBuilder, Tint};

use crate::model::{Color, Material, Scene, Texture};

/// A see-through material over its texture.
#[derive(Debug)]
struct FilteringTexture {
    texture: Arc<Texture>,
    material: Material,
}

impl Filter for FilteringTexture {
    fn transmittance_at(&self, uv: [f64; 2]) -> [f64; 3] {
        let [.., alpha] = self.texture.sample(uv);
        self.material.transmittance(alpha).to_array()
    }
}

/// How faces of a see-through material are there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filters {
    /// Those with texture coordinates.
    pub(super) textured: Option<FilterId>,
    /// All others; `None` where all light passes.
    pub(super) whole: Option<FilterId>,
}

/// The filters made so far.
#[derive(Default)]
pub(super) struct FiltersMade {
    textures: HashMap<usize, Arc<Texture>>,
    filters: HashMap<usize, Filters>,
}

impl FiltersMade {
    /// Returns the filters of material number `material`, made at the first call.
    pub(super) fn of(
        &mut self,
        scene: &Scene,
        material: usize,
        builder: &mut OccludersBuilder,
    ) -> Filters {
        if let Some(&known) = self.filters.get(&material) {
            return known;
        }
        let look = &scene.materials[material];
        let shares = look.transmittance(1.0);
        let whole = (shares != Color::ONE).then(|| Arc::new(Tint(shares.to_array())));
        let texture = look
            .diffuse_texture
            .and_then(|number| Some((number, scene.textures.get(number)?)));
        let texture = texture.filter(|(_, texture)| texture.alphas() != [255; 2]);
        let textured = texture.map(|(number, texture)| {
            let made = self.textures.entry(number);
            let texture = Arc::clone(made.or_insert_with(|| Arc::new(texture.clone())));
            let material = look.clone();
            builder.add_filter(Arc::new(FilteringTexture { texture, material }))
        });
        let whole = whole.map(|tint| builder.add_filter(tint));
        let filters = Filters { textured, whole };
        self.filters.insert(material, filters);
        filters
    }
}
