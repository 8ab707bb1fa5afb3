//! What is known of one light, to be saved.

use super::super::packed::Runs;

/// What is known of one light, to be kept.
pub(crate) struct KeptValues<'a> {
    pub(crate) runs: Runs<'a>,
    /// Links in whose place finer cells may be made.
    pub(crate) pending_count: u64,
}
