//! The light buffer. E. A. Haines and D. P. Greenberg, "The Light Buffer: A Shadow-Testing Accelerator", IEEE
//! Computer Graphics and Applications 6(9), September 1986, 6-16; as told in Paper 5.1.
//!
//! In: surfaces, one light. Out: planes of cells round the light (for a direction, one plane), in each cell the
//! surfaces that may be seen through it from the light, nearest first, and the *full occlusion* distance
//! beyond which one of them blocks everything. A query looks its cell up: beyond full occlusion the start is in
//! shadow; without surfaces it is lit; else surfaces nearer than the start are tested in order.
//!
//! Invariant: answers are the reference's. A list holds all that may block a start of its cell (`projection`);
//! whoever is in it is asked by the exact rule.
//!
//! Kinder than the paper: each plane's cells cover only the rectangle in which the scene is seen, and what is
//! hidden behind full occlusion is not listed. Left out: the cache of the last occluder. Triangles are candidates
//! one by one, so of a polygon of several no cell across a seam is fully occluded.

use antumbra::{Answer, Decided, LightId, QueryError, ShadowIndex};
use antumbra_geometry::{LightShape, Occluders, ReceiverPoint, SurfaceId};

use super::formulas::{self, PaperMemory};
use super::projection::{Place, Planes, Projected};
use super::{Rival, RivalError, RivalKind, RivalOptions, Work, answer, any_blocks, by_all};

/// No surface covers the cell.
const NONE: u32 = u32::MAX;
/// Bytes of an entry while lists are made.
const ENTRY_BYTES: u64 = 16;

/// Light buffers of all lights.
#[derive(Debug)]
pub struct LightBuffer {
    resolution: u32,
    buffers: Vec<Buffer>,
}

/// One light's.
#[derive(Debug)]
struct Buffer {
    planes: Planes,
    grids: Vec<Grid>,
}

/// One plane's cells.
#[derive(Debug, Default)]
struct Grid {
    cells: Vec<Cell>,
    /// Surfaces cell after cell, each cell's by depth.
    surfaces: Vec<u32>,
    /// For each a depth that it does not fall below in the cell.
    depths: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Where its list ends; it begins where the one before ends.
    end: u32,
    /// The nearest full occlusion, rounded up, and whose it is.
    full_depth: f32,
    full_surface: u32,
}

/// One surface in one cell, while lists are made.
struct Entry {
    cell: u32,
    depth: f32,
    surface: u32,
}

impl LightBuffer {
    /// Builds the buffers of all lights of an index.
    ///
    /// # Errors
    /// They need more memory than they may take.
    pub fn new(index: &ShadowIndex, options: &RivalOptions) -> Result<Self, RivalError> {
        let occluders = index.occluders();
        let resolution = options
            .buffer_resolution
            .unwrap_or_else(|| usual_resolution(occluders.surface_count()))
            .clamp(1, 4096)
            .next_power_of_two();
        let mut left = options.memory_limit;
        let mut buffers = Vec::new();
        for light in index.lights() {
            let buffer = Buffer::new(occluders, light, resolution, left).ok_or({
                RivalError::Memory {
                    kind: RivalKind::LightBuffer,
                    limit: options.memory_limit,
                }
            })?;
            left = left.saturating_sub(buffer.bytes());
            buffers.push(buffer);
        }
        Ok(Self {
            resolution,
            buffers,
        })
    }
}

/// Twice as many cells a plane as surfaces, from 64 x 64 up to 512 x 512: the paper leaves it to the user, and
/// shorter lists than that no longer pay for their memory.
fn usual_resolution(surface_count: usize) -> u32 {
    let side = (2.0 * surface_count as f64).sqrt() as u32;
    side.clamp(64, 512).next_power_of_two()
}

impl Buffer {
    /// `None` if it takes more than so many bytes.
    fn new(
        occluders: &Occluders,
        light: &LightShape,
        resolution: u32,
        most_bytes: u64,
    ) -> Option<Self> {
        let planes = Planes::new(occluders, light, resolution);
        let mut left = most_bytes;
        let mut grids = Vec::new();
        for plane in &planes.planes {
            let cells_bytes = (plane.cell_count() * size_of::<Cell>()) as u64;
            left = left.checked_sub(cells_bytes)?;
            let mut full = vec![(f32::INFINITY, NONE); plane.cell_count()];
            let mut entries = Vec::new();
            for surface in occluders.surfaces().filter(|_| plane.has_cells()) {
                let Some(projected) = Projected::new(occluders, surface, plane, light) else {
                    continue;
                };
                let covers = occluders.is_opaque_everywhere(surface);
                plane.cells_of(&projected, &mut |cell, region| {
                    entries.push(Entry {
                        cell: cell as u32,
                        depth: rounded_down(projected.nearest(region)),
                        surface: surface.0,
                    });
                    if covers
                        && let Some(depth) = projected.covers(region)
                        && rounded_up(depth) < full[cell].0
                    {
                        full[cell] = (rounded_up(depth), surface.0);
                    }
                });
                if entries.len() as u64 * ENTRY_BYTES > left {
                    return None;
                }
            }
            let grid = Grid::new(entries, &full);
            left = left.checked_sub(grid.bytes() - cells_bytes)?;
            grids.push(grid);
        }
        Some(Self { planes, grids })
    }

    fn bytes(&self) -> u64 {
        self.grids.iter().map(Grid::bytes).sum::<u64>()
            + size_of_val(self.planes.planes.as_slice()) as u64
    }
}

impl Grid {
    fn new(mut entries: Vec<Entry>, full: &[(f32, u32)]) -> Self {
        // Behind full occlusion nobody is asked, up to its own surface.
        entries.retain(|entry| entry.depth <= full[entry.cell as usize].0);
        entries.sort_unstable_by(|a, b| {
            (a.cell, a.depth, a.surface)
                .partial_cmp(&(b.cell, b.depth, b.surface))
                .expect("depths are numbers")
        });
        let mut ends = vec![0; full.len()];
        for entry in &entries {
            ends[entry.cell as usize] += 1;
        }
        let mut end = 0;
        let cells = ends.iter().zip(full).map(|(count, full)| {
            end += count;
            Cell {
                end,
                full_depth: full.0,
                full_surface: full.1,
            }
        });
        Self {
            cells: cells.collect(),
            surfaces: entries.iter().map(|entry| entry.surface).collect(),
            depths: entries.iter().map(|entry| entry.depth).collect(),
        }
    }

    fn bytes(&self) -> u64 {
        (size_of_val(self.cells.as_slice())
            + size_of_val(self.surfaces.as_slice())
            + size_of_val(self.depths.as_slice())) as u64
    }
}

fn rounded_down(depth: f64) -> f32 {
    let rounded = depth as f32;
    if f64::from(rounded) > depth {
        rounded.next_down()
    } else {
        rounded
    }
}

fn rounded_up(depth: f64) -> f32 {
    -rounded_down(-depth)
}

impl Rival for LightBuffer {
    fn kind(&self) -> RivalKind {
        RivalKind::LightBuffer
    }

    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError> {
        index.check_query(start, LightId::from_index(light))?;
        let answer = self.buffers[light].answer(index, start, &index.lights()[light], work);
        work.counters.shadow.count(answer);
        Ok(answer)
    }

    fn bytes(&self, light: usize) -> u64 {
        self.buffers[light].bytes()
    }

    fn paper_memory(&self, index: &ShadowIndex) -> Option<PaperMemory> {
        Some(formulas::light_buffer(index.occluders(), self.resolution))
    }
}

impl Buffer {
    fn answer(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: &LightShape,
        work: &mut Work,
    ) -> Answer {
        let occluders = index.occluders();
        let segment = || occluders.segment(start, light);
        // The far side of a closed solid, whatever lies between.
        let has_own_rule = start
            .surface
            .is_some_and(|surface| occluders.has_own_rule(surface));
        if has_own_rule && occluders.own_rule_blocks(&segment()) {
            return answer(true, Decided::FirstPass);
        }
        work.counters.steps += 1;
        // The exact start takes longer to find than its cell.
        let place = self
            .planes
            .place(start.point, occluders.start_offset(start));
        let place = if place == Place::InDoubt {
            let segment = segment();
            self.planes.place(segment.origin(), segment.origin_error())
        } else {
            place
        };
        let (plane, cell, depth, error) = match place {
            Place::InDoubt => return by_all(index, &segment(), work),
            Place::Outside => return answer(false, Decided::FirstPass),
            Place::Cell {
                plane,
                cell,
                depth,
                depth_error,
            } => (plane, cell, depth, depth_error),
        };
        let grid = &self.grids[plane];
        let found = grid.cells[cell];
        let first = cell.checked_sub(1).map_or(0, |cell| grid.cells[cell].end);
        let list = first as usize..found.end as usize;
        if depth - error > f64::from(found.full_depth) {
            let full = SurfaceId(found.full_surface);
            let is_own = start
                .surface
                .is_some_and(|own| own == full || occluders.have_one_own_rule(own, full));
            // A start far off its own surface: what is behind is not listed.
            return if is_own {
                by_all(index, &segment(), work)
            } else {
                answer(true, Decided::FirstPass)
            };
        }
        if list.is_empty() {
            return answer(false, Decided::FirstPass);
        }
        work.candidates += list.len() as u64;
        let nearer = grid.depths[list.clone()]
            .iter()
            .take_while(|&&nearest| f64::from(nearest) <= depth + error)
            .count();
        if nearer == 0 {
            return answer(false, Decided::FirstPass);
        }
        let candidates = grid.surfaces[list][..nearer].iter().copied().map(SurfaceId);
        answer(
            any_blocks(index, &segment(), candidates, work),
            Decided::BlockerList,
        )
    }
}
