//! What may come between a cell and a light.
//!
//! In: the tree, and tables of all surfaces and contour edges for one light. Out: for a cell those that matter
//! to it: from the tree, or closer from those of a cell around it. Invariant: nothing that blocks some start of the inflated cell, or ends a shadow
//! there, is left out.

use antumbra_geometry::{
    Bounds, DVec3, ElementId, LightShape, Mesh, MeshEdge, Occluders, Relation, Shaft, SurfaceId,
    Umbra,
};
use rayon::prelude::*;

use super::forms::{BOUND, Forms, Verdict};
use crate::bvh::{Bvh, Region};
use crate::frame::Frame;

/// What one light makes of each surface and edge.
#[derive(Debug)]
pub(crate) struct CasterTables {
    light: LightShape,
    /// For each triangle the side of its plane that the light is on.
    pub(crate) sides: Vec<i8>,
    /// For each triangle the forms of its umbra.
    pub(crate) umbra_forms: Vec<Forms>,
    /// Edges that may cast edges of shadows.
    contours: Vec<Contour>,
    /// For each edge of the mesh its number among the contours.
    contour_numbers: Vec<u32>,
    /// Elements that are no faces and block.
    curved: Vec<CurvedCaster>,
    /// For each surface that is no triangle its number among them.
    curved_numbers: Vec<u32>,
}

/// In place of a number of what is not there.
const NONE: u32 = u32::MAX;

/// A scene's surfaces as one light sees them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Casters<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) mesh: &'a Mesh,
    pub(crate) frame: Frame,
    pub(crate) light: LightShape,
    tables: &'a CasterTables,
}

#[derive(Debug)]
pub(crate) struct Contour {
    pub(crate) edge: MeshEdge,
    ends: [DVec3; 2],
    /// The plane through the light and the edge, four times.
    plane: Forms,
}

#[derive(Debug)]
pub(crate) struct CurvedCaster {
    pub(crate) element: ElementId,
    pub(crate) umbra: Umbra,
    /// Whether it is large enough for a patch's rounding not to matter to what it covers.
    pub(crate) may_cover_patches: bool,
}

/// What may matter to a cell, by number.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates {
    /// Triangles that may block a start of the cell, with holes or without.
    pub(crate) triangles: Vec<u32>,
    /// Contour edges that may come between.
    pub(crate) contours: Vec<u32>,
    /// Curved elements that may block some start and may not block another.
    pub(crate) crossing: Vec<u32>,
    /// Curved elements that block every start, but perhaps their own.
    pub(crate) covering: Vec<u32>,
    /// Surfaces that may meet the cell, opaque or not.
    pub(crate) holders: Vec<u32>,
    /// Whether some triangle blocks every start of the cell.
    pub(crate) is_covered: bool,
}

impl Candidates {
    /// Returns how many there are.
    pub(crate) fn count(&self) -> usize {
        self.triangles.len()
            + self.contours.len()
            + self.crossing.len()
            + self.covering.len()
            + self.holders.len()
    }
}

/// Elements smaller than this share of the frame cover no patches.
const SMALLEST_COVER: f64 = 1.0 / (1u64 << 20) as f64;

impl CasterTables {
    pub(crate) fn new(occluders: &Occluders, mesh: &Mesh, frame: Frame, light: LightShape) -> Self {
        let sides = occluders.light_sides(&light);
        let umbra_forms = (0..occluders.triangle_count() as u32)
            .into_par_iter()
            .map(|triangle| {
                let corners = occluders.triangle_positions(SurfaceId(triangle));
                Forms::of_umbra(&frame, corners.expect("a triangle"), &light)
            })
            .collect();
        let mut contours = Vec::new();
        let number_of = |edge: &MeshEdge| {
            if !mesh.is_contour(edge, &sides) {
                return NONE;
            }
            let ends = occluders.edge_positions(edge);
            let plane = Forms::through_light(&frame, ends, &light);
            contours.push(Contour {
                edge: *edge,
                ends,
                plane,
            });
            contours.len() as u32 - 1
        };
        let contour_numbers = mesh.edges().iter().map(number_of).collect();
        let mut curved_numbers = vec![NONE; occluders.surface_count() - occluders.triangle_count()];
        let mut curved = Vec::new();
        let elements = (0..occluders.elements().len() as u32).map(ElementId);
        for element in elements.filter(|&element| !occluders.is_face(element)) {
            let umbra = occluders.umbra(element, &light);
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
        Self {
            light,
            sides,
            umbra_forms,
            contours,
            contour_numbers,
            curved,
            curved_numbers,
        }
    }

    /// Returns the bytes of all tables.
    pub(crate) fn bytes(&self) -> u64 {
        let Self {
            light: _,
            sides,
            umbra_forms,
            contours,
            contour_numbers,
            curved,
            curved_numbers,
        } = self;
        (size_of_val(sides.as_slice())
            + size_of_val(umbra_forms.as_slice())
            + size_of_val(contours.as_slice())
            + size_of_val(contour_numbers.as_slice())
            + size_of_val(curved.as_slice())
            + size_of_val(curved_numbers.as_slice())) as u64
    }
}

impl<'a> Casters<'a> {
    pub(crate) fn new(
        occluders: &'a Occluders,
        mesh: &'a Mesh,
        frame: Frame,
        tables: &'a CasterTables,
    ) -> Self {
        Self {
            occluders,
            mesh,
            frame,
            light: tables.light,
            tables,
        }
    }

    /// Returns the side of a triangle's plane that the light is on; none for other surfaces.
    pub(crate) fn side(&self, surface: u32) -> Option<i8> {
        self.tables.sides.get(surface as usize).copied()
    }

    /// Returns the forms of a triangle's umbra.
    pub(crate) fn umbra_forms(&self, triangle: u32) -> &'a Forms {
        &self.tables.umbra_forms[triangle as usize]
    }

    pub(crate) fn contour(&self, number: u32) -> &'a Contour {
        &self.tables.contours[number as usize]
    }

    pub(crate) fn curved(&self, number: u32) -> &'a CurvedCaster {
        &self.tables.curved[number as usize]
    }

    pub(crate) fn blocks_everywhere(&self, triangle: u32) -> bool {
        self.occluders.is_opaque_everywhere(SurfaceId(triangle))
    }

    /// Returns what may matter to a cell, not closely.
    pub(crate) fn gather(&self, bvh: &Bvh, bounds: &Bounds) -> Candidates {
        let region = Region::new(&self.frame, &Shaft::new(*bounds, self.light), bounds);
        let mut all = Candidates::default();
        bvh.cull(&region, |surface, is_near| {
            if is_near {
                all.holders.push(surface.0);
            }
            let Some(side) = self.side(surface.0) else {
                let number = surface.0 as usize - self.tables.sides.len();
                all.crossing.push(self.tables.curved_numbers[number]);
                return;
            };
            if side != 0 && self.occluders.is_opaque(surface) {
                all.triangles.push(surface.0);
            }
            // The edges of those whose plane holds the light cast shadows as well.
            for edge in self.mesh.edges_of(surface) {
                if let Some(&number) = self.tables.contour_numbers.get(edge as usize) {
                    all.contours.push(number);
                }
            }
        });
        // Elements have several surfaces, and edges several triangles.
        for numbers in [&mut all.contours, &mut all.crossing] {
            numbers.sort_unstable();
            numbers.dedup();
            if numbers.last() == Some(&NONE) {
                numbers.pop();
            }
        }
        all
    }

    /// Returns those of the candidates that matter to a cell.
    pub(crate) fn narrow(&self, all: &Candidates, bounds: &Bounds) -> Candidates {
        let shaft = Shaft::new(*bounds, self.light);
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        let center = narrow(self.frame.point_in_frame(bounds.center()));
        let half = narrow(bounds.size() * (0.5 * self.frame.scale)).map(|x| x + 0.25 * BOUND);

        let mut kept = Candidates {
            // A cell within a covered one is covered.
            is_covered: all.is_covered,
            covering: all.covering.clone(),
            ..Candidates::default()
        };
        for &triangle in &all.triangles {
            match self.umbra_forms(triangle).verdict_of_box(center, half) {
                Verdict::Outside => continue,
                Verdict::Inside => kept.is_covered |= self.blocks_everywhere(triangle),
                Verdict::Doubt => {
                    let corners = self.occluders.triangle_positions(SurfaceId(triangle));
                    if corners.is_some_and(|corners| shaft.misses_triangle(&corners)) {
                        continue;
                    }
                }
            }
            kept.triangles.push(triangle);
        }
        for &number in &all.contours {
            let contour = self.contour(number);
            let is_missed =
                contour.plane.straddles_not(center, half) || shaft.misses_edge(&contour.ends);
            if !is_missed {
                kept.contours.push(number);
            }
        }
        for &number in &all.crossing {
            match self.curved(number).umbra.relation(&shaft) {
                Relation::Misses => {}
                Relation::Crosses => kept.crossing.push(number),
                Relation::Covers => kept.covering.push(number),
            }
        }
        kept.holders.extend(
            all.holders
                .iter()
                .copied()
                .filter(|&surface| self.occluders.may_meet_box(SurfaceId(surface), bounds)),
        );
        kept
    }
}
