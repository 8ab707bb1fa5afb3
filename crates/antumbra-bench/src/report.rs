//! The figures of `antumbra-bench shadows`, as JSON and as a table.

use std::collections::BTreeMap;
use std::time::Duration;

use antumbra_baselines::rival::formulas::PaperMemory;
use serde::Serialize;

use super::cold::BreakEven;
use super::head::Head;
use super::judge::Verdicts;
use super::measure::geometric_mean;

/// All figures of a run.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    pub(super) head: Head,
    pub(super) scenes: Vec<SceneReport>,
    /// Set, then method: geometric mean over the scenes of Embree's time by ours.
    pub(super) geometric_means: BTreeMap<String, BTreeMap<String, f64>>,
}

/// One scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneReport {
    pub(super) name: String,
    pub(super) light: String,
    pub(super) surfaces: usize,
    pub(super) triangles: usize,
    /// Answers of our methods that are not all the same, all sets together; must be 0.
    pub(super) mismatches: u64,
    /// Where Embree differs and was found right; must be 0.
    pub(super) ours_wrong: usize,
    /// What Embree is given otherwise than we are.
    pub(super) notes: Vec<String>,
    pub(super) preparation: BTreeMap<String, Preparation>,
    pub(super) coherent: SetReport,
    pub(super) shuffled: SetReport,
    pub(super) free: SetReport,
    /// From how many queries on cold `voxel` has taken less time than `bvh`.
    pub(super) break_even: Option<BreakEven>,
    /// Values alone, by voxels along the longest axis.
    pub(super) oracle: Option<BTreeMap<u32, Capped>>,
}

/// What values know, refined no further than some resolution.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Capped {
    /// Share of the coherent queries that values of uniform voxels could know at best, where it was
    /// sampled.
    pub(super) ceiling: Option<f64>,
    /// Share that the first pass knows.
    pub(super) first_pass: f64,
    /// Bytes of the values and their index.
    pub(super) value_bytes: u64,
    /// The same as a share of two bits for every voxel of a cube of that resolution.
    pub(super) dense_share: f64,
}

/// What comes before the first query.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Preparation {
    /// Bytes of blocker lists, planes and tables.
    pub(super) table_bytes: Option<u64>,
    pub(super) seconds: f64,
    /// Of occlusion values.
    pub(super) value_bytes: Option<u64>,
    /// Of all that is kept for shadow queries beside surfaces, grid and tree, mean over the lights.
    pub(super) bytes_per_light: Option<f64>,
    /// What the paper's formula gives for that.
    pub(super) paper: Option<PaperMemory>,
    /// Of everything, at the height of building; predicted.
    pub(super) predicted_bytes: Option<u64>,
}

impl Preparation {
    /// Returns that of a rival, whose bytes nobody knows.
    pub(super) fn of_rival(time: Duration) -> Self {
        Self {
            table_bytes: None,
            seconds: time.as_secs_f64(),
            value_bytes: None,
            bytes_per_light: None,
            paper: None,
            predicted_bytes: None,
        }
    }

    /// Returns that of a method for people.
    pub(super) fn row((name, preparation): (&String, &Self)) -> String {
        let values = preparation.bytes_per_light.map_or(String::new(), |bytes| {
            format!(", {bytes:.0} bytes for the light")
        });
        let paper = preparation.paper.map_or(String::new(), |paper| {
            format!("; the paper's {} is {:.0}", paper.formula, paper.bytes)
        });
        format!(
            "  {name:<12} prepared in {:.3} s{values}{paper}",
            preparation.seconds
        )
    }
}

/// One set of queries.
#[derive(Debug, Default, Serialize)]
pub(super) struct SetReport {
    pub(super) queries: usize,
    pub(super) shadowed_share: f64,
    /// `<method>_ns`: median over the rounds; `null` where there is no such method.
    #[serde(flatten)]
    pub(super) times_ns: BTreeMap<String, Option<f64>>,
    /// Median over the rounds of the time of Embree, one ray a call, by each method's.
    pub(super) embree_by: BTreeMap<String, f64>,
    /// Median over the rounds of the time of Embree's faster way, one ray a call or eight, by each method's.
    pub(super) embree_best_by: BTreeMap<String, f64>,
    /// Width of the middle half of the rounds over the median.
    pub(super) spread: BTreeMap<String, f64>,
    /// What rivals, and methods of ours, did for a query.
    pub(super) work: BTreeMap<String, WorkOfQuery>,
    /// How queries were decided.
    pub(super) shares: BTreeMap<String, Shares>,
    /// Of occlusion values, again, beside the times.
    pub(super) bytes: BTreeMap<String, u64>,
    pub(super) mismatches: u64,
    /// Judged differences of Embree, single rays and packets, and of a rival that is not exact.
    pub(super) differences: BTreeMap<String, Verdicts>,
}

/// Counts a query, means.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct WorkOfQuery {
    /// Voxels, nodes and cells.
    pub(super) steps: f64,
    /// Surfaces, shadow polygons and shadow volumes tested.
    pub(super) intersections: f64,
    /// What rivals found listed.
    pub(super) candidates: f64,
}

impl WorkOfQuery {
    pub(super) fn of(work: &antumbra_baselines::Work, query_count: usize) -> Self {
        let mean = |count: u64| count as f64 / query_count as f64;
        Self {
            steps: mean(work.counters.steps),
            intersections: mean(work.counters.intersections),
            candidates: mean(work.candidates),
        }
    }
}

/// Shares of the queries, 0..1.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Shares {
    pub(super) first_pass: f64,
    pub(super) intermediate: f64,
    pub(super) blocker_list: f64,
    pub(super) ray: f64,
}

impl Shares {
    pub(super) fn of(counters: &antumbra::ShadowCounters) -> Self {
        let antumbra::ShadowCounters {
            first_pass,
            intermediate,
            blocker_list,
            rays,
            ..
        } = *counters;
        let all = (first_pass + intermediate + blocker_list + rays).max(1) as f64;
        Self {
            first_pass: first_pass as f64 / all,
            intermediate: intermediate as f64 / all,
            blocker_list: blocker_list as f64 / all,
            ray: rays as f64 / all,
        }
    }

    pub(super) fn text(&self) -> String {
        format!(
            "first pass {:.1} %, intermediate {:.1} %, list {:.1} %, ray {:.1} %",
            100.0 * self.first_pass,
            100.0 * self.intermediate,
            100.0 * self.blocker_list,
            100.0 * self.ray
        )
    }
}

impl SceneReport {
    pub(super) fn sets(&self) -> [(&'static str, &SetReport); 3] {
        [
            ("coherent", &self.coherent),
            ("shuffled", &self.shuffled),
            ("free", &self.free),
        ]
    }

    /// Returns the scene's figures for people.
    pub(super) fn table(&self) -> String {
        let mut lines = vec![format!(
            "{}: {} surfaces ({} triangles), {}",
            self.name, self.surfaces, self.triangles, self.light
        )];
        lines.extend(self.notes.iter().map(|note| format!("  {note}")));
        lines.extend(self.preparation.iter().map(Preparation::row));
        for (set, report) in self.sets() {
            lines.push(format!(
                "  {set}: {} queries, {:.1} % in shadow",
                report.queries,
                100.0 * report.shadowed_share
            ));
            lines.extend(report.rows());
        }
        lines.extend(self.break_even.as_ref().map(BreakEven::row));
        for (voxels, capped) in self.oracle.iter().flatten() {
            let ceiling = capped.ceiling.map_or_else(String::new, |ceiling| {
                format!(
                    " of {:.2} % that voxels could know ({:.1} %)",
                    100.0 * ceiling,
                    100.0 * capped.first_pass / ceiling
                )
            });
            lines.push(format!(
                "  values alone at {voxels}^3: first pass {:.2} %{ceiling}; {} bytes, {:.2} % of dense",
                100.0 * capped.first_pass,
                capped.value_bytes,
                100.0 * capped.dense_share
            ));
        }
        lines.push(format!(
            "  {} mismatches among our methods, {} judged differences where we are wrong",
            self.mismatches, self.ours_wrong
        ));
        lines.join("\n")
    }
}

impl SetReport {
    fn rows(&self) -> Vec<String> {
        let mut rows = Vec::new();
        for (key, time) in &self.times_ns {
            let Some(time) = time else {
                continue;
            };
            let name = key.trim_end_matches("_ns");
            let mut row = format!("    {name:<12} {time:>8.1} ns");
            if let Some(spread) = self.spread.get(name) {
                row += &format!(" (spread {:>4.1} %)", 100.0 * spread);
            }
            if let Some(ratio) = self.embree_best_by.get(name) {
                row += &format!(", fastest embree by it {ratio:>5.2}");
            }
            if let Some(ratio) = self.embree_by.get(name) {
                row += &format!(", embree by it {ratio:>5.2}");
            }
            if let Some(shares) = self.shares.get(name) {
                row += &format!("; {}", shares.text());
            }
            if let Some(work) = self.work.get(name) {
                row += &format!(
                    "; {:.1} steps, {:.1} tests, {:.1} candidates a query",
                    work.steps, work.intersections, work.candidates
                );
            }
            if let Some(verdicts) = self.differences.get(name) {
                row += &format!("; {}", verdicts.text());
            }
            rows.push(row);
        }
        rows
    }
}

impl Report {
    /// Starts a report without scenes.
    pub(super) fn new(head: Head) -> Self {
        Self {
            head,
            scenes: Vec::new(),
            geometric_means: BTreeMap::new(),
        }
    }

    /// Fills the means in.
    pub(super) fn average(&mut self) {
        let mut ratios: BTreeMap<(&str, String), Vec<f64>> = BTreeMap::new();
        for scene in &self.scenes {
            for (set, report) in scene.sets() {
                let best = report.embree_best_by.iter();
                let best = best.map(|(method, ratio)| (format!("{method}_best"), *ratio));
                let single = report.embree_by.clone().into_iter();
                for (method, ratio) in single.chain(best) {
                    ratios.entry((set, method)).or_default().push(ratio);
                }
            }
        }
        let mut means: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
        for ((set, method), ratios) in ratios {
            let mean = geometric_mean(ratios.into_iter());
            means
                .entry(set.to_owned())
                .or_default()
                .insert(method, mean);
        }
        self.geometric_means = means;
    }

    /// Returns the means for people; empty without Embree.
    pub(super) fn means(&self) -> String {
        let sets = self.geometric_means.iter().map(|(set, means)| {
            let means: Vec<_> = means
                .iter()
                .map(|(method, mean)| format!("{method} {mean:.2}"))
                .collect();
            format!(
                "geometric mean of embree by it, {set}: {}",
                means.join(", ")
            )
        });
        sets.collect::<Vec<_>>().join("\n")
    }
}
