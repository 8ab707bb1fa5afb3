//! The scene as plain data: what a file says, validated, before anything is accelerated.
//!
//! In: nothing. Out: [`Scene`], which readers and generators build and `antumbra-render`
//! prepares. Invariant: every number is finite, every index is in range, directions are not
//! zero. The model knows no grid and no occlusion value.

use std::borrow::Cow;

use antumbra_geometry::{AreaShape, BezierPatch, Cone, DVec3, Disk, Implicit, Sphere};
use serde::{Deserialize, Serialize};

pub use super::mesh::{Corner, Mesh};
pub use crate::{
    bump::{Bump, BumpError},
    instance::Instance,
    opacity::ShadowKind,
    texture::{Filter, Texture, Wrap},
};

/// A linear RGB value; not limited to 1.
pub type Color = DVec3;

/// Everything a file says about one picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Surfaces' looks; objects name them by index.
    pub materials: Vec<Material>,
    /// Pictures; materials name them by index.
    pub textures: Vec<Texture>,
    /// Objects of the scene.
    #[serde(with = "crate::shared")]
    pub objects: Vec<Object>,
    /// Point, spot and directional lights.
    pub lights: Vec<Light>,
    /// Lights with size. No scene format has any: see [`crate::read_lights`].
    #[serde(default)]
    pub area_lights: Vec<AreaLight>,
    /// The view, if the file has one.
    pub camera: Option<Camera>,
    /// Color that a ray sees that hits nothing.
    pub background: Color,
    /// Light that reaches every point from everywhere, times the diffuse color.
    pub ambient: Color,
    /// Which normal decides whether a surface faces a light.
    pub facing: Facing,
    /// Which way is up, world space, any length but zero: for a camera or a sun that the file
    /// does not give.
    pub up: DVec3,
    /// Whether the lights' colors are photometric: candela for points and spots, lux for
    /// directional lights, so that a picture needs an exposure. Otherwise they are meant to be
    /// shown as they are.
    pub is_photometric: bool,
}

impl Default for Scene {
    /// An empty scene, black, with +z up.
    fn default() -> Self {
        Self {
            materials: Vec::new(),
            textures: Vec::new(),
            objects: Vec::new(),
            lights: Vec::new(),
            area_lights: Vec::new(),
            camera: None,
            background: Color::ZERO,
            ambient: Color::ZERO,
            facing: Facing::default(),
            up: DVec3::Z,
            is_photometric: false,
        }
    }
}

/// Which side of a surface counts as lit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Facing {
    /// The side that is looked at: the geometric normal is turned to the viewer.
    #[default]
    Viewer,
    /// The side the winding (or the outside of a curved shape) says, whoever looks: NFF.
    Winding,
}

/// One thing of the scene, as its file counts things.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// A name for messages; may be empty.
    pub name: String,
    /// Its shape.
    pub shape: Shape,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// The shape of an object, world space; of an instance, once it is placed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// A planar polygon, convex or concave, without holes.
    Polygon(Polygon),
    /// Faces that share vertices.
    Mesh(Mesh),
    /// A mesh that is there more than once: one of its copies.
    Instance(Instance),
    /// A sphere.
    Sphere(Sphere),
    /// A truncated cone or cylinder.
    Cone(Cone),
    /// A disk.
    Disk(Disk),
    /// A bicubic patch.
    Patch(Box<BezierPatch>),
    /// An implicit surface.
    Implicit(Box<Implicit>),
}

impl Shape {
    /// Returns the mesh of a shape of faces, world space; `None` for others.
    pub fn placed_mesh(&self) -> Option<Cow<'_, Mesh>> {
        match self {
            Self::Mesh(mesh) => Some(Cow::Borrowed(mesh)),
            Self::Instance(instance) => Some(Cow::Owned(instance.to_mesh())),
            _ => None,
        }
    }

    /// Returns the mesh of a shape of faces: corners, places in textures and colors are those of
    /// the shape, but positions and normals of an instance are in its own space. `None` for others.
    pub fn mesh(&self) -> Option<&Mesh> {
        match self {
            Self::Mesh(mesh) => Some(mesh),
            Self::Instance(instance) => Some(&instance.mesh),
            _ => None,
        }
    }
}

/// A polygon with at least three vertices, counter-clockwise seen from its front.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polygon {
    /// Vertices in order, world space.
    pub vertices: Vec<DVec3>,
    /// One shading normal per vertex (any length, zero means none), or empty for flat shading.
    pub normals: Vec<DVec3>,
}

/// How a surface looks: Whitted's model (local diffuse and highlight, mirror, refraction).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// A name for messages; may be empty.
    pub name: String,
    /// Lambertian weight per channel.
    pub diffuse: Color,
    /// Index into [`Scene::textures`]: a picture whose color multiplies `diffuse` and whose alpha
    /// multiplies `opacity`.
    pub diffuse_texture: Option<usize>,
    /// Meaning of the alpha value (`opacity` times the texture's).
    pub alpha: Alpha,
    /// The alpha value without a texture, 0 to 1.
    pub opacity: f64,
    /// Whether the back is seen too. Shadow rays are blocked from either side in any case.
    pub is_double_sided: bool,
    /// Weight of the highlight of each light.
    pub specular: Color,
    /// Phong exponent of the highlight, not negative.
    pub shininess: f64,
    /// Weight of the mirror ray; zero spawns none.
    pub reflection: Color,
    /// Weight of the refracted ray; zero spawns none. A transmitter blocks no shadow ray, and colors the light that goes through it.
    pub transmission: Color,
    /// Index of refraction, positive; used only where `transmission` is not zero.
    pub ior: f64,
    /// Light the surface sends out by itself. It lights other surfaces only where faces that emit are made lights of
    /// [`Scene::area_lights`].
    pub emission: Color,
    /// Relief of the surface, which is no geometry.
    #[serde(default)]
    pub bump: Option<Bump>,
}

/// Meaning of a material's alpha value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Alpha {
    /// Nothing: the surface is whole.
    #[default]
    Opaque,
    /// The surface is there where alpha is at least the cutoff, elsewhere it is a hole.
    Mask {
        /// The least alpha that is there, not negative. Above 1 there is no surface at all.
        cutoff: f64,
    },
    /// The share of what is behind that the surface covers.
    Blend,
}

impl Default for Material {
    /// A plain light grey.
    fn default() -> Self {
        Self {
            name: String::new(),
            diffuse: Color::splat(0.8),
            diffuse_texture: None,
            alpha: Alpha::Opaque,
            opacity: 1.0,
            is_double_sided: true,
            specular: Color::ZERO,
            shininess: 1.0,
            reflection: Color::ZERO,
            transmission: Color::ZERO,
            ior: 1.0,
            emission: Color::ZERO,
            bump: None,
        }
    }
}

/// One light: its shape and its power.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// A name for messages, options and image layers.
    pub name: String,
    /// Place or direction that the light comes from.
    pub kind: LightKind,
    /// Intensity (where it falls off) or irradiance, linear RGB; [`Scene::is_photometric`] says
    /// in which unit.
    pub color: Color,
    /// Whether the light weakens with the square of the distance.
    pub falls_off: bool,
}

/// Place or direction that light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// A point, world space.
    Point {
        /// Its position.
        position: DVec3,
    },
    /// Parallel light, as of the sun.
    Directional {
        /// From the scene towards the light; not zero.
        towards_light: DVec3,
    },
    /// A point that shines only into a cone.
    Spot {
        /// Its position.
        position: DVec3,
        /// The middle of the cone, away from the light; not zero.
        axis: DVec3,
        /// Cosine of the half-angle inside which the light is full.
        inner_cosine: f64,
        /// Cosine of the half-angle outside which there is none; at most `inner_cosine`.
        outer_cosine: f64,
    },
}

/// One light with size: its shape and its power.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AreaLight {
    /// A name for messages and image layers.
    pub name: String,
    /// Place or direction that the light comes from.
    pub shape: AreaShape,
    /// Linear RGB. For a sun disc: the irradiance of a surface that faces all of it, as for a directional light. For
    /// the sky: its radiance times pi, so that open ground has it. Else as `falls_off` says.
    pub color: Color,
    /// Whether the light is physical: `color` is the radiance of its surface, which looks as bright as it lights, and
    /// near and large lights light more. Without, `color` is the irradiance of a surface that faces all of
    /// the light and is straight in front of it, at any distance, as for point lights that do not fall off.
    pub falls_off: bool,
}

/// A pinhole camera. Right-handed: right is `forward x up`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// The eye, world space.
    pub eye: DVec3,
    /// A point in the middle of the picture.
    pub at: DVec3,
    /// Any vector not parallel to the view direction.
    pub up: DVec3,
    /// Full field of view in degrees, 0..180, over the picture's height.
    pub vertical_fov_degrees: f64,
    /// Picture size in pixels that the file asks for.
    pub resolution: Option<[u32; 2]>,
}
