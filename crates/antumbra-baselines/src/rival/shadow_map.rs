//! The shadow map. L. Williams, "Casting Curved Shadows on Curved Surfaces", Computer Graphics 12(3) (Proceedings of
//! SIGGRAPH 78), August 1978, 270-274; Paper 2.
//!
//! In: surfaces, one light. Out: the depth of what the light sees first through the middle of each texel of a
//! plane (round a point: of a cube's six). A query looks one texel up, and is in shadow where it is deeper by
//! more than a bias.
//!
//! **Not exact**, by construction: a texel has one depth for all starts in it. Too little bias and surfaces
//! shade themselves, too much and shadows come off what casts them. The bias here is one texel's width where the
//! start is. Planes are fitted to the scene, as those of the light buffer; there is no filter.

use antumbra::{Answer, Decided, LightId, QueryError, ShadowIndex};
use antumbra_geometry::{LightShape, Occluders, Ray, ReceiverPoint};

use super::formulas::PaperMemory;
use super::projection::{Place, Planes, Projected};
use super::{Rival, RivalError, RivalKind, RivalOptions, Work, answer};

/// The bias in widths of a texel.
const BIAS: f64 = 1.0;

/// Shadow maps of all lights.
#[derive(Debug)]
pub struct ShadowMap {
    maps: Vec<Map>,
}

#[derive(Debug)]
struct Map {
    planes: Planes,
    /// Plane by plane, infinite where nothing is.
    depths: Vec<Vec<f32>>,
}

impl ShadowMap {
    /// Draws the maps of all lights of an index.
    ///
    /// # Errors
    /// They need more memory than they may take.
    pub fn new(index: &ShadowIndex, options: &RivalOptions) -> Result<Self, RivalError> {
        let resolution = options.map_resolution.clamp(1, 8192).next_power_of_two();
        let mut left = options.memory_limit;
        let mut maps = Vec::new();
        for light in index.lights() {
            let planes = Planes::new(index.occluders(), light, resolution);
            let bytes = 4 * planes.cell_count() as u64;
            left = left.checked_sub(bytes).ok_or(RivalError::Memory {
                kind: RivalKind::ShadowMap,
                limit: options.memory_limit,
            })?;
            maps.push(Map::new(index.occluders(), light, planes));
        }
        Ok(Self { maps })
    }
}

impl Map {
    fn new(occluders: &Occluders, light: &LightShape, planes: Planes) -> Self {
        let begin = planes.before_all();
        let draw = |plane: &super::projection::Plane| {
            let mut depths = vec![f32::INFINITY; plane.cell_count()];
            for surface in occluders.surfaces().filter(|_| plane.has_cells()) {
                let Some(projected) = Projected::new(occluders, surface, plane, light) else {
                    continue;
                };
                plane.cells_of(&projected, &mut |texel, _| {
                    let (origin, direction) = plane.ray(texel, begin);
                    let ray = Ray {
                        origin,
                        direction,
                        leaves: None,
                    };
                    let segment = occluders.ray_segment(&ray);
                    if occluders.crosses(surface, &segment) {
                        let depth = begin + occluders.hit(surface, &segment).distance;
                        depths[texel] = depths[texel].min(depth as f32);
                    }
                });
            }
            depths
        };
        Self {
            depths: planes.planes.iter().map(draw).collect(),
            planes,
        }
    }

    fn is_shadowed(&self, place: Place) -> bool {
        let Place::Cell {
            plane, cell, depth, ..
        } = place
        else {
            return false;
        };
        let bias = BIAS * self.planes.planes[plane].width_at(depth);
        depth - bias > f64::from(self.depths[plane][cell])
    }
}

impl Rival for ShadowMap {
    fn kind(&self) -> RivalKind {
        RivalKind::ShadowMap
    }

    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError> {
        index.check_query(start, LightId::from_index(light))?;
        let map = &self.maps[light];
        work.counters.steps += 1;
        // The point as it is given: nothing here is exact.
        let is_shadowed = map.is_shadowed(map.planes.place(start.point, 0.0));
        let answer = answer(is_shadowed, Decided::FirstPass);
        work.counters.shadow.count(answer);
        Ok(answer)
    }

    fn bytes(&self, light: usize) -> u64 {
        let depths = &self.maps[light].depths;
        depths
            .iter()
            .map(|depths| size_of_val(depths.as_slice()) as u64)
            .sum()
    }

    fn paper_memory(&self, _: &ShadowIndex) -> Option<PaperMemory> {
        // The paper does not count it.
        None
    }
}
