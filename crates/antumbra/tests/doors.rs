//! The short ways to ask: one bit a question, ids in slices, and a renderer's rays many at a time. They answer what the
//! long ways do.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use antumbra::{
    AnyHit, Batch, Counters, DVec3, LightId, LightShape, Method, Occluders, Opacity, QueryError,
    ReceiverPoint, Refine, Refinement, ShadowIndex, SurfaceId,
};
use antumbra_geometry::Precision;

use common::{METHODS, Random, add_cone_and_disk, add_pane, builder_of, is_shadowed, lamps};

fn scene() -> Arc<Occluders> {
    let random = &mut Random(11);
    let mut builder = Occluders::builder();
    let floor = [
        [-4.0, -4.0, 0.0],
        [4.0, -4.0, 0.0],
        [4.0, 4.0, 0.0],
        [-4.0, 4.0, 0.0_f32],
    ];
    builder
        .add_mesh(&floor, &[[0, 1, 2], [0, 2, 3]], Opacity::Opaque)
        .expect("a floor");
    for _ in 0..60 {
        let middle = DVec3::new(0.0, 0.0, 1.5) + DVec3::new(3.5, 3.5, 1.0) * random.in_cube();
        let corners = [(); 3].map(|()| (middle + 0.5 * random.in_cube()).to_array());
        builder
            .add_mesh(&corners, &[[0, 1, 2]], Opacity::Opaque)
            .expect("a leaf");
    }
    add_pane(&mut builder);
    add_cone_and_disk(&mut builder, 0.2);
    Arc::new(builder.build())
}

fn starts(occluders: &Occluders, count: usize) -> Vec<ReceiverPoint> {
    let random = &mut Random(5);
    let mut all = Vec::new();
    for number in 0..count {
        let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
        let bounds = occluders.surface_bounds(surface);
        all.push(ReceiverPoint {
            point: bounds.min + random.in_unit_cube() * bounds.size(),
            surface: (number % 4 > 0).then_some(surface),
        });
    }
    all
}

#[test]
fn one_bit_is_the_answer_of_a_query() {
    let occluders = scene();
    let (mut on_surface, mut off_surface) = (0, 0);
    for method in METHODS {
        let index = builder_of(&occluders, &lamps(), method)
            .build()
            .expect("an index");
        for start in starts(&occluders, 500) {
            for light in index.light_ids() {
                let expected = is_shadowed(&index, &start, light.index());
                let Some(surface) = start.surface else {
                    let found = index.is_occluded_at(start.point.to_array(), light);
                    assert_eq!(found, Ok(expected), "{method:?} {start:?}");
                    continue;
                };
                let found = index.is_occluded(start.point, surface, light);
                if occluders.is_on(surface, start.point, Precision::Single) {
                    assert_eq!(found, Ok(expected), "{method:?} {start:?}");
                    on_surface += 1;
                } else {
                    // Another question was meant than the one that would be answered.
                    let is_refused = matches!(found, Err(QueryError::OffSurface { .. }));
                    assert!(is_refused, "{method:?} {start:?} {found:?}");
                    off_surface += 1;
                }
            }
        }
    }
    assert!(
        on_surface > 100 && off_surface > 100,
        "{on_surface} {off_surface}"
    );
    let index = builder_of(&occluders, &lamps(), Method::Auto)
        .build()
        .expect("an index");
    let above = index.is_occluded([0.5_f32, 0.25, 5.0], 0, 1);
    let told = above.expect_err("5 above the floor").to_string();
    assert!(told.contains("away from surface 0"), "{told}");
    let at = [0.5_f32, 0.25, 0.0];
    assert_eq!(
        index.is_occluded(at, 0, 1),
        index.is_occluded(at, SurfaceId(0), 1)
    );
    assert_eq!(
        index.is_occluded_at(at, 3),
        Err(QueryError::UnknownLight(LightId(3)))
    );
    let surface_count = occluders.surface_count() as u32;
    assert_eq!(
        index.is_occluded(at, surface_count, 0),
        Err(QueryError::UnknownSurface(surface_count))
    );
    let nowhere = index.is_occluded_at([f32::NAN, 0.0, 0.0], 0);
    assert!(matches!(nowhere, Err(QueryError::BadPoint(_))));
}

#[test]
fn surfaces_are_named_by_id_or_number() {
    let occluders = scene();
    let index = builder_of(&occluders, &lamps(), Method::Auto)
        .build()
        .expect("an index");
    // On the half of the floor that is triangle 0.
    let points: Vec<[f64; 3]> = (0..400)
        .map(|i| {
            [
                f64::from(i % 20) / 4.0 - 1.0,
                f64::from(i / 20) / 7.0 - 3.9,
                0.0,
            ]
        })
        .collect();
    let ids = vec![SurfaceId(0); points.len()];
    let numbers = vec![0_u32; points.len()];
    let [mut by_id, mut by_number] = [(); 2].map(|()| vec![9; 2 * points.len()]);
    index
        .occluded(
            &Batch::on_surfaces(&points, &ids),
            &[LightId(0), LightId(1)],
            &mut by_id,
        )
        .expect("a fine batch");
    index
        .occluded(
            &Batch::on_surfaces(&points, &numbers),
            &[LightId(0), LightId(1)],
            &mut by_number,
        )
        .expect("a fine batch");
    assert_eq!(by_id, by_number);
    assert!(by_id.contains(&0) && by_id.contains(&1));
}

/// Exact rays, which count how they are asked.
struct Theirs<'a> {
    occluders: &'a Occluders,
    is_batched: bool,
    single: AtomicUsize,
    batched: AtomicUsize,
    largest: AtomicUsize,
}

impl Theirs<'_> {
    fn trace(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
        let segment = self.occluders.segment(start, light);
        let mut surfaces = self.occluders.surfaces();
        surfaces.any(|surface| self.occluders.blocks(surface, &segment))
    }
}

impl AnyHit for Theirs<'_> {
    fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
        self.single.fetch_add(1, Ordering::Relaxed);
        self.trace(start, light)
    }

    fn are_occluded(&self, starts: &[ReceiverPoint], light: &LightShape, is_occluded: &mut [bool]) {
        assert_eq!(starts.len(), is_occluded.len());
        if !self.is_batched {
            for (start, is_occluded) in starts.iter().zip(is_occluded) {
                *is_occluded = self.is_blocked(start, light);
            }
            return;
        }
        self.batched.fetch_add(starts.len(), Ordering::Relaxed);
        self.largest.fetch_max(starts.len(), Ordering::Relaxed);
        for (start, is_occluded) in starts.iter().zip(is_occluded) {
            *is_occluded = self.trace(start, light);
        }
    }
}

#[test]
fn rays_of_a_renderer_are_asked_together_and_answer_alike() {
    let occluders = scene();
    let starts = starts(&occluders, 3_000);
    for method in METHODS {
        let refinement = Refinement {
            resolution: 16,
            space_resolution: 16,
            long_list: 0,
            short_list: 0,
            space_list: 0,
            refine: Refine::Lazy,
            ..Refinement::default()
        };
        let index = ShadowIndex::builder(Arc::clone(&occluders), lamps())
            .method(method)
            .refinement(refinement)
            .build()
            .expect("an index");
        index.set_refining(false);
        let rays = |is_batched| Theirs {
            occluders: &occluders,
            is_batched,
            single: AtomicUsize::new(0),
            batched: AtomicUsize::new(0),
            largest: AtomicUsize::new(0),
        };
        let (together, alone) = (rays(true), rays(false));
        for light in 0..lamps().len() {
            let ask = |rays: &Theirs<'_>| {
                let mut found = vec![false; starts.len()];
                let mut counters = Counters::default();
                index
                    .with_rays(rays)
                    .shadows(
                        &starts,
                        LightId::from_index(light),
                        &mut found,
                        &mut counters,
                    )
                    .expect("fine queries");
                (found, counters)
            };
            let expected: Vec<bool> = starts
                .iter()
                .map(|start| is_shadowed(&index, start, light))
                .collect();
            let (found, counters) = ask(&together);
            assert!(found == expected, "{method:?}");
            assert_eq!(ask(&alone), (found, counters), "{method:?}");
            let shadow = counters.shadow;
            let shadowed = expected.iter().filter(|&&is_shadowed| is_shadowed);
            assert_eq!(shadow.shadowed, shadowed.count() as u64, "{method:?}");
            let all = shadow.first_pass + shadow.blocker_list + shadow.rays + shadow.intermediate;
            assert_eq!(all, starts.len() as u64, "{method:?}");
        }
        assert!(together.largest.into_inner() > 100, "{method:?}");
        assert_eq!(together.single.into_inner(), 0, "{method:?}");
        assert_eq!(
            together.batched.into_inner(),
            alone.single.into_inner(),
            "{method:?}"
        );
    }
}
