//! Where queries of `verify` start.
//!
//! In: a number and a seed. Out: a start, a pure function of both and the scene. The kinds take
//! turns; where a kind has no point (no triangle, nothing seen), a free point stands in.

use std::f64::consts::TAU;

use antumbra::{Counters, ShadowIndex};
use antumbra_geometry::{Bounds, Cone, DVec3, Ray, Start, SurfaceId};
use antumbra_render::prepare::Gathered;
use antumbra_render::sampler::uniform;
use antumbra_scene::model::{Scene, Shape};

/// A stream of numbers in `0..1`.
struct Random {
    seed: u64,
    start: u64,
    drawn: u64,
}

impl Random {
    fn draw(&mut self) -> f64 {
        self.drawn += 1;
        uniform(&[self.seed, self.start, self.drawn])
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.draw() * count as f64) as usize).min(count.saturating_sub(1))
    }

    fn in_box(&mut self, bounds: &Bounds) -> DVec3 {
        bounds.min + bounds.size() * DVec3::new(self.draw(), self.draw(), self.draw())
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.draw() - 1.0;
        let (sine, cosine) = libm::sincos(TAU * self.draw());
        let across = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(across * cosine, across * sine, z)
    }
}

/// Returns start number `number`.
pub(super) fn start(
    number: u64,
    seed: u64,
    scene: &Scene,
    gathered: &Gathered,
    index: &ShadowIndex,
) -> Start {
    let mut random = Random {
        seed,
        start: number,
        drawn: 0,
    };
    let surface_count = gathered.occluders().surface_count();
    let bounds = reach(gathered);
    let surface = (surface_count > 0).then(|| SurfaceId(random.below(surface_count) as u32));
    let on_surface = match number % 10 {
        0..=3 => seen(&mut random, &bounds, index),
        4..=5 => surface.and_then(|surface| inside(&mut random, surface, scene, gathered, index)),
        6 => surface.and_then(|surface| on_edge(&mut random, surface, gathered)),
        7 => surface.and_then(|surface| on_vertex(&mut random, surface, gathered)),
        8 => surface
            .and_then(|surface| on_vertex(&mut random, surface, gathered))
            .map(|start| Start {
                surface: None,
                ..start
            }),
        _ => None,
    };
    on_surface.unwrap_or_else(|| Start {
        point: random.in_box(&bounds),
        surface: None,
    })
}

/// Returns the box that views and free points come from: somewhat more than the scene.
fn reach(gathered: &Gathered) -> Bounds {
    let bounds = gathered.occluders().bounds();
    if bounds.is_empty() {
        return Bounds {
            min: DVec3::NEG_ONE,
            max: DVec3::ONE,
        };
    }
    bounds.inflated(DVec3::splat(0.1 * bounds.size().max_element()))
}

/// Returns the point that a random view sees: an eye around the scene looks at some point of it.
fn seen(random: &mut Random, bounds: &Bounds, index: &ShadowIndex) -> Option<Start> {
    let aim = random.in_box(bounds);
    let distance = (0.2 + 1.3 * random.draw()) * bounds.size().length();
    let eye = bounds.center() + distance * random.direction();
    cast(eye, aim - eye, index)
}

fn cast(origin: DVec3, direction: DVec3, index: &ShadowIndex) -> Option<Start> {
    if !(direction.is_finite() && direction != DVec3::ZERO) {
        return None;
    }
    let ray = Ray {
        origin,
        direction,
        leaves: None,
    };
    let hit = index.nearest(&ray, &mut Counters::default())?;
    Some(Start {
        point: hit.point,
        surface: Some(hit.surface),
    })
}

/// Returns a point of a surface, spread evenly up to the curvature of its parameters.
fn inside(
    random: &mut Random,
    surface: SurfaceId,
    scene: &Scene,
    gathered: &Gathered,
    index: &ShadowIndex,
) -> Option<Start> {
    let place = gathered.place_of(surface);
    let point = match &scene.objects[place.object as usize].shape {
        Shape::Polygon(_) | Shape::Mesh(_) => {
            let [a, b, c] = gathered.occluders().triangle_positions(surface)?;
            let [mut u, mut v] = [random.draw(), random.draw()];
            if u + v > 1.0 {
                [u, v] = [1.0 - u, 1.0 - v];
            }
            a + u * (b - a) + v * (c - a)
        }
        Shape::Sphere(sphere) => sphere.center + sphere.radius * random.direction(),
        Shape::Disk(disk) => {
            let radius = disk.radius * random.draw().sqrt();
            disk.center + radius * around(random, disk.normal)?
        }
        Shape::Cone(cone) => {
            // Which part of a closed cone is hit depends on where the ray comes from.
            let point = on_wall(random, cone)?;
            let away = 2.0 * (cone.apex - cone.base).length() * random.direction();
            return cast(point + away, -away, index);
        }
    };
    Some(Start {
        point,
        surface: Some(surface),
    })
}

fn on_wall(random: &mut Random, cone: &Cone) -> Option<DVec3> {
    let along = random.draw();
    let radius = cone.base_radius + along * (cone.apex_radius - cone.base_radius);
    let axis = cone.apex - cone.base;
    Some(cone.base + along * axis + radius * around(random, axis)?)
}

/// Returns a unit vector at a right angle to `axis`.
fn around(random: &mut Random, axis: DVec3) -> Option<DVec3> {
    let unit = (axis / axis.abs().max_element()).try_normalize()?;
    let (first, second) = unit.any_orthonormal_pair();
    let (sine, cosine) = libm::sincos(TAU * random.draw());
    Some(cosine * first + sine * second)
}

/// Returns a point on an edge of a triangle, rounded; inner edges of polygons count.
fn on_edge(random: &mut Random, surface: SurfaceId, gathered: &Gathered) -> Option<Start> {
    let corners = gathered.occluders().triangle_positions(surface)?;
    let edge = random.below(3);
    let [from, to] = [corners[edge], corners[(edge + 1) % 3]];
    Some(Start {
        point: from + random.draw() * (to - from),
        surface: Some(surface),
    })
}

/// Returns a corner of a triangle, exactly.
fn on_vertex(random: &mut Random, surface: SurfaceId, gathered: &Gathered) -> Option<Start> {
    let corners = gathered.occluders().triangle_positions(surface)?;
    Some(Start {
        point: corners[random.below(3)],
        surface: Some(surface),
    })
}
