//! Exact shadow rays for static scenes, most of them answered without tracing.
//!
//! antumbra answers one question: does an opaque surface stand between this point and that light? It is for renderers,
//! light bakers, sun and visibility studies and mesh pipelines that ask it millions of times about one scene. Answers
//! are *exact*: there is no offset from the surface, no epsilon, no shadow acne and no leak along an edge. They are the
//! same bits for every method, any number of threads and whatever was computed before.
//!
//! # One query
//!
//! Add a mesh, name the lights, build the index, ask. `add_mesh` takes `f32` or `f64` vertices.
//!
//! ```
//! use std::sync::Arc;
//! use antumbra::{LightShape, Occluders, Opacity, ShadowIndex};
//!
//! let mut surfaces = Occluders::builder();
//! let square = |half: f32, z: f32| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
//! let triangles = [[0, 1, 2], [0, 2, 3]];
//! let floor = surfaces.add_mesh(&square(4.0, 0.0), &triangles, Opacity::Opaque)?;
//! let roof = surfaces.add_mesh(&square(1.0, 2.0), &triangles, Opacity::Opaque)?;
//! assert_eq!((floor.clone(), roof), (0..2, 2..4));
//!
//! let lamp = LightShape::Point([0.0, 0.0, 9.0].into());
//! let index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![lamp]).build()?;
//!
//! // A point on triangle 0 of the floor, and one in the air. A light's number is its place in the list.
//! assert!(index.is_occluded([0.5, 0.0, 0.0], floor.start, 0)?);
//! assert!(!index.is_occluded([3.0, 0.0, 0.0], floor.start, 0)?);
//! assert!(index.is_occluded_at([0.0, 0.0, 1.0], 0)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A batch
//!
//! Many points are answered on all threads, straight into memory of yours: a byte for each point and light
//! ([`ShadowIndex::occluded`]) or a bit ([`ShadowIndex::occluded_bits`]). A [`Batch`] says what its points are: on
//! surfaces that you name, on surfaces that the index finds, in space, or in space with normals.
//!
//! ```
//! # use std::sync::Arc;
//! # use antumbra::{LightShape, Occluders, Opacity};
//! use antumbra::{Batch, LightId, ShadowIndex};
//! # let mut surfaces = Occluders::builder();
//! # let square = |half: f32, z: f32| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
//! # let triangles = [[0, 1, 2], [0, 2, 3]];
//! # surfaces.add_mesh(&square(4.0, 0.0), &triangles, Opacity::Opaque)?;
//! # surfaces.add_mesh(&square(1.0, 2.0), &triangles, Opacity::Opaque)?;
//! # let lamp = LightShape::Point([0.0, 0.0, 9.0].into());
//! # let mut index = ShadowIndex::builder(Arc::new(surfaces.build()), vec![lamp]).build()?;
//!
//! // The same scene. A light may come, move and go at any time; what is known of others stays.
//! let sun = index.add_light(LightShape::Direction([1.0, 0.0, 1.0].into()))?;
//! let points = [[0.5_f32, 0.0, 0.0], [3.0, 0.0, 0.0], [-2.0, 0.0, 0.0]];
//! let lights = [LightId(0), sun];
//! let mut out = [0; 6];
//! index.occluded(&Batch::on_nearest(&points, None), &lights, &mut out)?;
//! // Point after point, the lights of each side by side.
//! assert_eq!(out, [1, 0, 0, 0, 0, 1]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A renderer's own rays
//!
//! A renderer that has a ray tracer keeps it: antumbra answers what it knows, exactly, and asks the renderer the rest.
//! [`AnyHit::are_occluded`] is there for packets and streams.
//!
//! ```
//! # use std::sync::Arc;
//! # use antumbra::{Occluders, Opacity};
//! use antumbra::{AnyHit, Batch, LightId, LightShape, Method, ShadowIndex, ReceiverPoint};
//!
//! struct Renderer { /* its own tree */ }
//!
//! impl AnyHit for Renderer {
//!     fn is_blocked(&self, start: &ReceiverPoint, light: &LightShape) -> bool {
//!         let direction = light.towards(start.point);
//!         // Trace `direction` from `start.point`, as ever.
//! #       let _ = direction;
//!         false
//!     }
//! }
//!
//! # let mut surfaces = Occluders::builder();
//! # let square = |half: f32, z: f32| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
//! # let triangles = [[0, 1, 2], [0, 2, 3]];
//! # surfaces.add_mesh(&square(4.0, 0.0), &triangles, Opacity::Opaque)?;
//! # surfaces.add_mesh(&square(1.0, 2.0), &triangles, Opacity::Opaque)?;
//! # let surfaces = Arc::new(surfaces.build());
//! # let lamp = LightShape::Point([0.0, 0.0, 9.0].into());
//! // No tree is kept, and values are computed before the first query.
//! let index = ShadowIndex::builder(surfaces, vec![lamp])
//!     .method(Method::Voxel)
//!     .without_tree()
//!     .build()?;
//! let points = [[0.5_f32, 0.0, 0.0], [3.0, 0.0, 0.0]];
//! let mut out = [0; 2];
//! let counted = index
//!     .with_rays(&Renderer {})
//!     .occluded(&Batch::on_surfaces(&points, &[0_u32, 0]), &[LightId(0)], &mut out)?;
//! assert_eq!(out, [1, 0]);
//! assert_eq!(counted.counters.shadow.rays, 0, "values knew");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Methods and what they cost
//!
//! [`Builder::method`] chooses how queries are answered. The answers are the same, so the choice is about time and memory
//! alone. `n` is the number of surfaces.
//!
//! | method | what it computes | a query | memory besides the surfaces |
//! |---|---|---|---|
//! | [`Method::Auto`], the default | for each light an exact shadow map, where that pays | a look-up; where the map does not know, a ray | the tree, and [`Refinement::memory`] at most |
//! | [`Method::Voxel`] | two bits a voxel and light, and short lists of blockers; can be saved to a file | a look-up or a list; where neither knows, a ray | the tree, and [`Refinement::memory`] at most |
//! | [`Method::Bvh`] | nothing | a ray through a bounding volume hierarchy, about `log n` | the tree |
//! | [`Method::Grid`] | nothing | a walk through a uniform grid | the grid |
//! | [`Method::Voxel1990`] | the values of Woo and Amanatides (1990) | a look-up, else a walk | the grid, two bits a voxel and light |
//! | [`Method::Naive`] | nothing | a test of every surface, `n` | none: this is the reference |
//!
//! [`Refinement::refine`] says when: while queries are answered (the default), or all before the first query.
//! [`ShadowIndex::predict`] says how much memory that takes before any is taken, and [`Builder::memory_limit`] bounds it.
//!
//! # What is exact
//!
//! 1. The given `f64` numbers are taken as exact real numbers.
//! 2. The segment from the point to the light is open at both ends: neither blocks itself.
//! 3. A point that names a triangle or a disk is moved onto it exactly, so that rounding cannot lift or sink it.
//! 4. Nothing is lifted off a surface: there is no offset and no epsilon.
//! 5. A surface does not block its own points, and curved solids shade themselves by a rule of their own.
//! 6. A triangle holds its edges and corners, so no light leaks between triangles that share them.
//! 7. Signs are computed in `f64` with an error bound, and in exact arithmetic where that leaves a doubt.
//! 8. Every method gives the bit of [`ShadowIndex::shadow_by_reference`], for any number of threads.
//! 9. Where a ray hits ([`ShadowIndex::nearest`]) is rounded to `f64`; *whether* it hits is exact.
//! 10. `EXACTNESS.md` in the repository defines each case; a second implementation in rational arithmetic checks it.
//!
//! # Features
//!
//! Both are on by default and change no answer. `parallel` uses all threads of the current rayon pool for batches,
//! builds and bakes; without it all work is done on the calling thread. `file` saves and loads what is known
//! ([`ShadowIndex::save`]).

#![cfg_attr(
    not(feature = "file"),
    allow(
        dead_code,
        unused_imports,
        reason = "values are written and read for files alone"
    )
)]

mod accel;
mod answer;
mod clock;
mod draw;
mod file;
mod index;
mod limits;
mod method;
mod occlusion;
mod query;
mod settings;
mod stats;
mod threads;

pub use answer::{Answer, Decided, QueryError, Shadow};
pub use antumbra_geometry::{
    AreaError, AreaSample, AreaShape, Directions, DiskLight, MAX_LIGHT_SAMPLES, MOST_BLOCKERS,
    MOST_SPANS, MeshLight, PolygonLight, RectangleLight, SegmentLight, Sky, SphereLight, SunDisc,
    TriangleLight,
};
pub use antumbra_geometry::{
    Ball, BezierPatch, Bounds, Cone, Coverage, CoverageId, DVec2, DVec3, Disk, Element, ElementId,
    ElementKind, Field, Filter, FilterId, Hit, Implicit, ImplicitError, LightId, LightShape,
    MAX_DEGREE, MAX_PATCH_LEVEL, MAX_TERMS, Occluders, OccludersBuilder, OccludersError, Opacity,
    Precision, Ray, ReceiverPoint, Sphere, SurfaceId, Term, Tint, UnidentifiedCoverage,
};
pub use antumbra_task::{Stopped, Task};
pub use file::{Change, LoadError, Part, Refusal, SaveError, Saved, SavedLight};
pub use index::{BuildError, Builder, IndexOptions, LightError, Prediction, ShadowIndex, Volume};
pub use occlusion::{QuickCheckVerdict, Refine};
pub use query::{
    AnyHit, Batch, BatchError, BatchKind, Coordinates, DirectionSet, FractionBy, Hits,
    LightSamples, LightSampling, LightsInTurn, LitIntervals, LitIntervalsError, Nearness,
    OffSurface, OffSurfaces, RayBatch, ReceiverSide, Sample, SurfaceNumber, Targets, Towards,
    VisibleFraction, WithRays,
};
pub use settings::{GridResolution, Method, QuickCheck, RayMethod, Refinement};
pub use stats::{BatchCounters, Counters, ShadowCounters};
