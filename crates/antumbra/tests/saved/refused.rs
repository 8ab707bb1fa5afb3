//! Files of another scene, light or setting, which are refused with the reason.

use std::sync::Arc;

use antumbra::{Change, Method, Refine, Refinement, Refusal, SaveError, SavedLight};
use antumbra_geometry::{Coverage, DVec3, Occluders};

use crate::world::{Folder, METHODS, World, refinement, scene};

#[test]
fn stale_files_are_refused_with_the_reason() {
    let world = World::new(64, Refine::Lazy);
    let folder = Folder::new();
    let path = folder.file("old.antumbra");
    world.index().save(&path).expect("a file");
    let other = |nudge| World {
        occluders: scene(12, 60, nudge),
        ..World::new(64, Refine::Lazy)
    };
    assert!(other(0.0).load(&path).is_ok());
    assert_eq!(other(1e-9).refusal(&path), Refusal::Stale(Change::Scene));
    // The box of the scene is part of it, too.
    assert!(matches!(
        World {
            occluders: scene(13, 60, 0.0),
            ..World::new(64, Refine::Lazy)
        }
        .refusal(&path),
        Refusal::Stale(Change::Scene | Change::Cells)
    ));

    let usual = world.refinement;
    let setting = |name, found, expected| {
        Refusal::Stale(Change::Setting {
            name,
            found,
            expected,
        })
    };
    for (refinement, reason) in [
        (
            Refinement {
                resolution: 128,
                ..usual
            },
            setting("resolution", 64, 128),
        ),
        (
            Refinement {
                space_resolution: 64,
                ..usual
            },
            setting("resolution for points of space", 32, 64),
        ),
        (
            Refinement {
                short_list: 2,
                ..usual
            },
            setting("short list", 3, 2),
        ),
        (
            Refinement {
                space_list: 2,
                ..usual
            },
            setting("list for points of space", 8, 2),
        ),
        (
            Refinement {
                long_list: 2,
                ..usual
            },
            setting("long list", 32, 2),
        ),
    ] {
        let world = World {
            refinement,
            ..World::new(64, Refine::Lazy)
        };
        assert_eq!(world.refusal(&path), reason);
    }
    let by_rays = world.builder().method(Method::Bvh).occlusion_file(&path);
    let error = by_rays.build().expect_err("no values");
    assert!(
        error.to_string().ends_with("a method that keeps nothing"),
        "{error}"
    );
}

#[test]
fn stale_maps_are_refused_and_settings_of_voxels_are_none_of_theirs() {
    let maps = |nudge| World {
        occluders: scene(12, 60, nudge),
        ..World::new(64, Refine::Eager).by(Method::Auto)
    };
    let world = maps(0.0);
    let folder = Folder::new();
    let path = folder.file("maps.antumbra");
    world.index().save(&path).expect("a file");
    assert_eq!(maps(1e-9).refusal(&path), Refusal::Stale(Change::Scene));
    let finer = World {
        refinement: refinement(256, Refine::Eager),
        ..maps(0.0)
    };
    let index = finer.load(&path).expect("it is taken");
    assert_eq!(index.saved_lights(), [SavedLight::Loaded; 2]);
}

#[test]
fn a_file_says_by_which_method_it_is_used() {
    let folder = Folder::new();
    let starts = World::new(64, Refine::Lazy).starts(2_000, 23);
    for saved in METHODS {
        let world = World::new(64, Refine::Eager).by(saved);
        let path = folder.file("file");
        world.index().save(&path).expect("a file");
        // The usual method takes what there is.
        let auto = World::new(64, Refine::Eager).by(Method::Auto);
        let index = auto.load(&path).expect("it is taken");
        assert_eq!(index.method(), saved);
        auto.assert_right(&index, &starts, &auto.expected(&starts));
        let voxel = World::new(64, Refine::Eager).by(Method::Voxel);
        match saved {
            Method::Auto => assert_eq!(voxel.refusal(&path), Refusal::OtherMethod),
            _ => assert_eq!(voxel.load(&path).expect("taken").method(), saved),
        }
        let by_rays = World::new(64, Refine::Eager).by(Method::Bvh);
        assert_eq!(by_rays.refusal(&path), Refusal::NoValues);
    }
}

#[derive(Debug)]
struct Holes {
    is_told: bool,
    edge: f64,
}

impl Coverage for Holes {
    fn is_solid_at(&self, uv: [f64; 2]) -> bool {
        uv[0] > self.edge
    }

    fn identify(&self, write: &mut dyn FnMut(&[u8])) -> bool {
        write(&self.edge.to_le_bytes());
        self.is_told
    }
}

#[test]
fn holes_are_part_of_the_scene() {
    let world = |is_told, edge| {
        let mut builder = Occluders::builder();
        let holes = builder.add_coverage(Arc::new(Holes { is_told, edge }));
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let uvs = corners.map(|corner| [corner.x, corner.y]);
        builder
            .add_alpha_tested_face(&corners, &uvs, holes)
            .expect("a face");
        World {
            occluders: Arc::new(builder.build()),
            ..World::new(32, Refine::Lazy)
        }
    };
    let folder = Folder::new();
    let path = folder.file("file");
    world(true, 0.5).index().save(&path).expect("a file");
    assert!(world(true, 0.5).load(&path).is_ok());
    let refusal = world(true, 0.25).refusal(&path);
    assert_eq!(refusal, Refusal::Stale(Change::Scene));
    let refusal = world(false, 0.5).refusal(&path);
    assert!(matches!(refusal, Refusal::Unidentified(_)));
    let error = world(false, 0.5).index().save(&path);
    assert!(matches!(error, Err(SaveError::Unidentified(_))));
    // What cannot be told is not written over what can.
    assert!(world(true, 0.5).load(&path).is_ok());
    let by_rays = world(true, 0.5).builder().method(Method::Bvh).build();
    let error = by_rays.expect("an index").save(&path);
    assert_eq!(error, Err(SaveError::NoValues));
}
