//! What tests share: random numbers, the methods, lamps, an index whose values tell starts in every way.

#![allow(dead_code, reason = "each file of tests uses some of it")]

pub(crate) mod nasty;

use std::sync::Arc;

use antumbra::{Builder, Counters, LightId, Method, Refine, Refinement, Shadow, ShadowIndex};
use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, OccludersBuilder, Opacity, ReceiverPoint,
};

/// SplitMix64: enough for tests, the same everywhere.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// A point of `[-1, 1]^3`.
    pub(crate) fn in_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.real(-1.0, 1.0)))
    }

    /// A point of `[0, 1]^3`.
    pub(crate) fn in_unit_cube(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.unit()))
    }
}

pub(crate) const METHODS: [Method; 6] = [
    Method::Auto,
    Method::Voxel1990,
    Method::Voxel,
    Method::Grid,
    Method::Bvh,
    Method::Naive,
];

/// The lamps of a hall.
pub(crate) fn lamps() -> Vec<LightShape> {
    vec![
        LightShape::Point(DVec3::new(0.5, -0.7, 3.5)),
        LightShape::Direction(DVec3::new(0.3, 0.5, 1.0)),
        // Under the floor.
        LightShape::Point(DVec3::new(0.0, 1.0, -2.0)),
    ]
}

pub(crate) fn add_face(builder: &mut OccludersBuilder, corners: &[DVec3]) {
    builder.add_face(corners, Opacity::Opaque).expect("a face");
}

/// Adds a pane of glass to a hall.
pub(crate) fn add_pane(builder: &mut OccludersBuilder) {
    let pane = [(-3.0, 1.0), (3.0, 1.0), (3.0, 2.5), (-3.0, 2.5)];
    let corners = pane.map(|(x, z)| DVec3::new(x, 1.5, z));
    builder
        .add_face(&corners, Opacity::Transparent)
        .expect("a face");
}

/// Adds a closed cone and a disk to a hall.
pub(crate) fn add_cone_and_disk(builder: &mut OccludersBuilder, foot: f64) {
    let cone = Cone {
        base: DVec3::new(-2.0, 2.5, foot),
        base_radius: 0.5,
        apex: DVec3::new(-2.0, 2.3, 1.5),
        apex_radius: 0.2,
        is_closed: true,
    };
    builder.add_cone(cone, Opacity::Opaque).expect("a cone");
    let disk = Disk {
        center: DVec3::new(1.0, -2.0, 2.5),
        normal: DVec3::new(0.2, 0.1, 1.0),
        radius: 0.6,
    };
    builder.add_disk(disk, Opacity::Opaque).expect("a disk");
}

/// Coarse enough that starts are told in every way.
pub(crate) fn builder_of(
    occluders: &Arc<Occluders>,
    lights: &[LightShape],
    method: Method,
) -> Builder {
    let refinement = Refinement {
        resolution: 64,
        space_resolution: 32,
        short_list: 2,
        space_list: 4,
        long_list: 8,
        refine: Refine::Eager,
        ..Refinement::default()
    };
    ShadowIndex::builder(Arc::clone(occluders), lights.to_vec())
        .method(method)
        .refinement(refinement)
}

pub(crate) fn is_shadowed(index: &ShadowIndex, start: &ReceiverPoint, light: usize) -> bool {
    let answer = index.shadow(start, LightId::from_index(light), &mut Counters::default());
    answer.expect("a fine query").shadow == Shadow::Shadowed
}
