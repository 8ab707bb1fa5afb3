//! Surfaces that color the light that goes through them (EXACTNESS.md, "What glass lets through").
//!
//! In: a surface, a segment. Out: which share of each color passes. Invariants: which surfaces filter is decided by exact
//! signs, and of triangles that share an edge one does where the segment goes through the edge. Paper 6.3.

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::{ElementId, NO_AXIS, Occluders, OccludersBuilder, OccludersError, Opacity, Surface};
use crate::intersect::{triangle_distance, triangle_is_pierced};
use crate::segment::Segment;
use crate::{Filter, FilterId, SurfaceId};

impl OccludersBuilder {
    /// Takes up a filter for surfaces that color the light that goes through them ([`Opacity::Filtering`]).
    pub fn add_filter(&mut self, filter: Arc<dyn Filter>) -> FilterId {
        self.occluders.filters.push(filter);
        FilterId(self.occluders.filters.len() as u32 - 1)
    }

    /// Adds a face whose filter has a texture: as [`OccludersBuilder::add_face`], with texture coordinates for each vertex.
    ///
    /// # Errors
    /// A coordinate is not finite or too large, or there is not one pair of texture coordinates for each vertex.
    pub fn add_filtering_face(
        &mut self,
        outline: &[DVec3],
        uvs: &[[f64; 2]],
        filter: FilterId,
    ) -> Result<ElementId, OccludersError> {
        self.add_textured_face(outline, uvs, Opacity::Filtering(filter))
    }
}

impl Occluders {
    /// Returns whether there is a surface that colors light.
    pub fn has_filters(&self) -> bool {
        let filters = |opacity| matches!(opacity, Opacity::Filtering(_));
        self.elements.iter().any(|element| filters(element.opacity))
    }

    /// Returns the filtering surfaces alone, as if they were opaque; all others are left out ([`Occluders::without`]). Surfaces
    /// keep their numbers. What blocks none of these no light is filtered on.
    #[must_use]
    pub fn filters_alone(&self) -> Self {
        let others = (0..).zip(&self.elements);
        let others =
            others.filter(|(_, element)| !matches!(element.opacity, Opacity::Filtering(_)));
        let others: Vec<ElementId> = others.map(|(element, _)| ElementId(element)).collect();
        let mut alone = self.without(&others);
        alone.bounds = OnceLock::new();
        alone.first_freeform = OnceLock::new();
        // Own rules are those of glass, too.
        for solid in &mut alone.solids {
            solid.is_opaque = false;
        }
        for element in &mut alone.elements {
            if !matches!(element.opacity, Opacity::Filtering(_)) {
                continue;
            }
            element.opacity = Opacity::Opaque;
            for surface in element.surfaces.clone() {
                match (surface as usize).checked_sub(alone.triangles.len()) {
                    None => alone.triangles[surface as usize].is_opaque = true,
                    Some(curved) => {
                        let curved = &mut alone.curved[curved];
                        curved.is_opaque = true;
                        alone.solids[curved.solid as usize].is_opaque = true;
                    }
                }
            }
        }
        alone
    }

    /// Returns the shares of red, green and blue that a surface lets through where a segment crosses it; `None` if it filters
    /// nothing, or is not crossed. Parts of one curved shape say so one by one: whoever multiplies takes one for each element.
    pub fn filtered_by(&self, surface: SurfaceId, segment: &Segment) -> Option<[f64; 3]> {
        let element = self.element_of(surface);
        let Opacity::Filtering(filter) = self.elements[element.0 as usize].opacity else {
            return None;
        };
        let uv = match self.surface(surface) {
            Surface::Curved(curved) => {
                let is_crossed = self.curved_crosses(surface, curved, segment);
                is_crossed.then_some([0.0; 2])?
            }
            Surface::Triangle(triangle) => {
                let is_other = segment.start().surface != Some(surface);
                let corners = self.positions_of(triangle);
                let is_crossed =
                    is_other && triangle.axis != NO_AXIS && triangle_is_pierced(corners, segment);
                is_crossed.then(|| self.filter_place(surface, corners, segment))?
            }
        };
        Some(self.filters[filter.0 as usize].transmittance_at(uv))
    }

    /// Returns texture coordinates where a segment crosses a triangle.
    fn filter_place(&self, surface: SurfaceId, corners: [DVec3; 3], segment: &Segment) -> [f64; 2] {
        let place = self
            .filter_uvs
            .binary_search_by_key(&surface.0, |&(triangle, _)| triangle);
        let Ok(place) = place else {
            return [0.0; 2];
        };
        let (_, uvs) = self.filter_uvs[place];
        let (_, [b, c]) = triangle_distance(corners, segment);
        std::array::from_fn(|i| {
            uvs[0][i] + (uvs[1][i] - uvs[0][i]) * b + (uvs[2][i] - uvs[0][i]) * c
        })
    }
}
