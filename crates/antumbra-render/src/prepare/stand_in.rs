//! Another method in the place of the index, for comparisons.

use std::fmt;

use antumbra::{Answer, Counters, QueryError, ShadowIndex};
use antumbra_geometry::ReceiverPoint;

/// A method that answers shadow queries about the surfaces and lights of an index in its place.
pub trait StandIn: fmt::Debug + Send + Sync {
    /// Answers one query. `index` is the one that this method was built for. Counts under `counters`; `candidates`
    /// grows by what was listed where the query looked.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        counters: &mut Counters,
        candidates: &mut u64,
    ) -> Result<Answer, QueryError>;

    /// Returns the bytes kept for one light, beside surfaces, grid and tree.
    ///
    /// # Panics
    /// There is no such light.
    fn bytes(&self, light: usize) -> u64;
}
