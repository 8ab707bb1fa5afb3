//! Which faces of a triangulation are inside an outline, by the even-odd rule.
//!
//! In: a triangulation that has every edge of the outline, and the outline. Out: for each face
//! whether it is inside. Invariant: faces that no edge of the outline parts are inside together, or
//! not at all; so each such region is asked once, at its largest face. Regions that reach the border
//! of the triangulation are outside.

use glam::DVec2;
use spade::{Triangulation, handles::FixedFaceHandle, handles::InnerTag};

use super::{Planar, turn};

/// The most comparisons of a point with an edge. No outline in use comes near it; it takes about a
/// second.
const MOST_WORK: usize = 1 << 28;

/// Returns for each face, by its index, whether it is inside; `None` if that takes too long.
pub(super) fn inside(planar: &Planar, outline: &[DVec2]) -> Option<Vec<bool>> {
    let (region_of, regions) = regions(planar);
    let is_inside = are_inside(outline, &regions)?;
    let inside_of = |region: u32| is_inside.get(region as usize) == Some(&true);
    Some(region_of.into_iter().map(inside_of).collect())
}

/// A region without outline edges in it: where to ask for it.
struct Region {
    number: u32,
    asked_at: DVec2,
}

/// Says which region each face belongs to.
fn regions(planar: &Planar) -> (Vec<u32>, Vec<Region>) {
    const NONE: u32 = u32::MAX;
    const OUTSIDE: u32 = u32::MAX - 1;
    let mut region_of = vec![NONE; planar.num_all_faces()];
    let mut regions = Vec::new();
    let mut members: Vec<FixedFaceHandle<InnerTag>> = Vec::new();
    for seed in planar.inner_faces() {
        if region_of[seed.index()] != NONE {
            continue;
        }
        let number = regions.len() as u32;
        region_of[seed.index()] = number;
        members.clear();
        members.push(seed.fix());
        let mut is_outside = false;
        let mut largest = (-1.0, DVec2::ZERO);
        let mut next = 0;
        while let Some(&member) = members.get(next) {
            next += 1;
            let face = planar.face(member);
            let [a, b, c] = face.positions();
            let area = face.area();
            if area > largest.0 {
                let middle = DVec2::new((a.x + b.x + c.x) / 3.0, (a.y + b.y + c.y) / 3.0);
                largest = (area, middle);
            }
            for edge in face.adjacent_edges() {
                if edge.is_constraint_edge() {
                    continue;
                }
                match edge.rev().face().as_inner() {
                    None => is_outside = true,
                    Some(neighbour) if region_of[neighbour.index()] == NONE => {
                        region_of[neighbour.index()] = number;
                        members.push(neighbour.fix());
                    }
                    Some(_) => {}
                }
            }
        }
        if is_outside {
            for member in &members {
                region_of[member.index()] = OUTSIDE;
            }
        } else {
            regions.push(Region {
                number,
                asked_at: largest.1,
            });
        }
    }
    (region_of, regions)
}

/// Returns for each region, by its number, whether a ray to the right from its point crosses the
/// outline an odd number of times.
fn are_inside(outline: &[DVec2], regions: &[Region]) -> Option<Vec<bool>> {
    let n = outline.len();
    // Edges from their lower to their upper end, and points, both from below.
    let mut edges: Vec<[DVec2; 2]> = (0..n)
        .map(|i| (outline[i], outline[(i + 1) % n]))
        .map(|(a, b)| if a.y <= b.y { [a, b] } else { [b, a] })
        .collect();
    edges.sort_by(|a, b| a[0].y.total_cmp(&b[0].y));
    let mut edges = edges.into_iter().peekable();
    let mut order: Vec<&Region> = regions.iter().collect();
    order.sort_by(|a, b| a.asked_at.y.total_cmp(&b.asked_at.y));

    let mut is_inside = vec![false; regions.len()];
    // Edges at the height of the point: those that begin at it or below and end above.
    let mut active: Vec<[DVec2; 2]> = Vec::new();
    let mut work = 0;
    for region in order {
        let point = region.asked_at;
        while let Some(edge) = edges.next_if(|[low, _]| low.y <= point.y) {
            active.push(edge);
        }
        work += active.len();
        if work > MOST_WORK {
            return None;
        }
        active.retain(|[_, high]| point.y < high.y);
        let crossings = active
            .iter()
            .filter(|[low, high]| turn(*low, *high, point) > 0.0);
        is_inside[region.number as usize] = crossings.count() % 2 == 1;
    }
    Some(is_inside)
}
