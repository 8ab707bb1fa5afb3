//! The testkit's scenes as the library has them, and targets that go wrong.

use std::sync::Arc;

use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, OccludersBuilder, Opacity, ReceiverPoint, Sphere,
    SurfaceId,
};
use antumbra_testkit::oracle::{OracleLight, OracleShape, OracleSurface};

use super::Random;

/// The lights of a scene, and some starts.
pub(crate) fn questions(
    scene: &antumbra_testkit::nasty::NastyScene,
) -> (Vec<LightShape>, Vec<ReceiverPoint>) {
    let lights = scene.lights.iter().map(|&shape| light(shape));
    let queries = scene.queries[..8].iter();
    let starts = queries.map(|query| start(query.point, query.surface));
    (lights.collect(), starts.collect())
}

/// A point on a triangle, perhaps at its border or near a point of it.
pub(crate) fn point_near([a, b, c]: [DVec3; 3], given: DVec3, random: &mut Random) -> DVec3 {
    let near = random.pick(&[0.0, 1e-9, 1e-6, 1e-3, 1.0]);
    let [s, t] = [random.unit(), random.unit()];
    let [s, t] = if s + t > 1.0 {
        [1.0 - s, 1.0 - t]
    } else {
        [s, t]
    };
    match random.below(3) {
        0 => a + (b - a) * s + (c - a) * (t * near),
        1 => given + (a + (b - a) * s + (c - a) * t - given) * near,
        _ => a + (b - a) * s + (c - a) * t,
    }
}

/// Builds the library's surfaces with the same numbers as the oracle's.
pub(crate) fn occluders(surfaces: &[OracleSurface]) -> Arc<Occluders> {
    occluders_with(surfaces, |_, _| Opacity::Transparent)
}

/// Builds them with surfaces that are not opaque as `see_through` has them.
pub(crate) fn occluders_with(
    surfaces: &[OracleSurface],
    mut see_through: impl FnMut(&mut OccludersBuilder, usize) -> Opacity,
) -> Arc<Occluders> {
    let v = DVec3::from_array;
    let mut builder = Occluders::builder();
    for (i, surface) in surfaces.iter().enumerate() {
        let opacity = match surface.opaque {
            true => Opacity::Opaque,
            false => see_through(&mut builder, i),
        };
        let added = match surface.shape {
            OracleShape::Triangle(corners) => builder.add_face(&corners.map(v), opacity),
            OracleShape::Sphere { center, radius } => builder.add_sphere(
                Sphere {
                    center: v(center),
                    radius,
                },
                opacity,
            ),
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let is_closed = matches!(
                    surfaces.get(i + 1).map(|next| next.shape),
                    Some(OracleShape::Cap { .. })
                );
                let (base, apex) = (v(base), v(apex));
                let cone = Cone {
                    base,
                    base_radius,
                    apex,
                    apex_radius,
                    is_closed,
                };
                builder.add_cone(cone, opacity)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let disk = Disk {
                    center: v(center),
                    normal: v(normal),
                    radius,
                };
                builder.add_disk(disk, opacity)
            }
            // Added with its tube.
            OracleShape::Cap { .. } => continue,
        };
        added.expect("numbers are in range");
    }
    let occluders = builder.build();
    assert_eq!(
        occluders.surface_count(),
        surfaces.len(),
        "surfaces are numbered alike"
    );
    Arc::new(occluders)
}

pub(crate) fn light(light: OracleLight) -> LightShape {
    match light {
        OracleLight::Point(position) => LightShape::Point(DVec3::from_array(position)),
        OracleLight::Direction(direction) => LightShape::Direction(DVec3::from_array(direction)),
    }
}

pub(crate) fn start(point: [f64; 3], surface: Option<usize>) -> ReceiverPoint {
    let surface = surface.map(|surface| SurfaceId(surface as u32));
    ReceiverPoint {
        point: DVec3::from_array(point),
        surface,
    }
}

/// Targets around a middle as a lamp's samples are: on a square of some size, some of them on a lattice.
pub(crate) fn samples(
    middle: DVec3,
    size: f64,
    count: usize,
    random: &mut Random,
) -> Vec<LightShape> {
    let (u, w) = (random.in_cube(), random.in_cube());
    let samples = (0..count).map(|_| {
        let (mut a, mut b) = (random.real(-1.0, 1.0), random.real(-1.0, 1.0));
        if random.below(4) == 0 {
            (a, b) = (a.round(), b.round());
        }
        LightShape::Point(middle + size * (a * u + b * w))
    });
    samples.collect()
}

/// Some targets of every kind that goes wrong.
pub(crate) fn nasty_targets(
    occluders: &Occluders,
    lights: &[LightShape],
    start: &ReceiverPoint,
    count: usize,
    random: &mut Random,
) -> Vec<LightShape> {
    let bounds = occluders.bounds();
    let size = bounds.size().max_element();
    let surface = |random: &mut Random| SurfaceId(random.below(occluders.surface_count()) as u32);
    let on_triangle = |surface: SurfaceId, random: &mut Random| {
        let [a, b, c] = occluders.triangle_positions(surface)?;
        let (s, t) = (
            random.pick(&[0.0, 1.0, 0.5, 0.3, 3.0, -2.0]),
            random.pick(&[0.0, 1.0, 0.5, 0.3, 3.0, -2.0]),
        );
        Some(a + (b - a) * s + (c - a) * t)
    };
    let mut targets: Vec<LightShape> = Vec::with_capacity(count);
    while targets.len() < count {
        let target = match random.below(12) {
            0 => random.pick(lights),
            // On a surface, its corner, its edge, its plane.
            1 => {
                let surface = surface(random);
                let center = occluders.surface_bounds(surface).center();
                LightShape::Point(on_triangle(surface, random).unwrap_or(center))
            }
            // In the start's own plane, and a little behind it.
            2 => match start.surface.and_then(|own| on_triangle(own, random)) {
                Some(point) => LightShape::Point(point),
                None => LightShape::Point(start.point),
            },
            3 => {
                let mut point = start.point;
                let axis = random.below(3);
                point[axis] = random.pick(&[
                    point[axis],
                    point[axis].next_up(),
                    point[axis].next_down(),
                    point[axis] + 1e-9 * size,
                ]);
                LightShape::Point(point)
            }
            4 => LightShape::Point(1e30 * random.in_cube()),
            5 => LightShape::Direction(random.in_cube()),
            6 => LightShape::Direction(DVec3::from_array(
                [0; 3].map(|_| random.pick(&[0.0, 0.0, 1.0, -1.0, 1e-300, 5e-324])),
            )),
            7 if !targets.is_empty() => targets[random.below(targets.len())],
            8 => LightShape::Point(bounds.center() + size * random.in_cube()),
            // Through a corner of a surface.
            9 => {
                let surface = surface(random);
                let center = occluders.surface_bounds(surface).center();
                let point = on_triangle(surface, random).unwrap_or(center);
                let beyond = random.pick(&[2.0, 1.0 + 1e-15, 1e3]);
                LightShape::Point(start.point + (point - start.point) * beyond)
            }
            10 => {
                let center = bounds.center() + size * random.in_cube();
                let reach = size * random.pick(&[1e-12, 1e-3, 0.1, 1.0, 30.0]);
                targets.extend(samples(center, reach, 40, random));
                continue;
            }
            _ => {
                let direction = random.in_cube();
                let spread = random.pick(&[0.0, 1e-9, 0.01, 0.3]);
                targets.extend(
                    (0..20).map(|_| LightShape::Direction(direction + spread * random.in_cube())),
                );
                continue;
            }
        };
        targets.push(target);
    }
    targets.truncate(count);
    for target in &mut targets {
        if let LightShape::Point(point) = target {
            *point = point.clamp(DVec3::splat(-1.2e30), DVec3::splat(1.2e30));
        }
    }
    targets
}
