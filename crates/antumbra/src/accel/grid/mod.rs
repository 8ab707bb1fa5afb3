//! The uniform voxel grid (Paper 4; Amanatides and Woo 1987).
//!
//! In: the surfaces. Out: for each voxel the surfaces that may meet it, and walks along rays.
//! Invariant: a surface is listed in every voxel that it meets once the voxel is inflated by
//! [`Layout::margin`], and a walk visits, for every point of its ray, a voxel that holds the point
//! once inflated by half of it. Absent here: lights, occlusion values.

mod build;
mod cut;
mod layout;
mod query;
mod walk;

pub(crate) use build::{Grid, affordable_resolution};
pub(crate) use layout::{Block, Layout};
pub(crate) use query::{Mailbox, any_hit_by_reference, nearest_of};
pub(crate) use walk::{Walk, point_along};
