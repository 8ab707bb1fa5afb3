//! Light in the air: pictures of fog, and airlight against marching with exact queries.

mod support;

use std::f64::consts::PI;

use antumbra::{LightId, LitIntervalsError, Method};
use antumbra_geometry::Ray;
use antumbra_geometry::{AreaShape, DVec3, RectangleLight, Sky, Sphere, SphereLight, SunDisc};
use antumbra_render::film::{RenderSettings, Rendered, Sampling};
use antumbra_render::fog::Fog;
use antumbra_render::integrator::{Air, Integrator, Seen, Tally};
use antumbra_render::prepare::Prepared;
use antumbra_scene::model::{
    AreaLight, Camera, Color, Corner, Light, LightKind, Material, Mesh, Scene, Shape,
};
use support::{ALL_METHODS, assert_golden, object, prepared, shot, square};

const SIZE: [u32; 2] = [96, 72];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn fog(extinction: f64, g: f64) -> Fog {
    Fog::new(extinction, 0.9, g).unwrap()
}

fn light(kind: LightKind, falls_off: bool) -> Light {
    Light {
        name: String::new(),
        kind,
        color: Color::new(1.0, 0.8, 0.5),
        falls_off,
    }
}

fn sun(towards_light: DVec3) -> Light {
    light(LightKind::Directional { towards_light }, false)
}

fn lamp(position: DVec3) -> Light {
    light(LightKind::Point { position }, true)
}

fn spot(position: DVec3, axis: DVec3) -> Light {
    let kind = LightKind::Spot {
        position,
        axis,
        inner_cosine: 0.95,
        outer_cosine: 0.85,
    };
    light(kind, true)
}

fn area(shape: AreaShape, falls_off: bool) -> AreaLight {
    AreaLight {
        name: String::new(),
        shape,
        color: Color::ONE,
        falls_off,
    }
}

/// Rectangles by corner and edges, as one mesh.
fn sheets(sheets: &[[DVec3; 3]]) -> Mesh {
    let mut mesh = Mesh::default();
    for &[corner, first, second] in sheets {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend([
            corner,
            corner + first,
            corner + first + second,
            corner + second,
        ]);
        mesh.corners.extend((base..base + 4).map(Corner::at));
        mesh.face_ends.push(mesh.corners.len() as u32);
    }
    mesh
}

/// A room of 4 x 6 x 3 with a window of two panes' size in the wall at x = 4.
fn room(lights: Vec<Light>) -> Scene {
    let (x, y, z) = (v(4.0, 0.0, 0.0), v(0.0, 6.0, 0.0), v(0.0, 0.0, 3.0));
    let along = |length: f64| v(0.0, length, 0.0);
    let up = |height: f64| v(0.0, 0.0, height);
    let inside = [
        [DVec3::ZERO, x, y],
        [z, y, x],
        [DVec3::ZERO, y, z],
        [y, x, z],
        // The wall with the window: below, above, before, between, behind.
        [x, along(6.0), up(1.0)],
        [x + up(2.4), along(6.0), up(0.6)],
        [x + up(1.0), along(2.0), up(1.4)],
        [x + up(1.0) + along(2.9), along(0.2), up(1.4)],
        [x + up(1.0) + along(4.0), along(2.0), up(1.4)],
    ];
    Scene {
        materials: vec![Material {
            diffuse: Color::splat(0.6),
            ..Material::default()
        }],
        objects: vec![object(Shape::Mesh(sheets(&inside)), 0)],
        lights,
        background: Color::new(0.5, 0.7, 0.9),
        ambient: Color::splat(0.02),
        ..Scene::default()
    }
}

fn camera() -> Camera {
    Camera {
        eye: v(0.4, 0.3, 1.2),
        at: v(3.0, 3.6, 1.3),
        up: DVec3::Z,
        vertical_fov_degrees: 55.0,
        resolution: None,
    }
}

fn settings(fog: Fog) -> RenderSettings {
    RenderSettings {
        fog: Some(fog),
        light_samples: 4,
        ..RenderSettings::default()
    }
}

/// Returns what an eye ray sees, the air before it, and counts.
fn looked(
    prepared: &Prepared,
    fog: Option<Fog>,
    origin: DVec3,
    direction: DVec3,
) -> (Color, Air, Tally) {
    let integrator = Integrator::new(prepared, 5)
        .with_fog(fog)
        .with_light_samples(64, 0);
    let mut seen = Seen::default();
    let mut work = integrator.work();
    let ray = Ray {
        origin,
        direction,
        leaves: None,
    };
    let color = integrator.radiance(&ray, &mut work, &mut seen);
    (color, seen.air, work.tally)
}

/// Returns the airlight of light 0 between two points by so many steps, each asked in its middle.
fn marched(prepared: &Prepared, fog: &Fog, [origin, end]: [DVec3; 2], steps: u32) -> f64 {
    let light = &prepared.scene().lights[0];
    let shape = &prepared.index().lights()[0];
    let length = (end - origin).length();
    let direction = (end - origin) / length;
    let of = |step: u32| {
        let share = (f64::from(step) + 0.5) / f64::from(steps);
        let point = origin + (end - origin) * share;
        if prepared.index().is_occluded_at(point, LightId(0)).unwrap() {
            return 0.0;
        }
        let (way, power) = match light.kind {
            LightKind::Directional { .. } => (0.0, 1.0),
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                let way = position.distance(point);
                (way, 1.0 / (way * way))
            }
        };
        let cosine = shape.towards(point).normalize().dot(direction);
        let left = (-fog.extinction() * (share * length + way)).exp();
        fog.extinction() * fog.albedo() * fog.phase(cosine) * power * left
    };
    PI * (0..steps).map(of).sum::<f64>() * length / f64::from(steps)
}

#[test]
fn airlight_through_a_slit_is_that_of_a_march_with_exact_queries() {
    // A plate with a slit of 0.2 over a floor; rays run under it.
    let plate = sheets(&[
        [v(-5.0, -5.0, 2.0), v(4.9, 0.0, 0.0), v(0.0, 10.0, 0.0)],
        [v(0.1, -5.0, 2.0), v(4.9, 0.0, 0.0), v(0.0, 10.0, 0.0)],
    ]);
    for one in [sun(v(0.3, 0.2, 1.0)), lamp(v(0.05, 0.1, 3.0))] {
        let scene = Scene {
            materials: vec![Material::default()],
            objects: vec![
                object(Shape::Mesh(square(6.0, 0.0)), 0),
                object(Shape::Mesh(plate.clone()), 0),
            ],
            lights: vec![one],
            ..Scene::default()
        };
        let prepared = prepared(scene, Method::Auto);
        let fog = fog(0.3, 0.4);
        let (origin, end) = (v(-4.0, -1.0, 1.8), v(4.0, 1.5, 0.0));
        let (_, air, tally) = looked(&prepared, Some(fog), origin, end - origin);
        let expected = marched(&prepared, &fog, [origin, end], 20_000);
        assert!(expected > 0.0);
        // Steps at the two edges of the shaft are lit as a whole or not at all.
        let edges = 2.0 * 9.0 / 20_000.0;
        let off = (air.light.x - expected).abs() / expected;
        assert!(off < edges, "{off} is not below {edges}");
        assert_eq!(
            [tally.air.segments, tally.air.by_parts, tally.air.intervals],
            [1, 0, 1]
        );
    }
}

#[test]
fn airlight_behind_a_ball_is_that_of_a_march_with_exact_queries() {
    let ball = Sphere {
        center: v(0.0, 0.0, 2.0),
        radius: 1.0,
    };
    let scene = Scene {
        materials: vec![Material::default()],
        objects: vec![
            object(Shape::Mesh(square(6.0, 0.0)), 0),
            object(Shape::Sphere(ball), 0),
        ],
        lights: vec![sun(v(0.1, 0.2, 1.0))],
        ..Scene::default()
    };
    let prepared = prepared(scene, Method::Auto);
    let fog = fog(0.3, 0.0);
    let (origin, end) = (v(-4.0, -1.0, 0.9), v(4.0, 1.5, 0.0));
    let (_, air, tally) = looked(&prepared, Some(fog), origin, end - origin);
    let expected = marched(&prepared, &fog, [origin, end], 20_000);
    let off = (air.light.x - expected).abs() / expected;
    assert!(off < 0.01, "{off}");
    // Who has no closed form is asked part by part, and counted.
    let light = &prepared.index().lights()[0];
    let exact = prepared.index().lit_intervals_along(origin, end, light);
    let is_by_parts = matches!(exact, Err(LitIntervalsError::NoClosedForm { .. }));
    assert_eq!(tally.air.by_parts, u64::from(is_by_parts));
    assert_eq!(tally.air.intervals, 2);
}

/// A wall that glows at x = 3, and a mirror in its place where asked for.
fn glowing_wall(is_mirror: bool, lights: Vec<Light>) -> Scene {
    let wall = |x: f64| sheets(&[[v(x, -9.0, -9.0), v(0.0, 18.0, 0.0), v(0.0, 0.0, 18.0)]]);
    let glow = Material {
        diffuse: Color::ZERO,
        emission: Color::ONE,
        ..Material::default()
    };
    let mirror = Material {
        diffuse: Color::ZERO,
        reflection: Color::ONE,
        ..Material::default()
    };
    Scene {
        materials: vec![glow, mirror],
        objects: vec![
            object(Shape::Mesh(wall(3.0)), usize::from(is_mirror)),
            object(Shape::Mesh(wall(-2.0)), 0),
        ],
        lights,
        background: Color::ONE,
        ..Scene::default()
    }
}

#[test]
fn the_air_weakens_what_is_behind_it_along_all_rays() {
    let fog = fog(0.25, 0.0);
    let seen = |scene: Scene, direction: DVec3| {
        let prepared = prepared(scene, Method::Auto);
        looked(&prepared, Some(fog), DVec3::ZERO, direction)
    };
    let close = |found: f64, length: f64| {
        let expected = (-0.25 * length).exp();
        assert!(
            (found - expected).abs() < 1e-12,
            "{found} is not {expected}"
        );
    };
    let (color, air, _) = seen(glowing_wall(false, vec![]), DVec3::X);
    close(color.x, 3.0);
    close(air.transmittance, 3.0);
    // To the mirror, and back to the wall behind.
    let (color, air, tally) = seen(glowing_wall(true, vec![]), DVec3::X);
    assert_eq!(tally.reflection, 1);
    close(color.x, 8.0);
    close(air.transmittance, 3.0);
    // Nothing is met: as far as the farthest corner.
    let (color, ..) = seen(glowing_wall(false, vec![]), DVec3::Z);
    close(color.x, v(3.0, 9.0, 9.0).length());
}

#[test]
fn a_wall_that_covers_half_lets_the_air_behind_it_through() {
    let fog = fog(0.25, 0.0);
    let mut scene = glowing_wall(false, vec![sun(DVec3::Z)]);
    let half = Material {
        diffuse: Color::ZERO,
        alpha: antumbra_scene::model::Alpha::Blend,
        opacity: 0.5,
        ..Material::default()
    };
    scene.materials.push(half);
    scene.objects.push(object(
        Shape::Mesh(sheets(&[[
            v(1.0, -9.0, -9.0),
            v(0.0, 18.0, 0.0),
            v(0.0, 0.0, 18.0),
        ]])),
        2,
    ));
    let prepared = prepared(scene, Method::Auto);
    let (color, air, tally) = looked(&prepared, Some(fog), DVec3::ZERO, DVec3::X);
    assert_eq!(tally.passed, 1);
    let between = |begin, end| PI * fog.airlight_of_direction(0.0, begin, end);
    let light = between(0.0, 1.0) + 0.5 * between(1.0, 3.0);
    assert!((air.light.x - light).abs() < 1e-12);
    let expected = light + 0.5 * (-0.75_f64).exp();
    assert!((color.x - expected).abs() < 1e-12, "{color} {expected}");
    assert!((air.transmittance - (-0.25_f64).exp()).abs() < 1e-12);
}

#[test]
fn lights_with_a_place_are_weakened_on_their_way_to_surfaces_and_suns_are_not() {
    let fog = fog(0.25, 0.0);
    let at_floor = |one: Light, fog: Option<Fog>| {
        let scene = Scene {
            materials: vec![Material::default()],
            objects: vec![object(Shape::Mesh(square(6.0, 0.0)), 0)],
            lights: vec![one],
            ..Scene::default()
        };
        let prepared = prepared(scene, Method::Auto);
        let (color, air, _) = looked(&prepared, fog, v(0.0, 0.0, 1.0), -DVec3::Z);
        (color - air.light) / air.transmittance
    };
    for (one, left) in [
        (sun(DVec3::Z), 1.0),
        (lamp(v(0.0, 0.0, 4.0)), (-1.0_f64).exp()),
        (spot(v(0.0, 0.0, 4.0), -DVec3::Z), (-1.0_f64).exp()),
    ] {
        let ratio = at_floor(one.clone(), Some(fog)).x / at_floor(one, None).x;
        assert!((ratio - left).abs() < 1e-12, "{ratio} is not {left}");
    }
}

#[test]
fn small_lights_are_points_and_directions_in_the_limit() {
    let fog = fog(0.3, 0.5);
    let of = |lights: Vec<Light>, areas: Vec<AreaLight>| {
        let mut scene = room(lights);
        scene.area_lights = areas;
        let prepared = prepared(scene, Method::Auto);
        let origin = v(0.4, 0.3, 1.2);
        looked(&prepared, Some(fog), origin, v(2.0, 4.0, 0.1))
            .1
            .light
    };
    let white = |mut one: Light| {
        one.color = Color::ONE;
        one
    };
    let towards = v(1.0, 0.1, 0.5);
    let disc = AreaShape::SunDisc(SunDisc::new(towards, 1e-5).unwrap());
    let (large, small) = (
        of(vec![], vec![area(disc, false)]),
        of(vec![white(sun(towards))], vec![]),
    );
    assert!((large.x / small.x - 1.0).abs() < 1e-5, "{large} {small}");

    let place = v(2.0, 3.0, 2.0);
    // Of 64 samples of a ball about 32 face the ray.
    let ball = AreaShape::Sphere(SphereLight::new(place, 1e-6).unwrap());
    let mut even = white(lamp(place));
    even.falls_off = false;
    let (large, small) = (
        of(vec![], vec![area(ball.clone(), false)]),
        of(vec![even], vec![]),
    );
    assert!((large.x / small.x - 1.0).abs() < 0.03, "{large} {small}");
    // A physical ball of radiance 1 has the intensity pi r^2: over pi, as surfaces count.
    let (large, small) = (
        of(vec![], vec![area(ball, true)]),
        of(vec![white(lamp(place))], vec![]),
    );
    assert!(
        (large.x / (1e-12 * small.x) - 1.0).abs() < 0.05,
        "{large} {small}"
    );

    // Seen along its normal a small sheet is a point, too.
    let sheet =
        RectangleLight::new(v(4.0, 3.0, 1.5), [DVec3::Y * 1e-5, DVec3::Z * 1e-5], true).unwrap();
    let large = of(vec![], vec![area(AreaShape::Rectangle(sheet), false)]);
    let mut even = white(lamp(v(4.0, 3.0, 1.5)));
    even.falls_off = false;
    let small = of(vec![even], vec![]);
    assert!(
        large.x > 0.2 * small.x && large.x < small.x,
        "{large} {small}"
    );
}

#[test]
fn open_air_scatters_half_of_the_skys_light() {
    let scene = Scene {
        materials: vec![Material::default()],
        objects: vec![object(Shape::Mesh(square(6.0, 0.0)), 0)],
        area_lights: vec![area(AreaShape::Sky(Sky::new(DVec3::Z).unwrap()), false)],
        ..Scene::default()
    };
    let prepared = prepared(scene, Method::Auto);
    let fog = Fog::new(0.2, 1.0, 0.0).unwrap();
    let (_, air, tally) = looked(&prepared, Some(fog), v(0.0, 0.0, 4.0), v(1.0, 0.0, -1.0));
    assert!(
        (air.light.x - 0.5 * (1.0 - air.transmittance)).abs() < 1e-12,
        "{air:?}"
    );
    assert_eq!(tally.air.segments, 64);
}

#[test]
fn fog_of_no_density_changes_no_bit() {
    let scene = || room(vec![sun(v(1.0, -0.2, 0.6)), lamp(v(2.0, 3.0, 2.5))]);
    let of = |fog: Option<Fog>| {
        let settings = RenderSettings {
            fog,
            ..RenderSettings::default()
        };
        shot(&prepared(scene(), Method::Auto), &camera(), SIZE, settings).picture
    };
    assert!(of(None) == of(Some(fog(0.0, 0.3))));
    assert!(of(None) != of(Some(fog(1e-3, 0.3))));
}

#[test]
fn foggy_pictures_are_the_same_for_any_method_and_number_of_threads() {
    let scene = || {
        let mut scene = room(vec![
            sun(v(1.0, -0.2, 0.6)),
            lamp(v(2.0, 5.0, 2.5)),
            spot(v(3.0, 1.0, 2.9), v(-0.4, 0.5, -1.0)),
        ]);
        let ball = Sphere {
            center: v(2.5, 4.0, 0.5),
            radius: 0.5,
        };
        scene.materials.push(Material {
            reflection: Color::splat(0.5),
            ..Material::default()
        });
        scene.objects.push(object(Shape::Sphere(ball), 1));
        let edges = [v(0.5, 0.0, 0.0), v(0.0, -0.5, 0.0)];
        scene.area_lights = vec![
            area(
                AreaShape::Rectangle(RectangleLight::new(v(1.0, 2.0, 2.9), edges, false).unwrap()),
                true,
            ),
            area(AreaShape::Sky(Sky::new(DVec3::Z).unwrap()), false),
        ];
        scene
    };
    let of = |method, threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let settings = RenderSettings {
            sampling: Sampling::Stratified { samples: 2 },
            light_samples: 2,
            ..settings(fog(0.2, 0.6))
        };
        pool.install(|| {
            let rendered = shot(&prepared(scene(), method), &camera(), [12, 9], settings);
            (rendered.picture, rendered.tally.air)
        })
    };
    let expected = of(Method::Naive, 1);
    for method in ALL_METHODS {
        for threads in [1, 2, 7] {
            assert!(
                of(method, threads) == expected,
                "{method:?}, {threads} threads"
            );
        }
    }
    let air = expected.1;
    assert!(air.by_parts <= air.segments && air.intervals > 0, "{air:?}");
}

fn in_room(one: Light, fog: Fog) -> Rendered {
    let settings = RenderSettings {
        sampling: Sampling::Stratified { samples: 4 },
        ..settings(fog)
    };
    shot(
        &prepared(room(vec![one]), Method::Auto),
        &camera(),
        SIZE,
        settings,
    )
}

#[test]
fn god_rays_through_a_window_look_as_they_did() {
    let mut one = sun(v(1.0, -0.1, 0.55));
    one.color *= 2.0;
    assert_golden("fog-window", &in_room(one, fog(0.15, 0.3)));
}

#[test]
fn a_spot_in_fog_looks_as_it_did() {
    let mut one = spot(v(2.2, 3.4, 2.9), v(-0.15, 0.1, -1.0));
    one.color *= 6.0;
    assert_golden("fog-spot", &in_room(one, fog(0.15, 0.3)));
}

#[test]
fn the_sun_behind_the_city_looks_as_it_did() {
    let mut scene = antumbra_scene::generate::city(400).unwrap();
    let camera = Camera {
        eye: v(-20.0, -130.0, 26.0),
        at: v(0.0, 0.0, 14.0),
        ..camera()
    };
    scene.background = Color::new(0.25, 0.3, 0.4);
    scene.ambient = Color::splat(0.05);
    scene.lights = vec![sun(v(0.1, 1.0, 0.2))];
    let settings = RenderSettings {
        sampling: Sampling::Stratified { samples: 4 },
        ..settings(fog(0.006, 0.6))
    };
    let rendered = shot(&prepared(scene, Method::Auto), &camera, SIZE, settings);
    assert_golden("fog-city", &rendered);
}
