//! Tests antumbra against exact arithmetic.
//!
//! * [`oracle`]: shadow answers in exact rational arithmetic, a second implementation of
//!   `EXACTNESS.md` that shares nothing with the library.

mod build;
mod exact;
pub mod fixtures;
pub mod nasty;
pub mod oracle;
