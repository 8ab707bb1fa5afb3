//! Soft shadows: pictures of a ball over a floor, lit by lights with size.

mod support;

use std::sync::Arc;

use antumbra::{IndexOptions, Method};
use antumbra_geometry::{
    AreaShape, DVec3, DiskLight, MeshLight, PolygonLight, RectangleLight, SegmentLight, Sky,
    Sphere, SphereLight, SunDisc, TriangleLight,
};
use antumbra_render::aov::Aovs;
use antumbra_render::camera::View;
use antumbra_render::film::{
    RenderSettings, Rendered, Sampling, Show, Watch, Window, render, render_window,
};
use antumbra_render::prepare::Prepared;
use antumbra_scene::gather::emissive_lights;
use antumbra_scene::model::{
    AreaLight, Camera, Color, Light, LightKind, Material, Object, Scene, Shape,
};
use antumbra_task::Task;
use support::{assert_golden, object, square};

const SIZE: [u32; 2] = [96, 72];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn area(shape: AreaShape) -> AreaLight {
    AreaLight {
        name: String::new(),
        shape,
        color: Color::ONE,
        falls_off: false,
    }
}

/// A lamp of `width` by `width` that shines down from above.
fn lamp(width: f64) -> AreaShape {
    let edges = [v(0.0, width, 0.0), v(width, 0.0, 0.0)];
    AreaShape::Rectangle(RectangleLight::new(v(1.5, 0.5, 4.0), edges, false).unwrap())
}

fn sun(degrees: f64) -> AreaShape {
    AreaShape::SunDisc(SunDisc::new(v(1.0, 0.4, 1.0), degrees).unwrap())
}

/// A ball that touches a floor.
fn ball_on_floor(lights: Vec<AreaShape>) -> Scene {
    let ball = Sphere {
        center: v(0.0, 0.0, 0.6),
        radius: 0.6,
    };
    Scene {
        materials: vec![Material::default()],
        objects: vec![
            object(Shape::Mesh(square(8.0, 0.0)), 0),
            object(Shape::Sphere(ball), 0),
        ],
        area_lights: lights.into_iter().map(area).collect(),
        ..Scene::default()
    }
}

fn camera() -> Camera {
    Camera {
        eye: v(-1.0, -5.5, 3.5),
        at: v(-0.4, 0.0, 0.2),
        up: DVec3::Z,
        vertical_fov_degrees: 36.0,
        resolution: None,
    }
}

fn shot_with(prepared: &Prepared, settings: RenderSettings) -> Rendered {
    let view = View::new(&camera(), SIZE).unwrap();
    let watch = Watch {
        task: &Task::default(),
        progress: &|_| {},
    };
    render(prepared, &view, &settings, watch)
}

fn prepared(scene: Scene, method: Method) -> Prepared {
    let options = IndexOptions {
        method,
        ..IndexOptions::default()
    };
    Prepared::new(scene, &options).unwrap()
}

fn settings(light_samples: u32) -> RenderSettings {
    RenderSettings {
        light_samples,
        ..RenderSettings::default()
    }
}

fn shot(scene: Scene, light_samples: u32) -> Rendered {
    shot_with(&prepared(scene, Method::Bvh), settings(light_samples))
}

#[test]
fn a_ball_under_a_lamp_looks_as_it_did() {
    assert_golden("soft-rectangle", &shot(ball_on_floor(vec![lamp(1.5)]), 64));
}

#[test]
fn a_ball_in_the_sun_looks_as_it_did() {
    assert_golden("soft-sun", &shot(ball_on_floor(vec![sun(8.0)]), 64));
}

#[test]
fn umbra_penumbra_and_lit_look_as_they_did() {
    let show = RenderSettings {
        show: Show::Occlusion,
        ..settings(64)
    };
    let prepared = prepared(ball_on_floor(vec![lamp(0.7)]), Method::Bvh);
    assert_golden("soft-regions", &shot_with(&prepared, show));
}

#[test]
fn pictures_are_the_same_for_any_method_and_number_of_threads() {
    let lights = || {
        let corners = [v(-3.0, 1.0, 3.0), v(-2.0, 3.0, 3.0), v(-2.0, 1.0, 2.0)];
        let square = [
            v(-3.0, -1.0, 3.0),
            v(-3.0, 1.0, 3.0),
            v(-2.0, 1.0, 3.0),
            v(-2.0, -1.0, 3.0),
        ];
        let ends = [v(-3.0, -2.0, 2.0), v(3.0, -2.0, 2.0)];
        vec![
            lamp(1.0),
            sun(3.0),
            AreaShape::Sky(Sky::new(DVec3::Z).unwrap()),
            AreaShape::Sphere(SphereLight::new(v(-2.0, -2.0, 2.0), 0.4).unwrap()),
            AreaShape::Segment(SegmentLight::new(ends).unwrap()),
            AreaShape::Triangle(TriangleLight::new(corners, true).unwrap()),
            AreaShape::Polygon(Arc::new(PolygonLight::new(square.to_vec(), false).unwrap())),
        ]
    };
    let scene = || {
        let mut scene = ball_on_floor(lights());
        scene.lights.push(Light {
            name: String::new(),
            kind: LightKind::Point {
                position: v(2.0, -2.0, 5.0),
            },
            color: Color::splat(0.3),
            falls_off: false,
        });
        scene.materials[0].reflection = Color::splat(0.2);
        scene
    };
    let of = |method, threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let settings = RenderSettings {
            sampling: Sampling::Stratified { samples: 2 },
            ..settings(5)
        };
        pool.install(|| {
            let rendered = shot_with(&prepared(scene(), method), settings);
            (rendered.picture, rendered.tally.area)
        })
    };
    let expected = of(Method::Naive, 1);
    for method in [
        Method::Grid,
        Method::Bvh,
        Method::Voxel1990,
        Method::Voxel,
        Method::Auto,
    ] {
        for threads in [1, 3] {
            let found = of(method, threads);
            assert!(found == expected, "{method:?}, {threads} threads");
        }
    }
    let area = expected.1;
    assert_eq!(
        area.points,
        area.facing_away + area.umbra + area.penumbra + area.lit
    );
    assert!(area.umbra > 0 && area.penumbra > 0 && area.lit > 0 && area.facing_away > 0);
    assert!(area.asked < area.samples && area.blocked < area.asked);
}

#[test]
fn pixels_of_a_window_are_those_of_the_picture() {
    let prepared = prepared(ball_on_floor(vec![lamp(1.0), sun(3.0)]), Method::Auto);
    let view = View::new(&camera(), SIZE).unwrap();
    let task = Task::default();
    let watch = Watch {
        task: &task,
        progress: &|_| {},
    };
    let two = Sampling::Stratified { samples: 2 };
    for sampling in [two, Sampling::Corners] {
        let aovs = Aovs {
            shadow: true,
            ..Aovs::default()
        };
        let settings = RenderSettings {
            sampling,
            aovs,
            ..settings(5)
        };
        let whole = render(&prepared, &view, &settings, watch);
        let width = SIZE[0] as usize;
        let window = Window {
            first: [17, 9],
            size: [40, 31],
        };
        let part = render_window(&prepared, &view, window, &settings, watch);
        assert_eq!(part.picture.size, window.size);
        let places: Vec<_> = (9..40)
            .flat_map(|row| (17..57).map(move |column| row * width + column))
            .collect();
        let colors: Vec<_> = places.iter().map(|&at| whole.picture.pixels[at]).collect();
        assert!(part.picture.pixels == colors, "colors differ, {sampling:?}");
        assert!(colors.iter().any(|color| *color != colors[0]));
        for (found, all) in part.layers.iter().zip(&whole.layers) {
            for ((_, found), (_, all)) in found.channels.iter().zip(&all.channels) {
                let expected: Vec<_> = places.iter().map(|&at| all[at]).collect();
                assert!(*found == expected, "a layer differs, {sampling:?}");
            }
        }
        assert_eq!(part.layers.len(), 2);
    }
}

/// Returns the brightness of the floor along a row of points, seen straight from above.
fn profile(light: AreaShape, from: DVec3, to: DVec3, count: u32) -> Vec<f64> {
    use antumbra::{Counters, LightSamples, LightSampling, ReceiverSide};
    let prepared = prepared(ball_on_floor(vec![]), Method::Bvh);
    let floor = antumbra_geometry::SurfaceId(0);
    let mut samples = LightSamples::default();
    (0..count)
        .map(|step| {
            let point = from + (to - from) * (f64::from(step) / f64::from(count - 1));
            let start = prepared.index().occluders().start_on(floor, point);
            let mut counters = Counters::default();
            let sampling = LightSampling::new(1024);
            let side = ReceiverSide::Both;
            let step = u64::from(step);
            let index = prepared.index();
            index
                .sample_light(
                    &start,
                    side,
                    &light,
                    step,
                    &sampling,
                    &mut samples,
                    &mut counters,
                )
                .unwrap();
            samples.visible_fraction()
        })
        .collect()
}

#[test]
fn a_penumbra_grows_smoothly_with_the_light_and_with_the_distance() {
    // Across the edge of the ball's shadow in the sun, at its widest part and beyond the ball.
    let towards = v(-1.0, -0.4, 0.0).normalize();
    let across = v(0.4, -1.0, 0.0).normalize();
    let width = |degrees: f64, behind: f64| {
        let middle = towards * behind;
        let fractions = profile(sun(degrees), middle, middle + 1.5 * across, 301);
        assert_eq!(fractions[300], 1.0, "the floor is lit far from the shadow");
        for pair in fractions.windows(2) {
            // No way back into the dark by more than what 1024 samples leave in doubt, and no leap.
            assert!(pair[1] > pair[0] - 0.02, "{degrees} {behind}: {pair:?}");
        }
        fractions.iter().filter(|&&f| f > 0.02 && f < 0.98).count()
    };
    let [small, medium, large] = [1.0, 4.0, 12.0].map(|degrees| width(degrees, 0.6));
    assert!(
        0 < small && 3 * small < medium && 2 * medium < large,
        "{small} {medium} {large}"
    );
    // A leap where the sun is small, none where it is large.
    let leap = |degrees: f64| {
        let middle = towards * 0.6;
        let fractions = profile(sun(degrees), middle, middle + 1.5 * across, 301);
        fractions
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(0.0, f64::max)
    };
    assert!(
        leap(0.01) > 0.95 && leap(12.0) < 0.08,
        "{} {}",
        leap(0.01),
        leap(12.0)
    );
}

#[test]
fn a_shadow_is_hard_where_the_ball_touches_the_floor() {
    // Near the foot of the ball the lamp is wholly hidden, however large it is.
    let under = profile(lamp(1.0), v(-0.05, 0.0, 0.0), v(0.05, 0.0, 0.0), 11);
    assert!(under.iter().all(|&fraction| fraction == 0.0), "{under:?}");
    // Farther away part of it is seen.
    let beyond = profile(lamp(1.0), v(-0.4, -0.1, 0.0), v(-1.6, -0.5, 0.0), 40);
    assert!(beyond.iter().any(|&f| f > 0.1 && f < 0.9), "{beyond:?}");
}

#[test]
fn open_ground_has_the_skys_color_and_a_wall_in_the_open_half_of_it() {
    let sky = AreaShape::Sky(Sky::new(DVec3::Z).unwrap());
    let mut scene = ball_on_floor(vec![sky]);
    scene.objects.pop();
    scene.area_lights[0].color = Color::new(0.5, 0.25, 1.0);
    let picture = shot(scene, 256).picture;
    let middle = picture.pixels[(SIZE[0] * SIZE[1] / 2 + SIZE[0] / 2) as usize];
    for (found, expected) in middle.iter().zip([0.4, 0.2, 0.8]) {
        assert!((found - expected).abs() < 0.004, "{middle:?}");
    }
}

#[test]
fn a_light_that_falls_off_lights_as_bright_as_it_looks() {
    // Under the middle of a disk the irradiance over pi is its radiance times R^2 / (R^2 + h^2): 0.8 here.
    let down = v(0.0, 0.0, -1.0);
    let panel = DiskLight::new(v(-0.4, 0.0, 6.0), down, 12.0, false).unwrap();
    let mut scene = ball_on_floor(vec![AreaShape::Disk(panel)]);
    scene.objects.pop();
    scene.area_lights[0].falls_off = true;
    let picture = shot(scene, 256).picture;
    let [width, height] = SIZE.map(|side| side as usize);
    let middle = (0..80).map(|i| [width / 2 - 5 + i % 10, height / 2 - 4 + i / 10]);
    let sum: f32 = middle.map(|[x, y]| picture.pixels[y * width + x][0]).sum();
    // The floor's diffuse color is 0.8.
    assert!((sum / 80.0 - 0.64).abs() < 0.01, "{}", sum / 80.0);
}

#[test]
fn a_small_light_is_a_point_in_the_limit() {
    let at = v(1.5, 0.5, 4.0);
    let small = AreaShape::Sphere(SphereLight::new(at, 1e-6).unwrap());
    let soft = shot(ball_on_floor(vec![small]), 4);
    let mut hard = ball_on_floor(vec![]);
    hard.lights.push(Light {
        name: String::new(),
        kind: LightKind::Point { position: at },
        color: Color::ONE,
        falls_off: false,
    });
    let hard = shot(hard, 4);
    let pixels = soft.picture.pixels.iter().zip(&hard.picture.pixels);
    let far = pixels.filter(|(a, b)| (a[0] - b[0]).abs() > 1e-4).count();
    assert!(far <= 1, "{far}");
}

#[test]
fn faces_that_emit_become_one_light_an_object_and_cast_no_shadow_on_what_they_light() {
    let mut scene = ball_on_floor(vec![]);
    scene.materials.push(Material {
        emission: Color::new(3.0, 2.0, 1.0),
        is_double_sided: false,
        ..Material::default()
    });
    // A tilted lamp of two squares, wound to shine down.
    let mut panel = square(0.7, 0.0);
    panel.corners.reverse();
    for position in &mut panel.positions {
        *position = v(
            position.x + 0.1 * position.y,
            position.y,
            3.0 + 0.3 * position.x,
        );
    }
    scene.objects.push(Object {
        name: "panel".into(),
        ..object(Shape::Mesh(panel), 1)
    });
    let lights = emissive_lights(&scene).unwrap();
    assert_eq!(lights.len(), 1);
    assert_eq!(lights[0].name, "panel");
    assert_eq!(lights[0].color, Color::new(3.0, 2.0, 1.0));
    let AreaShape::Mesh(mesh) = &lights[0].shape else {
        panic!("{:?}", lights[0]);
    };
    assert_eq!(mesh.triangles().len(), 2);
    scene.area_lights = lights;
    scene.objects.remove(1);
    let rendered = shot(scene, 64);
    assert!(rendered.tally.area.lit > 1000, "{:?}", rendered.tally.area);
    assert_eq!(
        rendered.tally.area.blocked, 0,
        "the lamp hides none of itself"
    );
}

#[test]
fn objects_that_emit_without_faces_or_area_give_no_light() {
    let mut scene = ball_on_floor(vec![]);
    scene.materials[0].emission = Color::ONE;
    let Shape::Mesh(floor) = &mut scene.objects[0].shape else {
        panic!("no floor");
    };
    floor.positions.fill(DVec3::ZERO);
    assert_eq!(emissive_lights(&scene), Ok(Vec::new()));
    let empty = MeshLight::new(Vec::new(), true);
    assert!(empty.is_err());
}
