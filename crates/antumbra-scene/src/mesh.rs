//! Meshes as plain data.

use antumbra_geometry::DVec3;
use serde::{Deserialize, Serialize};

/// Polygonal faces over shared positions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Vertex positions, world space.
    pub positions: Vec<DVec3>,
    /// Shading normals; corners name them by index. May be empty.
    pub normals: Vec<DVec3>,
    /// Places in the material's texture, as [`Texture::sample`](crate::model::Texture::sample) takes them; corners name them by
    /// index. May be empty. A corner has one: where a file has several sets, or moves them by a
    /// transform, its reader has chosen the set of the material's texture and moved it.
    pub uvs: Vec<[f64; 2]>,
    /// Linear red, green, blue and alpha of each position, in the order of `positions`, or empty.
    /// They multiply the material's diffuse color and its opacity. Finite, not negative; alpha is
    /// at most 1.
    pub colors: Vec<[f32; 4]>,
    /// All corners of all faces, face after face.
    pub corners: Vec<Corner>,
    /// End of each face in `corners`; face `i` is `ends[i - 1]..ends[i]`. At least 3 corners each.
    pub face_ends: Vec<u32>,
}

/// One corner of a mesh face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Corner {
    /// Index into [`Mesh::positions`].
    pub position: u32,
    /// Index into [`Mesh::normals`], or [`Corner::NONE`].
    pub normal: u32,
    /// Index into [`Mesh::uvs`], or [`Corner::NONE`]: then the texture counts as white.
    pub uv: u32,
}

impl Corner {
    /// Says that a corner has no shading normal, or no place in the texture.
    pub const NONE: u32 = u32::MAX;

    /// Returns a corner with neither shading normal nor place in a texture.
    pub const fn at(position: u32) -> Self {
        Self {
            position,
            normal: Self::NONE,
            uv: Self::NONE,
        }
    }
}

impl Mesh {
    /// Returns the corners of each face in turn.
    pub fn faces(&self) -> impl Iterator<Item = &[Corner]> {
        let mut start = 0;
        self.face_ends.iter().map(move |&end| {
            let face = &self.corners[start..end as usize];
            start = end as usize;
            face
        })
    }
}
