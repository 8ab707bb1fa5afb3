//! Tests antumbra against exact arithmetic.
//!
//! Shadow answers are exact by contract: `EXACTNESS.md` says what each one is. This crate holds a
//! second implementation of that page and the scenes to compare on. It depends on no other crate
//! of the project and looks at none, so that an error would have to be made twice to be missed.
//!
//! | module | what it holds |
//! |---|---|
//! | [`oracle`] | answers in exact rational arithmetic, by testing every surface |
//! | [`freeform`] | patches and implicit surfaces, every triangle and every sample |
//! | [`fixtures`] | named scenes with the answers geometry gives, and the page's known limits |
//! | [`nasty`] | seeded random scenes full of ties and rounding |
//! | [`help`] | what the help of every program has to be like |
//! | [`absent`] | what tests compare with and may not be there |
//!
//! Everything is plain data of `f64`s; the test that compares converts it. Surfaces are named by
//! their index. Scenes list triangles first, then the other shapes, closed cones as tube, base
//! cap, apex cap: in this order the library numbers what is added to it.
//!
//! ```
//! use antumbra_testkit::{nasty, oracle::Oracle};
//!
//! let scene = nasty::scene(123);
//! let oracle = Oracle::new(scene.surfaces.clone());
//! for query in &scene.queries {
//!     for &light in &scene.lights {
//!         let expected = oracle.is_blocked(query.point, query.surface, light);
//!         let found = expected; // ask the library here
//!         assert_eq!(found, expected, "{}: {query:?} {light:?}", scene.label());
//!     }
//! }
//! ```

pub mod absent;
mod build;
mod exact;
pub mod fixtures;
pub mod freeform;
pub mod help;
pub mod nasty;
pub mod oracle;
