//! Starts at delicate places, to find wrong answers with few queries.
//!
//! In: a seed, a number and a light. Out: a start and its kind, a pure function of these and the
//! scene. Where a kind has no point (no triangle, nothing behind), a free point stands in.
//!
//! | module | starts |
//! |---|---|
//! | `planes` | on planes between voxels, on surfaces and in space |
//! | `corners` | at vertices and edges of triangles, and off their own surface |
//! | `outlines` | on edges of shadows and near creases |

mod contours;
mod corners;
mod outlines;
mod planes;
mod voxels;

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};

use super::random::{Random, next};
use super::surfaces::{Surfaces, in_triangle};
use contours::Outlines;

/// A family of starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    VoxelPlane,
    VoxelLine,
    Vertex,
    Edge,
    InsideBorder,
    ShadowEdge,
    Crease,
    Area,
    FreeVoxel,
    FreeSurface,
    Lifted,
    Outside,
    OffSurface,
    OtherSurface,
    StandIn,
}

impl Kind {
    pub(super) const ALL: [Self; 15] = [
        Self::VoxelPlane,
        Self::VoxelLine,
        Self::Vertex,
        Self::Edge,
        Self::InsideBorder,
        Self::ShadowEdge,
        Self::Crease,
        Self::Area,
        Self::FreeVoxel,
        Self::FreeSurface,
        Self::Lifted,
        Self::Outside,
        Self::OffSurface,
        Self::OtherSurface,
        Self::StandIn,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::VoxelPlane => "plane between voxels",
            Self::VoxelLine => "line between voxels",
            Self::Vertex => "vertex",
            Self::Edge => "edge",
            Self::InsideBorder => "just inside the border",
            Self::ShadowEdge => "edge of a shadow",
            Self::Crease => "near a crease",
            Self::Area => "anywhere on surfaces",
            Self::FreeVoxel => "free, at a voxel's border",
            Self::FreeSurface => "free, on a surface",
            Self::Lifted => "free, lifted off a surface",
            Self::Outside => "free, anywhere",
            Self::OffSurface => "off its surface",
            Self::OtherSurface => "of another surface",
            Self::StandIn => "free, for want of the kind",
        }
    }
}

/// Which kinds take turns; the delicate ones more often.
const TURNS: [Kind; 20] = [
    Kind::ShadowEdge,
    Kind::VoxelPlane,
    Kind::ShadowEdge,
    Kind::VoxelLine,
    Kind::ShadowEdge,
    Kind::Vertex,
    Kind::ShadowEdge,
    Kind::Edge,
    Kind::ShadowEdge,
    Kind::InsideBorder,
    Kind::Crease,
    Kind::Area,
    Kind::Crease,
    Kind::FreeVoxel,
    Kind::Area,
    Kind::FreeSurface,
    Kind::Lifted,
    Kind::Outside,
    Kind::OffSurface,
    Kind::OtherSurface,
];

/// What the starts are made from.
pub(super) struct Attack<'a> {
    surfaces: &'a Surfaces<'a>,
    seed: u64,
    lights: &'a [LightShape],
    voxels: voxels::Voxels,
    outlines: Outlines,
}

impl<'a> Attack<'a> {
    /// Prepares starts; `voxels` are those of [`antumbra::ShadowIndex::voxel_planes`], where there is
    /// an index that has some.
    pub(super) fn new(
        surfaces: &'a Surfaces<'a>,
        seed: u64,
        voxels: Option<(DVec3, f64, [u32; 3])>,
    ) -> Self {
        let lights = surfaces.index.lights();
        Self {
            surfaces,
            seed,
            lights,
            voxels: voxels::Voxels::new(voxels, &surfaces.reach),
            outlines: Outlines::new(surfaces, lights),
        }
    }

    /// Returns start number `number`, meant for a light.
    pub(super) fn start(&self, number: u64, light: usize) -> (Kind, ReceiverPoint) {
        let mut random = Random::new(self.seed, number);
        // All turns for every light.
        let turn = random.below(TURNS.len());
        let mut kind = TURNS[turn];
        // Only the reference can tell where these start, for every triangle in exact arithmetic: in
        // large scenes they would take all the time.
        const MANY_TRIANGLES: f64 = 100.0;
        let triangle_count = self.surfaces.gathered.occluders().triangle_count();
        if kind == Kind::OtherSurface && random.draw() * triangle_count as f64 > MANY_TRIANGLES {
            kind = Kind::OffSurface;
        }
        // Far beyond this the library refuses points.
        const LARGEST: f64 = 1e30;
        let is_fine = |start: &ReceiverPoint| {
            start.point.is_finite() && start.point.abs().max_element() < LARGEST
        };
        // Rays that hit nothing and triangles without a plane through them are common.
        const MOST_TRIES: usize = 6;
        let found =
            (0..MOST_TRIES).find_map(|_| self.start_of(kind, &mut random, light).filter(is_fine));
        match found {
            Some(start) => (kind, start),
            None => (Kind::StandIn, self.anywhere(&mut random)),
        }
    }

    fn start_of(&self, kind: Kind, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        match kind {
            Kind::VoxelPlane => self.on_voxel_planes(random, 1),
            Kind::VoxelLine => self.on_voxel_planes(random, 2),
            Kind::Vertex => self.at_vertex(random),
            Kind::Edge => self.on_edge(random),
            Kind::InsideBorder => self.inside_border(random),
            Kind::ShadowEdge => self.on_shadow_edge(random, light),
            Kind::Crease => self.near_crease(random, light),
            Kind::Area => {
                let surface = self.surfaces.by_area(random)?;
                self.surfaces.point_on(random, surface)
            }
            Kind::FreeVoxel => Some(self.at_voxel_border(random)),
            Kind::FreeSurface => {
                let mut start = self.on_any(random, light)?;
                start.surface = None;
                Some(start)
            }
            Kind::Lifted => self.lifted(random, light),
            Kind::Outside => Some(self.anywhere(random)),
            Kind::OffSurface => self.off_surface(random, light),
            Kind::OtherSurface => self.of_other_surface(random, light),
            Kind::StandIn => None,
        }
    }

    /// Returns a start on a surface, of any kind that has one.
    fn on_any(&self, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        let kind = random.one_of(&[
            Kind::VoxelPlane,
            Kind::VoxelLine,
            Kind::Vertex,
            Kind::Edge,
            Kind::InsideBorder,
            Kind::ShadowEdge,
            Kind::Crease,
            Kind::Area,
        ]);
        self.start_of(kind, random, light)
    }

    /// Returns the size of a small step: from roundings to some thousandth of the scene.
    fn small(&self, random: &mut Random) -> f64 {
        self.surfaces.size * random.power_of_ten(-16.0, -3.0)
    }

    /// Returns a free point on a surface, or a little off it along its normal.
    fn lifted(&self, random: &mut Random, light: usize) -> Option<ReceiverPoint> {
        let start = self.on_any(random, light)?;
        let occluders = self.surfaces.gathered.occluders();
        let normal = occluders.normal_at(start.surface?, start.point);
        let side = random.one_of(&[-1.0, 1.0]);
        let height = random.one_of(&[0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3]);
        let mut point = start.point + side * height * self.surfaces.size * normal;
        if random.below(3) == 0 {
            // One number off along an axis.
            let axis = random.below(3);
            point[axis] = next(point[axis], side as i32);
        }
        Some(ReceiverPoint {
            point,
            surface: None,
        })
    }

    /// Returns a free point in the scene's box, around it, or far away.
    fn anywhere(&self, random: &mut Random) -> ReceiverPoint {
        let reach = &self.surfaces.reach;
        let point = match random.below(4) {
            0 => random.in_box(reach),
            1 => random.in_box(&reach.inflated(reach.size())),
            2 => {
                // Close to a face of the scene's box.
                let mut point = random.in_box(reach);
                let axis = random.below(3);
                let bounds = self.surfaces.gathered.occluders().bounds();
                if !bounds.is_empty() {
                    point[axis] = random.one_of(&[bounds.min[axis], bounds.max[axis]]);
                }
                random.by_ulps(point)
            }
            _ => {
                let distance = self.surfaces.size * random.power_of_ten(0.0, 12.0);
                reach.center() + distance * random.direction()
            }
        };
        ReceiverPoint {
            point,
            surface: None,
        }
    }

    /// Returns a point of a triangle, the more likely the larger, or of any triangle.
    fn triangle_point(
        &self,
        random: &mut Random,
    ) -> Option<(antumbra_geometry::SurfaceId, [DVec3; 3], DVec3)> {
        let occluders = self.surfaces.gathered.occluders();
        let (surface, corners) = if random.below(2) == 0 {
            let surface = self.surfaces.by_area(random)?;
            (surface, occluders.triangle_positions(surface)?)
        } else {
            self.surfaces.any_triangle(random)?
        };
        let point = in_triangle(random, corners);
        Some((surface, corners, point))
    }
}
