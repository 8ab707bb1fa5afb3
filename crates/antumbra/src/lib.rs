//! Exact shadow answers for static scenes, mostly without tracing a ray.

mod bvh;
mod clock;
mod frame;
mod grid;
mod index;
mod occlusion;
mod shadow;
mod stats;

pub use index::{
    Answer, BuildError, Builder, Decided, GridResolution, Method, QueryError, QuickCheck,
    QuickCheckVerdict, RayMethod, Refine, Refinement, Shadow, ShadowIndex,
};
pub use stats::{Counters, ShadowCounters};
