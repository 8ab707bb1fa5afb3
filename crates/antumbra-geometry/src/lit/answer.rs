//! What views of a light are asked and say.

use super::trace::Trace;

/// Effect of a surface on a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meeting {
    /// It hides nothing of it.
    Misses,
    /// It hides some, which is kept in mind.
    Hides,
    /// It may hide some, which has no closed form here, or there are too many.
    Unclear,
}

/// Shares of a light: which part of it is asked about and which part of that is lit, as shares of the whole light, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shares {
    /// Share that shines towards the start and is above its horizon.
    pub asked: f64,
    /// Share that is lit, too.
    pub lit: f64,
}

/// The plane that bounds what a start asks about, and whether it is the plane's negative side.
pub(super) type HorizonTrace<const K: usize> = Option<(Trace<K>, bool)>;
