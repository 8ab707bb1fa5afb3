//! Small pieces that fixtures and nasty scenes are made of.

use crate::oracle::OracleSurface;

/// The four-sided face `a b c d` as two triangles, `a b c` first.
pub(crate) fn quad([a, b, c, d]: [[f64; 3]; 4]) -> [OracleSurface; 2] {
    [
        OracleSurface::triangle([a, b, c]),
        OracleSurface::triangle([a, c, d]),
    ]
}

/// An axis-parallel rectangle at height `z`, facing up.
pub(crate) fn floor(low: [f64; 2], high: [f64; 2], z: f64) -> [OracleSurface; 2] {
    let ([x0, y0], [x1, y1]) = (low, high);
    quad([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
}

/// The twelve triangles of a box, facing outwards: two each for x low, x high, y low, y high,
/// z low, z high.
pub(crate) fn cuboid(low: [f64; 3], high: [f64; 3]) -> Vec<OracleSurface> {
    cuboid_of(|x, y, z| {
        [
            if x { high[0] } else { low[0] },
            if y { high[1] } else { low[1] },
            if z { high[2] } else { low[2] },
        ]
    })
}

/// The twelve triangles of a box with the given corners, in the order of [`cuboid`].
pub(crate) fn cuboid_of(corner: impl Fn(bool, bool, bool) -> [f64; 3]) -> Vec<OracleSurface> {
    let c = corner;
    let (f, t) = (false, true);
    [
        [c(f, f, f), c(f, f, t), c(f, t, t), c(f, t, f)],
        [c(t, f, f), c(t, t, f), c(t, t, t), c(t, f, t)],
        [c(f, f, f), c(t, f, f), c(t, f, t), c(f, f, t)],
        [c(f, t, f), c(f, t, t), c(t, t, t), c(t, t, f)],
        [c(f, f, f), c(f, t, f), c(t, t, f), c(t, f, f)],
        [c(f, f, t), c(t, f, t), c(t, t, t), c(f, t, t)],
    ]
    .into_iter()
    .flat_map(quad)
    .collect()
}

/// A point between `a` and `b`, rounded as a renderer rounds it.
pub(crate) fn lerp(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] * (1.0 - t) + b[i] * t)
}

/// `point` with coordinate `axis` moved to the next `f64` up or down.
pub(crate) fn nudged(mut point: [f64; 3], axis: usize, up: bool) -> [f64; 3] {
    point[axis] = if up {
        point[axis].next_up()
    } else {
        point[axis].next_down()
    };
    point
}
