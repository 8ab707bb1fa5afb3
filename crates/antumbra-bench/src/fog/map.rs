//! A march through a shadow map: what fog in games is made of. Not exact.
//!
//! In: a light and the points of a march. Out: how many of each segment's steps the map calls lit. The map has the depth of what
//! the light sees first through the middle of each texel, on a plane for a direction, on the faces of a cube for a point; a
//! step is dark where it is deeper by more than a texel's width. Each plane is fitted to the points that are asked about,
//! which is more than a program knows beforehand. Steps are `f32`s and cost a division, a look-up and a comparison.

use antumbra_geometry::{DVec3, LightShape, Ray};
use antumbra_render::integrator::{Integrator, Tally};
use antumbra_render::prepare::Prepared;
use rayon::prelude::*;

/// Texels along a side of a plane.
const SIDE: usize = 2048;

/// How far from a light, and from the middle, everything is, in sizes of the scene.
const AFAR: f64 = 4.0;

/// The map of one light.
#[derive(Debug)]
pub(super) struct Map {
    eye: Eye,
    planes: Vec<Plane>,
}

/// How space is seen.
#[derive(Clone, Copy, Debug)]
enum Eye {
    /// From a point: the largest coordinate is the depth.
    Point(DVec3),
    /// Along an axis, beside two others, from a point that is before all.
    Axes(DVec3, [DVec3; 3]),
}

/// A plane of the map.
#[derive(Clone, Debug)]
struct Plane {
    from: [f32; 2],
    /// Texels a unit.
    scale: [f32; 2],
    /// Depth that is granted to a step: a share of its own, and a length.
    bias: [f32; 2],
    depths: Vec<f32>,
}

/// Where a point is: the plane's number, the place on it and the depth.
type Place = (usize, [f32; 2], f32);

impl Eye {
    fn of(light: &LightShape, middle: DVec3, size: f64) -> Self {
        match *light {
            LightShape::Point(point) => Self::Point(point),
            LightShape::Direction(direction) => {
                let depth = -direction.normalize_or_zero();
                let (u, v) = depth.any_orthonormal_pair();
                Self::Axes(middle - AFAR * size * depth, [u, v, depth])
            }
        }
    }

    /// Returns the eye as far as a point is seen from it.
    fn seen(&self, point: DVec3) -> [f32; 3] {
        match self {
            Self::Point(eye) => (point - *eye).as_vec3().to_array(),
            Self::Axes(eye, axes) => axes.map(|axis| axis.dot(point - *eye) as f32),
        }
    }

    /// Returns where something that is seen so lies.
    #[inline]
    fn place(&self, seen: [f32; 3]) -> Place {
        match self {
            Self::Axes(..) => (0, [seen[0], seen[1]], seen[2]),
            Self::Point(_) => {
                let size = seen.map(f32::abs);
                let axis = if size[0] >= size[1] && size[0] >= size[2] {
                    0
                } else if size[1] >= size[2] {
                    1
                } else {
                    2
                };
                let (depth, u, v) = match axis {
                    0 => (seen[0], seen[1], seen[2]),
                    1 => (seen[1], seen[2], seen[0]),
                    _ => (seen[2], seen[0], seen[1]),
                };
                let plane = 2 * axis + usize::from(depth < 0.0);
                let depth = depth.abs();
                (plane, [u / depth, v / depth], depth)
            }
        }
    }

    /// Returns the ray through a place of a plane.
    fn ray(&self, plane: usize, [u, v]: [f64; 2]) -> Ray {
        let (origin, direction) = match self {
            Self::Axes(eye, [x, y, depth]) => (*eye + u * *x + v * *y, *depth),
            Self::Point(eye) => {
                let axis = plane / 2;
                let mut direction = DVec3::ZERO;
                direction[axis] = if plane.is_multiple_of(2) { 1.0 } else { -1.0 };
                direction[(axis + 1) % 3] = u;
                direction[(axis + 2) % 3] = v;
                (*eye, direction)
            }
        };
        Ray {
            origin,
            direction,
            leaves: None,
        }
    }
}

impl Map {
    /// Draws the planes that some points lie on.
    pub(super) fn new(
        prepared: &Prepared,
        light: &LightShape,
        points: impl Iterator<Item = DVec3>,
    ) -> Self {
        let bounds = prepared.gathered().occluders().bounds();
        let eye = Eye::of(light, bounds.center(), bounds.size().length());
        let (least, most) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut windows = [[[least, most]; 2]; 6];
        for point in points {
            let (plane, place, _) = eye.place(eye.seen(point));
            for (window, at) in windows[plane].iter_mut().zip(place) {
                *window = [window[0].min(at), window[1].max(at)];
            }
        }
        let planes = windows.into_iter().enumerate();
        let planes = planes.map(|(number, window)| Plane::drawn(prepared, &eye, number, window));
        Self {
            planes: planes.collect(),
            eye,
        }
    }

    /// Returns how many steps of a march from one point to another are lit; the first step is that share of a step away.
    pub(super) fn lit_steps(&self, [from, to]: [DVec3; 2], steps: u32, shift: f64) -> u32 {
        let (from, to) = (self.eye.seen(from), self.eye.seen(to));
        let share = 1.0 / steps as f32;
        let along = [0, 1, 2].map(|axis| share * (to[axis] - from[axis]));
        let mut lit = 0;
        for step in 0..steps {
            let step = step as f32 + shift as f32;
            let seen = [0, 1, 2].map(|axis| from[axis] + step * along[axis]);
            let (plane, place, depth) = self.eye.place(seen);
            lit += u32::from(self.planes[plane].is_lit(place, depth));
        }
        lit
    }
}

impl Plane {
    fn drawn(prepared: &Prepared, eye: &Eye, number: usize, window: [[f32; 2]; 2]) -> Self {
        let from = window.map(|[least, _]| least);
        let width = window.map(|[least, most]| (most - least).max(f32::MIN_POSITIVE));
        let texel = width.map(|width| width / SIDE as f32);
        let largest = texel[0].max(texel[1]);
        let mut plane = Self {
            from,
            scale: texel.map(f32::recip),
            bias: match eye {
                Eye::Point(_) => [largest, 0.0],
                Eye::Axes(..) => [0.0, largest],
            },
            depths: Vec::new(),
        };
        if window[0][0] > window[0][1] {
            return plane;
        }
        let integrator = Integrator::new(prepared, 1);
        let depth = |number_of_texel: usize| {
            let place = [number_of_texel % SIDE, number_of_texel / SIDE];
            let at = [0, 1].map(|axis| {
                f64::from(from[axis]) + (place[axis] as f64 + 0.5) * f64::from(texel[axis])
            });
            let ray = eye.ray(number, at);
            let seen = integrator.first_seen(&ray, &mut Tally::default());
            seen.map_or(f32::INFINITY, |seen| eye.place(eye.seen(seen.hit.point)).2)
        };
        plane.depths = (0..SIDE * SIDE).into_par_iter().map(depth).collect();
        plane
    }

    #[inline]
    fn is_lit(&self, place: [f32; 2], depth: f32) -> bool {
        let [column, row] = [0, 1].map(|axis| {
            let texel = (place[axis] - self.from[axis]) * self.scale[axis];
            (texel as usize).min(SIDE - 1)
        });
        // A plane that no point lies on, but for rounding, has no depths.
        let first = self.depths.get(row * SIDE + column);
        first.is_none_or(|&first| depth - (self.bias[0] * depth + self.bias[1]) <= first)
    }
}
