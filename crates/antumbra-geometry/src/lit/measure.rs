//! How much of a light a piece is, in `f64`.

use std::f64::consts::PI;

/// How pieces are measured.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measure {
    /// By area, all of the light being this much.
    Flat(f64),
    /// By area within the circle around the middle with radius 1.
    Disc,
    /// By the solid angle of the directions within that circle.
    Cap {
        /// The tangent of the cone's half-angle.
        tangent: f64,
        /// 1 less its cosine.
        height: f64,
    },
}

impl Measure {
    /// Returns whether only what is in the circle counts.
    pub(super) fn is_round(self) -> bool {
        !matches!(self, Self::Flat(_))
    }

    /// Returns the whole light's measure.
    pub(super) fn whole(self) -> f64 {
        match self {
            Self::Flat(whole) => whole,
            Self::Disc => PI,
            Self::Cap { height, .. } => 2.0 * PI * height,
        }
    }

    /// Returns a convex polygon's measure; its corners are in counter-clockwise order.
    pub(super) fn of(self, mut places: impl Iterator<Item = [f64; 2]>) -> f64 {
        let Some(first) = places.next() else {
            return 0.0;
        };
        let (mut sum, mut from) = (0.0, first);
        for to in places {
            sum += self.under(first, from, to);
            from = to;
        }
        (sum + self.under(first, from, first)).max(0.0)
    }

    /// Returns what the side from one corner to the next adds.
    fn under(self, origin: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
        match self {
            // Seen from a corner small pieces far out lose no bits.
            Self::Flat(_) => 0.5 * cross(minus(from, origin), minus(to, origin)),
            _ => self.in_circle(from, to),
        }
    }

    /// Returns the part of the triangle from the middle to a side that is in the circle, by orientation.
    fn in_circle(self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let along = minus(to, from);
        let square = dot(along, along);
        if square == 0.0 {
            return 0.0;
        }
        // Where the side's line crosses the circle, as shares of the side.
        let middle = -dot(from, along) / square;
        let off = cross(from, along);
        let half = (square - off * off) / (square * square);
        if half <= 0.0 {
            return self.sector(from, to);
        }
        let half = half.sqrt();
        let enter = (middle - half).clamp(0.0, 1.0);
        let leave = (middle + half).clamp(0.0, 1.0);
        if enter >= leave {
            return self.sector(from, to);
        }
        let at = |share: f64| [from[0] + along[0] * share, from[1] + along[1] * share];
        let (a, b) = (
            if enter > 0.0 { at(enter) } else { from },
            if leave < 1.0 { at(leave) } else { to },
        );
        let mut sum = self.triangle(a, b);
        if enter > 0.0 {
            sum += self.sector(from, a);
        }
        if leave < 1.0 {
            sum += self.sector(b, to);
        }
        sum
    }

    fn sector(self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let angle = libm::atan2(cross(from, to), dot(from, to));
        match self {
            Self::Cap { height, .. } => angle * height,
            _ => 0.5 * angle,
        }
    }

    fn triangle(self, from: [f64; 2], to: [f64; 2]) -> f64 {
        match self {
            // The spherical triangle between the axis and two directions (Van Oosterom and Strackee 1983).
            Self::Cap { tangent, .. } => {
                let square = tangent * tangent;
                let length = |place: [f64; 2]| (1.0 + square * dot(place, place)).sqrt();
                let (first, second) = (length(from), length(to));
                let beside = 1.0 + square * dot(from, to);
                let volume = square * cross(from, to);
                2.0 * libm::atan2(volume, first * second + first + second + beside)
            }
            _ => 0.5 * cross(from, to),
        }
    }
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_disc_and_of_a_cap_have_their_closed_forms() {
        let half = [[0.0, -3.0], [3.0, -3.0], [3.0, 3.0], [0.0, 3.0]];
        let quarter = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];
        let segment = [[0.5, -3.0], [3.0, -3.0], [3.0, 3.0], [0.5, 3.0]];
        let beside = [[1.5, -3.0], [3.0, -3.0], [3.0, 3.0], [1.5, 3.0]];
        let inside = [[0.1, 0.1], [0.3, 0.1], [0.3, 0.4]];
        let close = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        };
        let disc = |corners: &[[f64; 2]]| Measure::Disc.of(corners.iter().copied());
        close(disc(&half), PI / 2.0);
        close(disc(&quarter), PI / 4.0);
        close(disc(&segment), PI / 3.0 - 0.75_f64.sqrt() / 2.0);
        close(disc(&beside), 0.0);
        close(disc(&inside), 0.03);
        for degrees in [1e-3_f64, 0.25, 30.0, 89.0] {
            let angle = degrees.to_radians();
            let (tangent, height) = (angle.tan(), 2.0 * (angle / 2.0).sin().powi(2));
            let cap = Measure::Cap { tangent, height };
            let share = |corners: &[[f64; 2]]| cap.of(corners.iter().copied()) / cap.whole();
            close(share(&half), 0.5);
            close(share(&quarter), 0.25);
            close(share(&beside), 0.0);
        }
        // A cube's face fills a sixth of all directions.
        let cap = Measure::Cap {
            tangent: 2.0,
            height: 1.0 - 1.0 / 5.0_f64.sqrt(),
        };
        let face = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        close(cap.of(face.into_iter()), 4.0 * PI / 6.0);
    }
}
