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
//! | `switch` | from how many polygons on a shadow ray costs less |
//!
//! Invariant: answers are the reference's. A polygon that the way may only touch leaves the number in doubt, and
//! a shadow ray is asked; so it is where curved or alpha-tested surfaces, which have no polygons, may darken the
//! start's voxel.
//!
//! Where this departs from the paper, which keeps the number up to date along every ray of the picture: a query
//! knows no ray, so each goes straight from one reference, the viewpoint if it is in the grid or else the point
//! of the grid next to it. For eye rays that is nearly the same way; its voxels are counted as steps, although
//! there the eye ray has entered them anyway. `N_th` is computed there from statistics of the polygons, by a
//! formula that could not be had; here it is the number that costs least for queries from the middles of some
//! surfaces, zero where that is to send every shadow ray. Mailboxes spare second tests.

mod boundary;
mod switch;
mod voxels;

use std::cell::RefCell;

use antumbra::{Answer, Decided, LightId, QueryError, ShadowIndex};
use antumbra_geometry::{
    DVec3, ElementKind, LightShape, Occluders, Opacity, ReceiverPoint, Segment, SurfaceId,
};

use super::forms::{Frame, Polygon, WALL};
use super::formulas::{self, PaperMemory};
use super::{Rival, RivalError, RivalKind, RivalOptions, Work, answer};
use voxels::{Lists, Voxels};

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
        let mut hybrid = Self {
            frame,
            voxels,
            lights,
        };
        for light in 0..index.lights().len() {
            hybrid.lights[light].most_tests = options.most_polygons.unwrap_or_else(|| {
                switch::most_tests(index, light, |segment, work| {
                    let count = hybrid.by_count(&hybrid.lights[light], segment, work);
                    count != Count::Unknown
                })
            });
        }
        Ok(hybrid)
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
            most_tests: u64::MAX,
        };
        let left = most_bytes.checked_sub(all.bytes())?;
        all.lists = Lists::new(voxels, &all.polygons, left)?;
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
        if has_polygons
            || matches!(
                element.opacity,
                Opacity::Transparent | Opacity::Filtering(_)
            )
        {
            continue;
        }
        let umbra = occluders.umbra(antumbra_geometry::ElementId(number as u32), light);
        voxels.mark_umbra(&umbra, light, &mut bits);
    }
    bits
}

impl Rival for Hybrid {
    fn kind(&self) -> RivalKind {
        RivalKind::Hybrid
    }

    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError> {
        index.check_query(start, LightId::from_index(light))?;
        let occluders = index.occluders();
        let segment = occluders.segment(start, &index.lights()[light]);
        let count = if occluders.own_rule_blocks(&segment) {
            Count::Known(true)
        } else {
            self.by_count(&self.lights[light], &segment, work)
        };
        match count {
            Count::Known(is_shadowed) => {
                let answer = answer(is_shadowed, Decided::FirstPass);
                work.counters.shadow.count(answer);
                Ok(answer)
            }
            // Counts for itself.
            Count::Unknown => index.shadow(start, LightId::from_index(light), &mut work.counters),
        }
    }

    fn bytes(&self, light: usize) -> u64 {
        self.lights[light].bytes()
    }

    fn paper_memory(&self, index: &ShadowIndex) -> Option<PaperMemory> {
        Some(formulas::hybrid(index.occluders(), index.grid_resolution()))
    }
}

/// How a count ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Count {
    /// With an answer.
    Known(bool),
    /// Without, and a shadow ray is to be asked.
    Unknown,
}

impl Hybrid {
    /// Counts the volumes that hold the start, until there are too many polygons on the way or one is in doubt.
    fn by_count(&self, light: &Polygons, segment: &Segment, work: &mut Work) -> Count {
        if light.most_tests == 0 {
            return Count::Unknown;
        }
        let count = MAILBOX.with_borrow_mut(|mailbox| {
            mailbox.begin(light.polygons.len());
            self.count(light, segment, mailbox, work)
        });
        match count {
            None => Count::Unknown,
            Some(0) => {
                let voxel = self.voxels.holding(segment.origin());
                if light.is_darkened[voxel / 64] >> (voxel % 64) & 1 != 0 {
                    Count::Unknown
                } else {
                    Count::Known(false)
                }
            }
            Some(_) => Count::Known(true),
        }
    }

    fn count(
        &self,
        light: &Polygons,
        segment: &Segment,
        mailbox: &mut Mailbox,
        work: &mut Work,
    ) -> Option<i32> {
        let (reference, mut count) = light.reference?;
        let start = self.frame.start(segment)?;
        let from = self.frame.seen(reference);
        let own = segment.start().surface;
        count -= light.own_volume(own, from, start)?;

        let mut tests = 0;
        for voxel in self.voxels.walk(reference, segment.origin()) {
            work.counters.steps += 1;
            let list = light.lists.of(voxel);
            work.candidates += list.len() as u64;
            for &number in list {
                let polygon = &light.polygons[number as usize];
                if !mailbox.is_first(number) || own == Some(SurfaceId(polygon.triangle)) {
                    continue;
                }
                tests += 1;
                if tests > light.most_tests {
                    return None;
                }
                work.counters.intersections += 1;
                count += polygon.crossing(from, start)?;
            }
        }
        Some(count)
    }
}

thread_local! {
    static MAILBOX: RefCell<Mailbox> = const { RefCell::new(Mailbox::new()) };
}

/// Which polygons the query at hand has tested.
#[derive(Debug)]
struct Mailbox {
    /// For each polygon the last query that tested it; numbers are of this thread and never come again.
    last: Vec<u64>,
    query: u64,
}

impl Mailbox {
    const fn new() -> Self {
        Self {
            last: Vec::new(),
            query: 0,
        }
    }

    fn begin(&mut self, polygon_count: usize) {
        self.query += 1;
        if self.last.len() < polygon_count {
            self.last.resize(polygon_count, 0);
        }
    }

    fn is_first(&mut self, polygon: u32) -> bool {
        let last = &mut self.last[polygon as usize];
        std::mem::replace(last, self.query) != self.query
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
