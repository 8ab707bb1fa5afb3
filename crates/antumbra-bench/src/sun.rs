//! `antumbra-bench sun`: which sensors on a mesh which suns of a year reach, or which patches of a sky.
//!
//! Sensors lie on a grid on all faces that do not look down, and a share of them is asked: blocks of 64 neighbors, evenly
//! among all. A pair is a sensor and a direction in front of its face: all times are nanoseconds a pair. Ours is
//! [`ShadowIndex::visible_directions`] of an index that knows nothing. Embree gets the pairs alone, in two orders: those
//! of a sensor in a row, as neighboring directions of the sky follow each other, and those of a direction in a row, as neighboring sensors do. A
//! packet has 8 or 16 pairs in a row.

use std::path::Path;

use antumbra::{Batch, DirectionSet, IndexOptions, Method, ReceiverSide, ShadowIndex};
use antumbra_baselines::embree::{Embree, EmbreeWay, Geometry};
use antumbra_baselines::{LoadedBatch, TargetBatch};
use antumbra_geometry::{DVec3, LightShape, ReceiverPoint, SurfaceId};
use antumbra_render::prepare::Prepared;
use serde::Serialize;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::load;
use antumbra_cli::screen::Screen;

use super::head::Head;
use super::measure::{self, Measured, SLICE, Stopwatch, Way, geometric_mean};
use super::subject;
use super::typed::{Sky, SunStudy};

/// Sensors that are neighbors.
const BLOCK: usize = 64;

/// The reference answers so many pairs, evenly among all.
const CHECKED_PAIRS: usize = 4096;

/// Faces that look down more than this, as the sine of the angle, have no sensors.
const LEAST_UP: f64 = -0.5;

/// Result of one scene and one sky. Times are in nanoseconds per pair.
#[derive(Debug, Serialize)]
struct SceneReport {
    name: String,
    sky: &'static str,
    triangles: usize,
    sensors: usize,
    directions: usize,
    /// Pairs of a sensor and a direction in front of its face.
    pairs: usize,
    occluded_share: f64,
    ours_ns: f64,
    /// By a ray of ours a pair, in the order of the sky.
    rays_ns: Option<f64>,
    /// Single rays of Embree, in the better order.
    embree_ns: Option<f64>,
    embree_best_ns: Option<f64>,
    embree_best: Option<String>,
    /// Pairs answered for a group of sensors and directions at once.
    group_share: f64,
    /// Nodes and surfaces that were looked at for a pair.
    steps_per_pair: f64,
    tests_per_pair: f64,
    /// Bits of ours that are not those of single rays, or not the reference's where it was asked.
    mismatches: u64,
    /// Bits of Embree's fastest way that are others.
    embree_differences: u64,
}

/// Everything that was measured.
#[derive(Debug, Serialize)]
struct Report {
    head: Head,
    scenes: Vec<SceneReport>,
}

/// Measures all scenes, then reports.
pub(super) fn run(typed: &SunStudy, screen: &Screen) -> Result<Outcome, Failure> {
    typed.subjects.timed.run(|| work(typed, screen))?
}

fn work(typed: &SunStudy, screen: &Screen) -> Result<Outcome, Failure> {
    if typed.spacing.is_some_and(|spacing| spacing <= 0.0) {
        return Err(Failure::input(
            "sensors cannot lie 0 apart",
            "give --spacing a length",
        ));
    }
    let (stopwatch, embree, head) =
        subject::begin(&typed.subjects.timed, typed.rounds, [0, 0], screen);
    let mut report = Report {
        head,
        scenes: Vec::new(),
    };
    for path in &typed.subjects.scenes {
        scene(path, typed, embree.as_ref(), stopwatch, screen, &mut report)?;
    }
    let mean = |of: &dyn Fn(&SceneReport) -> Option<f64>| {
        let ratios = report.scenes.iter();
        geometric_mean(ratios.filter_map(|scene| Some(of(scene)? / scene.ours_ns)))
    };
    screen.result(format!(
        "geometric means over ours: single rays {:.2}, Embree 1 {:.2}, Embree's fastest {:.2}",
        mean(&|scene| scene.rays_ns),
        mean(&|scene| scene.embree_ns),
        mean(&|scene| scene.embree_best_ns),
    ));
    typed.subjects.figures.write(&report)?;
    let is_clean = report.scenes.iter().all(|scene| scene.mismatches == 0);
    Ok(if is_clean {
        Outcome::Done
    } else {
        Outcome::Differences
    })
}

fn scene(
    path: &Path,
    typed: &SunStudy,
    embree: Option<&Embree>,
    stopwatch: Stopwatch,
    screen: &Screen,
    report: &mut Report,
) -> Result<(), Failure> {
    let file = typed.subjects.light.file(path);
    let mut lit = load::lit_scene(
        &file,
        &typed.subjects.cost,
        &typed.subjects.outputs()?,
        screen,
    )?;
    subject::fill_holes(&mut lit.scene, screen);
    let up = lit.up.direction;
    let options = IndexOptions {
        method: Method::Bvh,
        ..IndexOptions::default()
    };
    let prepared = Prepared::new(lit.scene, &options)?;
    let sensors = Sensors::on(prepared.index(), up, typed.spacing, typed.sensors);
    if sensors.starts.is_empty() {
        return Err(Failure::input(
            format!("no face of {} looks up or aside", path.display()),
            "give a mesh",
        ));
    }
    let geometry = Geometry::of(prepared.scene(), prepared.gathered().occluders());
    let rival = embree
        .map(|embree| subject::rival(embree, &geometry, stopwatch))
        .transpose()?;
    for &sky in &typed.skies {
        let directions = directions(sky, up);
        let found = measured(
            prepared.index(),
            &sensors,
            &directions,
            rival.as_ref().map(|(scene, _)| scene),
            (&typed.ways, typed.rounds),
            stopwatch,
        );
        let name = path.file_stem().unwrap_or_default();
        let found = SceneReport {
            name: name.to_string_lossy().into_owned(),
            sky: sky.name(),
            ..found
        };
        screen.result(found.row());
        report.scenes.push(found);
    }
    Ok(())
}

/// Points on faces.
#[derive(Debug, Default)]
struct Sensors {
    starts: Vec<ReceiverPoint>,
    normals: Vec<DVec3>,
}

impl Sensors {
    /// Lays a grid on all faces and takes blocks of neighbors until there are so many. Without a spacing it is a thousandth
    /// of the scene's larger horizontal extent.
    fn on(index: &ShadowIndex, up: DVec3, spacing: Option<f64>, count: usize) -> Self {
        let occluders = index.occluders();
        let size = occluders.bounds().size();
        let spacing = spacing.unwrap_or((size - size * up).max_element() / 1000.0);
        let mut all = Self::default();
        for surface in 0..occluders.triangle_count() as u32 {
            let surface = SurfaceId(surface);
            let Some(corners) = occluders.triangle_positions(surface) else {
                continue;
            };
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let normal = normal.normalize_or_zero();
            if normal == DVec3::ZERO || normal.dot(up) < LEAST_UP {
                continue;
            }
            for point in grid(corners, normal, spacing) {
                all.starts.push(ReceiverPoint {
                    point,
                    surface: Some(surface),
                });
                all.normals.push(normal);
            }
        }
        let blocks = all.starts.len().div_ceil(BLOCK);
        let step = (blocks * BLOCK / count.max(1)).max(1);
        let mut taken = Self::default();
        for first in (0..blocks).step_by(step).map(|block| block * BLOCK) {
            let end = (first + BLOCK).min(all.starts.len());
            taken.starts.extend_from_slice(&all.starts[first..end]);
            taken.normals.extend_from_slice(&all.normals[first..end]);
        }
        taken
    }
}

/// Returns the points of a grid in a triangle's plane that lie in the triangle, in the order of a curve that keeps
/// neighbors together.
fn grid(corners: [DVec3; 3], normal: DVec3, spacing: f64) -> Vec<DVec3> {
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let flat = corners.map(|corner| [(corner - corners[0]).dot(u), (corner - corners[0]).dot(v)]);
    let least = |axis: usize| flat.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
    let most = |axis: usize| {
        flat.iter()
            .map(|c| c[axis])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let cells =
        |axis: usize| (((most(axis) - least(axis)) / spacing).ceil() as u32).clamp(1, 1 << 12);
    let mut points = Vec::new();
    let side = cells(0).max(cells(1)).next_power_of_two();
    for code in 0..u64::from(side) * u64::from(side) {
        let of = |first: u32| (0..16).fold(0, |x, bit| x | (code >> (2 * bit + first) & 1) << bit);
        let place = [of(0), of(1)];
        if place[0] >= u64::from(cells(0)) || place[1] >= u64::from(cells(1)) {
            continue;
        }
        let at = [0, 1].map(|axis| least(axis) + spacing * (place[axis] as f64 + 0.37));
        let is_inside = (0..3).all(|i| {
            let (a, b) = (flat[i], flat[(i + 1) % 3]);
            (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]) >= 0.0
        });
        if is_inside {
            points.push(corners[0] + u * at[0] + v * at[1]);
        }
    }
    points
}

/// Returns the directions of a sky, in its own order.
fn directions(sky: Sky, up: DVec3) -> Vec<DVec3> {
    let local = match sky {
        Sky::Hours => suns(1),
        Sky::Tenths => suns(6),
        Sky::Tregenza => patches(1),
        Sky::Reinhart => patches(4),
    };
    // Given with z up.
    let turned = |d: DVec3| {
        if up == DVec3::Y {
            DVec3::new(d.x, d.z, -d.y)
        } else {
            d
        }
    };
    local.into_iter().map(turned).collect()
}

/// Returns the suns of a year at 48 degrees north, in the middle of so many steps an hour, by the declination's simplest
/// formula: what is measured does not depend on fractions of degrees.
fn suns(steps: u32) -> Vec<DVec3> {
    let (sin_latitude, cos_latitude) = libm::sincos(48_f64.to_radians());
    let mut suns = Vec::new();
    for day in 1..=365 {
        let turn = std::f64::consts::TAU * f64::from(284 + day) / 365.0;
        let declination = 23.45_f64.to_radians() * libm::sin(turn);
        let (sin, cos) = libm::sincos(declination);
        for step in 0..24 * steps {
            let hour = (f64::from(step) + 0.5) / f64::from(steps);
            let (sin_hour, cos_hour) = libm::sincos((hour - 12.0) * 15_f64.to_radians());
            let height = sin_latitude * sin + cos_latitude * cos * cos_hour;
            if height > 0.001 {
                let north = cos_latitude * sin - sin_latitude * cos * cos_hour;
                suns.push(DVec3::new(-cos * sin_hour, north, height).normalize());
            }
        }
    }
    suns
}

/// Returns the middles of the sky's 145 patches by Tregenza, each parted in so many by so many as by Reinhart.
fn patches(parts: u32) -> Vec<DVec3> {
    let mut patches = Vec::new();
    for (row, count) in [30, 30, 24, 24, 18, 12, 6].into_iter().enumerate() {
        for part in 0..parts {
            let row = f64::from(row as u32 * parts + part) + 0.5;
            let (up, along) = libm::sincos((row * 12.0 / f64::from(parts)).to_radians());
            for number in 0..count * parts {
                let turn = (f64::from(number) + 0.5) / f64::from(count * parts);
                let (east, north) = libm::sincos(std::f64::consts::TAU * turn);
                patches.push(DVec3::new(along * east, along * north, up));
            }
        }
    }
    patches.push(DVec3::Z);
    patches
}

/// Pairs of a sensor and a direction in front of it, in some order, with what is expected of each.
struct Pairs {
    batch: TargetBatch,
    is_occluded: Vec<bool>,
}

impl Pairs {
    fn new(
        sensors: &Sensors,
        directions: &[DVec3],
        order: impl Iterator<Item = (usize, usize)>,
        is_visible: impl Fn(usize, usize) -> Option<bool>,
    ) -> Self {
        let mut batch = TargetBatch {
            per_start: 1,
            ..TargetBatch::default()
        };
        let mut is_occluded = Vec::new();
        for (sensor, direction) in order {
            if let Some(is_visible) = is_visible(sensor, direction) {
                batch.starts.push(sensors.starts[sensor]);
                batch.normals.push(sensors.normals[sensor]);
                batch
                    .targets
                    .push(LightShape::Direction(directions[direction]));
                is_occluded.push(!is_visible);
            }
        }
        Self { batch, is_occluded }
    }
}

fn measured(
    index: &ShadowIndex,
    sensors: &Sensors,
    directions: &[DVec3],
    rival: Option<&antumbra_baselines::embree::EmbreeScene>,
    (chosen, rounds): (&[String], u32),
    stopwatch: Stopwatch,
) -> SceneReport {
    let occluders = index.occluders();
    let count = sensors.starts.len();
    let points: Vec<[f64; 3]> = sensors.starts.iter().map(|s| s.point.to_array()).collect();
    let surfaces: Vec<SurfaceId> = sensors.starts.iter().filter_map(|s| s.surface).collect();
    let batch = Batch::on_surfaces(&points, &surfaces);
    let set = DirectionSet::new(directions).expect("directions are finite");
    let stride = set.word_count();
    let mut expected = vec![0; stride * count];
    let mut words = vec![0; stride * count];
    let ask = |words: &mut [u64]| {
        index
            .visible_directions(&batch, &set, ReceiverSide::Front, words)
            .expect("sensors lie on their faces")
            .counters
    };
    let counters = ask(&mut words);
    let shadow = counters.shadow;
    // Single rays tell what is right.
    let mut is_asked = vec![0; stride * count];
    let targets: Vec<LightShape> = directions
        .iter()
        .map(|&d| LightShape::Direction(d))
        .collect();
    for (number, start) in sensors.starts.iter().enumerate() {
        let words = number * stride..(number + 1) * stride;
        for (place, target) in targets.iter().enumerate() {
            let is_front = occluders.light_side(start, target) > 0;
            is_asked[number * stride + place / 64] |= u64::from(is_front) << (place % 64);
        }
        let expected = &mut expected[words.clone()];
        index
            .occluded_targets_by_rays(start, &targets, expected, &mut Default::default())
            .expect("sensors lie on their faces");
        for (word, asked) in expected.iter_mut().zip(&is_asked[words]) {
            *word = asked & !*word;
        }
    }
    let differences = |words: &[u64]| {
        let words = words.iter().zip(&expected);
        words
            .map(|(word, expected)| u64::from((word ^ expected).count_ones()))
            .sum::<u64>()
    };
    let first = differences(&words);
    let bit = |words: &[u64], sensor: usize, direction: usize| {
        words[sensor * stride + direction / 64] >> (direction % 64) & 1 != 0
    };
    let answer = |sensor: usize, direction: usize| {
        bit(&is_asked, sensor, direction).then(|| bit(&expected, sensor, direction))
    };
    // As neighbors in the sky follow each other.
    let by_sky: Vec<usize> = set.order().map(|number| number as usize).collect();
    let by_sensor = Pairs::new(
        sensors,
        directions,
        (0..count).flat_map(|sensor| by_sky.iter().map(move |&direction| (sensor, direction))),
        answer,
    );
    let by_direction = Pairs::new(
        sensors,
        directions,
        by_sky
            .iter()
            .flat_map(|&direction| (0..count).map(move |sensor| (sensor, direction))),
        answer,
    );
    let wrong = wrong_by_reference(index, &by_sensor);
    let mut ways: Vec<Way<'_>> = vec![(
        "ours",
        Box::new(|| {
            ask(&mut words);
            differences(&words)
        }),
    )];
    let single = antumbra_baselines::LoadedTargets::new(
        index,
        &by_sensor.batch,
        antumbra_baselines::TargetWay::Rays,
    );
    ways.push((
        "rays",
        counted(Box::new(single), &by_sensor.is_occluded, stopwatch),
    ));
    if let Some(scene) = rival {
        for (names, pairs) in [
            (
                [
                    "embree by sensor",
                    "embree8 by sensor",
                    "embree16 by sensor",
                ],
                &by_sensor,
            ),
            (
                ["embree by sun", "embree8 by sun", "embree16 by sun"],
                &by_direction,
            ),
        ] {
            for (name, way) in names.into_iter().zip([
                EmbreeWay::Single,
                EmbreeWay::Packets8,
                EmbreeWay::Packets16,
            ]) {
                let loaded = scene.load_targets(&pairs.batch, way);
                ways.push((name, counted(loaded, &pairs.is_occluded, stopwatch)));
            }
        }
    }
    ways.retain(|(name, _)| chosen.is_empty() || chosen.iter().any(|one| one == name));
    let names: Vec<_> = ways.iter().map(|(name, _)| *name).collect();
    let all = measure::interleave_ways(&mut ways, by_sensor.is_occluded.len(), rounds, stopwatch);
    drop(ways);
    let fastest = |is_one: &dyn Fn(&str) -> bool| {
        let named = names.iter().zip(&all).filter(|(name, _)| is_one(name));
        named.min_by(|a, b| a.1.median_ns().total_cmp(&b.1.median_ns()))
    };
    let of = |name: &str| fastest(&|other| other == name).map(|(_, measured)| measured);
    let best = fastest(&|name| name.starts_with("embree"));
    let pairs = by_sensor.is_occluded.len();
    let occluded = by_sensor.is_occluded.iter().filter(|&&bit| bit).count();
    let share = |part: f64, of: f64| part / of.max(1.0);
    SceneReport {
        name: String::new(),
        sky: "",
        triangles: occluders.triangle_count(),
        sensors: count,
        directions: directions.len(),
        pairs,
        occluded_share: share(occluded as f64, pairs as f64),
        ours_ns: of("ours").map_or(f64::NAN, Measured::median_ns),
        rays_ns: of("rays").map(Measured::median_ns),
        embree_ns: fastest(&|name| name.starts_with("embree ")).map(|(_, m)| m.median_ns()),
        embree_best_ns: best.map(|(_, measured)| measured.median_ns()),
        embree_best: best.map(|(name, _)| (*name).to_owned()),
        group_share: share(
            shadow.first_pass as f64,
            (shadow.first_pass + shadow.rays) as f64,
        ),
        steps_per_pair: share(counters.steps as f64, pairs as f64),
        tests_per_pair: share(counters.intersections as f64, pairs as f64),
        mismatches: first.max(of("ours").map_or(0, |ours| ours.differences)) + wrong,
        embree_differences: best.map_or(0, |(_, measured)| measured.differences),
    }
}

/// Wraps a loaded batch.
fn counted<'a>(
    loaded: Box<dyn LoadedBatch + 'a>,
    expected: &'a [bool],
    stopwatch: Stopwatch,
) -> Box<dyn FnMut() -> u64 + 'a> {
    let mut found = vec![false; expected.len()];
    Box::new(move || {
        measure::count_differences(&*loaded, 0, expected, &mut found, SLICE, stopwatch)
    })
}

/// Returns how many of some pairs the reference answers otherwise.
fn wrong_by_reference(index: &ShadowIndex, pairs: &Pairs) -> u64 {
    let occluders = index.occluders();
    let step = pairs.is_occluded.len().div_ceil(CHECKED_PAIRS).max(1);
    let is_wrong = |&pair: &usize| {
        let segment = occluders.segment(&pairs.batch.starts[pair], &pairs.batch.targets[pair]);
        let is_blocked = occluders
            .surfaces()
            .any(|surface| occluders.blocks(surface, &segment));
        is_blocked != pairs.is_occluded[pair]
    };
    (0..pairs.is_occluded.len())
        .step_by(step)
        .filter(is_wrong)
        .count() as u64
}

impl SceneReport {
    /// Returns it for people.
    fn row(&self) -> String {
        let by = |ns: Option<f64>| match ns {
            Some(ns) => format!("{ns:6.2} ns ({:5.2}x)", ns / self.ours_ns),
            None => "  none".to_owned(),
        };
        format!(
            "{:<16} {:>9}, {} sensors x {} directions, {:.2} million pairs, {:2.0} % occluded, {:2.0} % by groups, {:.2} nodes and {:.2} \
             surfaces a pair: ours \
             {:6.2} ns a pair, single rays {}, Embree 1 {}, {} {}, mismatches {}, Embree's {}",
            self.name,
            self.sky,
            self.sensors,
            self.directions,
            self.pairs as f64 / 1e6,
            100.0 * self.occluded_share,
            100.0 * self.group_share,
            self.steps_per_pair,
            self.tests_per_pair,
            self.ours_ns,
            by(self.rays_ns),
            by(self.embree_ns),
            self.embree_best.as_deref().unwrap_or("Embree's best"),
            by(self.embree_best_ns),
            self.mismatches,
            self.embree_differences,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skies_have_their_numbers_of_directions_above_the_horizon() {
        for (sky, count) in [
            (Sky::Hours, 4376),
            (Sky::Tregenza, 145),
            (Sky::Reinhart, 2305),
        ] {
            let z = directions(sky, DVec3::Z);
            let y = directions(sky, DVec3::Y);
            assert_eq!(z.len(), count, "{sky:?}");
            for (z, y) in z.into_iter().zip(y) {
                assert!(z.z > 0.0 && (z.length() - 1.0).abs() < 1e-12);
                assert_eq!([y.y, y.x, y.z], [z.z, z.x, -z.y]);
            }
        }
    }

    #[test]
    fn grids_lie_in_their_triangle() {
        let corners = [
            DVec3::ZERO,
            DVec3::new(4.0, 0.0, 3.0),
            DVec3::new(0.0, 5.0, 0.0),
        ];
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize();
        let points = grid(corners, normal, 0.5);
        // An area of 12.5 in cells of 0.25.
        assert!((45..=55).contains(&points.len()), "{}", points.len());
        assert!(
            points
                .iter()
                .all(|p| p.dot(normal).abs() < 1e-12 && p.y >= 0.0 && p.x >= 0.0)
        );
    }
}
