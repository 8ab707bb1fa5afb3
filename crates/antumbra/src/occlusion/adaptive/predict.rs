//! What lights will know, in bytes, before anything is made.
//!
//! In: counts and settings. Out: a guess that the room bounds. Tables are told from the sizes of what they hold; how
//! much values and lists take depends on how shadows lie, and is a share for each surface, as measured on scenes of
//! many kinds (`crates/antumbra/tests/memory.rs`).

use antumbra_geometry::{Mesh, Occluders};

use super::super::bricks::Store;
use super::super::lattice::Lattice;
use super::super::map;
use super::super::tables::{LightTables, SceneTables};
use super::demand::{CURVED_NS, TABLE_NS};
use super::{AdaptiveValues, Knowledge, Making};
use crate::Refine;
use crate::accel::frame::Frame;
use crate::occlusion::budget::LOSS;

/// Bytes of packed values and lists for a surface and light; fewer where cells are so coarse that shadows cross few of
/// them, by the square of the finest along an axis.
const PACKED_EACH: u64 = 300;
const PACKED_EACH_CURVED: u64 = 900;
const PACKED_SQUARE: u64 = 48;
/// Bytes of the store for one of what is packed from it.
const STORE_SHARE: u64 = 2;
/// Bytes of the store that queries fill, for a surface.
const FILLED_EACH: u64 = 20;
/// More for a vertex that is not shared: loose triangles have more borders.
const FILLED_LOOSE: u64 = 260;
/// Vertices of joined triangles, at most, in tenths of one a triangle.
const JOINED_TENTHS: u64 = 7;
/// Bytes of contour edges for a triangle.
const EDGES_EACH: u64 = 120;
/// Nanoseconds that a ray takes, as queries account for it, on scenes of many kinds.
const RAY_NS: f64 = 250.0;
/// So many queries at most are known to come when tables are weighed: a batch is cut into parts.
const AHEAD: f64 = 65_536.0;

impl AdaptiveValues {
    /// Returns about how many bytes lights will take of their room at the height; at most as many as that has. With so
    /// many queries of each light to come, or any number.
    pub(crate) fn predict_bytes(
        occluders: &Occluders,
        light_count: usize,
        making: &Making,
        query_count: Option<u64>,
    ) -> u64 {
        if occluders.surface_count() == 0 || light_count == 0 {
            return 0;
        }
        let (light_count, surface_count) = (light_count as u64, occluders.surface_count() as u64);
        let triangle_count = occluders.triangle_count() as u64;
        let scene = SceneTables::bytes_for(occluders, making.knowledge == Knowledge::Values);
        let of_light = LightTables::bytes_for(occluders);
        if making.knowledge == Knowledge::Maps {
            let spendable = query_count.map(|queries| 0.75 * RAY_NS * queries as f64);
            let is_made = making.refine != Refine::Lazy
                || spendable
                    .is_none_or(|spendable| spendable > map::price(occluders, false) as f64);
            if !is_made {
                return 0;
            }
            // As systems count that give all memory at once.
            let map = of_light + map::most_words(occluders);
            let mesh = Mesh::height_bytes_without_edges(occluders.triangle_count());
            let all = scene + mesh + light_count * map + map::height_bytes(occluders);
            return all.min(making.most_bytes);
        }
        let roots = Store::bare_bytes(&lattices(occluders, making), making.most_bytes);
        let all = match making.refine {
            Refine::Eager => {
                let square = 1 << (2 * making.depth.surfaces);
                let most = PACKED_EACH * triangle_count
                    + PACKED_EACH_CURVED * (surface_count - triangle_count);
                let packed = most.min(PACKED_SQUARE * square);
                let store = STORE_SHARE * packed + roots;
                let stays = of_light + packed + roots;
                let mesh = Mesh::height_bytes(occluders.triangle_count()) / 2;
                let beside = mesh + EDGES_EACH * triangle_count;
                let making = store + beside;
                scene + light_count * stays + making.max(store)
            }
            Refine::Queried | Refine::Lazy => {
                let price =
                    TABLE_NS * triangle_count + CURVED_NS * (surface_count - triangle_count);
                let queries = query_count.unwrap_or(u64::MAX) as f64;
                let spendable = RAY_NS * LOSS * (queries + queries.min(AHEAD));
                if making.refine == Refine::Lazy && spendable < price as f64 {
                    return 0;
                }
                // Before the first brick.
                let mesh = Mesh::height_bytes(occluders.triangle_count()) / 2;
                let edges = EDGES_EACH * triangle_count;
                let vertices = occluders.vertex_count() as u64;
                let loose = vertices.saturating_sub(JOINED_TENTHS * triangle_count / 10);
                let filled = FILLED_EACH * surface_count + FILLED_LOOSE * loose;
                let stays = of_light + filled + roots + edges;
                scene + mesh + light_count * stays
            }
        };
        all.min(making.most_bytes)
    }
}

fn lattices(occluders: &Occluders, making: &Making) -> [Lattice; 3] {
    let bounds = occluders.bounds();
    let frame = Frame::new(bounds);
    super::lattices(&bounds, &frame, making.depth)
}
