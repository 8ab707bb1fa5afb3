//! Laws that need no expected answers, and a count that the scenes put every rule to work.

use super::*;
use crate::nasty::{self, NastyScene};

fn answers(scene: &NastyScene, oracle: &Oracle) -> Vec<bool> {
    let ask = |query: &nasty::NastyQuery| {
        let query = *query;
        scene
            .lights
            .iter()
            .map(move |&light| (query, light))
            .collect::<Vec<_>>()
    };
    scene
        .queries
        .iter()
        .flat_map(ask)
        .map(|(query, light)| oracle.is_blocked(query.point, query.surface, light))
        .collect()
}

#[test]
fn winding_and_the_order_of_corners_do_not_matter() {
    for seed in 0..48 {
        let scene = nasty::scene(seed);
        let turned: Vec<_> = scene
            .surfaces
            .iter()
            .map(|&surface| match surface.shape {
                OracleShape::Triangle([a, b, c]) => OracleSurface {
                    shape: OracleShape::Triangle([c, b, a]),
                    ..surface
                },
                OracleShape::Disk {
                    center,
                    normal,
                    radius,
                } => {
                    let normal = normal.map(|x| -x);
                    OracleSurface {
                        shape: OracleShape::Disk {
                            center,
                            normal,
                            radius,
                        },
                        ..surface
                    }
                }
                _ => surface,
            })
            .collect();
        let (as_is, turned) = (Oracle::new(scene.surfaces.clone()), Oracle::new(turned));
        assert_eq!(
            answers(&scene, &as_is),
            answers(&scene, &turned),
            "{}",
            scene.label()
        );
        for query in &scene.queries {
            let Some(s) = query.surface else { continue };
            let flips = scene.surfaces[s] != turned.surfaces[s];
            for &light in &scene.lights {
                let side = as_is.light_side(query.point, s, light);
                let expected = if flips { -side } else { side };
                assert_eq!(
                    turned.light_side(query.point, s, light),
                    expected,
                    "{}",
                    scene.label()
                );
            }
        }
    }
}

#[test]
fn the_order_of_surfaces_does_not_matter() {
    for seed in 0..48 {
        let mut scene = nasty::scene(seed);
        let before = answers(&scene, &Oracle::new(scene.surfaces.clone()));
        let last = scene.surfaces.len() - 1;
        scene.surfaces.reverse();
        for query in &mut scene.queries {
            query.surface = query.surface.map(|s| last - s);
        }
        let after = answers(&scene, &Oracle::new(scene.surfaces.clone()));
        assert_eq!(before, after, "{}", scene.label());
    }
}

#[test]
fn the_length_of_a_direction_does_not_matter() {
    for seed in 0..48 {
        let mut scene = nasty::scene(seed);
        let oracle = Oracle::new(scene.surfaces.clone());
        let before = answers(&scene, &oracle);
        for light in &mut scene.lights {
            if let OracleLight::Direction(direction) = light {
                *direction = direction.map(|x| x * 2f64.powi(-40));
            }
        }
        assert_eq!(before, answers(&scene, &oracle), "{}", scene.label());
    }
}

#[test]
fn a_far_away_point_light_is_not_asked_to_be_a_direction() {
    // Directions are at infinity, not far away: a wall beyond any point light still counts.
    let wall =
        OracleSurface::triangle([[-1e25, -1e25, 1e20], [1e25, 0.0, 1e20], [0.0, 1e25, 1e20]]);
    let oracle = Oracle::new(vec![wall]);
    assert!(!oracle.is_blocked([0.0; 3], None, OracleLight::Point([0.0, 0.0, 1e19])));
    assert!(oracle.is_blocked([0.0; 3], None, OracleLight::Direction([0.0, 0.0, 1e-300])));
}

#[test]
fn starts_lie_on_their_triangle_and_corners_stay() {
    for seed in 0..48 {
        let scene = nasty::scene(seed);
        let oracle = Oracle::new(scene.surfaces.clone());
        for query in &scene.queries {
            let Some(s) = query.surface else { continue };
            let (OracleShape::Triangle(corners), Prepared::Triangle(own)) =
                (scene.surfaces[s].shape, &oracle.prepared[s])
            else {
                continue;
            };
            let start = own.start(Vec3::new(query.point));
            assert!(start.scale.sign() > 0, "{}", scene.label());
            let [a, b, c] = corners.map(|x| &Vec3::new(x).scale(&start.scale) - &start.scaled);
            let normal = (&b - &a).cross(&(&c - &a));
            assert!(normal.dot(&a).is_zero(), "{}", scene.label());
            for (x, y) in [(&a, &b), (&b, &c), (&c, &a)] {
                let sign = x.cross(y).dot(&normal).sign();
                assert!(sign >= 0, "{}: {query:?}", scene.label());
            }
            for corner in corners {
                let again = own.start(Vec3::new(corner));
                let step = &again.scaled - &Vec3::new(corner).scale(&again.scale);
                assert!(step.is_zero(), "{}", scene.label());
            }
        }
    }
}

/// How often a rule was asked, by its answer.
#[derive(Debug, Default)]
struct Count {
    no: usize,
    yes: usize,
}

impl Count {
    fn add(&mut self, answer: bool) {
        *if answer { &mut self.yes } else { &mut self.no } += 1;
    }
}

#[test]
fn nasty_scenes_put_every_rule_to_work() {
    let (mut moved, mut own_sphere) = (Count::default(), Count::default());
    let (mut own_tube, mut own_solid, mut twin) =
        (Count::default(), Count::default(), Count::default());
    let (mut sphere, mut tube, mut disk) = (Count::default(), Count::default(), Count::default());
    for seed in 0..240 {
        let scene = nasty::scene(seed);
        let oracle = Oracle::new(scene.surfaces);
        for query in &scene.queries {
            if let Some(s) = query.surface
                && let Prepared::Triangle(own) = &oracle.prepared[s]
            {
                let (start, in_plane) = (
                    own.start(Vec3::new(query.point)),
                    own.plane.start(Vec3::new(query.point)),
                );
                let step =
                    &start.scaled.scale(&in_plane.scale) - &in_plane.scaled.scale(&start.scale);
                moved.add(!step.is_zero());
            }
            for &light in &scene.lights {
                let segment = oracle.segment(query.point, query.surface, light);
                for t in (0..oracle.surfaces.len()).filter(|&t| oracle.surfaces[t].opaque) {
                    if let Some(s) = query.surface
                        && let Some(answer) = oracle.own_rule(t, s, &segment)
                    {
                        match (&oracle.prepared[t], oracle.closed_tube[t]) {
                            (_, Some(_)) => own_solid.add(answer),
                            (Prepared::Sphere(_), None) => own_sphere.add(answer),
                            (Prepared::Tube(_), None) => own_tube.add(answer),
                            _ => {}
                        }
                        let both = [s, t].map(|i| oracle.surfaces[i].solid);
                        if s != t && (both[0].is_none() || both[0] != both[1]) {
                            twin.add(answer);
                        }
                        continue;
                    }
                    match &oracle.prepared[t] {
                        Prepared::Sphere(shape) => sphere.add(shape.is_crossed(&segment)),
                        Prepared::Tube(shape) => tube.add(shape.is_crossed(&segment)),
                        Prepared::Disk(shape) => disk.add(shape.is_crossed(&segment)),
                        _ => {}
                    }
                }
            }
        }
    }
    for (rule, count) in [
        ("start moved to its triangle", moved),
        ("own sphere", own_sphere),
        ("own open tube", own_tube),
        ("own closed cone", own_solid),
        ("own rule of a twin", twin),
        ("sphere", sphere),
        ("tube", tube),
        ("disk", disk),
    ] {
        assert!(
            count.no > 100 && count.yes > 100,
            "{rule} is hardly put to work: {count:?}"
        );
    }
}
