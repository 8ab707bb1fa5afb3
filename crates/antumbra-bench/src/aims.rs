//! Segments that must be blocked: through a vertex or a point of an edge where all faces around
//! face the light.
//!
//! In: a mesh, a light. Out: free starts behind vertices and edges. Why they must be blocked: round
//! an inner edge there are two faces, round an inner vertex a closed fan of them. If the light lies
//! strictly on the same side of all, the fan covers a neighbourhood of the point as seen from the
//! light, so a segment through the point, or a rounding beside it, crosses the fan.

use std::collections::HashMap;

use antumbra::{LightId, ShadowIndex};
use antumbra_geometry::{DVec3, ReceiverPoint, SurfaceId};

/// Starts by what they aim at.
#[derive(Clone, Debug, Default)]
pub(super) struct Aims {
    /// Inner vertices.
    pub(super) vertices: Vec<ReceiverPoint>,
    /// One and three quarters of the way along inner edges.
    pub(super) edge_points: Vec<ReceiverPoint>,
    /// Middles of inner edges, the diagonals of a height field's cells among them.
    pub(super) midpoints: Vec<ReceiverPoint>,
}

/// What is known about a vertex or an edge.
#[derive(Clone, Copy, Debug)]
struct Faces {
    count: usize,
    /// The common side of the light, 0 if there is none.
    side: i8,
}

impl Faces {
    fn with(found: Option<Self>, side: i8) -> Self {
        match found {
            None => Self { count: 1, side },
            Some(Self { count, side: other }) => Self {
                count: count + 1,
                side: if side == other { side } else { 0 },
            },
        }
    }
}

/// Why no question is refused.
const FINE: &str = "corners are finite and there is a light";

type Key = [u64; 3];

fn key(point: DVec3) -> Key {
    // Adding zero makes -0 and 0 one.
    (point + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// Finds all aims of a mesh for light number 0, a point; starts lie `reach` times the distance to
/// the light behind what they aim at.
pub(super) fn aims(index: &ShadowIndex, light: DVec3, reach: f64) -> Aims {
    let occluders = index.occluders();
    let mut vertices: HashMap<Key, (DVec3, Faces)> = HashMap::new();
    let mut edges: HashMap<[Key; 2], ([DVec3; 2], Faces)> = HashMap::new();
    for surface in (0..occluders.triangle_count() as u32).map(SurfaceId) {
        let Some(corners) = occluders.triangle_positions(surface) else {
            continue;
        };
        let start = ReceiverPoint {
            point: corners[0],
            surface: Some(surface),
        };
        let side = if occluders.is_opaque(surface) {
            index.light_side(&start, LightId(0)).expect(FINE)
        } else {
            0
        };
        for i in 0..3 {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let found = vertices.get(&key(from)).map(|&(_, faces)| faces);
            vertices.insert(key(from), (from, Faces::with(found, side)));
            let (ends, name) = if key(from) < key(to) {
                ([from, to], [key(from), key(to)])
            } else {
                ([to, from], [key(to), key(from)])
            };
            let found = edges.get(&name).map(|&(_, faces)| faces);
            edges.insert(name, (ends, Faces::with(found, side)));
        }
    }

    // A vertex with an edge that has not two faces is no inner one.
    for ([from, to], (_, faces)) in &edges {
        if faces.count != 2 {
            for end in [from, to] {
                if let Some((_, faces)) = vertices.get_mut(end) {
                    faces.side = 0;
                }
            }
        }
    }
    let behind = |point: DVec3| ReceiverPoint {
        point: point + reach * (point - light),
        surface: None,
    };
    let mut aims = Aims::default();
    for (point, faces) in in_order(vertices) {
        if faces.side != 0 {
            aims.vertices.push(behind(point));
        }
    }
    for ([from, to], faces) in in_order(edges) {
        if faces.count == 2 && faces.side != 0 {
            let along = |share: f64| behind(from + share * (to - from));
            aims.edge_points.extend([0.25, 0.75].map(along));
            aims.midpoints.push(along(0.5));
        }
    }
    aims
}

/// Returns the values in the order of their keys, the same in every run.
fn in_order<K: Ord, V>(map: HashMap<K, V>) -> impl Iterator<Item = V> {
    let mut entries: Vec<_> = map.into_iter().collect();
    entries.sort_by(|(a, _), (b, _)| a.cmp(b));
    entries.into_iter().map(|(_, value)| value)
}
