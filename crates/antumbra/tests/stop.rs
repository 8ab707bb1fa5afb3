//! Long calls that are stopped: soon, and without harm to the index.

use std::sync::Arc;
use std::time::{Duration, Instant};

use antumbra::{Batch, LightId, Method, RayBatch, Refine, Refinement, ShadowIndex, Stopped, Task};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity};

/// A second is promised. As much again is for machines that do much else.
const PROMISED: Duration = Duration::from_secs(2);

/// Waves of `2 n^2` triangles over `[-1, 1]^2`.
fn waves(n: u32) -> Arc<Occluders> {
    let at = |i: u32, j: u32| {
        let [x, y] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(n) - 1.0);
        DVec3::new(x, y, 0.2 * (9.0 * x).sin() * (7.0 * y).cos())
    };
    let mut builder = Occluders::builder();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        for corners in [[a, b, c], [a, c, d]] {
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
        }
    }
    Arc::new(builder.build())
}

fn lights(count: usize) -> Vec<LightShape> {
    let at = |number: usize| {
        let angle = number as f64;
        DVec3::new(2.0 * angle.cos(), 2.0 * angle.sin(), 0.7)
    };
    (0..count)
        .map(|number| LightShape::Point(at(number)))
        .collect()
}

fn points(occluders: &Occluders, count: usize) -> (Vec<[f64; 3]>, Vec<u32>) {
    let triangle_count = occluders.triangle_count();
    let surfaces: Vec<u32> = (0..count)
        .map(|number| (number * 7919 % triangle_count) as u32)
        .collect();
    let middle = |&surface: &u32| {
        let corners = occluders.triangle_positions(antumbra_geometry::SurfaceId(surface));
        let [a, b, c] = corners.expect("a triangle");
        ((a + b + c) / 3.0).to_array()
    };
    (surfaces.iter().map(middle).collect(), surfaces)
}

/// Stops the work after some time; returns its outcome, and how long it went on.
fn stopped_after<T>(wait: Duration, work: impl FnOnce() -> T) -> (Result<T, Stopped>, Duration) {
    let task = Task::default();
    std::thread::scope(|scope| {
        let stopper = scope.spawn(|| {
            std::thread::sleep(wait);
            task.stop();
            Instant::now()
        });
        let done = task.run(work);
        let end = Instant::now();
        let stopped = stopper.join().expect("it waits only");
        (done, end.saturating_duration_since(stopped))
    })
}

#[test]
fn an_index_that_was_stopped_anywhere_answers_right_and_goes_on_learning() {
    let occluders = waves(30);
    let lights = lights(3);
    let all = [0, 1, 2].map(LightId);
    let (points, surfaces) = points(&occluders, 3_000);
    let batch = Batch::on_surfaces(&points, &surfaces);
    let answers = |index: &ShadowIndex| {
        let mut answers = vec![0; points.len() * all.len()];
        index.occluded(&batch, &all, &mut answers).expect("answers");
        answers
    };
    let index = |refine| {
        let refinement = Refinement {
            resolution: 256,
            refine,
            ..Refinement::default()
        };
        let builder = ShadowIndex::builder(Arc::clone(&occluders), lights.clone());
        builder.refinement(refinement).build().expect("an index")
    };
    let reference = ShadowIndex::builder(Arc::clone(&occluders), lights.clone());
    let expected = answers(&reference.method(Method::Bvh).build().expect("an index"));
    let mut stopped_count = 0;
    for refine in [Refine::Queried, Refine::Lazy] {
        for micros in [0, 30, 200, 1_000, 4_000, 15_000, 60_000] {
            let index = index(refine);
            let (stopped, _) = stopped_after(Duration::from_micros(micros), || answers(&index));
            stopped_count += u32::from(stopped.is_err());
            for _ in 0..2 {
                assert_eq!(
                    answers(&index),
                    expected,
                    "{refine:?} stopped after {micros} us"
                );
            }
            assert!(refine == Refine::Lazy || index.occlusion_bytes() > 0);
        }
    }
    assert!(stopped_count >= 2, "{stopped_count} were stopped");
}

/// Stops the work as late as it can be stopped before it is done: a fast machine is done with
/// it sooner. Returns how long it went on after that, or `None` where it never was stopped.
fn stopped_late<T>(mut work: impl FnMut() -> T) -> Option<Duration> {
    [300, 100, 30, 10, 3, 1, 0].into_iter().find_map(|millis| {
        let (stopped, took) = stopped_after(Duration::from_millis(millis), &mut work);
        stopped.is_err().then_some(took)
    })
}

#[test]
fn building_and_asking_end_soon_after_they_are_stopped() {
    let occluders = waves(120);
    let lights = lights(40);
    let build = |method, refine| {
        let refinement = Refinement {
            refine,
            ..Refinement::default()
        };
        let builder = ShadowIndex::builder(Arc::clone(&occluders), lights.clone());
        builder.method(method).refinement(refinement).build()
    };
    for (method, refine) in [
        (Method::Voxel, Refine::Eager),
        (Method::Voxel, Refine::Queried),
    ] {
        let took = stopped_late(|| build(method, refine));
        let soon = took.is_some_and(|took| took < PROMISED);
        assert!(soon, "{method:?} {refine:?}: {took:?}");
    }
    let naive = build(Method::Naive, Refine::Lazy).expect("an index");
    let (points, surfaces) = points(&occluders, 300_000);
    let batch = Batch::on_surfaces(&points, &surfaces);
    let mut answers = vec![0; points.len()];
    let took = stopped_late(|| naive.occluded(&batch, &[LightId(0)], &mut answers));
    assert!(took.is_some_and(|took| took < PROMISED), "{took:?}");
    let directions = vec![[1.0, 0.5, 0.01]; points.len()];
    let rays = RayBatch {
        origins: &points,
        directions: &directions,
        leaves: None,
    };
    let (stopped, took) = stopped_after(Duration::from_millis(300), || naive.all_hits(&rays));
    assert!(stopped.is_err() || took == Duration::ZERO, "{took:?}");
    assert!(took < PROMISED, "{took:?}");
}
