//! Words of packed values, run after run.

use std::borrow::Cow;

/// Words of one light in a few rows: values as a stream in the first and nothing in the others, or the tables of
/// what is packed: roots, bricks, leaves, entries.
pub(crate) type Runs<'a> = [Cow<'a, [u32]>; RUNS];

pub(crate) const RUNS: usize = 4;
