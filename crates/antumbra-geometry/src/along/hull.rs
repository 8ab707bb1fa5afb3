//! Planes around a segment and its light: surfaces beyond one of them shade no point of the segment.
//!
//! In: the segment's ends and the light. Out: half-spaces that hold every shadow ray from the segment. Invariant: what is
//! said to miss them blocks none of these rays. Which surfaces are said to is a function of segment, light and surface
//! alone.

use glam::DVec3;

/// More than all roundings of a height, as a share of the lengths that it is made of: each is at most 2^-53 of them, and
/// there are fewer than 16.
const ROOM: f64 = 1.0 / (1_u64 << 48) as f64;

/// Products of unit vectors that are shorter say too little of the plane that holds both.
const FLAT: f64 = 1.0 / (1_u64 << 30) as f64;

/// A direction of light that rises more than this above a plane leaves it; rises that are less widen the room. It decides
/// only which planes are of use.
const LARGEST_RISE: f64 = 1e-6;

/// A half-space that holds all shadow rays.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Outwards; its largest component is 1.
    normal: DVec3,
    /// Largest height of the segment and of a light point over the segment's first end.
    height: f64,
    /// How much room a distance from the first end needs, as a share of it.
    room: f64,
}

impl Side {
    const NOWHERE: Self = Self {
        normal: DVec3::ZERO,
        height: 0.0,
        room: 0.0,
    };
}

/// Planes of a hull at most.
const SIDES: usize = 6;

/// The half-spaces around the rays from a segment to a light.
#[derive(Clone, Debug)]
pub(super) struct Hull {
    first: DVec3,
    /// Largest coordinate of the segment, as seen from its first end.
    length: f64,
    sides: [Side; SIDES],
    side_count: usize,
}

impl Hull {
    /// Makes the half-spaces; the light is a point or a direction, as its weight says.
    pub(super) fn new([first, last]: [DVec3; 2], (light, weight): (DVec3, f64)) -> Self {
        let along = last - first;
        let towards = if weight == 0.0 { light } else { light - first };
        let mut hull = Self {
            first,
            length: along.abs().max_element(),
            sides: [Side::NOWHERE; SIDES],
            side_count: 0,
        };
        let seen = Seen {
            along,
            towards,
            is_direction: weight == 0.0,
        };
        let (along, towards) = (to_unit_size(along), to_unit_size(towards));
        let across = along.cross(towards);
        // Not for NaN.
        let is_wide = across.abs().max_element() >= FLAT;
        if is_wide {
            let across = to_unit_size(across);
            hull.add(&seen, [across, -across]);
            let from_last = if weight == 0.0 {
                towards
            } else {
                to_unit_size(light - last)
            };
            let beside = [along, towards, from_last].map(|edge| across.cross(edge));
            // Of each, the one that has the hull's third corner below it.
            for (normal, inwards) in beside.into_iter().zip([towards, along, -along]) {
                let is_outwards = normal.dot(inwards) <= 0.0;
                hull.add(&seen, [if is_outwards { normal } else { -normal }]);
            }
        } else {
            // Towards the light, or none at all: a beam without width.
            let is_longer = seen.along.abs().max_element() > seen.towards.abs().max_element();
            let axis = if weight != 0.0 && is_longer {
                along
            } else {
                towards
            };
            let axis = if axis == DVec3::ZERO { DVec3::X } else { axis };
            let least = if axis.x.abs() <= axis.y.abs().min(axis.z.abs()) {
                DVec3::X
            } else if axis.y.abs() <= axis.z.abs() {
                DVec3::Y
            } else {
                DVec3::Z
            };
            let across = axis.cross(least);
            let other = axis.cross(across);
            hull.add(&seen, [across, -across, other, -other, axis, -axis]);
        }
        hull
    }

    fn add<const N: usize>(&mut self, seen: &Seen, normals: [DVec3; N]) {
        for normal in normals {
            let largest = normal.abs().max_element();
            // Not for NaN.
            let is_some = largest > 0.0 && largest.is_finite();
            let side = is_some.then(|| seen.side(normal / largest)).flatten();
            if let Some(side) = side {
                self.sides[self.side_count] = side;
                self.side_count += 1;
            }
        }
    }

    fn sides(&self) -> &[Side] {
        &self.sides[..self.side_count]
    }

    /// Returns whether the hull of some points surely blocks no ray from the segment to the light.
    #[inline]
    pub(super) fn misses(&self, corners: &[DVec3]) -> bool {
        self.sides().iter().any(|side| {
            corners.iter().all(|&corner| {
                let from = corner - self.first;
                let reach = from.abs().max_element() + self.length;
                side.normal.dot(from) > side.height + side.room * reach
            })
        })
    }

    /// Returns whether a ball surely blocks no such ray.
    pub(super) fn misses_ball(&self, center: DVec3, radius: f64) -> bool {
        self.sides().iter().any(|side| {
            let from = center - self.first;
            let reach = from.abs().max_element() + radius + self.length;
            // A normal whose largest component is 1 is at most sqrt(3) long.
            let size = side.normal.length() * radius;
            side.normal.dot(from) - size > side.height + side.room * reach
        })
    }

    /// Returns outward normals whose largest component is 1, and for each a height over a point: no ray within a
    /// distance (along each axis) of that point is higher.
    pub(super) fn heights_over(
        &self,
        point: DVec3,
        reach: f64,
    ) -> impl Iterator<Item = (DVec3, f64)> + Clone {
        let from = self.first - point;
        let farthest = from.abs().max_element() + reach + self.length;
        let sides = self.sides().iter();
        sides.map(move |side| {
            let height = side.height + side.room * farthest + side.normal.dot(from);
            (side.normal, height + ROOM * farthest)
        })
    }
}

/// A segment and its light as its first end sees them.
struct Seen {
    along: DVec3,
    towards: DVec3,
    is_direction: bool,
}

impl Seen {
    /// Returns the side with a normal; `None` where the light is above every plane with it.
    fn side(&self, normal: DVec3) -> Option<Side> {
        let (along, towards) = (normal.dot(self.along), normal.dot(self.towards));
        let sizes = [self.along, self.towards].map(|v| v.abs().max_element());
        let mut side = Side {
            normal,
            height: along.max(0.0) + ROOM * sizes[0],
            room: ROOM,
        };
        if self.is_direction {
            let rise = towards.max(0.0) / sizes[1];
            // Not for NaN.
            let is_below = rise < LARGEST_RISE;
            if !is_below {
                return None;
            }
            side.room += rise + ROOM;
        } else {
            side.height = side.height.max(towards + ROOM * sizes[1]);
        }
        Some(side)
    }
}

/// Returns a vector whose largest component is 1, or zero where that cannot be told.
fn to_unit_size(vector: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > f64::MIN_POSITIVE && largest.is_finite() {
        vector / largest
    } else {
        DVec3::ZERO
    }
}
