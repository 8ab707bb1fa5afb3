//! A bounding volume hierarchy: the surfaces in a tree of boxes, for rays of all kinds.
//!
//! In: the surfaces. Out: any-hit and nearest-hit queries with the bits of the reference. The tree is
//! built from the top down (Wald 2007), made better (Meister and Bittner 2018) and eight wide (Ylitie et al. 2017). Boxes and filters are `f32` in a frame of the scene's own
//! ([`Frame`](crate::accel::frame::Frame)), the rule is `Occluders`'.
//!
//! Many rays to one light (`many`) are prepared together (`rays`, `offsets`), in an order by place where theirs
//! is none (`order`), and walk as one where they start close together (`hull`).
//!
//! Invariants: a walk visits every surface that the exact rule may find (`ray`); a filter says *miss*
//! or *hit* only where the exact rule says the same (`filter`), all else is asked of the rule. Where
//! an `f32` says nothing - starts far off their surface or far outside the scene - the reference
//! answers. Absent here: lights, occlusion values, threads.

mod all;
mod beam;
mod binary;
mod bounds;
mod boxes;
mod build;
mod cull;
mod data;
mod filter;
mod hull;
mod many;
mod near;
mod offsets;
mod order;
mod ray;
mod rays;
mod reinsert;
mod topology;
mod walk;
mod wedge;

pub(crate) use beam::column::AskedDirection;
pub(crate) use beam::sheaf::{Cut, Reach, Sheaf};
pub(crate) use beam::tile::{OfTile, Tile};
pub(crate) use beam::whole::{Found, Whole};
pub(crate) use beam::{Asked, Block, Memory, TARGETS};
pub(crate) use cull::{Leaf, Region, WEDGES};
pub(crate) use data::Bvh;
pub(crate) use topology::{Topology, Tree};
pub(crate) use wedge::Visitor;
