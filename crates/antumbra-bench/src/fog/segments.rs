//! Stretches of eye rays through the air of a scene, and places on them.
//!
//! In: a prepared scene and its camera. Out: for each pixel of some tiles the segment from where its ray enters the scene's
//! box to what it hits, or to where it leaves the box. Invariant: coordinates of both ends are whole multiples of one power
//! of two and at most 2^36 of them, so a place whose share has 17 bits is an `f64` on the exact segment: the rule there is
//! the rule on the segment.

use antumbra_geometry::{Bounds, DVec3, Ray, ReceiverPoint};
use antumbra_render::camera::View;
use antumbra_render::integrator::{Integrator, Tally};
use antumbra_render::prepare::Prepared;
use antumbra_render::sampler::{mix, uniform};

/// Pixels along a side of a tile.
const TILE: u32 = 8;

/// Pixels along a side of a block, whose rays lie together within a tile.
const BLOCK: u32 = 4;

/// The air reaches so far beyond the surfaces' box, as a share of its largest side.
const AROUND: f64 = 0.02;

/// Shorter segments are left out, as a share of the box's largest side.
const SHORTEST: f64 = 1e-6;

/// Bits of a coordinate of an end: with those of a share they are an `f64`'s.
const COORDINATE_BITS: i32 = 36;
/// Bits of a share.
pub(super) const SHARE_BITS: u32 = 17;

/// A stretch of an eye ray.
pub(super) type Ends = [DVec3; 2];

/// Returns the segments of so many tiles of a frame, chosen by a seed: tile after tile, block after block.
pub(super) fn of_frame(prepared: &Prepared, view: &View, tiles: usize, seed: u64) -> Vec<Ends> {
    let bounds = prepared.gathered().occluders().bounds();
    if bounds.is_empty() {
        return Vec::new();
    }
    let size = bounds.size().max_element();
    let air = bounds.inflated(DVec3::splat(AROUND * size));
    let [columns, rows] = view.size().map(|pixels| pixels.div_ceil(TILE));
    let mut chosen: Vec<u64> = (0..u64::from(columns) * u64::from(rows)).collect();
    chosen.sort_by_key(|&tile| mix(seed ^ mix(tile)));
    chosen.truncate(tiles);
    let integrator = Integrator::new(prepared, 1);
    let mut segments = Vec::new();
    for tile in chosen {
        let corner = [tile % u64::from(columns), tile / u64::from(columns)];
        for pixel in 0..TILE * TILE {
            let (block, within) = (pixel / (BLOCK * BLOCK), pixel % (BLOCK * BLOCK));
            let blocks = TILE / BLOCK;
            let place = [
                block % blocks * BLOCK + within % BLOCK,
                block / blocks * BLOCK + within / BLOCK,
            ];
            let [x, y] =
                [0, 1].map(|axis| (corner[axis] * u64::from(TILE)) as f64 + f64::from(place[axis]));
            let ray = view.ray(x + 0.5, y + 0.5);
            let hit = integrator.first_seen(&ray, &mut Tally::default());
            let Some([from, to]) = inside(&air, &ray) else {
                continue;
            };
            let to = match hit {
                Some(seen) => seen.hit.point,
                None => ray.origin + to * ray.direction,
            };
            let from = ray.origin + from * ray.direction;
            if (to - from).length() > SHORTEST * size {
                segments.push([from, to]);
            }
        }
    }
    on_lattice(&mut segments);
    segments
}

/// Returns the shares of a ray's direction between which it is inside of a box.
fn inside(bounds: &Bounds, ray: &Ray) -> Option<[f64; 2]> {
    let (mut from, mut to) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
        let at = [bounds.min, bounds.max].map(|plane| (plane[axis] - origin) / direction);
        if direction == 0.0 {
            if origin < bounds.min[axis] || origin > bounds.max[axis] {
                return None;
            }
            continue;
        }
        from = from.max(at[0].min(at[1]));
        to = to.min(at[0].max(at[1]));
    }
    (from < to).then_some([from, to])
}

/// Moves all ends to the nearest points of a lattice.
fn on_lattice(segments: &mut [Ends]) {
    let ends = segments.as_flattened().iter();
    let largest = ends.map(|end| end.abs().max_element()).fold(0.0, f64::max);
    if largest == 0.0 {
        return;
    }
    // Above the largest coordinate, so that none is more than 2^36 units.
    let exponent = libm::frexp(largest).1 - COORDINATE_BITS;
    let unit = libm::ldexp(1.0, exponent);
    for end in segments.as_flattened_mut() {
        *end = (*end / unit).round() * unit;
    }
}

/// Returns the point of a segment at a share whose last bit is 2^-17 or before: exactly there.
pub(super) fn exact_place([from, to]: Ends, share: f64) -> ReceiverPoint {
    ReceiverPoint {
        point: (1.0 - share) * from + share * to,
        surface: None,
    }
}

/// Returns by what share of a step a segment's march is moved along.
pub(super) fn shift(number: usize, steps: u32, seed: u64) -> f64 {
    uniform(&[seed, number as u64, steps.into()])
}

/// Returns the points of a march in so many steps, moved along by a share of a step that each segment has of its own.
pub(super) fn jittered(
    [from, to]: Ends,
    number: usize,
    steps: u32,
    seed: u64,
) -> impl Iterator<Item = ReceiverPoint> {
    let shift = shift(number, steps, seed);
    (0..steps).map(move |step| ReceiverPoint {
        point: from + (f64::from(step) + shift) / f64::from(steps) * (to - from),
        surface: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra::IndexOptions;

    #[test]
    fn segments_lie_in_the_air_and_their_places_are_exact() {
        let scene = antumbra_scene::generate::city(40).expect("a city");
        let view = View::new(&scene.camera.expect("a camera"), [64, 64]).expect("a view");
        let prepared = Prepared::new(scene, &IndexOptions::default()).expect("a scene");
        let segments = of_frame(&prepared, &view, 20, 1);
        assert!(segments.len() > 600);
        assert_ne!(segments, of_frame(&prepared, &view, 20, 2));
        let bounds = prepared.gathered().occluders().bounds();
        let air = bounds.inflated(DVec3::splat(0.021 * bounds.size().max_element()));
        for ends in segments {
            assert!(ends.iter().all(|&end| air.contains(end)), "{ends:?}");
            // The middle of the middle is a quarter, whichever way it is found.
            let place = |share| exact_place(ends, share).point;
            assert_eq!(place(0.0), ends[0]);
            assert_eq!(place(1.0), ends[1]);
            let last = 1.0 / f64::from(1 << SHARE_BITS);
            assert_eq!(
                place(last) - ends[0],
                ends[1] - place(1.0 - last),
                "{ends:?}"
            );
            assert_eq!(2.0 * place(0.25) - ends[0], place(0.5));
        }
    }
}
