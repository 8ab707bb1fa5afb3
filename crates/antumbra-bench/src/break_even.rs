//! From which frame on values have saved time.

use serde::Serialize;

/// From how many queries on cold `auto` has taken less time in total than `bvh`.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct BreakEven {
    /// Median over the rounds; null where `auto` is still behind after `most_frames`.
    pub(super) queries: Option<f64>,
    pub(super) most_frames: u32,
    /// Queries of a frame.
    pub(super) frame_queries: usize,
}

impl BreakEven {
    /// Returns it for people.
    pub(super) fn row(&self) -> String {
        match self.queries {
            Some(queries) => format!(
                "  cold auto has taken less time than bvh from {queries:.0} queries on, {:.2} frames",
                queries / self.frame_queries as f64
            ),
            None => format!(
                "  cold auto has not taken less time than bvh within {} frames",
                self.most_frames
            ),
        }
    }
}
