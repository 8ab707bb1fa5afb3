//! Whitted ray tracing over antumbra: from a scene and a camera to an image file.
//!
//! | stage | module | in | out |
//! |---|---|---|---|
//! | scene meets accelerator | [`prepare`] | `Scene` | [`Prepared`](prepare::Prepared) |
//! | eye rays | [`camera`], [`sampler`], [`orbit`] | `Camera`, pixel, sample | `Ray` |
//! | light in the air | [`fog`] | lit stretches of a ray | airlight |
//! | shading | [`integrator`], [`false_color`] | `Ray` | linear RGB, [`Tally`](integrator::Tally) |
//! | picture | [`film`], [`aov`] | all samples | [`Picture`](film::Picture), [`Layer`](aov::Layer)s |
//! | pictures of numbers | [`value_picture`], [`color_map`], [`legend`] | a number a point | [`Picture`](film::Picture) |
//! | exposure | [`exposure`] | finished pixels | stops |
//! | file | [`image_file`], [`exr_file`] | `Picture`, `Layer`s | PNG, OpenEXR |
//! | figures | [`statistics`] | `Tally`, times | the stable schema of `--stats-json` |
//!
//! Invariants: a picture is a pure function of scene and settings, whatever the number of threads
//! and the shadow method; shading normals decide no shadow. Absent here: how a shadow query is
//! answered, which only `antumbra` knows, and any printing.

pub mod aov;
pub mod camera;
pub mod color_map;
mod cone;
pub mod exposure;
pub mod exr_file;
pub mod false_color;
pub mod film;
pub mod fog;
pub mod image_file;
pub mod integrator;
pub mod legend;
pub mod orbit;
pub mod prepare;
pub mod sampler;
pub mod statistics;
pub mod value_picture;
mod vector;
