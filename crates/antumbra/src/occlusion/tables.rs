//! What queries and refinement want to know of each surface.
//!
//! In: the surfaces, a light. Out: [`Tables`]. What concerns one triangle is made when it is first asked for;
//! tables of all triangles, with the mesh and its contour edges, are made when that pays. Absent here:
//! cells.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicI8, Ordering};

use antumbra_geometry::{
    DVec3, ElementId, LightShape, Mesh, MeshEdge, Occluders, SurfaceId, Umbra,
};
use antumbra_task::checked;

use super::balls::Ball;
use super::forms::Forms;
use super::planes::StartPlane;
use crate::frame::Frame;

/// What concerns the surfaces for all lights.
#[derive(Debug)]
pub(crate) struct SceneTables {
    /// For each triangle whether a point is where a start on it is.
    start_forms: Box<[OnceLock<Box<Forms>>]>,
    /// The same for the other surfaces.
    pub(super) ball_starts: Vec<Ball>,
    /// Those of them that are spheres.
    pub(super) balls: Vec<Ball>,
    whole: OnceLock<WholeScene>,
    no_mesh: Mesh,
}

/// All triangles, and how they hang together.
#[derive(Debug)]
struct WholeScene {
    start_forms: Vec<Forms>,
    mesh: Mesh,
}

/// What concerns the surfaces for one light.
#[derive(Debug)]
pub(crate) struct LightTables {
    /// For each triangle the side of its plane that the light is on, or [`NO_SIDE`].
    sides: Box<[AtomicI8]>,
    /// For each triangle the forms of its umbra.
    umbra_forms: Box<[OnceLock<Box<Forms>>]>,
    /// Elements that are no faces and block.
    curved: Vec<CurvedCaster>,
    /// For each surface that is no triangle its number among them.
    curved_numbers: Vec<u32>,
    all: OnceLock<AllForLight>,
    edges: OnceLock<EdgesForLight>,
}

/// What concerns all triangles, one after the other.
#[derive(Debug)]
struct AllForLight {
    sides: Vec<i8>,
    umbra_forms: Vec<Forms>,
    start_planes: Vec<StartPlane>,
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

/// In place of a side that nobody has asked for.
const NO_SIDE: i8 = i8::MAX;

fn once<T>(count: usize) -> Box<[OnceLock<T>]> {
    (0..count).map(|_| OnceLock::new()).collect()
}

impl SceneTables {
    pub(crate) fn new(occluders: &Occluders) -> Self {
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
            start_forms: once(occluders.triangle_count()),
            ball_starts,
            balls,
            whole: OnceLock::new(),
            no_mesh: Mesh::default(),
        }
    }

    fn make_whole(&self, occluders: &Occluders, frame: &Frame) -> &WholeScene {
        self.whole.get_or_init(|| WholeScene {
            start_forms: checked(triangles(occluders))
                .map(|triangle| start_forms(occluders, frame, triangle))
                .collect(),
            mesh: Mesh::new(occluders),
        })
    }

    /// Returns the bytes of all tables.
    pub(crate) fn bytes(&self) -> u64 {
        let Self {
            start_forms,
            ball_starts,
            balls,
            whole,
            no_mesh: _,
        } = self;
        let whole = whole.get().map_or(0, |WholeScene { start_forms, mesh }| {
            size_of_val(start_forms.as_slice()) as u64 + mesh.memory_bytes()
        });
        whole
            + (size_of_val(&**start_forms)
                + size_of_val(ball_starts.as_slice())
                + size_of_val(balls.as_slice())) as u64
    }
}

/// On one thread: one that waits for others may take up a query that waits for these tables.
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
        Self {
            sides: (0..count).map(|_| AtomicI8::new(NO_SIDE)).collect(),
            umbra_forms: once(count),
            curved,
            curved_numbers,
            all: OnceLock::new(),
            edges: OnceLock::new(),
        }
    }

    /// Enters all triangles, one after the other.
    pub(crate) fn make_all(&self, occluders: &Occluders, frame: &Frame, light: &LightShape) {
        self.all.get_or_init(|| {
            let count = occluders.triangle_count();
            let mut all = AllForLight {
                sides: occluders.light_sides(light),
                umbra_forms: Vec::with_capacity(count),
                start_planes: Vec::with_capacity(count),
            };
            for triangle in checked(triangles(occluders)) {
                let side = all.sides[triangle.0 as usize];
                let forms = umbra_forms(occluders, frame, light, triangle);
                all.umbra_forms.push(forms);
                let plane = StartPlane::of_triangle(occluders, frame, triangle, side);
                all.start_planes.push(plane);
            }
            all
        });
    }

    /// Makes all tables there are.
    pub(crate) fn make_whole(
        &self,
        scene: &SceneTables,
        occluders: &Occluders,
        frame: &Frame,
        light: &LightShape,
    ) {
        self.make_all(occluders, frame, light);
        let mesh = &scene.make_whole(occluders, frame).mesh;
        let Some(AllForLight { sides, .. }) = self.all.get() else {
            return;
        };
        self.edges.get_or_init(|| {
            let mut contours = Vec::new();
            let number_of = |edge: &MeshEdge| {
                if !mesh.is_contour(edge, sides) {
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
            EdgesForLight {
                contours,
                contour_numbers,
            }
        });
    }

    pub(crate) fn is_whole(&self) -> bool {
        self.edges.get().is_some()
    }

    /// Returns the bytes of all tables.
    pub(crate) fn bytes(&self) -> u64 {
        let Self {
            sides,
            umbra_forms,
            curved,
            curved_numbers,
            all,
            edges,
        } = self;
        let of_all = |all: &AllForLight| {
            let AllForLight {
                sides,
                umbra_forms,
                start_planes,
            } = all;
            size_of_val(sides.as_slice())
                + size_of_val(umbra_forms.as_slice())
                + size_of_val(start_planes.as_slice())
        };
        let of_edges = |edges: &EdgesForLight| {
            let EdgesForLight {
                contours,
                contour_numbers,
            } = edges;
            size_of_val(contours.as_slice()) + size_of_val(contour_numbers.as_slice())
        };
        (size_of_val(&**sides)
            + size_of_val(&**umbra_forms)
            + size_of_val(curved.as_slice())
            + size_of_val(curved_numbers.as_slice())
            + all.get().map_or(0, of_all)
            + edges.get().map_or(0, of_edges)) as u64
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
    all: Option<&'a AllForLight>,
    whole: Option<Whole<'a>>,
}

/// Tables that are made with the mesh.
#[derive(Clone, Copy, Debug)]
struct Whole<'a> {
    start_forms: &'a [Forms],
    mesh: &'a Mesh,
    edges: &'a EdgesForLight,
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
        let whole = scene.whole.get().zip(of_light.edges.get());
        Self {
            occluders,
            frame,
            light,
            scene,
            of_light,
            all: of_light.all.get(),
            whole: whole.map(|(scene, edges)| Whole {
                start_forms: &scene.start_forms,
                mesh: &scene.mesh,
                edges,
            }),
        }
    }

    #[inline(always)]
    pub(crate) fn triangle_count(&self) -> usize {
        self.of_light.sides.len()
    }

    /// Returns the forms of the starts on a triangle.
    #[inline(always)]
    pub(crate) fn start_forms(&self, triangle: usize) -> Option<&'a Forms> {
        match self.whole {
            Some(whole) => whole.start_forms.get(triangle),
            None => {
                let forms = self.scene.start_forms.get(triangle)?;
                Some(forms.get_or_init(|| {
                    let triangle = SurfaceId(triangle as u32);
                    Box::new(start_forms(self.occluders, self.frame, triangle))
                }))
            }
        }
    }

    /// Returns the forms of a triangle's umbra.
    #[inline(always)]
    pub(crate) fn umbra_forms(&self, triangle: usize) -> Option<&'a Forms> {
        match self.all {
            Some(all) => all.umbra_forms.get(triangle),
            None => {
                let forms = self.of_light.umbra_forms.get(triangle)?;
                Some(forms.get_or_init(|| {
                    let triangle = SurfaceId(triangle as u32);
                    Box::new(umbra_forms(
                        self.occluders,
                        self.frame,
                        self.light,
                        triangle,
                    ))
                }))
            }
        }
    }

    /// Returns the forms of the umbrae of all triangles; none as long as not all are entered.
    #[inline(always)]
    pub(crate) fn all_umbra_forms(&self) -> &'a [Forms] {
        self.all.map_or(&[], |all| &all.umbra_forms)
    }

    /// Returns what tells whether points are where starts on triangles are, of all triangles; none as long as
    /// not all are entered.
    #[inline(always)]
    pub(super) fn start_planes(&self) -> &'a [StartPlane] {
        self.all.map_or(&[], |all| &all.start_planes)
    }

    /// Returns the side of a triangle's plane that the light is on.
    #[inline(always)]
    pub(crate) fn side(&self, triangle: usize) -> Option<i8> {
        match self.all {
            Some(all) => all.sides.get(triangle).copied(),
            None => {
                let kept = self.of_light.sides.get(triangle)?;
                let side = kept.load(Ordering::Relaxed);
                Some(if side == NO_SIDE {
                    self.ask_side(triangle, kept)
                } else {
                    side
                })
            }
        }
    }

    #[cold]
    fn ask_side(&self, triangle: usize, kept: &AtomicI8) -> i8 {
        let triangle = SurfaceId(triangle as u32);
        let side = self.occluders.light_side_of(triangle, self.light);
        kept.store(side, Ordering::Relaxed);
        side
    }

    /// Returns whether two triangles are known to lie in one plane.
    #[inline(always)]
    pub(crate) fn are_in_one_plane(&self, own: SurfaceId, other: SurfaceId) -> bool {
        own == other
            || self.whole.is_some_and(|Whole { mesh, .. }| {
                (own.0 as usize) < self.triangle_count()
                    && mesh.flat_group(own) == mesh.flat_group(other)
            })
    }

    /// Returns the mesh; without edges as long as there are no tables of all triangles.
    pub(crate) fn mesh(&self) -> &'a Mesh {
        self.whole.map_or(&self.scene.no_mesh, |whole| whole.mesh)
    }

    pub(crate) fn contour(&self, number: u32) -> Option<&'a Contour> {
        self.whole?.edges.contours.get(number as usize)
    }

    /// Returns the number of a contour edge of the mesh's, [`NONE`] if it is none.
    pub(crate) fn contour_number(&self, edge: u32) -> u32 {
        self.whole
            .and_then(|whole| whole.edges.contour_numbers.get(edge as usize))
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
