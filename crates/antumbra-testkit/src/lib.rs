//! Tests antumbra against exact arithmetic.
//!
//! * [`oracle`]: shadow answers in exact rational arithmetic, a second implementation of
//!   `EXACTNESS.md` that shares nothing with the library.

mod exact;
pub mod oracle;
