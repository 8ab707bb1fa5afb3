//! Convex pieces of a light, cut by lines.
//!
//! In: lines. Out: the pieces on either side of them. Invariants: a piece is what its lines bound, so its corners are
//! crossings of lines as they were given, however often it was cut; which side of a line a corner is on is exact; no
//! piece is without area.

use super::lines::{Half, Lines};
use crate::number::{Approximate, Exact, Number, Sign, decide};

/// Where two lines cross: weight, `u`, `v`, with a weight above zero.
#[derive(Debug)]
struct Corner {
    halves: [Half; 2],
    rough: [Approximate; 3],
    exact: Option<Box<[Exact; 3]>>,
    place: [f64; 2],
}

/// A convex piece: its sides in counter-clockwise order, and before each its corner with the side before.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    sides: Vec<(Half, u32)>,
    min: [f64; 2],
    max: [f64; 2],
}

/// Places are right to this share of the light's extent, or are computed exactly first.
const FINE: f64 = 1.0 / (1_u64 << 48) as f64;

/// What boxes of places leave for their rounding.
const ROOM: f64 = 1.0 / (1_u64 << 40) as f64;

impl Piece {
    /// Returns whether two pieces are surely apart.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        (0..2).any(|axis| {
            self.min[axis] > other.max[axis] + ROOM || other.min[axis] > self.max[axis] + ROOM
        })
    }

    /// Returns the sides.
    pub(super) fn sides(&self) -> impl Iterator<Item = Half> {
        self.sides.iter().map(|&(half, _)| half)
    }
}

/// Where a piece lies about a line.
#[derive(Debug)]
pub(super) enum Cut {
    /// All of it is inside, up to its border.
    Inside,
    /// All of it is outside, up to its border.
    Outside,
    /// Some of it is inside and some outside: where each corner is.
    Both(Vec<Sign>),
}

/// Lines and the corners that they make.
#[derive(Debug)]
pub(super) struct Plan<'a> {
    pub(super) lines: Lines<'a, 3>,
    corners: Vec<Corner>,
}

impl<'a> Plan<'a> {
    pub(super) fn new(lines: Lines<'a, 3>) -> Self {
        Self {
            lines,
            corners: Vec::new(),
        }
    }

    /// Returns the piece that lines bound, which are in counter-clockwise order and make a bounded area.
    pub(super) fn piece(&mut self, halves: &[Half]) -> Piece {
        let count = halves.len();
        let sides = (0..count)
            .map(|number| {
                let before = halves[(number + count - 1) % count];
                (halves[number], self.corner(before, halves[number]))
            })
            .collect();
        self.bounded(sides)
    }

    fn bounded(&self, sides: Vec<(Half, u32)>) -> Piece {
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for &(_, corner) in &sides {
            let place = self.corners[corner as usize].place;
            for axis in 0..2 {
                min[axis] = min[axis].min(place[axis]);
                max[axis] = max[axis].max(place[axis]);
            }
        }
        Piece { sides, min, max }
    }

    /// Returns the places of a piece's corners, in order.
    pub(super) fn places(&self, piece: &Piece) -> impl Iterator<Item = [f64; 2]> + Clone {
        let corners = piece.sides.iter();
        corners.map(|&(_, corner)| self.corners[corner as usize].place)
    }

    /// Returns where a piece lies about a line.
    pub(super) fn cut(&mut self, piece: &Piece, half: Half) -> Cut {
        let signs: Vec<Sign> = piece
            .sides
            .iter()
            .map(|&(_, corner)| self.side_of(corner, half))
            .collect();
        if !signs.contains(&Sign::Negative) {
            // Also a form that is zero everywhere, which is no border.
            Cut::Inside
        } else if !signs.contains(&Sign::Positive) {
            Cut::Outside
        } else {
            Cut::Both(signs)
        }
    }

    /// Returns the part of a piece inside of a line that cuts it.
    pub(super) fn inside(&mut self, piece: &Piece, signs: &[Sign], half: Half) -> Piece {
        self.part(piece, signs, half, Sign::Positive)
    }

    /// Returns the part of a piece outside of a line that cuts it.
    pub(super) fn outside(&mut self, piece: &Piece, signs: &[Sign], half: Half) -> Piece {
        self.part(piece, signs, half.flipped(), Sign::Negative)
    }

    fn part(&mut self, piece: &Piece, signs: &[Sign], half: Half, wanted: Sign) -> Piece {
        let count = signs.len();
        // Corners with the sign are a run around the piece, and so are the sides that they end.
        let is_wanted = |corner: usize| signs[corner % count] == wanted;
        let first = (0..count)
            .find(|&side| !is_wanted(side) && is_wanted(side + 1))
            .unwrap_or(0);
        let mut sides = Vec::with_capacity(count + 1);
        for step in 0..count {
            let side = first + step;
            sides.push(piece.sides[side % count]);
            if !is_wanted(side + 1) {
                break;
            }
        }
        let (begin, end) = (sides[0].0, sides[sides.len() - 1].0);
        sides[0].1 = self.corner(half, begin);
        let closing = self.corner(end, half);
        sides.push((half, closing));
        self.bounded(sides)
    }

    /// Makes the corner of two half-planes that follow each other counter-clockwise.
    fn corner(&mut self, first: Half, second: Half) -> u32 {
        let halves = [first, second];
        let [a, b] = halves.map(|half| self.lines.rough(half));
        let rough = cross(&a, &b);
        let [w, u, v] = rough;
        let least = w.value() - w.error();
        let place = [u, v].map(|x| x.value() / w.value());
        let is_fine = [u, v].iter().zip(place).all(|(x, place)| {
            let error = (x.error() + place.abs() * w.error()) / least;
            least > 0.0 && error <= FINE && place.abs() <= 4.0
        });
        let index = self.corners.len() as u32;
        self.corners.push(Corner {
            halves,
            rough,
            exact: None,
            place,
        });
        if !is_fine {
            let [w, u, v] = self.exact_place(index);
            let place = [u.over(w), v.over(w)];
            self.corners[index as usize].place = place;
        }
        index
    }

    /// Returns on which side of a line a corner is.
    fn side_of(&mut self, corner: u32, half: Half) -> Sign {
        let Corner { halves, rough, .. } = &self.corners[corner as usize];
        let [a, b] = halves.map(Half::line);
        let line = half.line();
        if line == a || line == b || self.lines.meet_in_a_vertex([a, b, line]) {
            return Sign::Zero;
        }
        let rough = dot(&self.lines.rough(half), rough).sign();
        rough.unwrap_or_else(|| self.exact_side_of(corner, half))
    }

    #[cold]
    fn exact_side_of(&mut self, corner: u32, half: Half) -> Sign {
        let numbers = self.lines.exact(half);
        let place = self.exact_place(corner);
        dot(&numbers, place).sign().unwrap_or(Sign::Zero)
    }

    fn exact_place(&mut self, corner: u32) -> &[Exact; 3] {
        let index = corner as usize;
        if self.corners[index].exact.is_none() {
            let [a, b] = self.corners[index]
                .halves
                .map(|half| self.lines.exact(half));
            self.corners[index].exact = Some(Box::new(cross(&a, &b)));
        }
        self.corners[index]
            .exact
            .as_deref()
            .expect("it was made just now")
    }

    /// Returns whether a piece holds points that are nearer than 1 to the middle of the light's coordinates.
    pub(super) fn meets_disc(&mut self, piece: &Piece) -> bool {
        // Most do by far, or a corner of theirs.
        let is_inside = |[x, y]: [f64; 2]| x * x + y * y < 1.0 - ROOM;
        if self.places(piece).any(is_inside) {
            return true;
        }
        let halves: Vec<Half> = piece.sides().collect();
        let at_middle = |plan: &mut Self, half: Half| {
            let rough = plan.lines.rough(half)[0].sign();
            decide(rough, || plan.lines.exact(half)[0].sign())
        };
        if halves
            .iter()
            .all(|&half| at_middle(self, half) != Sign::Negative)
        {
            return true;
        }
        let count = piece.sides.len();
        (0..count).any(|side| {
            let (half, from) = piece.sides[side];
            let to = piece.sides[(side + 1) % count].1;
            self.corner_is_in_disc(from) || self.side_meets_disc(half, [from, to])
        })
    }

    fn corner_is_in_disc(&mut self, corner: u32) -> bool {
        fn is_in<N: Number>([w, u, v]: &[N; 3]) -> Option<bool> {
            let square = u.times(u).plus(&v.times(v)).minus(&w.times(w));
            Some(square.sign()? == Sign::Negative)
        }
        let rough = is_in(&self.corners[corner as usize].rough);
        decide(rough, || is_in(self.exact_place(corner)))
    }

    /// Returns whether a side's line comes nearer than 1 to the middle between the side's ends.
    fn side_meets_disc(&mut self, half: Half, ends: [u32; 2]) -> bool {
        fn meets<N: Number>([c, a, b]: &[N; 3], ends: [&[N; 3]; 2]) -> Option<bool> {
            let far = c.times(c).minus(&a.times(a)).minus(&b.times(b));
            if far.sign()? != Sign::Negative {
                return Some(false);
            }
            // Where both ends are from the foot of the perpendicular, along the line.
            let [from, to] = ends.map(|[_, u, v]| a.times(v).minus(&b.times(u)).sign());
            let (from, to) = (from?, to?);
            Some(from.is_opposite(to) || from == Sign::Zero || to == Sign::Zero)
        }
        let line = self.lines.rough(half);
        let [from, to] = ends.map(|corner| &self.corners[corner as usize].rough);
        let rough = meets(&line, [from, to]);
        rough.unwrap_or_else(|| {
            let line = self.lines.exact(half);
            let [from, to] = ends.map(|corner| self.exact_place(corner).clone());
            meets(&line, [&from, &to]).unwrap_or(false)
        })
    }
}

fn cross<N: Number>([a0, a1, a2]: &[N; 3], [b0, b1, b2]: &[N; 3]) -> [N; 3] {
    [
        a1.times(b2).minus(&a2.times(b1)),
        a2.times(b0).minus(&a0.times(b2)),
        a0.times(b1).minus(&a1.times(b0)),
    ]
}

fn dot<N: Number>([a0, a1, a2]: &[N; 3], [b0, b1, b2]: &[N; 3]) -> N {
    a0.times(b0).plus(&a1.times(b1)).plus(&a2.times(b2))
}
