//! Lines on a light that surfaces make for one start: which of them bound what a surface hides.
//!
//! In: surfaces. Out: half-planes (on a segment, half-lines), whose common part is what a triangle hides. Invariant: a
//! place of the light strictly inside of all of them is one that the triangle blocks by the rule, and a place strictly
//! outside of one is not.

use glam::DVec3;
use hashbrown::HashMap;

use super::pyramid::Pyramid;
use super::trace::{Eye, Line, Trace};
use crate::number::{Approximate, Exact, Number, Sign};
use crate::segment::Plane;
use crate::{Occluders, SurfaceId};

/// One side of a line: the line's number, and whether it is the side where the form is negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Half(u32);

impl Half {
    pub(super) fn new(line: usize, is_negative: bool) -> Self {
        Self((line as u32) << 1 | u32::from(is_negative))
    }

    pub(super) fn line(self) -> usize {
        (self.0 >> 1) as usize
    }

    pub(super) fn flipped(self) -> Self {
        Self(self.0 ^ 1)
    }

    pub(super) fn is_negative(self) -> bool {
        self.0 & 1 != 0
    }
}

/// What a surface may do to a light.
#[derive(Debug)]
pub(super) enum Candidate {
    /// It hides nothing of it.
    Misses,
    /// It may hide some, and what has no closed form.
    Unclear,
    /// It hides what is inside of all of these.
    Hides(Vec<Half>),
}

/// Lines of one start, and whose shadows they are.
#[derive(Debug)]
pub(super) struct Lines<'a, const K: usize> {
    pub(super) occluders: &'a Occluders,
    pub(super) eye: Eye<K>,
    pub(super) pyramid: Pyramid,
    lines: Vec<Line<K>>,
    /// The ends of lines that are edges seen from the start: vertices of the surfaces.
    ends: Vec<Option<[u32; 2]>>,
    /// Lines by the edge that they are the shadow of; none where that has none.
    by_edge: HashMap<[u32; 2], Option<usize>>,
}

impl<'a, const K: usize> Lines<'a, K> {
    pub(super) fn new(occluders: &'a Occluders, eye: Eye<K>, pyramid: Pyramid) -> Self {
        Self {
            occluders,
            eye,
            pyramid,
            lines: Vec::new(),
            ends: Vec::new(),
            by_edge: HashMap::new(),
        }
    }

    /// Takes a line up and returns its number.
    pub(super) fn add(&mut self, trace: Trace<K>) -> usize {
        let line = self.eye.line(trace);
        self.lines.push(line);
        self.ends.push(None);
        self.lines.len() - 1
    }

    /// Returns whether a line is zero everywhere.
    pub(super) fn is_zero(&mut self, line: usize) -> bool {
        self.eye.is_zero(&mut self.lines[line])
    }

    /// Returns what a surface hides, as far as the rule of the surface itself goes: holes are the caller's.
    pub(super) fn candidate(&mut self, surface: SurfaceId) -> Candidate {
        let occluders = self.occluders;
        let own = self.eye.segment.start().surface;
        if !occluders.is_opaque(surface) || own == Some(surface) {
            return Candidate::Misses;
        }
        let Some(corners) = occluders.triangle_positions(surface) else {
            let is_own = own.is_some_and(|own| occluders.have_one_own_rule(own, surface));
            let is_missed = match occluders.sphere(surface) {
                Some(sphere) => sphere.radius == 0.0 || self.pyramid.misses_sphere(&sphere),
                None => self
                    .pyramid
                    .misses(&occluders.surface_bounds(surface).corners()),
            };
            return if is_own || is_missed {
                Candidate::Misses
            } else {
                Candidate::Unclear
            };
        };
        let Some(vertices) = occluders.triangle_vertices(surface) else {
            return Candidate::Misses;
        };
        if self.pyramid.misses(&corners) {
            return Candidate::Misses;
        }
        let plane = Plane::Points(corners);
        let side = self.eye.side_of_start(&plane);
        if side == Sign::Zero {
            return Candidate::Misses;
        }
        // The light must be on the other side, and all edges turn the way that this means.
        let is_above = side.is_positive();
        let line = self.add(Trace::Plane(plane));
        if self.is_zero(line) {
            // The light lies in the triangle's plane, and is on no side of it.
            return Candidate::Misses;
        }
        let mut halves = vec![Half::new(line, is_above)];
        for from in 0..3 {
            let to = (from + 1) % 3;
            let is_reversed = vertices[from] > vertices[to];
            let (low, high) = if is_reversed { (to, from) } else { (from, to) };
            let ends = [vertices[low], vertices[high]];
            if let Some(line) = self.edge(ends, [corners[low], corners[high]]) {
                halves.push(Half::new(line, is_above != is_reversed));
            }
        }
        Candidate::Hides(halves)
    }

    /// Returns the line of an edge, made once for all faces that share it.
    fn edge(&mut self, ends: [u32; 2], places: [DVec3; 2]) -> Option<usize> {
        if let Some(&line) = self.by_edge.get(&ends) {
            return line;
        }
        let line = self.eye.edge(places).map(|(line, is_from_start)| {
            self.lines.push(line);
            self.ends.push(is_from_start.then_some(ends));
            self.lines.len() - 1
        });
        self.by_edge.insert(ends, line);
        line
    }

    /// Returns whether three lines are the shadows of edges with a vertex in common, so that they meet in its shadow.
    pub(super) fn meet_in_a_vertex(&self, lines: [usize; 3]) -> bool {
        let [Some(first), Some(second), Some(third)] = lines.map(|line| self.ends[line]) else {
            return false;
        };
        first
            .iter()
            .any(|end| second.contains(end) && third.contains(end))
    }

    /// Returns a half's form, with bounds.
    pub(super) fn rough(&self, half: Half) -> [Approximate; K] {
        let numbers = self.lines[half.line()].rough;
        if half.is_negative() {
            numbers.map(|x| x.negated())
        } else {
            numbers
        }
    }

    /// Returns a half's form, exactly, up to a factor above zero.
    pub(super) fn exact(&mut self, half: Half) -> [Exact; K] {
        let numbers = self.eye.exact(&mut self.lines[half.line()]);
        if half.is_negative() {
            numbers.each_ref().map(Number::negated)
        } else {
            numbers.clone()
        }
    }
}
