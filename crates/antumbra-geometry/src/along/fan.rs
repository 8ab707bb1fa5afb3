//! Which stretch of a segment a surface can shade at most, before any of its forms is made.
//!
//! In: the segment's ends, the light, corners around a surface. Out: two shares of the length that the surface's shadow lies
//! between, or nothing. Invariant: the shadow is between them. Where that is dark already the surface changes nothing:
//! curved surfaces, and boxes of the tree with all that they hold, are left out by that.

use glam::DVec3;

/// Sine of the angle between segment and light, below which nothing is said.
const NARROWEST: f64 = 1.0 / 1024.0;

/// More than what a share errs, per unit of the lengths that it is made of: normals of a wide fan err by less than 2^-40 of
/// themselves.
const ROOM: f64 = 1.0 / (1_u64 << 36) as f64;

/// Two linear functions whose ratio says where a point's shadow falls on the segment's line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fan {
    /// Zero on the rays between the first end and the light, one on those of the last end.
    rising: DVec3,
    /// The reverse.
    falling: DVec3,
    /// A place on the rays of each: the light, or the end.
    zeros: [DVec3; 2],
    /// Bound on what both functions err per unit of distance.
    room: f64,
}

impl Fan {
    /// Makes the fan; `None` where segment and light are nearly on a line.
    pub(super) fn new([first, last]: [DVec3; 2], (light, weight): (DVec3, f64)) -> Option<Self> {
        let along = last - first;
        let zeros = if weight == 0.0 {
            [first, last]
        } else {
            [light; 2]
        };
        let rays = if weight == 0.0 {
            [light; 2]
        } else {
            [first - light, last - light]
        };
        let [from, to] = rays.map(DVec3::normalize_or_zero);
        let across = from.cross(along.normalize_or_zero());
        let other = to.cross(along.normalize_or_zero());
        let is_wide = across.length() > NARROWEST && other.length() > NARROWEST;
        if !is_wide {
            return None;
        }
        // Each is at a right angle to its rays, and one at the other end.
        let scaled = |normal: DVec3, end: DVec3, zero: DVec3| normal / normal.dot(end - zero);
        let rising = scaled(across.normalize().cross(from), last, zeros[0]);
        let falling = scaled(other.normalize().cross(to), first, zeros[1]);
        let room = ROOM * (rising.length() + falling.length());
        let is_fine = room.is_finite();
        is_fine.then_some(Self {
            rising,
            falling,
            zeros,
            room,
        })
    }

    /// Returns a half-space around whose points, as far as they are within `reach` of a point along each axis, shadows fall
    /// beyond a share, or before it: an outward normal whose largest component is 1, and what is lower than the plane is over
    /// the point.
    ///
    /// What is at `x = p(t) + w (light - p(t))` has the value `(1 - w) (t - share)`, with `w` below 1: it shades `t`, and the
    /// sign tells on which side that is.
    pub(super) fn half_space(
        &self,
        share: f64,
        is_beyond: bool,
        point: DVec3,
        reach: f64,
    ) -> Option<(DVec3, f64)> {
        let normal = (1.0 - share) * self.rising - share * self.falling;
        let (rising, falling) = (point - self.zeros[0], point - self.zeros[1]);
        let value = (1.0 - share) * self.rising.dot(rising) - share * self.falling.dot(falling);
        let size = rising.abs().max_element() + falling.abs().max_element() + 2.0 * reach;
        let (normal, value) = if is_beyond {
            (-normal, value)
        } else {
            (normal, -value)
        };
        let largest = normal.abs().max_element();
        let height = (value - 2.0 * self.room * size) / largest;
        let is_fine = largest > 0.0 && height.is_finite();
        is_fine.then(|| (normal / largest, height))
    }

    /// Returns two shares that the shadow of what is between some corners lies between; `None` where it may be anywhere.
    #[inline]
    pub(super) fn reach(&self, corners: &[DVec3]) -> Option<[f64; 2]> {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for &corner in corners {
            // Spelled out: `map` is a function of its own here.
            let (rising, falling) = (corner - self.zeros[0], corner - self.zeros[1]);
            let size = rising.abs().max_element() + falling.abs().max_element();
            let (rising, falling) = (self.rising.dot(rising), self.falling.dot(falling));
            // Points before the light, as the segment has them, are above zero; those of the line are one.
            let sum = rising + falling;
            let room = self.room * size / sum;
            // So wide a room says nothing worth having, and the exact test decides. Not for NaN.
            let is_fine = sum > 0.0 && room < 1e-6;
            if !is_fine {
                return None;
            }
            let share = rising / sum;
            let room = room * (1.0 + share.abs());
            least = least.min(share - room);
            most = most.max(share + room);
        }
        Some([least, most])
    }
}
