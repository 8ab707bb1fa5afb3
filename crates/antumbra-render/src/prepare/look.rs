//! How a surface looks in one place.

use antumbra_scene::model::{Color, Material};

/// How a surface looks in one place.
#[derive(Clone, Copy, Debug)]
pub struct Look<'a> {
    /// The material, without its texture.
    pub material: &'a Material,
    /// The diffuse color, times the texture's and the vertices'.
    pub diffuse: Color,
    /// How much of what is behind the surface covers: 0, it is not there, to 1, it is whole.
    pub coverage: f64,
}
