//! Points on the surfaces of a scene.
//!
//! In: a stream of random numbers. Out: points of surfaces of every shape, right up to a rounding,
//! and hits of rays.

use std::f64::consts::TAU;

use antumbra::{Counters, ShadowIndex};
use antumbra_geometry::{Bounds, Cone, DVec3, Ray, ReceiverPoint, SurfaceId};
use antumbra_scene::gather::Gathered;
use antumbra_scene::model::{Scene, Shape};

use super::random::Random;

/// A scene's surfaces and what finds hits on them.
pub(super) struct Surfaces<'a> {
    pub(super) scene: &'a Scene,
    pub(super) gathered: &'a Gathered,
    pub(super) index: &'a ShadowIndex,
    /// The box that views and free points come from: somewhat more than the scene.
    pub(super) reach: Bounds,
    /// The longest edge of the scene's box.
    pub(super) size: f64,
    /// The area of all surfaces up to each one.
    areas: Vec<f64>,
}

impl<'a> Surfaces<'a> {
    pub(super) fn new(scene: &'a Scene, gathered: &'a Gathered, index: &'a ShadowIndex) -> Self {
        let occluders = gathered.occluders();
        let bounds = occluders.bounds();
        let (reach, size) = if bounds.is_empty() {
            let reach = Bounds {
                min: DVec3::NEG_ONE,
                max: DVec3::ONE,
            };
            (reach, 1.0)
        } else {
            let size = bounds.size().max_element();
            (bounds.inflated(DVec3::splat(0.1 * size)), size)
        };
        let mut surfaces = Self {
            scene,
            gathered,
            index,
            reach,
            size,
            areas: Vec::new(),
        };
        let mut sum = 0.0;
        for surface in occluders.surfaces() {
            // NaN and infinity would spoil all sums that follow.
            let area = surfaces.area(surface);
            sum += if area.is_finite() { area } else { 0.0 };
            surfaces.areas.push(sum);
        }
        surfaces
    }

    fn area(&self, surface: SurfaceId) -> f64 {
        match self.shape(surface) {
            Shape::Polygon(_) | Shape::Mesh(_) | Shape::Instance(_) => {
                let corners = self.gathered.occluders().triangle_positions(surface);
                corners.map_or(0.0, |[a, b, c]| 0.5 * (b - a).cross(c - a).length())
            }
            Shape::Sphere(sphere) => 2.0 * TAU * sphere.radius * sphere.radius,
            Shape::Disk(disk) => 0.5 * TAU * disk.radius * disk.radius,
            Shape::Cone(cone) => {
                let length = (cone.apex - cone.base).length();
                let slant = libm::hypot(length, cone.apex_radius - cone.base_radius);
                0.5 * TAU * (cone.base_radius + cone.apex_radius) * slant
            }
            // Of parts of a patch, and of what an implicit surface may be at least.
            Shape::Patch(_) | Shape::Implicit(_) => {
                let bounds = self.gathered.occluders().surface_bounds(surface);
                let size = bounds.size();
                size.x * size.y + size.y * size.z + size.z * size.x
            }
        }
    }

    /// Returns a surface, the more likely the larger.
    pub(super) fn by_area(&self, random: &mut Random) -> Option<SurfaceId> {
        let aim = random.draw() * self.areas.last()?;
        let number = self.areas.partition_point(|&sum| sum <= aim);
        Some(SurfaceId(number.min(self.areas.len() - 1) as u32))
    }

    /// Returns any surface, all alike.
    pub(super) fn any(&self, random: &mut Random) -> Option<SurfaceId> {
        let count = self.gathered.occluders().surface_count();
        (count > 0).then(|| SurfaceId(random.below(count) as u32))
    }

    /// Returns any triangle, all alike.
    pub(super) fn any_triangle(&self, random: &mut Random) -> Option<(SurfaceId, [DVec3; 3])> {
        let occluders = self.gathered.occluders();
        let count = occluders.triangle_count();
        if count == 0 {
            return None;
        }
        let surface = SurfaceId(random.below(count) as u32);
        Some((surface, occluders.triangle_positions(surface)?))
    }

    /// Returns the shape that a surface belongs to.
    pub(super) fn shape(&self, surface: SurfaceId) -> &'a Shape {
        let place = self.gathered.place_of(surface);
        &self.scene.objects[place.object as usize].shape
    }

    /// Returns the nearest hit of a ray that may leave a surface.
    pub(super) fn cast(
        &self,
        origin: DVec3,
        direction: DVec3,
        leaves: Option<SurfaceId>,
    ) -> Option<ReceiverPoint> {
        if !(origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO) {
            return None;
        }
        let ray = Ray {
            origin,
            direction,
            leaves,
        };
        let hit = self.index.nearest(&ray, &mut Counters::default())?;
        Some(ReceiverPoint {
            point: hit.point,
            surface: Some(hit.surface),
        })
    }

    /// Returns a point of a surface, spread evenly up to the curvature of its parameters.
    pub(super) fn point_on(
        &self,
        random: &mut Random,
        surface: SurfaceId,
    ) -> Option<ReceiverPoint> {
        let point = match self.shape(surface) {
            Shape::Polygon(_) | Shape::Mesh(_) | Shape::Instance(_) => {
                let corners = self.gathered.occluders().triangle_positions(surface)?;
                in_triangle(random, corners)
            }
            Shape::Sphere(sphere) => sphere.center + sphere.radius * random.direction(),
            Shape::Disk(disk) => {
                let radius = disk.radius * random.draw().sqrt();
                disk.center + radius * random.around(disk.normal)?
            }
            Shape::Cone(cone) => {
                // Which part of a closed cone is hit depends on where the ray comes from.
                let point = on_wall(random, cone)?;
                let away = 2.0 * (cone.apex - cone.base).length() * random.direction();
                return self.cast(point + away, -away, None);
            }
            Shape::Patch(_) | Shape::Implicit(_) => {
                let bounds = self.gathered.occluders().surface_bounds(surface);
                let share = DVec3::from_array([(); 3].map(|()| random.draw()));
                let target = bounds.min + bounds.size() * share;
                let away = 2.0 * bounds.size().length() * random.direction();
                return self.cast(target + away, -away, None);
            }
        };
        Some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }
}

/// Returns a point of a triangle, spread evenly.
pub(super) fn in_triangle(random: &mut Random, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let [mut u, mut v] = [random.draw(), random.draw()];
    if u + v > 1.0 {
        [u, v] = [1.0 - u, 1.0 - v];
    }
    a + u * (b - a) + v * (c - a)
}

fn on_wall(random: &mut Random, cone: &Cone) -> Option<DVec3> {
    let along = random.draw();
    let radius = cone.base_radius + along * (cone.apex_radius - cone.base_radius);
    let axis = cone.apex - cone.base;
    Some(cone.base + along * axis + radius * random.around(axis)?)
}
