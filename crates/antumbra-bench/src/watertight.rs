//! `antumbra-bench watertight`: rays aimed at vertices and edges, which must not leak through.
//!
//! The built-in meshes have coordinates so short that `f32` holds them: whoever leaks had the same
//! mesh. Each is asked under two lights. Under one, starts and directions are exact too, and the
//! segments go exactly through what they aim at, so that every sign is a tie. Under the other
//! nothing is exact, and segments go by on either side by a rounding.

use antumbra_baselines::embree::{Embree, EmbreeWay, Geometry};
use antumbra_baselines::{Batch, ShadowMethod};
use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};
use antumbra_scene::gather::Gathered;
use antumbra_scene::generate;
use antumbra_scene::model::{Color, Light, LightKind, Material, Object, Polygon, Scene, Shape};
use serde::Serialize;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::load;
use antumbra_cli::screen::Screen;

use super::aims::{Aims, aims};
use super::measure::{self, Stopwatch};
use super::typed::Watertight;
use super::{methods, subject};
use antumbra_cli::outputs::Outputs;

/// Vertices along a side: 256^2 cells and 255^2 inner vertices.
const HEIGHTFIELD: u32 = 257;
/// Cells round and from pole to pole, and roundings of coordinates a unit.
const SPHERE: [u32; 2] = [128, 64];
const SPHERE_STEPS: f64 = 1024.0;

/// A mesh to aim at.
struct Target {
    name: String,
    scene: Scene,
    light: DVec3,
    /// How far behind the mesh starts lie, in distances to the light.
    reach: f64,
}

/// What one method let through.
#[derive(Debug, Serialize)]
struct Leaks {
    mesh: String,
    method: String,
    aimed_at: &'static str,
    rays: usize,
    leaks: usize,
    is_ours: bool,
}

pub(super) fn run(typed: &Watertight, screen: &Screen) -> Result<Outcome, Failure> {
    antumbra_cli::commands::on_threads(&typed.threads, || work(typed, screen))?
}

fn work(typed: &Watertight, screen: &Screen) -> Result<Outcome, Failure> {
    let outputs = typed.figures.outputs(&typed.meshes)?;
    let embree = Embree::load(1);
    if let Err(error) = &embree {
        screen.warning(format!("{error}; its rows are left out"));
    }
    let mut targets: Vec<_> = heightfields().into_iter().chain(spheres()).collect();
    for path in &typed.meshes {
        targets.push(file(path, typed, &outputs, screen)?);
    }
    let mut all = Vec::new();
    for target in &targets {
        let leaks = leaks(target, typed, embree.as_ref().ok())?;
        for Leaks {
            mesh,
            method,
            aimed_at,
            rays,
            leaks,
            ..
        } in &leaks
        {
            screen.result(format!(
                "{mesh:<20} {aimed_at:<12} {method:<14} {leaks:>8} of {rays} rays leak"
            ));
        }
        all.extend(leaks);
    }
    let figures = serde_json::json!({ "schema": 1, "leaks": all });
    typed.figures.write(&figures)?;
    let is_clean = all.iter().all(|leaks| !leaks.is_ours || leaks.leaks == 0);
    Ok(if is_clean {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

/// Sends all rays at one mesh through all methods.
fn leaks(
    target: &Target,
    typed: &Watertight,
    embree: Option<&Embree>,
) -> Result<Vec<Leaks>, Failure> {
    let gathered = Gathered::of(&target.scene)?;
    let lights = [Light {
        name: String::new(),
        kind: LightKind::Point {
            position: target.light,
        },
        color: Color::ONE,
        falls_off: false,
    }];
    let chosen = methods::chosen(&[]);
    let ours = methods::build(
        &chosen,
        &gathered,
        &lights,
        None,
        &typed.cost,
        Stopwatch::new(0),
    )?;
    let geometry = Geometry::of_triangles(gathered.occluders());
    let rivals = embree.map(|embree| {
        [("embree", false), ("embree robust", true)]
            .map(|(name, is_robust)| (name, embree.build(&geometry, is_robust)))
    });

    let Some(first) = ours.first() else {
        return Ok(Vec::new());
    };
    let Aims {
        vertices,
        edge_points,
        midpoints,
    } = aims(first.method.index(), target.light, target.reach);
    let sets = [
        ("vertices", vertices),
        ("edge points", edge_points),
        ("midpoints", midpoints),
    ];
    let mut all = Vec::new();
    for (aimed_at, starts) in sets {
        let batch = batch(starts, target.light);
        let mut tell = |method: &dyn ShadowMethod, name: &str, is_ours| {
            let answers = measure::answers(&*method.load(&batch), batch.starts.len());
            all.push(Leaks {
                mesh: target.name.clone(),
                method: name.to_owned(),
                aimed_at,
                rays: answers.len(),
                leaks: answers.iter().filter(|&&is_shadowed| !is_shadowed).count(),
                is_ours,
            });
        };
        for built in &ours {
            tell(&built.method, built.method.name(), true);
        }
        for (name, scene) in rivals.iter().flatten() {
            let scene = scene
                .as_ref()
                .map_err(|error| subject::failure(error.clone()))?;
            tell(&scene.method(EmbreeWay::Single), name, false);
        }
    }
    Ok(all)
}

fn batch(starts: Vec<ReceiverPoint>, light: DVec3) -> Batch {
    Batch {
        light: 0,
        light_shape: LightShape::Point(light),
        normals: vec![DVec3::ZERO; starts.len()],
        starts,
        is_coherent: false,
    }
}

/// The bench's own height field under lights so high that every face faces them.
fn heightfields() -> [Target; 2] {
    [
        ("height field", DVec3::new(3.3, 5.7, 1033.1)),
        ("height field, exact", DVec3::new(3.0, 5.0, 2048.0)),
    ]
    .map(|(name, light)| Target {
        name: name.into(),
        scene: generate::heightfield(HEIGHTFIELD).expect("the size is in range"),
        light,
        reach: 1.0,
    })
}

/// A closed mesh around lights near its middle.
fn spheres() -> [Target; 2] {
    [
        ("sphere", DVec3::new(0.047, -0.031, 0.077)),
        ("sphere, exact", DVec3::new(3.0, -2.0, 5.0) / 64.0),
    ]
    .map(|(name, light)| Target {
        name: name.into(),
        scene: sphere(),
        light,
        reach: 1.0,
    })
}

fn sphere() -> Scene {
    let [around, down] = SPHERE;
    let vertex = |i: u32, j: u32| {
        let [longitude, latitude] = [
            std::f64::consts::TAU * f64::from(i % around) / f64::from(around),
            std::f64::consts::PI * f64::from(j) / f64::from(down),
        ];
        let ((sine, cosine), (across, height)) = (libm::sincos(longitude), libm::sincos(latitude));
        let point = DVec3::new(across * cosine, across * sine, height);
        // Adding zero makes -0 and 0 one.
        (point * SPHERE_STEPS).round() / SPHERE_STEPS + DVec3::ZERO
    };
    let mut objects = Vec::new();
    let mut add = |vertices: [DVec3; 3]| {
        objects.push(Object {
            name: String::new(),
            shape: Shape::Polygon(Polygon {
                vertices: vertices.to_vec(),
                normals: Vec::new(),
            }),
            material: 0,
        });
    };
    for i in 0..around {
        for j in 0..down {
            let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(u, v)| vertex(i + u, j + v));
            // One triangle a cell at the poles.
            if j + 1 < down {
                add([a, b, c]);
            }
            if j > 0 {
                add([a, c, d]);
            }
        }
    }
    Scene {
        materials: vec![Material::default()],
        objects,
        ..Scene::default()
    }
}

/// A mesh from a file, under a light high over it unless one is typed. Starts lie near behind what
/// they aim at; another part of the mesh may still be in between, which hides a leak.
fn file(
    path: &std::path::Path,
    typed: &Watertight,
    outputs: &Outputs,
    screen: &Screen,
) -> Result<Target, Failure> {
    let scene = load::lit_scene(&typed.light.file(path), &typed.cost, outputs, screen)?.scene;
    let bounds = scene.bounds();
    let light = match scene.lights.first().map(|light| light.kind) {
        Some(LightKind::Point { position }) if typed.light.is_given() => position,
        _ => bounds.center() + 2.0 * bounds.size().length() * scene.up.normalize_or_zero(),
    };
    let name = path.file_stem().unwrap_or_default();
    Ok(Target {
        name: name.to_string_lossy().into_owned(),
        scene,
        light,
        reach: 1.0 / 64.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_scene::gather::light_shapes;

    #[test]
    fn built_in_meshes_have_the_inner_vertices_they_should() {
        let field = [255 * 255, 3 * 256 * 256 - 2 * 256];
        let ball = [2 + 128 * 63, 128 * (63 + 64 + 62)];
        let targets = heightfields().into_iter().chain(spheres());
        for (target, [vertices, edges]) in targets.zip([field, field, ball, ball]) {
            let gathered = Gathered::of(&target.scene).unwrap();
            let light = Light {
                name: String::new(),
                kind: LightKind::Point {
                    position: target.light,
                },
                color: Color::ONE,
                falls_off: false,
            };
            let options = antumbra::IndexOptions {
                method: antumbra::Method::Grid,
                ..Default::default()
            };
            let index = options
                .build(gathered.occluders(), light_shapes(&[light]))
                .unwrap();
            let aims = aims(&index, target.light, target.reach);
            assert_eq!(aims.vertices.len(), vertices, "{}", target.name);
            assert_eq!(aims.midpoints.len(), edges, "{}", target.name);
            assert_eq!(aims.edge_points.len(), 2 * edges, "{}", target.name);
            let starts = aims.vertices.iter().chain(&aims.edge_points);
            let is_exact = starts
                .map(|start| start.point)
                .all(|point| point.as_vec3().as_dvec3() == point);
            assert_eq!(is_exact, target.name.ends_with("exact"));
        }
    }
}
