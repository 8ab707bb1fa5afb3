//! Every method against the oracle: the fixtures of EXACTNESS.md and generated nasty scenes.
//!
//! The oracle (`antumbra-testkit`) implements the same page in rational arithmetic and shares no
//! code with the library. A failure names the scene, so that one line repeats it.

mod common;

use antumbra::{
    Batch, BatchKind, Counters, GridResolution, LightId, Method, RayBatch, Refine, Refinement,
    Shadow, ShadowIndex, Towards,
};
use antumbra_geometry::{LightShape, ReceiverPoint, SurfaceId};
use antumbra_testkit::fixtures::{self, Fixture};
use antumbra_testkit::nasty;
use antumbra_testkit::oracle::{Oracle, OracleLight, OracleSurface};
use common::nasty::{light, occluders, start};

/// Values alone, coarse and fine; lists as soon as they are long enough for everything; both; made before
/// and while they are asked.
fn refinements() -> [Refinement; 6] {
    let refinement = |resolution, short_list, long_list, refine| Refinement {
        resolution,
        space_resolution: resolution,
        short_list,
        space_list: short_list,
        long_list,
        refine,
        ..Refinement::default()
    };
    [
        refinement(4, 0, 0, Refine::Eager),
        refinement(32, 0, 0, Refine::Eager),
        refinement(4, 64, 64, Refine::Eager),
        refinement(64, 2, 8, Refine::Eager),
        refinement(64, 2, 8, Refine::Queried),
        refinement(4096, 0, 2, Refine::Queried),
    ]
}

/// All methods, the walking ones on several grids.
fn indices(surfaces: &[OracleSurface], lights: &[OracleLight]) -> Vec<(String, ShadowIndex)> {
    let occluders = occluders(surfaces);
    let lights: Vec<LightShape> = lights.iter().map(|&l| light(l)).collect();
    let grids = [
        GridResolution::Fixed([1; 3]),
        GridResolution::Fixed([5, 3, 4]),
        GridResolution::Fixed([8; 3]),
        GridResolution::Fixed([23, 31, 17]),
    ];
    let mut indices = Vec::new();
    for method in [Method::Grid, Method::Voxel1990] {
        for grid in grids {
            let index = ShadowIndex::builder(occluders.clone(), lights.clone())
                .method(method)
                .grid(grid)
                .build()
                .expect("settings are in range");
            indices.push((format!("{method:?} {grid:?}"), index));
        }
    }
    for refinement in refinements() {
        let index = ShadowIndex::builder(occluders.clone(), lights.clone())
            .method(Method::Voxel)
            .grid(GridResolution::Fixed([1; 3]))
            .refinement(refinement)
            .build()
            .expect("settings are in range");
        indices.push((format!("Voxel {refinement:?}"), index));
    }
    for refine in [Refine::Eager, Refine::Queried, Refine::Lazy] {
        let index = ShadowIndex::builder(occluders.clone(), lights.clone())
            .method(Method::Auto)
            .grid(GridResolution::Fixed([1; 3]))
            .refinement(Refinement {
                refine,
                ..Refinement::default()
            })
            .build()
            .expect("settings are in range");
        indices.push((format!("Auto {refine:?}"), index));
    }
    let by_tree = ShadowIndex::builder(occluders, lights)
        .method(Method::Bvh)
        .grid(GridResolution::Fixed([1; 3]))
        .build()
        .expect("settings are in range");
    indices.push(("Bvh".to_string(), by_tree));
    indices
}

fn is_shadowed(index: &ShadowIndex, start: &ReceiverPoint, light: usize) -> bool {
    let answer = index.shadow(start, LightId::from_index(light), &mut Counters::default());
    answer.expect("a fine query").shadow == Shadow::Shadowed
}

/// Starts of a slice that values which are made before answer together.
const TOGETHER: usize = 64;

/// Returns the answers to a start that is asked so often at once.
fn are_shadowed(index: &ShadowIndex, start: &ReceiverPoint, light: usize) -> [bool; TOGETHER] {
    let mut found = [false; TOGETHER];
    index
        .shadows(
            &[*start; TOGETHER],
            LightId::from_index(light),
            &mut found,
            &mut Counters::default(),
        )
        .expect("a fine query");
    found
}

/// Asks one question of the oracle, the reference and all methods; returns the differences.
fn differences(
    label: &str,
    oracle: &Oracle,
    indices: &[(String, ShadowIndex)],
    lights: &[OracleLight],
    (point, surface, light): ([f64; 3], Option<usize>, usize),
) -> Vec<String> {
    let truth = oracle.is_blocked(point, surface, lights[light]);
    let start = start(point, surface);
    let mut found = Vec::new();
    let mut note = |name: &str, answer: String| {
        found.push(format!(
            "{label}: {name} says {answer}, oracle blocked = {truth} by {:?}: point {point:?} \
             surface {surface:?} light {:?}",
            oracle.blockers(point, surface, lights[light]),
            lights[light],
        ));
    };
    let reference = indices[0]
        .1
        .shadow_by_reference(&start, LightId::from_index(light))
        == Ok(Shadow::Shadowed);
    if reference != truth {
        note("reference", reference.to_string());
    }
    if let Some(surface) = surface {
        let side = oracle.light_side(point, surface, lights[light]);
        let ours = indices[0]
            .1
            .light_side(&start, LightId::from_index(light))
            .expect("a fine query");
        if ours != side {
            note("light side", format!("{ours}, not {side}"));
        }
    }
    for (name, index) in indices {
        // Values that are made while they are asked: by a ray, by coarse voxels, by finer ones.
        for _ in 0..6 {
            let answer = is_shadowed(index, &start, light);
            if answer != truth {
                note(name, answer.to_string());
            }
            if !name.contains("Asked") {
                break;
            }
        }
        if name.contains("Eager") && are_shadowed(index, &start, light) != [truth; TOGETHER] {
            note(name, format!("{} in a slice", !truth));
        }
    }
    found
}

fn check_fixture(fixture: &Fixture) {
    let oracle = Oracle::new(fixture.surfaces.clone());
    let indices = indices(&fixture.surfaces, &fixture.lights);
    let mut found = Vec::new();
    for query in &fixture.queries {
        let question = (query.point, query.surface, query.light);
        found.extend(differences(
            fixture.name,
            &oracle,
            &indices,
            &fixture.lights,
            question,
        ));
        if let Some(expected) = query.expected {
            let truth = oracle.is_blocked(query.point, query.surface, fixture.lights[query.light]);
            assert_eq!(truth, expected, "{}: {query:?}", fixture.name);
        }
    }
    assert!(!fixture.queries.is_empty(), "{} asks nothing", fixture.name);
    assert!(
        found.is_empty(),
        "{}: {}\n{}",
        fixture.name,
        fixture.why,
        found.join("\n")
    );
}

/// One test for each fixture, so that EXACTNESS.md can name them.
macro_rules! fixture_tests {
    ($($name:ident),* $(,)?) => {
        $(#[test] fn $name() { check_fixture(&fixtures::$name()); })*

        #[test]
        fn no_fixture_is_forgotten() {
            let named = [$(stringify!($name)),*];
            assert_eq!(fixtures::all().len(), named.len());
        }
    };
}

fixture_tests!(
    valley,
    grazing_floor,
    grazing_tilted_floor,
    piercing_at_shared_vertex,
    slab_top,
    closed_room,
    glass_joined_to_opaque,
    doubled_faces,
    light_inside_sphere,
    touching_spheres,
    open_tube,
    open_cone,
    coplanar_overlap,
    t_junction_crease,
    light_on_surface,
    light_in_plane,
    light_near_vertex,
    start_is_light,
    cube_edges,
    utm_coordinates,
    disk_rim,
    cylinder_on_floor,
    cone_under_light_on_axis,
    degenerate_surfaces,
    ends_of_the_segment,
    foot_of_wall,
    out_through_apex,
    down_from_apex,
    pipe_of_two_tubes,
    start_is_light_on_solid,
    aligned_tiles,
    start_off_its_triangle,
    start_off_its_curved_surface,
);

/// How many nasty scenes the suite asks; `ANTUMBRA_NASTY_SEEDS=from..to` asks others.
fn seeds() -> std::ops::Range<u64> {
    let Ok(text) = std::env::var("ANTUMBRA_NASTY_SEEDS") else {
        return 0..240;
    };
    let (from, to) = text
        .split_once("..")
        .expect("ANTUMBRA_NASTY_SEEDS is from..to");
    from.parse().expect("a number")..to.parse().expect("a number")
}

#[test]
fn nasty_scenes_agree_with_the_oracle() {
    let mut found = Vec::new();
    let (mut asked, mut blocked) = (0u64, 0u64);
    for seed in seeds() {
        let scene = nasty::scene(seed);
        let oracle = Oracle::new(scene.surfaces.clone());
        let indices = indices(&scene.surfaces, &scene.lights);
        for query in &scene.queries {
            for light in 0..scene.lights.len() {
                let question = (query.point, query.surface, light);
                asked += 1;
                blocked +=
                    u64::from(oracle.is_blocked(query.point, query.surface, scene.lights[light]));
                found.extend(differences(
                    &scene.label(),
                    &oracle,
                    &indices,
                    &scene.lights,
                    question,
                ));
            }
        }
        if found.len() > 20 {
            break;
        }
    }
    found.truncate(20);
    assert!(found.is_empty(), "{}", found.join("\n"));
    assert!(
        blocked * 10 > asked && blocked * 10 < asked * 9,
        "{blocked} of {asked} are blocked"
    );
}

/// Nasty seed 951 (Fan, Huge): the start's shift onto its plane, a quarter of the smallest number,
/// underflowed to nothing, and so did its error bound; the start was taken to be exact while it
/// lay on the other side of a face through the same vertex.
#[test]
fn start_shift_that_underflows() {
    let size = 2f64.powi(40);
    let place = |corners: [[f64; 3]; 3]| {
        OracleSurface::triangle(corners.map(|corner| corner.map(|x| x * size)))
    };
    // The start's own face in the plane y + 4 z = 0, the other one in the plane y + 8 z = 0, both
    // from the origin towards `side` along y.
    for side in [-1.0, 1.0] {
        let own = place([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 4.0 * side, -side]]);
        let other = place([
            [0.0; 3],
            [4.0, 8.0 * side, -side],
            [-4.0, 8.0 * side, -side],
        ]);
        let light = OracleLight::Point([0.0, 0.0, 2.0 * side * size]);
        // With e the smallest number and side 1 the start belongs on (0, e, -e / 4), under the
        // other face; (0, e, 0) is over it, as is the light.
        let point = [0.0, 5e-324 * side, 0.0];
        let surfaces = [own, other];
        let oracle = Oracle::new(surfaces.to_vec());
        assert!(oracle.is_blocked(point, Some(0), light));
        let found = differences(
            "underflow",
            &oracle,
            &indices(&surfaces, &[light]),
            &[light],
            (point, Some(0), 0),
        );
        assert!(found.is_empty(), "{}", found.join("\n"));
    }
}

#[test]
fn rays_of_many_agree_with_the_oracle() {
    for seed in 0..24 {
        let scene = nasty::scene(seed);
        let oracle = Oracle::new(scene.surfaces.clone());
        let occluders = occluders(&scene.surfaces);
        for method in [Method::Bvh, Method::Grid, Method::Naive] {
            let index = ShadowIndex::builder(occluders.clone(), Vec::new())
                .method(method)
                .build()
                .expect("settings are in range");
            for &light in &scene.lights {
                ask_many(&index, &oracle, &scene, light);
            }
        }
    }
}

/// Asks all queries of a scene about one light as segments or rays of the points' own.
fn ask_many(index: &ShadowIndex, oracle: &Oracle, scene: &nasty::NastyScene, light: OracleLight) {
    let on_surface = |on: bool| {
        let queries = scene.queries.iter();
        queries.filter(move |query| query.surface.is_some() == on)
    };
    for is_free in [false, true] {
        let points: Vec<[f64; 3]> = on_surface(!is_free).map(|query| query.point).collect();
        let surfaces: Vec<u32> = on_surface(!is_free)
            .filter_map(|query| query.surface.map(|surface| surface as u32))
            .collect();
        let batch = if is_free {
            Batch::free(&points)
        } else {
            // However far they are from them.
            let kind = BatchKind::OnSurfaces {
                surfaces: &surfaces,
                tolerance: Some(f64::INFINITY),
            };
            Batch {
                points: &points,
                kind,
            }
        };
        let mut is_blocked = vec![2; points.len()];
        let targets = |target| vec![target; points.len()];
        let towards = match light {
            OracleLight::Point(point) => {
                index.occluded_towards(&batch, Towards::Points(&targets(point)), &mut is_blocked)
            }
            OracleLight::Direction(direction) => index.occluded_towards(
                &batch,
                Towards::Directions(&targets(direction)),
                &mut is_blocked,
            ),
        };
        towards.expect("numbers are in range");
        for (query, &found) in on_surface(!is_free).zip(&is_blocked) {
            let expected = oracle.is_blocked(query.point, query.surface, light);
            let label = scene.label();
            assert_eq!(found, u8::from(expected), "{label}: {query:?} {light:?}");
        }
        let OracleLight::Direction(direction) = light else {
            continue;
        };
        let rays = RayBatch {
            origins: &points,
            directions: &targets(direction),
            leaves: (!is_free).then_some(&surfaces),
        };
        check_hits(index, oracle, scene, &rays, on_surface(!is_free));
    }
}

/// Compares what rays meet with what blocks, and the nearest of many rays with each ray's.
fn check_hits<'a>(
    index: &ShadowIndex,
    oracle: &Oracle,
    scene: &nasty::NastyScene,
    rays: &RayBatch,
    queries: impl Iterator<Item = &'a nasty::NastyQuery>,
) {
    let all = index.all_hits(rays).expect("numbers are in range");
    let mut nearest = vec![None; rays.origins.len()];
    index
        .nearest_hits(rays, &mut nearest)
        .expect("numbers are in range");
    let mut first = 0;
    for (number, query) in queries.enumerate() {
        let label = scene.label();
        let hits = &all.hits[first..all.ends[number]];
        first = all.ends[number];
        assert!(
            hits.is_sorted_by_key(|hit| hit.distance),
            "{label}: {query:?}"
        );
        let occluders = index.occluders();
        // By the own rule all parts of a solid and its twins block, or none; it is left through one of them.
        let is_own = |surface: &usize| {
            query.surface.is_some_and(|own| {
                occluders.have_one_own_rule(SurfaceId(own as u32), SurfaceId(*surface as u32))
            })
        };
        let mut found: Vec<usize> = hits.iter().map(|hit| hit.surface.0 as usize).collect();
        let exits = found.iter().copied().filter(is_own).count();
        let light = OracleLight::Direction(rays.directions[number]);
        let mut expected = oracle.blockers(query.point, query.surface, light);
        assert!(exits <= 1, "{label}: {query:?}");
        assert!(
            exits == 1 || !expected.iter().any(is_own),
            "{label}: {query:?}"
        );
        found.retain(|surface| !is_own(surface) && occluders.is_opaque(SurfaceId(*surface as u32)));
        found.sort_unstable();
        expected.retain(|surface| !is_own(surface));
        assert_eq!(found, expected, "{label}: {query:?} {light:?}");
        assert_eq!(nearest[number], hits.first().copied(), "{label}: {query:?}");
    }
}
