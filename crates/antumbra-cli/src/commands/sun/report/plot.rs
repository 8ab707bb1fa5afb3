//! Plots as SVG: a distribution, and the course of days.

use antumbra_render::color_map::inferno_srgb;
use antumbra_render::legend::{step, written};
use maud::{Markup, html};

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 260.0;
/// Left, right, top and bottom of the plane, from the left and the top.
const PLANE: [f64; 4] = [56.0, 884.0, 12.0, 214.0];

/// Colors of days: those of Okabe and Ito.
pub(super) const DAY_COLORS: [&str; 3] = ["#009e73", "#d55e00", "#0072b2"];

/// Share of an area in each of equal bins from 0 to `most`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bins {
    pub(super) most: f64,
    pub(super) shares: Vec<f64>,
}

/// Bins of a distribution.
const BINS: usize = 24;

impl Bins {
    /// Counts numbers, not negative, weighted by `weight`.
    pub(super) fn of(list: &[f64], weight: impl Fn(usize) -> f64) -> Self {
        let most = list.iter().copied().fold(0.0, f64::max);
        let mut shares = vec![0.0; BINS];
        let mut whole = 0.0;
        for (place, &number) in list.iter().enumerate() {
            let share = if most > 0.0 { number / most } else { 0.0 };
            let bin = ((share * BINS as f64) as usize).min(BINS - 1);
            shares[bin] += weight(place);
            whole += weight(place);
        }
        if whole > 0.0 {
            shares.iter_mut().for_each(|share| *share /= whole);
        }
        Self { most, shares }
    }
}

/// Returns a place of the plane, from shares of its width and height.
fn place(across: f64, up: f64) -> [f64; 2] {
    let [left, right, top, bottom] = PLANE;
    [left + across * (right - left), bottom - up * (bottom - top)]
}

/// Returns axes: marks from 0 to the ends, and what they count.
fn axes(ends: [f64; 2], steps: [f64; 2], names: [&str; 2]) -> Markup {
    let marks = |end: f64, step: f64| {
        let count = (end / step + 1e-9) as usize;
        (0..=count.min(50)).map(move |mark| (mark as f64 * step, mark as f64 * step / end))
    };
    let [left, right, _, bottom] = PLANE;
    html! {
        @for (number, share) in marks(ends[1], steps[1]) {
            @let [_, y] = place(0.0, share);
            line.axis x1=(left) x2=(right) y1=(y) y2=(y) {}
            text x=(left - 8.0) y=(y + 4.0) text-anchor="end" { (written(number, steps[1])) }
        }
        @for (number, share) in marks(ends[0], steps[0]) {
            @let [x, _] = place(share, 0.0);
            line.axis x1=(x) x2=(x) y1=(bottom) y2=(bottom + 5.0) {}
            text x=(x) y=(bottom + 20.0) text-anchor="middle" { (written(number, steps[0])) }
        }
        text x=(right) y=(bottom + 40.0) text-anchor="end" { (names[0]) }
        text x=(left) y=(bottom + 40.0) { (names[1]) }
    }
}

/// Draws a distribution, in the colors of the picture.
pub(super) fn bins(bins: &Bins, unit: &str) -> Markup {
    let highest = 100.0 * bins.shares.iter().copied().fold(0.0, f64::max);
    let up = step(highest);
    let end = if highest > 0.0 {
        (highest / up).ceil() * up
    } else {
        1.0
    };
    let most = if bins.most > 0.0 { bins.most } else { 1.0 };
    let count = bins.shares.len() as f64;
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label=(format!("distribution of {unit}")) {
            (axes([most, end], [step(most), up], [unit, "% of the area"]))
            @for (number, &share) in bins.shares.iter().enumerate() {
                @let [left, top] = place(number as f64 / count, 100.0 * share / end);
                @let [right, bottom] = place((number + 1) as f64 / count, 0.0);
                @let color = inferno_srgb((number as f64 + 0.5) / count);
                @let title = format!(
                    "{:.4} to {:.4}: {:.2} %", most * number as f64 / count, most * (number + 1) as f64 / count, 100.0 * share
                );
                rect x=(left + 1.0) y=(top) width=(right - left - 2.0) height=(bottom - top)
                    fill=(format!("#{color:06x}")) stroke="#808080" stroke-width="0.5" { title { (title) } }
            }
        }
    }
}

/// Sunlit shares in the course of a day.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Day {
    pub(super) name: String,
    /// Hours of the local clock, and the share of the area that is sunlit then.
    pub(super) points: Vec<[f64; 2]>,
}

/// Draws the course of days.
pub(super) fn days(days: &[Day]) -> Markup {
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {HEIGHT}")) role="img" aria-label="sunlit share in the course of a day" {
            (axes([24.0, 100.0], [2.0, 20.0], ["hour of the local standard time", "% of the area is sunlit"]))
            @for (day, color) in days.iter().zip(DAY_COLORS) {
                @let line = day.points.iter().map(|&[hour, share]| {
                    let [x, y] = place(hour / 24.0, share);
                    format!("{x:.1},{y:.1}")
                });
                polyline.day points=(line.collect::<Vec<_>>().join(" ")) stroke=(color) {}
            }
            @for (number, (day, color)) in days.iter().zip(DAY_COLORS).enumerate() {
                @let x = PLANE[0] + 16.0 + 200.0 * number as f64;
                line x1=(x) x2=(x + 24.0) y1="24" y2="24" stroke=(color) stroke-width="2.5" {}
                text x=(x + 32.0) y="28" { (day.name) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_the_whole_area_once() {
        let list = [0.0, 1.0, 12.0, 24.0, 24.0];
        let found = Bins::of(&list, |place| if place == 0 { 6.0 } else { 1.0 });
        assert_eq!(found.most, 24.0);
        assert!((found.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let due = [(0, 0.6), (1, 0.1), (12, 0.1), (23, 0.2)];
        for (bin, share) in due {
            assert_eq!(found.shares[bin], share, "{bin}");
        }
        assert_eq!(Bins::of(&[0.0, 0.0], |_| 1.0).shares[0], 1.0);
        assert_eq!(Bins::of(&[], |_| 1.0).shares, [0.0; BINS]);
    }
}
