//! What a hit looks like: normals, texture, coverage, relief.
//!
//! In: a hit. Out: what shading needs of the scene there. Invariant: what is interpolated over a
//! triangle uses the hit's barycentric weights and the outline's corners; a triangle with a corner
//! that the file does not know (where an outline crosses itself) is flat and untextured.

use antumbra_geometry::{DVec3, Hit, Opacity, SurfaceId};
use antumbra_scene::gather::face_of;
use antumbra_scene::model::{Alpha, Color, Corner, Material, Mesh, Shape};

use super::Prepared;
use super::look::Look;
use super::relief::{Picture, Relief};
use crate::vector::unit;

impl Prepared {
    /// Returns how a surface looks, its texture left out.
    pub fn material(&self, surface: SurfaceId) -> &Material {
        let place = self.gathered.place_of(surface);
        &self.scene.materials[self.scene.objects[place.object as usize].material]
    }

    /// Returns how the surface looks at a hit, from the side `viewer_side`: positive for the side of
    /// the geometric normal, negative for the other.
    ///
    /// The back of a material that is not double-sided covers nothing, unless it transmits light,
    /// which has to get out again. Where the geometry has cut holes, a hit is on what is left.
    pub fn look(&self, hit: &Hit, viewer_side: i8) -> Look<'_> {
        let material = self.material(hit.surface);
        let texture = material
            .diffuse_texture
            .and_then(|number| self.scene.textures.get(number));
        let [red, green, blue, alpha] = texture
            .zip(self.uv(hit))
            .map_or([1.0; 4], |(texture, uv)| texture.sample(uv));

        let [r, g, b, a] = self.vertex_color(hit).unwrap_or([1.0; 4]);
        let tint = Color::new(red, green, blue) * Color::new(r, g, b);

        let is_culled =
            viewer_side < 0 && !material.is_double_sided && material.transmission == Color::ZERO;
        let coverage = if is_culled {
            0.0
        } else if material.alpha == Alpha::Opaque || self.has_holes(hit.surface) {
            1.0
        } else {
            material.coverage(alpha * a)
        };
        Look {
            material,
            diffuse: material.diffuse * tint,
            coverage,
        }
    }

    /// Returns whether a material has a relief.
    pub fn has_reliefs(&self) -> bool {
        let mut materials = self.scene.materials.iter();
        materials.any(|material| material.bump.is_some())
    }

    /// Returns the relief at a hit, if the surface has one there.
    pub(crate) fn relief(&self, hit: &Hit) -> Option<Relief<'_>> {
        let bump = self.material(hit.surface).bump?;
        let Some(texture) = bump.texture() else {
            return Relief::in_space(bump, hit.point);
        };
        let texture = self.scene.textures.get(texture)?;
        let corners = self.gathered.occluders().triangle_positions(hit.surface)?;
        let places = self.corner_uvs(hit)?;
        let picture = Picture::on_triangle(texture, self.uv(hit)?, corners, places)?;
        Relief::in_picture(bump, picture, hit.point)
    }

    /// Returns the place of a hit in its texture, or `None` where the file gives none.
    pub fn uv(&self, hit: &Hit) -> Option<[f64; 2]> {
        self.between_corners(
            hit,
            |mesh| !mesh.uvs.is_empty(),
            |mesh, corner| mesh.uvs.get(corner.uv as usize).copied(),
        )
    }

    /// Returns the color and alpha of the vertices at a hit, or `None` where the file gives none.
    fn vertex_color(&self, hit: &Hit) -> Option<[f64; 4]> {
        self.between_corners(
            hit,
            |mesh| !mesh.colors.is_empty(),
            |mesh, corner| {
                let color = mesh.colors.get(corner.position as usize)?;
                Some(color.map(f64::from))
            },
        )
    }

    /// Interpolates what corners of a mesh have, weighted by the hit's place in its triangle. A face
    /// with a corner that has none has none as a whole. `is_there` saves the way to meshes without any.
    fn between_corners<const N: usize>(
        &self,
        hit: &Hit,
        is_there: impl Fn(&Mesh) -> bool,
        value_of: impl Fn(&Mesh, &Corner) -> Option<[f64; N]>,
    ) -> Option<[f64; N]> {
        let [a, b, c] = self.of_corners(hit, is_there, value_of)?;
        let [second, third] = hit.barycentric;
        Some(std::array::from_fn(|i| {
            a[i] + (b[i] - a[i]) * second + (c[i] - a[i]) * third
        }))
    }

    /// Returns the places in its texture of the corners of a hit's triangle, or `None` where the file gives none.
    fn corner_uvs(&self, hit: &Hit) -> Option<[[f64; 2]; 3]> {
        self.of_corners(
            hit,
            |mesh| !mesh.uvs.is_empty(),
            |mesh, corner| mesh.uvs.get(corner.uv as usize).copied(),
        )
    }

    /// Returns what the corners of a hit's triangle have, as [`Prepared::between_corners`] takes it.
    fn of_corners<const N: usize>(
        &self,
        hit: &Hit,
        is_there: impl Fn(&Mesh) -> bool,
        value_of: impl Fn(&Mesh, &Corner) -> Option<[f64; N]>,
    ) -> Option<[[f64; N]; 3]> {
        let place = self.gathered.place_of(hit.surface);
        let mesh = self.scene.objects[place.object as usize].shape.mesh()?;
        if !is_there(mesh) {
            return None;
        }
        let corners = self.gathered.occluders().corners(hit.surface)?;
        let face = face_of(mesh, place.face as usize)?;
        let value_of = |corner: &Corner| value_of(mesh, corner);
        if face.iter().any(|corner| value_of(corner).is_none()) {
            return None;
        }
        let [a, b, c] = corners.map(|corner| face.get(corner as usize).and_then(value_of));
        Some([a?, b?, c?])
    }

    /// Returns whether the geometry asks a coverage about this surface.
    fn has_holes(&self, surface: SurfaceId) -> bool {
        let occluders = self.gathered.occluders();
        let element = &occluders.elements()[occluders.element_of(surface).0 as usize];
        matches!(element.opacity, Opacity::AlphaTested(_))
    }

    /// Returns the unit geometric normal at a hit: by the winding, or outwards.
    pub fn geometric_normal(&self, hit: &Hit) -> DVec3 {
        self.gathered.occluders().normal_at(hit.surface, hit.point)
    }

    /// Returns the unit shading normal at a hit: the vertex normals weighted by the hit's place in
    /// its triangle, on the same side as `geometric_normal`, which stands in for vertex normals
    /// that are missing or zero. The winding, not the vertex normals, says which side is front.
    pub fn shading_normal(&self, hit: &Hit, geometric_normal: DVec3) -> DVec3 {
        let Some(normals) = self.vertex_normals(hit.surface) else {
            let occluders = self.gathered.occluders();
            return match occluders.is_freeform(hit.surface) {
                true => occluders.smooth_normal_at(hit.surface, hit.point),
                false => geometric_normal,
            };
        };
        let [second, third] = hit.barycentric;
        let [a, b, c] = normals.map(|normal| normal.and_then(unit).unwrap_or(geometric_normal));
        let sum = a * (1.0 - second - third) + b * second + c * third;
        let normal = unit(sum).unwrap_or(geometric_normal);
        if normal.dot(geometric_normal) < 0.0 {
            -normal
        } else {
            normal
        }
    }

    /// Returns the file's normals at the corners of a triangle, as long as they were written, or
    /// `None` where it has none at all.
    fn vertex_normals(&self, surface: SurfaceId) -> Option<[Option<DVec3>; 3]> {
        let place = self.gathered.place_of(surface);
        match &self.scene.objects[place.object as usize].shape {
            Shape::Polygon(polygon) if !polygon.normals.is_empty() => {
                let corners = self.gathered.occluders().corners(surface)?;
                Some(corners.map(|corner| polygon.normals.get(corner as usize).copied()))
            }
            shape => {
                let mesh = shape.mesh().filter(|mesh| !mesh.normals.is_empty())?;
                let corners = self.gathered.occluders().corners(surface)?;
                let face = face_of(mesh, place.face as usize)?;
                Some(corners.map(|corner| {
                    let normal = face.get(corner as usize)?.normal as usize;
                    match shape {
                        Shape::Instance(instance) => instance.normal(normal),
                        _ => mesh.normals.get(normal).copied(),
                    }
                }))
            }
        }
    }
}
