//! What is asked of points that are meant to lie on surfaces: tolerances, ties, named surfaces, starts off them.

#[path = "../common/mod.rs"]
mod common;
mod nearest_page;
mod off_starts;
mod off_surfaces;

use std::sync::Arc;

use antumbra::{Batch, BatchError, Coordinates, GridResolution, LightId, Method, ShadowIndex};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity};

const UP: LightShape = LightShape::Direction(DVec3::Z);

/// Map coordinates of Munich.
const MUNICH: [f64; 3] = [691_000.0, 5_334_000.0, 520.0];

fn scene(faces: &[&[[f64; 3]]]) -> Arc<Occluders> {
    let mut builder = Occluders::builder();
    for face in faces {
        let corners: Vec<DVec3> = face.iter().map(|&x| DVec3::from_array(x)).collect();
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    Arc::new(builder.build())
}

fn index_of(occluders: &Arc<Occluders>, lights: &[LightShape], method: Method) -> ShadowIndex {
    ShadowIndex::builder(Arc::clone(occluders), lights.to_vec())
        .method(method)
        .grid(GridResolution::Fixed([8; 3]))
        .build()
        .expect("an index")
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn narrow(point: [f64; 3]) -> [f32; 3] {
    point.map(|x| x as f32)
}

fn ask<P: Coordinates>(index: &ShadowIndex, batch: &Batch<P>) -> Result<Vec<bool>, BatchError> {
    let mut out = vec![7; batch.points.len()];
    index.occluded(batch, &[LightId(0)], &mut out)?;
    Ok(out.iter().map(|&byte| byte == 1).collect())
}

fn on_nearest<P: Coordinates>(
    index: &ShadowIndex,
    point: P,
    normal: Option<P>,
) -> Result<bool, BatchError> {
    let (points, normals) = ([point], normal.map(|normal| [normal]));
    let normals = normals.as_ref().map(|normals| &normals[..]);
    ask(index, &Batch::on_nearest(&points, normals)).map(|answers| answers[0])
}
