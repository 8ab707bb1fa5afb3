//! Cutting polygons into triangles that share the outline's own vertices.
//!
//! In: an outline in order. Out: triangles over its vertices (and, where the outline crosses
//! itself, over new points). Invariants: triangles wind as the polygon; neighbours share whole
//! edges; an outline that does not cross itself is covered exactly once; size plays no part, since
//! small outlines are scaled up by powers of two first. Concave outlines go through a constrained
//! Delaunay triangulation (crate `spade`); self-crossing ones are filled by the even-odd rule, and
//! refused where they cross themselves so often that time and memory would not be linear.

mod even_odd;
mod planar;

use std::collections::HashMap;

use glam::{DVec2, DVec3};
pub(crate) use planar::PolygonCorner;
use planar::{Planar, PlanarVertex, turn};
use spade::handles::FixedVertexHandle;
use spade::{
    Intersection, LineIntersectionIterator, Point2, PositionInTriangulation, Triangulation as _,
};

/// An outline crosses itself too often to be cut, or so closely that rounding makes ever new crossings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooManyCrossings {
    /// The number of its vertices.
    pub(crate) corners: usize,
}

/// How often an outline may cross itself: more than any outline of a hundred vertices can, and
/// for long ones a small multiple of their vertices, so that what comes out stays in proportion to
/// what goes in.
const fn most_crossings(corners: usize) -> usize {
    4 * corners + 4096
}

/// Returns the triangles of a polygon; none if its area is zero.
///
/// With n vertices and k crossings, time is about (n + k) log n for usual outlines.
///
/// # Errors
/// The outline crosses itself too often.
pub(crate) fn triangulate(outline: &[DVec3]) -> Result<Vec<[PolygonCorner; 3]>, TooManyCrossings> {
    let corner = |i: usize| PolygonCorner {
        position: outline[i],
        outline_index: Some(i as u32),
    };
    if outline.len() == 3 {
        return Ok(vec![[corner(0), corner(1), corner(2)]]);
    }
    // Repeated vertices in a row carry no shape; nor does a last one that closes the outline.
    let mut kept: Vec<usize> = (0..outline.len())
        .filter(|&i| i == 0 || outline[i] != outline[i - 1])
        .collect();
    while kept.len() > 1 && kept.last().is_some_and(|&last| outline[last] == outline[0]) {
        kept.pop();
    }
    let Some(normal) = widest_normal(outline, &kept) else {
        return Ok(Vec::new());
    };
    let projection = Projection::along(normal);
    let flat: Vec<DVec2> = kept.iter().map(|&i| projection.apply(outline[i])).collect();
    let scale = Scale::of(&flat);
    let flat: Vec<DVec2> = flat.iter().map(|&point| scale.up(point)).collect();
    if is_strictly_convex(&flat) {
        return Ok((1..kept.len() - 1)
            .map(|i| [corner(kept[0]), corner(kept[i]), corner(kept[i + 1])])
            .collect());
    }
    let lift = |point| projection.lift(scale.down(point), outline[kept[0]]);
    triangulate_any(outline, &kept, &flat, &lift)
}

/// Returns the power of two that brings a positive number to 1 or above, and below 2; 0 for none.
pub(crate) fn to_one(number: f64) -> i32 {
    if number > 0.0 {
        -libm::ilogb(number)
    } else {
        0
    }
}

fn scaled(vector: DVec3, exponent: i32) -> DVec3 {
    vector.map(|x| libm::scalbn(x, exponent))
}

/// Newell's normal, or for outlines whose areas cancel that of the widest corner; of any length.
fn widest_normal(outline: &[DVec3], kept: &[usize]) -> Option<DVec3> {
    if kept.len() < 3 {
        return None;
    }
    let origin = outline[kept[0]];
    // Both scalings are exact: they change no comparison, and keep squares from vanishing.
    let size = |vector: DVec3| vector.abs().max_element();
    let sizes = kept.iter().map(|&i| size(outline[i] - origin));
    let exponent = to_one(sizes.fold(0.0, f64::max));
    let seen = |i: usize| scaled(outline[kept[i % kept.len()]] - origin, exponent);
    let corner = |i: usize| (seen(i + 1) - seen(i)).cross(seen(i + 2) - seen(i));
    let newell: DVec3 = (0..kept.len()).map(|i| seen(i).cross(seen(i + 1))).sum();
    let sizes = (0..kept.len()).map(|i| size(corner(i)));
    let exponent = to_one(sizes.fold(size(newell), f64::max));
    let newell = scaled(newell, exponent);
    let widest = (0..kept.len())
        .map(|i| scaled(corner(i), exponent))
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    // Cancelled areas leave rounding only.
    let normal = if newell.length_squared() > 1e-24 * widest.length_squared() {
        newell
    } else {
        widest
    };
    (normal != DVec3::ZERO && normal.is_finite()).then_some(normal)
}

/// Powers of two that bring small outlines into the range of the triangulation, axis by axis.
///
/// Outlines of usual size are left as they are. Small ones are scaled as a whole, which changes
/// nothing about their shape; an axis that is far smaller than the other is stretched.
struct Scale([i32; 2]);

impl Scale {
    /// The least extent that is left as it is, 2^-100: products of four numbers of a hundredth of it
    /// are far from vanishing.
    const SMALL: f64 = 1.0 / (1_u128 << 100) as f64;

    fn of(flat: &[DVec2]) -> Self {
        let largest = flat.iter().fold(DVec2::ZERO, |m, p| m.max(p.abs()));
        let whole = largest.max_element();
        let exponent = if whole < Self::SMALL {
            to_one(whole)
        } else {
            0
        };
        Self(largest.to_array().map(|side| {
            let side = libm::scalbn(side, exponent);
            exponent + if side < Self::SMALL { to_one(side) } else { 0 }
        }))
    }

    fn up(&self, point: DVec2) -> DVec2 {
        let [x, y] = self.0;
        DVec2::new(libm::scalbn(point.x, x), libm::scalbn(point.y, y))
    }

    fn down(&self, point: DVec2) -> DVec2 {
        let [x, y] = self.0;
        DVec2::new(libm::scalbn(point.x, -x), libm::scalbn(point.y, -y))
    }
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

/// Returns whether every corner turns left, once round in all.
fn is_strictly_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let turns_left =
        (0..n).all(|i| turn(points[i], points[(i + 1) % n], points[(i + 2) % n]) > 0.0);
    // Left turns all the way go round once iff the direction changes its x sign twice.
    let rightward = |i: usize| points[(i + 1) % n].x > points[i % n].x;
    turns_left && (0..n).filter(|&i| rightward(i) != rightward(i + 1)).count() == 2
}

fn triangulate_any(
    outline: &[DVec3],
    kept: &[usize],
    flat: &[DVec2],
    lift: &dyn Fn(DVec2) -> DVec3,
) -> Result<Vec<[PolygonCorner; 3]>, TooManyCrossings> {
    let too_many = TooManyCrossings {
        corners: outline.len(),
    };
    // Only coordinates beyond spade's range fail, far beyond those accepted here.
    let Some((mut planar, handles)) = with_vertices(outline, kept, flat) else {
        return Ok(Vec::new());
    };
    let mut crossings_left = most_crossings(outline.len());
    for i in 0..handles.len() {
        let edge = [handles[i], handles[(i + 1) % handles.len()]];
        add_edge(&mut planar, edge, lift, &mut crossings_left).ok_or(too_many)?;
    }
    let is_inside = even_odd::inside(&planar, flat).ok_or(too_many)?;
    Ok(planar
        .inner_faces()
        .filter(|face| is_inside[face.index()])
        .map(|face| face.vertices().map(|vertex| vertex.data().corner))
        .collect())
}

/// Triangulates the vertices of an outline; returns the handle of each, too. Of vertices that project
/// to one point the first stands for all.
fn with_vertices(
    outline: &[DVec3],
    kept: &[usize],
    flat: &[DVec2],
) -> Option<(Planar, Vec<FixedVertexHandle>)> {
    /// Where vertices are many, their order matters to time: on a line, each would be looked for
    /// along all others. A sweep takes them together. Which of several equally good triangles it
    /// chooses is its own affair, so that outlines of usual length go in vertex by vertex.
    const MANY: usize = 1024;
    let mut number_of = HashMap::new();
    let mut numbers = Vec::with_capacity(kept.len());
    let mut vertices = Vec::with_capacity(kept.len());
    for (&i, &p) in kept.iter().zip(flat) {
        let flat = spade::mitigate_underflow(Point2::new(p.x, p.y));
        // Adding 0 turns -0 into 0 and changes nothing else.
        let key = [flat.x + 0.0, flat.y + 0.0].map(f64::to_bits);
        let number = *number_of.entry(key).or_insert(vertices.len());
        if number == vertices.len() {
            let corner = PolygonCorner {
                position: outline[i],
                outline_index: Some(i as u32),
            };
            vertices.push(PlanarVertex { flat, corner });
        }
        numbers.push(number);
    }
    let handles: Vec<_>;
    let planar = if vertices.len() > MANY {
        let planar = Planar::bulk_load(vertices).ok()?;
        let mut found = vec![None; number_of.len()];
        for vertex in planar.vertices() {
            let Point2 { x, y } = vertex.position();
            let number = number_of.get(&[x + 0.0, y + 0.0].map(f64::to_bits))?;
            found[*number] = Some(vertex.fix());
        }
        handles = found.into_iter().collect::<Option<_>>()?;
        planar
    } else {
        let mut planar = Planar::new();
        let inserted = vertices.into_iter().map(|vertex| planar.insert(vertex));
        handles = inserted.collect::<Result<_, _>>().ok()?;
        planar
    };
    let handles = numbers.into_iter().map(|number| handles[number]).collect();
    Some((planar, handles))
}

/// Adds an edge of the outline; where it crosses one that is there, both get a vertex. `None` if there
/// are more crossings than are left.
///
/// This is not spade's `add_constraint_and_split`, which panics on some outlines that overlap
/// themselves.
fn add_edge(
    planar: &mut Planar,
    edge: [FixedVertexHandle; 2],
    lift: &dyn Fn(DVec2) -> DVec3,
    crossings_left: &mut usize,
) -> Option<()> {
    // The part to be added next is the last.
    let mut parts = vec![edge];
    while let Some([from, to]) = parts.pop() {
        if planar.can_add_constraint(from, to) {
            planar.add_constraint(from, to);
            continue;
        }
        let crossed = LineIntersectionIterator::new_from_handles(planar, from, to)
            .skip(1)
            .find_map(|met| match met {
                Intersection::EdgeIntersection(edge) if edge.is_constraint_edge() => Some(edge),
                _ => None,
            })?;
        *crossings_left = crossings_left.checked_sub(1)?;
        let [a, b] = crossed.vertices().map(|vertex| vertex.fix());
        let crossed = crossed.as_undirected().fix();
        let flat = crossing(planar, [a, b], [from, to]);
        let flat = spade::mitigate_underflow(Point2::new(flat.x, flat.y));
        let known = match planar.locate_with_hint(flat, a) {
            PositionInTriangulation::OnVertex(vertex) => Some(vertex),
            _ => None,
        };
        // Rounding may put the crossing on an end of the crossed edge, which then stays.
        if known != Some(a) && known != Some(b) {
            planar.remove_constraint_edge(crossed);
        }
        let middle = match known {
            Some(vertex) => vertex,
            None => {
                let corner = PolygonCorner {
                    position: lift(DVec2::new(flat.x, flat.y)),
                    outline_index: None,
                };
                planar
                    .insert_with_hint(PlanarVertex { flat, corner }, a)
                    .ok()?
            }
        };
        if middle == a || middle == b {
            parts.extend([[middle, to], [from, middle]]);
        } else {
            parts.extend([[middle, to], [middle, b], [a, middle], [from, middle]]);
        }
        parts.retain(|[from, to]| from != to);
    }
    Some(())
}

/// Returns the point where an edge crosses another, rounded, but never beyond an end of either.
fn crossing(planar: &Planar, edge: [FixedVertexHandle; 2], other: [FixedVertexHandle; 2]) -> DVec2 {
    let ends = |edge: [FixedVertexHandle; 2]| {
        edge.map(|vertex| {
            let Point2 { x, y } = planar.vertex(vertex).position();
            DVec2::new(x, y)
        })
    };
    let [[p, q], [r, s]] = [ends(edge), ends(other)];
    // Lines as a x + b y = c.
    let line = |p: DVec2, q: DVec2| {
        let (a, b) = (q.y - p.y, p.x - q.x);
        (a, b, a * p.x + b * p.y)
    };
    let ((a1, b1, c1), (a2, b2, c2)) = (line(p, q), line(r, s));
    let determinant = a1 * b2 - a2 * b1;
    let point = DVec2::new(b2 * c1 - b1 * c2, a1 * c2 - a2 * c1) / determinant;
    let low = p.min(q).max(r.min(s));
    let high = p.max(q).min(r.max(s));
    if point.is_nan() {
        return p;
    }
    point.max(low).min(high)
}

#[cfg(test)]
mod tests;
