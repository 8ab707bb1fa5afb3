//! Contours of surfaces as a light sees them.

use antumbra_geometry::{DVec3, ElementId, LightShape, Mesh, Occluders, SurfaceId};

use crate::commands::verify::surfaces::Surfaces;

/// What casts edges of shadows.
pub(super) struct Outlines {
    pub(super) mesh: Mesh,
    /// For each light the edges that may cast one.
    pub(super) contours: Vec<Vec<u32>>,
    /// For each light the few edges closest to it: as large as others, seen from there.
    pub(super) closest: Vec<Vec<u32>>,
    /// One surface of each element that is no face.
    pub(super) curved: Vec<SurfaceId>,
}

impl Outlines {
    pub(super) fn new(surfaces: &Surfaces<'_>, lights: &[LightShape]) -> Self {
        let occluders = surfaces.gathered.occluders();
        let mesh = Mesh::new(occluders);
        let contours: Vec<Vec<u32>> = lights
            .iter()
            .map(|light| {
                let sides = occluders.light_sides(light);
                (0..)
                    .zip(mesh.edges())
                    .filter(|(_, edge)| mesh.is_contour(edge, &sides))
                    .map(|(number, _)| number)
                    .collect()
            })
            .collect();
        let closest = lights
            .iter()
            .zip(&contours)
            .map(|(light, contours)| closest(light, contours, &mesh, occluders))
            .collect();
        let curved = (0..occluders.elements().len() as u32)
            .map(ElementId)
            .filter(|&element| !occluders.is_face(element))
            .filter_map(|element| occluders.surfaces_of(element).next())
            .collect();
        Self {
            mesh,
            contours,
            closest,
            curved,
        }
    }
}

/// Returns a few edges that are the closest to a light.
pub(super) fn closest(
    light: &LightShape,
    contours: &[u32],
    mesh: &Mesh,
    occluders: &Occluders,
) -> Vec<u32> {
    const COUNT: usize = 8;
    let LightShape::Point(light) = *light else {
        return Vec::new();
    };
    let mut all: Vec<(f64, u32)> = contours
        .iter()
        .map(|&number| {
            let ends = occluders.edge_positions(&mesh.edges()[number as usize]);
            ((foot(light, ends) - light).length(), number)
        })
        .collect();
    all.sort_unstable_by(|first, second| first.0.total_cmp(&second.0));
    all.truncate(COUNT);
    all.into_iter().map(|(_, number)| number).collect()
}

/// Returns the point of an edge closest to another point.
pub(super) fn foot(point: DVec3, [from, to]: [DVec3; 2]) -> DVec3 {
    let along = to - from;
    let share = (point - from).dot(along) / along.length_squared();
    if share.is_nan() {
        return from;
    }
    from + share.clamp(0.0, 1.0) * along
}
