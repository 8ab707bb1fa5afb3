//! Objects become numbered surfaces.

use crate::model::{Corner, Light, LightKind, Mesh, Object, Scene, ShadowKind, Shape};
use antumbra_geometry::{
    CoverageId, DVec3, ElementId, LightShape, Occluders, OccludersBuilder, OccludersError, Opacity,
    SurfaceId,
};
use antumbra_task::checked;
use std::sync::Arc;

use super::error::GatherError;
use super::faces::face_of;
use super::filters::{Filters, FiltersMade};
use super::masks::Masks;
use super::memory::Sizes;

/// Place in the scene that an element comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// Which face of a mesh; 0 for other shapes.
    pub face: u32,
}

/// A scene's surfaces, numbered, before anything is built over them.
#[derive(Clone, Debug)]
pub struct Gathered {
    occluders: Arc<Occluders>,
    runs: Vec<Run>,
}

/// Elements that come from one object, its faces in order.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// The first of them; the others follow, up to the next run.
    first: u32,
    object: u32,
}

impl Gathered {
    /// Collects the surfaces of `scene`.
    ///
    /// # Errors
    /// A number or an index of the scene is out of range.
    pub fn of(scene: &Scene) -> Result<Self, GatherError> {
        let mut gathering = Gathering {
            scene,
            builder: Occluders::builder(),
            runs: Vec::with_capacity(scene.objects.len()),
            element_count: 0,
            masks: Masks::default(),
            filters: FiltersMade::default(),
        };
        let Sizes {
            faces,
            triangles,
            vertices,
            ..
        } = Sizes::of(scene);
        gathering.builder.reserve(faces, triangles, vertices);
        for (number, object) in checked(scene.objects.iter().enumerate()) {
            let name = || object.name.clone();
            gathering.add(number, object).map_err(|bad| match bad {
                Bad::Shape(source) => GatherError::BadObject {
                    object: number,
                    name: name(),
                    source,
                },
                Bad::Index(what) => GatherError::BadIndex {
                    object: number,
                    name: name(),
                    what,
                },
            })?;
        }
        Ok(Self {
            occluders: Arc::new(gathering.builder.build()),
            runs: gathering.runs,
        })
    }

    /// Returns the surfaces.
    pub fn occluders(&self) -> &Arc<Occluders> {
        &self.occluders
    }

    /// Returns the bytes that surfaces take, and what says where they come from.
    pub fn memory_bytes(&self) -> u64 {
        self.occluders.memory_bytes() + (self.runs.capacity() * size_of::<Run>()) as u64
    }

    /// Returns where the element of a surface comes from.
    pub fn place_of(&self, surface: SurfaceId) -> Place {
        let ElementId(element) = self.occluders.element_of(surface);
        let behind = self.runs.partition_point(|run| run.first <= element);
        // Every element is of a run: the first begins with the first element.
        let Run { first, object } = self.runs[behind - 1];
        Place {
            object,
            face: element - first,
        }
    }
}

/// Returns the shapes of lights, in order.
pub fn light_shapes(lights: &[Light]) -> Vec<LightShape> {
    lights
        .iter()
        .map(|light| light_shape(&light.kind))
        .collect()
}

/// Returns the shape of a light: a spot is a point, its cone is power (Paper 7.1).
fn light_shape(kind: &LightKind) -> LightShape {
    match *kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => {
            LightShape::Point(position)
        }
        LightKind::Directional { towards_light } => LightShape::Direction(towards_light),
    }
}

/// What is wrong with an object.
enum Bad {
    Shape(OccludersError),
    Index(&'static str),
}

impl From<OccludersError> for Bad {
    fn from(error: OccludersError) -> Self {
        Self::Shape(error)
    }
}

/// How the faces of an object are added.
#[derive(Clone, Copy)]
enum Presence {
    Whole(Opacity),
    /// With holes, where there are texture coordinates; whole elsewhere.
    Masked(CoverageId),
    /// Coloring light, by a texture where there are texture coordinates.
    Filtering(Filters),
}

impl Presence {
    /// Returns whether texture coordinates matter.
    fn has_texture(self) -> bool {
        match self {
            Self::Whole(_) => false,
            Self::Masked(_) => true,
            Self::Filtering(Filters { textured, .. }) => textured.is_some(),
        }
    }

    /// Returns how shapes without texture coordinates are added: their texture counts as white.
    fn without_texture(self) -> Opacity {
        match self {
            Self::Whole(opacity) => opacity,
            Self::Masked(_) => Opacity::Opaque,
            Self::Filtering(Filters { whole, .. }) => {
                whole.map_or(Opacity::Transparent, Opacity::Filtering)
            }
        }
    }
}

/// A scene half gathered.
struct Gathering<'a> {
    scene: &'a Scene,
    builder: OccludersBuilder,
    runs: Vec<Run>,
    element_count: usize,
    masks: Masks,
    filters: FiltersMade,
}

impl Gathering<'_> {
    fn add(&mut self, number: usize, object: &Object) -> Result<(), Bad> {
        let Some(presence) = self.presence(object.material)? else {
            return Ok(());
        };
        let element = self.element_count;
        let too_many = |_| OccludersError::TooMany { element };
        self.runs.push(Run {
            first: u32::try_from(element).map_err(too_many)?,
            object: u32::try_from(number).map_err(too_many)?,
        });
        let opacity = presence.without_texture();
        self.element_count += match &object.shape {
            Shape::Mesh(mesh) => self.add_mesh(mesh, &mesh.positions, presence)?,
            Shape::Instance(instance) => {
                let mesh = &*instance.mesh;
                let positions = 0..mesh.positions.len();
                let placed: Vec<_> = checked(positions).map(|at| instance.position(at)).collect();
                self.add_mesh(mesh, &placed, presence)?
            }
            Shape::Polygon(polygon) => {
                self.builder.add_face(&polygon.vertices, opacity)?;
                1
            }
            Shape::Sphere(sphere) => {
                self.builder.add_sphere(*sphere, opacity)?;
                1
            }
            Shape::Cone(cone) => {
                self.builder.add_cone(*cone, opacity)?;
                1
            }
            Shape::Disk(disk) => {
                self.builder.add_disk(*disk, opacity)?;
                1
            }
            Shape::Patch(patch) => {
                self.builder.add_patch(patch, opacity)?;
                1
            }
            Shape::Implicit(implicit) => {
                self.builder.add_implicit(implicit, opacity)?;
                1
            }
        };
        // An object without faces comes from nowhere.
        if self.element_count == element {
            self.runs.pop();
        }
        Ok(())
    }

    /// Returns how faces of a material are there; `None` if they are nowhere.
    fn presence(&mut self, material: usize) -> Result<Option<Presence>, Bad> {
        let look = self.scene.materials.get(material);
        let look = look.ok_or(Bad::Index("its material"))?;
        let texture_count = self.scene.textures.len();
        let textures = [
            look.diffuse_texture,
            look.bump.and_then(|bump| bump.texture()),
        ];
        if textures.into_iter().flatten().any(|n| n >= texture_count) {
            return Err(Bad::Index("its texture"));
        }
        // No texture makes more of it than full alpha.
        if look.coverage(1.0) <= 0.0 {
            return Ok(None);
        }
        Ok(Some(match look.shadow_kind() {
            ShadowKind::Opaque => Presence::Whole(Opacity::Opaque),
            ShadowKind::Transparent => {
                let made = self.filters.of(self.scene, material, &mut self.builder);
                Presence::Filtering(made)
            }
            ShadowKind::AlphaTested => self
                .masks
                .coverage(self.scene, material, &mut self.builder)
                .map_or(Presence::Whole(Opacity::Opaque), Presence::Masked),
        }))
    }

    /// Adds the faces of a mesh whose positions are at `positions`; returns how many there are.
    fn add_mesh(
        &mut self,
        mesh: &Mesh,
        positions: &[DVec3],
        presence: Presence,
    ) -> Result<usize, Bad> {
        let mut outline = Vec::new();
        let mut uvs = Vec::new();
        for face in checked(0..mesh.face_ends.len()) {
            let corners = face_of(mesh, face).ok_or(Bad::Index("a face end"))?;
            outline.clear();
            for corner in corners {
                let position = positions.get(corner.position as usize);
                outline.push(*position.ok_or(Bad::Index("a corner"))?);
            }
            let uv = |corner: &Corner| mesh.uvs.get(corner.uv as usize).copied();
            uvs.clear();
            if presence.has_texture() {
                uvs.extend(corners.iter().map_while(uv));
            }
            let has_uvs = uvs.len() == corners.len();
            let builder = &mut self.builder;
            match presence {
                Presence::Masked(coverage) if has_uvs => {
                    builder.add_alpha_tested_face(&outline, &uvs, coverage)?
                }
                Presence::Filtering(Filters {
                    textured: Some(filter),
                    ..
                }) if has_uvs => builder.add_filtering_face(&outline, &uvs, filter)?,
                _ => builder.add_face(&outline, presence.without_texture())?,
            };
        }
        Ok(mesh.face_ends.len())
    }
}
