//! Outlines of all kinds and sizes.

use super::*;

fn triangulate(outline: &[DVec3]) -> Vec<[PolygonCorner; 3]> {
    super::triangulate(outline).unwrap()
}

fn area(triangles: &[[PolygonCorner; 3]]) -> DVec3 {
    triangles
        .iter()
        .map(|t| 0.5 * (t[1].position - t[0].position).cross(t[2].position - t[0].position))
        .sum()
}

fn flat(points: &[(f64, f64)]) -> Vec<DVec3> {
    points.iter().map(|&(x, y)| DVec3::new(x, y, 1.0)).collect()
}

#[test]
fn square_is_a_fan_that_winds_as_given() {
    let square = flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
    assert_eq!(triangulate(&square).len(), 2);
    assert_eq!(area(&triangulate(&square)), DVec3::new(0.0, 0.0, 4.0));
    let back: Vec<DVec3> = square.into_iter().rev().collect();
    assert_eq!(area(&triangulate(&back)), DVec3::new(0.0, 0.0, -4.0));
}

#[test]
fn concave_outline_covers_its_area_once() {
    let arrow = flat(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)]);
    let triangles = triangulate(&arrow);
    assert_eq!(triangles.len(), 3);
    assert_eq!(area(&triangles), DVec3::new(0.0, 0.0, 10.0));
    assert!(
        triangles
            .iter()
            .flatten()
            .all(|corner| corner.outline_index.is_some())
    );
}

#[test]
fn vertex_on_an_edge_makes_no_empty_triangle() {
    let square = flat(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]);
    let triangles = triangulate(&square);
    assert_eq!(triangles.len(), 3);
    assert_eq!(area(&triangles), DVec3::new(0.0, 0.0, 4.0));
}

#[test]
fn bow_tie_is_filled_by_even_odd() {
    let bow_tie = flat(&[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]);
    let triangles = triangulate(&bow_tie);
    let total: f64 = triangles.iter().map(|t| area(&[*t]).length()).sum();
    assert!(
        (total - 2.0).abs() < 1e-12,
        "two triangles of area 1, not {total}"
    );
    assert!(
        triangles
            .iter()
            .flatten()
            .any(|corner| corner.outline_index.is_none())
    );
}

#[test]
fn repeated_and_collinear_vertices_have_no_area() {
    assert!(triangulate(&flat(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)])).is_empty());
    assert!(triangulate(&flat(&[(1.0, 1.0); 5])).is_empty());
    let with_double = flat(&[(0.0, 0.0), (2.0, 0.0), (2.0, 0.0), (2.0, 2.0)]);
    assert_eq!(area(&triangulate(&with_double)), DVec3::new(0.0, 0.0, 2.0));
}

#[test]
fn an_outline_that_is_closed_by_its_first_corner_is_the_fan_from_it() {
    // Not in one plane: the other diagonal is another shape.
    let [a, b, c, d] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 1.0],
        [0.0, 1.0, 0.0],
    ]
    .map(DVec3::from_array);
    let fan = [[a, b, c], [a, c, d]];
    for outline in [
        &[a, b, c, d][..],
        &[a, b, c, d, a],
        &[a, a, b, c, c, d, a, a],
        &[a, b, b, b, c, d],
    ] {
        let triangles = triangulate(outline);
        let corners = triangles.iter().map(|t| t.map(|corner| corner.position));
        assert_eq!(corners.collect::<Vec<_>>(), fan, "{outline:?}");
    }
}

#[test]
fn ties_of_the_normal_are_seen_along_the_lowest_axis() {
    // Newell's normal is (4, 4, 4). Seen along x the outline is strictly convex, along y and z it is a dart whose only
    // cut is the other one.
    let outline = [
        [0.0, 0.0, 0.0],
        [3.0, -1.0, 0.0],
        [4.0, -2.0, -2.0],
        [3.0, 0.0, -1.0],
    ]
    .map(DVec3::from_array);
    let fan = [[0, 1, 2], [0, 2, 3]].map(|triangle| triangle.map(Some));
    assert_eq!(indices(&outline), fan);
}

#[test]
fn corners_seen_at_one_place_are_one() {
    // A fence on a floor: its top and its foot are seen at one place from above.
    let outline = [
        [0.0, 0.0, 0.0],
        [8.0, 0.0, 0.0],
        [8.0, 8.0, 0.0],
        [8.0, 8.0, 1.0],
        [0.0, 8.0, 0.0],
    ]
    .map(DVec3::from_array);
    let triangles = triangulate(&outline);
    let heights = triangles.iter().flatten().map(|corner| corner.position.z);
    assert_eq!(heights.fold(0.0, f64::max), 0.0, "the first stands for all");
    assert_eq!(triangles.len(), 2);
}

/// Random numbers from 0 to 1 (a Weyl sequence through a mixer, as in SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Which vertices each triangle has.
fn indices(outline: &[DVec3]) -> Vec<[Option<u32>; 3]> {
    let triangles = triangulate(outline);
    triangles
        .iter()
        .map(|triangle| triangle.map(|corner| corner.outline_index))
        .collect()
}

const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
const ARROW: [(f64, f64); 5] = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)];
const BOW_TIE: [(f64, f64); 4] = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)];

#[test]
fn small_and_large_outlines_are_cut_alike() {
    for shape in [&SQUARE[..], &ARROW, &BOW_TIE] {
        let expected = indices(&flat(shape));
        // In a plane through the origin, and in one far from it.
        for plane in [0.0, 1.0, 1e6] {
            for exponent in [-1000, -565, -400, -142, -60, 60, 98] {
                let size = libm::scalbn(1.0, exponent);
                let at = |&(x, y): &(f64, f64)| DVec3::new(plane, x * size, y * size);
                let outline: Vec<_> = shape.iter().map(at).collect();
                assert_eq!(indices(&outline), expected, "2^{exponent} at {plane}");
            }
        }
    }
}

#[test]
fn a_quad_of_size_1e_minus_170_is_two_triangles() {
    for size in [1e-170, 1e-43] {
        let square = SQUARE.map(|(x, y)| DVec3::new(x * size, y * size, 0.0));
        assert_eq!(triangulate(&square).len(), 2, "{size}");
        let dart = [(0.0, 0.0), (2.0, 0.0), (0.5, 0.5), (0.0, 2.0)];
        let dart = dart.map(|(x, y)| DVec3::new(x * size, y * size, 0.0));
        assert_eq!(triangulate(&dart).len(), 2, "{size}");
    }
}

#[test]
fn needles_thinner_than_any_product_keep_their_triangles() {
    for width in [1e-30, 1e-100, 1e-200, 1e-300] {
        for shape in [&SQUARE[..], &ARROW] {
            let needle: Vec<_> = shape
                .iter()
                .map(|&(x, y)| DVec3::new(x, y * width, 0.0))
                .collect();
            assert_eq!(triangulate(&needle).len(), shape.len() - 2, "{width}");
        }
    }
}

/// Spade's own splitting panics on some of these.
#[test]
fn outlines_that_overlap_themselves_are_cut_without_a_panic() {
    let mut random = Random(7);
    let (mut count, mut refused) = (0, 0);
    for _ in 0..2000 {
        let n = 4 + (random.next() * 60.0) as usize;
        let outline: Vec<_> = (0..n)
            .map(|_| {
                let [x, y] = [random.next(), random.next()].map(|r| (5.0 * r).floor());
                DVec3::new(x, y, 0.5 * x)
            })
            .collect();
        // Where crossings lie a rounding apart, splitting may come to no end.
        let Ok(triangles) = super::triangulate(&outline) else {
            refused += 1;
            continue;
        };
        let is_inside =
            |p: DVec3| p.is_finite() && p.min_element() >= 0.0 && p.max_element() <= 5.0;
        assert!(triangles.iter().flatten().all(|c| is_inside(c.position)));
        count += triangles.len();
    }
    assert!(count > 10_000 && refused < 10, "{count}, {refused} refused");
}

/// The area of what is inside an odd number of times, for a pentagram and the like.
#[test]
fn outlines_wound_several_times_are_filled_by_even_odd() {
    let n = 5;
    let point = |i: usize| {
        let angle = (2 * i % n) as f64 / n as f64 * std::f64::consts::TAU;
        (libm::cos(angle), libm::sin(angle))
    };
    let pentagram: Vec<_> = (0..n).map(point).collect();
    let triangles = triangulate(&flat(&pentagram));
    assert_eq!(triangles.len(), 5, "five points, and not the middle");
}

/// A comb with so many corners, about half of them at its upper side.
fn comb(corners: usize) -> Vec<DVec3> {
    let y = |i: usize| if matches!(i % 4, 1 | 2) { 100.0 } else { 0.0 };
    let teeth = (0..corners).map(|i| ((i / 2) as f64, y(i)));
    let below = [(corners as f64, -1.0), (-1.0, -1.0)];
    flat(&teeth.chain(below).collect::<Vec<_>>())
}

fn is_quick<T>(what: &str, work: impl FnOnce() -> T) -> T {
    let begin = std::time::Instant::now();
    let result = work();
    let taken = begin.elapsed();
    assert!(taken.as_secs_f64() < 5.0, "{what} takes {taken:?}");
    result
}

#[test]
fn long_outlines_are_cut_in_time() {
    let n = 40_000;
    let teeth = is_quick("a comb", || triangulate(&comb(n)));
    assert_eq!(teeth.len(), n);

    let side = |i: usize| {
        let along = (i % (n / 4)) as f64 / (n / 4) as f64;
        [
            (along, 0.0),
            (1.0, along),
            (1.0 - along, 1.0),
            (0.0, 1.0 - along),
        ][i / (n / 4)]
    };
    let square: Vec<_> = (0..n).map(side).collect();
    let square = is_quick("a square with many vertices on its sides", || {
        triangulate(&flat(&square))
    });
    assert_eq!(square.len(), n - 2);
    assert!((area(&square).z - 1.0).abs() < 1e-9);

    let round = |i: usize| {
        let angle = i as f64 / n as f64 * std::f64::consts::TAU;
        (libm::cos(angle), libm::sin(angle))
    };
    let round: Vec<_> = (0..n).map(round).collect();
    let round = is_quick("a convex outline", || triangulate(&flat(&round)));
    assert_eq!(round.len(), n - 2);
}

#[test]
fn outlines_that_cross_themselves_too_often_are_refused_in_time() {
    let mut random = Random(1);
    for corners in [8000, 16_000] {
        let outline: Vec<_> = (0..corners)
            .map(|_| DVec3::new(random.next(), random.next(), 0.0))
            .collect();
        let refused = is_quick("a tangle", || super::triangulate(&outline));
        assert_eq!(refused, Err(TooManyCrossings { corners }));
    }
    // A hundred random vertices are not too many: they cross less than 4096 times.
    let outline: Vec<_> = (0..100)
        .map(|_| DVec3::new(random.next(), random.next(), 0.0))
        .collect();
    assert!(triangulate(&outline).len() > 1000);
}
