//! Where the nodes of meshes stand, so that 32 bits are enough for what is left of their coordinates.
//!
//! In: meshes. Out: a translation for each, zero where that serves. A vertex at `p` is written as the 32-bit number
//! nearest to `p - origin`, and comes back as the 64-bit sum of the two. Invariants: where an origin makes all
//! vertices of a mesh come back as they are, it is found if it is a coordinate of the mesh, within a bound on the work;
//! meshes that share a vertex and do not come back as they are have one origin, so that they still share it.

use std::borrow::Cow;
use std::collections::HashMap;

use antumbra_geometry::DVec3;

use crate::model::Mesh;

/// By how much an origin has to lessen rounding for it to be worth a translation. A mesh that stands at most at seven
/// times its size loses three bits of 24 without one.
const WORTH: f64 = 8.0;

/// Returns what a coordinate is written as, and what it comes back as.
pub(super) fn rounded(coordinate: f64, origin: f64) -> (f32, f64) {
    // One zero, so that equal positions are equal bits.
    let single = (coordinate - origin) as f32 + 0.0;
    (single, origin + f64::from(single))
}

/// Returns an origin for each mesh.
pub(super) fn origins(meshes: &[Cow<'_, Mesh>]) -> Vec<DVec3> {
    let own: Vec<Fit> = meshes.iter().map(|mesh| fit(&[&**mesh])).collect();
    let mut groups = Groups::new(meshes.len());
    if own.iter().any(|fit| !fit.is_exact) {
        groups.join(meshes);
    }
    let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
    for mesh in 0..meshes.len() {
        members.entry(groups.root(mesh)).or_default().push(mesh);
    }
    let mut origins = vec![DVec3::ZERO; meshes.len()];
    for group in members.values() {
        let is_exact = group.iter().all(|&mesh| own[mesh].is_exact);
        let common = match (is_exact, &group[..]) {
            (true, _) => None,
            (false, &[alone]) => Some(own[alone].origin),
            (false, all) => {
                let all: Vec<&Mesh> = all.iter().map(|&mesh| &*meshes[mesh]).collect();
                Some(fit(&all).origin)
            }
        };
        for &mesh in group {
            origins[mesh] = common.unwrap_or(own[mesh].origin);
        }
    }
    origins
}

/// An origin, and whether all comes back as it was.
struct Fit {
    origin: DVec3,
    is_exact: bool,
}

fn fit(meshes: &[&Mesh]) -> Fit {
    let mut is_exact = true;
    let origin = std::array::from_fn(|axis| {
        let (origin, error) = on_axis(meshes.iter().flat_map(|mesh| {
            let corners = mesh.corners.iter();
            corners.map(move |corner| mesh.positions[corner.position as usize][axis])
        }));
        is_exact &= error == 0.0;
        origin
    });
    Fit {
        origin: DVec3::from_array(origin),
        is_exact,
    }
}

/// Returns an origin on one axis and by how much coordinates are rounded in all.
fn on_axis(coordinates: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let error = |origin| {
        let of = |coordinate: f64| (rounded(coordinate, origin).1 - coordinate).abs();
        coordinates.clone().map(of).sum::<f64>()
    };
    let plain = error(0.0);
    if plain == 0.0 {
        return (0.0, plain);
    }
    let mut sorted: Vec<f64> = coordinates.clone().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    if let Some(origin) = exact_origin(&sorted) {
        return (origin, 0.0);
    }
    // Coordinates themselves: differences of coordinates have few bits where the coordinates have them on one lattice.
    // The median is where most of a mesh is, whatever lies far off; the one nearest to the middle leaves the smallest
    // differences.
    let median = sorted[sorted.len() / 2];
    let middle = (sorted[0] + sorted[sorted.len() - 1]) / 2.0;
    let from_middle = |x: &&f64| (*x - middle).abs();
    let nearest = sorted
        .iter()
        .min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)));
    let [by_median, by_middle] =
        [Some(&median), nearest].map(|origin| origin.map_or((0.0, plain), |&x| (x, error(x))));
    let best = if by_middle.1 < by_median.1 {
        by_middle
    } else {
        by_median
    };
    if WORTH * best.1 < plain {
        best
    } else {
        (0.0, plain)
    }
}

/// Returns a coordinate that makes all of them come back as they are, from the middle of their order outwards.
///
/// What was read from 32 bits and an origin that was a coordinate is so, whatever was rounded then: a coordinate that
/// came back keeps its 32 bits beside that origin. So what is written again stays the same bit for bit.
fn exact_origin(sorted: &[f64]) -> Option<f64> {
    /// Comparisons for each coordinate, lest time go with the square of their number. What is wrong for one origin is
    /// asked first of the next, so that nearly all take one.
    const MOST_EACH: usize = 64;
    let mut distinct = sorted.to_vec();
    distinct.dedup();
    let middle = distinct.partition_point(|x| *x < sorted[sorted.len() / 2]);
    let (below, above) = distinct.split_at(middle);
    let mut outwards = Vec::with_capacity(distinct.len());
    for step in 0..below.len().max(above.len()) {
        outwards.extend(above.get(step));
        outwards.extend(below.iter().rev().nth(step));
    }
    let mut asked_first = outwards.clone();
    let mut left = MOST_EACH * distinct.len();
    for origin in outwards {
        let is_wrong = |&x: &f64| rounded(x, origin).1 != x;
        let Some(wrong) = asked_first.iter().take(left).position(is_wrong) else {
            return (left >= asked_first.len()).then_some(origin);
        };
        left -= wrong;
        asked_first.swap(0, wrong);
    }
    None
}

/// Meshes that share vertices.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn join(&mut self, meshes: &[Cow<'_, Mesh>]) {
        let mut first = HashMap::new();
        for (number, mesh) in meshes.iter().enumerate() {
            for corner in &mesh.corners {
                // One zero.
                let key = (mesh.positions[corner.position as usize] + DVec3::ZERO)
                    .to_array()
                    .map(f64::to_bits);
                let other = *first.entry(key).or_insert(number);
                let (a, b) = (self.root(number), self.root(other));
                self.0[a] = b;
            }
        }
    }

    fn root(&mut self, mut mesh: usize) -> usize {
        while self.0[mesh] != mesh {
            self.0[mesh] = self.0[self.0[mesh]];
            mesh = self.0[mesh];
        }
        mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_on_a_lattice_come_back_wherever_they_are() {
        for far in [0.0, 691_000.0, 5_334_000.125, -1e9, 0.1] {
            let on_lattice = (-50..50).map(|i| far + f64::from(i) / 1024.0);
            // What the lattice is at that distance.
            let coordinates: Vec<f64> = on_lattice.collect();
            let (origin, error) = on_axis(coordinates.iter().copied());
            assert_eq!(error, 0.0, "{far}");
            for x in coordinates {
                assert_eq!(rounded(x, origin).1, x);
            }
        }
    }

    #[test]
    fn what_lies_far_off_does_not_blur_the_rest() {
        let near = (0..100).map(|i| 691_000.0 + 0.1 * f64::from(i));
        let (origin, _) = on_axis(near.clone().chain([0.3, 0.7]));
        for x in near {
            assert!((rounded(x, origin).1 - x).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn a_mesh_round_the_origin_stays_there() {
        let coordinates = (-7..9).map(|i| 0.1 * f64::from(i));
        assert_eq!(on_axis(coordinates).0, 0.0);
    }
}
