//! Tests of how often single queries read the clock.

use std::sync::Arc;

use antumbra_geometry::{
    AreaShape, DVec3, LightShape, Occluders, Opacity, ReceiverPoint, SphereLight,
};

use crate::clock::READ;
use crate::{Counters, LightSamples, LightSampling, ReceiverSide, ShadowIndex};

/// A reading is a system call, which takes as long as several rays: a renderer that asks one by one must not pay it
/// with each query.
#[test]
fn single_queries_seldom_read_the_clock() {
    let corners = |size: f64, z: f64| [[-size, -size, z], [size, -size, z], [0.0, size, z]];
    let mut surfaces = Occluders::builder();
    let floor = surfaces
        .add_mesh(&corners(9.0, 0.0), &[[0, 1, 2]], Opacity::Opaque)
        .unwrap();
    surfaces
        .add_mesh(&corners(1.0, 2.0), &[[0, 1, 2]], Opacity::Opaque)
        .unwrap();
    let lights = vec![LightShape::Point(DVec3::new(0.5, 0.0, 4.0)); 20];
    let index = ShadowIndex::builder(Arc::new(surfaces.build()), lights)
        .build()
        .unwrap();
    let lamp = AreaShape::Sphere(SphereLight::new(DVec3::new(0.5, 0.0, 4.0), 0.2).unwrap());
    let sampling = LightSampling {
        samples: 16,
        seed: 0,
        light: 0,
    };

    const COUNT: u64 = 16_384;
    let start = |number: u64| ReceiverPoint {
        point: DVec3::new(number as f64 / COUNT as f64 - 0.5, 0.25, 0.0),
        surface: Some(floor.start.into()),
    };
    let mut counters = Counters::default();
    let (mut samples, mut visible) = (LightSamples::default(), [0]);
    let mut in_turn = index.lights_in_turn();
    let reads = |ask: &mut dyn FnMut(u64)| {
        let before = READ.get();
        (0..COUNT).for_each(ask);
        READ.get() - before
    };
    let hard = reads(&mut |number| {
        let id = index.light_ids().next().unwrap();
        index
            .shadow(&start(number), id, &mut Counters::default())
            .unwrap();
    });
    let side = ReceiverSide::Front;
    let soft = reads(&mut |number| {
        index
            .sample_light(
                &start(number),
                side,
                &lamp,
                number,
                &sampling,
                &mut samples,
                &mut counters,
            )
            .unwrap();
    });
    let all = reads(&mut |number| {
        index
            .lights_visible_of(
                &[start(number)],
                side,
                &mut visible,
                &mut Counters::default(),
            )
            .unwrap();
    });
    let turns = reads(&mut |number| {
        in_turn
            .ask(&start(number), side, &[], &mut Counters::default())
            .unwrap();
    });
    for (name, reads) in [
        ("hard", hard),
        ("soft", soft),
        ("all", all),
        ("turns", turns),
    ] {
        assert!(reads > 0, "{name}: nothing is timed");
        assert!(reads <= COUNT / 8, "{name}: {reads} of {COUNT}");
    }
}
