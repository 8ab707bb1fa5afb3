//! Curved shapes as meshes (Paper 9.1: polygonization).
//!
//! In: a shape, how finely it is cut. Out: a mesh with the shape's normals for shading. Invariants: vertices lie on the shape,
//! up to rounding; of implicit surfaces, up to what a line between two samples is off. Shadows of the mesh have polygonal
//! outlines: what is asked about near them may get another answer.

use std::collections::HashMap;
use std::f64::consts::TAU;

use antumbra_geometry::{
    BezierPatch, Bounds, Cone, DVec3, Disk, Implicit, MAX_PATCH_LEVEL, Sphere,
};

use crate::model::{Corner, Mesh, Scene, Shape};

/// Cells along a side: the fewest and the most.
pub const TESSELLATION: std::ops::RangeInclusive<u32> = 1..=1024;

/// Most cells along the longest side of an implicit surface's box: they fill space.
const MOST_OF_SPACE: u32 = 256;

impl Scene {
    /// Returns the scene with all curved shapes as meshes; see [`Shape::tessellated`].
    #[must_use]
    pub fn tessellated(mut self, cells: u32) -> Self {
        for object in &mut self.objects {
            if let Some(mesh) = object.shape.tessellated(cells) {
                object.shape = Shape::Mesh(mesh);
            }
        }
        self
    }
}

impl Shape {
    /// Returns a curved shape as a mesh; `None` for shapes of faces. `cells` are kept within [`TESSELLATION`]. Circles have twice as
    /// many sides, at least 3; patches have as many cells a side, rounded up to a power of two and to at most 4096; boxes of
    /// implicit surfaces have as many along their longest side, at most 256. Takes time and memory in
    /// proportion to the square of `cells`, of implicit surfaces to the cube.
    pub fn tessellated(&self, cells: u32) -> Option<Mesh> {
        let cells = cells.clamp(*TESSELLATION.start(), *TESSELLATION.end());
        Some(match self {
            Self::Sphere(sphere) => of_sphere(sphere, cells),
            Self::Cone(cone) => of_cone(cone, cells),
            Self::Disk(disk) => of_disk(disk, cells),
            Self::Patch(patch) => of_patch(patch, cells),
            Self::Implicit(implicit) => of_implicit(implicit, cells.min(MOST_OF_SPACE)),
            Self::Polygon(_) | Self::Mesh(_) | Self::Instance(_) => return None,
        })
    }
}

/// A mesh in the making, with a normal for each vertex.
#[derive(Default)]
struct Making {
    mesh: Mesh,
}

impl Making {
    /// Adds a vertex and returns its number. A zero normal is none.
    fn vertex(&mut self, position: DVec3, normal: DVec3) -> u32 {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal);
        self.mesh.positions.len() as u32 - 1
    }

    /// Adds a face, unless two corners that follow one another are in one place: then without one of them.
    fn face(&mut self, corners: &[u32]) {
        let place = |corner: u32| self.mesh.positions[corner as usize];
        let mut kept: Vec<u32> = Vec::with_capacity(corners.len());
        for &corner in corners {
            if kept.last().is_none_or(|&last| place(last) != place(corner)) {
                kept.push(corner);
            }
        }
        while kept.len() > 1 && place(kept[0]) == place(kept[kept.len() - 1]) {
            kept.pop();
        }
        if kept.len() < 3 {
            return;
        }
        for corner in kept {
            let has_normal = self.mesh.normals[corner as usize] != DVec3::ZERO;
            self.mesh.corners.push(Corner {
                normal: if has_normal { corner } else { Corner::NONE },
                ..Corner::at(corner)
            });
        }
        self.mesh.face_ends.push(self.mesh.corners.len() as u32);
    }
}

/// Returns a unit direction round an axis, one of `count`.
fn around([across, beside]: [DVec3; 2], number: u32, count: u32) -> DVec3 {
    let angle = TAU * f64::from(number % count) / f64::from(count);
    let (sine, cosine) = libm::sincos(angle);
    across * cosine + beside * sine
}

fn unit(vector: DVec3) -> DVec3 {
    (vector / vector.abs().max_element()).normalize()
}

fn of_sphere(sphere: &Sphere, cells: u32) -> Mesh {
    let (rings, sides) = (cells.max(2), (2 * cells).max(3));
    let mut making = Making::default();
    for ring in 0..=rings {
        let angle = 0.5 * TAU * f64::from(ring) / f64::from(rings);
        let (sine, cosine) = match ring {
            0 => (0.0, 1.0),
            _ if ring == rings => (0.0, -1.0),
            _ => libm::sincos(angle),
        };
        for side in 0..sides {
            let out = around([DVec3::X, DVec3::Y], side, sides);
            let normal = out * sine + DVec3::Z * cosine;
            making.vertex(sphere.center + normal * sphere.radius, normal);
        }
    }
    for ring in 0..rings {
        for side in 0..sides {
            let next = (side + 1) % sides;
            let [upper, lower] = [ring, ring + 1].map(|ring| ring * sides);
            making.face(&[upper + side, lower + side, lower + next, upper + next]);
        }
    }
    making.mesh
}

fn of_cone(cone: &Cone, cells: u32) -> Mesh {
    let mut making = Making::default();
    let axis = cone.apex - cone.base;
    if axis == DVec3::ZERO {
        return making.mesh;
    }
    let sides = (2 * cells).max(3);
    let along = unit(axis);
    let (across, beside) = along.any_orthonormal_pair();
    // The wall's normal tilts with its slope.
    let tilt = along * ((cone.base_radius - cone.apex_radius) / axis.length());
    let ends = [(cone.base, cone.base_radius), (cone.apex, cone.apex_radius)];
    for (center, radius) in ends {
        for side in 0..sides {
            let out = around([across, beside], side, sides);
            making.vertex(center + out * radius, unit(out + tilt));
        }
    }
    for side in 0..sides {
        let next = (side + 1) % sides;
        making.face(&[side, next, sides + next, sides + side]);
    }
    if cone.is_closed {
        for ((center, radius), normal) in ends.into_iter().zip([-along, along]) {
            let rim = (0..sides).map(|side| {
                let side = if normal == along {
                    side
                } else {
                    sides - 1 - side
                };
                center + around([across, beside], side, sides) * radius
            });
            let rim: Vec<u32> = rim.map(|place| making.vertex(place, normal)).collect();
            making.face(&rim);
        }
    }
    making.mesh
}

fn of_disk(disk: &Disk, cells: u32) -> Mesh {
    let mut making = Making::default();
    if disk.normal == DVec3::ZERO {
        return making.mesh;
    }
    let normal = unit(disk.normal);
    let (across, beside) = normal.any_orthonormal_pair();
    let sides = (2 * cells).max(3);
    let rim =
        (0..sides).map(|side| disk.center + around([across, beside], side, sides) * disk.radius);
    let rim: Vec<u32> = rim.map(|place| making.vertex(place, normal)).collect();
    making.face(&rim);
    making.mesh
}

fn of_patch(patch: &BezierPatch, cells: u32) -> Mesh {
    let level = cells.next_power_of_two().ilog2().min(MAX_PATCH_LEVEL);
    let patch = BezierPatch {
        control: patch.control,
        level,
    };
    let cells = patch.cells();
    let mut making = Making::default();
    for j in 0..=cells {
        for i in 0..=cells {
            let normal = patch.normal(i, j);
            making.vertex(patch.vertex(i, j), normal);
        }
    }
    for j in 0..cells {
        for i in 0..cells {
            let corner = j * (cells + 1) + i;
            let above = corner + cells + 1;
            making.face(&[corner, corner + 1, above + 1]);
            making.face(&[corner, above + 1, above]);
        }
    }
    making.mesh
}

/// Corners of a cube's six tetrahedra, as bits of x, y and z: all share the diagonal from 0 to 7, so that neighbours fit.
const TETRAHEDRA: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];

/// Cuts space into cubes, cubes into tetrahedra, and these where the field changes its sign.
fn of_implicit(implicit: &Implicit, cells: u32) -> Mesh {
    let bounds = implicit.bounds();
    let counts = cell_counts(&bounds, cells);
    let [nx, ny, nz] = counts.map(|count| count + 1);
    let place = |number: usize| {
        let [x, y, z] = [number % nx, number / nx % ny, number / (nx * ny)];
        let share = DVec3::new(
            x as f64 / (nx - 1) as f64,
            y as f64 / (ny - 1) as f64,
            z as f64 / (nz - 1) as f64,
        );
        implicit.low + (implicit.high - implicit.low) * share
    };
    let values = implicit.values_at((0..nx * ny * nz).map(place));
    let mut making = Making::default();
    let mut vertices: HashMap<(usize, usize), u32> = HashMap::new();
    let mut cut = |making: &mut Making, inside: usize, outside: usize| {
        let key = (inside.min(outside), inside.max(outside));
        *vertices.entry(key).or_insert_with(|| {
            let (low, high) = (values[key.0], values[key.1]);
            let share = (low / (low - high)).clamp(0.0, 1.0);
            let (from, to) = (place(key.0), place(key.1));
            making.vertex(from + (to - from) * share, DVec3::ZERO)
        })
    };
    for cell in 0..counts.iter().product() {
        antumbra_task::check();
        let [x, y, z] = [
            cell % counts[0],
            cell / counts[0] % counts[1],
            cell / (counts[0] * counts[1]),
        ];
        let corner = |bits: usize| {
            let [x, y, z] = [x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2)];
            x + nx * (y + ny * z)
        };
        for tetrahedron in TETRAHEDRA {
            let corners = tetrahedron.map(corner);
            let is_inside = |&corner: &usize| values[corner] < 0.0;
            let (inside, outside): (Vec<usize>, Vec<usize>) =
                corners.into_iter().partition(is_inside);
            let ring: Vec<(usize, usize)> = match (&inside[..], &outside[..]) {
                (&[a], &[b, c, d]) => vec![(a, b), (a, c), (a, d)],
                (&[b, c, d], &[a]) => vec![(b, a), (c, a), (d, a)],
                (&[a, b], &[c, d]) => vec![(a, c), (a, d), (b, d), (b, c)],
                _ => continue,
            };
            let mut corners: Vec<u32> = ring
                .iter()
                .map(|&(inside, outside)| cut(&mut making, inside, outside))
                .collect();
            // Wound so that its front looks outwards.
            let [a, b, c] = [0, 1, 2].map(|i: usize| making.mesh.positions[corners[i] as usize]);
            let outwards = place(outside[0]) - place(inside[0]);
            if (b - a).cross(c - a).dot(outwards) < 0.0 {
                corners.reverse();
            }
            for last in 2..corners.len() {
                making.face(&[corners[0], corners[last - 1], corners[last]]);
            }
        }
    }
    let Making { mut mesh } = making;
    mesh.normals = implicit.normals_at(mesh.positions.iter().copied());
    for corner in &mut mesh.corners {
        if mesh.normals[corner.position as usize] != DVec3::ZERO {
            corner.normal = corner.position;
        }
    }
    mesh
}

fn cell_counts(bounds: &Bounds, cells: u32) -> [usize; 3] {
    let size = bounds.size() / bounds.size().max_element();
    size.to_array()
        .map(|share| ((share * f64::from(cells)).ceil() as usize).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area of all faces, and six times the volume that they enclose.
    fn measures(mesh: &Mesh) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for face in mesh.faces() {
            let place = |corner: usize| mesh.positions[face[corner].position as usize];
            for last in 2..face.len() {
                let (a, b, c) = (place(0), place(last - 1), place(last));
                sums[0] += (b - a).cross(c - a).length();
                sums[1] += a.dot(b.cross(c));
            }
        }
        sums
    }

    #[test]
    fn meshes_have_the_size_of_their_shapes_and_look_outwards() {
        let center = DVec3::new(1.0, 2.0, 3.0);
        let cone = Cone {
            base: center,
            base_radius: 2.0,
            apex: center + DVec3::new(0.0, 3.0, 4.0),
            apex_radius: 1.0,
            is_closed: true,
        };
        let torus = Implicit::torus(center, DVec3::new(1.0, 0.2, 0.1), 2.0, 0.75);
        let half = 0.5 * TAU;
        let wall = 26.0_f64.sqrt() * 3.0;
        for (shape, area, volume) in [
            (
                Shape::Sphere(Sphere {
                    center,
                    radius: 2.0,
                }),
                8.0 * TAU,
                half * 32.0 / 3.0,
            ),
            (
                Shape::Cone(cone),
                half * (wall + 5.0),
                half * 5.0 * 7.0 / 3.0,
            ),
            (
                Shape::Implicit(Box::new(torus)),
                TAU * TAU * 2.0 * 0.75,
                half * TAU * 2.0 * 0.5625,
            ),
        ] {
            let mesh = shape.tessellated(96).unwrap();
            let [found_area, found_volume] = measures(&mesh);
            let is_near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 0.01;
            assert!(
                is_near(0.5 * found_area, area),
                "{shape:?} {found_area} {area}"
            );
            assert!(
                is_near(found_volume / 6.0, volume),
                "{shape:?} {found_volume} {volume}"
            );
        }
        let disk = Shape::Disk(Disk {
            center,
            normal: DVec3::new(0.0, 0.0, 5.0),
            radius: 2.0,
        });
        let [area, _] = measures(&disk.tessellated(64).unwrap());
        assert!((0.5 * area / (4.0 * half) - 1.0).abs() < 0.01);
        assert!(Shape::Mesh(Mesh::default()).tessellated(4).is_none());
    }

    #[test]
    fn patches_that_meet_have_meshes_that_meet() {
        let control = std::array::from_fn(|j| {
            std::array::from_fn(|i| DVec3::new(i as f64, j as f64, (i * j % 3) as f64))
        });
        let patch = BezierPatch { control, level: 8 };
        let mesh = Shape::Patch(Box::new(patch.clone()))
            .tessellated(5)
            .unwrap();
        // Five cells become eight.
        assert_eq!(mesh.face_ends.len(), 2 * 8 * 8);
        let coarse = BezierPatch { control, level: 3 };
        assert_eq!(mesh.positions[8], coarse.vertex(8, 0));
        assert!(mesh.normals.iter().all(|normal| normal.z > 0.0));
    }
}
