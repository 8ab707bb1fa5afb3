//! A point as the oracle is asked about it.

/// What is known of a point that is meant to lie on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OraclePoint {
    /// Where it is.
    pub point: [f64; 3],
    /// What it looks at, if that is known; of any length.
    pub normal: Option<[f64; 3]>,
    /// Whether it was rounded to `f32`; else to `f64`.
    pub is_single: bool,
    /// How far its surface may be, where that is said.
    pub tolerance: Option<f64>,
}
