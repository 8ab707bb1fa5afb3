//! The hull of a light with size: a few corners that all its samples lie between.
//!
//! In: a light's shape. Out: corners in the frame's units, or directions. Invariant: every sample of the light, rounded
//! as it is, lies within [`LightHull::slack`] of the corners' convex hull (of the cone of directions). Absent here: what a
//! cell sees of it (`shaft`).

use antumbra_geometry::{AreaShape, Bounds, DVec3, LightShape};

use crate::accel::frame::Frame;

/// Most corners of a hull.
const MOST_CORNERS: usize = 12;

/// Wider sun discs have no hull, in degrees.
const WIDEST_SUN: f64 = 90.0;

/// Directions that have 1 along the disc's axis leave the frame's box, whose diagonal is below 3.5, by this many times
/// themselves; their sums do as well.
const FAR: f64 = 4.0;

/// Lights farther away, in the frame's units, have no hull.
const FARTHEST: f64 = 65536.0;

/// Corners of a polygon around a circle.
const AROUND: usize = 8;

/// The hull of a light.
#[derive(Clone, Debug)]
pub(super) struct LightHull {
    /// Points of the frame. Of light from afar vectors that end outside the frame from any of its points.
    pub(super) corners: Vec<DVec3>,
    /// Pairs of corners that have an edge.
    pub(super) edges: Vec<[u8; 2]>,
    pub(super) is_afar: bool,
    /// What samples, corners and heights over planes are off at most, in the frame's units.
    pub(super) slack: f64,
    shines: Shines,
}

/// A triangle in the frame's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    pub(super) corners: [DVec3; 3],
    /// The product of two edges, which were differences of world coordinates: right to 2^-50 of `products`.
    pub(super) normal: DVec3,
    /// The product of the largest components of these edges.
    products: f64,
}

impl Flat {
    #[inline]
    pub(super) fn new(frame: &Frame, corners: [DVec3; 3]) -> Self {
        let first = (corners[1] - corners[0]) * frame.scale;
        let second = (corners[2] - corners[0]) * frame.scale;
        Self {
            corners: corners.map(|corner| frame.point_in_frame(corner)),
            normal: first.cross(second),
            products: first.abs().max_element() * second.abs().max_element(),
        }
    }

    /// Returns what a height over its plane may be off, times the normal's length, for points that are known up to a
    /// distance of at least 2^-40 of how far they are.
    #[inline]
    pub(super) fn bound(&self, distance: f64) -> f64 {
        (self.products + self.normal.abs().element_sum()) * distance
    }

    /// Returns a point's height over the plane, times the normal's length.
    #[inline]
    pub(super) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.corners[0])
    }
}

/// Where a light shines to.
#[derive(Clone, Copy, Debug)]
enum Shines {
    /// To all points of space that are not on it.
    Everywhere,
    /// In front of a plane, or off it, world space.
    OffPlane {
        origin: DVec3,
        normal: DVec3,
        is_two_sided: bool,
    },
    /// Outside a ball, world space.
    Outside { center: DVec3, radius: f64 },
    /// To places that nobody has worked out.
    Somewhere,
}

impl LightHull {
    /// Returns the hull of a shape; `None` for those that have none: the sky, meshes with slivers, and what is out of range.
    pub(super) fn new(shape: &AreaShape, frame: &Frame) -> Option<Self> {
        let plane = |is_two_sided: bool, origin: DVec3, normal: DVec3| Shines::OffPlane {
            origin,
            normal,
            is_two_sided,
        };
        let (corners, edges, shines) = match shape {
            AreaShape::Segment(light) => (light.ends().to_vec(), vec![[0, 1]], Shines::Everywhere),
            AreaShape::Triangle(light) => {
                let corners = light.corners();
                let shines = plane(light.is_two_sided(), corners[0], light.normal());
                (corners.to_vec(), ring(3), shines)
            }
            AreaShape::Rectangle(light) => {
                let [u, v] = light.edges().map(|edge| 0.5 * edge);
                let corners = [-u - v, u - v, u + v, v - u].map(|way| light.center() + way);
                let shines = plane(light.is_two_sided(), light.center(), light.normal());
                (corners.to_vec(), ring(4), shines)
            }
            AreaShape::Polygon(light) => {
                let corners = light.corners().to_vec();
                let shines = plane(light.is_two_sided(), corners[0], light.normal());
                let edges = ring(corners.len());
                (corners, edges, shines)
            }
            AreaShape::Disk(light) => {
                let around =
                    around(light.normal()).map(|way| light.center() + light.radius() * way);
                let shines = plane(light.is_two_sided(), light.center(), light.normal());
                (around.to_vec(), ring(AROUND), shines)
            }
            AreaShape::Sphere(light) => {
                let (center, radius) = (light.center(), light.radius());
                let bounds = Bounds {
                    min: center - radius,
                    max: center + radius,
                };
                let shines = Shines::Outside { center, radius };
                (bounds.corners().to_vec(), box_edges(), shines)
            }
            AreaShape::SunDisc(light) => {
                if light.diameter_degrees() > WIDEST_SUN {
                    return None;
                }
                let axis = light.towards_light();
                let tangent = light.tangent();
                let around = around(axis).map(|way| FAR * (axis + tangent * way));
                return Some(Self {
                    slack: slack(&around, frame),
                    corners: around.to_vec(),
                    edges: ring(AROUND),
                    is_afar: true,
                    shines: Shines::Everywhere,
                });
            }
            AreaShape::Mesh(light) => {
                let triangles = light.triangles();
                if triangles.iter().any(is_sliver) {
                    return None;
                }
                let bounds = Bounds::of_points(triangles.iter().flatten().copied());
                (bounds.corners().to_vec(), box_edges(), Shines::Somewhere)
            }
            AreaShape::Sky(_) => return None,
        };
        if corners.len() > MOST_CORNERS {
            return None;
        }
        let corners: Vec<DVec3> = corners
            .into_iter()
            .map(|corner| frame.point_in_frame(corner))
            .collect();
        // Not for NaN.
        let are_near = corners
            .iter()
            .all(|corner| corner.abs().max_element() <= FARTHEST);
        are_near.then(|| Self {
            slack: slack(&corners, frame),
            corners,
            edges,
            is_afar: false,
            shines,
        })
    }

    /// Returns how much lower or higher than a point of the frame the hull may reach along a vector: the most of `n . L`,
    /// or of `n . D` and 0 for light from afar, which begins at the point itself.
    #[inline]
    pub(super) fn highest(&self, normal: DVec3) -> f64 {
        let lowest = if self.is_afar { 0.0 } else { f64::MIN };
        self.corners
            .iter()
            .fold(lowest, |most, corner| most.max(normal.dot(*corner)))
    }

    /// Returns the way to a corner from a point.
    #[inline]
    pub(super) fn towards(&self, corner: usize, from: DVec3) -> DVec3 {
        let corner = self.corners[corner];
        if self.is_afar { corner } else { corner - from }
    }

    /// Returns a point of the middle of the light, or a direction, in world space.
    pub(super) fn middle(&self, frame: &Frame) -> LightShape {
        let sum: DVec3 = self.corners.iter().sum();
        let mean = sum / self.corners.len() as f64;
        match self.is_afar {
            true => LightShape::Direction(mean),
            false => {
                let point = frame.center + mean / frame.scale;
                LightShape::Point(point)
            }
        }
    }

    /// Returns the corners as targets.
    pub(super) fn targets(&self, frame: &Frame) -> Vec<LightShape> {
        let corners = self.corners.iter();
        corners
            .map(|&corner| match self.is_afar {
                true => LightShape::Direction(corner),
                false => LightShape::Point(frame.center + corner / frame.scale),
            })
            .collect()
    }

    /// Returns on which side of a triangle's plane all samples surely lie: 1 on that of the normal by winding, -1
    /// behind, 0 where they differ or it is not known. `margin` in the frame's units is granted besides.
    pub(super) fn side_of(&self, triangle: &Flat, margin: f64) -> i8 {
        let bound = triangle.bound(self.slack + margin);
        let (mut is_over, mut is_under) = (true, true);
        for number in 0..self.corners.len() {
            let height = triangle
                .normal
                .dot(self.towards(number, triangle.corners[0]));
            // Not for NaN.
            is_over &= height > bound;
            is_under &= height < -bound;
        }
        i8::from(is_over) - i8::from(is_under)
    }

    /// Returns whether the light surely shines to all points of a box of world space, from all of it.
    pub(super) fn shines_to(&self, bounds: &Bounds) -> bool {
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        match self.shines {
            Shines::Everywhere => true,
            Shines::Somewhere => false,
            Shines::OffPlane {
                origin,
                normal,
                is_two_sided,
            } => {
                let bound = (reach + origin.abs().max_element()) * 1e-12;
                let (mut is_over, mut is_under) = (true, is_two_sided);
                for corner in bounds.corners() {
                    let height = normal.dot(corner - origin);
                    is_over &= height > bound;
                    is_under &= height < -bound;
                }
                is_over || is_under
            }
            Shines::Outside { center, radius } => {
                let nearest = center.clamp(bounds.min, bounds.max);
                let bound = (reach + center.abs().max_element() + radius) * 1e-12;
                (nearest - center).length() > radius + bound
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> u64 {
        (self.corners.capacity() * size_of::<DVec3>() + self.edges.capacity() * 2) as u64
    }
}

/// Returns whether a triangle is so thin that samples may be moved far off it: where rounding puts one behind, it is moved along
/// the axis of the normal's largest component. With more width that is at most 64 roundings of the coordinates.
fn is_sliver([a, b, c]: &[DVec3; 3]) -> bool {
    let (first, second) = (b - a, c - a);
    let is_wide = first.cross(second).length() > 2f64.powi(-20) * first.length() * second.length();
    // For NaN, too.
    !is_wide
}

/// What numbers of the hull's size may be off: 2^-40 of them, some thousand roundings, and as many of what world
/// coordinates are rounded by.
fn slack(corners: &[DVec3], frame: &Frame) -> f64 {
    let reach = corners
        .iter()
        .fold(1.0_f64, |most, corner| most.max(corner.abs().max_element()));
    reach * 2f64.powi(-40) + frame.margin_in_frame * 2f64.powi(-4)
}

/// The edges of a polygon.
fn ring(count: usize) -> Vec<[u8; 2]> {
    (0..count)
        .map(|number| [number as u8, ((number + 1) % count) as u8])
        .collect()
}

/// The edges of a box, between corners whose numbers differ in one bit.
fn box_edges() -> Vec<[u8; 2]> {
    (0..8_u8)
        .flat_map(|corner| [1, 2, 4].map(|bit| [corner, corner ^ bit]))
        .filter(|[first, second]| first < second)
        .collect()
}

/// The corners of a polygon around the unit circle across an axis, a little larger than needed.
fn around(axis: DVec3) -> [DVec3; AROUND] {
    // 1 over the cosine of an eighth of half a turn, and some more.
    const REACH: f64 = 1.082_392_200_3;
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let (across, along) = axis.any_orthonormal_pair();
    let way = |x: f64, y: f64| REACH * (x * across + y * along);
    [
        way(1.0, 0.0),
        way(HALF, HALF),
        way(0.0, 1.0),
        way(-HALF, HALF),
        way(-1.0, 0.0),
        way(-HALF, -HALF),
        way(0.0, -1.0),
        way(HALF, -HALF),
    ]
}

#[cfg(test)]
pub(super) use tests::light as any_light;

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use antumbra_geometry::{
        DiskLight, LightShape, MeshLight, PolygonLight, RectangleLight, SamplePattern,
        SegmentLight, SphereLight, SunDisc, TriangleLight,
    };

    use super::super::super::testing::Random;
    use super::*;

    /// Lights of all shapes that have hulls.
    pub(in super::super) fn light(random: &mut Random, about: DVec3, size: f64) -> AreaShape {
        let mut corner = || about + size * random.of_cube();
        let (a, b, c) = (corner(), corner(), corner());
        let is_two_sided = random.below(2) == 0;
        let kind = random.below(8);
        let made = match kind {
            0 => SegmentLight::new([a, b]).map(AreaShape::Segment),
            1 => RectangleLight::new(a, [b - a, c - a], is_two_sided).map(AreaShape::Rectangle),
            2 => TriangleLight::new([a, b, c], is_two_sided).map(AreaShape::Triangle),
            3 => {
                let corners = vec![a, b, b + (c - a), c];
                PolygonLight::new(corners, is_two_sided)
                    .map(|light| AreaShape::Polygon(Arc::new(light)))
            }
            4 => DiskLight::new(a, b - c, size * 0.3, is_two_sided).map(AreaShape::Disk),
            5 => MeshLight::new(
                vec![[a, b, c], [b, a, a + b - c], [c, c + size * DVec3::X, b]],
                is_two_sided,
            )
            .map(|light| AreaShape::Mesh(Arc::new(light))),
            6 => SphereLight::new(a, size * 0.3).map(AreaShape::Sphere),
            _ => SunDisc::new(b - c, random.pick(&[0.5, 6.0, 30.0, 80.0])).map(AreaShape::SunDisc),
        };
        // Corners in one line or at one place.
        made.unwrap_or_else(|_| {
            AreaShape::Sphere(SphereLight::new(a, 0.1 * size).expect("a ball of light"))
        })
    }

    #[test]
    fn samples_lie_in_the_hull() {
        let random = &mut Random(5);
        let mut count = 0;
        for _ in 0..2_000 {
            let scene = random.scene();
            let frame = Frame::new(scene);
            let about = random.in_box(&scene);
            let size = scene.size().max_element() * random.pick(&[1e-6, 0.01, 0.5, 30.0]);
            let shape = light(random, about, size);
            let Some(hull) = LightHull::new(&shape, &frame) else {
                continue;
            };
            for number in 0..16 {
                let receiver = random.in_box(&scene);
                let place = SamplePattern::place(SamplePattern { seed: 1 }.scramble(7, 0), number);
                let Some(sample) = shape.sample(receiver, place) else {
                    continue;
                };
                // The highest along any way is not below any sample.
                for _ in 0..8 {
                    let normal = random.of_cube().normalize_or_zero();
                    let height = match sample.target {
                        LightShape::Point(point) => normal.dot(frame.point_in_frame(point)),
                        LightShape::Direction(way) => normal.dot(way),
                    };
                    count += 1;
                    assert!(
                        height <= hull.highest(normal) + 2.0 * hull.slack,
                        "{shape:?}"
                    );
                }
            }
        }
        assert!(count > 30_000, "{count}");
    }
}
