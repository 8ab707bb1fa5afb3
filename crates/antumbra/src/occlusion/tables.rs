//! What queries and refinement want to know of each surface.
//!
//! In: the surfaces, a light. Out: [`Tables`], of all surfaces at once. The mesh and its contour edges are made when
//! that pays, and dropped where nothing more is made. All is made where its bytes are taken from the room before.
//! Absent here: cells.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use antumbra_geometry::{
    DVec3, ElementId, LightShape, Mesh, MeshEdge, Occluders, SurfaceId, Umbra,
};
use antumbra_task::checked;

use super::balls::Ball;
use super::forms::Forms;
use super::planes::ReceiverPlane;
use super::room::{Room, Share};
use crate::accel::frame::Frame;

/// What concerns the surfaces for all lights.
#[derive(Debug)]
pub(crate) struct SceneTables {
    /// For each triangle whether a point is where a start on it is. Empty where nothing more is made.
    start_forms: Vec<Forms>,
    /// The same for the other surfaces.
    pub(super) ball_starts: Vec<Ball>,
    /// Those of them that are spheres.
    pub(super) balls: Vec<Ball>,
    /// Whether all triangles are, if not everywhere.
    are_all_opaque: bool,
    mesh: OnceLock<(Mesh, Share)>,
    no_mesh: Mesh,
}

/// What concerns the surfaces for one light.
#[derive(Debug)]
pub(crate) struct LightTables {
    /// For each triangle the side of its plane that the light is on.
    sides: Vec<i8>,
    /// For each triangle the forms of its umbra.
    umbra_forms: Vec<Forms>,
    /// What tells of each triangle whether points are where starts on it are.
    start_planes: Vec<ReceiverPlane>,
    /// Elements that are no faces and block.
    curved: Vec<CurvedCaster>,
    /// For each surface that is no triangle its number among them.
    curved_numbers: Vec<u32>,
    edges: OnceLock<(EdgesForLight, Share)>,
    /// Of whoever makes those.
    making: Mutex<()>,
}

/// The edges that may cast edges of shadows.
#[derive(Debug)]
struct EdgesForLight {
    contours: Vec<Contour>,
    /// For each edge of the mesh its number among the contours.
    contour_numbers: Vec<u32>,
}

#[derive(Debug)]
pub(crate) struct Contour {
    pub(crate) edge: MeshEdge,
    pub(crate) ends: [DVec3; 2],
    /// The plane through the light and the edge, four times.
    pub(crate) plane: Forms,
}

#[derive(Debug)]
pub(crate) struct CurvedCaster {
    pub(crate) element: ElementId,
    pub(crate) umbra: Umbra,
    /// Whether it is large enough for a patch's rounding not to matter to what it covers.
    pub(crate) may_cover_patches: bool,
}

/// Elements smaller than this share of the frame cover no patches.
const SMALLEST_COVER: f64 = 1.0 / (1u64 << 20) as f64;

/// In place of a number of what is not there.
pub(crate) const NONE: u32 = u32::MAX;

impl SceneTables {
    /// Makes what queries need, and for values also what making those does.
    pub(crate) fn new(occluders: &Occluders, frame: &Frame, has_values: bool) -> Self {
        let start_triangles = triangles(occluders).take_while(|_| has_values);
        let curved = || {
            let all = occluders.triangle_count()..occluders.surface_count();
            all.map(|surface| SurfaceId(surface as u32))
        };
        let ball_starts = curved()
            .map(|surface| match occluders.sphere(surface) {
                Some(sphere) if occluders.is_opaque(surface) => Ball::new(sphere),
                _ => Ball::NONE,
            })
            .collect();
        let balls = curved()
            .map(|surface| occluders.sphere(surface).map_or(Ball::NONE, Ball::new))
            .collect();
        Self {
            start_forms: start_triangles
                .map(|triangle| start_forms(occluders, frame, triangle))
                .collect(),
            ball_starts,
            balls,
            are_all_opaque: triangles(occluders).all(|triangle| occluders.is_opaque(triangle)),
            mesh: OnceLock::new(),
            no_mesh: Mesh::default(),
        }
    }

    /// Returns the bytes that [`SceneTables::new`] will take.
    pub(crate) fn bytes_for(occluders: &Occluders, has_values: bool) -> u64 {
        let (triangle_count, surface_count) =
            (occluders.triangle_count(), occluders.surface_count());
        let bytes = triangle_count * size_of::<Forms>() * usize::from(has_values)
            + (surface_count - triangle_count) * 2 * size_of::<Ball>();
        bytes as u64
    }

    /// Returns the mesh; makes it where there is room. On one thread: one that waits for others may take up a query
    /// that waits for these tables.
    pub(super) fn make_mesh(
        &self,
        occluders: &Occluders,
        room: &Arc<Room>,
        has_edges: bool,
    ) -> Option<&Mesh> {
        if self.mesh.get().is_none() {
            let count = occluders.triangle_count();
            let most = match has_edges {
                true => Mesh::height_bytes(count),
                false => Mesh::height_bytes_without_edges(count),
            };
            let held = room.hold(most);
            if held.bytes() < most {
                return None;
            }
            let mesh = match has_edges {
                true => Mesh::new(occluders),
                false => Mesh::without_edges(occluders),
            };
            let share = held.keep(mesh.memory_bytes())?;
            // Another thread may have been faster.
            self.mesh.get_or_init(|| (mesh, share));
        }
        self.mesh.get().map(|(mesh, _)| mesh)
    }

    /// Returns whether values can be made: not after [`SceneTables::finish`].
    pub(crate) fn can_make(&self, occluders: &Occluders) -> bool {
        self.start_forms.len() == occluders.triangle_count()
    }

    pub(crate) fn mesh_bytes(&self) -> u64 {
        self.mesh.get().map_or(0, |(_, share)| share.bytes())
    }

    /// Drops what is needed only to make values. Returns the bytes of what stays, the mesh apart.
    pub(crate) fn finish(&mut self) -> u64 {
        self.start_forms = Vec::new();
        if let Some((mut mesh, share)) = self.mesh.take() {
            mesh.keep_planes();
            share.shrink_to(mesh.memory_bytes());
            self.mesh = OnceLock::from((mesh, share));
        }
        (size_of_val(self.balls.as_slice()) + size_of_val(self.ball_starts.as_slice())) as u64
    }
}

fn triangles(occluders: &Occluders) -> impl Iterator<Item = SurfaceId> {
    (0..occluders.triangle_count() as u32).map(SurfaceId)
}

fn start_forms(occluders: &Occluders, frame: &Frame, triangle: SurfaceId) -> Forms {
    match (
        occluders.triangle_positions(triangle),
        occluders.dominant_axis(triangle),
    ) {
        (Some(corners), Some(axis)) => Forms::of_starts(frame, corners, axis),
        _ => Forms::NOWHERE,
    }
}

fn umbra_forms(
    occluders: &Occluders,
    frame: &Frame,
    light: &LightShape,
    triangle: SurfaceId,
) -> Forms {
    match occluders.triangle_positions(triangle) {
        Some(corners) => Forms::of_umbra(frame, corners, light),
        None => Forms::NOWHERE,
    }
}

impl LightTables {
    pub(crate) fn new(occluders: &Occluders, frame: &Frame, light: &LightShape) -> Self {
        let mut curved_numbers = vec![NONE; occluders.surface_count() - occluders.triangle_count()];
        let mut curved = Vec::new();
        let elements = (0..occluders.elements().len() as u32).map(ElementId);
        for element in checked(elements.filter(|&element| !occluders.is_face(element))) {
            let umbra = occluders.umbra(element, light);
            if umbra.is_nothing() {
                continue;
            }
            for SurfaceId(surface) in occluders.surfaces_of(element) {
                let number = surface as usize - occluders.triangle_count();
                curved_numbers[number] = curved.len() as u32;
            }
            let size = occluders.element_bounds(element).size().max_element();
            curved.push(CurvedCaster {
                element,
                umbra,
                may_cover_patches: size * frame.scale > SMALLEST_COVER,
            });
        }
        let count = occluders.triangle_count();
        let mut tables = Self {
            sides: occluders.light_sides(light),
            umbra_forms: Vec::with_capacity(count),
            start_planes: Vec::with_capacity(count),
            curved,
            curved_numbers,
            edges: OnceLock::new(),
            making: Mutex::new(()),
        };
        for triangle in checked(triangles(occluders)) {
            let side = tables.sides[triangle.0 as usize];
            let forms = umbra_forms(occluders, frame, light, triangle);
            tables.umbra_forms.push(forms);
            let plane = ReceiverPlane::of_triangle(occluders, frame, triangle, side);
            tables.start_planes.push(plane);
        }
        tables
    }

    /// Returns the bytes that [`LightTables::new`] will take at most.
    pub(crate) fn bytes_for(occluders: &Occluders) -> u64 {
        let count = occluders.triangle_count();
        let each = size_of::<i8>() + size_of::<Forms>() + size_of::<ReceiverPlane>();
        let curved = occluders.surface_count() - count;
        let each_curved = size_of::<u32>() + size_of::<CurvedCaster>();
        (count * each + curved * each_curved) as u64
    }

    /// Makes the mesh and its contour edges, where there is room; returns whether they are there.
    pub(crate) fn make_edges(
        &self,
        scene: &SceneTables,
        occluders: &Occluders,
        (frame, light): (&Frame, &LightShape),
        room: &Arc<Room>,
    ) -> bool {
        let making = self.making.lock().unwrap_or_else(PoisonError::into_inner);
        if self.edges.get().is_some() {
            return true;
        }
        let Some(mesh) = scene.make_mesh(occluders, room, true) else {
            return false;
        };
        let is_contour = |edge: &&MeshEdge| mesh.is_contour(edge, &self.sides);
        let count = mesh.edges().iter().filter(is_contour).count();
        let bytes = count * size_of::<Contour>() + size_of::<u32>() * mesh.edges().len();
        let Some(share) = room.take(bytes as u64) else {
            return false;
        };
        let mut contours = Vec::with_capacity(count);
        let number_of = |edge: &MeshEdge| {
            if !mesh.is_contour(edge, &self.sides) {
                return NONE;
            }
            let ends = occluders.edge_positions(edge);
            contours.push(Contour {
                edge: *edge,
                ends,
                plane: Forms::through_light(frame, ends, light),
            });
            contours.len() as u32 - 1
        };
        let contour_numbers = checked(mesh.edges()).map(number_of).collect();
        let edges = EdgesForLight {
            contours,
            contour_numbers,
        };
        self.edges.get_or_init(|| (edges, share));
        drop(making);
        true
    }

    pub(crate) fn has_edges(&self) -> bool {
        self.edges.get().is_some()
    }

    /// Returns the bytes of contour edges.
    pub(crate) fn edge_bytes(&self) -> u64 {
        self.edges.get().map_or(0, |(_, share)| share.bytes())
    }

    /// Drops what is needed only to make values.
    pub(crate) fn finish(&mut self) {
        self.edges.take();
    }
}

/// The tables of a scene and a light, at hand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tables<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) frame: &'a Frame,
    pub(crate) light: &'a LightShape,
    pub(crate) scene: &'a SceneTables,
    of_light: &'a LightTables,
    mesh: Option<&'a Mesh>,
    /// Made with the mesh.
    edges: Option<&'a EdgesForLight>,
}

impl<'a> Tables<'a> {
    #[inline]
    pub(crate) fn new(
        occluders: &'a Occluders,
        frame: &'a Frame,
        light: &'a LightShape,
        scene: &'a SceneTables,
        of_light: &'a LightTables,
    ) -> Self {
        Self {
            occluders,
            frame,
            light,
            scene,
            of_light,
            mesh: scene.mesh.get().map(|(mesh, _)| mesh),
            edges: of_light.edges.get().map(|(edges, _)| edges),
        }
    }

    #[inline(always)]
    pub(crate) fn triangle_count(&self) -> usize {
        self.of_light.sides.len()
    }

    /// Returns the forms of the starts on a triangle.
    #[inline(always)]
    pub(crate) fn start_forms(&self, triangle: usize) -> Option<&'a Forms> {
        self.scene.start_forms.get(triangle)
    }

    /// Returns the forms of a triangle's umbra.
    #[inline(always)]
    pub(crate) fn umbra_forms(&self, triangle: usize) -> Option<&'a Forms> {
        self.of_light.umbra_forms.get(triangle)
    }

    /// Returns the forms of the umbrae of all triangles.
    #[inline(always)]
    pub(crate) fn all_umbra_forms(&self) -> &'a [Forms] {
        &self.of_light.umbra_forms
    }

    /// Returns what tells whether points are where starts on triangles are, of all triangles.
    #[inline(always)]
    pub(super) fn start_planes(&self) -> &'a [ReceiverPlane] {
        &self.of_light.start_planes
    }

    /// Returns the side of a triangle's plane that the light is on.
    #[inline(always)]
    pub(crate) fn side(&self, triangle: usize) -> Option<i8> {
        self.of_light.sides.get(triangle).copied()
    }

    /// Returns whether two triangles are known to lie in one plane.
    #[inline(always)]
    pub(crate) fn are_in_one_plane(&self, own: SurfaceId, other: SurfaceId) -> bool {
        own == other
            || self.mesh.is_some_and(|mesh| {
                (own.0 as usize) < self.triangle_count()
                    && mesh.flat_group(own) == mesh.flat_group(other)
            })
    }

    /// Returns the mesh; without edges as long as those of the light are not made.
    pub(crate) fn mesh(&self) -> &'a Mesh {
        match (self.mesh, self.edges) {
            (Some(mesh), Some(_)) => mesh,
            _ => &self.scene.no_mesh,
        }
    }

    /// Returns the mesh if it says how triangles are joined.
    pub(super) fn joined(&self) -> Option<&'a Mesh> {
        self.mesh.filter(|mesh| mesh.is_joined())
    }

    /// Returns whether all triangles are opaque, if not everywhere.
    #[inline(always)]
    pub(super) fn are_all_opaque(&self) -> bool {
        self.scene.are_all_opaque
    }

    /// Returns for each triangle the side of its plane that the light is on.
    pub(super) fn sides(&self) -> &'a [i8] {
        &self.of_light.sides
    }

    pub(crate) fn contour(&self, number: u32) -> Option<&'a Contour> {
        self.edges?.contours.get(number as usize)
    }

    /// Returns the number of a contour edge of the mesh's, [`NONE`] if it is none.
    pub(crate) fn contour_number(&self, edge: u32) -> u32 {
        self.edges
            .and_then(|edges| edges.contour_numbers.get(edge as usize))
            .copied()
            .unwrap_or(NONE)
    }

    pub(crate) fn curved(&self, number: u32) -> &'a CurvedCaster {
        &self.of_light.curved[number as usize]
    }

    /// Returns the number of the curved element of a surface that is no triangle, [`NONE`] if it blocks
    /// nothing.
    pub(crate) fn curved_number(&self, surface: SurfaceId) -> u32 {
        self.of_light.curved_numbers[surface.0 as usize - self.triangle_count()]
    }
}
