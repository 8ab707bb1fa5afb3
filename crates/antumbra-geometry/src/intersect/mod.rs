//! Where things meet: one pair of shapes a file.
//!
//! `segment_*`: the rule of EXACTNESS.md ("Which surfaces block") and the distance of the crossing.
//! `box_*`: conservative overlap of a shape and a box, for putting shapes into voxels.
//! Invariant of the former: the answer is the rule's, whatever the rounding. Invariant of the
//! latter: never `false` for shapes that meet the box.

mod box_shapes;
mod box_triangle;
mod quadratic;
mod segment_cone;
mod segment_disk;
mod segment_sphere;
mod segment_triangle;

pub(crate) use box_shapes::{
    box_meets_cone, box_meets_disk, box_meets_sphere, cone_bounds, disk_bounds, unit_of,
};
pub(crate) use box_triangle::box_meets_triangle;
pub(crate) use quadratic::near_one;
use quadratic::{SignsTaken, signs_in_quadrant};
pub(crate) use segment_cone::{
    cone_distance, cone_is_outside, cone_meets_interior, is_behind_wall, own_tube_blocks,
    tube_blocks, tube_side, wall_exit,
};
pub(crate) use segment_disk::{DiskPlane, cap_exit, disk_blocks, disk_distance};
pub(crate) use segment_sphere::{
    line_surely_misses_ball, own_sphere_blocks, own_sphere_filter, own_sphere_surely_shows,
    sphere_blocks, sphere_distance, sphere_side,
};
pub(crate) use segment_triangle::{
    plane_side, triangle_blocks, triangle_distance, triangle_is_pierced,
};
