//! Plots as SVG: stacked bars, plain bars, lines. Colors are the page's classes.

use maud::{Markup, html};

/// A bar of parts, left to right.
pub(super) struct Bar {
    pub(super) label: String,
    /// Lengths, each with the class that colors it.
    pub(super) parts: Vec<(f64, &'static str)>,
    /// Written behind the bar.
    pub(super) note: String,
}

/// Bars under a heading.
pub(super) struct Group {
    pub(super) title: String,
    pub(super) bars: Vec<Bar>,
}

const WIDTH: f64 = 640.0;
const LABEL: f64 = 148.0;
const NOTE: f64 = 142.0;
const ROW: f64 = 23.0;

/// Returns groups of horizontal bars; the longest of each group fills the width, or all share one scale, `full`.
pub(super) fn bars(groups: &[Group], full: Option<f64>, title: &str) -> Markup {
    let room = WIDTH - LABEL - NOTE;
    let height: f64 = groups
        .iter()
        .map(|group| 30.0 + ROW * group.bars.len() as f64)
        .sum();
    let mut top = 0.0;
    html! {
        svg.plot viewBox=(format!("0 0 {WIDTH} {height}")) role="img" aria-label=(title) {
            @for group in groups {
                @let longest = group.bars.iter().map(|bar| bar.parts.iter().map(|part| part.0.max(0.0)).sum::<f64>());
                @let scale = room / full.unwrap_or_else(|| longest.fold(f64::MIN_POSITIVE, f64::max));
                text.head x="0" y=(number(top + 19.0)) { (group.title) }
                @for (i, bar) in group.bars.iter().enumerate() {
                    @let y = top + 26.0 + ROW * i as f64;
                    text.label x=(number(LABEL - 8.0)) y=(number(y + 14.5)) { (bar.label) }
                    @let ends = ends(&bar.parts, scale);
                    @for (from, to, class) in &ends {
                        rect class=(class) x=(number(LABEL + from)) y=(number(y + 1.5))
                            width=(number(to - from)) height="17" {}
                    }
                    @let end = ends.last().map_or(0.0, |end| end.1);
                    text.note x=(number(LABEL + end + 6.0)) y=(number(y + 14.5)) { (bar.note) }
                }
                ({ top += 30.0 + ROW * group.bars.len() as f64; "" })
            }
        }
    }
}

/// Returns where each part begins and ends.
fn ends(parts: &[(f64, &'static str)], scale: f64) -> Vec<(f64, f64, &'static str)> {
    let mut end = 0.0;
    parts
        .iter()
        .map(|&(length, class)| {
            let from = end;
            end += scale * length.max(0.0);
            (from, end, class)
        })
        .collect()
}

/// A line through points.
pub(super) struct Line {
    pub(super) class: &'static str,
    pub(super) points: Vec<(f64, f64)>,
}

const CHART: [f64; 2] = [300.0, 190.0];
const LEFT: f64 = 44.0;
const BOTTOM: f64 = 30.0;
const TOP: f64 = 26.0;
const RIGHT: f64 = 10.0;

/// Returns lines over an axis from 0 up, marked at the values of `at`; places along it go by logarithm if
/// `is_log`.
pub(super) fn lines(title: &str, at: &[u32], unit: &str, is_log: bool, lines: &[Line]) -> Markup {
    let along = |value: f64| if is_log { libm::log2(value) } else { value };
    let ends = [at.first(), at.last()].map(|end| along(f64::from(end.copied().unwrap_or(1))));
    let width = (ends[1] - ends[0]).max(f64::MIN_POSITIVE);
    let x = |value: f64| LEFT + (along(value) - ends[0]) / width * (CHART[0] - LEFT - RIGHT);
    let points = lines.iter().flat_map(|line| &line.points);
    let step = step(points.fold(0.0, |most, point| point.1.max(most)));
    let most = points_most(lines, step);
    let y = |value: f64| CHART[1] - BOTTOM - value / most * (CHART[1] - BOTTOM - TOP);
    let tick_count = (most / step).round() as u32;
    html! {
        svg.chart viewBox=(format!("0 0 {} {}", CHART[0], CHART[1])) role="img" aria-label=(title) {
            text.head x="0" y="14" { (title) }
            @for tick in 0..=tick_count {
                @let value = step * f64::from(tick);
                line.grid x1=(number(LEFT)) x2=(number(CHART[0] - RIGHT)) y1=(number(y(value))) y2=(number(y(value))) {}
                text.label x=(number(LEFT - 6.0)) y=(number(y(value) + 4.0)) { (tick_text(value, step)) }
            }
            @for &value in at {
                text.tick x=(number(x(f64::from(value)))) y=(number(CHART[1] - BOTTOM + 16.0)) { (value) }
            }
            text.unit x=(number(CHART[0] - RIGHT)) y=(number(CHART[1] - 1.0)) { (unit) }
            @for line in lines {
                @let path: Vec<String> = line.points.iter().map(|&(at, value)| format!("{},{}", number(x(at)), number(y(value)))).collect();
                polyline class=(line.class) points=(path.join(" ")) {}
                @for &(at, value) in &line.points {
                    circle class=(line.class) cx=(number(x(at))) cy=(number(y(value))) r="2.5" {}
                }
            }
        }
    }
}

/// Returns the highest mark: above all points.
fn points_most(lines: &[Line], step: f64) -> f64 {
    let points = lines.iter().flat_map(|line| &line.points);
    let most = points.fold(0.0, |most: f64, point| point.1.max(most));
    step * (most / step).ceil().max(1.0)
}

/// Returns a round distance between marks, for three to six of them.
fn step(most: f64) -> f64 {
    let most = most.max(1e-9);
    let power = libm::pow(10.0, libm::log10(most).floor());
    let sizes = [0.2, 0.5, 1.0, 2.0].map(|part| part * power);
    let fits = sizes.into_iter().find(|size| most / size <= 5.0);
    fits.unwrap_or(power)
}

fn tick_text(value: f64, step: f64) -> String {
    let digits = (-libm::log10(step).floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$}")
}

/// Tenths are fine enough, and short.
fn number(value: f64) -> String {
    format!("{value:.1}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_few() {
        for (most, expected) in [(0.9, 0.2), (1.0, 0.2), (1.4, 0.5), (4.0, 1.0), (7.0, 2.0)] {
            assert!(
                (step(most) - expected).abs() < 1e-12,
                "{most}: {}",
                step(most)
            );
            assert!(most / step(most) <= 5.0);
        }
        assert_eq!(tick_text(0.25, 0.05), "0.25");
        assert_eq!(tick_text(20.0, 10.0), "20");
    }

    #[test]
    fn parts_follow_one_another() {
        let found = ends(&[(1.0, "a"), (2.0, "b"), (-1.0, "c")], 10.0);
        assert_eq!(
            found,
            [(0.0, 10.0, "a"), (10.0, 30.0, "b"), (30.0, 30.0, "c")]
        );
    }
}
