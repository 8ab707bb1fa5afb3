//! Sun studies as their users see them.

mod files;
mod hand_solved;
mod light;
mod positions;
mod sensors;
mod study;
mod sums;
mod support;
