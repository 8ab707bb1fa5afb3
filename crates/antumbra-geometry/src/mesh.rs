//! How the triangles of a scene hang together.
//!
//! In: the surfaces. Out: edges with the opaque triangles at them, edge-connected components,
//! groups of triangles in one plane. Invariants: triangles are joined by bit-equal positions, never
//! by index or tolerance; only triangles that block everywhere take part in edges and components,
//! each set of three positions once. Absent here: lights, boxes.

use antumbra_task::{check, checked};
use glam::BVec3;

use crate::intersect::plane_side;
use crate::number::Sign;
use crate::occluders::NO_AXIS;
use crate::segment::Plane;
use crate::{DVec3, LightShape, Occluders, SurfaceId};

/// An edge of opaque triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshEdge {
    /// The positions at its ends, the smaller number first.
    pub(crate) vertices: [u32; 2],
    /// The component of its triangles.
    pub component: u32,
    faces: Faces,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Faces {
    /// One triangle, or more than two: a contour for every light.
    Rim,
    /// Two, and whether they turn along the edge in opposite directions.
    Two {
        surfaces: [SurfaceId; 2],
        is_consistent: bool,
    },
}

/// The triangles' edges, components and planes.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    edges: Vec<MeshEdge>,
    /// For each triangle the numbers of its edges, [`NO_EDGE`] where it takes part in none.
    triangle_edges: Vec<[u32; 3]>,
    /// For each side of a triangle, from corner to corner, twice the triangle beyond, and 1 if the two turn along it in
    /// opposite directions; [`NO_EDGE`] where not exactly one is beyond.
    across: Vec<[u32; 3]>,
    /// Whether a triangle repeats another one that blocks everywhere.
    repeated: Vec<bool>,
    components: Vec<u32>,
    flat_groups: Vec<u32>,
}

/// In place of an edge that is none.
pub const NO_EDGE: u32 = u32::MAX;

/// The component of triangles that belong to none.
pub const NO_COMPONENT: u32 = u32::MAX;

impl Mesh {
    /// Joins the triangles of a scene.
    pub fn new(occluders: &Occluders) -> Self {
        Self::with_edges(occluders, true)
    }

    /// Likewise, without edges and components: what lies beyond the sides of triangles, and in which planes they lie, in
    /// a sixth of the memory.
    pub fn without_edges(occluders: &Occluders) -> Self {
        Self::with_edges(occluders, false)
    }

    fn with_edges(occluders: &Occluders, has_edges: bool) -> Self {
        let count = occluders.triangle_count();
        let mut components = Joined::new(count);
        let mut planes = Joined::new(count);

        // Edges of the triangles that block everywhere, each set of corners once.
        let has_area = |surface: &u32| occluders.triangles[*surface as usize].axis != NO_AXIS;
        let is_member =
            |surface: u32| has_area(&surface) && occluders.is_opaque_everywhere(SurfaceId(surface));
        let mut vertex_sets: Vec<([u32; 3], bool, u32)> = Vec::with_capacity(count);
        vertex_sets.extend(checked(0..count as u32).filter(has_area).map(|surface| {
            let mut corners = occluders.triangles[surface as usize].vertices;
            corners.sort_unstable();
            (corners, is_member(surface), surface)
        }));
        let position_count = occluders.positions.len();
        let vertex_sets = sorted(vertex_sets, position_count, |set| set.0[0]);
        check();
        let mut is_twin = vec![false; count];
        for same in vertex_sets.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            for &(_, _, surface) in &same[1..] {
                components.join(same[0].2, surface);
                planes.join(same[0].2, surface);
                is_twin[surface as usize] = true;
            }
        }
        drop(vertex_sets);
        let mut at_edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * count);
        let all = checked(0..count as u32)
            .filter(|surface| has_area(surface) && !is_twin[*surface as usize])
            .flat_map(|surface| {
                let vertices = occluders.triangles[surface as usize].vertices;
                sides_of(vertices).map(|[from, to]| ([from.min(to), from.max(to)], surface))
            });
        at_edges.extend(all);
        check();
        let at_edges = sorted(at_edges, position_count, |of| of.0[0]);

        let edge_count = at_edges.chunk_by(|a, b| a.0 == b.0).count();
        let [edge_count, in_edges] = [edge_count, count].map(|n| if has_edges { n } else { 0 });
        let mut edges = Vec::with_capacity(edge_count);
        let mut triangle_edges = vec![[NO_EDGE; 3]; in_edges];
        let mut across = vec![[NO_EDGE; 3]; count];
        let mut members = Vec::new();
        for all in checked(at_edges.chunk_by(|a, b| a.0 == b.0)) {
            let (vertices, first) = all[0];
            // Planes join triangles of all kinds.
            for &(_, other) in &all[1..] {
                if occluders.are_coplanar(SurfaceId(first), SurfaceId(other)) {
                    planes.join(first, other);
                }
            }
            members.clear();
            members.extend(all.iter().map(|of| of.1).filter(|&s| is_member(s)));
            for &other in members.iter().skip(1) {
                components.join(members[0], other);
            }
            let faces = match *members {
                [] => continue,
                [first, second] => {
                    // Which side it is, and whether it runs up.
                    let side = |surface: u32| {
                        let sides = sides_of(occluders.triangles[surface as usize].vertices);
                        let is_it =
                            |[from, to]: &[u32; 2]| [*from.min(to), *from.max(to)] == vertices;
                        let number = sides.iter().position(is_it).unwrap_or(0);
                        (number, sides[number] == vertices)
                    };
                    let (one, other) = (side(first), side(second));
                    let is_consistent = one.1 != other.1;
                    let beyond = |surface: u32| surface << 1 | u32::from(is_consistent);
                    across[first as usize][one.0] = beyond(second);
                    across[second as usize][other.0] = beyond(first);
                    Faces::Two {
                        surfaces: [SurfaceId(first), SurfaceId(second)],
                        is_consistent,
                    }
                }
                _ => Faces::Rim,
            };
            if !has_edges {
                continue;
            }
            for &member in &members {
                let own = &mut triangle_edges[member as usize];
                if let Some(free) = own.iter_mut().find(|edge| **edge == NO_EDGE) {
                    *free = edges.len() as u32;
                }
            }
            edges.push(MeshEdge {
                vertices,
                component: members[0],
                faces,
            });
        }
        for edge in &mut edges {
            edge.component = components.root(edge.component);
        }
        let component_of = |surface: u32| {
            if is_member(surface) {
                components.root(surface)
            } else {
                NO_COMPONENT
            }
        };
        let components = (0..in_edges as u32).map(component_of).collect();
        let is_repeated = |surface: u32| is_twin[surface as usize] && is_member(surface);
        let repeated = (0..count as u32).map(is_repeated).collect();
        let flat_groups = (0..count as u32).map(|s| planes.root(s)).collect();
        Self {
            edges,
            triangle_edges,
            across,
            repeated,
            components,
            flat_groups,
        }
    }

    /// Returns all edges at which an opaque triangle lies, in a fixed order.
    pub fn edges(&self) -> &[MeshEdge] {
        &self.edges
    }

    /// Returns the numbers of a triangle's edges, [`NO_EDGE`] for triangles without area, that do not block
    /// everywhere, or that repeat another.
    pub fn edges_of(&self, triangle: SurfaceId) -> [u32; 3] {
        self.triangle_edges[triangle.0 as usize]
    }

    /// Returns for each side of a triangle, from corner to corner, the triangle beyond it; `None` where the side may
    /// cast an edge of a shadow ([`Mesh::is_contour`]). `sides` are those of [`Occluders::light_sides`].
    pub fn beyond(&self, triangle: SurfaceId, sides: &[i8]) -> [Option<SurfaceId>; 3] {
        self.across[triangle.0 as usize].map(|across| {
            let (other, is_consistent) = (across >> 1, across & 1 != 0);
            let side = sides.get(other as usize)?;
            let is_contour = is_edge_contour([sides[triangle.0 as usize], *side], is_consistent);
            (across != NO_EDGE && !is_contour).then_some(SurfaceId(other))
        })
    }

    /// Returns whether a triangle repeats another one that blocks everywhere, corner by corner in any order: one of them
    /// has edges, this one has none.
    pub fn is_repeated(&self, triangle: SurfaceId) -> bool {
        self.repeated[triangle.0 as usize]
    }

    /// Returns the component of a triangle, [`NO_COMPONENT`] for those that do not block everywhere.
    pub fn component(&self, triangle: SurfaceId) -> u32 {
        self.components[triangle.0 as usize]
    }

    /// Returns a number that triangles share only if they lie exactly in one plane, so that none of
    /// them blocks a start on another.
    pub fn flat_group(&self, triangle: SurfaceId) -> u32 {
        self.flat_groups[triangle.0 as usize]
    }

    /// Returns whether an edge may cast an edge of a shadow: not if it has two triangles that lie on
    /// opposite sides of the plane through the edge and the light. `sides` are those of
    /// [`Occluders::light_sides`].
    pub fn is_contour(&self, edge: &MeshEdge, sides: &[i8]) -> bool {
        let Faces::Two {
            surfaces: [first, second],
            is_consistent,
        } = edge.faces
        else {
            return true;
        };
        is_edge_contour(
            [sides[first.0 as usize], sides[second.0 as usize]],
            is_consistent,
        )
    }

    /// Returns the most bytes that [`Mesh::new`] takes at its height, for so many triangles: what it makes, and beside
    /// it three sides and their sets of each triangle.
    pub fn height_bytes(triangle_count: usize) -> u64 {
        let made = 3 * size_of::<MeshEdge>() + 2 * size_of::<[u32; 3]>() + 2 * size_of::<u32>();
        (triangle_count * (made + BESIDE)) as u64
    }

    /// Returns the most bytes that [`Mesh::without_edges`] takes at its height, for so many triangles.
    pub fn height_bytes_without_edges(triangle_count: usize) -> u64 {
        let made = size_of::<[u32; 3]>() + size_of::<u32>();
        (triangle_count * (made + BESIDE)) as u64
    }

    /// Returns whether it says how triangles are joined: not of no triangles, nor after [`Mesh::keep_planes`].
    pub fn is_joined(&self) -> bool {
        !self.across.is_empty()
    }

    /// Drops all but what says which triangles lie in one plane. There are no edges then.
    pub fn keep_planes(&mut self) {
        let flat_groups = std::mem::take(&mut self.flat_groups);
        *self = Self {
            flat_groups,
            ..Self::default()
        };
    }

    /// Returns the bytes of all tables.
    pub fn memory_bytes(&self) -> u64 {
        (self.edges.capacity() * size_of::<MeshEdge>()
            + size_of_val(self.triangle_edges.as_slice())
            + size_of_val(self.across.as_slice())
            + size_of_val(self.repeated.as_slice())
            + size_of_val(self.components.as_slice())
            + size_of_val(self.flat_groups.as_slice())) as u64
    }
}

/// Bytes for each triangle while a mesh is made: its sides, twice while they are sorted, and numbers.
const BESIDE: usize =
    2 * 3 * size_of::<([u32; 2], u32)>() + 5 * size_of::<u32>() + 2 * size_of::<bool>();

/// Sorts items, of which few share the first number of their keys. All of those are below `count`.
fn sorted<T: Ord + Copy>(items: Vec<T>, count: usize, first: impl Fn(&T) -> u32) -> Vec<T> {
    let mut ends = vec![0_u32; count + 1];
    for item in &items {
        ends[first(item) as usize + 1] += 1;
    }
    for number in 0..count {
        ends[number + 1] += ends[number];
    }
    let mut sorted = items.clone();
    for item in checked(&items) {
        let end = &mut ends[first(item) as usize];
        sorted[*end as usize] = *item;
        *end += 1;
    }
    for same in checked(sorted.chunk_by_mut(|a, b| first(a) == first(b))) {
        same.sort_unstable();
    }
    sorted
}

/// Returns whether an edge of two triangles may cast an edge of a shadow, on whose sides the light is so.
fn is_edge_contour([first, second]: [i8; 2], is_consistent: bool) -> bool {
    // The light sees two triangles that turn alike from the same side, iff they lie on opposite
    // sides of the plane through their edge and the light.
    first * second != if is_consistent { 1 } else { -1 }
}

fn sides_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Disjoint sets; a set is named by its smallest member.
struct Joined {
    parents: Vec<u32>,
}

impl Joined {
    fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    fn root(&self, mut member: u32) -> u32 {
        while self.parents[member as usize] != member {
            member = self.parents[member as usize];
        }
        member
    }

    fn join(&mut self, first: u32, second: u32) {
        let (first, second) = (self.root(first), self.root(second));
        let (low, high) = (first.min(second), first.max(second));
        self.parents[high as usize] = low;
        // Halve both ways while at it.
        for mut member in [first, second] {
            while self.parents[member as usize] != low {
                let next = self.parents[member as usize];
                self.parents[member as usize] = low;
                member = next;
            }
        }
    }
}

impl Occluders {
    /// Returns for each triangle on which side of its plane the light is: 1 on the side of its
    /// normal, -1 behind, 0 in the plane and for triangles without area.
    pub fn light_sides(&self, light: &LightShape) -> Vec<i8> {
        let all = 0..self.triangles.len() as u32;
        all.map(|triangle| self.light_side_of(SurfaceId(triangle), light))
            .collect()
    }

    /// Returns the same for one triangle.
    pub fn light_side_of(&self, triangle: SurfaceId, light: &LightShape) -> i8 {
        let triangle = &self.triangles[triangle.0 as usize];
        let light = light.without_underflow().homogeneous();
        match triangle.axis {
            NO_AXIS => 0,
            _ => plane_side(&Plane::Points(self.positions_of(triangle)), light).to_i8(),
        }
    }

    /// Returns the positions of an edge's ends.
    pub fn edge_positions(&self, edge: &MeshEdge) -> [DVec3; 2] {
        edge.vertices.map(|vertex| self.positions[vertex as usize])
    }

    /// Returns whether two triangles with area lie exactly in one plane.
    pub(crate) fn are_coplanar(&self, first: SurfaceId, second: SurfaceId) -> bool {
        let [first, second] = [first, second].map(|s| &self.triangles[s.0 as usize]);
        first.axis != NO_AXIS
            && second.axis != NO_AXIS
            && (self.are_upright_in_one_plane(first, second)
                || self.vertex_sides(first, second) == [Sign::Zero; 3])
    }

    /// Returns whether all corners of two triangles have one coordinate in common. Of walls and floors that is soon told.
    fn are_upright_in_one_plane(
        &self,
        first: &crate::occluders::Triangle,
        second: &crate::occluders::Triangle,
    ) -> bool {
        let corner = |vertex: u32| self.positions[vertex as usize];
        let shared = corner(first.vertices[0]);
        let corners = first.vertices[1..].iter().chain(&second.vertices);
        let mut is_shared = BVec3::TRUE;
        for &vertex in corners {
            is_shared &= corner(vertex).cmpeq(shared);
        }
        is_shared.any()
    }

    /// Returns on which side of the first triangle's plane the corners of the second lie, exactly.
    pub(crate) fn vertex_sides(
        &self,
        first: &crate::occluders::Triangle,
        second: &crate::occluders::Triangle,
    ) -> [Sign; 3] {
        let plane = Plane::Points(self.positions_of(first));
        second.vertices.map(|vertex| {
            if first.vertices.contains(&vertex) {
                Sign::Zero
            } else {
                plane_side(&plane, (self.positions[vertex as usize], 1.0))
            }
        })
    }
}

#[cfg(test)]
mod tests;
