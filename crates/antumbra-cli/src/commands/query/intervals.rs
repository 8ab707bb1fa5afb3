//! Lit intervals of segments: which stretches of them each light reaches.
//!
//! In: a scene, origins and ends. Out: an array of float64, a row an interval, and a line that sums them up.

use antumbra::{LitIntervals, LitIntervalsError};
use antumbra_scene::gather::light_shapes;
use antumbra_scene::model::Scene;

use super::arrays::{self, PointFile};
use super::asked::{Chosen, Files, index};
use crate::failure::{Failure, Outcome};
use crate::saved;
use crate::screen::Screen;
use crate::typed::Query;

/// Numbers of a row: the segment, the column of its light, begin and end.
const ROW: u64 = 4;

/// Reads, asks, writes, sums up.
pub(super) fn work(
    typed: &Query,
    files: Files,
    ends: PointFile,
    scene: &Scene,
    chosen: &Chosen,
    screen: &Screen,
) -> Result<Outcome, Failure> {
    if typed.packed {
        return Err(Failure::input(
            "--packed writes bits, and the answers are intervals",
            "leave --packed out",
        ));
    }
    if ends.count != files.points.count {
        let (path, count) = (typed.points.display(), files.points.count);
        let message = format!(
            "{}: {} ends, but {path} has {count} points",
            ends.path.display(),
            ends.count
        );
        return Err(Failure::input(message, "give an end for each point"));
    }
    let sizes = (ends.count, files.bytes() + ends.bytes());
    let index = index(typed, scene, chosen, sizes, screen)?;
    let ends_path = ends.path.clone();
    let (origins, _) = files.read()?;
    let ends = ends.read()?;
    let lights = chosen.lights.iter();
    let lights = light_shapes(
        &lights
            .map(|&light| scene.lights[light].clone())
            .collect::<Vec<_>>(),
    );
    let mut columns = Vec::new();
    for &light in &chosen.columns {
        let found = index.lit_intervals_of_segments(&origins, &ends, &lights[light.index()]);
        columns.push(found.map_err(|error| {
            let file = match &error {
                LitIntervalsError::BadEnd { what: "end", .. } => &ends_path,
                _ => &typed.points,
            };
            let help = match &error {
                LitIntervalsError::NoClosedForm { .. } => {
                    "leave out segments that alpha-tested surfaces may shade"
                }
                _ => "",
            };
            Failure::input(format!("{}: {error}", file.display()), help)
        })?);
    }
    let numbers = rows_of(&columns, origins.len());
    let count = numbers.len() as u64 / ROW;
    arrays::write_doubles(&typed.output, &[count, ROW], &numbers)?;
    saved::save_if_typed(&typed.saved, &index, screen)?;
    let lit: f64 = numbers
        .chunks(ROW as usize)
        .map(|row| row[3] - row[2])
        .sum();
    let all = (origins.len() * columns.len()).max(1) as f64;
    let lights = match columns.len() {
        1 => "1 light".to_owned(),
        count => format!("{count} lights"),
    };
    screen.result(format!(
        "{} segments, {lights}: {count} lit intervals, {:.2} % of the lengths",
        origins.len(),
        100.0 * lit / all
    ));
    Ok(Outcome::Done)
}

/// Returns the rows, segment after segment, the lights of each in order.
fn rows_of(columns: &[LitIntervals], segment_count: usize) -> Vec<f64> {
    let mut numbers = Vec::new();
    for segment in 0..segment_count {
        for (light, column) in columns.iter().enumerate() {
            for &[begin, end] in column.of(segment) {
                numbers.extend([segment as f64, light as f64, begin, end]);
            }
        }
    }
    numbers
}
