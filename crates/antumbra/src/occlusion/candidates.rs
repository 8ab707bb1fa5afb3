//! What may come between a cell and a light.
//!
//! In: all surfaces and contour edges for one light. Out: for a cell those that matter to it, from those
//! of a cell around it. Invariant: nothing that blocks some start of the inflated cell, or ends a shadow
//! there, is left out.

use antumbra_geometry::{
    Bounds, DVec3, ElementId, LightShape, Mesh, MeshEdge, Occluders, Relation, Shaft, SurfaceId,
    Umbra,
};
use rayon::prelude::*;

use super::forms::{BOUND, Forms, Verdict};
use crate::frame::Frame;

/// A scene's surfaces as one light sees them.
#[derive(Debug)]
pub(crate) struct Casters<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) mesh: &'a Mesh,
    pub(crate) frame: Frame,
    pub(crate) light: LightShape,
    /// For each triangle the side of its plane that the light is on.
    pub(crate) sides: Vec<i8>,
    /// For each triangle that blocks the forms of its umbra.
    pub(crate) umbra_forms: Vec<Forms>,
    /// Edges that may cast edges of shadows.
    contours: Vec<Contour>,
    /// Elements that are no faces and block.
    curved: Vec<CurvedCaster>,
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

/// Elements smaller than this share of the frame cover no patches.
const SMALLEST_COVER: f64 = 1.0 / (1u64 << 20) as f64;

/// Cells of fewer halvings are so large that their shaft holds almost everything.
const SHAFT_LEVEL: u32 = 2;

impl<'a> Casters<'a> {
    pub(crate) fn new(
        occluders: &'a Occluders,
        mesh: &'a Mesh,
        frame: Frame,
        light: LightShape,
    ) -> Self {
        let sides = occluders.light_sides(&light);
        let umbra_forms = (0..occluders.triangle_count() as u32)
            .into_par_iter()
            .map(|triangle| {
                let corners = occluders.triangle_positions(SurfaceId(triangle));
                Forms::of_umbra(&frame, corners.expect("a triangle"), &light)
            })
            .collect();
        let contours = mesh
            .edges()
            .iter()
            .filter(|edge| mesh.is_contour(edge, &sides))
            .map(|&edge| {
                let ends = occluders.edge_positions(&edge);
                let plane = Forms::through_light(&frame, ends, &light);
                Contour { edge, ends, plane }
            })
            .collect();
        let curved = (0..occluders.elements().len() as u32)
            .map(ElementId)
            .filter(|&element| !occluders.is_face(element))
            .map(|element| {
                let size = occluders.element_bounds(element).size().max_element();
                CurvedCaster {
                    element,
                    umbra: occluders.umbra(element, &light),
                    may_cover_patches: size * frame.scale > SMALLEST_COVER,
                }
            })
            .filter(|caster| !caster.umbra.is_nothing())
            .collect();
        Self {
            occluders,
            mesh,
            frame,
            light,
            sides,
            umbra_forms,
            contours,
            curved,
        }
    }

    pub(crate) fn contour(&self, number: u32) -> &Contour {
        &self.contours[number as usize]
    }

    pub(crate) fn curved(&self, number: u32) -> &CurvedCaster {
        &self.curved[number as usize]
    }

    pub(crate) fn blocks_everywhere(&self, triangle: u32) -> bool {
        self.occluders.is_opaque_everywhere(SurfaceId(triangle))
    }

    /// Returns everything.
    pub(crate) fn all(&self) -> Candidates {
        let triangles = 0..self.occluders.triangle_count() as u32;
        Candidates {
            triangles: triangles
                .filter(|&triangle| {
                    self.sides[triangle as usize] != 0
                        && self.occluders.is_opaque(SurfaceId(triangle))
                })
                .collect(),
            contours: (0..self.contours.len() as u32).collect(),
            crossing: (0..self.curved.len() as u32).collect(),
            covering: Vec::new(),
            holders: self.occluders.surfaces().map(|surface| surface.0).collect(),
            is_covered: false,
        }
    }

    /// Returns those of the candidates that matter to a cell.
    pub(crate) fn narrow(&self, all: &Candidates, bounds: &Bounds, level: u32) -> Candidates {
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
            match self.umbra_forms[triangle as usize].verdict_of_box(center, half) {
                Verdict::Outside => continue,
                Verdict::Inside => kept.is_covered |= self.blocks_everywhere(triangle),
                Verdict::Doubt if level >= SHAFT_LEVEL => {
                    let corners = self.occluders.triangle_positions(SurfaceId(triangle));
                    if corners.is_some_and(|corners| shaft.misses_triangle(&corners)) {
                        continue;
                    }
                }
                Verdict::Doubt => {}
            }
            kept.triangles.push(triangle);
        }
        for &number in &all.contours {
            let contour = &self.contours[number as usize];
            let is_missed = contour.plane.straddles_not(center, half)
                || (level >= SHAFT_LEVEL && shaft.misses_edge(&contour.ends));
            if !is_missed {
                kept.contours.push(number);
            }
        }
        for &number in &all.crossing {
            match self.curved[number as usize].umbra.relation(&shaft) {
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
