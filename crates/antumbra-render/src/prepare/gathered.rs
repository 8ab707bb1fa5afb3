//! Objects become numbered surfaces.

use std::path::Path;
use std::sync::Arc;

use antumbra::ShadowIndex;
use antumbra_geometry::{
    CoverageId, LightShape, Occluders, OccludersBuilder, OccludersError, Opacity, SurfaceId,
};
use antumbra_scene::model::{Corner, Light, LightKind, Mesh, Object, Scene, ShadowKind, Shape};

use super::masks::Masks;
use super::{PrepareError, PrepareOptions};

/// Where in the scene an element comes from.
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
    pub(super) occluders: Arc<Occluders>,
    places: Vec<Place>,
}

impl Gathered {
    /// Collects the surfaces of `scene`.
    ///
    /// # Errors
    /// A number or an index of the scene is out of range.
    pub fn of(scene: &Scene) -> Result<Self, PrepareError> {
        let mut gathering = Gathering {
            scene,
            builder: Occluders::builder(),
            places: Vec::with_capacity(scene.objects.len()),
            masks: Masks::default(),
        };
        for (number, object) in scene.objects.iter().enumerate() {
            let name = || object.name.clone();
            gathering.add(number, object).map_err(|bad| match bad {
                Bad::Shape(source) => PrepareError::BadObject {
                    object: number,
                    name: name(),
                    source,
                },
                Bad::Index(what) => PrepareError::BadIndex {
                    object: number,
                    name: name(),
                    what,
                },
            })?;
        }
        Ok(Self {
            occluders: Arc::new(gathering.builder.build()),
            places: gathering.places,
        })
    }

    /// Returns the surfaces.
    pub fn occluders(&self) -> &Occluders {
        &self.occluders
    }

    /// Returns where each element comes from, in the order of elements.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Returns the bytes that grid, tree and values will take, before any is taken.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn predict_bytes(
        &self,
        light_count: usize,
        options: &PrepareOptions,
    ) -> Result<u64, PrepareError> {
        let Self { occluders, .. } = self;
        Ok(ShadowIndex::predict_bytes(
            occluders,
            light_count,
            options.grid,
            options.method,
            options.rays,
        )?)
    }

    /// Returns the voxels along x, y and z that the grid will have.
    ///
    /// # Errors
    /// A setting is out of range.
    pub fn resolve_grid(&self, options: &PrepareOptions) -> Result<[u32; 3], PrepareError> {
        Ok(ShadowIndex::resolve_grid(&self.occluders, options.grid)?)
    }

    /// Builds an index over the surfaces for `lights`.
    ///
    /// # Errors
    /// A light or a setting is out of range, or the memory limit is too small.
    pub fn index(
        &self,
        lights: &[Light],
        options: &PrepareOptions,
    ) -> Result<ShadowIndex, PrepareError> {
        self.index_from(lights, options, None)
    }

    /// Builds an index over the surfaces for `lights`, with the values that a file has of them
    /// ([`antumbra::Builder::occlusion_file`]). Their power and colour play no part.
    ///
    /// # Errors
    /// As [`Gathered::index`], or the file is refused.
    pub fn index_from(
        &self,
        lights: &[Light],
        options: &PrepareOptions,
        occlusion: Option<&Path>,
    ) -> Result<ShadowIndex, PrepareError> {
        let shapes = lights
            .iter()
            .map(|light| light_shape(&light.kind))
            .collect();
        let mut builder = ShadowIndex::builder(Arc::clone(&self.occluders), shapes)
            .method(options.method)
            .rays(options.rays)
            .grid(options.grid)
            .quick_check(options.quick_check)
            .refinement(options.refinement)
            .memory_limit(options.memory_limit);
        if let Some(path) = occlusion {
            builder = builder.occlusion_file(path);
        }
        Ok(builder.build()?)
    }

    /// Returns where the element of a surface comes from.
    pub fn place_of(&self, surface: SurfaceId) -> Place {
        self.places[self.occluders.element_of(surface).0 as usize]
    }
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
}

impl Presence {
    /// Returns how shapes without texture coordinates are added: their texture counts as white.
    fn without_texture(self) -> Opacity {
        match self {
            Self::Whole(opacity) => opacity,
            Self::Masked(_) => Opacity::Opaque,
        }
    }
}

/// A scene half gathered.
struct Gathering<'a> {
    scene: &'a Scene,
    builder: OccludersBuilder,
    places: Vec<Place>,
    masks: Masks,
}

impl Gathering<'_> {
    fn add(&mut self, number: usize, object: &Object) -> Result<(), Bad> {
        let Some(presence) = self.presence(object.material)? else {
            return Ok(());
        };
        let element = self.places.len();
        let object_number =
            u32::try_from(number).map_err(|_| OccludersError::TooMany { element })?;
        let mut place = Place {
            object: object_number,
            face: 0,
        };
        let opacity = presence.without_texture();
        match &object.shape {
            Shape::Mesh(mesh) => {
                for face in 0..mesh.face_ends.len() {
                    place.face = face as u32;
                    self.add_mesh_face(mesh, face, presence)?;
                    self.places.push(place);
                }
                return Ok(());
            }
            Shape::Polygon(polygon) => self.builder.add_face(&polygon.vertices, opacity)?,
            Shape::Sphere(sphere) => self.builder.add_sphere(*sphere, opacity)?,
            Shape::Cone(cone) => self.builder.add_cone(*cone, opacity)?,
            Shape::Disk(disk) => self.builder.add_disk(*disk, opacity)?,
        };
        self.places.push(place);
        Ok(())
    }

    /// Returns how faces of a material are there; `None` if they are nowhere.
    fn presence(&mut self, material: usize) -> Result<Option<Presence>, Bad> {
        let look = self.scene.materials.get(material);
        let look = look.ok_or(Bad::Index("its material"))?;
        let texture_count = self.scene.textures.len();
        if look.diffuse_texture.is_some_and(|n| n >= texture_count) {
            return Err(Bad::Index("its texture"));
        }
        // No texture makes more of it than full alpha.
        if look.coverage(1.0) <= 0.0 {
            return Ok(None);
        }
        Ok(Some(match look.shadow_kind() {
            ShadowKind::Opaque => Presence::Whole(Opacity::Opaque),
            ShadowKind::Transparent => Presence::Whole(Opacity::Transparent),
            ShadowKind::AlphaTested => self
                .masks
                .coverage(self.scene, material, &mut self.builder)
                .map_or(Presence::Whole(Opacity::Opaque), Presence::Masked),
        }))
    }

    fn add_mesh_face(&mut self, mesh: &Mesh, face: usize, presence: Presence) -> Result<(), Bad> {
        let corners = face_of(mesh, face).ok_or(Bad::Index("a face end"))?;
        let position = |corner: &Corner| mesh.positions.get(corner.position as usize).copied();
        let outline: Vec<_> = corners
            .iter()
            .map(position)
            .collect::<Option<_>>()
            .ok_or(Bad::Index("a corner"))?;
        if let Presence::Masked(coverage) = presence {
            let uv = |corner: &Corner| mesh.uvs.get(corner.uv as usize).copied();
            if let Some(uvs) = corners.iter().map(uv).collect::<Option<Vec<_>>>() {
                self.builder
                    .add_alpha_tested_face(&outline, &uvs, coverage)?;
                return Ok(());
            }
        }
        self.builder
            .add_face(&outline, presence.without_texture())?;
        Ok(())
    }
}

/// Returns the corners of face `face`, or `None` if the ends are out of range or order.
pub(super) fn face_of(mesh: &Mesh, face: usize) -> Option<&[Corner]> {
    let start = if face == 0 {
        0
    } else {
        *mesh.face_ends.get(face - 1)? as usize
    };
    mesh.corners.get(start..*mesh.face_ends.get(face)? as usize)
}
