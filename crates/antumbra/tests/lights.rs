//! Lights that are added, moved and removed: the answers are those of an index that is built for them, and what is
//! known of the other lights stays.

mod common;

use std::fs;
use std::path::Path;
use std::sync::Arc;

use antumbra::{
    BuildError, Counters, DVec3, LightError, LightId, LightShape, Method, Occluders, Opacity,
    ReceiverPoint, Refine, Refinement, SavedLight, ShadowIndex, Sphere, SurfaceId,
};

use common::{METHODS, Random, add_cone_and_disk, add_pane, builder_of, is_shadowed, lamps};

/// A bumpy floor, leaves, glass and curved shapes.
fn scene() -> Arc<Occluders> {
    let random = &mut Random(7);
    let mut builder = Occluders::builder();
    let edge = 10;
    let mut vertices = Vec::new();
    for i in 0..=edge {
        for j in 0..=edge {
            let at = |n: i32| 8.0 * f64::from(n) / f64::from(edge) - 4.0;
            vertices.push([at(i), at(j), random.real(0.0, 0.2)]);
        }
    }
    let mut triangles = Vec::new();
    for i in 0..edge as u32 {
        for j in 0..edge as u32 {
            let row = edge as u32 + 1;
            let corner = i * row + j;
            triangles.push([corner, corner + row, corner + row + 1]);
            triangles.push([corner, corner + row + 1, corner + 1]);
        }
    }
    builder
        .add_mesh(&vertices, &triangles, Opacity::Opaque)
        .expect("a floor");
    for _ in 0..40 {
        let middle = DVec3::new(0.0, 0.0, 1.5) + DVec3::new(3.5, 3.5, 1.0) * random.in_cube();
        let corners = [(); 3].map(|()| (middle + 0.5 * random.in_cube()).to_array());
        builder
            .add_mesh(&corners, &[[0, 1, 2]], Opacity::Opaque)
            .expect("a leaf");
    }
    add_pane(&mut builder);
    add_cone_and_disk(&mut builder, 0.2);
    let ball = Sphere {
        center: DVec3::new(0.0, 0.0, 1.2),
        radius: 0.6,
    };
    builder.add_sphere(ball, Opacity::Opaque).expect("a ball");
    Arc::new(builder.build())
}

/// On surfaces and in space.
fn starts(occluders: &Occluders, count: usize) -> Vec<ReceiverPoint> {
    let random = &mut Random(3);
    let mut all = Vec::new();
    for number in 0..count {
        let surface = SurfaceId(random.below(occluders.triangle_count()) as u32);
        let [a, b, c] = occluders.triangle_positions(surface).expect("a triangle");
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 {
            (1.0 - u, 1.0 - v)
        } else {
            (u, v)
        };
        all.push(match number % 3 {
            0 => ReceiverPoint {
                point: DVec3::new(0.0, 0.0, 1.0) + 3.0 * random.in_cube(),
                surface: None,
            },
            _ => ReceiverPoint {
                point: a + u * (b - a) + v * (c - a),
                surface: Some(surface),
            },
        });
    }
    all
}

fn answers(index: &ShadowIndex, starts: &[ReceiverPoint], light: usize) -> (Vec<bool>, Counters) {
    let mut found = vec![false; starts.len()];
    let mut counters = Counters::default();
    index
        .shadows(
            starts,
            LightId::from_index(light),
            &mut found,
            &mut counters,
        )
        .expect("fine queries");
    (found, counters)
}

fn reference(index: &ShadowIndex, starts: &[ReceiverPoint], light: usize) -> Vec<bool> {
    let answer = |start| {
        index
            .shadow_by_reference(start, LightId::from_index(light))
            .expect("fine queries")
    };
    let all = starts.iter().map(answer);
    all.map(|shadow| shadow == antumbra::Shadow::Shadowed)
        .collect()
}

const NEW: LightShape = LightShape::Point(DVec3::new(-1.5, 2.0, 3.0));
const MOVED: LightShape = LightShape::Direction(DVec3::new(-0.5, 0.2, 0.8));

#[test]
fn changed_lights_are_answered_as_in_a_fresh_index_by_every_method() {
    let occluders = scene();
    let starts = starts(&occluders, 1_500);
    let refines = [Refine::Lazy, Refine::Eager, Refine::Queried];
    for method in METHODS {
        for refine in refines {
            let is_kept = matches!(method, Method::Voxel | Method::Auto);
            if !is_kept && refine != Refine::Lazy {
                continue;
            }
            let refinement = Refinement {
                resolution: 64,
                space_resolution: 32,
                refine,
                ..Refinement::default()
            };
            let build = |lights: Vec<LightShape>| {
                let builder = ShadowIndex::builder(Arc::clone(&occluders), lights);
                let builder = builder.method(method).refinement(refinement);
                builder.build().expect("an index")
            };
            let mut index = build(lamps());
            let mut lights = lamps();
            let same = |index: &ShadowIndex, lights: &[LightShape]| {
                assert_eq!(index.lights(), lights);
                let fresh = build(lights.to_vec());
                for light in 0..lights.len() {
                    let (found, _) = answers(index, &starts, light);
                    let case = format!("{method:?} {refine:?} light {light} of {}", lights.len());
                    assert!(found == reference(&fresh, &starts, light), "{case}");
                    assert!(found == answers(&fresh, &starts, light).0, "{case}");
                    for (start, &expected) in starts.iter().zip(&found).step_by(7) {
                        assert_eq!(is_shadowed(index, start, light), expected, "{case}");
                    }
                }
            };
            same(&index, &lights);
            assert_eq!(index.add_light(NEW), Ok(LightId(3)));
            lights.push(NEW);
            same(&index, &lights);
            index.move_light(LightId(1), MOVED).expect("a fine light");
            lights[1] = MOVED;
            same(&index, &lights);
            assert_eq!(index.remove_light(LightId(0)), Ok(lights.remove(0)));
            same(&index, &lights);
            while !lights.is_empty() {
                assert_eq!(index.remove_light(LightId(0)), Ok(lights.remove(0)));
            }
            same(&index, &lights);
            assert_eq!(index.add_light(NEW), Ok(LightId(0)));
            same(&index, &[NEW]);
        }
    }
}

/// How queries are decided, and the bytes that each light's values take, tell that nothing was made again or dropped.
#[test]
fn what_is_known_of_other_lights_stays() {
    let occluders = scene();
    let starts = starts(&occluders, 3_000);
    for (method, refine) in [
        (Method::Voxel, Refine::Eager),
        (Method::Voxel, Refine::Queried),
        (Method::Auto, Refine::Eager),
        (Method::Auto, Refine::Queried),
    ] {
        let refinement = Refinement {
            resolution: 64,
            space_resolution: 32,
            refine,
            ..Refinement::default()
        };
        let mut index = ShadowIndex::builder(Arc::clone(&occluders), lamps())
            .method(method)
            .refinement(refinement)
            .build()
            .expect("an index");
        for light in 0..lamps().len() {
            answers(&index, &starts, light);
        }
        // What is known now is all there is.
        index.set_refining(false);
        let case = format!("{method:?} {refine:?}");
        let before: Vec<_> = (0..3)
            .map(|light| answers(&index, &starts, light))
            .collect();
        let known = before[0].1.shadow;
        // A map knows little of so small a scene.
        let is_known = |known: antumbra::ShadowCounters| match method {
            Method::Voxel => known.first_pass > known.rays,
            _ => known.first_pass > 100,
        };
        assert!(is_known(known), "{case}: {known:?}");
        let bytes = index.occlusion_bytes();

        assert_eq!(index.add_light(NEW), Ok(LightId(3)), "{case}");
        for light in 0..3 {
            assert_eq!(
                answers(&index, &starts, light),
                before[light],
                "{case} {light}"
            );
        }
        if refine == Refine::Eager {
            assert!(index.occlusion_bytes() > bytes, "{case}");
            let (_, counted) = answers(&index, &starts, 3);
            assert!(is_known(counted.shadow), "{case}: {counted:?}");
        }
        index.move_light(LightId(3), MOVED).expect("a fine light");
        index.move_light(LightId(3), MOVED).expect("where it is");
        for light in 0..3 {
            assert_eq!(
                answers(&index, &starts, light),
                before[light],
                "{case} {light}"
            );
        }
        index.remove_light(LightId(3)).expect("a light");
        assert_eq!(index.occlusion_bytes(), bytes, "{case}");
        // Those behind move up with what they know.
        index.remove_light(LightId(0)).expect("a light");
        assert!(index.occlusion_bytes() < bytes, "{case}");
        for light in 0..2 {
            assert_eq!(
                answers(&index, &starts, light),
                before[light + 1],
                "{case} {light}"
            );
        }
        assert_eq!(index.lights_without_room(), 0, "{case}");
        assert_eq!(index.evictions(), 0, "{case}");
    }
}

#[test]
fn files_know_lights_by_where_they_are() {
    let occluders = scene();
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("values.antumbra");
    let build = |lights: &[LightShape], path: Option<&Path>| {
        let builder = builder_of(&occluders, lights, Method::Voxel);
        let builder = match path {
            Some(path) => builder.occlusion_file(path),
            None => builder,
        };
        builder.build().expect("an index")
    };
    let mut index = build(&lamps(), None);
    index.add_light(NEW).expect("a fine light");
    index.remove_light(LightId(1)).expect("a light");
    index.save(&path).expect("a file");
    // As if it had been built so.
    let [a, _, c] = lamps()[..] else {
        panic!("three lamps");
    };
    let again = folder.path().join("again.antumbra");
    build(&[a, c, NEW], None).save(&again).expect("a file");
    let bytes = |path: &Path| fs::read(path).expect("a file");
    assert!(bytes(&path) == bytes(&again), "other bytes");

    let mut index = build(&[NEW, a], Some(&path));
    assert_eq!(index.saved_lights(), [SavedLight::Loaded; 2]);
    let starts = starts(&occluders, 2_000);
    let before = answers(&index, &starts, 0);
    assert_eq!(index.add_light(MOVED), Ok(LightId(2)));
    index.move_light(LightId(1), c).expect("a fine light");
    assert_eq!(
        index.saved_lights(),
        [SavedLight::Loaded, SavedLight::Absent, SavedLight::Absent]
    );
    assert_eq!(answers(&index, &starts, 0), before);
    for light in 0..3 {
        let (found, _) = answers(&index, &starts, light);
        assert!(found == reference(&index, &starts, light), "light {light}");
    }
    index.save(&path).expect("a file");
    let index = build(&[c, MOVED, NEW], Some(&path));
    assert_eq!(index.saved_lights(), [SavedLight::Loaded; 3]);
}

#[test]
fn a_light_that_finds_no_room_is_answered_by_rays() {
    let occluders = scene();
    let starts = starts(&occluders, 1_500);
    let build = |memory| {
        let refinement = Refinement {
            resolution: 64,
            space_resolution: 32,
            refine: Refine::Eager,
            memory,
            ..Refinement::default()
        };
        ShadowIndex::builder(Arc::clone(&occluders), lamps())
            .method(Method::Voxel)
            .refinement(refinement)
            .build()
            .expect("an index")
    };
    let needed = build(1 << 30).knowledge_bytes();
    let mut are_refused = 0;
    for memory in [needed / 2, needed, needed + needed / 8, 4 * needed] {
        let mut index = build(memory);
        for _ in 0..3 {
            index.add_light(NEW).expect("a fine light");
            index.move_light(LightId(0), MOVED).expect("a fine light");
        }
        assert!(index.knowledge_bytes() <= memory);
        are_refused += index.lights_without_room();
        for light in 0..index.lights().len() {
            let (found, _) = answers(&index, &starts, light);
            assert!(
                found == reference(&index, &starts, light),
                "{memory} {light}"
            );
        }
    }
    assert!(are_refused > 0);
}

#[test]
fn an_index_without_a_tree_takes_lights() {
    let occluders = scene();
    let starts = starts(&occluders, 1_000);
    for method in [Method::Voxel, Method::Voxel1990, Method::Auto] {
        let mut index = builder_of(&occluders, &lamps()[..1], method)
            .without_tree()
            .build()
            .expect("an index");
        assert_eq!(index.add_light(NEW), Ok(LightId(1)));
        let (found, counted) = answers(&index, &starts, 1);
        assert!(found == reference(&index, &starts, 1), "{method:?}");
        assert!(counted.shadow.first_pass > 0, "{method:?}");
    }
}

#[test]
fn bad_lights_are_refused_and_change_nothing() {
    let occluders = scene();
    for method in METHODS {
        let mut index = builder_of(&occluders, &lamps(), method)
            .build()
            .expect("an index");
        let bad = [
            LightShape::Direction(DVec3::ZERO),
            LightShape::Point(DVec3::new(f64::NAN, 0.0, 0.0)),
            LightShape::Point(DVec3::new(0.0, 1e31, 0.0)),
        ];
        for light in bad {
            let refused = |light| LightError::Refused(BuildError::BadLight { light });
            assert_eq!(index.add_light(light), Err(refused(LightId(3))));
            assert_eq!(
                index.move_light(LightId(1), light),
                Err(refused(LightId(1)))
            );
        }
        let unknown = LightError::Unknown {
            light: LightId(3),
            light_count: 3,
        };
        assert_eq!(index.move_light(LightId(3), NEW), Err(unknown.clone()));
        assert_eq!(index.remove_light(LightId(3)), Err(unknown));
        assert_eq!(index.lights(), lamps());
    }
}

#[test]
fn values_of_the_uniform_grid_keep_to_the_limit() {
    let occluders = scene();
    let build = |count: usize, limit| {
        ShadowIndex::builder(Arc::clone(&occluders), vec![NEW; count])
            .method(Method::Voxel1990)
            .memory_limit(limit)
            .build()
    };
    let Err(BuildError::Memory { predicted, .. }) = build(3, 1) else {
        panic!("a byte is too little");
    };
    let mut index = build(2, predicted.needed()).expect("enough for three");
    assert_eq!(index.add_light(NEW), Ok(LightId(2)));
    let refused = index.add_light(NEW).expect_err("too much");
    assert!(
        matches!(refused, LightError::Refused(BuildError::Memory { .. })),
        "{refused}"
    );
    assert_eq!(index.lights().len(), 3);
}
