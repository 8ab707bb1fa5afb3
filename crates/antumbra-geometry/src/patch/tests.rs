//! Patches against the exact rule.

use super::*;
use crate::{Mesh, Opacity, ReceiverPoint, Segment};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn around(center: DVec3, half: f64) -> Bounds {
    Bounds {
        min: center - half,
        max: center + half,
    }
}

fn opaque(triangles: &[[DVec3; 3]]) -> Occluders {
    let mut builder = Occluders::builder();
    for triangle in triangles {
        builder.add_face(triangle, Opacity::Opaque).expect("a face");
    }
    builder.build()
}

fn patch_of<'a>(
    occluders: &'a Occluders,
    surface: SurfaceId,
    bounds: &Bounds,
    light: &LightShape,
) -> Option<Patch<'a>> {
    let sides = occluders.light_sides(light);
    let side = sides.get(surface.0 as usize).copied();
    occluders.patch(surface, bounds, light, side.unwrap_or(1))
}

const FLOOR: [DVec3; 3] = [
    DVec3::new(-9.0, -9.0, 0.0),
    DVec3::new(9.0, -9.0, 0.0),
    DVec3::new(0.0, 18.0, 0.0),
];

#[test]
fn a_wall_cuts_the_floor_where_it_stands() {
    let foot = [v(-1.0, 0.0, 0.0), v(1.0, 0.0, 0.0)];
    let wall = [foot[0], foot[1], v(0.0, 0.0, 2.0)];
    let occluders = opaque(&[FLOOR, wall]);
    for light in [
        LightShape::Point(v(0.5, 3.0, 7.0)),
        LightShape::Direction(v(0.0, 0.3, 1.0)),
    ] {
        let is_clear = |center: DVec3| {
            let bounds = around(center, 0.25);
            let patch = patch_of(&occluders, SurfaceId(0), &bounds, &light);
            patch.expect("floor").is_clear_of(SurfaceId(1))
        };
        // Beside it, and before its end in its plane.
        for clear in [v(0.0, 1.0, 0.0), v(0.0, -1.0, 0.0), v(2.5, 0.0, 0.0)] {
            assert!(is_clear(clear), "{clear} {light:?}");
        }
        for cut in [v(0.0, 0.0, 0.0), v(0.9, 0.1, 0.0), v(-1.1, -0.2, 0.0)] {
            assert!(!is_clear(cut), "{cut} {light:?}");
        }
    }
    // Lit from below the wall is behind the floor: it is in nobody's way.
    let below = LightShape::Point(v(0.0, 0.0, -5.0));
    let patch = patch_of(&occluders, SurfaceId(0), &around(DVec3::ZERO, 0.5), &below);
    assert!(patch.expect("floor").is_clear_of(SurfaceId(1)));
    // The floor cuts the wall nowhere: it ends there.
    let light = LightShape::Point(v(0.5, 3.0, 7.0));
    let patch = patch_of(&occluders, SurfaceId(1), &around(DVec3::ZERO, 0.5), &light);
    assert!(patch.expect("wall").is_clear_of(SurfaceId(0)));
}

#[test]
fn edges_matter_only_between_the_patch_and_the_light() {
    let light = LightShape::Point(v(0.0, 0.0, 10.0));
    let bounds = around(v(0.0, 0.0, 0.0), 1.0);
    let misses = |edge_of: [DVec3; 2]| {
        // Far apex: only this edge of the triangle is asked.
        let occluders = opaque(&[FLOOR, [edge_of[0], edge_of[1], v(70.0, 0.0, 80.0)]]);
        let mesh = Mesh::new(&occluders);
        let mut edges = mesh.edges().iter();
        let edge = edges
            .find(|edge| {
                let ends = occluders.edge_positions(edge);
                edge_of.iter().all(|end| ends.contains(end))
            })
            .expect("the edge");
        let patch = patch_of(&occluders, SurfaceId(0), &bounds, &light).expect("floor");
        patch.misses_edge(edge)
    };
    // Across, at all heights; with one end far beside.
    assert!(!misses([v(-3.0, 0.1, 5.0), v(3.0, 0.2, 5.0)]));
    assert!(!misses([v(-3.0, 0.1, 1e-9), v(3.0, 0.2, 1e-9)]));
    assert!(!misses([v(0.1, 0.1, 9.0), v(60.0, 3.0, 9.0)]));
    // It goes through the floor within the patch.
    assert!(!misses([v(0.1, 0.1, -1.0), v(0.2, 0.3, 1.0)]));
    // Behind the plane; touching it from behind.
    assert!(misses([v(-3.0, 0.1, -5.0), v(3.0, 0.2, -1e-9)]));
    assert!(misses([v(-3.0, 0.1, 0.0), v(3.0, 0.2, -1.0)]));
    // In front and beside: of the walls, and of the plane through the light and the edge.
    assert!(misses([v(3.0, -1.0, 1.0), v(3.0, 1.0, 1.0)]));
    assert!(misses([v(3.0, 0.0, 1.0), v(0.0, 3.0, 1.0)]));
    assert!(misses([v(1.9, 0.0, 1.0), v(0.0, 1.9, 1.0)]));
    // Close to the light walls are close together.
    assert!(misses([v(0.2, -1.0, 9.0), v(0.2, 1.0, 9.0)]));
    assert!(!misses([v(0.05, -1.0, 9.0), v(0.05, 1.0, 9.0)]));
    // Beyond the light.
    assert!(misses([v(5.0, 6.0, 11.0), v(5.0, -6.0, 11.0)]));
    // Its own.
    assert!(misses([FLOOR[0], FLOOR[1]]));
    // From an own corner that is not in the box, up and away, and back over the patch.
    assert!(misses([FLOOR[0], v(-9.0, -9.0, 5.0)]));
    assert!(!misses([FLOOR[0], v(9.0, 9.0, 3.0)]));
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// A point around the origin; a whole one half the time, so that things meet.
    fn point(&mut self, reach: f64) -> DVec3 {
        let is_whole = self.below(2) == 0;
        DVec3::from_array(std::array::from_fn(|_| {
            let x = self.real(-reach, reach);
            if is_whole { x.round() } else { x }
        }))
    }

    fn light(&mut self) -> LightShape {
        match self.below(3) {
            0 => LightShape::Direction(self.point(3.0) + v(0.01, 0.02, 0.03)),
            1 => LightShape::Point(self.point(3.0)),
            _ => LightShape::Point(self.point(12.0)),
        }
    }

    /// Triangles that share corners; some stand on others.
    fn scene(&mut self) -> Occluders {
        let count = 1 + self.below(6);
        let pool: Vec<DVec3> = (0..6).map(|_| self.point(3.0)).collect();
        let triangles: Vec<[DVec3; 3]> = (0..count)
            .map(|_| {
                std::array::from_fn(|_| match self.below(4) {
                    0 => self.point(3.0),
                    _ => pool[self.below(pool.len())],
                })
            })
            .collect();
        opaque(&triangles)
    }

    /// A box about a point of a triangle.
    fn bounds(&mut self, corners: [DVec3; 3]) -> Bounds {
        let center = self.inside(&corners);
        let half = [0.02, 0.2, 1.0, 8.0][self.below(4)];
        around(center, half)
    }

    /// A point between corners, or one of them, or on an edge.
    fn inside(&mut self, corners: &[DVec3]) -> DVec3 {
        let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
        let first = self.below(corners.len());
        let most = [1, 2, corners.len(), corners.len(), corners.len()][self.below(5)];
        for number in 0..most {
            let weight = self.real(0.0, 1.0);
            sum += weight * corners[(first + number) % corners.len()];
            weights += weight;
        }
        if most == 1 {
            corners[first]
        } else {
            sum / weights
        }
    }
}

/// What decides a patch: where nothing is in the way of changing, one start speaks for all.
#[test]
fn starts_of_a_clear_patch_have_one_answer() {
    let random = &mut Random(1);
    let (mut told, mut missed) = ([0; 2], 0);
    for round in 0..12_000 {
        let occluders = random.scene();
        let light = random.light();
        let mesh = Mesh::new(&occluders);
        let sides = occluders.light_sides(&light);
        let triangle = SurfaceId(0);
        let corners = occluders.triangle_positions(triangle).expect("a triangle");
        let bounds = random.bounds(corners);
        let Some(patch) = patch_of(&occluders, triangle, &bounds, &light) else {
            continue;
        };
        let places: Vec<DVec3> = patch.corners().collect();
        let starts: Vec<Segment> = (0..12)
            .map(|_| ReceiverPoint {
                point: random.inside(&places),
                surface: Some(triangle),
            })
            .map(|start| occluders.segment(&start, &light))
            .collect();
        for other in occluders.surfaces().skip(1) {
            if patch.misses_triangle(other) {
                missed += 1;
                for start in &starts {
                    let start_at = start.start();
                    assert!(
                        !occluders.blocks(other, start),
                        "{round}: {other:?} {start_at:?}"
                    );
                }
            }
        }
        let mut edges = mesh
            .edges()
            .iter()
            .filter(|edge| mesh.is_contour(edge, &sides));
        let is_clear = occluders.surfaces().all(|other| patch.is_clear_of(other))
            && edges.all(|edge| patch.misses_edge(edge));
        if !is_clear {
            continue;
        }
        let answers: Vec<bool> = starts
            .iter()
            .map(|start| {
                occluders
                    .surfaces()
                    .any(|other| occluders.blocks(other, start))
            })
            .collect();
        assert!(
            answers.iter().all(|&answer| answer == answers[0]),
            "{round}: {answers:?} {light:?} {bounds:?} {:?}",
            occluders
                .surfaces()
                .map(|surface| occluders.triangle_positions(surface))
                .collect::<Vec<_>>()
        );
        told[usize::from(answers[0])] += 1;
    }
    assert!(
        told[0] > 1_000 && told[1] > 300 && missed > 5_000,
        "{told:?} {missed}"
    );
}

#[test]
fn shafts_hold_the_segments_of_their_patches() {
    let random = &mut Random(2);
    let mut asked = 0;
    for _ in 0..6_000 {
        let occluders = opaque(&[[random.point(3.0), random.point(3.0), random.point(3.0)]]);
        let light = random.light();
        let corners = occluders
            .triangle_positions(SurfaceId(0))
            .expect("a triangle");
        let bounds = random.bounds(corners);
        let Some(patch) = patch_of(&occluders, SurfaceId(0), &bounds, &light) else {
            continue;
        };
        let shaft = patch.shaft();
        let places: Vec<DVec3> = patch.corners().collect();
        for _ in 0..10 {
            let start = random.inside(&places);
            let along = match light {
                LightShape::Point(light) => random.real(0.0, 1.0) * (light - start),
                LightShape::Direction(direction) => random.real(0.0, 20.0) * direction,
            };
            // What a patch's rounding may be off is for its asker to know (`SMALLEST_COVER`).
            let room = 1e-12 * v(1.0, 1.0, 1.0);
            let ends = [start + along - room, start + along + room];
            assert!(!shaft.misses_edge(&ends), "{corners:?} {light:?} {start}");
            asked += 1;
        }
        // But not everything: what is behind is outside.
        let behind = -patch.light.towards(patch.middle());
        let far = patch.middle() + behind;
        assert!(shaft.misses_edge(&[far, far]), "{corners:?} {light:?}");
    }
    assert!(asked > 10_000, "{asked}");
}

#[test]
fn there_is_no_patch_without_starts() {
    let light = LightShape::Point(v(0.0, 0.0, 9.0));
    let line = [v(0.0, 0.0, 0.0), v(1.0, 1.0, 1.0), v(2.0, 2.0, 2.0)];
    let occluders = opaque(&[FLOOR, line]);
    let patch = |surface, center: DVec3, light| {
        patch_of(&occluders, SurfaceId(surface), &around(center, 0.5), &light)
    };
    assert!(patch(0, DVec3::ZERO, light).is_some());
    // Over the floor, beside it; without area; seen edge on; not there.
    assert!(patch(0, v(0.0, 0.0, 1.0), light).is_none());
    assert!(patch(0, v(-8.0, 15.0, 0.0), light).is_none());
    assert!(patch(1, DVec3::ZERO, light).is_none());
    assert!(patch(0, DVec3::ZERO, LightShape::Point(v(3.0, 4.0, 0.0))).is_none());
    assert!(patch(0, DVec3::ZERO, LightShape::Direction(DVec3::X)).is_none());
    assert!(patch(2, DVec3::ZERO, light).is_none());
}
