//! `antumbra sun`: which sensors the sun reaches, at which of a year's times.
//!
//! In: a scene, sensors, suns. Out: a file of bits and what they amount to, perhaps a table of what blocks suns, and lines
//! that say it in short. What is done
//! when it is stopped is kept beside the output, and the next run of the same command goes on there.

mod blockers;
mod file;
mod groups;
mod picture;
mod report;
mod sensors;
mod suns;

use antumbra::IndexOptions;
use antumbra_geometry::DVec3;
use antumbra_render::prepare::Prepared;
use antumbra_scene::gather::{Gathered, scene_bytes, surface_bytes};
use antumbra_sun::{
    About, Blockers, Compass, Diffuse, Dome, Facing, Parts, Questions, Study, StudyError, Suns,
    VERSION, answer, check_energyplus, parts_beside, reinhart, sums,
};

use crate::failure::{Failure, Outcome};
use crate::load::{self, Lighting, LitScene};
use crate::memory::{self, Need};
use crate::outputs::Content;
use crate::screen::Screen;
use crate::typed::{IndexCost, Layout, SceneFile, SunStudy};
use file::StudyFile;
use picture::Looked;
use sensors::Asked;

/// Reinhart's factor of the patches that `--diffuse` counts: 2305 patches.
const DOME_FACTOR: u32 = 4;

/// Reads, asks or takes what was asked, sums, writes.
pub fn run(typed: &SunStudy, screen: &Screen) -> Result<Outcome, Failure> {
    picture::check(typed)?;
    file::check(typed)?;
    suns::check(typed)?;
    let mut output = StudyFile::new(&typed.output)?;
    let files = &mut output.outputs;
    files.add_if("--picture", typed.picture.as_ref(), Content::Picture)?;
    files.add_if("--blockers", typed.blockers.as_ref(), Content::Table)?;
    if let Some(folder) = &typed.report {
        report::prepare(folder, files)?;
    }
    let inputs = [
        &typed.epw,
        &typed.wea,
        &typed.suns,
        &typed.points,
        &typed.normals,
        &typed.from,
    ];
    output.outputs.spare(inputs.into_iter().flatten())?;
    super::on_threads(&typed.threads, || {
        let (study, looked) = match &typed.from {
            Some(path) => (again(typed, path, screen)?, None),
            None => first(typed, &output, screen).map(|(study, looked)| (study, Some(looked)))?,
        };
        let sums = sums(&study);
        match (typed.layout, &looked, &study.surfaces) {
            (Layout::Energyplus, Some(looked), Some(surfaces)) => {
                output.write_energyplus(&study, &groups::by_object(surfaces, looked))?;
            }
            _ => output.write(&study, &sums)?,
        }
        parts_beside(&typed.output).remove();
        let picture = match (&looked, picture::shown(&sums)) {
            (Some(looked), Some(shown)) if picture::is_drawn(typed) => {
                Some(picture::draw(typed, looked, &study, &shown, screen)?)
            }
            _ => None,
        };
        if let (Some(path), Some(picture)) = (&typed.picture, &picture) {
            picture::write(path, picture)?;
        }
        if let Some(folder) = &typed.report {
            report::write(folder, &study, &sums, looked.as_ref(), picture.as_ref())?;
        }
        file::report(&study, &sums, screen);
        Ok(Outcome::Done)
    })?
}

/// Takes the bits of an earlier study; other weather replaces its irradiances.
fn again(typed: &SunStudy, path: &std::path::Path, screen: &Screen) -> Result<Study, Failure> {
    let mut study = antumbra_sun::read_npz(path).map_err(|error| {
        Failure::input(
            error.to_string(),
            "give a file that antumbra sun -o STUDY.npz wrote",
        )
    })?;
    let Some(weather) = suns::weather(typed)? else {
        return Ok(study);
    };
    weather.notes.iter().for_each(|note| screen.warning(note));
    let about = &study.about;
    let found = weather.replace_irradiance(&mut study.suns, about.instant, about.location);
    let found = found.map_err(|error| Failure::input(error.to_string(), ""))?;
    let missing = study.suns.len() - found;
    if found == 0 {
        let message = format!(
            "{}: no row is of a time of the study",
            weather.file.display()
        );
        return Err(Failure::input(message, "give weather of the same times"));
    }
    if missing > 0 {
        screen.warning(format!(
            "{}: {missing} of {} suns have no irradiance: sums count them as 0",
            weather.file.display(),
            study.suns.len()
        ));
    }
    study.about.has_weather = true;
    if let Some(diffuse) = &mut study.about.diffuse {
        diffuse.horizontal = suns::diffuse_horizontal(&weather, diffuse.dates, screen);
    }
    Ok(study)
}

/// Asks about a scene.
fn first(
    typed: &SunStudy,
    output: &StudyFile,
    screen: &Screen,
) -> Result<(Study, Looked), Failure> {
    let (suns, source) = suns::suns(typed, screen)?;
    if typed.layout == Layout::Energyplus {
        check_energyplus(&suns.list, typed.instant.instant()).map_err(|error| {
            Failure::input(
                error.to_string(),
                "leave --layout out, or give --year, --epw or --wea",
            )
        })?;
    }
    let asked = Asked::open(typed)?;
    let LitScene { mut scene, up, .. } = scene(typed, output, screen)?;
    // None of them plays a part.
    scene.lights.clear();
    let limit = memory::limit(typed.memory_limit);
    let size = match picture::is_drawn(typed) {
        true => Some(picture::size(typed, &scene)?),
        false => None,
    };
    let mut need = Need {
        scene: scene_bytes(&scene),
        surfaces: surface_bytes(&scene),
        picture: size.map_or(0, |size| picture::predict_bytes(size, 0)),
        ..Need::default()
    };
    need.check(limit)?;
    let gathered = Gathered::of(&scene)?;
    let mut options = IndexOptions::default();
    let predicted = options.predict(gathered.occluders(), 0, None)?;
    need.set_index(gathered.memory_bytes(), predicted);
    need.check(limit)?;
    options.memory_limit = need.left_for_index(limit);
    let prepared = Prepared::of_gathered(scene, gathered, &options)?;
    let index = prepared.index();

    let left = limit.saturating_sub(need.needed());
    let light = typed.light();
    let bytes_of_one = sensors::bytes_of_one(suns.list.len(), light.has_shares());
    let most = (left / bytes_of_one) as usize;
    let sensors = asked.sensors(typed, &prepared, up.direction, most, screen)?;
    if let Some(size) = size {
        need.picture = picture::predict_bytes(size, sensors.count());
    }
    need.arrays = sensors.count() as u64 * bytes_of_one;
    need.check(limit)?;
    screen.detail(format!("memory predicted: {need}"));
    if typed.diffuse && sensors.facing == Facing::All {
        return Err(Failure::input(
            "--diffuse: sensors that see all directions have no normal, and no sky view factor",
            "give --normals or --on-surface",
        ));
    }
    if typed.through_glass && !index.has_glass() {
        screen.note("--through-glass: no surface of the scene lets light through");
    }

    let compass = Compass {
        up: up.direction,
        north: typed.north,
    };
    up.say("the sun", screen);
    let directions: Vec<DVec3> = suns.list.iter().map(|sun| compass.towards(sun)).collect();
    let parts = parts_beside(&typed.output);
    let stop = SaidAtStop {
        parts: &parts,
        screen,
    };
    let dome = typed.diffuse.then(|| {
        let patches = reinhart(DOME_FACTOR).list;
        Dome::new(&patches, up.direction, |patch| compass.towards(patch))
    });
    let questions = Questions {
        directions: &directions,
        light,
        dome: dome.as_ref(),
    };
    let answered = answer(index, &sensors, &questions, Some(&parts)).map_err(unanswered)?;
    if let Some(path) = &typed.blockers {
        let of = Blockers {
            index,
            sensors: &sensors,
            suns: &suns.list,
            directions: &directions,
            bits: &answered.bits,
            has_weather: suns.has_weather,
        };
        blockers::write(path, &of, &prepared)?;
    }
    drop(stop);
    if answered.sampled > 0 {
        screen.note(format!(
            "{} visible shares of the sun are of 64 samples each, for want of a closed form",
            answered.sampled
        ));
    }
    let [resumed, count] = answered.resumed;
    if resumed > 0 {
        screen.note(format!(
            "{resumed} of {count} sensors were answered by a run that was stopped"
        ));
    }
    let Suns {
        kind,
        list,
        below_horizon,
        has_weather,
        mut notes,
    } = suns;
    notes.extend_from_slice(&sensors.notes);
    let study = Study {
        about: About {
            antumbra_sun: VERSION,
            kind,
            source: source.name,
            location: source.location,
            refraction: source.refraction,
            instant: typed.instant.instant(),
            north: typed.north,
            up: up.direction.to_array(),
            below_horizon,
            has_weather,
            sun_diameter: light.sun_diameter,
            through_glass: light.through_glass,
            diffuse: source.diffuse_horizontal.map(|horizontal| Diffuse {
                sky: format!("reinhart:{DOME_FACTOR}"),
                horizontal,
                dates: typed.dates,
            }),
        },
        normals: sensors.normals(index.occluders()),
        points: sensors.points,
        surfaces: sensors.surfaces,
        areas: sensors.areas,
        directions: directions.iter().map(|to| to.to_array()).collect(),
        suns: list,
        bits: answered.bits,
        shares: answered.shares,
        sky_view_factor: answered.sky_view_factor,
    };
    let looked = Looked {
        prepared,
        up,
        notes,
    };
    Ok((study, looked))
}

/// Says at a stop what is kept: a stopped task unwinds.
struct SaidAtStop<'a> {
    parts: &'a Parts,
    screen: &'a Screen,
}

impl Drop for SaidAtStop<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() && self.parts.folder.is_dir() {
            self.screen.note(format!(
                "what is done is kept in {}: the same command goes on there",
                self.parts.folder.display()
            ));
        }
    }
}

/// Reads the scene.
fn scene(typed: &SunStudy, output: &StudyFile, screen: &Screen) -> Result<LitScene, Failure> {
    let file = SceneFile {
        scene: typed.scene.clone().unwrap_or_default(),
        up: typed.up,
        tessellate: typed.tessellate,
        lights: Vec::new(),
        sun: None,
        background: None,
    };
    let cost = IndexCost {
        grid: None,
        memory_limit: typed.memory_limit,
        resolution: None,
        lists: None,
        refine: None,
        occlusion_memory: None,
    };
    load::any_lit_scene(
        &file,
        None,
        Lighting::Unneeded,
        &cost,
        &output.outputs,
        screen,
    )
}

/// Returns why a study has no answers.
fn unanswered(error: StudyError) -> Failure {
    match error {
        StudyError::Part(_) => Failure::system(error.to_string()),
        _ => Failure::input(error.to_string(), ""),
    }
}
