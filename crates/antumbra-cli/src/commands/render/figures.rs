//! Figures of a run, as they are reported.

use std::time::Duration;

use antumbra_render::integrator::Tally;
use antumbra_render::prepare::Prepared;
use antumbra_render::statistics::{
    BumpCounts, FogCounts, LightSampleCounts, MemoryUse, Rays, SCHEMA, Settings, ShadowQueries,
    Statistics, Times, Traversal, Verdict,
};

use super::files::Format;
use super::meant::Meant;
use crate::failure::Failure;
use crate::machine;
use crate::outputs;
use crate::screen::Screen;
use crate::typed::{Render, Shadows, Whether};
use crate::values::{Exposure, format_bytes};

/// What happened so far.
pub(super) struct Run {
    pub(super) tally: Tally,
    pub(super) frame_count: u32,
    /// Whether the last frame is.
    pub(super) is_complete: bool,
    /// What the first frame was brightened by.
    pub(super) exposure_in_stops: Option<f64>,
    pub(super) predicted_bytes: u64,
    pub(super) load_time: Duration,
    pub(super) prepare_time: Duration,
    pub(super) render_time: Duration,
}

impl Run {
    pub(super) fn statistics(
        &self,
        typed: &Render,
        meant: &Meant,
        prepared: &Prepared,
    ) -> Statistics {
        Statistics {
            schema: SCHEMA,
            scene: typed.file.scene.display().to_string(),
            frames: self.frame_count,
            preparations: 1,
            is_complete: self.is_complete && self.frame_count as usize == meant.frames.len(),
            settings: self.settings(typed, meant, prepared),
            rays: Rays::from(&self.tally),
            shadow: ShadowQueries::from(&self.tally),
            light_samples: LightSampleCounts::from(&self.tally),
            bumps: (typed.bumps == Whether::On && prepared.has_reliefs())
                .then(|| BumpCounts::from(&self.tally)),
            fog: typed.fog.map(|_| FogCounts::from(&self.tally)),
            traversal: Traversal::from(&self.tally),
            time: Times {
                load_s: self.load_time.as_secs_f64(),
                prepare_s: self.prepare_time.as_secs_f64(),
                render_s: self.render_time.as_secs_f64(),
            },
            memory: MemoryUse {
                occlusion_bytes: prepared.index().occlusion_bytes(),
                bytes_per_light: prepared.bytes_per_light(),
                knowledge_bytes: prepared.index().knowledge_bytes(),
                evictions: prepared.index().evictions(),
                lights_without_room: prepared.index().lights_without_room(),
                predicted_bytes: self.predicted_bytes,
                peak_bytes: machine::peak_bytes(),
            },
            quick_check: prepared.index().quick_check().map(Verdict::from),
        }
    }

    fn settings(&self, typed: &Render, meant: &Meant, prepared: &Prepared) -> Settings {
        let exposure = match (meant.format, meant.exposure) {
            (Format::Exr, _) => "none",
            (Format::Png, Exposure::Auto) => "auto",
            (Format::Png, Exposure::Stops(_)) => "fixed",
        };
        Settings {
            shadows: typed.shadows.name().to_owned(),
            is_exact: true,
            shadows_used: used(prepared).to_owned(),
            rays: typed.rays.name().to_owned(),
            grid: prepared.index().grid_resolution(),
            size: meant.size,
            spp: typed.spp,
            light_samples: typed.more_lights.soft.samples(),
            exact_fractions: typed.more_lights.soft.is_exact(),
            colored_shadows: typed.shadows_through_glass == Whether::On,
            bumps: typed.bumps == Whether::On,
            fog: typed
                .fog
                .map(|fog| [fog.extinction(), fog.albedo(), fog.g()]),
            corner_rays: typed.corner_rays,
            max_depth: typed.max_depth,
            seed: typed.seed,
            threads: rayon::current_num_threads(),
            show: typed.show.name().to_owned(),
            exposure: exposure.to_owned(),
            exposure_stops: self.exposure_in_stops.unwrap_or(0.0),
            aovs: meant.layer_names(),
        }
    }
}

/// Returns who answered.
fn used(prepared: &Prepared) -> &'static str {
    Shadows::of(prepared.index().method()).name()
}

/// Reports the figures to whom they were promised.
pub(super) fn report(
    typed: &Render,
    statistics: &Statistics,
    screen: &Screen,
) -> Result<(), Failure> {
    if let Some(path) = &typed.stats_json {
        outputs::write_json(path, statistics)?;
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
        light_samples,
        bumps,
        fog,
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
    let of_bumps = bumps.map(|bumps| {
        let share = |part: u64| {
            let percent = 100.0 * part as f64 / bumps.queries.max(1) as f64;
            format!("{part:>14}  {percent:5.1} % of those on bumps")
        };
        [
            ("queries on bumps", count(bumps.queries)),
            ("  known to be lit", share(bumps.known_lit)),
            ("  known to be in shadow", share(bumps.known_shadowed)),
            ("  by perturbed test", share(bumps.perturbed)),
        ]
    });
    let of_fog = fog.map(|fog| {
        [
            ("segments in fog, lights", count(fog.segments)),
            ("  by points between", count(fog.by_parts)),
            ("  lit intervals", count(fog.intervals)),
        ]
    });
    let rows = [
        ("frames", count(statistics.frames.into())),
        ("preparations", count(statistics.preparations.into())),
        ("eye rays", count(rays.primary)),
        ("  that hit", count(rays.primary_hits)),
        ("mirrored rays", count(rays.reflection)),
        ("refracted rays", count(rays.refraction)),
        ("rays gone on straight", count(rays.passed)),
        ("all rays, shadow rays too", count(rays.total)),
        ("shadow queries", count(shadow.queries)),
        ("  facing away", count(shadow.facing_away)),
        ("  outside the cone", count(shadow.out_of_cone)),
        ("  by first pass", share(shadow.first_pass)),
        ("  by intermediate", share(shadow.intermediate)),
        ("  by blocker list", share(shadow.blocker_list)),
        ("  by ray", share(shadow.rays)),
        ("  found blocked", share(shadow.shadowed)),
        ("points and large lights", count(light_samples.points)),
        ("  facing away", count(light_samples.facing_away)),
        ("  in umbra", count(light_samples.umbra)),
        ("  in penumbra", count(light_samples.penumbra)),
        ("  wholly lit", count(light_samples.lit)),
        ("  by exact fraction", count(light_samples.exact)),
        ("  samples asked", count(light_samples.asked)),
        ("  found blocked", count(light_samples.blocked)),
        ("voxels, nodes entered", count(traversal.steps)),
        ("surfaces tested", count(traversal.intersections)),
        (
            "exposure",
            format!("{:>14.2} stops", statistics.settings.exposure_stops),
        ),
        ("loading", seconds(time.load_s)),
        ("preparing", seconds(time.prepare_s)),
        ("rendering", seconds(time.render_s)),
        (
            "occlusion values",
            format!("{:>14}", format_bytes(memory.occlusion_bytes)),
        ),
        (
            "kept for each light",
            format!("{:>14}", format_bytes(memory.bytes_per_light as u64)),
        ),
        (
            "known, all lights",
            format!("{:>14}", format_bytes(memory.knowledge_bytes)),
        ),
        ("dropped for room", count(memory.evictions)),
        (
            "lights without room",
            count(memory.lights_without_room as u64),
        ),
        (
            "memory predicted",
            format!("{:>14}", format_bytes(memory.predicted_bytes)),
        ),
        ("memory at most", format!("{peak:>14}")),
    ];
    let rows = rows.into_iter().chain(of_bumps.into_iter().flatten());
    let rows = rows.chain(of_fog.into_iter().flatten());
    let rows: Vec<_> = rows
        .map(|(name, value)| format!("{name:<26}{value}"))
        .collect();
    rows.join("\n")
}
