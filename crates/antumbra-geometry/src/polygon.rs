//! Cutting polygons into triangles that share the outline's own vertices.
//!
//! In: an outline in order. Out: triangles over its vertices (and, where the outline crosses
//! itself, over new points). Invariants: triangles wind as the polygon; neighbours share whole
//! edges; an outline that does not cross itself is covered exactly once. Concave outlines go through
//! a constrained Delaunay triangulation (crate `spade`); self-crossing ones are filled by the
//! even-odd rule.

use glam::{DVec2, DVec3};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// One corner of a triangle: a vertex of the outline, or a new point where the outline crosses
/// itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolygonCorner {
    pub(crate) position: DVec3,
    /// Index into the outline, if it is one of its vertices.
    pub(crate) outline_index: Option<u32>,
}

/// Returns the triangles of a polygon; none if its area is zero.
pub(crate) fn triangulate(outline: &[DVec3]) -> Vec<[PolygonCorner; 3]> {
    let corner = |i: usize| PolygonCorner {
        position: outline[i],
        outline_index: Some(i as u32),
    };
    if outline.len() == 3 {
        return vec![[corner(0), corner(1), corner(2)]];
    }
    // Repeated vertices in a row carry no shape.
    let kept: Vec<usize> = (0..outline.len())
        .filter(|&i| outline[i] != outline[(i + outline.len() - 1) % outline.len()])
        .collect();
    let Some(normal) = widest_normal(outline, &kept) else {
        return Vec::new();
    };
    let flat = Projection::along(normal);
    if is_strictly_convex(kept.iter().map(|&i| flat.apply(outline[i]))) {
        return (1..kept.len() - 1)
            .map(|i| [corner(kept[0]), corner(kept[i]), corner(kept[i + 1])])
            .collect();
    }
    triangulate_any(outline, &kept, &flat)
}

/// Newell's normal, or for outlines whose areas cancel that of the widest corner.
fn widest_normal(outline: &[DVec3], kept: &[usize]) -> Option<DVec3> {
    if kept.len() < 3 {
        return None;
    }
    let origin = outline[kept[0]];
    let seen = |i: usize| outline[kept[i % kept.len()]] - origin;
    let newell: DVec3 = (0..kept.len()).map(|i| seen(i).cross(seen(i + 1))).sum();
    let widest = (0..kept.len())
        .map(|i| (seen(i + 1) - seen(i)).cross(seen(i + 2) - seen(i)))
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    // Cancelled areas leave rounding only.
    let normal = if newell.length_squared() > 1e-24 * widest.length_squared() {
        newell
    } else {
        widest
    };
    (normal != DVec3::ZERO && normal.is_finite()).then_some(normal)
}

/// Drops the coordinate of the normal's largest component and keeps the winding.
struct Projection {
    axis: usize,
    is_mirrored: bool,
    normal: DVec3,
}

impl Projection {
    fn along(normal: DVec3) -> Self {
        let size = normal.abs();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        Self {
            axis,
            is_mirrored: normal[axis] < 0.0,
            normal,
        }
    }

    fn apply(&self, point: DVec3) -> DVec2 {
        let (u, v) = (point[(self.axis + 1) % 3], point[(self.axis + 2) % 3]);
        if self.is_mirrored {
            DVec2::new(v, u)
        } else {
            DVec2::new(u, v)
        }
    }

    /// Lifts a projected point back to the plane through `origin`.
    fn lift(&self, flat: DVec2, origin: DVec3) -> DVec3 {
        let (u, v) = if self.is_mirrored {
            (flat.y, flat.x)
        } else {
            (flat.x, flat.y)
        };
        let (i, j) = ((self.axis + 1) % 3, (self.axis + 2) % 3);
        let mut point = DVec3::ZERO;
        point[i] = u;
        point[j] = v;
        let rise = self.normal[i] * (u - origin[i]) + self.normal[j] * (v - origin[j]);
        point[self.axis] = origin[self.axis] - rise / self.normal[self.axis];
        point
    }
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Returns whether every corner turns left, once round in all.
fn is_strictly_convex(points: impl Iterator<Item = DVec2>) -> bool {
    let points: Vec<DVec2> = points.collect();
    let n = points.len();
    let turns_left =
        (0..n).all(|i| turn(points[i], points[(i + 1) % n], points[(i + 2) % n]) > 0.0);
    // Left turns all the way go round once iff the direction changes its x sign twice.
    let rightward = |i: usize| points[(i + 1) % n].x > points[i % n].x;
    turns_left && (0..n).filter(|&i| rightward(i) != rightward(i + 1)).count() == 2
}

struct PlanarVertex {
    flat: Point2<f64>,
    corner: PolygonCorner,
}

impl HasPosition for PlanarVertex {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.flat
    }
}

fn triangulate_any(
    outline: &[DVec3],
    kept: &[usize],
    projection: &Projection,
) -> Vec<[PolygonCorner; 3]> {
    let flat: Vec<DVec2> = kept.iter().map(|&i| projection.apply(outline[i])).collect();
    let mut planar = ConstrainedDelaunayTriangulation::<PlanarVertex>::new();
    let mut handles = Vec::with_capacity(kept.len());
    for (&i, &p) in kept.iter().zip(&flat) {
        let corner = PolygonCorner {
            position: outline[i],
            outline_index: Some(i as u32),
        };
        let flat = spade::mitigate_underflow(Point2::new(p.x, p.y));
        // Of vertices that project to one point the first stands for all.
        let existing = planar.locate_vertex(flat).map(|vertex| vertex.fix());
        let handle = match existing {
            Some(handle) => Ok(handle),
            None => planar.insert(PlanarVertex { flat, corner }),
        };
        // Only coordinates beyond spade's range fail, far beyond those accepted here.
        let Ok(handle) = handle else {
            return Vec::new();
        };
        handles.push(handle);
    }
    for i in 0..handles.len() {
        let (from, to) = (handles[i], handles[(i + 1) % handles.len()]);
        if from != to {
            planar.add_constraint_and_split(from, to, |crossing| {
                let lifted = projection.lift(DVec2::new(crossing.x, crossing.y), outline[kept[0]]);
                let corner = PolygonCorner {
                    position: lifted,
                    outline_index: None,
                };
                PlanarVertex {
                    flat: crossing,
                    corner,
                }
            });
        }
    }
    planar
        .inner_faces()
        .filter(|face| {
            let [a, b, c] = face.positions();
            let middle = DVec2::new((a.x + b.x + c.x) / 3.0, (a.y + b.y + c.y) / 3.0);
            is_inside_even_odd(&flat, middle)
        })
        .map(|face| face.vertices().map(|vertex| vertex.data().corner))
        .collect()
}

/// Returns whether a ray from `point` crosses the outline an odd number of times.
fn is_inside_even_odd(outline: &[DVec2], point: DVec2) -> bool {
    let n = outline.len();
    let crossing_count = (0..n)
        .filter(|&i| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
            low.y <= point.y && point.y < high.y && turn(low, high, point) > 0.0
        })
        .count();
    crossing_count % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(triangles: &[[PolygonCorner; 3]]) -> DVec3 {
        triangles
            .iter()
            .map(|t| 0.5 * (t[1].position - t[0].position).cross(t[2].position - t[0].position))
            .sum()
    }

    fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
        points.iter().map(|&(x, y)| DVec3::new(x, y, 1.0)).collect()
    }

    #[test]
    fn square_is_a_fan_that_winds_as_given() {
        let square = flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
        assert_eq!(triangulate(&square).len(), 2);
        assert_eq!(area(&triangulate(&square)), DVec3::new(0.0, 0.0, 4.0));
        let back: Vec<DVec3> = square.into_iter().rev().collect();
        assert_eq!(area(&triangulate(&back)), DVec3::new(0.0, 0.0, -4.0));
    }

    #[test]
    fn concave_outline_covers_its_area_once() {
        let arrow = flat(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)]);
        let triangles = triangulate(&arrow);
        assert_eq!(triangles.len(), 3);
        assert_eq!(area(&triangles), DVec3::new(0.0, 0.0, 10.0));
        assert!(
            triangles
                .iter()
                .flatten()
                .all(|corner| corner.outline_index.is_some())
        );
    }

    #[test]
    fn vertex_on_an_edge_makes_no_empty_triangle() {
        let square = flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
        let triangles = triangulate(&square);
        assert_eq!(triangles.len(), 3);
        assert_eq!(area(&triangles), DVec3::new(0.0, 0.0, 4.0));
    }

    #[test]
    fn bow_tie_is_filled_by_even_odd() {
        let bow_tie = flat(&[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]);
        let triangles = triangulate(&bow_tie);
        let total: f64 = triangles.iter().map(|t| area(&[*t]).length()).sum();
        assert!(
            (total - 2.0).abs() < 1e-12,
            "two triangles of area 1, not {total}"
        );
        assert!(
            triangles
                .iter()
                .flatten()
                .any(|corner| corner.outline_index.is_none())
        );
    }

    #[test]
    fn repeated_and_collinear_vertices_have_no_area() {
        assert!(triangulate(&flat(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)])).is_empty());
        assert!(triangulate(&flat(&[(1.0, 1.0); 5])).is_empty());
        let with_double = flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 0.0), (2.0, 2.0)]);
        assert_eq!(area(&triangulate(&with_double)), DVec3::new(0.0, 0.0, 2.0));
    }
}
