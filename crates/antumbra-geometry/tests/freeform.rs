//! Patches and implicit surfaces as surfaces among others: what is refused, what keeps, where points on them are.

use antumbra_geometry::{
    Ball, BezierPatch, DVec3, Field, Implicit, ImplicitError, Occluders, OccludersError, Opacity,
    Ray, SurfaceId, Term,
};

fn patch(height: f64, level: u32) -> BezierPatch {
    let control = std::array::from_fn(|j| {
        std::array::from_fn(|i| DVec3::new(i as f64, j as f64, height * ((i * j) % 3) as f64))
    });
    BezierPatch { control, level }
}

fn gyroid(period: f64) -> Implicit {
    Implicit {
        field: Field::Gyroid {
            center: DVec3::ZERO,
            period,
            level: 0.0,
        },
        low: DVec3::splat(-1.0),
        high: DVec3::splat(1.0),
    }
}

/// The bytes of everything that answers depend on.
fn said(patch: &BezierPatch, implicit: &Implicit) -> Vec<u8> {
    let mut builder = Occluders::builder();
    builder.add_patch(patch, Opacity::Opaque).expect("a patch");
    builder
        .add_implicit(implicit, Opacity::Opaque)
        .expect("a surface");
    let mut bytes = Vec::new();
    let occluders = builder.build();
    occluders
        .identify(&mut |more| bytes.extend_from_slice(more))
        .expect("no coverage");
    bytes
}

#[test]
fn whatever_changes_an_answer_is_said() {
    let terms = |factor| Implicit {
        field: Field::Polynomial {
            center: DVec3::ZERO,
            unit: 1.0,
            terms: vec![Term {
                factor,
                exponents: [1, 2, 0],
            }],
        },
        ..gyroid(1.0)
    };
    let balls = |strength| Implicit {
        field: Field::Metaballs {
            balls: vec![Ball {
                center: DVec3::ZERO,
                radius: 1.0,
                strength,
            }],
            threshold: 0.5,
        },
        ..gyroid(1.0)
    };
    let torus = |minor| Implicit::torus(DVec3::ZERO, DVec3::Z, 1.0, minor);
    let wider = Implicit {
        high: DVec3::splat(2.0),
        ..gyroid(1.0)
    };
    let mut all = vec![said(&patch(0.5, 3), &gyroid(1.0))];
    for (patch, implicit) in [
        (patch(0.25, 3), gyroid(1.0)),
        (patch(0.5, 4), gyroid(1.0)),
        (patch(0.5, 3), gyroid(2.0)),
        (patch(0.5, 3), wider),
        (patch(0.5, 3), terms(1.0)),
        (patch(0.5, 3), terms(2.0)),
        (patch(0.5, 3), balls(1.0)),
        (patch(0.5, 3), balls(2.0)),
        (patch(0.5, 3), torus(0.25)),
        (patch(0.5, 3), torus(0.5)),
    ] {
        let other = said(&patch, &implicit);
        assert!(!all.contains(&other));
        all.push(other);
    }
}

#[test]
fn what_is_no_surface_is_refused() {
    let mut builder = Occluders::builder();
    let mut bad = patch(1.0, 3);
    bad.control[2][1].y = f64::NAN;
    let refused = builder.add_patch(&bad, Opacity::Opaque);
    assert!(matches!(refused, Err(OccludersError::BadNumber { .. })));
    let refused = builder.add_patch(&patch(1.0, 13), Opacity::Opaque);
    assert!(matches!(refused, Err(OccludersError::PatchLevel { .. })));
    for (implicit, expected) in [
        (gyroid(f64::NAN), ImplicitError::BadNumber),
        (
            Implicit::torus(DVec3::ZERO, DVec3::Z, 1.0, 0.0),
            ImplicitError::NotPositive("the radius of the tube of a torus"),
        ),
        (
            Implicit {
                low: DVec3::ONE,
                ..gyroid(1.0)
            },
            ImplicitError::EmptyBox,
        ),
    ] {
        assert_eq!(implicit.check(), Err(expected.clone()));
        let refused = builder.add_implicit(&implicit, Opacity::Opaque);
        let Err(OccludersError::Implicit { source, .. }) = refused else {
            panic!("{refused:?}");
        };
        assert_eq!(source, expected);
    }
}

#[test]
fn degenerate_patches_are_never_hit() {
    let mut builder = Occluders::builder();
    let point = BezierPatch {
        control: [[DVec3::ONE; 4]; 4],
        level: 6,
    };
    let line = BezierPatch {
        control: std::array::from_fn(|_| std::array::from_fn(|i| DVec3::X * i as f64)),
        level: 6,
    };
    for patch in [&point, &line] {
        builder.add_patch(patch, Opacity::Opaque).expect("a patch");
    }
    let occluders = builder.build();
    for surface in occluders.surfaces() {
        for target in [DVec3::ONE, DVec3::X, DVec3::new(1.5, 0.0, 0.0)] {
            let ray = Ray {
                origin: DVec3::new(0.3, 4.0, 5.0),
                direction: target - DVec3::new(0.3, 4.0, 5.0),
                leaves: None,
            };
            assert!(!occluders.crosses(surface, &occluders.ray_segment(&ray)));
        }
    }
}

#[test]
fn hits_lie_on_the_surface_and_starts_return_to_it() {
    let mut builder = Occluders::builder();
    builder
        .add_patch(&patch(0.4, 7), Opacity::Opaque)
        .expect("a patch");
    let torus = Implicit::torus(
        DVec3::new(8.0, 0.0, 0.0),
        DVec3::new(0.2, 0.1, 1.0),
        2.0,
        0.5,
    );
    builder
        .add_implicit(&torus, Opacity::Opaque)
        .expect("a torus");
    let occluders = builder.build();
    let mut hits = [0; 2];
    for number in 0..400 {
        let (x, y) = (
            f64::from(number % 20) * 0.6 - 0.5,
            f64::from(number / 20) * 0.25 - 2.0,
        );
        let ray = Ray {
            origin: DVec3::new(x, y, 6.0),
            direction: DVec3::new(0.05, -0.03, -1.0),
            leaves: None,
        };
        let segment = occluders.ray_segment(&ray);
        for surface in occluders.surfaces() {
            if !occluders.crosses(surface, &segment) {
                continue;
            }
            let hit = occluders.hit(surface, &segment);
            let is_torus = surface.0 as usize == occluders.surface_count() - 1;
            hits[usize::from(is_torus)] += 1;
            assert!(occluders.distance(surface, hit.point).expect("a surface") < 1e-9);
            let along = ray.origin + ray.direction * hit.distance;
            assert!((along - hit.point).length() < 1e-9);
            // A little off, along the normal, the nearest point is that far.
            let normal = occluders.smooth_normal_at(surface, hit.point);
            let off = hit.point + normal * 1e-3;
            let found = occluders.distance(surface, off).expect("a surface");
            assert!((found - 1e-3).abs() < 2e-5, "{surface:?} {found}");
            let back = occluders.start_on(surface, off).point;
            assert!((back - hit.point).length() < 2e-4);
        }
    }
    assert!(hits.iter().all(|&hits| hits > 30), "{hits:?}");
    assert!(occluders.is_freeform(SurfaceId(0)));
}
