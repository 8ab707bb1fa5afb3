//! The figures of `antumbra-bench frames`, as JSON and as a table.

use std::collections::BTreeMap;

use antumbra_baselines::embree::EmbreeWay;
use serde::Serialize;

use super::head::Head;
use super::judge::Verdicts;
use super::measure::{Measured, geometric_mean};
use super::report::{Preparation, Shares};
use super::shadows::fastest;

/// Rows that exist in the JSON, `null` without Embree.
const KEYS: [&str; 5] = [
    "auto_ns",
    "bvh_ns",
    "embree_ns",
    "embree8_ns",
    "embree16_ns",
];

/// All figures of a run.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    head: Head,
    pub(super) scenes: Vec<SceneReport>,
    /// Part of a series, then ratio of times: geometric mean over the scenes.
    geometric_means: BTreeMap<&'static str, BTreeMap<String, f64>>,
}

/// One scene.
#[derive(Debug, Serialize)]
pub(super) struct SceneReport {
    pub(super) name: String,
    pub(super) light: String,
    pub(super) surfaces: usize,
    pub(super) triangles: usize,
    /// Answers of our methods that are not the plain grid's, in all rounds; must be 0.
    pub(super) mismatches: u64,
    /// Where Embree differs and was found right; must be 0.
    pub(super) ours_wrong: usize,
    /// What Embree is given otherwise than we are, and what no time counts.
    pub(super) notes: Vec<String>,
    pub(super) preparation: BTreeMap<String, Preparation>,
    /// Of the orbit.
    pub(super) first_frame: Timing,
    /// The orbit's fourth frame, asked of `auto` with the values that three have left; `null` in a
    /// shorter orbit.
    pub(super) warm_after_three_views: Option<Timing>,
    pub(super) orbit: SeriesReport,
    pub(super) samples: SeriesReport,
}

/// Times of some frames of a series.
#[derive(Debug, Serialize)]
pub(super) struct Timing {
    queries: usize,
    shadowed_share: f64,
    /// `<method>_ns` a query: median over the rounds.
    #[serde(flatten)]
    times_ns: BTreeMap<String, Option<f64>>,
    /// Median over the rounds of the time of `auto` by that of `bvh`.
    auto_by_bvh: Option<f64>,
    /// Median over the rounds of the time of Embree, one ray a call, by that of each other method.
    embree_by: BTreeMap<String, f64>,
    /// Median over the rounds of the time of Embree's faster way, one ray a call or eight, by each method's.
    embree_best_by: BTreeMap<String, f64>,
    /// Width of the middle half of the rounds over the median.
    spread: BTreeMap<String, f64>,
}

/// A series.
#[derive(Debug, Serialize)]
pub(super) struct SeriesReport {
    pub(super) frames: usize,
    #[serde(flatten)]
    pub(super) timing: Timing,
    /// Method, then frame: nanoseconds a query.
    pub(super) frames_ns: BTreeMap<String, Vec<f64>>,
    /// How `auto` decided the queries of the last frame.
    pub(super) last_frame: Shares,
    /// At the end: of values.
    pub(super) value_bytes: u64,
    /// At the end: of lists, planes and tables.
    pub(super) table_bytes: u64,
    /// How often all values were thrown away for want of room.
    pub(super) evictions: u64,
    /// Judged differences of Embree, single rays and packets, in one round.
    pub(super) differences: BTreeMap<String, Verdicts>,
}

impl Timing {
    /// Sums up what was measured, a method each.
    pub(super) fn new(
        queries: usize,
        shadowed_share: f64,
        names: &[String],
        measured: &[Measured],
    ) -> Self {
        let of = |name: &str| {
            let number = names.iter().position(|other| other == name)?;
            Some(&measured[number])
        };
        let mut timing = Self {
            queries,
            shadowed_share,
            times_ns: KEYS.map(|key| (key.to_owned(), None)).into(),
            auto_by_bvh: None,
            embree_by: BTreeMap::new(),
            embree_best_by: BTreeMap::new(),
            spread: BTreeMap::new(),
        };
        // Nothing asked, nothing measured.
        if queries == 0 {
            return timing;
        }
        for (name, measured) in names.iter().zip(measured) {
            let time = Some(measured.median_ns());
            timing.times_ns.insert(format!("{name}_ns"), time);
            timing.spread.insert(name.clone(), measured.spread());
            let is_embree = name.starts_with("embree");
            let ways = EmbreeWay::ALL.map(|way| of(way.name()));
            if let Some(best) = fastest(ways).filter(|_| !is_embree) {
                let ratio = best.ratio_to(measured);
                timing.embree_best_by.insert(name.clone(), ratio);
            }
            if let Some(embree) = of("embree").filter(|_| name != "embree") {
                let ratio = embree.ratio_to(measured);
                timing.embree_by.insert(name.clone(), ratio);
            }
        }
        if let (Some(auto), Some(bvh)) = (of("auto"), of("bvh")) {
            timing.auto_by_bvh = Some(auto.ratio_to(bvh));
        }
        timing
    }

    fn rows(&self) -> Vec<String> {
        let mut rows = Vec::new();
        for key in KEYS {
            let Some(time) = self.times_ns[key] else {
                continue;
            };
            let name = key.trim_end_matches("_ns");
            let mut row = format!(
                "    {name:<8} {time:>8.1} ns (spread {:>4.1} %)",
                100.0 * self.spread[name]
            );
            if let Some(ratio) = self.embree_by.get(name) {
                row += &format!(", embree by it {ratio:>5.2}");
            }
            if let Some(ratio) = self.embree_best_by.get(name) {
                row += &format!(", fastest embree by it {ratio:>5.2}");
            }
            if let Some(ratio) = self.auto_by_bvh.filter(|_| name == "auto") {
                row += &format!(", it by bvh {ratio:.3}");
            }
            rows.push(row);
        }
        rows
    }

    /// Returns the ratios that are averaged.
    fn ratios(&self) -> impl Iterator<Item = (String, f64)> {
        let embree = self.embree_by.iter();
        let best = self.embree_best_by.iter();
        embree
            .map(|(name, &ratio)| (format!("embree_by_{name}"), ratio))
            .chain(best.map(|(name, &ratio)| (format!("embree_best_by_{name}"), ratio)))
            .chain(self.auto_by_bvh.map(|ratio| ("auto_by_bvh".into(), ratio)))
    }
}

impl SeriesReport {
    fn rows(&self) -> Vec<String> {
        let mut rows = self.timing.rows();
        rows.push(format!(
            "    auto, last frame: {}; {} bytes of values, {} of lists and tables, {} evictions",
            self.last_frame.text(),
            self.value_bytes,
            self.table_bytes,
            self.evictions
        ));
        let differences = self.differences.iter();
        rows.extend(differences.map(|(name, verdicts)| format!("    {name}: {}", verdicts.text())));
        rows
    }
}

impl SceneReport {
    fn timings(&self) -> impl Iterator<Item = (&'static str, &Timing)> {
        [
            ("first_frame", Some(&self.first_frame)),
            (
                "warm_after_three_views",
                self.warm_after_three_views.as_ref(),
            ),
            ("orbit", Some(&self.orbit.timing)),
            ("samples", Some(&self.samples.timing)),
        ]
        .into_iter()
        .filter_map(|(name, timing)| Some((name, timing?)))
    }

    /// Returns the scene's figures for people.
    pub(super) fn table(&self) -> String {
        let mut lines = vec![format!(
            "{}: {} surfaces ({} triangles), {}",
            self.name, self.surfaces, self.triangles, self.light
        )];
        lines.extend(self.notes.iter().map(|note| format!("  {note}")));
        lines.extend(self.preparation.iter().map(Preparation::row));
        for (name, timing) in self.timings() {
            let title = match name {
                "first_frame" => "first frame".to_owned(),
                "orbit" => format!("orbit, {} frames", self.orbit.frames),
                "samples" => format!("still, {} samples", self.samples.frames),
                _ => "fourth frame, by what three frames have left".to_owned(),
            };
            lines.push(format!(
                "  {title}: {} queries, {:.1} % in shadow",
                timing.queries,
                100.0 * timing.shadowed_share
            ));
            lines.extend(match name {
                "orbit" => self.orbit.rows(),
                "samples" => self.samples.rows(),
                _ => timing.rows(),
            });
        }
        lines.push(format!(
            "  {} mismatches among our methods, {} judged differences where we are wrong",
            self.mismatches, self.ours_wrong
        ));
        lines.join("\n")
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
        let mut all: BTreeMap<(&'static str, String), Vec<f64>> = BTreeMap::new();
        for (part, timing) in self.scenes.iter().flat_map(SceneReport::timings) {
            for (name, ratio) in timing.ratios() {
                all.entry((part, name)).or_default().push(ratio);
            }
        }
        for ((part, name), ratios) in all {
            let mean = geometric_mean(ratios.into_iter());
            let means = self.geometric_means.entry(part).or_default();
            means.insert(name, mean);
        }
    }

    /// Returns the means for people.
    pub(super) fn means(&self) -> String {
        let parts = self.geometric_means.iter().map(|(part, means)| {
            let means = means.iter().map(|(name, mean)| format!("{name} {mean:.3}"));
            let means: Vec<_> = means.collect();
            format!("geometric means, {part}: {}", means.join(", "))
        });
        parts.collect::<Vec<_>>().join("\n")
    }
}
