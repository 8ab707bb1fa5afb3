//! Queries as Embree takes them.

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};

use crate::{Batch, TargetBatch};

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

/// `RTCRay8` or `RTCRay16`: the members of so many rays side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Rays<const N: usize> {
    pub(super) origin: [[f32; N]; 3],
    pub(super) near: [f32; N],
    pub(super) direction: [[f32; N]; 3],
    pub(super) time: [f32; N],
    pub(super) far: [f32; N],
    pub(super) mask: [u32; N],
    pub(super) id: [u32; N],
    pub(super) flags: [u32; N],
}

/// Mask of a packet's rays: -1 for one that is there, else 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Valid<const N: usize>(pub(super) [i32; N]);

/// Packet of `N` rays, some of which may be absent at a batch's end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packet<const N: usize> {
    pub(super) rays: Rays<N>,
    pub(super) valid: Valid<N>,
}

const _: () = assert!(
    size_of::<RayToLight>() == 48 && size_of::<Rays<8>>() == 384 && size_of::<Rays<16>>() == 768
);

/// Converts a batch; `lift` moves starts on surfaces towards the light's side.
pub(super) fn rays_of(batch: &Batch, lift: f64) -> impl Iterator<Item = RayToLight> {
    let light = batch.light_shape;
    let starts = batch.starts.iter().zip(&batch.normals);
    starts.map(move |(start, &normal)| ray(start, lift * normal, &light))
}

/// Converts a batch of starts with targets: those of a start side by side.
pub(super) fn rays_to(batch: &TargetBatch, lift: f64) -> impl Iterator<Item = RayToLight> {
    let starts = batch.starts.iter().zip(&batch.normals);
    let targets = batch.targets.chunks(batch.per_start.max(1));
    starts
        .zip(targets)
        .flat_map(move |((start, &normal), targets)| {
            let ray = move |target| ray(start, lift * normal, target);
            targets.iter().map(ray)
        })
}

fn ray(start: &ReceiverPoint, lift: DVec3, light: &LightShape) -> RayToLight {
    let origin = (start.point + lift).as_vec3();
    let (direction, far) = match *light {
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
}

impl<const N: usize> Packet<N> {
    /// Packs one to `N` rays.
    pub(super) fn of(rays: &[RayToLight]) -> Self {
        // Lanes that are not there repeat the last ray.
        let ray = |lane: usize| &rays[lane.min(rays.len() - 1)];
        let lanes = |of: &dyn Fn(&RayToLight) -> f32| std::array::from_fn(|lane| of(ray(lane)));
        Self {
            rays: Rays {
                origin: std::array::from_fn(|axis| lanes(&|ray| ray.origin[axis])),
                near: lanes(&|ray| ray.near),
                direction: std::array::from_fn(|axis| lanes(&|ray| ray.direction[axis])),
                time: [0.0; N],
                far: lanes(&|ray| ray.far),
                mask: [u32::MAX; N],
                id: [0; N],
                flags: [0; N],
            },
            valid: Valid(std::array::from_fn(|lane| -i32::from(lane < rays.len()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_end_at_the_light_and_packets_know_their_length() {
        let batch = Batch {
            light: 0,
            light_shape: LightShape::Point(DVec3::new(0.0, 0.0, 4.0)),
            starts: (0..3)
                .map(|i| ReceiverPoint {
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
        let packet = Packet::<8>::of(&rays);
        assert_eq!(packet.valid.0, [-1, -1, -1, 0, 0, 0, 0, 0]);
        assert_eq!(packet.rays.origin[0][..4], [0.0, 1.0, 2.0, 2.0]);
    }
}
