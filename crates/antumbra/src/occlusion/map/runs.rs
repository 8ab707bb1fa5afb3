//! Words of a map, run after run.

use std::borrow::Cow;

/// Words of a map: of its tiles, where the surfaces of each tile begin, these surfaces, what is told of whole faces.
pub(in super::super) type MapRuns<'a> = [Cow<'a, [u32]>; 4];
