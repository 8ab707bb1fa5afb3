//! Exact shadow answers for static scenes, mostly without tracing a ray.

mod batch;
mod beam;
mod bvh;
mod clock;
mod draw;
mod frame;
mod grid;
mod index;
mod kept;
mod locate;
mod named;
mod occlusion;
mod own_rays;
mod parts;
mod rays;
mod shadow;
mod stats;
mod sweep;

pub use antumbra_task::{Stopped, Task};
pub use batch::{Batch, BatchCounters, BatchError, BatchKind, Coordinates};
pub use beam::Targets;
pub use index::{
    Answer, BuildError, Builder, Decided, GridResolution, Method, Prediction, QueryError,
    QuickCheck, QuickCheckVerdict, RayMethod, Refine, Refinement, Shadow, ShadowIndex,
};
pub use kept::{Change, KeptLight, LoadError, Part, Refusal, SaveError, Saved, Volume};
pub use locate::{Nearness, Sample};
pub use named::{OffSurface, OffSurfaces};
pub use own_rays::{AnyHit, WithRays};
pub use rays::{Hits, RayBatch, Towards};
pub use stats::{Counters, ShadowCounters};
