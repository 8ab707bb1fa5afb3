//! Whether a polygon has any area at all.
//!
//! In: vertices. Out: yes or no, decided exactly. Invariant: no tolerance; a sliver of any width
//! has area.

use antumbra_geometry::DVec3;
use robust::{Coord, orient2d};

/// Returns whether the points, all finite, are not all on one line. Linear time. Exact, except that
/// coordinates smaller than about 1e-140 of the largest along their axis may count as 0.
pub(crate) fn has_area(points: impl Iterator<Item = DVec3> + Clone) -> bool {
    // So that no product underflows, each axis is scaled by a power of two, which rounds nothing and
    // keeps what is on one line there.
    let largest = points
        .clone()
        .fold(DVec3::ZERO, |largest, point| largest.max(point.abs()));
    let exponents = largest.to_array().map(|size| match size {
        0.0 => 0,
        size => -libm::ilogb(size),
    });
    let mut points = points.map(|point| {
        let scaled = |axis: usize| libm::scalbn(point[axis], exponents[axis]);
        DVec3::new(scaled(0), scaled(1), scaled(2))
    });
    let Some(a) = points.next() else { return false };
    let Some(b) = points.find(|&p| p != a) else {
        return false;
    };
    points.any(|c| !is_on_one_line(a, b, c))
}

/// Points of space are on one line iff their three projections along the axes are.
fn is_on_one_line(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let turn = |f: fn(DVec3) -> (f64, f64)| {
        let [a, b, c] = [a, b, c].map(|p| Coord {
            x: f(p).0,
            y: f(p).1,
        });
        orient2d(a, b, c)
    };
    turn(|p| (p.x, p.y)) == 0.0 && turn(|p| (p.y, p.z)) == 0.0 && turn(|p| (p.z, p.x)) == 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: &[[f64; 3]]) -> bool {
        has_area(points.iter().map(|&p| DVec3::from_array(p)))
    }

    #[test]
    fn lines_and_points_have_none() {
        assert!(!of(&[]));
        assert!(!of(&[[1.0, 2.0, 3.0]; 3]));
        assert!(!of(&[[0.0; 3], [1.0, 1.0, 1.0], [0.0; 3], [3.0, 3.0, 3.0]]));
        assert!(!of(&[[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]]));
    }

    #[test]
    fn slivers_and_specks_have_some() {
        assert!(of(&[
            [0.0; 3],
            [1.0, 1.0, 1.0],
            [3.0, 3.0, 3.0_f64.next_up()]
        ]));
        assert!(of(&[[0.0; 3], [1e-200, 0.0, 0.0], [0.0, 1e-200, 0.0]]));
        assert!(of(&[
            [0.0; 3],
            [0.0; 3],
            [1e30, 0.0, 0.0],
            [0.0, 1e30, 0.0]
        ]));
        assert!(of(&[
            [1e6, 0.0, 0.0],
            [1e6, 1e-170, 0.0],
            [1e6, 0.0, 1e-170]
        ]));
        assert!(of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 5e-324, 0.0]]));
    }
}
