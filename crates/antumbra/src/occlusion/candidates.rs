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
use super::value::Audience;
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
    /// For each triangle the forms of the starts on it.
    start_forms: &'a [Forms],
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
    pub(crate) const NONE: Self = Self {
        triangles: Vec::new(),
        contours: Vec::new(),
        crossing: Vec::new(),
        covering: Vec::new(),
        holders: Vec::new(),
        is_covered: false,
    };

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
        start_forms: &'a [Forms],
        frame: Frame,
        tables: &'a CasterTables,
    ) -> Self {
        Self {
            occluders,
            mesh,
            frame,
            light: tables.light,
            start_forms,
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

    /// Returns what may matter to a cell, not closely; without edges where nothing is to be proven by them.
    pub(crate) fn gather(&self, bvh: &Bvh, bounds: &Bounds, has_edges: bool) -> Candidates {
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
            let edges = self.mesh.edges_of(surface);
            for edge in edges.into_iter().filter(|_| has_edges) {
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

    /// Leaves in `kept` those of the surfaces that may meet a cell. Returns whether an audience may start there.
    pub(crate) fn narrow_holders(
        &self,
        all: &Candidates,
        bounds: &Bounds,
        audience: Audience,
        kept: &mut Candidates,
    ) -> bool {
        let wanted = match audience {
            Audience::Front => 1,
            Audience::Back => -1,
            Audience::Free => 0,
        };
        let mut are_there = audience == Audience::Free;
        kept.holders.clear();
        let (center, half) = self.box_in_frame(bounds);
        for &holder in &all.holders {
            // Most are told by their edges and plane.
            let is_beside = self
                .start_forms
                .get(holder as usize)
                .is_some_and(|forms| forms.is_beside(center, half));
            let may_meet = || {
                let holder = SurfaceId(holder);
                match self.occluders.triangle_positions(holder) {
                    Some(corners) => Bounds::of_points(corners).overlaps(bounds),
                    None => self.occluders.may_meet_box(holder, bounds),
                }
            };
            if !is_beside && may_meet() {
                kept.holders.push(holder);
                // Starts on curved surfaces are at the front.
                are_there |= self.side(holder).unwrap_or(1) == wanted;
            }
        }
        are_there
    }

    /// Leaves in `kept` those of the triangles, edges and curved shapes that matter to a cell.
    pub(crate) fn narrow(&self, all: &Candidates, bounds: &Bounds, kept: &mut Candidates) {
        let (center, half) = self.box_in_frame(bounds);
        // Most candidates are told without it.
        let mut shaft = None;
        let mut region = None;

        // A cell within a covered one is covered.
        kept.is_covered = all.is_covered;
        kept.covering.clone_from(&all.covering);
        kept.triangles.clear();
        kept.contours.clear();
        kept.crossing.clear();
        let new_shaft = || Shaft::new(*bounds, self.light);
        let new_region = |shaft: &Shaft| Region::new(&self.frame, shaft, bounds);
        for &triangle in &all.triangles {
            match self.umbra_forms(triangle).verdict_of_box(center, half) {
                Verdict::Outside => continue,
                Verdict::Inside => kept.is_covered |= self.blocks_everywhere(triangle),
                Verdict::Doubt => {
                    let shaft = shaft.get_or_insert_with(new_shaft);
                    let region = region.get_or_insert_with(|| new_region(shaft));
                    let corners = self.occluders.triangle_positions(SurfaceId(triangle));
                    if corners.is_some_and(|corners| self.is_outside(region, &corners)) {
                        continue;
                    }
                }
            }
            kept.triangles.push(triangle);
        }
        for &number in &all.contours {
            let contour = self.contour(number);
            let is_missed = contour.plane.straddles_not(center, half) || {
                let shaft = shaft.get_or_insert_with(new_shaft);
                let region = region.get_or_insert_with(|| new_region(shaft));
                self.is_outside(region, &contour.ends)
            };
            if !is_missed {
                kept.contours.push(number);
            }
        }
        for &number in &all.crossing {
            let shaft = shaft.get_or_insert_with(new_shaft);
            match self.curved(number).umbra.relation(shaft) {
                Relation::Misses => {}
                Relation::Crosses => kept.crossing.push(number),
                Relation::Covers => kept.covering.push(number),
            }
        }
    }

    /// Returns the middle of a box in the frame, and half its size, a little larger.
    fn box_in_frame(&self, bounds: &Bounds) -> ([f32; 3], [f32; 3]) {
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        let center = narrow(self.frame.point_in_frame(bounds.center()));
        let half = narrow(bounds.size() * (0.5 * self.frame.scale));
        (center, half.map(|x| x + 0.25 * BOUND))
    }

    /// Returns whether the hull of some points of the scene surely misses a region's shaft.
    fn is_outside(&self, region: &Region, points: &[DVec3]) -> bool {
        let narrow = |&v: &DVec3| {
            let x = self.frame.point_in_frame(v);
            [x.x as f32, x.y as f32, x.z as f32]
        };
        region.misses(points.iter().map(narrow))
    }
}
