//! Queries as Embree takes them.

use antumbra_geometry::LightShape;

use crate::Batch;

/// `RTCRay`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct RayToLight {
    pub(super) origin: [f32; 3],
    pub(super) near: f32,
    pub(super) direction: [f32; 3],
    pub(super) time: f32,
    /// Negative infinity afterwards if something is in between.
    pub(super) far: f32,
    pub(super) mask: u32,
    pub(super) id: u32,
    pub(super) flags: u32,
}

/// `RTCRay8`: the members of eight rays side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Rays8 {
    pub(super) origin: [[f32; 8]; 3],
    pub(super) near: [f32; 8],
    pub(super) direction: [[f32; 8]; 3],
    pub(super) time: [f32; 8],
    pub(super) far: [f32; 8],
    pub(super) mask: [u32; 8],
    pub(super) id: [u32; 8],
    pub(super) flags: [u32; 8],
}

/// Which of eight rays are there: -1, else 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Valid8(pub(super) [i32; 8]);

/// Eight rays, or the fewer at a batch's end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packet {
    pub(super) rays: Rays8,
    pub(super) valid: Valid8,
}

const _: () = assert!(size_of::<RayToLight>() == 48 && size_of::<Rays8>() == 384);

/// Converts a batch; `lift` moves starts on surfaces towards the light's side.
pub(super) fn rays_of(batch: &Batch, lift: f64) -> impl Iterator<Item = RayToLight> {
    let light = batch.light_shape;
    batch
        .starts
        .iter()
        .zip(&batch.normals)
        .map(move |(start, &normal)| {
            let origin = (start.point + lift * normal).as_vec3();
            let (direction, far) = match light {
                LightShape::Point(position) => ((position - origin.as_dvec3()).as_vec3(), 1.0),
                LightShape::Direction(direction) => (direction.as_vec3(), f32::INFINITY),
            };
            RayToLight {
                origin: origin.to_array(),
                near: 0.0,
                direction: direction.to_array(),
                time: 0.0,
                far,
                mask: u32::MAX,
                id: 0,
                flags: 0,
            }
        })
}

impl Packet {
    /// Packs one to eight rays.
    pub(super) fn of(rays: &[RayToLight]) -> Self {
        // Lanes that are not there repeat the last ray.
        let ray = |lane: usize| &rays[lane.min(rays.len() - 1)];
        let lanes = |of: &dyn Fn(&RayToLight) -> f32| std::array::from_fn(|lane| of(ray(lane)));
        Self {
            rays: Rays8 {
                origin: std::array::from_fn(|axis| lanes(&|ray| ray.origin[axis])),
                near: lanes(&|ray| ray.near),
                direction: std::array::from_fn(|axis| lanes(&|ray| ray.direction[axis])),
                time: [0.0; 8],
                far: lanes(&|ray| ray.far),
                mask: [u32::MAX; 8],
                id: [0; 8],
                flags: [0; 8],
            },
            valid: Valid8(std::array::from_fn(|lane| -i32::from(lane < rays.len()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_geometry::{DVec3, Start};

    #[test]
    fn rays_end_at_the_light_and_packets_know_their_length() {
        let batch = Batch {
            light: 0,
            light_shape: LightShape::Point(DVec3::new(0.0, 0.0, 4.0)),
            starts: (0..3)
                .map(|i| Start {
                    point: DVec3::new(f64::from(i), 0.0, 0.0),
                    surface: None,
                })
                .collect(),
            normals: vec![DVec3::Z; 3],
            is_coherent: false,
        };
        let rays: Vec<_> = rays_of(&batch, 0.5).collect();
        assert_eq!(rays[1].origin, [1.0, 0.0, 0.5]);
        assert_eq!(rays[1].direction, [-1.0, 0.0, 3.5]);
        assert_eq!(rays[1].far, 1.0);
        let packet = Packet::of(&rays);
        assert_eq!(packet.valid.0, [-1, -1, -1, 0, 0, 0, 0, 0]);
        assert_eq!(packet.rays.origin[0][..4], [0.0, 1.0, 2.0, 2.0]);
    }
}
