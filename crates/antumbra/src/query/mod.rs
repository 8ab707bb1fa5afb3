//! What can be asked of an index: one point, slices, batches, rays, targets and lights with size.
//!
//! In: points, rays, lights. Out: answers in the caller's memory. Absent here: how a query is answered (`method`), and
//! what is known (`occlusion`).

mod all_lights;
mod along;
mod ask;
mod batch;
mod beam;
mod between;
#[cfg(all(test, unix))]
mod clock_tests;
mod directions;
mod fraction;
mod glass;
mod lists;
mod locate;
mod named;
mod off_surface;
mod own_rays;
mod points;
mod rays;
mod refused;
mod run;

pub use all_lights::in_turn::LightsInTurn;
pub use along::{LitIntervals, LitIntervalsError};
pub use beam::Targets;
pub use directions::DirectionSet;
pub use fraction::exact::{FractionBy, VisibleFraction};
pub use fraction::{LightSamples, LightSampling};
pub use locate::Sample;
pub use named::OffSurfaces;
pub use off_surface::OffSurface;
pub use own_rays::{AnyHit, WithRays};
pub use points::{Batch, BatchKind, Coordinates, Nearness, ReceiverSide, SurfaceNumber};
pub use rays::{Hits, RayBatch, Towards};
pub use refused::BatchError;
