//! `antumbra verify`: every exact method against the reference.
//!
//! In: a scene and a number of queries. Out: each difference, and their number; of another method that is not
//! exact the share of its wrong answers, which are no differences. Every query is asked alone, and of our
//! methods once more with others of its light. The queries are a pure function of scene and seed: points
//! as random views see them, points spread over all surfaces, points on edges, vertices, and free points;
//! or, with `--attack`, points at delicate places. They are made, asked and forgotten some thousands at a
//! time, so there may be very many.

mod area;
mod attack;
mod bumps;
mod candidate;
mod lights;
mod random;
mod starts;
mod surfaces;
mod tally;

use std::ops::Range;

use antumbra::{Counters, IndexOptions, LightId, Method, Refine, Shadow, ShadowIndex};
use antumbra_geometry::ReceiverPoint;
use antumbra_scene::gather::{Gathered, light_shapes};
use antumbra_scene::model::Scene;
use rayon::prelude::*;

use crate::failure::{Failure, Outcome};
use crate::outputs::Outputs;
use crate::screen::Screen;
use crate::typed::{Against, Shadows, Verify};
use crate::{load, memory};
use attack::{Attack, Kind};
pub use candidate::{BuildStandIn, Other};
use candidate::{Candidate, VALID};
use random::Random;
use surfaces::Surfaces;
use tally::{Difference, Tally};

/// Queries that a thread asks at a time: one by one, then those of each light together. So many that those that
/// are together lie close together.
const RUN_QUERIES: u64 = 1 << 14;

/// One query in so many is asked again as if its surface had bumps.
const ON_BUMPS: u64 = 4;

/// Tells random numbers for bumps from others.
const BUMPS: u64 = 0xb0;

/// Builds one index a method, asks, compares; with `others` beside the methods that were typed.
pub fn run(typed: &Verify, others: Vec<Other>, screen: &Screen) -> Result<Outcome, Failure> {
    let none = Outputs::none();
    let scene = load::any_lit_scene(
        &typed.file,
        None,
        load::Lighting::Needed,
        &typed.cost,
        &none,
        screen,
    )?
    .scene;
    super::on_threads(&typed.threads, || work(typed, others, scene, screen))?
}

/// Returns the methods to compare: those typed, or all that the judge leaves.
fn methods(typed: &Verify) -> Vec<Shadows> {
    let mut methods = typed.shadows.clone();
    if methods.is_empty() {
        let is_wanted = |method: &Shadows| match typed.against {
            Against::Reference => true,
            Against::Bvh => !matches!(method, Shadows::Naive | Shadows::Bvh),
        };
        methods = Shadows::ALL.into_iter().filter(is_wanted).collect();
    }
    methods
}

fn work(
    typed: &Verify,
    others: Vec<Other>,
    mut scene: Scene,
    screen: &Screen,
) -> Result<Outcome, Failure> {
    let gathered = Gathered::of(&scene)?;
    if typed.more_lights > 0 {
        let options = options(typed, Method::Bvh, memory::limit(typed.cost.memory_limit));
        let index = options.build(gathered.occluders(), light_shapes(&scene.lights))?;
        let surfaces = Surfaces::new(&scene, &gathered, &index);
        let more = lights::more(typed.more_lights, typed.seed, &surfaces);
        scene.lights.extend(more);
    }
    let mut built = Built {
        typed,
        scene: &scene,
        gathered: &gathered,
        memory_left: memory::limit(typed.cost.memory_limit),
    };
    // What answers are compared with; it also finds hits. The reference needs no values.
    let judge = built.index(Method::Bvh)?;
    let mut candidates = Vec::new();
    for shadows in methods(typed) {
        candidates.push(Candidate {
            name: shadows.name(),
            is_exact: true,
            index: built.index(shadows.method())?,
            stand_in: None,
        });
        screen.detail(format!("{} is built", shadows.name()));
    }
    for other in others {
        candidates.push(built.other(&other)?);
        screen.detail(format!("{} is built", other.name));
    }

    let surfaces = Surfaces::new(&scene, &gathered, &judge);
    let voxels = candidates
        .iter()
        .find_map(|candidate| candidate.index.voxel_planes());
    let comparison = Comparison {
        typed,
        attack: (typed.attack && !scene.lights.is_empty())
            .then(|| Attack::new(&surfaces, typed.seed, voxels)),
        surfaces: &surfaces,
        candidates: &candidates,
    };
    let found = if scene.area_lights.is_empty() {
        area::Found::default()
    } else {
        let judge = built.index(area::judge_method(typed.against))?;
        let comparison = area::Comparison {
            against: typed.against,
            seed: typed.seed,
            lights: &scene.area_lights,
            surfaces: &surfaces,
            judge: &judge,
            candidates: &candidates,
        };
        let found = comparison.run(typed.queries, screen);
        screen.result(format!(
            "{} samples and {} exact fractions of lights with size, {} differences",
            found.samples, found.fractions, found.differences
        ));
        found
    };
    let area_differences = found.differences;
    if scene.lights.is_empty() {
        return Ok(outcome(area_differences));
    }
    let mut tally = comparison.run(screen);
    let judge_name = match typed.against {
        Against::Reference => "reference",
        Against::Bvh => "bvh",
    };
    tally.report_differences(judge_name, &judge, &candidates, screen);
    if typed.attack {
        tally.report_counts(&candidates, screen);
    }
    tally.report_inexact(&candidates, typed.queries, screen);
    tally.report_glass(screen);
    tally.report_bumps(screen);
    let difference_count = tally.difference_count();
    screen.result(format!(
        "{} queries, {difference_count} differences",
        typed.queries
    ));
    Ok(outcome(difference_count + area_differences))
}

/// Returns what so many differences mean.
fn outcome(difference_count: u64) -> Outcome {
    match difference_count {
        0 => Outcome::Done,
        _ => Outcome::Differences,
    }
}

fn options(typed: &Verify, method: Method, memory_limit: u64) -> IndexOptions {
    IndexOptions {
        method,
        grid: typed.cost.grid.unwrap_or_default(),
        refinement: typed.cost.refinement(Refine::Eager),
        memory_limit,
        ..IndexOptions::default()
    }
}

/// Indices side by side in what memory there is.
struct Built<'a> {
    typed: &'a Verify,
    scene: &'a Scene,
    gathered: &'a Gathered,
    memory_left: u64,
}

impl Built<'_> {
    fn index(&mut self, method: Method) -> Result<ShadowIndex, Failure> {
        let options = options(self.typed, method, self.memory_left);
        let lights = &self.scene.lights;
        let predicted = options.predict(self.gathered.occluders(), lights.len(), None)?;
        let taken = predicted.total().min(self.memory_left);
        let index = options.build(self.gathered.occluders(), light_shapes(lights))?;
        self.memory_left = self.memory_left.saturating_sub(taken);
        Ok(index)
    }

    fn other(&mut self, other: &Other) -> Result<Candidate, Failure> {
        let index = self.index(other.method)?;
        let stand_in = (other.build)(&index, self.memory_left)?;
        if let Some(stand_in) = &stand_in {
            let lights = 0..index.lights().len();
            let taken: u64 = lights.map(|light| stand_in.bytes(light)).sum();
            self.memory_left = self.memory_left.saturating_sub(taken);
        }
        Ok(Candidate {
            name: other.name,
            is_exact: other.is_exact,
            index,
            stand_in,
        })
    }
}

/// All queries, and who is asked.
struct Comparison<'a> {
    typed: &'a Verify,
    attack: Option<Attack<'a>>,
    surfaces: &'a Surfaces<'a>,
    candidates: &'a [Candidate],
}

impl Comparison<'_> {
    fn run(&self, screen: &Screen) -> Tally {
        let query_count = self.typed.queries;
        let bar = screen.progress(query_count, "comparing");
        let new = || Tally::new(self.candidates.len());
        let task = antumbra_task::current();
        let tally = (0..query_count.div_ceil(RUN_QUERIES))
            .into_par_iter()
            .fold(new, |mut tally, run| {
                let first = run * RUN_QUERIES;
                let end = query_count.min(first + RUN_QUERIES);
                task.enter(|| {
                    antumbra_task::check();
                    self.ask_run(first..end, &mut tally);
                });
                bar.inc(end - first);
                tally
            })
            .reduce(new, Tally::with);
        bar.finish_and_clear();
        tally
    }

    /// Returns where query number `query` starts. All lights take turns at each start, or, at delicate
    /// places, which often are meant for one light, at each query.
    fn start(&self, query: u64, light: usize) -> (Option<Kind>, ReceiverPoint) {
        match &self.attack {
            Some(attack) => {
                let (kind, start) = attack.start(query, light);
                (Some(kind), start)
            }
            None => {
                let number = query / self.surfaces.scene.lights.len() as u64;
                let start = starts::start(number, self.typed.seed, self.surfaces);
                (None, start)
            }
        }
    }

    /// Asks some queries of the judge, and of every method one by one and together.
    fn ask_run(&self, queries: Range<u64>, tally: &mut Tally) {
        let light_count = self.surfaces.scene.lights.len();
        let mut asked = vec![Asked::default(); light_count];
        for query in queries {
            let light = (query % light_count as u64) as usize;
            let (kind, start) = self.start(query, light);
            if let Some(kind) = kind {
                tally.count_kind(kind);
            }
            let difference = |number, found, expected| Difference {
                query,
                kind,
                start,
                light,
                candidate: number,
                found,
                expected,
            };
            let expected = self.expected(&start, light);
            for (number, candidate) in self.candidates.iter().enumerate() {
                let answer = candidate.shadow(&start, light, tally.counters(number));
                let found = answer.expect(VALID).shadow;
                if found != expected && !candidate.is_exact {
                    tally.count_wrong(number);
                } else if found != expected {
                    tally.add_difference(difference(number, found, expected));
                }
            }
            if expected == Shadow::Lit && self.surfaces.index.has_glass() {
                self.ask_glass(&start, LightId::from_index(light), tally);
            }
            if query % ON_BUMPS == 0 {
                let mut random = Random::new(self.typed.seed ^ BUMPS, query);
                let judge = |start: &ReceiverPoint| self.expected(start, light);
                let id = LightId::from_index(light);
                let (surfaces, all) = (self.surfaces, self.candidates);
                tally.count_bumps(bumps::ask(&start, id, surfaces, all, &mut random, judge));
            }
            asked[light].queries.push((query, kind));
            asked[light].starts.push(start);
            asked[light].expected.push(expected);
        }
        for (light, asked) in asked.iter().enumerate() {
            self.ask_together(light, asked, tally);
        }
    }

    /// Asks our own methods what glass leaves of a light that nothing opaque is before.
    fn ask_glass(&self, start: &ReceiverPoint, light: LightId, tally: &mut Tally) {
        let judge = self.surfaces.index;
        let counters = &mut Counters::default();
        let expected = match self.typed.against {
            Against::Reference => judge.transmittance_by_reference(start, light),
            Against::Bvh => judge.filtered_from(start, light, counters),
        };
        let expected = expected.expect(VALID);
        let own = self
            .candidates
            .iter()
            .filter(|candidate| candidate.stand_in.is_none());
        let differs = |candidate: &&Candidate| {
            let found = candidate
                .index
                .filtered_from(start, light, &mut Counters::default());
            found.expect(VALID) != expected
        };
        tally.count_glass(expected != [1.0; 3], own.filter(differs).count() as u64);
    }

    /// Asks our own methods the queries of one light again, all at once.
    fn ask_together(&self, light: usize, asked: &Asked, tally: &mut Tally) {
        let mut is_shadowed = vec![false; asked.starts.len()];
        for (number, candidate) in self.candidates.iter().enumerate() {
            if candidate.stand_in.is_some() {
                continue;
            }
            let index = &candidate.index;
            index
                .shadows(
                    &asked.starts,
                    LightId::from_index(light),
                    &mut is_shadowed,
                    &mut Counters::default(),
                )
                .expect(VALID);
            for (place, &is_shadowed) in is_shadowed.iter().enumerate() {
                let found = if is_shadowed {
                    Shadow::Shadowed
                } else {
                    Shadow::Lit
                };
                let (start, expected) = (asked.starts[place], asked.expected[place]);
                if found == expected {
                    continue;
                }
                let alone =
                    index.shadow(&start, LightId::from_index(light), &mut Counters::default());
                // Else it was reported already.
                if alone.expect(VALID).shadow == expected {
                    let (query, kind) = asked.queries[place];
                    let difference = Difference {
                        query,
                        kind,
                        start,
                        light,
                        candidate: number,
                        found,
                        expected,
                    };
                    tally.add_difference(difference);
                }
            }
        }
    }

    /// Returns what the judge says.
    fn expected(&self, start: &ReceiverPoint, light: usize) -> Shadow {
        let (judge, light) = (self.surfaces.index, LightId::from_index(light));
        let expected = match self.typed.against {
            Against::Reference => judge.shadow_by_reference(start, light),
            Against::Bvh => judge
                .shadow(start, light, &mut Counters::default())
                .map(|answer| answer.shadow),
        };
        expected.expect(VALID)
    }
}

/// Queries of one light.
#[derive(Clone, Debug, Default)]
struct Asked {
    queries: Vec<(u64, Option<Kind>)>,
    starts: Vec<ReceiverPoint>,
    expected: Vec<Shadow>,
}
