//! The values of all lights, as queries read them.
//!
//! In: the surfaces, the lights. Out: for a start what is known of it. Invariant: what is known is the
//! reference's answer. Absent here: rays.

use antumbra_geometry::{Bounds, DVec3, LightShape, Mesh, Occluders, Start, SurfaceId};
use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4};
use rayon::prelude::*;

use super::bricks::{Bricks, Decisions, Leaf, ListId, ListPool, pack};
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
    level: Level,
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
            level: Level::new(),
        }
    }

    /// Finds what is known of starts whose own rules, if they have one, do not block: one place of
    /// `known` for each of `starts`, at most [`BLOCK`] of them.
    pub(crate) fn get(
        &self,
        occluders: &Occluders,
        starts: &[Start],
        light: usize,
        known: &mut [Known],
    ) {
        dispatch!(self.level, simd => self.get_wide(simd, occluders, starts, light, known));
    }

    #[inline(always)]
    fn get_wide<S: Simd>(
        &self,
        simd: S,
        occluders: &Occluders,
        starts: &[Start],
        light: usize,
        known: &mut [Known],
    ) {
        let query = Query {
            simd,
            values: self,
            light: &self.lights[light],
            occluders,
        };
        // One step for all starts before the next: so the memory that they need is fetched together.
        let mut audiences = [None; BLOCK];
        for (start, audience) in starts.iter().zip(&mut audiences) {
            *audience = query.audience(start);
        }
        for ((start, audience), known) in starts.iter().zip(audiences).zip(known) {
            *known = match audience {
                Some(audience) => query.get(start, start.point, audience),
                None => query.get_off_surface(start),
            };
        }
    }
}

/// Starts that are looked up together.
pub(crate) const BLOCK: usize = 32;

/// What is needed to look up a start.
struct Query<'a, S> {
    simd: S,
    values: &'a AdaptiveValues,
    light: &'a LightValues,
    occluders: &'a Occluders,
}

impl<S: Simd> Query<'_, S> {
    #[inline(always)]
    fn narrow(&self, point: DVec3) -> f32x4<S> {
        let x = self.values.frame.point_in_frame(point);
        f32x4::simd_from(self.simd, [x.x as f32, x.y as f32, x.z as f32, 0.0])
    }

    /// Returns whose values speak of a start that is where its point is, `None` if it may not be.
    #[inline(always)]
    fn audience(&self, start: &Start) -> Option<Audience> {
        let Some(SurfaceId(surface)) = start.surface else {
            return Some(Audience::Free);
        };
        let forms = self.values.start_forms.get(surface as usize)?;
        if !forms.is_start(self.simd, self.narrow(start.point)) {
            return None;
        }
        audience_of(self.light.sides[surface as usize])
    }

    /// The start is not where its point is given, or is on a curved surface.
    #[cold]
    #[inline(never)]
    fn get_off_surface(&self, start: &Start) -> Known {
        let Some(SurfaceId(surface)) = start.surface else {
            return Known::Nothing;
        };
        // The light does not matter to where the start is.
        let direction = LightShape::Direction(DVec3::X);
        let segment = self.occluders.segment(start, &direction);
        let room = 0.5 * START_ROOM / self.values.frame.scale;
        let audience = match self.light.sides.get(surface as usize) {
            Some(&side) => audience_of(side),
            None => self.is_on_curved(start, room).then_some(Audience::Front),
        };
        match audience {
            Some(audience) if segment.origin_error() < room => {
                self.get(start, segment.origin(), audience)
            }
            _ => Known::Nothing,
        }
    }

    /// Returns whether a start on a curved surface is nearly where its point is.
    fn is_on_curved(&self, start: &Start, room: f64) -> bool {
        let Some(surface) = start.surface else {
            return false;
        };
        if let Some(sphere) = self.occluders.sphere(surface) {
            let distance = (start.point - sphere.center).length();
            return (distance - sphere.radius).abs() < room;
        }
        let around = Bounds {
            min: start.point - room,
            max: start.point + room,
        };
        self.occluders.may_meet_box(surface, &around)
    }

    #[inline(always)]
    fn get(&self, start: &Start, point: DVec3, audience: Audience) -> Known {
        let lattice = &self.values.lattice;
        let x = self.narrow(point);
        let Some(finest) = lattice.finest_at(self.simd, x) else {
            return Known::Nothing;
        };
        match self.light.bricks[audience as usize].find(lattice, finest) {
            Leaf::Known(is_shadowed) => Known::Value(is_shadowed),
            Leaf::Unknown => Known::Nothing,
            Leaf::List(list) => Known::List(self.is_blocked_by(list, start, x)),
        }
    }

    /// Returns whether a listed surface blocks a start. Triangles of the start's own plane do not.
    #[inline(always)]
    fn is_blocked_by(&self, ListId(list): ListId, start: &Start, x: f32x4<S>) -> bool {
        let lists = &self.light.lists;
        let length = lists.words[list as usize] as usize;
        let first = list as usize + 1;
        let entries = &lists.words[first..first + length];
        let mut is_in_doubt = false;
        for &entry in entries {
            let Some(forms) = lists.forms.get(entry as usize) else {
                is_in_doubt = true;
                continue;
            };
            let verdict = forms.wide_verdict(self.simd, x);
            if verdict == Verdict::Outside {
                continue;
            }
            let blocker = &lists.blockers[entry as usize];
            if start
                .surface
                .is_some_and(|own| self.are_in_one_plane(own, blocker))
            {
                continue;
            }
            if verdict == Verdict::Inside && blocker.blocks_everywhere {
                return true;
            }
            is_in_doubt = true;
        }
        is_in_doubt && self.is_blocked_exactly(entries, start, x)
    }

    #[inline(always)]
    fn are_in_one_plane(&self, own: SurfaceId, blocker: &Blocker) -> bool {
        (own.0 as usize) < self.values.start_forms.len()
            && self.values.mesh.flat_group(own) == blocker.flat_group
    }

    /// Asks the exact rule about what is in doubt.
    #[cold]
    #[inline(never)]
    fn is_blocked_exactly(&self, entries: &[u32], start: &Start, x: f32x4<S>) -> bool {
        let lists = &self.light.lists;
        let segment = self.occluders.segment(start, &self.light.light);
        entries.iter().any(|&entry| {
            let surface = match lists.forms.get(entry as usize) {
                Some(forms) if forms.wide_verdict(self.simd, x) == Verdict::Outside => {
                    return false;
                }
                Some(_) => lists.blockers[entry as usize].surface,
                None => SurfaceId(entry & !EXACT),
            };
            self.occluders.blocks(surface, &segment)
        })
    }
}

/// Returns whose values speak of starts on a triangle; of those that the light's plane holds none do.
#[inline(always)]
fn audience_of(side: i8) -> Option<Audience> {
    match side {
        1 => Some(Audience::Front),
        -1 => Some(Audience::Back),
        _ => None,
    }
}

/// Halvings of the scene's box to the coarsest bricks, of 4^3 cells each.
const ROOT_LEVEL: u32 = 4;

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
}
