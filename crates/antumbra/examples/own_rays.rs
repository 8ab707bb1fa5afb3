//! A renderer's own rays behind antumbra's values: `cargo run --release -p antumbra --example own_rays`.

use std::{error::Error, sync::Arc};

use antumbra::{
    AnyHit, Batch, DVec3, LightId, LightShape, Method, Occluders, Opacity, ReceiverPoint,
    Refinement, ShadowIndex,
};

/// What the renderer has: triangles, and a ray that tests them all (Möller and Trumbore 1997).
struct Renderer(Vec<[DVec3; 3]>);

impl AnyHit for Renderer {
    fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
        let direction = light.towards(start.point);
        let (_, weight) = light.homogeneous();
        let end = if weight == 0.0 { f64::MAX } else { 1.0 };
        self.0.iter().any(|&[a, b, c]| {
            let across = direction.cross(c - a);
            let from = (start.point - a) / across.dot(b - a);
            let (u, v) = (from.dot(across), from.cross(b - a).dot(direction));
            let distance = from.cross(b - a).dot(c - a);
            // The usual offset: what this ray answers is not exact.
            u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 1e-6 && distance < end
        })
    }
}

#[expect(clippy::print_stdout, reason = "its output is what it is for")]
fn main() -> Result<(), Box<dyn Error>> {
    // Slats over a floor, under a lamp.
    let v = DVec3::new;
    let slat = |x| [v(x, -2.0, 1.0), v(x, 2.0, 1.0), v(x + 0.5, 0.0, 1.2)];
    let floor = [v(-9.0, -9.0, 0.0), v(9.0, -9.0, 0.0), v(0.0, 9.0, 0.0)];
    let renderer = Renderer(vec![floor, slat(-2.0), slat(-1.0), slat(0.5)]);
    let mut surfaces = Occluders::builder();
    for triangle in &renderer.0 {
        surfaces.add_face(triangle, Opacity::Opaque)?;
    }
    let lamp = LightShape::Point(v(0.0, 0.0, 8.0));
    let mut refinement = Refinement::default();
    (refinement.short_list, refinement.long_list) = (0, 0);
    let index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![lamp])
        .method(Method::Voxel)
        .refinement(refinement)
        .without_tree()
        .build()?;

    let along = |i: u16| f32::from(i) / 60.0 - 2.5;
    let point = |i: u16| [along(i % 250), along(i / 250), 0.0];
    let points: Vec<[f32; 3]> = (0..62_500).map(point).collect();
    let floor = vec![0; points.len()];
    let batch = Batch::on_surfaces(&points, &floor);
    let mut is_shadowed = vec![0; points.len()];
    let index = index.with_rays(&renderer);
    let counted = index.occluded(&batch, &[LightId(0)], &mut is_shadowed)?;
    println!("{:?}", counted.counters.shadow);
    Ok(())
}
