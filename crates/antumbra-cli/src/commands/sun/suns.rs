//! Suns of a study, from whatever was typed.

use std::path::Path;

use antumbra_sun::{
    Dates, Location, Positions, Refraction, Suns, Weather, read_epw, read_suns, read_wea, reinhart,
    tregenza,
};

use crate::failure::Failure;
use crate::screen::Screen;
use crate::typed::{Sky, SunStudy};

/// Where suns come from.
pub(super) struct Source {
    /// In words, for the file.
    pub(super) name: String,
    pub(super) location: Option<Location>,
    pub(super) refraction: Option<Refraction>,
    /// Diffuse horizontal irradiation of all days that count, kWh/m2, if it is asked for.
    pub(super) diffuse_horizontal: Option<f64>,
}

/// Reads or works out the suns. Says what a user should hear of them.
pub(super) fn suns(typed: &SunStudy, screen: &Screen) -> Result<(Suns, Source), Failure> {
    let input = |message: String| Failure::input(message, "");
    let refraction = typed.refraction.then_some(Refraction {
        pressure: typed.pressure,
        temperature: typed.temperature,
    });
    let instant = typed.instant.instant();
    let mut source = Source {
        name: String::new(),
        location: None,
        refraction,
        diffuse_horizontal: None,
    };
    let suns = if let Some(weather) = weather(typed)? {
        source.name = name(&weather.file);
        source.location = Some(weather.location);
        source.diffuse_horizontal = typed
            .diffuse
            .then(|| diffuse_horizontal(&weather, typed.dates, screen));
        let suns = weather.suns(typed.year, refraction, instant, typed.dates);
        suns.map_err(|error| input(error.to_string()))?
    } else if let Some(path) = &typed.suns {
        source.name = name(path);
        read_suns(path, typed.step).map_err(|error| input(error.to_string()))?
    } else if let Some(sky) = typed.sky {
        let (name, suns) = match sky {
            Sky::Tregenza => ("tregenza".to_owned(), tregenza()),
            Sky::Reinhart(factor) => (format!("reinhart:{factor}"), reinhart(factor)),
        };
        source.name = name;
        suns
    } else if let (Some(latitude), Some(longitude), Some(timezone), Some(year)) =
        (typed.latitude, typed.longitude, typed.timezone, typed.year)
    {
        let location = Location::new(latitude, longitude, typed.altitude, timezone);
        let location = location.map_err(|error| input(error.to_string()))?;
        source.name = format!("{year}, every {} minutes", typed.step);
        source.location = Some(location);
        let positions = Positions::new(location, refraction);
        let suns = positions.and_then(|at| at.year(year, typed.step, instant, typed.dates));
        let mut suns = suns.map_err(|error| input(error.to_string()))?;
        suns.notes.extend(location.doubt());
        suns
    } else {
        return Err(Failure::input(
            "no suns are given",
            "give --latitude, --longitude, --timezone and --year, or --epw, --wea, --suns or --sky",
        ));
    };
    suns.notes.iter().for_each(|note| screen.warning(note));
    if suns.list.is_empty() {
        let message = match suns.below_horizon {
            0 => format!("{}: there are no suns", source.name),
            count => format!(
                "{}: no sun stands above the horizon at any of {count} times{}",
                source.name,
                match source.location {
                    Some(location) => format!(", at latitude {}", location.latitude),
                    None => String::new(),
                }
            ),
        };
        return Err(Failure::input(
            message,
            "choose other days or another place",
        ));
    }
    Ok((suns, source))
}

/// Returns the diffuse horizontal irradiation of some days, kWh/m2. Says how many rows miss it.
pub(super) fn diffuse_horizontal(weather: &Weather, dates: Option<Dates>, screen: &Screen) -> f64 {
    let (sum, missing) = weather.diffuse_horizontal(dates);
    if missing > 0 {
        screen.warning(format!(
            "{}: {missing} rows have no diffuse horizontal irradiance: sums count them as 0",
            weather.file.display()
        ));
    }
    sum
}

/// Refuses light of the sky where no weather says how bright it is.
pub(super) fn check(typed: &SunStudy) -> Result<(), Failure> {
    if typed.diffuse && typed.epw.is_none() && typed.wea.is_none() {
        return Err(Failure::input(
            "--diffuse: no weather is given that says how bright the sky is",
            "give --epw or --wea",
        ));
    }
    Ok(())
}

/// Reads the weather that was typed.
pub(super) fn weather(typed: &SunStudy) -> Result<Option<Weather>, Failure> {
    let weather = match (&typed.epw, &typed.wea) {
        (Some(path), _) => read_epw(path),
        (None, Some(path)) => read_wea(path),
        (None, None) => return Ok(None),
    };
    weather
        .map(Some)
        .map_err(|error| Failure::input(error.to_string(), ""))
}

/// Returns a file's name without its folder: results do not depend on where inputs lie.
fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
