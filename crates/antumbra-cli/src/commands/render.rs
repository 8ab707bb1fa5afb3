//! `antumbra render`: from a scene file to PNG.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use antumbra_render::camera::View;
use antumbra_render::film::{self, RenderSettings, Sampling, Watch};
use antumbra_render::image_file::write_png;
use antumbra_render::integrator::Tally;
use antumbra_render::orbit::camera_of_frame;
use antumbra_render::prepare::{PrepareOptions, Prepared};
use antumbra_render::statistics::{
    MemoryUse, Rays, SCHEMA, Settings, ShadowQueries, Statistics, Times, Traversal, Verdict,
};

use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::screen::Screen;
use crate::typed::{QuickCheckAction, Render, Shadows};
use crate::values::format_bytes;
use crate::{load, machine, memory};

/// The picture's size where neither file nor command line gives one.
const DEFAULT_SIZE: [u32; 2] = [512, 512];

/// What was meant: everything but the scene, settled and checked.
struct Meant {
    /// One view and one file a frame.
    frames: Vec<(View, PathBuf)>,
    size: [u32; 2],
    settings: RenderSettings,
    prepare: PrepareOptions,
}

impl Meant {
    fn of(typed: &Render, scene: &load::LitScene, screen: &Screen) -> Result<Self, Failure> {
        let scene = &scene.scene;
        let camera = load::camera(scene, &typed.file, typed.camera.as_ref(), screen)?;
        let size = typed
            .size
            .or(camera.resolution.map(clamped))
            .unwrap_or(DEFAULT_SIZE);
        let frame_count = typed.orbit.unwrap_or(1);
        let frames = (0..frame_count)
            .map(|frame| {
                let view = View::new(&camera_of_frame(&camera, frame, frame_count), size)
                    .map_err(|error| Failure::input(error.to_string(), "give another --camera"))?;
                let path = match typed.orbit {
                    Some(_) => numbered(&typed.output, frame + 1),
                    None => typed.output.clone(),
                };
                Ok((view, path))
            })
            .collect::<Result<Vec<_>, Failure>>()?;

        let sampling = if typed.corner_rays {
            Sampling::Corners
        } else {
            Sampling::Stratified { samples: typed.spp }
        };
        let limit = memory::limit(typed.cost.memory_limit);
        // Eight bits a channel for the file come on top of the film.
        let file_bytes = 3 * u64::from(size[0]) * u64::from(size[1]);
        let picture_bytes = film::predict_bytes(size, sampling) + file_bytes;
        Ok(Self {
            frames,
            size,
            settings: RenderSettings {
                sampling,
                max_depth: typed.max_depth,
                seed: typed.seed,
                show: typed.show.show(),
            },
            prepare: PrepareOptions {
                method: typed.shadows.method(),
                grid: typed.cost.grid.unwrap_or_default(),
                quick_check: QuickCheckAction::quick_check(typed.quick_check),
                memory_limit: memory::left_after(limit, picture_bytes)?,
            },
        })
    }
}

/// Keeps a size from a file within what `--size` takes.
fn clamped(size: [u32; 2]) -> [u32; 2] {
    size.map(|side| side.clamp(1, crate::values::MAX_SIDE))
}

/// Returns `a/b-0007.png` for `a/b.png` and 7.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let mut name = path.file_stem().map(OsString::from).unwrap_or_default();
    name.push(format!("-{number:04}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Loads, prepares once, renders every frame, tells the figures.
pub(crate) fn run(
    typed: &Render,
    screen: &Screen,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    if typed.output.file_name().is_none() {
        let message = format!("{} names no file to write", typed.output.display());
        return Err(Failure::input(message, "give --output FILE.png"));
    }
    let lit = load::lit_scene(&typed.file, screen)?;
    let meant = Meant::of(typed, &lit, screen)?;
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
    let prepared = Prepared::new(lit.scene, &meant.prepare)?;
    let prepare_time = begin.elapsed();
    say_prepared(&prepared, prepare_time, screen);

    interrupt.keep_partial_results();
    let mut tally = Tally::default();
    let mut render_time = Duration::ZERO;
    let mut frame_count = 0;
    let mut is_complete = true;
    let bar = screen.progress(
        film::work(meant.size, meant.settings.sampling) * meant.frames.len() as u64,
        "rendering",
    );
    let progress = |samples| bar.inc(samples);
    for (view, path) in &meant.frames {
        let begin = Instant::now();
        let watch = Watch {
            cancel: interrupt.cancel(),
            progress: &progress,
        };
        let rendered = film::render(&prepared, view, &meant.settings, watch);
        render_time += begin.elapsed();
        tally.add(&rendered.tally);
        write_png(path, &rendered.picture, typed.exposure)
            .map_err(|error| Failure::system(error.to_string()))?;
        frame_count += 1;
        is_complete = rendered.is_complete;
        if !is_complete {
            bar.abandon();
            let path = path.display();
            screen.aside(format!(
                "stopped; what was finished of the picture is in {path}"
            ));
            break;
        }
    }
    bar.finish_and_clear();

    let statistics = Statistics {
        schema: SCHEMA,
        scene: typed.file.scene.display().to_string(),
        frames: frame_count,
        preparations: 1,
        is_complete: is_complete && frame_count as usize == meant.frames.len(),
        settings: settings(typed, meant, &prepared),
        rays: Rays::from(&tally),
        shadow: ShadowQueries::from(&tally),
        traversal: Traversal::from(&tally),
        time: Times {
            load_s: lit.load_time.as_secs_f64(),
            prepare_s: prepare_time.as_secs_f64(),
            render_s: render_time.as_secs_f64(),
        },
        memory: MemoryUse {
            occlusion_bytes: prepared.index().occlusion_bytes(),
            peak_bytes: machine::peak_bytes(),
        },
        quick_check: prepared.index().quick_check().map(Verdict::from),
    };
    tell(typed, &statistics, screen)?;
    Ok(if is_complete {
        Outcome::Done
    } else {
        Outcome::Interrupted
    })
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

fn settings(typed: &Render, meant: &Meant, prepared: &Prepared) -> Settings {
    Settings {
        shadows: typed.shadows.name().to_owned(),
        shadows_used: Shadows::of(prepared.index().method()).name().to_owned(),
        grid: prepared.index().grid_resolution(),
        size: meant.size,
        spp: typed.spp,
        corner_rays: typed.corner_rays,
        max_depth: typed.max_depth,
        seed: typed.seed,
        threads: rayon::current_num_threads(),
        show: typed.show.name().to_owned(),
    }
}

/// Tells the figures to whom they were promised.
fn tell(typed: &Render, statistics: &Statistics, screen: &Screen) -> Result<(), Failure> {
    if let Some(path) = &typed.stats_json {
        let write = || -> Result<(), std::io::Error> {
            let mut text = serde_json::to_string_pretty(statistics)?;
            text.push('\n');
            fs::write(path, text)
        };
        write().map_err(|error| {
            Failure::system(format!("cannot write {}: {error}", path.display()))
        })?;
    }
    if typed.stats {
        screen.aside(table(statistics));
    }
    Ok(())
}

/// Returns the figures as a table for people.
fn table(statistics: &Statistics) -> String {
    let Statistics {
        rays,
        shadow,
        traversal,
        time,
        memory,
        ..
    } = statistics;
    let asked = shadow.queries - shadow.facing_away - shadow.out_of_cone;
    let share = |part: u64| {
        let percent = if asked == 0 {
            0.0
        } else {
            100.0 * part as f64 / asked as f64
        };
        format!("{part:>14}  {percent:5.1} % of those asked")
    };
    let count = |count: u64| format!("{count:>14}");
    let seconds = |seconds: f64| format!("{seconds:>14.3} s");
    let peak = memory.peak_bytes.map_or("unknown".into(), format_bytes);
    let rows = [
        ("frames", count(statistics.frames.into())),
        ("preparations", count(statistics.preparations.into())),
        ("eye rays", count(rays.primary)),
        ("  that hit", count(rays.primary_hits)),
        ("mirrored rays", count(rays.reflection)),
        ("refracted rays", count(rays.refraction)),
        ("all rays, shadow rays too", count(rays.total)),
        ("shadow queries", count(shadow.queries)),
        ("  facing away", count(shadow.facing_away)),
        ("  outside the cone", count(shadow.out_of_cone)),
        ("  by first pass", share(shadow.first_pass)),
        ("  by intermediate", share(shadow.intermediate)),
        ("  by blocker list", share(shadow.blocker_list)),
        ("  by ray", share(shadow.rays)),
        ("  found blocked", share(shadow.shadowed)),
        ("voxels entered", count(traversal.steps)),
        ("surfaces tested", count(traversal.intersections)),
        ("loading", seconds(time.load_s)),
        ("preparing", seconds(time.prepare_s)),
        ("rendering", seconds(time.render_s)),
        (
            "occlusion values",
            format!("{:>14}", format_bytes(memory.occlusion_bytes)),
        ),
        ("memory at most", format!("{peak:>14}")),
    ];
    rows.map(|(name, value)| format!("{name:<26}{value}"))
        .join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered_before_the_ending() {
        assert_eq!(
            numbered(Path::new("a.b/c.png"), 7),
            Path::new("a.b/c-0007.png")
        );
        assert_eq!(numbered(Path::new("plain"), 12), Path::new("plain-0012"));
    }

    #[test]
    fn sizes_from_files_are_kept_in_range() {
        assert_eq!(clamped([0, 1_000_000]), [1, 16_384]);
    }
}
