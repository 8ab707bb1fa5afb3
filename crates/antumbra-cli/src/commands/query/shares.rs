//! Shares in place of bits: visible fractions, ambient occlusion, sky view factors.
//!
//! In: a scene, points, what is asked. Out: an array of float32, and a line that sums them up.

use antumbra::{
    Batch, BatchCounters, BatchError, FractionBy, LightId, ReceiverSide, ShadowIndex,
    VisibleFraction,
};
use antumbra_geometry::{DVec3, Sky};
use antumbra_render::aov::all_light_names;
use antumbra_scene::model::Scene;

use super::arrays;
use super::asked::{Chosen, Files, batch, failure, index, nearness, warn_of_surfaces};
use crate::failure::{Failure, Outcome};
use crate::load::LitScene;
use crate::saved;
use crate::screen::Screen;
use crate::typed::Query;

/// A column of the answers.
#[derive(Clone, Copy, Debug)]
enum Column {
    /// A light without size, by its place in the index.
    Light(LightId),
    /// A light with size, by its place in the scene.
    AreaLight(usize),
    AmbientOcclusion,
    SkyViewFactor,
}

/// Reads, asks, writes, sums up.
pub(super) fn work(
    typed: &Query,
    files: Files,
    lit: &LitScene,
    names: &[&str],
    screen: &Screen,
) -> Result<Outcome, Failure> {
    let scene = &lit.scene;
    if typed.packed {
        return Err(Failure::input(
            "--packed writes bits, and the answers are shares",
            "leave --packed out",
        ));
    }
    let (chosen, columns) = columns(typed, scene, names)?;
    let count = files.points.count;
    let mut shape = vec![count];
    if columns.len() != 1 {
        shape.push(columns.len() as u64);
    }
    let out_bytes = 4 * shape.iter().product::<u64>();
    let work_bytes = count * size_of::<VisibleFraction>() as u64;
    let sizes = (count, files.bytes() + out_bytes + work_bytes);
    let index = index(typed, scene, &chosen, sizes, screen)?;
    let room = nearness(typed, &files);
    let (points, normals) = files.read()?;
    let points_of = batch(typed, &points, normals.as_deref(), room);
    if !typed.on_surface && normals.is_none() {
        warn_of_surfaces(&index, &points, screen);
    }
    if typed.shares.sky_view_factor {
        lit.up.say("the sky", screen);
    }
    let asking = Asking {
        typed,
        scene,
        up: lit.up.direction,
        index: &index,
        batch: &points_of,
    };
    let mut out = vec![0.0_f32; points.len() * columns.len()];
    let mut values = vec![0.0_f32; points.len()];
    let mut by_samples = 0;
    for (number, &column) in columns.iter().enumerate() {
        let answered = asking.column(column, &mut values);
        by_samples += answered.map_err(|error| failure(typed, &error))?;
        for (row, &value) in values.iter().enumerate() {
            out[row * columns.len() + number] = value;
        }
    }
    arrays::write_shares(&typed.output, &shape, &out)?;
    saved::save_if_typed(&typed.saved, &index, screen)?;
    let sum: f64 = out.iter().map(|&share| f64::from(share)).sum();
    let mean = sum / out.len().max(1) as f64;
    let what = match columns[..] {
        [Column::AmbientOcclusion] => "ambient occlusion".to_owned(),
        [Column::SkyViewFactor] => "sky view factor".to_owned(),
        [_] => "1 light, visible fraction".to_owned(),
        _ => format!("{} lights, visible fraction", columns.len()),
    };
    screen.result(format!("{} points, {what}: mean {mean:.4}", points.len()));
    if typed.more_lights.soft.is_exact() {
        screen.result(format!(
            "{by_samples} fractions by samples, the others exact"
        ));
    }
    Ok(Outcome::Done)
}

/// Returns the lights that an index is made for, and the columns.
fn columns(typed: &Query, scene: &Scene, names: &[&str]) -> Result<(Chosen, Vec<Column>), Failure> {
    let mut chosen = Chosen {
        lights: Vec::new(),
        columns: Vec::new(),
    };
    if typed.shares.ambient_occlusion {
        return Ok((chosen, vec![Column::AmbientOcclusion]));
    }
    if typed.shares.sky_view_factor {
        return Ok((chosen, vec![Column::SkyViewFactor]));
    }
    let layers = all_light_names(scene);
    let plain = scene.lights.len();
    let own_name = |number: usize| match number.checked_sub(plain) {
        None => &scene.lights[number].name,
        Some(area) => &scene.area_lights[area].name,
    };
    let mut wanted = Vec::new();
    for &name in names {
        let mut own = (0..layers.len()).filter(|&number| own_name(number) == name);
        let light = match (own.next(), own.next()) {
            (Some(light), None) => Some(light),
            // A layer's name is unlike all others.
            _ => layers.iter().position(|layer| layer == name),
        };
        wanted.push(light.ok_or_else(|| {
            let message = format!("no light, or more than one, is called `{name}`");
            Failure::input(message, format!("the scene has {}", layers.join(", ")))
        })?);
    }
    if names.is_empty() {
        wanted = (0..layers.len()).collect();
    }
    let mut columns = Vec::new();
    for number in wanted {
        columns.push(match number.checked_sub(plain) {
            None => {
                chosen.lights.push(number);
                Column::Light(LightId::from_index(chosen.lights.len() - 1))
            }
            Some(area) => Column::AreaLight(area),
        });
    }
    Ok((chosen, columns))
}

struct Asking<'a, 'b> {
    typed: &'a Query,
    scene: &'a Scene,
    up: DVec3,
    index: &'a ShadowIndex,
    batch: &'a Batch<'b, [f64; 3]>,
}

impl Asking<'_, '_> {
    /// Answers a column, and returns how many exact fractions were wanted that samples answered.
    fn column(&self, column: Column, values: &mut [f32]) -> Result<usize, BatchError> {
        let shares = &self.typed.shares;
        let (side, directions) = (
            shares.receiver_side(),
            shares.sampling(shares.directions, 0),
        );
        let done = |_: BatchCounters| 0;
        match column {
            Column::AmbientOcclusion => {
                let distance = shares.distance.filter(|distance| distance.is_finite());
                let index = self.index;
                let answered =
                    index.ambient_occlusion(self.batch, side, distance, &directions, values);
                answered.map(done)
            }
            Column::SkyViewFactor => {
                let sky = Sky::new(self.up).expect("up is an axis, or a reader's");
                let index = self.index;
                let answered = index.sky_view_factor(self.batch, side, &sky, &directions, values);
                answered.map(done)
            }
            Column::Light(light) => {
                let mut bits = vec![0_u8; values.len()];
                self.index.occluded(self.batch, &[light], &mut bits)?;
                for (value, bit) in values.iter_mut().zip(bits) {
                    *value = f32::from(1 - bit);
                }
                Ok(0)
            }
            Column::AreaLight(number) => self.area_light(number, side, values),
        }
    }

    fn area_light(
        &self,
        number: usize,
        side: ReceiverSide,
        values: &mut [f32],
    ) -> Result<usize, BatchError> {
        let light = &self.scene.area_lights[number].shape;
        let soft = &self.typed.more_lights.soft;
        let sampling = self.typed.shares.sampling(soft.samples(), number);
        if !soft.is_exact() {
            let index = self.index;
            let answered = index.visible_fractions(self.batch, side, light, &sampling, values);
            return answered.map(|_| 0);
        }
        let mut fractions = vec![VisibleFraction::default(); values.len()];
        self.index
            .exact_visible_fractions(self.batch, side, light, &sampling, &mut fractions)?;
        for (value, found) in values.iter_mut().zip(&fractions) {
            *value = found.fraction as f32;
        }
        let by_samples = fractions
            .iter()
            .filter(|found| found.by == FractionBy::Samples);
        Ok(by_samples.count())
    }
}
