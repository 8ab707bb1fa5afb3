//! Tests of the module above.

use std::sync::Arc;

use super::*;
use crate::{Coverage, Opacity};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn scene(faces: &[(&[DVec3], Opacity)]) -> (Occluders, Mesh) {
    let mut builder = Occluders::builder();
    for (outline, opacity) in faces {
        builder.add_face(outline, *opacity).expect("a face");
    }
    let occluders = builder.build();
    let mesh = Mesh::new(&occluders);
    (occluders, mesh)
}

fn opaque(faces: &[&[DVec3]]) -> (Occluders, Mesh) {
    let faces: Vec<_> = faces.iter().map(|&face| (face, Opacity::Opaque)).collect();
    scene(&faces)
}

/// The ends of all contour edges for a light.
fn contours(occluders: &Occluders, mesh: &Mesh, light: LightShape) -> Vec<[DVec3; 2]> {
    let sides = occluders.light_sides(&light);
    let is_contour = |edge: &&MeshEdge| mesh.is_contour(edge, &sides);
    let edges = mesh.edges().iter().filter(is_contour);
    edges.map(|edge| occluders.edge_positions(edge)).collect()
}

/// Faces of the unit cube, each as a quad; `is_turned` says which are wound the other way.
fn cube(is_turned: impl Fn(usize) -> bool) -> (Occluders, Mesh) {
    let corner = |at: usize| v((at & 1) as f64, (at >> 1 & 1) as f64, (at >> 2) as f64);
    let faces = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let faces: Vec<[DVec3; 4]> = (0..)
        .zip(faces)
        .map(|(number, face)| {
            let mut outline = face.map(corner);
            if is_turned(number) {
                outline.reverse();
            }
            outline
        })
        .collect();
    let faces: Vec<&[DVec3]> = faces.iter().map(|face| &face[..]).collect();
    opaque(&faces)
}

#[test]
fn contours_of_a_cube_are_its_silhouette_whatever_the_winding() {
    let corner = LightShape::Point(v(5.0, 6.0, 7.0));
    for is_turned in [|_| false, |_| true, |face| face % 2 == 0, |face| face > 2] {
        let (occluders, mesh) = cube(is_turned);
        // Twelve, and the diagonal of each face.
        assert_eq!(mesh.edges().len(), 18);
        let silhouette = contours(&occluders, &mesh, corner);
        assert_eq!(silhouette.len(), 6);
        // Neither the nearest corner nor the farthest is on it.
        for end in silhouette.iter().flatten() {
            assert!(*end != DVec3::ZERO && *end != DVec3::ONE, "{end}");
        }
        let direction = LightShape::Direction(v(1.0, 2.0, -0.5));
        assert_eq!(contours(&occluders, &mesh, direction).len(), 6);
        // Before one face; inside, from where every face is seen alike.
        let before = LightShape::Point(v(0.4, 0.6, 3.0));
        let around_top = contours(&occluders, &mesh, before);
        assert_eq!(around_top.len(), 4);
        assert!(around_top.iter().flatten().all(|end| end.z == 1.0));
        let inside = LightShape::Point(v(0.4, 0.6, 0.3));
        assert_eq!(contours(&occluders, &mesh, inside), [[DVec3::ZERO; 2]; 0]);
        // In the plane of the top: that is seen edge on, and all its edges may matter.
        let in_plane = LightShape::Point(v(3.0, 0.5, 1.0));
        let ends = contours(&occluders, &mesh, in_plane);
        let of_top = ends
            .iter()
            .filter(|ends| ends.iter().all(|end| end.z == 1.0));
        assert_eq!(of_top.count(), 5);
        // One solid.
        assert!((0..12).all(|face| mesh.component(SurfaceId(face)) == 0));
    }
}

#[test]
fn a_doubled_face_is_one_face() {
    let face = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let turned = [face[2], face[1], face[0]];
    let next = [face[1], v(1.0, 1.0, 0.5), face[2]];
    let light = LightShape::Point(v(0.3, 0.3, 4.0));
    let (once, once_mesh) = opaque(&[&face, &next]);
    let expected = contours(&once, &once_mesh, light);
    assert_eq!(expected.len(), 4);
    for twin in [face, turned, [face[1], face[2], face[0]]] {
        for faces in [[face, twin, next], [face, next, twin], [twin, next, face]] {
            let (occluders, mesh) = opaque(&faces.each_ref().map(|face| &face[..]));
            let mut ends = contours(&occluders, &mesh, light);
            // Corners are numbered in the order that they come in.
            let sorted = |ends: &mut Vec<[DVec3; 2]>| {
                ends.iter_mut().for_each(|ends| {
                    ends.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).expect("numbers"))
                });
                ends.sort_by_key(|ends| format!("{ends:?}"));
            };
            let mut expected = expected.clone();
            sorted(&mut ends);
            sorted(&mut expected);
            assert_eq!(ends, expected);
            // In one plane and one component with its twin.
            let of_face: Vec<u32> = (0..3)
                .filter(|&s| faces[s as usize] != next)
                .map(|s| mesh.flat_group(SurfaceId(s)))
                .collect();
            assert_eq!(of_face[0], of_face[1]);
            assert!((0..3).all(|s| mesh.component(SurfaceId(s)) == 0));
        }
    }
    // Alone all its edges are rims.
    let (occluders, mesh) = opaque(&[&face, &turned]);
    assert_eq!(contours(&occluders, &mesh, light).len(), 3);
}

#[test]
fn an_edge_of_three_faces_is_always_a_contour() {
    let (a, b) = (v(0.0, 0.0, 0.0), v(0.0, 1.0, 0.0));
    let wing = |x: f64, z: f64| [a, b, v(x, 0.5, z)];
    let faces = [wing(1.0, 0.0), wing(-1.0, 0.1), wing(0.2, -1.0)];
    let light = LightShape::Direction(v(0.1, 0.2, 1.0));
    let is_between = |faces: &[&[DVec3]]| {
        let (occluders, mesh) = opaque(faces);
        contours(&occluders, &mesh, light).contains(&[a, b])
    };
    // A roof of two does not end at its ridge, the third wing hangs from it.
    assert!(!is_between(&[&faces[0], &faces[1]]));
    assert!(is_between(&[&faces[0], &faces[1], &faces[2]]));
    assert!(is_between(&[&faces[0]]));
    // A fold that is seen from one side only.
    assert!(is_between(&[&faces[0], &wing(1.0, 0.5)]));
}

#[derive(Debug)]
struct Half;

impl Coverage for Half {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        uv[0] < 0.5
    }
}

#[test]
fn what_does_not_block_everywhere_ends_an_opaque_face() {
    let quad = |x: f64| {
        [
            v(x, 0.0, 0.0),
            v(x + 1.0, 0.0, 0.0),
            v(x + 1.0, 1.0, 0.0),
            v(x, 1.0, 0.0),
        ]
    };
    let seam = [v(1.0, 0.0, 0.0), v(1.0, 1.0, 0.0)];
    let light = LightShape::Point(v(0.5, 0.5, 3.0));
    let has_seam = |occluders: &Occluders, mesh: &Mesh| {
        let ends = contours(occluders, mesh, light);
        ends.iter()
            .any(|ends| seam.iter().all(|end| ends.contains(end)))
    };
    let both = |other| scene(&[(&quad(0.0), Opacity::Opaque), (&quad(1.0), other)]);
    let (occluders, mesh) = both(Opacity::Opaque);
    assert!(!has_seam(&occluders, &mesh));
    let (occluders, mesh) = both(Opacity::Transparent);
    assert!(has_seam(&occluders, &mesh));
    assert_eq!(mesh.component(SurfaceId(0)), 0);
    assert_eq!(mesh.component(SurfaceId(2)), NO_COMPONENT);
    // A pane lies in the plane of the wall around it: neither blocks the other.
    assert_eq!(mesh.flat_group(SurfaceId(0)), mesh.flat_group(SurfaceId(3)));

    let mut builder = Occluders::builder();
    builder
        .add_face(&quad(0.0), Opacity::Opaque)
        .expect("a face");
    let half = builder.add_coverage(Arc::new(Half));
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    builder
        .add_alpha_tested_face(&quad(1.0), &uvs, half)
        .expect("a face");
    let occluders = builder.build();
    let mesh = Mesh::new(&occluders);
    assert!(has_seam(&occluders, &mesh));
    assert_eq!(mesh.component(SurfaceId(3)), NO_COMPONENT);
    // Only the opaque quad has edges: four sides and a diagonal.
    assert_eq!(mesh.edges().len(), 5);
}

#[derive(Debug)]
struct HalfAndSaysSo;

impl Coverage for HalfAndSaysSo {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        uv[0] < 0.5
    }

    fn is_solid_throughout(&self, low: [f64; 2], high: [f64; 2]) -> Option<bool> {
        match (self.is_solid_at(low), self.is_solid_at(high)) {
            (false, _) => Some(false),
            (true, true) => Some(true),
            (true, false) => None,
        }
    }
}

#[test]
fn an_alpha_tested_triangle_without_holes_is_opaque_and_one_of_holes_only_is_not_there() {
    let corners = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
    let light = LightShape::Direction(v(0.0, 0.0, 1.0));
    for (least, is_opaque, is_whole) in [(0.0, true, true), (0.4, true, false), (0.6, false, false)]
    {
        let mut builder = Occluders::builder();
        let half = builder.add_coverage(Arc::new(HalfAndSaysSo));
        let uvs = [[least, 0.0], [least + 0.3, 0.0], [least, 1.0]];
        builder
            .add_alpha_tested_face(&corners, &uvs, half)
            .expect("a face");
        let occluders = builder.build();
        let surface = SurfaceId(0);
        assert_eq!(occluders.is_opaque(surface), is_opaque, "{least}");
        assert_eq!(occluders.is_opaque_everywhere(surface), is_whole, "{least}");
        for x in [0.1, 0.3, 0.6] {
            let start = crate::ReceiverPoint {
                point: v(x, 0.3, -1.0),
                surface: None,
            };
            let segment = occluders.segment(&start, &light);
            let is_there = least + 0.3 * x < 0.5;
            assert_eq!(occluders.blocks(surface, &segment), is_there, "{least} {x}");
            assert_eq!(
                occluders.crosses(surface, &segment),
                is_there,
                "{least} {x}"
            );
        }
    }
}

#[test]
fn flat_groups_hold_what_lies_exactly_in_one_plane() {
    let quad = [
        v(0.0, 0.0, 0.0),
        v(1.0, 0.0, 0.1),
        v(1.0, 1.0, 0.1),
        v(0.0, 1.0, 0.0),
    ];
    let group = |faces: &[&[DVec3]]| {
        let (occluders, mesh) = opaque(faces);
        let groups = (0..occluders.triangle_count() as u32).map(|s| mesh.flat_group(SurfaceId(s)));
        groups.collect::<Vec<_>>()
    };
    // Its two triangles; another quad in the plane that it does not touch stays apart.
    let moved = quad.map(|corner| corner + v(0.0, 3.0, 0.0));
    assert_eq!(group(&[&quad, &moved]), [0, 0, 2, 2]);
    // A corner that is off by the last bit.
    let mut bent = [quad[0], quad[1], quad[3], quad[2]].map(|corner| corner * 3.0);
    let flat = [[bent[0], bent[1], bent[3]], [bent[0], bent[3], bent[2]]];
    assert_eq!(group(&[&flat[0], &flat[1]]), [0, 0]);
    bent[2].z = bent[2].z.next_up();
    let folded = [[bent[0], bent[1], bent[3]], [bent[0], bent[3], bent[2]]];
    assert_eq!(group(&[&folded[0], &folded[1]]), [0, 1]);
    // Without area there is no plane.
    let line = [quad[0], quad[1], quad[0] + 2.0 * (quad[1] - quad[0])];
    assert_eq!(group(&[&quad, &line]), [0, 0, 2]);
}
