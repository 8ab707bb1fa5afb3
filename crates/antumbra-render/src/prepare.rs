//! Scene meets accelerator: the only place.
//!
//! In: a [`Scene`]. Out: [`Gathered`] (its surfaces, and which object each came from), then
//! [`Prepared`] (with the shadow index). Invariant: elements are numbered in the order of the
//! file: each polygon, each face of a mesh, each sphere, cone and disk is one element. A surface
//! blocks iff its material is opaque.

use std::sync::Arc;

use antumbra::{BuildError, GridResolution, Method, QuickCheck, ShadowIndex};
use antumbra_geometry::{
    DVec3, Hit, LightShape, Occluders, OccludersBuilder, OccludersError, Opacity, SurfaceId,
};
use antumbra_scene::model::{Light, LightKind, Material, Mesh, Scene, Shape};

use crate::vector::unit;

/// Why a scene cannot be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// An object's numbers are out of range.
    #[error("object {object}{}: {source}", named(name))]
    BadObject {
        /// Index into [`Scene::objects`].
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// What is wrong.
        source: OccludersError,
    },
    /// An object names a material, a position or a face end that is not there.
    #[error("object {object}{}: {what} is out of range", named(name))]
    BadIndex {
        /// Index into [`Scene::objects`].
        object: usize,
        /// The object's name, may be empty.
        name: String,
        /// Which index it is.
        what: &'static str,
    },
    /// The index refuses the lights or a setting, or needs too much memory.
    #[error(transparent)]
    Build(#[from] BuildError),
}

fn named(name: &str) -> String {
    if name.is_empty() {
        String::new()
    } else {
        format!(" ({name})")
    }
}

/// How a scene is accelerated.
#[derive(Clone, Copy, Debug)]
pub struct PrepareOptions {
    /// How shadow queries are answered.
    pub method: Method,
    /// How fine the grid is.
    pub grid: GridResolution,
    /// What the quick check of Paper 7.3 does.
    pub quick_check: QuickCheck,
    /// Most bytes that grid and values may take.
    pub memory_limit: u64,
}

impl Default for PrepareOptions {
    fn default() -> Self {
        Self {
            method: Method::default(),
            grid: GridResolution::default(),
            quick_check: QuickCheck::default(),
            memory_limit: u64::MAX,
        }
    }
}

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
    occluders: Arc<Occluders>,
    places: Vec<Place>,
}

impl Gathered {
    /// Collects the surfaces of `scene`.
    ///
    /// # Errors
    /// A number or an index of the scene is out of range.
    pub fn of(scene: &Scene) -> Result<Self, PrepareError> {
        let mut builder = Occluders::builder();
        let mut places = Vec::with_capacity(scene.objects.len());
        for (number, object) in scene.objects.iter().enumerate() {
            let bad_index = |what| PrepareError::BadIndex {
                object: number,
                name: object.name.clone(),
                what,
            };
            let bad_object = |source| PrepareError::BadObject {
                object: number,
                name: object.name.clone(),
                source,
            };
            let material = scene
                .materials
                .get(object.material)
                .ok_or(bad_index("its material"))?;
            let opacity = if material.is_opaque() {
                Opacity::Opaque
            } else {
                Opacity::Transparent
            };
            let object_number = u32::try_from(number).map_err(|_| {
                bad_object(OccludersError::TooMany {
                    element: places.len(),
                })
            })?;
            let mut place = Place {
                object: object_number,
                face: 0,
            };
            match &object.shape {
                Shape::Mesh(mesh) => {
                    for face in 0..mesh.face_ends.len() {
                        place.face = face as u32;
                        add_mesh_face(&mut builder, mesh, face, opacity)
                            .ok_or(bad_index("a corner"))?
                            .map_err(bad_object)?;
                        places.push(place);
                    }
                    continue;
                }
                Shape::Polygon(polygon) => builder.add_face(&polygon.vertices, opacity),
                Shape::Sphere(sphere) => builder.add_sphere(*sphere, opacity),
                Shape::Cone(cone) => builder.add_cone(*cone, opacity),
                Shape::Disk(disk) => builder.add_disk(*disk, opacity),
            }
            .map_err(bad_object)?;
            places.push(place);
        }
        Ok(Self {
            occluders: Arc::new(builder.build()),
            places,
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

    /// Returns the bytes that grid and values will take, before any is taken.
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
        let shapes = lights
            .iter()
            .map(|light| light_shape(&light.kind))
            .collect();
        Ok(ShadowIndex::builder(Arc::clone(&self.occluders), shapes)
            .method(options.method)
            .grid(options.grid)
            .quick_check(options.quick_check)
            .memory_limit(options.memory_limit)
            .build()?)
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

/// Returns the corners of face `face`, or `None` if the ends are out of range or order.
fn face_of(mesh: &Mesh, face: usize) -> Option<&[antumbra_scene::model::Corner]> {
    let start = if face == 0 {
        0
    } else {
        *mesh.face_ends.get(face - 1)? as usize
    };
    mesh.corners.get(start..*mesh.face_ends.get(face)? as usize)
}

/// Adds one face; `None` if an index of the mesh is out of range.
fn add_mesh_face(
    builder: &mut OccludersBuilder,
    mesh: &Mesh,
    face: usize,
    opacity: Opacity,
) -> Option<Result<(), OccludersError>> {
    let outline = face_of(mesh, face)?
        .iter()
        .map(|corner| mesh.positions.get(corner.position as usize).copied())
        .collect::<Option<Vec<_>>>()?;
    Some(builder.add_face(&outline, opacity).map(drop))
}

/// A scene ready to be looked at: its data, its surfaces and its shadow index.
#[derive(Debug)]
pub struct Prepared {
    scene: Scene,
    gathered: Gathered,
    index: ShadowIndex,
}

impl Prepared {
    /// Gathers the surfaces of `scene` and builds the index, on all threads of the current rayon
    /// pool. The scene's lights are fixed from here on; cameras are not part of it.
    ///
    /// # Errors
    /// The scene or a setting is out of range, or the memory limit is too small; the need is
    /// predicted and compared before any of it is taken.
    pub fn new(scene: Scene, options: &PrepareOptions) -> Result<Self, PrepareError> {
        let gathered = Gathered::of(&scene)?;
        let index = gathered.index(&scene.lights, options)?;
        Ok(Self {
            scene,
            gathered,
            index,
        })
    }

    /// Returns the scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the surfaces and where they come from.
    pub fn gathered(&self) -> &Gathered {
        &self.gathered
    }

    /// Returns the shadow index; its lights have the order of [`Scene::lights`].
    pub fn index(&self) -> &ShadowIndex {
        &self.index
    }

    /// Returns how a surface looks.
    pub fn material(&self, surface: SurfaceId) -> &Material {
        let place = self.gathered.place_of(surface);
        &self.scene.materials[self.scene.objects[place.object as usize].material]
    }

    /// Returns the unit geometric normal at a hit: by the winding, or outwards.
    pub fn geometric_normal(&self, hit: &Hit) -> DVec3 {
        self.gathered.occluders.normal_at(hit.surface, hit.point)
    }

    /// Returns the unit shading normal at a hit: the vertex normals weighted by the hit's place in
    /// its triangle, on the same side as `geometric_normal`, which stands in for vertex normals
    /// that are missing or zero. The winding, not the vertex normals, says which side is front.
    pub fn shading_normal(&self, hit: &Hit, geometric_normal: DVec3) -> DVec3 {
        let Some(normals) = self.vertex_normals(hit.surface) else {
            return geometric_normal;
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
                let corners = self.gathered.occluders.corners(surface)?;
                Some(corners.map(|corner| polygon.normals.get(corner as usize).copied()))
            }
            Shape::Mesh(mesh) if !mesh.normals.is_empty() => {
                let corners = self.gathered.occluders.corners(surface)?;
                let face = face_of(mesh, place.face as usize)?;
                Some(corners.map(|corner| {
                    let normal = face.get(corner as usize)?.normal;
                    mesh.normals.get(normal as usize).copied()
                }))
            }
            _ => None,
        }
    }
}
