//! How the triangles of a scene hang together.
//!
//! In: the surfaces. Out: edges with the opaque triangles at them, edge-connected components,
//! groups of triangles in one plane. Invariants: triangles are joined by bit-equal positions, never
//! by index or tolerance; only triangles that block everywhere take part in edges and components,
//! each set of three positions once. Absent here: lights, boxes.

use std::collections::HashMap;

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
    components: Vec<u32>,
    flat_groups: Vec<u32>,
}

/// The component of triangles that belong to none.
pub const NO_COMPONENT: u32 = u32::MAX;

impl Mesh {
    /// Joins the triangles of a scene.
    pub fn new(occluders: &Occluders) -> Self {
        let count = occluders.triangle_count();
        let mut components = Joined::new(count);
        let mut planes = Joined::new(count);
        let mut vertex_sets = HashMap::with_capacity(count);
        let mut at_edge: HashMap<[u32; 2], Vec<u32>> = HashMap::with_capacity(2 * count);

        // Edges of the triangles that block everywhere, each set of corners once.
        let is_member = |surface: usize| {
            let triangle = &occluders.triangles[surface];
            triangle.axis != NO_AXIS && occluders.is_opaque_everywhere(SurfaceId(surface as u32))
        };
        let mut is_twin = vec![false; count];
        for surface in 0..count {
            if occluders.triangles[surface].axis == NO_AXIS {
                continue;
            }
            let mut corners = occluders.triangles[surface].vertices;
            corners.sort_unstable();
            let key = (corners, is_member(surface));
            match vertex_sets.entry(key) {
                std::collections::hash_map::Entry::Occupied(first) => {
                    components.join(*first.get(), surface as u32);
                    planes.join(*first.get(), surface as u32);
                    is_twin[surface] = true;
                }
                std::collections::hash_map::Entry::Vacant(vacant) => {
                    vacant.insert(surface as u32);
                }
            }
        }
        for surface in (0..count).filter(|&surface| !is_twin[surface]) {
            let triangle = &occluders.triangles[surface];
            if triangle.axis == NO_AXIS {
                continue;
            }
            for [from, to] in sides_of(triangle.vertices) {
                let key = [from.min(to), from.max(to)];
                at_edge.entry(key).or_default().push(surface as u32);
            }
        }

        let mut edges = Vec::with_capacity(at_edge.len());
        for (vertices, all) in at_edge {
            // Planes join triangles of all kinds.
            for &other in &all[1..] {
                if occluders.are_coplanar(SurfaceId(all[0]), SurfaceId(other)) {
                    planes.join(all[0], other);
                }
            }
            let members: Vec<u32> = all
                .into_iter()
                .filter(|&surface| is_member(surface as usize))
                .collect();
            for &other in members.iter().skip(1) {
                components.join(members[0], other);
            }
            let faces = match *members {
                [] => continue,
                [first, second] => {
                    let runs_up = |surface: u32| {
                        sides_of(occluders.triangles[surface as usize].vertices).contains(&vertices)
                    };
                    Faces::Two {
                        surfaces: [SurfaceId(first), SurfaceId(second)],
                        is_consistent: runs_up(first) != runs_up(second),
                    }
                }
                _ => Faces::Rim,
            };
            edges.push(MeshEdge {
                vertices,
                component: members[0],
                faces,
            });
        }
        edges.sort_unstable_by_key(|edge| edge.vertices);
        for edge in &mut edges {
            edge.component = components.root(edge.component);
        }
        let component_of = |surface: usize| {
            if is_member(surface) {
                components.root(surface as u32)
            } else {
                NO_COMPONENT
            }
        };
        let components = (0..count).map(component_of).collect();
        let flat_groups = (0..count as u32).map(|s| planes.root(s)).collect();
        Self {
            edges,
            components,
            flat_groups,
        }
    }

    /// Returns all edges at which an opaque triangle lies, in a fixed order.
    pub fn edges(&self) -> &[MeshEdge] {
        &self.edges
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
        // The light sees two triangles that turn alike from the same side, iff they lie on opposite
        // sides of the plane through their edge and the light.
        let product = sides[first.0 as usize] * sides[second.0 as usize];
        product != if is_consistent { 1 } else { -1 }
    }

    /// Returns the bytes of all tables.
    pub fn memory_bytes(&self) -> u64 {
        (size_of_val(self.edges.as_slice())
            + size_of_val(self.components.as_slice())
            + size_of_val(self.flat_groups.as_slice())) as u64
    }
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
        let light = light.without_underflow().homogeneous();
        let side = |triangle: &crate::occluders::Triangle| match triangle.axis {
            NO_AXIS => 0,
            _ => plane_side(&Plane::Points(self.positions_of(triangle)), light).to_i8(),
        };
        self.triangles.iter().map(side).collect()
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
            && self.vertex_sides(first, second) == [Sign::Zero; 3]
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

    /// Returns whether two triangles surely share no point beside a common corner or edge, or lie in
    /// one plane, where neither blocks a start on the other.
    pub fn surely_do_not_cross(&self, first: SurfaceId, second: SurfaceId) -> bool {
        let [first, second] = [first, second].map(|s| &self.triangles[s.0 as usize]);
        if first.axis == NO_AXIS || second.axis == NO_AXIS {
            return true;
        }
        let shared = |vertex: &u32| first.vertices.contains(vertex);
        let shared_count = second
            .vertices
            .iter()
            .filter(|vertex| shared(vertex))
            .count();
        if shared_count >= 2 {
            return true;
        }
        // Beside the shared corner all corners of one lie strictly on one side of the other's plane.
        let is_one_sided = |signs: [Sign; 3]| {
            let zeros = signs.iter().filter(|&&sign| sign == Sign::Zero).count();
            zeros <= shared_count
                && !(signs.contains(&Sign::Positive) && signs.contains(&Sign::Negative))
        };
        let of_second = self.vertex_sides(first, second);
        if of_second == [Sign::Zero; 3] || is_one_sided(of_second) {
            return true;
        }
        is_one_sided(self.vertex_sides(second, first))
    }
}
