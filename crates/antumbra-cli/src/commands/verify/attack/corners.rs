//! Starts at vertices and edges of triangles, a hair inside, and off their own surface.

use antumbra_geometry::{DVec3, ReceiverPoint};

use super::Attack;
use crate::commands::verify::random::{Random, next_towards};

impl Attack<'_> {
    /// Returns a vertex, exactly.
    pub(super) fn at_vertex(&self, random: &mut Random) -> Option<ReceiverPoint> {
        let (surface, corners) = self.surfaces.any_triangle(random)?;
        Some(ReceiverPoint {
            point: corners[random.below(3)],
            surface: Some(surface),
        })
    }

    /// Returns a point of an edge, rounded: random, the middle, or close to an end.
    pub(super) fn on_edge(&self, random: &mut Random) -> Option<ReceiverPoint> {
        let (surface, corners, _) = self.triangle_point(random)?;
        let (from, to) = any_edge(random, corners);
        Some(ReceiverPoint {
            point: from + along_edge(random) * (to - from),
            surface: Some(surface),
        })
    }

    /// Returns a point of a vertex or an edge, moved inside by a rounding or a tiny step.
    pub(super) fn inside_border(&self, random: &mut Random) -> Option<ReceiverPoint> {
        let (surface, corners, inside) = self.triangle_point(random)?;
        let (from, to) = any_edge(random, corners);
        let border = if random.below(2) == 0 {
            from
        } else {
            from + along_edge(random) * (to - from)
        };
        let point = if random.below(2) == 0 {
            let [a, b, c] = corners;
            next_towards(border, (a + b + c) / 3.0)
        } else {
            self.stepped(random, border, inside)
        };
        Some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }

    /// Returns a point a tiny step from another, never beyond the aim.
    pub(super) fn stepped(&self, random: &mut Random, from: DVec3, aim: DVec3) -> DVec3 {
        let step = self.surfaces.size * random.power_of_ten(-15.0, -6.0);
        let way = aim - from;
        from + way * (step / way.length()).min(1.0)
    }

    /// Returns a start whose point lies off its triangle, or by a rounding off a curved surface.
    pub(super) fn off_surface(&self, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        let mut start = self.on_any(random, light)?;
        let surface = start.surface?;
        let is_triangle =
            (surface.0 as usize) < self.surfaces.gathered.occluders().triangle_count();
        let distance = if is_triangle {
            self.small(random)
        } else {
            // As far as EXACTNESS.md lets starts on other surfaces lie off them.
            self.surfaces.size * random.power_of_ten(-16.0, -12.5)
        };
        start.point += distance * random.direction();
        Some(start)
    }

    /// Returns a start of a triangle that its point has nothing to do with, or whose neighbour it lies
    /// on: the start is the nearest point of the triangle.
    pub(super) fn of_other_surface(
        &self,
        random: &mut Random,
        light: usize,
    ) -> Option<ReceiverPoint> {
        let (surface, corners) = self.surfaces.any_triangle(random)?;
        let point = match random.below(3) {
            // Over the line that leads on from an edge or a corner.
            0 => {
                let (from, to) = any_edge(random, corners);
                to + self.small(random) * (to - from).normalize_or_zero()
            }
            1 => self.on_any(random, light)?.point,
            _ => random.in_box(&self.surfaces.reach),
        };
        Some(ReceiverPoint {
            point,
            surface: Some(surface),
        })
    }
}

/// Returns an edge, in any direction.
pub(super) fn any_edge(random: &mut Random, corners: [DVec3; 3]) -> (DVec3, DVec3) {
    let number = random.below(3);
    let other = (number + 1 + random.below(2)) % 3;
    (corners[number], corners[other])
}

/// Returns a share of an edge's length.
pub(super) fn along_edge(random: &mut Random) -> f64 {
    match random.below(5) {
        0 => 0.5,
        1 => random.power_of_ten(-16.0, -1.0),
        _ => random.draw(),
    }
}
