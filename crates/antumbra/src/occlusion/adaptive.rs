//! The values of all lights, as queries read them.
//!
//! In: the surfaces, the lights. Out: for a start what is known of it. Invariant: what is known is the
//! reference's answer. Absent here: rays.

use antumbra_geometry::{DVec3, LightShape, Mesh, Occluders, Start, SurfaceId};
use rayon::prelude::*;

use super::bricks::{Bricks, Decisions, Leaf, ListPool, pack};
use super::candidates::Casters;
use super::forms::{Forms, START_ROOM, Verdict};
use super::lattice::Lattice;
use super::refine::{Depth, Refiner};
use super::value::Audience;
use crate::frame::Frame;

/// Values of a scene for its lights.
#[derive(Debug)]
pub(crate) struct AdaptiveValues {
    frame: Frame,
    lattice: Lattice,
    /// For each triangle whether a point is where a start on it is.
    start_forms: Vec<Forms>,
    mesh: Mesh,
    lights: Vec<LightValues>,
}

/// Values for one light.
#[derive(Debug)]
struct LightValues {
    light: LightShape,
    /// For each triangle the side of its plane that the light is on.
    sides: Vec<i8>,
    /// For each [`Audience`].
    bricks: [Bricks; 3],
    lists: Lists,
}

/// Lists of possible blockers.
#[derive(Debug)]
struct Lists {
    /// Each list: its length, then its entries: numbers of `blockers`, or surfaces with [`EXACT`].
    words: Vec<u32>,
    forms: Vec<Forms>,
    blockers: Vec<Blocker>,
}

#[derive(Clone, Copy, Debug)]
struct Blocker {
    surface: SurfaceId,
    flat_group: u32,
    blocks_everywhere: bool,
}

/// Marks entries of lists that only the exact rule can tell.
const EXACT: u32 = 1 << 31;

/// What the values know of a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Known {
    /// The answer, by the value alone.
    Value(bool),
    /// The answer, by a list.
    List(bool),
    /// Nothing.
    Nothing,
}

impl AdaptiveValues {
    /// Decides and lists for all lights, on all threads.
    pub(crate) fn new(occluders: &Occluders, lights: &[LightShape], depth: Depth) -> Self {
        let bounds = occluders.bounds();
        let frame = Frame::new(bounds);
        let finest = depth.surfaces.max(depth.space);
        let lattice = Lattice::new(&bounds, &frame, ROOT_LEVEL.min(finest), finest);
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
        let lights = lights
            .iter()
            .map(|&light| {
                if is_ordinary(occluders, &frame, &light) {
                    LightValues::new(occluders, &mesh, frame, &lattice, light, depth)
                } else {
                    LightValues::nothing(occluders, &lattice, light)
                }
            })
            .collect();
        Self {
            frame,
            lattice,
            start_forms,
            mesh,
            lights,
        }
    }

    /// Returns what is known of a start whose own rule, if it has one, does not block.
    #[inline]
    pub(crate) fn get(&self, occluders: &Occluders, start: &Start, light: usize) -> Known {
        let values = &self.lights[light];
        let x = self.narrow(start.point);
        let audience = match start.surface {
            None => Audience::Free,
            Some(SurfaceId(surface)) => match self.start_forms.get(surface as usize) {
                Some(forms) => {
                    if !forms.is_start(x) {
                        return self.get_off_surface(occluders, start, light);
                    }
                    match values.sides[surface as usize] {
                        1 => Audience::Front,
                        -1 => Audience::Back,
                        _ => return Known::Nothing,
                    }
                }
                None => {
                    if !self.is_on_curved(occluders, start) {
                        return Known::Nothing;
                    }
                    Audience::Front
                }
            },
        };
        self.get_at(occluders, start, start.point, audience, light)
    }

    /// The start is not where its point is given.
    #[cold]
    fn get_off_surface(&self, occluders: &Occluders, start: &Start, light: usize) -> Known {
        let values = &self.lights[light];
        let Some(surface) = start.surface else {
            return Known::Nothing;
        };
        let audience = match values.sides.get(surface.0 as usize) {
            Some(1) => Audience::Front,
            Some(-1) => Audience::Back,
            _ => return Known::Nothing,
        };
        // The light does not matter to where the start is.
        let direction = LightShape::Direction(DVec3::X);
        let segment = occluders.segment(start, &direction);
        if segment.origin_error() * self.frame.scale > 0.5 * START_ROOM {
            return Known::Nothing;
        }
        self.get_at(occluders, start, segment.origin(), audience, light)
    }

    /// Returns whether a point is on a curved surface, nearly.
    fn is_on_curved(&self, occluders: &Occluders, start: &Start) -> bool {
        let Some(surface) = start.surface else {
            return false;
        };
        let room = 0.5 * START_ROOM / self.frame.scale;
        match occluders.sphere(surface) {
            Some(sphere) => {
                let distance = (start.point - sphere.center).length();
                (distance - sphere.radius).abs() < room
            }
            None => {
                let around = antumbra_geometry::Bounds {
                    min: start.point - room,
                    max: start.point + room,
                };
                let direction = LightShape::Direction(DVec3::X);
                let segment = occluders.segment(start, &direction);
                let moved = (segment.origin() - start.point).abs().max_element();
                occluders.may_meet_box(surface, &around) && moved + segment.origin_error() < room
            }
        }
    }

    #[inline]
    fn get_at(
        &self,
        occluders: &Occluders,
        start: &Start,
        point: DVec3,
        audience: Audience,
        light: usize,
    ) -> Known {
        let Some(finest) = self.lattice.finest_at(point) else {
            return Known::Nothing;
        };
        let values = &self.lights[light];
        match values.bricks[audience as usize].find(&self.lattice, finest) {
            Leaf::Known(is_shadowed) => Known::Value(is_shadowed),
            Leaf::Unknown => Known::Nothing,
            Leaf::List(list) => {
                let own_group = match start.surface {
                    Some(surface) if audience != Audience::Free => self.flat_group(surface),
                    _ => NO_GROUP,
                };
                let x = self.narrow(point);
                let list = list.0 as usize;
                let lists = &values.lists;
                Known::List(lists.is_blocked(list, occluders, start, &values.light, x, own_group))
            }
        }
    }
}

/// Halvings of the scene's box to the coarsest bricks, of 4^3 cells each.
const ROOT_LEVEL: u32 = 4;

/// The flat group of starts that belong to no triangle.
const NO_GROUP: u32 = u32::MAX;

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
    #[inline]
    fn narrow(&self, point: DVec3) -> [f32; 3] {
        self.frame
            .point_in_frame(point)
            .to_array()
            .map(|x| x as f32)
    }

    #[inline]
    fn flat_group(&self, surface: SurfaceId) -> u32 {
        if (surface.0 as usize) < self.start_forms.len() {
            self.mesh.flat_group(surface)
        } else {
            NO_GROUP
        }
    }

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
            } = &values.lists;
            bytes(&values.sides) + bytes(words) + bytes(forms) + bytes(blockers)
        };
        self.lights.iter().map(of_light).sum::<u64>()
            + bytes(&self.start_forms)
            + self.mesh.memory_bytes()
    }

    /// Returns the planes between the finest cells.
    pub(crate) fn planes(&self) -> (DVec3, f64, [u32; 3]) {
        self.lattice.planes()
    }
}

impl LightValues {
    fn new(
        occluders: &Occluders,
        mesh: &Mesh,
        frame: Frame,
        lattice: &Lattice,
        light: LightShape,
        depth: Depth,
    ) -> Self {
        let casters = Casters::new(occluders, mesh, frame, light);
        let refiner = Refiner {
            casters: &casters,
            lattice,
            depth,
        };
        let octrees = refiner.refine();
        let mut pool = ListPool::default();
        let bricks = octrees.map(|octrees| pack(octrees, &mut pool));
        let lists = Lists::new(&casters, pool);
        Self {
            light,
            sides: casters.sides,
            bricks,
            lists,
        }
    }

    /// Values that know nothing.
    fn nothing(occluders: &Occluders, lattice: &Lattice, light: LightShape) -> Self {
        let brick_count = lattice.root_bricks().count();
        let unknown = || {
            pack(
                vec![Decisions::Unknown; brick_count],
                &mut ListPool::default(),
            )
        };
        Self {
            light,
            sides: vec![0; occluders.triangle_count()],
            bricks: std::array::from_fn(|_| unknown()),
            lists: Lists {
                words: Vec::new(),
                forms: Vec::new(),
                blockers: Vec::new(),
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
        let mut numbers = vec![u32::MAX; casters.umbra_forms.len()];
        let mut at = 0;
        while at < words.len() {
            let length = words[at] as usize;
            for entry in &mut words[at + 1..=at + length] {
                let Some(number) = numbers.get_mut(*entry as usize) else {
                    *entry |= EXACT;
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
        }
    }

    /// Returns whether a listed surface blocks a start. Triangles of the start's own plane do not.
    #[inline]
    fn is_blocked(
        &self,
        list: usize,
        occluders: &Occluders,
        start: &Start,
        light: &LightShape,
        x: [f32; 3],
        own_group: u32,
    ) -> bool {
        let length = self.words[list] as usize;
        let entries = &self.words[list + 1..=list + length];
        let mut is_in_doubt = false;
        for &entry in entries {
            let Some(forms) = self.forms.get(entry as usize) else {
                is_in_doubt = true;
                continue;
            };
            match forms.verdict(x) {
                Verdict::Outside => {}
                verdict => {
                    let blocker = &self.blockers[entry as usize];
                    if blocker.flat_group == own_group {
                        continue;
                    }
                    if verdict == Verdict::Inside && blocker.blocks_everywhere {
                        return true;
                    }
                    is_in_doubt = true;
                }
            }
        }
        is_in_doubt && self.is_blocked_exactly(entries, occluders, start, light, x)
    }

    /// Asks the exact rule about what is in doubt.
    #[cold]
    fn is_blocked_exactly(
        &self,
        entries: &[u32],
        occluders: &Occluders,
        start: &Start,
        light: &LightShape,
        x: [f32; 3],
    ) -> bool {
        let segment = occluders.segment(start, light);
        entries.iter().any(|&entry| {
            let surface = match self.forms.get(entry as usize) {
                Some(forms) if forms.verdict(x) == Verdict::Outside => return false,
                Some(_) => self.blockers[entry as usize].surface,
                None => SurfaceId(entry & !EXACT),
            };
            occluders.blocks(surface, &segment)
        })
    }
}
