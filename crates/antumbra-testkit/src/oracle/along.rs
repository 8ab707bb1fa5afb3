//! Which points of a segment a light reaches (EXACTNESS.md, "Lit intervals along a segment").
//!
//! No interval of any triangle is computed here. Every place where an answer may change is a zero of one of the page's
//! forms, so between two neighbours of them the free query of one point answers for all: the rule itself is asked, at
//! rational points.

use super::share::OracleShare;
use super::surface::{Light, Segment, Start};
use super::{Oracle, OracleLight, OracleShape};
use crate::exact::Vec3;

impl Oracle {
    /// Says whether a place of a segment is in shadow: the free query of that point, which need not be a point of `f64`s.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn is_blocked_along(
        &self,
        ends: [[f64; 3]; 2],
        share: &OracleShare,
        light: OracleLight,
    ) -> bool {
        let [first, last] = ends.map(Vec3::new);
        let start = Start {
            scaled: &first.scale(&(&share.under - &share.over)) + &last.scale(&share.over),
            scale: share.under.clone(),
        };
        let segment = Segment::new(start, Light::new(light), None);
        (0..self.surfaces.len()).any(|t| self.blocks_segment(t, None, &segment))
    }

    /// Returns the lit intervals of a segment, in order.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`], and when an opaque surface is no triangle.
    pub fn lit_intervals_along(
        &self,
        ends: [[f64; 3]; 2],
        light: OracleLight,
    ) -> Vec<[OracleShare; 2]> {
        let mut places = vec![OracleShare::new(0.0), OracleShare::new(1.0)];
        for surface in self.surfaces.iter().filter(|surface| surface.opaque) {
            let OracleShape::Triangle(corners) = surface.shape else {
                panic!("lit intervals are those between shadows of triangles");
            };
            places.extend(changes(corners, ends, light));
        }
        places.sort_by(OracleShare::compare);
        let mut lit: Vec<[OracleShare; 2]> = Vec::new();
        let mut was_lit = false;
        for pair in places.windows(2) {
            let [from, to] = pair else { continue };
            if from.compare(to).is_eq() {
                continue;
            }
            let is_lit = !self.is_blocked_along(ends, &from.between(to), light);
            match lit.last_mut() {
                Some(last) if is_lit && was_lit => last[1] = to.clone(),
                _ if is_lit => lit.push([from.clone(), to.clone()]),
                _ => {}
            }
            was_lit = is_lit;
        }
        lit
    }
}

/// The places strictly between the ends where the segment crosses the plane of a triangle, or a plane through one of its
/// edges and the light.
fn changes(
    corners: [[f64; 3]; 3],
    ends: [[f64; 3]; 2],
    light: OracleLight,
) -> impl Iterator<Item = OracleShare> {
    let corners = corners.map(Vec3::new);
    let [first, last] = ends.map(Vec3::new);
    let light = Light::new(light);
    let edges = [0, 1, 2].map(|i: usize| &corners[(i + 1) % 3] - &corners[i]);
    let planes = [0, 1, 2, 3].map(|i: usize| match i {
        3 => (edges[0].cross(&edges[1]), corners[0].clone()),
        _ => {
            let towards = &light.position - &corners[i].scale(&light.weight);
            (towards.cross(&edges[i]), corners[i].clone())
        }
    });
    let along = &last - &first;
    planes.into_iter().filter_map(move |(normal, point)| {
        let rate = normal.dot(&along);
        if rate.is_zero() {
            return None;
        }
        let share = OracleShare::of(normal.dot(&(&point - &first)), rate);
        let is_between = share.over.sign() > 0 && share.over.compare(&share.under).is_lt();
        is_between.then_some(share)
    })
}
