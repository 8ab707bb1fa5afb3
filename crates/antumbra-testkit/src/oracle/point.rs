//! A point as the oracle is asked about it.

/// A point that is meant to lie on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OraclePoint {
    /// Position.
    pub point: [f64; 3],
    /// Normal, if that is known; of any length.
    pub normal: Option<[f64; 3]>,
    /// Whether it was rounded to `f32`; else to `f64`.
    pub is_single: bool,
    /// How far its surface may be, where that is said.
    pub tolerance: Option<f64>,
}
