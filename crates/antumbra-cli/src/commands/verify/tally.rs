//! Counts of `verify`, and its report.
//!
//! Invariant: sums and the first differences do not depend on the order of work.

use antumbra::{Counters, LightId, Shadow, ShadowIndex};
use antumbra_geometry::{LightShape, ReceiverPoint};

use super::Candidate;
use super::attack::Kind;
use super::bumps;
use crate::screen::Screen;

/// Differences reported one by one.
const MOST_TOLD: usize = 20;

/// One method that does not give the judge's bit.
#[derive(Clone, Debug)]
pub(super) struct Difference {
    pub(super) query: u64,
    pub(super) kind: Option<Kind>,
    pub(super) start: ReceiverPoint,
    pub(super) light: usize,
    /// Place among those that are compared.
    pub(super) candidate: usize,
    pub(super) found: Shadow,
    pub(super) expected: Shadow,
}

/// Counts of some of the queries.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    kinds: [u64; Kind::ALL.len()],
    /// For each method how it decided, and how often it differed.
    methods: Vec<(Counters, u64)>,
    /// For each how often it was wrong that may be.
    wrong: Vec<u64>,
    glass: GlassCounts,
    bumps: bumps::Found,
    /// Those of the lowest numbers.
    first: Vec<Difference>,
}

/// Counts of what glass leaves of lights that nothing opaque is before.
#[derive(Clone, Copy, Debug, Default)]
struct GlassCounts {
    asked: u64,
    /// Those where something filters.
    filtered: u64,
    /// Answers of methods that are not the judge's colors.
    differences: u64,
}

impl Tally {
    pub(super) fn new(method_count: usize) -> Self {
        Self {
            methods: vec![(Counters::default(), 0); method_count],
            wrong: vec![0; method_count],
            ..Self::default()
        }
    }

    pub(super) fn count_kind(&mut self, kind: Kind) {
        self.kinds[kind as usize] += 1;
    }

    pub(super) fn counters(&mut self, method: usize) -> &mut Counters {
        &mut self.methods[method].0
    }

    pub(super) fn add_difference(&mut self, difference: Difference) {
        self.methods[difference.candidate].1 += 1;
        self.first.push(difference);
        self.forget();
    }

    /// Counts a wrong answer of a method that is not exact.
    pub(super) fn count_wrong(&mut self, method: usize) {
        self.wrong[method] += 1;
    }

    /// Counts a query about glass, whether any filters there, and the methods that differ.
    pub(super) fn count_glass(&mut self, is_filtered: bool, differences: u64) {
        self.glass.asked += 1;
        self.glass.filtered += u64::from(is_filtered);
        self.glass.differences += differences;
    }

    /// Reports what was asked about glass, if anything was.
    pub(super) fn report_glass(&self, screen: &Screen) {
        let GlassCounts {
            asked,
            filtered,
            differences,
        } = self.glass;
        if asked > 0 {
            screen.result(format!(
                "{asked} of them about glass, {filtered} filtered, {differences} differences of colors"
            ));
        }
    }

    pub(super) fn count_bumps(&mut self, found: bumps::Found) {
        self.bumps.known += found.known;
        self.bumps.differences += found.differences;
    }

    /// Reports what methods knew of points above surfaces, if any knew something.
    pub(super) fn report_bumps(&self, screen: &Screen) {
        let bumps::Found { known, differences } = self.bumps;
        if known > 0 {
            screen.result(format!(
                "bump: {known} answers in full and null regions equal those of the perturbed reference: {differences} differences"
            ));
        }
    }

    /// Reports how often methods that are not exact were wrong.
    pub(super) fn report_inexact(
        &self,
        candidates: &[Candidate],
        query_count: u64,
        screen: &Screen,
    ) {
        for (candidate, wrong) in candidates.iter().zip(&self.wrong) {
            if !candidate.is_exact {
                screen.result(format!(
                    "{} is not exact: {wrong} of {query_count} answers are wrong, {:.3} %",
                    candidate.name,
                    100.0 * *wrong as f64 / query_count as f64
                ));
            }
        }
    }

    /// Returns both counts in one.
    pub(super) fn with(mut self, other: Self) -> Self {
        for (kind, more) in self.kinds.iter_mut().zip(other.kinds) {
            *kind += more;
        }
        for (method, more) in self.methods.iter_mut().zip(other.methods) {
            method.0.add(&more.0);
            method.1 += more.1;
        }
        for (wrong, more) in self.wrong.iter_mut().zip(other.wrong) {
            *wrong += more;
        }
        self.glass.asked += other.glass.asked;
        self.glass.filtered += other.glass.filtered;
        self.glass.differences += other.glass.differences;
        self.count_bumps(other.bumps);
        self.first.extend(other.first);
        self.forget();
        self
    }

    /// Keeps the first differences only, once they are many.
    fn forget(&mut self) {
        if self.first.len() > 2 * MOST_TOLD {
            self.sort();
        }
    }

    fn sort(&mut self) {
        self.first
            .sort_by_key(|difference| (difference.query, difference.candidate));
        self.first.truncate(MOST_TOLD);
    }

    pub(super) fn difference_count(&self) -> u64 {
        let of_methods = self.methods.iter().map(|method| method.1);
        of_methods.sum::<u64>() + self.glass.differences + self.bumps.differences
    }

    /// Reports the first differences.
    pub(super) fn report_differences(
        &mut self,
        judge: &str,
        index: &ShadowIndex,
        candidates: &[Candidate],
        screen: &Screen,
    ) {
        self.sort();
        for difference in &self.first {
            let Difference {
                start,
                light,
                candidate,
                found,
                expected,
                ..
            } = difference;
            let [x, y, z] = start.point.to_array();
            let surface = start
                .surface
                .map_or("free".into(), |id| format!("surface {}", id.0));
            let kind = difference
                .kind
                .map_or(String::new(), |kind| format!(" ({})", kind.name()));
            // Where the judge is a method, the reference says who is wrong.
            let reference = match judge {
                "reference" => String::new(),
                _ => index
                    .shadow_by_reference(start, LightId::from_index(*light))
                    .map_or_else(|error| error.to_string(), |shadow| format!("{shadow:?}")),
            };
            let reference = if reference.is_empty() {
                reference
            } else {
                format!(", the reference {reference}")
            };
            screen.result(format!(
                "difference: query {}{kind}: point [{x:?}, {y:?}, {z:?}], {surface}, light {light} \
                 {}: {} says {found:?}, the {judge} {expected:?}{reference}",
                difference.query,
                light_text(&index.lights()[*light]),
                candidates[*candidate].name
            ));
        }
    }

    /// Reports kinds of queries and how methods decided.
    pub(super) fn report_counts(&self, candidates: &[Candidate], screen: &Screen) {
        for (kind, count) in Kind::ALL.into_iter().zip(self.kinds) {
            screen.result(format!("{:<26} {count:>12}", kind.name()));
        }
        for (candidate, (counters, differences)) in candidates.iter().zip(&self.methods) {
            let shadow = &counters.shadow;
            let all = shadow.first_pass + shadow.intermediate + shadow.blocker_list + shadow.rays;
            let share = |count: u64| 100.0 * count as f64 / all.max(1) as f64;
            screen.result(format!(
                "{:<10} {differences} differences; first pass {:.2} %, intermediate {:.2} %, list \
                 {:.2} %, ray {:.2} %; shadowed {:.2} %",
                candidate.name,
                share(shadow.first_pass),
                share(shadow.intermediate),
                share(shadow.blocker_list),
                share(shadow.rays),
                share(shadow.shadowed)
            ));
        }
    }
}

fn light_text(light: &LightShape) -> String {
    match light {
        LightShape::Point(at) => format!("at [{:?}, {:?}, {:?}]", at.x, at.y, at.z),
        LightShape::Direction(to) => format!("towards [{:?}, {:?}, {:?}]", to.x, to.y, to.z),
    }
}
