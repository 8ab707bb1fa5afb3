//! What is told of the faces of a cell that has a list.
//!
//! In: the facets of the list. Out: for each whether all its starts in the cell are lit, or in shadow, or it is not
//! known. The proof is in the note beside this file, "Faces".

use antumbra_geometry::{DVec3, SurfaceId};
use fearless_simd::Simd;

use super::super::forms::Verdict;
use super::build::{Builder, Entry};
use super::faces::Part;

/// Longer lists are left in doubt.
const MOST_RESOLVED: usize = 12;

/// Heights over a plane are told with this share of the products they are made of: they err by less than a sixteenth.
const HEIGHT_DOUBT: f64 = 1.0 / (1u64 << 44) as f64;

/// An entry that a list asks, and the corners of a triangle.
struct Asked {
    entry: Entry,
    corners: Option<[DVec3; 3]>,
}

impl<S: Simd> Builder<'_, S> {
    /// Tells of those entries of a list that it asks.
    pub(super) fn resolve(&mut self, list: &[Entry], is_asked: impl Fn(usize) -> bool) {
        let asked = || (0..list.len()).filter(|&number| is_asked(number));
        // What other cells have told apart stays so.
        if asked().all(|number| self.part_of(list[number].facet).is_mixed()) {
            return;
        }
        if asked().nth(MOST_RESOLVED).is_some() {
            return asked().for_each(|number| self.tell(list[number].facet, Part::DOUBT));
        }
        let asked: Vec<Asked> = asked().map(|number| self.asked(&list[number])).collect();
        for number in 0..asked.len() {
            let facet = asked[number].entry.facet;
            if !self.part_of(facet).is_mixed() {
                let part = self.resolved(&asked, number);
                self.tell(facet, part);
            }
        }
    }

    fn resolved(&self, asked: &[Asked], number: usize) -> Part {
        let own = &asked[number];
        let Some(corners) = &own.corners else {
            return Part::DOUBT;
        };
        let others = || asked.iter().enumerate().filter(|other| other.0 != number);
        if !others().any(|(_, other)| self.may_hide(other, own, corners)) {
            return Part::LIT;
        }
        // What hides a whole triangle begins before it.
        let mut before = others().filter(|(_, other)| other.entry.near <= own.entry.near);
        match before.any(|(_, other)| self.hides_all(&other.entry, corners)) {
            true => Part::SHADOWED,
            false => Part::DOUBT,
        }
    }

    fn asked(&self, entry: &Entry) -> Asked {
        Asked {
            entry: *entry,
            corners: self.corners(entry),
        }
    }

    fn corners(&self, entry: &Entry) -> Option<[DVec3; 3]> {
        let surface = SurfaceId(self.facet(entry).surface);
        self.tables.occluders.triangle_positions(surface)
    }

    /// Returns whether a facet may hide a part of another in the cell.
    fn may_hide(&self, other: &Asked, own: &Asked, corners: &[DVec3; 3]) -> bool {
        if other.entry.near > own.entry.far {
            return false;
        }
        let Some(others) = &other.corners else {
            return true;
        };
        let (a, b) = (self.facet(&own.entry), self.facet(&other.entry));
        if a.has_sides() && b.has_sides() {
            let are_parted =
                a.parts_from(b, [corners, others]) || b.parts_from(a, [others, corners]);
            if are_parted {
                return false;
            }
        }
        let [own_side, other_side] = [a, b].map(|facet| {
            let side = self.tables.side(facet.surface as usize);
            f64::from(side.unwrap_or(0))
        });
        // Before the other's plane, or the other behind this one's.
        let is_before = are_on(others, other_side, corners);
        let is_behind = are_on(corners, -own_side, others);
        !is_before && !is_behind
    }

    /// Returns whether a facet surely hides a whole triangle.
    fn hides_all(&self, other: &Entry, corners: &[DVec3; 3]) -> bool {
        let surface = self.facet(other).surface;
        let forms = self.tables.umbra_forms(surface as usize);
        let is_opaque = self
            .tables
            .occluders
            .is_opaque_everywhere(SurfaceId(surface));
        forms.filter(|_| is_opaque).is_some_and(|forms| {
            corners.iter().all(|&corner| {
                let place = self.tables.frame.point_in_frame(corner);
                let place = place.to_array().map(|x| x as f32);
                forms.verdict(place) == Verdict::Inside
            })
        })
    }
}

/// Returns whether points surely lie on one side of a triangle's plane, or are corners of it.
fn are_on(plane: &[DVec3; 3], side: f64, points: &[DVec3; 3]) -> bool {
    let [a, b, c] = *plane;
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let size = ab.abs().max_element() * ac.abs().max_element();
    side != 0.0
        && points.iter().all(|point| {
            let seen = *point - a;
            let doubt = HEIGHT_DOUBT * size * seen.abs().max_element() + f64::MIN_POSITIVE;
            plane.contains(point) || side * normal.dot(seen) > doubt
        })
}
