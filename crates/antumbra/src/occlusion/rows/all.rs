//! What answers all lights of an index at once: groups for beams, and rows.

use std::sync::atomic::{AtomicU32, Ordering};

use antumbra_geometry::{LightShape, Occluders};

use super::super::adaptive::AdaptiveValues;
use super::groups::Groups;
use super::light_rows::LightRows;
use crate::Refine;

/// Calls of fewer starts look at the ledger one time in so many.
const SMALL_CALL: usize = 64;
const LOOK: u32 = 16;

/// What answers all lights at once.
#[derive(Debug)]
pub(crate) struct AllLights {
    pub(crate) groups: Groups,
    /// `None` for methods that know nothing.
    pub(crate) rows: Option<LightRows>,
    pub(crate) refine: Refine,
    calls: AtomicU32,
}

impl AllLights {
    /// Prepares all lights; rows are a part of the room of `knowledge`, if there is any.
    pub(crate) fn new(
        occluders: &Occluders,
        lights: &[LightShape],
        knowledge: Option<&AdaptiveValues>,
    ) -> Self {
        let knowledge = knowledge.filter(|_| !lights.is_empty());
        let refine = knowledge.map_or(Refine::Lazy, |values| values.means().2);
        let rows = knowledge.map(|values| {
            let (room, finest_level, _) = values.means();
            LightRows::new(occluders, lights, room, finest_level)
        });
        Self {
            groups: Groups::new(lights),
            rows,
            refine,
            calls: AtomicU32::new(0),
        }
    }

    /// Returns the bytes of rows.
    pub(crate) fn row_bytes(&self) -> u64 {
        self.rows.as_ref().map_or(0, LightRows::bytes)
    }

    /// Returns whether a call of so many starts looks at whether rows pay.
    pub(crate) fn is_time_to_look(&self, start_count: usize) -> bool {
        start_count >= SMALL_CALL
            || self
                .calls
                .fetch_add(1, Ordering::Relaxed)
                .is_multiple_of(LOOK)
    }
}
