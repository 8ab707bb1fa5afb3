//! Adding a whole triangle mesh at once.
//!
//! In: vertices and the triangles that name them, as renderers, file formats and NumPy keep them. Out: a surface for
//! each triangle, the same as [`OccludersBuilder::add_face`] makes of its corners. Invariant: all of a mesh is added, or
//! nothing. A vertex is looked up among all positions once, however many triangles meet in it.

use std::ops::Range;

use glam::DVec3;

use super::build::{LARGEST, OccludersBuilder};
use super::{Element, ElementKind, NO_ALPHA_TEST, NO_AXIS, OccludersError, Opacity, Triangle};
use crate::segment::Plane;

/// In place of a vertex's number among the positions, until a triangle asks for it.
const NO_POSITION: u32 = u32::MAX;

impl OccludersBuilder {
    /// Adds a triangle mesh: `vertices` in world space, as `f32` or `f64`, and for each triangle the places of its three
    /// corners among them.
    ///
    /// Returns the numbers of the new surfaces, one for each triangle in the order given: triangle `i` is
    /// `SurfaceId(range.start + i)`. A triangle without area, or with a corner named twice, keeps its number like any
    /// other and blocks nothing. Each triangle is an element of its own, as if [`add_face`](Self::add_face) had added
    /// it, and all answers are the same.
    ///
    /// Cost: about a third of a microsecond a triangle. Vertices that no
    /// triangle names cost nothing and may hold any number.
    ///
    /// ```
    /// use antumbra_geometry::{Occluders, Opacity};
    ///
    /// let vertices = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let mut builder = Occluders::builder();
    /// let floor = builder.add_mesh(&vertices, &[[0, 1, 2], [0, 2, 3]], Opacity::Opaque)?;
    /// assert_eq!(floor, 0..2);
    /// assert!(builder.add_mesh(&vertices, &[[0, 1, 4]], Opacity::Opaque).is_err());
    /// # Ok::<(), antumbra_geometry::OccludersError>(())
    /// ```
    ///
    /// # Errors
    /// A triangle names a vertex that is not there, or one with a number that is not finite or beyond 2^100, or there
    /// are too many triangles. Nothing is added then.
    pub fn add_mesh<T: Copy + Into<f64>>(
        &mut self,
        vertices: &[[T; 3]],
        triangles: &[[u32; 3]],
        opacity: Opacity,
    ) -> Result<Range<u32>, OccludersError> {
        check(vertices, triangles)?;
        self.check_room(triangles.len())?;
        let first = self.occluders.triangles.len() as u32;
        let first_element = self.occluders.elements.len() as u32;
        self.occluders.triangles.reserve(triangles.len());
        self.occluders.elements.reserve(triangles.len());
        let mut position_of = vec![NO_POSITION; vertices.len()];
        for (number, corners) in (0..).zip(triangles) {
            let surface = first + number;
            let element = first_element + number;
            let positions = corners.map(|corner| position(vertices[corner as usize]));
            let indices = [0, 1, 2].map(|i| {
                let known = &mut position_of[corners[i] as usize];
                if *known == NO_POSITION {
                    *known = self.vertex(positions[i]);
                }
                *known
            });
            self.occluders.triangles.push(Triangle {
                vertices: indices,
                corners: [0, 1, 2],
                element,
                axis: Plane::Points(positions).dominant_axis().unwrap_or(NO_AXIS),
                is_opaque: opacity.blocks(),
                alpha_test: NO_ALPHA_TEST,
            });
            self.occluders.elements.push(Element {
                kind: ElementKind::Face,
                surfaces: surface..surface + 1,
                opacity,
            });
        }
        Ok(first..first + triangles.len() as u32)
    }
}

fn position<T: Copy + Into<f64>>(vertex: [T; 3]) -> DVec3 {
    DVec3::from_array(vertex.map(Into::into))
}

/// Finds the first triangle that cannot be added.
fn check<T: Copy + Into<f64>>(
    vertices: &[[T; 3]],
    triangles: &[[u32; 3]],
) -> Result<(), OccludersError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        for (corner, &index) in corners.iter().enumerate() {
            let Some(&vertex) = vertices.get(index as usize) else {
                return Err(OccludersError::MeshIndex {
                    triangle,
                    corner,
                    index,
                    vertex_count: vertices.len(),
                });
            };
            let position = position(vertex);
            // Not for NaN.
            if !position.abs().cmple(DVec3::splat(LARGEST)).all() {
                return Err(OccludersError::MeshVertex {
                    triangle,
                    vertex: index,
                    position,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Occluders, Sphere};

    /// A bumpy square of 2 n^2 triangles, in which vertices stand twice, zeros have both signs, and some triangles have
    /// no area.
    fn mesh(n: u32) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let mut vertices = Vec::new();
        for i in 0..=n {
            for j in 0..=n {
                let height = f64::from((i * 7 + j * 13) % 5) - 2.0;
                vertices.push([
                    f64::from(i) - 3.0,
                    -f64::from(j),
                    -0.0 * height + height / 8.0,
                ]);
            }
        }
        let copies = vertices.clone();
        vertices.extend(copies.iter().map(|v| v.map(|x| x + 0.0)));
        let (row, all) = (n + 1, (n + 1) * (n + 1));
        let mut triangles = Vec::new();
        for i in 0..n {
            for j in 0..n {
                let corner = i * row + j;
                triangles.push([corner, corner + 1, corner + row]);
                triangles.push([corner + 1 + all, corner + row + 1, corner + row + all]);
            }
        }
        triangles.extend([[0, 0, 1], [3, all + 3, 5], [0, row, 2 * row], [1, 1, 1]]);
        (vertices, triangles)
    }

    #[test]
    fn a_mesh_is_what_a_loop_over_its_faces_makes() {
        let (vertices, triangles) = mesh(9);
        let coverage_free = [Opacity::Opaque, Opacity::Transparent];
        for opacity in coverage_free {
            let ball = Sphere {
                center: DVec3::ONE,
                radius: 2.0,
            };
            let [mut at_once, mut one_by_one] = [(); 2].map(|()| Occluders::builder());
            for builder in [&mut at_once, &mut one_by_one] {
                builder
                    .add_face(&[DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y], opacity)
                    .expect("a face");
                builder.add_sphere(ball, opacity).expect("a sphere");
            }
            let range = at_once
                .add_mesh(&vertices, &triangles, opacity)
                .expect("a mesh");
            for corners in &triangles {
                let outline = corners.map(|i| DVec3::from_array(vertices[i as usize]));
                one_by_one.add_face(&outline, opacity).expect("a triangle");
            }
            // And once more what is there already.
            at_once
                .add_mesh(&vertices, &triangles[..5], opacity)
                .expect("a mesh");
            for corners in &triangles[..5] {
                let outline = corners.map(|i| DVec3::from_array(vertices[i as usize]));
                one_by_one.add_face(&outline, opacity).expect("a triangle");
            }
            assert_eq!(range.len(), triangles.len());
            let (at_once, one_by_one) = (at_once.build(), one_by_one.build());
            let all = |occluders: &Occluders| {
                let Occluders {
                    positions,
                    triangles,
                    elements,
                    ..
                } = occluders;
                let bits: Vec<_> = positions
                    .iter()
                    .map(|v| v.to_array().map(f64::to_bits))
                    .collect();
                format!("{bits:?} {triangles:?} {elements:?}")
            };
            assert_eq!(all(&at_once), all(&one_by_one));
        }
    }

    #[test]
    fn single_precision_is_widened() {
        let (vertices, triangles) = mesh(3);
        let single: Vec<[f32; 3]> = vertices.iter().map(|v| v.map(|x| x as f32)).collect();
        let [mut first, mut second] = [(); 2].map(|()| Occluders::builder());
        first
            .add_mesh(&vertices, &triangles, Opacity::Opaque)
            .expect("a mesh");
        second
            .add_mesh(&single, &triangles, Opacity::Opaque)
            .expect("a mesh");
        // Eighths are whole in both.
        assert_eq!(first.build().positions, second.build().positions);
    }

    #[test]
    fn bad_meshes_are_refused_whole() {
        let mut vertices = mesh(2).0;
        let count = vertices.len();
        let mut builder = Occluders::builder();
        let bad_index = [[0, 1, 2], [2, count as u32, 1]];
        assert_eq!(
            builder.add_mesh(&vertices, &bad_index, Opacity::Opaque),
            Err(OccludersError::MeshIndex {
                triangle: 1,
                corner: 1,
                index: count as u32,
                vertex_count: count,
            })
        );
        for bad in [f64::NAN, f64::INFINITY, -1.3e30] {
            vertices[4][2] = bad;
            let refused = builder.add_mesh(&vertices, &[[0, 1, 2], [3, 5, 4]], Opacity::Opaque);
            let message = refused.expect_err("a bad vertex").to_string();
            assert!(
                message.starts_with("triangle 1: vertex 4 is ("),
                "{message}"
            );
            // Nobody names it.
            assert_eq!(builder.add_mesh(&vertices, &[], Opacity::Opaque), Ok(0..0));
        }
        assert_eq!(builder.build().surface_count(), 0);
        let mut builder = Occluders::builder();
        let added = builder.add_mesh(&vertices, &[[0, 1, 3]], Opacity::Opaque);
        assert_eq!(added, Ok(0..1), "vertex 4 is nobody's");
    }
}
