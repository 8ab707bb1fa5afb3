//! Starts on edges of shadows, and near creases where light grazes.
//!
//! An edge of a shadow lies where the line from the light through a point of an outline goes on to the
//! next surface.

use antumbra_geometry::{Cone, DVec3, LightShape, ReceiverPoint, SurfaceId};
use antumbra_scene::model::Shape;

use super::Attack;
use super::contours::{Outlines, foot};
use super::corners::{along_edge, any_edge};
use crate::commands::verify::random::{Random, next_towards};

impl Attack<'_> {
    /// Returns a point of an outline, or of the edge of a shadow that it casts, or a little beside.
    pub(super) fn on_shadow_edge(
        &self,
        random: &mut Random,
        light: usize,
    ) -> Option<ReceiverPoint> {
        let outline = self.on_outline(random, light)?;
        let start = if random.below(8) == 0 && outline.surface.is_some() {
            outline
        } else {
            self.behind(outline.point, outline.surface, light)?
        };
        Some(self.beside(random, start))
    }

    /// Returns a point a hair from a crease, or what the light meets behind it.
    pub(super) fn near_crease(&self, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        let (surface, corners, inside) = self.triangle_point(random)?;
        let (from, to) = any_edge(random, corners);
        let crease = if random.below(3) == 0 {
            from
        } else {
            from + along_edge(random) * (to - from)
        };
        let point = if random.below(4) == 0 {
            next_towards(crease, inside)
        } else {
            self.stepped(random, crease, inside)
        };
        match random.below(4) {
            0 => Some(ReceiverPoint {
                point,
                surface: Some(surface),
            }),
            _ => self.behind(point, Some(surface), light),
        }
    }

    /// Returns the next surface behind a point, as seen from the light.
    fn behind(
        &self,
        point: DVec3,
        surface: Option<SurfaceId>,
        light: usize,
    ) -> Option<ReceiverPoint> {
        let away = -self.lights[light].towards(point);
        self.surfaces.cast(point, away, surface)
    }

    /// Moves a start by nothing, by roundings, or by a tiny step in its surface.
    fn beside(&self, random: &mut Random, mut start: ReceiverPoint) -> ReceiverPoint {
        match random.below(3) {
            0 => {}
            1 => start.point = random.by_ulps(start.point),
            _ => {
                let occluders = self.surfaces.gathered.occluders();
                let normal = start
                    .surface
                    .map(|surface| occluders.normal_at(surface, start.point));
                let around = normal.and_then(|normal| random.around(normal));
                let is_flat = start
                    .surface
                    .is_some_and(|surface| (surface.0 as usize) < occluders.triangle_count());
                // A long straight step leaves a curved surface.
                let longest = if is_flat { -3.0 } else { -7.0 };
                let step = self.surfaces.size * random.power_of_ten(-15.0, longest);
                start.point += step * around.unwrap_or(DVec3::ZERO);
            }
        }
        start
    }

    fn on_outline(&self, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        let Outlines {
            mesh,
            contours,
            closest,
            curved,
        } = &self.outlines;
        let [contours, closest] = [&contours[light], &closest[light]];
        let occluders = self.surfaces.gathered.occluders();
        let is_curved = !curved.is_empty()
            && (contours.is_empty() || occluders.triangle_count() == 0 || random.below(2) == 0);
        if is_curved {
            let surface = random.one_of(curved);
            return self.on_silhouette(random, surface, light);
        }
        if contours.is_empty() || random.below(4) == 0 {
            let (surface, corners, _) = self.triangle_point(random)?;
            let (from, to) = any_edge(random, corners);
            return Some(ReceiverPoint {
                point: from + along_edge(random) * (to - from),
                surface: Some(surface),
            });
        }
        let is_close = !closest.is_empty() && random.below(4) == 0;
        let number = random.one_of(if is_close { closest } else { contours });
        let ends = occluders.edge_positions(&mesh.edges()[number as usize]);
        let [from, to] = ends;
        let mut point = from + along_edge(random) * (to - from);
        if let LightShape::Point(light) = self.lights[light]
            && random.below(4) == 0
        {
            // As far from where the light is closest as the light is away, more or less.
            let foot = foot(light, ends);
            let distance = (foot - light).length() * random.power_of_ten(-2.0, 2.0);
            let aim = random.one_of(&ends);
            let way = aim - foot;
            point = foot + way * (distance / way.length()).min(1.0);
        }
        Some(ReceiverPoint {
            point,
            surface: None,
        })
    }

    /// Returns a point of a curved surface where light grazes it, or of its rim.
    fn on_silhouette(
        &self,
        random: &mut Random,
        surface: SurfaceId,
        light: usize,
    ) -> Option<ReceiverPoint> {
        let light = &self.lights[light];
        let point = match self.surfaces.shape(surface) {
            Shape::Sphere(sphere) => {
                let to_light = light.towards(sphere.center);
                let around = random.around(to_light)?;
                // From a point the circle of contact is nearer than the middle, and smaller.
                let nearer = match light {
                    LightShape::Point(_) => sphere.radius / to_light.length(),
                    LightShape::Direction(_) => 0.0,
                };
                // A light within the sphere sees no outline.
                if nearer > 1.0 || nearer.is_nan() {
                    return None;
                }
                let smaller = (1.0 - nearer * nearer).sqrt();
                let along = nearer * to_light.normalize_or_zero() + smaller * around;
                sphere.center + sphere.radius * along
            }
            Shape::Cone(cone) => on_cone_silhouette(random, cone, light)?,
            Shape::Disk(disk) => disk.center + disk.radius * random.around(disk.normal)?,
            Shape::Patch(_) | Shape::Implicit(_) => {
                return self.on_freeform_silhouette(random, surface, light);
            }
            Shape::Polygon(_) | Shape::Mesh(_) | Shape::Instance(_) => return None,
        };
        Some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }
}

impl Attack<'_> {
    /// Slides a point along the surface until light grazes it.
    fn on_freeform_silhouette(
        &self,
        random: &mut Random,
        surface: SurfaceId,
        light: &LightShape,
    ) -> Option<ReceiverPoint> {
        let occluders = self.surfaces.gathered.occluders();
        let start = self.surfaces.point_on(random, surface)?;
        let surface = start.surface?;
        let reach = 0.125 * occluders.surface_bounds(surface).size().max_element();
        let mut point = start.point;
        for _ in 0..32 {
            let normal = occluders.smooth_normal_at(surface, point);
            let towards = light.towards(point).normalize_or_zero();
            // Down where light comes from above, so that the normal turns away.
            let along = towards - normal * towards.dot(normal);
            let step = along.normalize_or_zero() * (reach * normal.dot(towards));
            point = occluders.start_on(surface, point + step).point;
        }
        point.is_finite().then_some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }
}

fn on_cone_silhouette(random: &mut Random, cone: &Cone, light: &LightShape) -> Option<DVec3> {
    let axis = cone.apex - cone.base;
    let unit = axis.try_normalize()?;
    let between = random.draw();
    let along = random.one_of(&[0.0, 1.0, between]);
    let middle = cone.base + along * axis;
    let radius = cone.base_radius + along * (cone.apex_radius - cone.base_radius);
    if random.below(3) == 0 {
        return Some(middle + radius * random.around(axis)?);
    }
    // The wall's normal is e + slope * unit, with e at a right angle to the axis; the light is in the
    // wall's tangent plane at middle + radius * e where w . e = reach.
    let slope = (cone.base_radius - cone.apex_radius) / axis.length();
    let to_light = light.towards(middle);
    let own = match light {
        LightShape::Point(_) => radius,
        LightShape::Direction(_) => 0.0,
    };
    let reach = own - slope * to_light.dot(unit);
    let across = to_light - unit * to_light.dot(unit);
    let cosine = reach / across.length();
    if !(-1.0..=1.0).contains(&cosine) {
        return None;
    }
    let first = across.try_normalize()?;
    let second = unit.cross(first) * random.one_of(&[-1.0, 1.0]);
    let e = cosine * first + (1.0 - cosine * cosine).sqrt() * second;
    Some(middle + radius * e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_grazes_a_cone_at_its_silhouette() {
        let cone = Cone {
            base: DVec3::new(1.0, 2.0, 0.0),
            base_radius: 1.0,
            apex: DVec3::new(1.0, 2.0, 4.0),
            apex_radius: 0.5,
            is_closed: false,
        };
        let lamp = DVec3::new(5.0, -3.0, 7.0);
        let light = LightShape::Point(lamp);
        let mut seen = 0;
        for number in 0..300 {
            let mut random = Random::new(5, number);
            let Some(point) = on_cone_silhouette(&mut random, &cone, &light) else {
                continue;
            };
            let height = point.z / 4.0;
            let e = DVec3::new(point.x - 1.0, point.y - 2.0, 0.0);
            assert!((e.length() - (1.0 - 0.5 * height)).abs() < 1e-12);
            let normal = e.normalize() + 0.125 * DVec3::Z;
            seen += usize::from((lamp - point).dot(normal).abs() < 1e-12);
        }
        assert!(seen > 150, "{seen}");
    }
}
