//! The values of all lights.
//!
//! In: the surfaces, the lights. Out: bricks, lists and tables, which `lookup` reads.

use std::collections::HashMap;

use antumbra_geometry::{DVec3, LightShape, Mesh, Occluders, SurfaceId};
use fearless_simd::Level;
use rayon::prelude::*;

use super::balls::{Ball, BallStart};
use super::bricks::{Bricks, ListPool, pack};
use super::candidates::Casters;
use super::forms::{Forms, START_ROOM};
use super::lattice::Lattice;
use super::refine::{Depth, Refiner, cut_out};
use super::value::Audience;
use crate::frame::Frame;

/// Values of a scene for its lights.
#[derive(Debug)]
pub(crate) struct AdaptiveValues {
    pub(super) frame: Frame,
    /// How far a start may lie from its point, in world units.
    pub(super) start_room: f64,
    /// For each [`Audience`].
    pub(super) lattices: [Lattice; 3],
    /// For each triangle whether a point is where a start on it is.
    pub(super) start_forms: Vec<Forms>,
    /// The same for the other surfaces.
    pub(super) ball_starts: Vec<BallStart>,
    pub(super) mesh: Mesh,
    pub(super) lights: Vec<LightValues>,
    pub(super) level: Level,
}

/// Values for one light.
#[derive(Debug)]
pub(super) struct LightValues {
    pub(super) light: LightShape,
    /// For each triangle the side of its plane that the light is on.
    pub(super) sides: Vec<i8>,
    /// For each [`Audience`].
    pub(super) bricks: [Bricks; 3],
    pub(super) lists: Lists,
}

/// Lists of possible blockers.
#[derive(Debug)]
pub(super) struct Lists {
    /// Each list: its length, then its entries: numbers of `blockers`, numbers of `balls` with [`BALL`],
    /// or surfaces with [`EXACT`].
    pub(super) words: Vec<u32>,
    pub(super) forms: Vec<Forms>,
    pub(super) blockers: Vec<Blocker>,
    pub(super) balls: Vec<(Ball, SurfaceId)>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Blocker {
    pub(super) surface: SurfaceId,
    pub(super) flat_group: u32,
    pub(super) blocks_everywhere: bool,
}

/// Marks entries of lists that are spheres.
pub(super) const BALL: u32 = 1 << 30;

/// Marks entries of lists that only the exact rule can tell.
pub(super) const EXACT: u32 = 1 << 31;

impl AdaptiveValues {
    /// Decides and lists for all lights, on all threads.
    pub(crate) fn new(occluders: &Occluders, lights: &[LightShape], depth: Depth) -> Self {
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let lattices = Audience::ALL.map(|audience| {
            let finest = match audience {
                Audience::Front | Audience::Back => depth.surfaces,
                Audience::Free => depth.space,
            };
            Lattice::new(&bounds, &frame, finest)
        });
        let mesh = Mesh::new(occluders);
        let start_forms = (0..occluders.triangle_count() as u32)
            .into_par_iter()
            .map(|triangle| {
                let surface = SurfaceId(triangle);
                match (
                    occluders.triangle_positions(surface),
                    occluders.dominant_axis(surface),
                ) {
                    (Some(corners), Some(axis)) => Forms::of_starts(&frame, corners, axis),
                    _ => Forms::NOWHERE,
                }
            })
            .collect();
        let ball_starts = (occluders.triangle_count()..occluders.surface_count())
            .map(|surface| {
                let surface = SurfaceId(surface as u32);
                match occluders.sphere(surface) {
                    Some(sphere) if occluders.is_opaque(surface) => BallStart::new(sphere),
                    _ => BallStart::NONE,
                }
            })
            .collect();
        let lights = lights
            .iter()
            .map(|&light| {
                // Filters square directions.
                let light = light.without_underflow();
                if is_ordinary(occluders, &frame, &light) {
                    LightValues::new(occluders, &mesh, frame, &lattices, light, depth)
                } else {
                    LightValues::nothing(occluders, &lattices, light)
                }
            })
            .collect();
        Self {
            frame,
            start_room: START_ROOM / frame.scale,
            lattices,
            start_forms,
            ball_starts,
            mesh,
            lights,
            level: Level::new(),
        }
    }
}

/// Whether numbers stay so far from the ends of their range that products of lengths are safe, and
/// coordinates so small beside the scene that its frame can tell them.
fn is_ordinary(occluders: &Occluders, frame: &Frame, light: &LightShape) -> bool {
    const LARGEST: f64 = 1.4272476927059598e45; // 2^150
    let size = occluders.bounds().size().max_element();
    let reach = match *light {
        LightShape::Point(position) => position.abs().max_element(),
        LightShape::Direction(_) => 0.0,
    };
    occluders.surface_count() > 0
        && size > 1.0 / LARGEST
        && size.max(reach) < LARGEST
        && reach * frame.scale < 1e12
        && frame.margin_in_frame < START_ROOM / 64.0
}

impl AdaptiveValues {
    /// Returns the bytes of values and links.
    pub(crate) fn value_bytes(&self) -> u64 {
        let of_light = |values: &LightValues| values.bricks.iter().map(Bricks::bytes).sum::<u64>();
        self.lights.iter().map(of_light).sum()
    }

    /// Returns the bytes of lists, planes and tables.
    pub(crate) fn table_bytes(&self) -> u64 {
        fn bytes<T>(items: &[T]) -> u64 {
            size_of_val(items) as u64
        }
        let of_light = |values: &LightValues| {
            let Lists {
                words,
                forms,
                blockers,
                balls,
            } = &values.lists;
            bytes(&values.sides) + bytes(words) + bytes(forms) + bytes(blockers) + bytes(balls)
        };
        self.lights.iter().map(of_light).sum::<u64>()
            + bytes(&self.start_forms)
            + bytes(&self.ball_starts)
            + self.mesh.memory_bytes()
    }

    /// Returns the planes between the finest cells.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        self.lattices[Audience::Front as usize].planes()
    }
}

impl LightValues {
    fn new(
        occluders: &Occluders,
        mesh: &Mesh,
        frame: Frame,
        lattices: &[Lattice; 3],
        light: LightShape,
        depth: Depth,
    ) -> Self {
        let casters = Casters::new(occluders, mesh, frame, light);
        let refiner = Refiner {
            casters: &casters,
            lattices,
            depth,
        };
        let octrees = refiner.refine();
        let mut pool = ListPool::default();
        let bricks = std::array::from_fn(|audience| {
            let lattice = &lattices[audience];
            pack(lattice, cut_out(&octrees[audience], lattice), &mut pool)
        });
        let lists = Lists::new(&casters, pool);
        Self {
            light,
            sides: casters.sides,
            bricks,
            lists,
        }
    }

    /// Values that know nothing.
    fn nothing(occluders: &Occluders, lattices: &[Lattice; 3], light: LightShape) -> Self {
        let unknown =
            |lattice: &Lattice| pack(lattice, std::iter::empty(), &mut ListPool::default());
        Self {
            light,
            sides: vec![0; occluders.triangle_count()],
            bricks: lattices.each_ref().map(unknown),
            lists: Lists {
                words: Vec::new(),
                forms: Vec::new(),
                blockers: Vec::new(),
                balls: Vec::new(),
            },
        }
    }
}

impl Lists {
    /// Keeps the planes of the triangles that are listed.
    fn new(casters: &Casters<'_>, pool: ListPool) -> Self {
        let mut words = pool.words;
        let mut forms = Vec::new();
        let mut blockers = Vec::new();
        let mut balls = Balls::default();
        let mut numbers = vec![u32::MAX; casters.umbra_forms.len()];
        let mut at = 0;
        while at < words.len() {
            let length = words[at] as usize;
            for entry in &mut words[at + 1..=at + length] {
                let Some(number) = numbers.get_mut(*entry as usize) else {
                    *entry = balls.entry(casters.occluders, SurfaceId(*entry));
                    continue;
                };
                if *number == u32::MAX {
                    *number = blockers.len() as u32;
                    forms.push(casters.umbra_forms[*entry as usize]);
                    blockers.push(Blocker {
                        surface: SurfaceId(*entry),
                        flat_group: casters.mesh.flat_group(SurfaceId(*entry)),
                        blocks_everywhere: casters.blocks_everywhere(*entry),
                    });
                }
                *entry = *number;
            }
            at += 1 + length;
        }
        Self {
            words,
            forms,
            blockers,
            balls: balls.all,
        }
    }
}

/// Collects the spheres that are listed.
#[derive(Default)]
struct Balls {
    all: Vec<(Ball, SurfaceId)>,
    numbers: HashMap<SurfaceId, u32>,
}

impl Balls {
    /// Returns the entry of a surface that is no triangle.
    fn entry(&mut self, occluders: &Occluders, surface: SurfaceId) -> u32 {
        let Some(sphere) = occluders.sphere(surface) else {
            return surface.0 | EXACT;
        };
        let all = &mut self.all;
        let number = self.numbers.entry(surface).or_insert_with(|| {
            all.push((Ball::new(sphere), surface));
            all.len() as u32 - 1
        });
        *number | BALL
    }
}
