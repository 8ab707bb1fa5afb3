//! Transmittance of points: which shares of red, green and blue of each light reach them through glass.
//!
//! In: a scene, points. Out: an array of float64, three numbers a point and light, and a line that sums them up.

use antumbra_scene::model::Scene;

use super::arrays;
use super::asked::{Chosen, Files, batch, failure, index, nearness, warn_of_surfaces};
use crate::failure::{Failure, Outcome};
use crate::saved;
use crate::screen::Screen;
use crate::typed::Query;

/// Bytes of an answer.
const TRIPLE: u64 = 24;

/// Reads, asks, writes, sums up.
pub(super) fn work(
    typed: &Query,
    files: Files,
    scene: &Scene,
    chosen: &Chosen,
    screen: &Screen,
) -> Result<Outcome, Failure> {
    if typed.packed {
        return Err(Failure::input(
            "--packed writes bits, and the answers are shares of colors",
            "leave --packed out",
        ));
    }
    let (count, light_count) = (files.points.count, chosen.columns.len() as u64);
    let out_bytes = count.saturating_mul(light_count).saturating_mul(TRIPLE);
    let sizes = (count, files.bytes().saturating_add(out_bytes));
    let index = index(typed, scene, chosen, sizes, screen)?;
    if !index.has_glass() {
        screen.note("--transmittance: no surface of the scene lets light through in part");
    }
    let nearness = nearness(typed, &files);
    let (points, normals) = files.read()?;
    let batch = batch(typed, &points, normals.as_deref(), nearness);
    if !typed.on_surface {
        warn_of_surfaces(&index, &points, screen);
    }
    let mut shares = vec![[0.0; 3]; points.len() * chosen.columns.len()];
    let answered = index.transmittances(&batch, &chosen.columns, &mut shares);
    answered.map_err(|error| failure(typed, &error))?;
    let shape = match light_count {
        1 => vec![count, 3],
        _ => vec![count, light_count, 3],
    };
    arrays::write_doubles(&typed.output, &shape, shares.as_flattened())?;
    saved::save_if_typed(&typed.saved, &index, screen)?;
    let of = |kind: fn(&[f64; 3]) -> bool| shares.iter().filter(|share| kind(share)).count();
    let (blocked, whole) = (
        of(|&share| share == [0.0; 3]),
        of(|&share| share == [1.0; 3]),
    );
    screen.result(format!(
        "{} points, {light_count} lights: {blocked} answers blocked, {whole} unfiltered, {} filtered",
        points.len(),
        shares.len() - blocked - whole
    ));
    Ok(Outcome::Done)
}
