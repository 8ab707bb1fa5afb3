//! The atomics that `links` is made of; a test replaces them by those of a model checker.

pub(crate) use std::sync::atomic::{AtomicU32, Ordering};
