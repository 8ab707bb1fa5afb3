//! Work on all threads, or on one where the crate is built without its feature `parallel`.
//!
//! In: parallel iterators as rayon names them. Out: the same results, since none depends on threads. Without the feature
//! the names stand for plain iterators, as far as this crate uses them.

#[cfg(not(feature = "parallel"))]
mod alone;
#[cfg(feature = "parallel")]
mod apart;

#[cfg(not(feature = "parallel"))]
pub(crate) use alone::{apart, count, join, prelude};
#[cfg(feature = "parallel")]
pub(crate) use apart::apart;
#[cfg(feature = "parallel")]
pub(crate) use rayon::{current_num_threads as count, join, prelude};
