//! Tetra: a tetrahedron of tetrahedra, four halved copies at every level.
//!
//! In: the size. Out: 4^size triangles and one light. The paper's Tetra is size 6: 4096
//! triangles that touch in edges and corners, the case where voxel occlusion loses.

use antumbra_geometry::DVec3;

use crate::{
    defaults::nff_material,
    model::{Object, Polygon, Scene, Shape},
};

use super::{GenerateError, check_size, stage};

/// The largest size: 4^11, four million triangles.
const LARGEST: u32 = 11;

/// The corners of a cube, every second one: a tetrahedron's, and the way to its four quarters.
const CORNERS: [DVec3; 4] = [
    DVec3::new(-1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(1.0, 1.0, 1.0),
];

/// The tetrahedron's faces, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 1, 2], [3, 2, 1], [2, 3, 0], [1, 0, 3]];

/// Makes the scene of SPD's `tetra -s size`.
///
/// # Errors
/// The size is not from 1 to 11.
pub fn tetra(size: u32) -> Result<Scene, GenerateError> {
    check_size("tetra", size, 1..=LARGEST)?;
    let mut scene = stage(
        DVec3::new(1.022846, -3.177154, -2.174512),
        DVec3::new(-0.004103, -0.004103, 0.216539),
        DVec3::new(-0.816497, -0.816497, 0.816497),
        &[DVec3::new(2.0, -18.0, -5.0)],
    );
    scene
        .materials
        .push(nff_material([1.0, 0.2, 0.2, 1.0, 0.0, 100_000.0, 0.0, 0.0]));
    scene.objects.reserve_exact(4_usize.pow(size));
    divide(&mut scene.objects, size, DVec3::ZERO, 1.0);
    Ok(scene)
}

/// Adds the tetrahedra in the cube around `center` whose edge is twice `reach`.
fn divide(objects: &mut Vec<Object>, levels: u32, center: DVec3, reach: f64) {
    if levels > 1 {
        for corner in CORNERS {
            divide(
                objects,
                levels - 1,
                center + corner * reach / 2.0,
                reach / 2.0,
            );
        }
        return;
    }
    let corners = CORNERS.map(|corner| center + corner * reach);
    for face in FACES {
        let vertices = face.map(|i| corners[i]).to_vec();
        let shape = Shape::Polygon(Polygon {
            vertices,
            normals: Vec::new(),
        });
        objects.push(Object {
            name: String::new(),
            shape,
            material: 0,
        });
    }
}
