//! Scenes: the model, the readers, the generators.

pub mod model;
