//! The file of a study, by its ending, and the lines that say in short what is in it.

use std::path::{Path, PathBuf};

use antumbra_sun::{
    Groups, Study, Sums, SunKind, check_zarr, write_csv, write_energyplus, write_netcdf, write_npz,
    write_zarr,
};

use crate::failure::Failure;
use crate::outputs::{self, Content, Outputs};
use crate::screen::Screen;
use crate::typed::{Layout, SunStudy};

/// The file that a study is written to.
pub(super) struct StudyFile {
    path: PathBuf,
    pub(super) outputs: Outputs,
}

impl StudyFile {
    /// Checks that it can be written, before anything is computed.
    pub(super) fn new(path: &Path) -> Result<Self, Failure> {
        let mut outputs = Outputs::none();
        // A folder is no output of any other command.
        match ending(path).as_str() {
            "zarr" => check_zarr(path).map_err(|error| refused(path, error))?,
            _ => outputs.add("--output", path, Content::Study)?,
        }
        Ok(Self {
            path: path.to_path_buf(),
            outputs,
        })
    }

    /// Writes the shares of groups that are sunlit, for EnergyPlus.
    pub(super) fn write_energyplus(&self, study: &Study, groups: &Groups) -> Result<(), Failure> {
        self.written(write_energyplus(&self.path, study, groups))
    }

    /// Writes a study.
    pub(super) fn write(&self, study: &Study, sums: &Sums) -> Result<(), Failure> {
        let path = &self.path;
        let written = match ending(path).as_str() {
            "csv" => write_csv(path, study, sums),
            "nc" => write_netcdf(path, study, sums),
            "zarr" => write_zarr(path, study, sums),
            _ => write_npz(path, study, sums),
        };
        self.written(written)
    }

    fn written(&self, written: std::io::Result<()>) -> Result<(), Failure> {
        let path = &self.path;
        written.map_err(|error| match error.kind() {
            std::io::ErrorKind::InvalidInput => refused(path, error),
            _ => outputs::unwritable(path, error),
        })
    }
}

/// Refuses a layout that the file or the sensors cannot have.
pub(super) fn check(typed: &SunStudy) -> Result<(), Failure> {
    if typed.layout == Layout::Sensors {
        return Ok(());
    }
    if ending(&typed.output) != "csv" {
        let message = format!("{}: --layout is about CSV files", typed.output.display());
        return Err(Failure::input(
            message,
            "give --output a name that ends in .csv",
        ));
    }
    if typed.points.is_some() && !typed.on_surface {
        return Err(Failure::input(
            "--layout energyplus: points of space lie on no object",
            "give --on-surface, or --sensors grid:SPACING",
        ));
    }
    Ok(())
}

fn refused(path: &Path, error: std::io::Error) -> Failure {
    let message = format!("cannot write {}: {error}", path.display());
    Failure::input(message, "give another name")
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_ascii_lowercase()
}

/// Prints what a study amounts to.
pub(super) fn report(study: &Study, sums: &Sums, screen: &Screen) {
    let about = &study.about;
    let (count, suns) = (study.sensor_count(), study.suns.len());
    let areas = study.areas.as_deref();
    let (kind, below) = match about.kind {
        SunKind::Suns => (
            "suns",
            format!(" ({} below the horizon left out)", about.below_horizon),
        ),
        SunKind::Sky => ("patches of the sky", String::new()),
    };
    screen.result(format!("{count} sensors, {suns} {kind}{below}"));
    let weight = match areas {
        Some(_) => "mean by area",
        None => "mean",
    };
    let line = |list: &Option<Vec<f64>>, unit: &str| {
        if let Some(list) = list {
            let [low, mean, high] = spread(list, areas);
            screen.result(format!(
                "{unit}: {weight} {mean:.3}, from {low:.3} to {high:.3}"
            ));
        }
    };
    line(&sums.hours, "hours of sun");
    line(&sums.irradiation, "direct irradiation, kWh/m2");
    line(&sums.diffuse, "diffuse irradiation, kWh/m2");
    line(&sums.sky_view_factor, "sky view factor");
    line(&sums.sky_visible, "visible share of the sky");
    let air = match about.refraction {
        Some(_) => "with refraction",
        None => "geometric, without refraction",
    };
    if about.location.is_some() {
        screen.detail(format!("positions: SPA, {air}; times: local standard time"));
    }
}

/// Returns the least number, the mean, weighted by areas if there are some, and the greatest.
fn spread(list: &[f64], areas: Option<&[f64]>) -> [f64; 3] {
    let low = list.iter().copied().fold(f64::INFINITY, f64::min);
    let high = list.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let area = |sensor: usize| areas.map_or(1.0, |areas| areas[sensor]);
    let whole: f64 = (0..list.len()).map(area).sum();
    let sum: f64 = list
        .iter()
        .enumerate()
        .map(|(sensor, x)| x * area(sensor))
        .sum();
    [low, sum / whole, high]
}
