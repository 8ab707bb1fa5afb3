//! Which surface a point is meant to lie on: "Points of a batch" and "Distances" of `EXACTNESS.md`.
//!
//! In: surfaces, a point, perhaps a normal, how it was rounded. Out: a surface. Distances are rounded `f64`, in the
//! order of operations of the page, and no code is shared with the library: every surface is measured, nothing is
//! looked up, vectors are arrays.

use super::point::OraclePoint;
use super::{Oracle, OracleShape};

type Vector = [f64; 3];

/// The way from a point to a surface: how far, and in which direction (a unit vector, or zero).
#[derive(Clone, Copy, Debug)]
struct Way {
    distance: f64,
    direction: Vector,
}

impl Oracle {
    /// Returns the surface that a point is meant to lie on.
    pub fn surface_of(&self, asked: &OraclePoint) -> Option<usize> {
        let ways: Vec<(usize, Way)> = (0..self.surfaces.len())
            .filter_map(|s| Some((s, self.way(s, asked.point)?)))
            .collect();
        let is_near = |s: usize, way: &Way| match asked.tolerance {
            Some(tolerance) => way.distance <= tolerance,
            None => way.distance <= granted(way, self.rounding(s, asked)),
        };
        let near: Vec<(usize, Way)> = ways
            .into_iter()
            .filter(|(s, way)| is_near(*s, way))
            .collect();
        let by_distance = |a: &&(usize, Way), b: &&(usize, Way)| {
            a.1.distance.total_cmp(&b.1.distance).then(a.0.cmp(&b.0))
        };
        let &(nearest, first) = near.iter().min_by(by_distance)?;
        let unit_normal = asked.normal.and_then(|normal| {
            let largest = largest_of(normal);
            unit(normal.map(|x| x / largest))
        });
        let Some(normal) = unit_normal else {
            return Some(nearest);
        };
        let rounding = self.rounding(nearest, asked);
        let ties = near
            .iter()
            .filter(|(_, way)| way.distance - first.distance <= granted(way, rounding));
        ties.map(|&(s, way)| {
            let cosine = dot(self.front(s, asked.point), normal);
            let disagreement = ((1.0 - cosine.abs()) * 1_048_576.0).round();
            (disagreement, cosine < 0.0, way.distance, s)
        })
        .min_by(|a, b| a.partial_cmp(b).expect("numbers"))
        .map(|(_, _, _, s)| s)
    }

    /// How far rounding may have moved a point of a surface, along each axis.
    fn rounding(&self, s: usize, asked: &OraclePoint) -> Vector {
        let share = 2.0_f64.powi(if asked.is_single { -21 } else { -42 });
        let (low, high) = self.ends(s);
        let each = [0, 1, 2].map(|i: usize| {
            let largest = asked.point[i].abs().max(low[i].abs()).max(high[i].abs());
            largest * share
        });
        let extent = [0, 1, 2].map(|i: usize| high[i] - low[i]);
        let largest = |v: Vector| v.into_iter().fold(0.0, f64::max);
        let cancelled = (largest(extent) / 16.0).min(largest(each));
        each.map(|x| x.max(cancelled))
    }

    /// The corners of the box around a surface.
    fn ends(&self, s: usize) -> (Vector, Vector) {
        let around = |center: Vector, reach: Vector| {
            (
                [0, 1, 2].map(|i: usize| center[i] - reach[i]),
                [0, 1, 2].map(|i: usize| center[i] + reach[i]),
            )
        };
        let join = |(a, b): (Vector, Vector), (c, d): (Vector, Vector)| {
            (
                [0, 1, 2].map(|i: usize| a[i].min(c[i])),
                [0, 1, 2].map(|i: usize| b[i].max(d[i])),
            )
        };
        let of_disk = |center: Vector, normal: Vector, radius: f64| {
            let n = unit(normal).unwrap_or([0.0; 3]);
            let sine = |i: usize, j: usize| radius * (n[i] * n[i] + n[j] * n[j]).sqrt();
            around(center, [sine(1, 2), sine(2, 0), sine(0, 1)])
        };
        match self.surfaces[s].shape {
            OracleShape::Triangle([a, b, c]) => join((a, a), join((b, b), (c, c))),
            OracleShape::Sphere { center, radius } => around(center, [radius; 3]),
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let axis = minus(apex, base);
                join(
                    of_disk(base, axis, base_radius),
                    of_disk(apex, axis, apex_radius),
                )
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => of_disk(center, normal, radius),
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => {
                let center = if at_apex { apex } else { base };
                of_disk(center, minus(apex, base), radius)
            }
        }
    }

    /// `None` for a degenerate surface.
    fn way(&self, s: usize, p: Vector) -> Option<Way> {
        if matches!(self.prepared[s], super::Prepared::Nothing) {
            return None;
        }
        Some(match self.surfaces[s].shape {
            OracleShape::Triangle(corners) => {
                let way = to_triangle(corners.map(|x| minus(x, p)));
                Way {
                    distance: length(way),
                    direction: unit(way).unwrap_or([0.0; 3]),
                }
            }
            OracleShape::Sphere { center, radius } => {
                let u = minus(p, center);
                Way {
                    distance: (length(u) - radius).abs(),
                    direction: unit(u).unwrap_or([1.0, 0.0, 0.0]),
                }
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => to_disk(normal, radius, minus(p, center)),
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => {
                let (inner, outer) = if at_apex { (base, apex) } else { (apex, base) };
                to_disk(minus(outer, inner), radius, minus(p, outer))
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let a = minus(apex, base);
                let axis = unit(a).unwrap_or([0.0; 3]);
                let q = minus(p, base);
                let z = dot(q, axis);
                let across = minus(q, scaled(axis, z));
                let off = length(across);
                let wall = [length(a), apex_radius - base_radius, 0.0];
                let along = unit(wall).unwrap_or([0.0; 3]);
                let reach = dot([z, off - base_radius, 0.0], along).clamp(0.0, length(wall));
                let nearest = [along[0] * reach, base_radius + along[1] * reach];
                let way = [nearest[0] - z, nearest[1] - off];
                let out = unit(across).unwrap_or_else(|| off_axis(axis));
                Way {
                    distance: length([way[0], way[1], 0.0]),
                    direction: unit(plus(scaled(axis, way[0]), scaled(out, way[1])))
                        .unwrap_or([0.0; 3]),
                }
            }
        })
    }

    /// The unit vector on the front of a surface at a point.
    fn front(&self, s: usize, p: Vector) -> Vector {
        let front = match self.surfaces[s].shape {
            OracleShape::Triangle([a, b, c]) => cross(minus(b, a), minus(c, a)),
            OracleShape::Sphere { center, .. } => minus(p, center),
            OracleShape::Disk { normal, .. } => normal,
            OracleShape::Cap {
                base,
                apex,
                at_apex,
                ..
            } => {
                if at_apex {
                    minus(apex, base)
                } else {
                    minus(base, apex)
                }
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let a = minus(apex, base);
                let q = minus(p, base);
                let across = minus(q, scaled(a, dot(q, a) / dot(a, a)));
                let slope = (base_radius - apex_radius) / dot(a, a);
                plus(unit(across).unwrap_or([0.0; 3]), scaled(a, slope))
            }
        };
        unit(front).unwrap_or([0.0; 3])
    }
}

/// How much of the rounding along the axes points along the way.
fn granted(way: &Way, rounding: Vector) -> f64 {
    dot(rounding, way.direction.map(f64::abs))
}

fn to_triangle([a, b, c]: [Vector; 3]) -> Vector {
    let (ab, ac) = (minus(b, a), minus(c, a));
    let (d1, d2) = (-dot(ab, a), -dot(ac, a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-dot(ab, b), -dot(ac, b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let (d5, d6) = (-dot(ab, c), -dot(ac, c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    if d1 * d4 - d3 * d2 <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return plus(a, scaled(ab, d1 / (d1 - d3)));
    }
    if d5 * d2 - d1 * d6 <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return plus(a, scaled(ac, d2 / (d2 - d6)));
    }
    if d3 * d6 - d5 * d4 <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return plus(b, scaled(minus(c, b), t));
    }
    let n = cross(ab, ac);
    scaled(n, dot(n, a) / dot(n, n))
}

/// A direction across an axis, for points on it.
fn off_axis([x, y, z]: Vector) -> Vector {
    let sign = 1.0_f64.copysign(z);
    let a = -1.0 / (sign + z);
    [x * y * a, sign + y * y * a, -y]
}

fn to_disk(normal: Vector, radius: f64, u: Vector) -> Way {
    let axis = unit(normal).unwrap_or([0.0; 3]);
    let height = dot(u, axis);
    let across = minus(u, scaled(axis, height));
    let beyond = (length(across) - radius).max(0.0);
    let out = unit(across).unwrap_or([0.0; 3]);
    Way {
        distance: length([height, beyond, 0.0]),
        direction: unit(plus(scaled(axis, height), scaled(out, beyond))).unwrap_or([0.0; 3]),
    }
}

fn plus(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn scaled(a: Vector, by: f64) -> Vector {
    a.map(|x| x * by)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A power of two that keeps squares of numbers up to `largest` in the range of `f64`.
fn shift(largest: f64) -> f64 {
    match largest {
        x if x < 1e-250 => 2.0_f64.powi(900),
        x if x < 1e-140 => 2.0_f64.powi(500),
        x if x > 1e140 => 2.0_f64.powi(-500),
        _ => 1.0,
    }
}

fn largest_of(a: Vector) -> f64 {
    a.into_iter().map(f64::abs).fold(0.0, f64::max)
}

fn length(a: Vector) -> f64 {
    let shift = shift(largest_of(a));
    let a = scaled(a, shift);
    dot(a, a).sqrt() / shift
}

/// `None` for zero.
fn unit(a: Vector) -> Option<Vector> {
    let largest = largest_of(a);
    let a = scaled(a, shift(largest));
    (largest > 0.0).then(|| scaled(a, 1.0 / dot(a, a).sqrt()))
}
