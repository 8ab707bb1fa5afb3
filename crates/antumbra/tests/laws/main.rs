//! Laws that answers obey, whatever they are.
//!
//! EXACTNESS.md makes an answer a function of the surfaces' positions, the start and the light. So
//! it cannot depend on what it does not mention (grid, method, order, threads), and keeps its value
//! under every change of the numbers under which the signs of its polynomials keep theirs. The scenes are
//! `antumbra_testkit::nasty`, full of ties; a failure names the seed. Release builds ask many more.

#[path = "../common/mod.rs"]
mod common;
mod invariance;
mod nearest;
mod transforms;
mod values;

use std::sync::Arc;

use antumbra::{Counters, GridResolution, LightId, Method, Shadow, ShadowIndex};
use antumbra_geometry::{
    Cone, DVec3, Disk, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId,
};
use antumbra_testkit::nasty;
use antumbra_testkit::nasty::NastyScene;
use antumbra_testkit::oracle::{OracleLight, OracleShape};

use common::Random;

/// One element with its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Triangle([DVec3; 3]),
    Sphere(Sphere),
    Cone(Cone),
    Disk(Disk),
}

/// A scene that laws can be applied to. Starts name an element and a part of it, because
/// surfaces are numbered anew when elements are added in another order.
#[derive(Clone, Debug)]
struct World {
    label: String,
    elements: Vec<(Shape, Opacity)>,
    lights: Vec<LightShape>,
    starts: Vec<(DVec3, Option<(usize, u32)>)>,
}

impl World {
    fn nasty(seed: u64) -> Self {
        Self::of(&nasty::scene(seed))
    }

    fn of(scene: &NastyScene) -> Self {
        let v = DVec3::from_array;
        let mut elements = Vec::new();
        let mut parts = Vec::new();
        for (i, surface) in scene.surfaces.iter().enumerate() {
            let shape = match surface.shape {
                OracleShape::Triangle(corners) => Shape::Triangle(corners.map(v)),
                OracleShape::Sphere { center, radius } => Shape::Sphere(Sphere {
                    center: v(center),
                    radius,
                }),
                OracleShape::Tube {
                    base,
                    base_radius,
                    apex,
                    apex_radius,
                } => {
                    let next = scene.surfaces.get(i + 1).map(|next| next.shape);
                    Shape::Cone(Cone {
                        base: v(base),
                        base_radius,
                        apex: v(apex),
                        apex_radius,
                        is_closed: matches!(next, Some(OracleShape::Cap { .. })),
                    })
                }
                OracleShape::Disk {
                    center,
                    normal,
                    radius,
                } => Shape::Disk(Disk {
                    center: v(center),
                    normal: v(normal),
                    radius,
                }),
                OracleShape::Cap { .. } => {
                    let (element, part): (usize, u32) = parts[i - 1];
                    parts.push((element, part + 1));
                    continue;
                }
            };
            parts.push((elements.len(), 0));
            let opacity = if surface.opaque {
                Opacity::Opaque
            } else {
                Opacity::Transparent
            };
            elements.push((shape, opacity));
        }
        let lights = scene.lights.iter().map(|light| match *light {
            OracleLight::Point(position) => LightShape::Point(v(position)),
            OracleLight::Direction(direction) => LightShape::Direction(v(direction)),
        });
        let starts = scene
            .queries
            .iter()
            .map(|query| (v(query.point), query.surface.map(|surface| parts[surface])));
        Self {
            label: scene.label(),
            lights: lights.collect(),
            starts: starts.collect(),
            elements,
        }
    }

    fn occluders(&self) -> Arc<Occluders> {
        let mut builder = Occluders::builder();
        for &(shape, opacity) in &self.elements {
            match shape {
                Shape::Triangle(corners) => builder.add_face(&corners, opacity),
                Shape::Sphere(sphere) => builder.add_sphere(sphere, opacity),
                Shape::Cone(cone) => builder.add_cone(cone, opacity),
                Shape::Disk(disk) => builder.add_disk(disk, opacity),
            }
            .unwrap_or_else(|error| panic!("{}: {error}", self.label));
        }
        Arc::new(builder.build())
    }

    fn starts(&self, occluders: &Occluders) -> Vec<ReceiverPoint> {
        let surface_of = |(element, part): (usize, u32)| {
            SurfaceId(occluders.elements()[element].surfaces.start + part)
        };
        self.starts
            .iter()
            .map(|&(point, surface)| ReceiverPoint {
                point,
                surface: surface.map(surface_of),
            })
            .collect()
    }

    fn index(&self, method: Method, grid: [u32; 3]) -> ShadowIndex {
        ShadowIndex::builder(self.occluders(), self.lights.clone())
            .method(method)
            .grid(GridResolution::Fixed(grid))
            .build()
            .unwrap_or_else(|error| panic!("{}: {error}", self.label))
    }

    /// For every start and light whether it is in shadow, and the side of the light.
    fn answers_of(&self, index: &ShadowIndex) -> Vec<(bool, i8)> {
        let starts = self.starts(index.occluders());
        let ask = |start: &ReceiverPoint| {
            let start = *start;
            (0..self.lights.len()).map(move |light| {
                let answer = index
                    .shadow(&start, LightId::from_index(light), &mut Counters::default())
                    .expect("a fine query");
                (
                    answer.shadow == Shadow::Shadowed,
                    index
                        .light_side(&start, LightId::from_index(light))
                        .expect("a fine query"),
                )
            })
        };
        starts.iter().flat_map(ask).collect()
    }

    /// The reference, and the paper's method on a grid, which must agree.
    fn answers(&self) -> Vec<(bool, i8)> {
        let expected = self.answers_of(&self.index(Method::Naive, [1; 3]));
        let found = self.answers_of(&self.index(Method::Voxel1990, [7, 5, 6]));
        self.assert_same("voxel occlusion testing", &expected, &found);
        expected
    }

    fn assert_same(&self, what: &str, expected: &[(bool, i8)], found: &[(bool, i8)]) {
        assert_eq!(expected.len(), found.len(), "{}", self.label);
        for (i, (expected, found)) in expected.iter().zip(found).enumerate() {
            let (start, light) = (i / self.lights.len(), i % self.lights.len());
            assert_eq!(
                expected, found,
                "{}: {what}: start {:?}, light {:?}; left is before, right after",
                self.label, self.starts[start], self.lights[light]
            );
        }
    }
}

/// Applies a change to everything that is a position, a length or a direction.
struct Change<'a> {
    point: &'a dyn Fn(DVec3) -> DVec3,
    vector: &'a dyn Fn(DVec3) -> DVec3,
    length: f64,
}

impl World {
    fn changed(&self, change: &Change<'_>) -> Self {
        let Change {
            point,
            vector,
            length,
        } = *change;
        let shape = |shape: Shape| match shape {
            Shape::Triangle(corners) => Shape::Triangle(corners.map(point)),
            Shape::Sphere(Sphere { center, radius }) => Shape::Sphere(Sphere {
                center: point(center),
                radius: radius * length,
            }),
            Shape::Cone(cone) => Shape::Cone(Cone {
                base: point(cone.base),
                base_radius: cone.base_radius * length,
                apex: point(cone.apex),
                apex_radius: cone.apex_radius * length,
                ..cone
            }),
            Shape::Disk(disk) => Shape::Disk(Disk {
                center: point(disk.center),
                normal: vector(disk.normal),
                radius: disk.radius * length,
            }),
        };
        Self {
            label: self.label.clone(),
            elements: self.elements.iter().map(|&(s, o)| (shape(s), o)).collect(),
            lights: self
                .lights
                .iter()
                .map(|light| match *light {
                    LightShape::Point(position) => LightShape::Point(point(position)),
                    LightShape::Direction(direction) => LightShape::Direction(vector(direction)),
                })
                .collect(),
            starts: self.starts.iter().map(|&(p, s)| (point(p), s)).collect(),
        }
    }

    /// All numbers, for bit-by-bit comparison.
    fn numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for &(shape, _) in &self.elements {
            match shape {
                Shape::Triangle(corners) => {
                    numbers.extend(corners.iter().flat_map(|c| c.to_array()));
                }
                Shape::Sphere(Sphere { center, radius }) => {
                    numbers.extend(center.to_array());
                    numbers.push(radius);
                }
                Shape::Cone(cone) => {
                    numbers.extend(cone.base.to_array().into_iter().chain(cone.apex.to_array()));
                    numbers.extend([cone.base_radius, cone.apex_radius]);
                }
                Shape::Disk(disk) => {
                    numbers.extend(disk.center.to_array());
                    numbers.extend(disk.normal.to_array());
                    numbers.push(disk.radius);
                }
            }
        }
        for light in &self.lights {
            numbers.extend(light.homogeneous().0.to_array());
        }
        numbers.extend(self.starts.iter().flat_map(|(p, _)| p.to_array()));
        numbers
    }

    /// Leaves out starts and lights that a change would round (`there and back` is not the same);
    /// `None` if a surface would be rounded or leave the range.
    fn exact_under(&self, there: &Change<'_>, back: &Change<'_>) -> Option<Self> {
        let is_exact = |world: &Self| {
            let there = world.changed(there);
            let largest = there.numbers().into_iter().fold(0.0, |m, x| x.abs().max(m));
            largest <= 2f64.powi(100) && there.changed(back).numbers() == world.numbers()
        };
        let with = |lights: Vec<LightShape>, starts: Vec<(DVec3, Option<(usize, u32)>)>| Self {
            lights,
            starts,
            ..self.clone()
        };
        if !is_exact(&with(Vec::new(), Vec::new())) {
            return None;
        }
        let mut lights = self.lights.clone();
        lights.retain(|&light| is_exact(&with(vec![light], Vec::new())));
        let mut starts = self.starts.clone();
        starts.retain(|&start| is_exact(&with(Vec::new(), vec![start])));
        (!lights.is_empty() && !starts.is_empty()).then(|| with(lights, starts))
    }
}

impl Random {
    fn shuffled(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        for i in (1..count).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// The scenes that a law is tried on: `few` in a debug build; `ANTUMBRA_LAW_SEEDS=from..to` for others.
fn seeds(few: u64) -> std::ops::Range<u64> {
    if let Ok(text) = std::env::var("ANTUMBRA_LAW_SEEDS") {
        let (from, to) = text
            .split_once("..")
            .expect("ANTUMBRA_LAW_SEEDS is from..to");
        return from.parse().expect("a number")..to.parse().expect("a number");
    }
    // All families in all frames take 144 seeds.
    if cfg!(debug_assertions) {
        0..few
    } else {
        0..few.max(144) * 3
    }
}
