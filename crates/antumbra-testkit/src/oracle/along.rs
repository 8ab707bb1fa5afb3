//! Which points of a segment a light reaches (EXACTNESS.md, "Lit intervals along a segment").
//!
//! No interval of any surface is computed here. Every place where an answer may change is a zero of a number that some
//! surface decides by, so between two neighbours of them the free query of one point answers for all: the rule itself is
//! asked, at rational points. The numbers are taken at four places each, and the polynomials are those through them.

use super::place::{OraclePlace, Polynomial};
use super::share::OracleShare;
use super::surface::{Light, ReceiverPoint, Segment};
use super::{Oracle, OracleLight};
use crate::exact::{Exact, Vec3};

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
        let segment = segment_at(ends, &share.0, light);
        (0..self.surfaces.len()).any(|t| self.blocks_segment(t, None, &segment))
    }

    /// Returns the lit intervals of a segment, in order.
    ///
    /// # Panics
    ///
    /// As [`Oracle::is_blocked`].
    pub fn lit_intervals_along(
        &self,
        ends: [[f64; 3]; 2],
        light: OracleLight,
    ) -> Vec<[OraclePlace; 2]> {
        let segments = [-1.0, 0.0, 1.0, 2.0].map(|t| segment_at(ends, &Exact::new(t), light));
        let mut places = vec![OraclePlace::end(0.0), OraclePlace::end(1.0)];
        for (surface, prepared) in self.surfaces.iter().zip(&self.prepared) {
            if surface.opaque {
                let mut numbers = segments
                    .each_ref()
                    .map(|x| prepared.decisive(x).into_iter());
                while let [Some(a), Some(b), Some(c), Some(d)] =
                    numbers.each_mut().map(|left| left.next())
                {
                    places.extend(Polynomial::through([a, b, c, d]).zeros());
                }
            }
        }
        places.sort_by(OraclePlace::compare);
        let mut lit: Vec<[OraclePlace; 2]> = Vec::new();
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

/// The line from a place of a segment to a light.
fn segment_at(ends: [[f64; 3]; 2], share: &Exact, light: OracleLight) -> Segment {
    let [first, last] = ends.map(Vec3::new);
    let start = ReceiverPoint {
        scaled: &first + &(&last - &first).scale(share),
        scale: Exact::ONE,
    };
    Segment::new(start, Light::new(light), None)
}
