//! What may come between a cell and a light.
//!
//! In: the tree, and tables of all surfaces and contour edges for one light. Out: for a cell those that matter
//! to it: from the tree, or closer from those of a cell around it. Invariant: nothing that blocks some start of the inflated cell, or ends a shadow
//! there, is left out.

use antumbra_geometry::{Bounds, DVec3, LightShape, Mesh, Occluders, Relation, Shaft, SurfaceId};

use super::forms::{BOUND, Forms, Verdict};
use super::tables::{Contour, CurvedCaster, NONE, Tables};
use super::value::ReceiverClass;
use crate::accel::bvh::{Bvh, Region};
use crate::accel::frame::Frame;

/// A scene's surfaces as one light sees them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Casters<'a> {
    pub(crate) occluders: &'a Occluders,
    pub(crate) mesh: &'a Mesh,
    pub(crate) frame: Frame,
    pub(crate) light: LightShape,
    tables: Tables<'a>,
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
}

impl<'a> Casters<'a> {
    pub(crate) fn new(tables: Tables<'a>) -> Self {
        Self {
            occluders: tables.occluders,
            mesh: tables.mesh(),
            frame: *tables.frame,
            light: *tables.light,
            tables,
        }
    }

    /// Returns the side of a triangle's plane that the light is on; none for other surfaces.
    pub(crate) fn side(&self, surface: u32) -> Option<i8> {
        self.tables.side(surface as usize)
    }

    /// Returns the forms of a triangle's umbra.
    pub(crate) fn umbra_forms(&self, triangle: u32) -> &'a Forms {
        self.tables
            .umbra_forms(triangle as usize)
            .unwrap_or(&Forms::NOWHERE)
    }

    pub(crate) fn contour(&self, number: u32) -> Option<&'a Contour> {
        self.tables.contour(number)
    }

    pub(crate) fn curved(&self, number: u32) -> &'a CurvedCaster {
        self.tables.curved(number)
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
                all.crossing.push(self.tables.curved_number(surface));
                return;
            };
            if side != 0 && self.occluders.is_opaque(surface) {
                all.triangles.push(surface.0);
            }
            // The edges of those whose plane holds the light cast shadows as well.
            let edges = self.mesh.edges_of(surface);
            let numbers = edges.map(|edge| self.tables.contour_number(edge));
            all.contours.extend(numbers);
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

    /// Leaves in `kept` those of the surfaces that may meet a cell. Returns whether a receiver class may start there.
    pub(crate) fn narrow_holders(
        &self,
        all: &Candidates,
        bounds: &Bounds,
        class: ReceiverClass,
        kept: &mut Candidates,
    ) -> bool {
        let wanted = match class {
            ReceiverClass::Front => 1,
            ReceiverClass::Back => -1,
            ReceiverClass::Free => 0,
        };
        let mut are_there = class == ReceiverClass::Free;
        kept.holders.clear();
        let (center, half) = self.box_in_frame(bounds);
        for &holder in &all.holders {
            // Most are told by their edges and plane.
            let is_beside = self
                .tables
                .start_forms(holder as usize)
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
            let Some(contour) = self.contour(number) else {
                continue;
            };
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
