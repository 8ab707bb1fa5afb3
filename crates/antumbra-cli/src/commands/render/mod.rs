//! `antumbra render`: from a scene file to PNG or OpenEXR.
//!
//! | module | what |
//! |---|---|
//! | `meant` | what was typed becomes views, settings, files |
//! | `files` | pictures and layers become files |
//! | `figures` | what is reported about the run |

mod figures;
mod files;
mod meant;

use std::time::{Duration, Instant};

use antumbra::IndexOptions;
use antumbra_render::film::{self, Watch};
use antumbra_render::integrator::Tally;
use antumbra_render::prepare::Prepared;
use antumbra_scene::gather::{Gathered, scene_bytes, surface_bytes};

use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::load::{self, Lighting};
use crate::memory::Need;
use crate::outputs::{Content, Outputs};
use crate::saved;
use crate::screen::Screen;
use crate::typed::Render;
use crate::values::{Exposure, format_bytes};
use figures::Run;
use files::Format;
use meant::Meant;

/// Loads, prepares once, renders every frame, reports the figures.
pub fn run(typed: &Render, screen: &Screen, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    let format = Format::of(&typed.output)?;
    let mut outputs = Outputs::none();
    if typed.orbit.is_none() {
        outputs.add("--output", &typed.output, Content::Picture)?;
    }
    outputs.add_if("--stats-json", typed.stats_json.as_ref(), Content::Json)?;
    typed.saved.add_to(&mut outputs)?;
    let mut lit = load::any_lit_scene(
        &typed.file,
        Some(&typed.more_lights),
        Lighting::Needed,
        &typed.cost,
        &outputs,
        screen,
    )?;
    if typed.bump.is_some() {
        for material in &mut lit.scene.materials {
            material.bump = typed.bump;
        }
    }
    let meant = Meant::of(typed, format, &lit, screen)?;
    // What depends on the scene: frames and layers.
    for (option, path) in meant.more_files(typed, &lit.scene) {
        outputs.add_made(option, &path, Content::Picture)?;
    }
    outputs.spare(&lit.files)?;
    typed.saved.spare(&outputs)?;
    super::on_threads(&typed.threads, || {
        work(typed, lit, &meant, screen, interrupt)
    })?
}

fn work(
    typed: &Render,
    lit: load::LitScene,
    meant: &Meant,
    screen: &Screen,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    // Once, whatever the number of frames.
    let begin = Instant::now();
    let (prepared, predicted_bytes) = prepared(typed, lit.scene, meant, screen)?;
    let prepare_time = begin.elapsed();
    say_prepared(&prepared, prepare_time, screen);
    let times = (predicted_bytes, lit.load_time, prepare_time);

    // What is rendered when Ctrl-C comes is written.
    interrupt.keep_partial_results();
    antumbra_task::unwatched(|| frames(typed, &prepared, meant, screen, interrupt, times))
}

/// Renders and writes all frames, or as much as is finished when Ctrl-C comes.
fn frames(
    typed: &Render,
    prepared: &Prepared,
    meant: &Meant,
    screen: &Screen,
    interrupt: &Interrupt,
    (predicted_bytes, load_time, prepare_time): (u64, Duration, Duration),
) -> Result<Outcome, Failure> {
    let mut run = Run {
        tally: Tally::default(),
        frame_count: 0,
        is_complete: true,
        exposure_in_stops: None,
        predicted_bytes,
        load_time,
        prepare_time,
        render_time: Duration::ZERO,
    };
    let bar = screen.progress(
        film::work(meant.size, meant.settings.sampling) * meant.frames.len() as u64,
        "rendering",
    );
    let progress = |samples| bar.inc(samples);
    for (number, (view, path)) in meant.frames.iter().enumerate() {
        let frames_left = (meant.frames.len() - number) as u64;
        film::expect(prepared, meant.size, meant.settings.sampling, frames_left);
        let begin = Instant::now();
        let watch = Watch {
            task: interrupt.task(),
            progress: &progress,
        };
        let rendered = film::render(prepared, view, &meant.settings, watch);
        run.render_time += begin.elapsed();
        run.tally.add(&rendered.tally);
        // One exposure for all frames, so that a fly-around does not flicker.
        let stops = *run.exposure_in_stops.get_or_insert_with(|| {
            let stops = match meant.exposure {
                Exposure::Auto => rendered.metering.stops(),
                Exposure::Stops(stops) => stops,
            };
            if meant.exposure == Exposure::Auto {
                screen.detail(format!("automatic exposure: {stops:+.2} stops"));
            }
            stops
        });
        meant.format.write(path, &rendered, stops)?;
        run.frame_count += 1;
        run.is_complete = rendered.is_complete;
        if !run.is_complete {
            bar.finish_and_clear();
            let path = path.display();
            screen.aside(format!(
                "stopped; what was finished of the picture is in {path}"
            ));
            break;
        }
    }
    bar.finish_and_clear();
    saved::save_if_typed(&typed.saved, prepared.index(), screen)?;

    figures::report(typed, &run.statistics(typed, meant, prepared), screen)?;
    Ok(if run.is_complete {
        Outcome::Done
    } else {
        Outcome::Interrupted
    })
}

/// Prepares the scene, unless it needs more memory than it may take; says how much it needs.
fn prepared(
    typed: &Render,
    scene: antumbra_scene::model::Scene,
    meant: &Meant,
    screen: &Screen,
) -> Result<(Prepared, u64), Failure> {
    let mut need = Need {
        scene: scene_bytes(&scene),
        surfaces: surface_bytes(&scene),
        picture: meant.picture_bytes,
        ..Need::default()
    };
    need.check(meant.memory_limit)?;
    let gathered = Gathered::of(&scene)?;
    let predicted = meant
        .prepare
        .predict(gathered.occluders(), scene.lights.len(), None)?;
    need.set_index(gathered.memory_bytes(), predicted);
    need.check(meant.memory_limit)?;
    screen.detail(format!("memory predicted: {need}"));
    let options = IndexOptions {
        memory_limit: need.left_for_index(meant.memory_limit),
        ..meant.prepare
    };
    let file = typed.saved.occlusion.as_deref();
    let prepared = Prepared::of_gathered_from(scene, gathered, &options, file)?;
    if let Some(path) = file {
        saved::report(prepared.index(), &prepared.scene().lights, path, screen);
    }
    // Files hold what is known of lights one by one.
    let prepared = match typed.saved.save_occlusion {
        Some(_) => prepared.with_lights_one_by_one(),
        None => prepared,
    };
    Ok((prepared, need.total(meant.memory_limit)))
}

fn say_prepared(prepared: &Prepared, time: Duration, screen: &Screen) {
    let index = prepared.index();
    let [x, y, z] = index.grid_resolution();
    screen.detail(format!(
        "prepared in {:.3} s: {} surfaces, grid {x} x {y} x {z}, occlusion values {}",
        time.as_secs_f64(),
        index.occluders().surface_count(),
        format_bytes(index.occlusion_bytes())
    ));
    if let Some(verdict) = index.quick_check() {
        let advice = if verdict.is_advised {
            "advises"
        } else {
            "advises against"
        };
        screen.note(format!(
            "the quick check {advice} voxel occlusion testing: elements occupy {:.3} % of the \
             voxels on average, the threshold is {:.3} %",
            100.0 * verdict.occupied_share,
            100.0 * verdict.threshold
        ));
    }
}
