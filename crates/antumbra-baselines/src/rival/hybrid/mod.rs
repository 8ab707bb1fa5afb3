//! Hybrid shadow testing. D. S. Eo and C. M. Kyung, "Hybrid Shadow Testing Scheme for Ray Tracing", Computer-Aided
//! Design 21(1), January 1989, 38-48; as told in Paper 5.2.
//!
//! In: surfaces, one light, the voxels of the grid. Out: the boundary of all shadow volumes, as [`Polygon`]s
//! listed in the voxels that they meet, and the number of volumes that hold one point, the *reference*. A query
//! goes from the reference to its start, voxel after voxel, and adds up how the number changes; in the end it is
//! the number of volumes that hold the start. Once more than `N_th` polygons had to be tested, it gives up and
//! asks a shadow ray through the grid instead.
//!
//! | module | what |
//! |---|---|
//! | `boundary` | the polygons: triangles, and walls behind the edges where the number changes |
//! | `voxels` | which voxels a polygon meets, and which a ray visits |
//!
//! Invariant: answers are the reference's. A polygon that the way may only touch leaves the number in doubt, and
//! a shadow ray is asked; so it is where curved or alpha-tested surfaces, which have no polygons, may darken the
//! start's voxel.
//!
//! Where this departs from the paper, which keeps the number up to date along every ray of the picture: a query
//! knows no ray, so each goes straight from one reference, the viewpoint if it is in the grid or else the point
//! of the grid next to it. For eye rays that is the same way. `N_th` is there computed from statistics of the
//! polygons by a formula that could not be had; here it is measured: what shadow rays from the middles of some
//! surfaces take.

mod boundary;
mod voxels;

use antumbra::{Answer, Counters, Decided, QueryError, ShadowIndex};
use antumbra_geometry::{
    DVec3, ElementKind, LightShape, Occluders, Opacity, Segment, Start, SurfaceId,
};

use super::forms::{Frame, Polygon, WALL};
use super::formulas::{self, PaperMemory};
use super::{Rival, RivalError, RivalKind, RivalOptions, Work, answer};
use voxels::{Lists, Voxels};

/// How many shadow rays tell what one takes.
const SAMPLES: usize = 256;
/// Fewer polygons than this are always tested.
const FEWEST_TESTS: u64 = 8;
/// References tried before the number of volumes is given up.
const TRIES: u32 = 16;

/// Hybrid shadow testing for all lights.
#[derive(Debug)]
pub struct Hybrid {
    frame: Frame,
    voxels: Voxels,
    lights: Vec<Polygons>,
}

/// One light's.
#[derive(Debug)]
struct Polygons {
    polygons: Vec<Polygon>,
    lists: Lists,
    /// For each triangle its polygon; [`WALL`] for those without.
    caps: Vec<u32>,
    /// A bit a voxel: whether surfaces without polygons may darken it.
    is_darkened: Vec<u64>,
    /// The reference and the number of volumes that hold it; none where no point could be found that is off all
    /// their boundaries.
    reference: Option<(DVec3, i32)>,
    /// `N_th`.
    most_tests: u64,
}

impl Hybrid {
    /// Builds the polygons of all lights of an index.
    ///
    /// # Errors
    /// They need more memory than they may take.
    pub fn new(index: &ShadowIndex, options: &RivalOptions) -> Result<Self, RivalError> {
        let occluders = index.occluders();
        let frame = Frame::new(occluders.bounds());
        let voxels = Voxels::new(&frame, index.grid_resolution());
        let mut left = options.memory_limit;
        let mut lights = Vec::new();
        for light in 0..index.lights().len() {
            let polygons = Polygons::new(index, light, &frame, &voxels, options.viewpoint, left);
            let polygons = polygons.ok_or(RivalError::Memory {
                kind: RivalKind::Hybrid,
                limit: options.memory_limit,
            })?;
            left = left.saturating_sub(polygons.bytes());
            lights.push(polygons);
        }
        Ok(Self {
            frame,
            voxels,
            lights,
        })
    }
}

impl Polygons {
    /// `None` if they take more than so many bytes.
    fn new(
        index: &ShadowIndex,
        light_number: usize,
        frame: &Frame,
        voxels: &Voxels,
        viewpoint: Option<DVec3>,
        most_bytes: u64,
    ) -> Option<Self> {
        let occluders = index.occluders();
        let light = index.lights()[light_number].without_underflow();
        let polygons = boundary::polygons(occluders, &light, frame);
        let mut caps = vec![WALL; occluders.triangle_count()];
        for (number, polygon) in polygons.iter().enumerate() {
            if polygon.triangle != WALL {
                caps[polygon.triangle as usize] = number as u32;
            }
        }
        let mut all = Self {
            reference: reference(&polygons, frame, viewpoint),
            polygons,
            lists: Lists::default(),
            caps,
            is_darkened: darkened(occluders, &light, voxels),
            most_tests: 0,
        };
        let left = most_bytes.checked_sub(all.bytes())?;
        all.lists = Lists::new(voxels, &all.polygons, left)?;
        all.most_tests = usual_work(index, light_number).max(FEWEST_TESTS);
        Some(all)
    }

    fn bytes(&self) -> u64 {
        (size_of_val(self.polygons.as_slice())
            + size_of_val(self.caps.as_slice())
            + size_of_val(self.is_darkened.as_slice())) as u64
            + self.lists.bytes()
    }
}

/// Finds a point off all boundaries and counts the volumes that hold it.
fn reference(
    polygons: &[Polygon],
    frame: &Frame,
    viewpoint: Option<DVec3>,
) -> Option<(DVec3, i32)> {
    let bounds = frame.bounds();
    let wanted = viewpoint.unwrap_or_else(|| bounds.center());
    (0..TRIES).find_map(|number| {
        // Off the wanted point by no more than a hundredth of the box, each time elsewhere.
        let share = |axis: u32| f64::from(number * (7 + 2 * axis) % 16) / 1600.0;
        let off = bounds.size() * DVec3::new(share(0), share(1), share(2));
        let low = bounds.min + bounds.size() / 64.0;
        let high = bounds.max - bounds.size() / 64.0;
        let point = wanted.clamp(low.min(high), high.max(low)) + off;
        let seen = frame.seen(point);
        let volumes = polygons.iter().filter(|polygon| polygon.triangle != WALL);
        let count = volumes
            .map(|volume| volume.volume_holds(seen).map(i32::from))
            .sum::<Option<i32>>()?;
        bounds.contains(point).then_some((point, count))
    })
}

/// Marks the voxels that surfaces without polygons may darken.
fn darkened(occluders: &Occluders, light: &LightShape, voxels: &Voxels) -> Vec<u64> {
    let mut bits = vec![0; voxels.count().div_ceil(64)];
    for (number, element) in occluders.elements().iter().enumerate() {
        let has_polygons = element.kind == ElementKind::Face
            && !matches!(element.opacity, Opacity::AlphaTested(_));
        if has_polygons || element.opacity == Opacity::Transparent {
            continue;
        }
        let umbra = occluders.umbra(antumbra_geometry::ElementId(number as u32), light);
        voxels.mark_umbra(&umbra, light, &mut bits);
    }
    bits
}

/// Returns the mean work of shadow rays from the middles of some surfaces.
fn usual_work(index: &ShadowIndex, light: usize) -> u64 {
    let occluders = index.occluders();
    let step = occluders.surface_count().div_ceil(SAMPLES).max(1);
    let (mut counters, mut count) = (Counters::default(), 0);
    for surface in occluders.surfaces().step_by(step) {
        let start = Start {
            point: occluders.surface_bounds(surface).center(),
            surface: None,
        };
        // Middles of boxes are finite where their surfaces are.
        if index.shadow(&start, light, &mut counters).is_ok() {
            count += 1;
        }
    }
    (counters.steps + counters.intersections) / count.max(1)
}

impl Rival for Hybrid {
    fn kind(&self) -> RivalKind {
        RivalKind::Hybrid
    }

    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &Start,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError> {
        index.check_query(start, light)?;
        let occluders = index.occluders();
        let segment = occluders.segment(start, &index.lights()[light]);
        let known = if occluders.own_rule_blocks(&segment) {
            Some(true)
        } else {
            self.by_count(&self.lights[light], &segment, work)
        };
        match known {
            Some(is_shadowed) => {
                let answer = answer(is_shadowed, Decided::FirstPass);
                work.counters.shadow.count(answer);
                Ok(answer)
            }
            // Counts for itself.
            None => index.shadow(start, light, &mut work.counters),
        }
    }

    fn bytes(&self, light: usize) -> u64 {
        self.lights[light].bytes()
    }

    fn paper_memory(&self, index: &ShadowIndex) -> Option<PaperMemory> {
        Some(formulas::hybrid(index.occluders(), index.grid_resolution()))
    }
}

impl Hybrid {
    /// Counts the volumes that hold the start; `None` if there are too many polygons on the way, or in doubt.
    fn by_count(&self, light: &Polygons, segment: &Segment, work: &mut Work) -> Option<bool> {
        let (reference, mut count) = light.reference?;
        let start = self.frame.start(segment)?;
        let from = self.frame.seen(reference);
        count -= light.own_volume(segment.start().surface, from, start)?;
        let own = segment.start().surface;

        let mut tests = 0;
        // Polygons reach over several voxels: those that were crossed are few.
        let mut crossed: Vec<u32> = Vec::new();
        for voxel in self.voxels.walk(reference, segment.origin()) {
            work.counters.steps += 1;
            let list = light.lists.of(voxel);
            tests += list.len() as u64;
            work.candidates += list.len() as u64;
            if tests > light.most_tests {
                return None;
            }
            work.counters.intersections += list.len() as u64;
            for &number in list {
                let polygon = &light.polygons[number as usize];
                if own == Some(SurfaceId(polygon.triangle)) {
                    continue;
                }
                let change = polygon.crossing(from, start)?;
                if change != 0 && !crossed.contains(&number) {
                    crossed.push(number);
                    count += change;
                }
            }
        }
        if count != 0 {
            return Some(true);
        }
        let voxel = self.voxels.holding(segment.origin());
        let is_darkened = light.is_darkened[voxel / 64] >> (voxel % 64) & 1 != 0;
        (!is_darkened).then_some(false)
    }
}

impl Polygons {
    /// Returns how many volumes the way leaves by ending on its own triangle: one if it comes from behind it.
    fn own_volume(&self, own: Option<SurfaceId>, reference: DVec3, start: DVec3) -> Option<i32> {
        let cap = own.and_then(|own| self.caps.get(own.0 as usize).copied());
        let Some(cap) = cap.filter(|&cap| cap != WALL) else {
            return Some(0);
        };
        let cap = &self.polygons[cap as usize];
        match cap.side_of(reference) {
            1 => Some(0),
            -1 if cap.is_well_inside(start) => Some(1),
            _ => None,
        }
    }
}
