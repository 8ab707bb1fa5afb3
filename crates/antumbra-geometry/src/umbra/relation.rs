//! How an umbra lies to a box.

/// How one element's umbra lies to a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Relation {
    /// The element blocks no start in the box.
    Misses,
    /// The element blocks every start in the box.
    Covers,
    /// It may block some.
    Crosses,
}

/// Shapes for coverage are shrunk by this share, so that "in the umbra" holds with a margin that
/// no rounding of a start eats up, however close the light is to the shape.
pub(crate) const SHRINK: f64 = 1.0 - 1.0 / (1u64 << 24) as f64;
