//! Arguments of `antumbra sun`.

use std::path::PathBuf;

use antumbra_sun::{Dates, Instant, LARGEST_SUN, Light, MOST_FACTOR};
use clap::{Args, ValueEnum};

use super::Threads;
use crate::methods::Up;
use crate::values::{self, CameraParts};

#[derive(Args, Debug)]
#[command(group(clap::ArgGroup::new("drawn").multiple(true)))]
pub struct SunStudy {
    /// Scene file; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    #[arg(help_heading = "Scene", required_unless_present = "from")]
    pub scene: Option<PathBuf>,

    /// Axis that points up [default: that of the format]
    #[arg(long, help_heading = "Scene", value_name = "AXIS")]
    pub up: Option<Up>,

    /// Direction of true north: degrees from the scene's own north clockwise, seen from above. The scene's own north is +y
    /// with z up, -z with y up
    #[arg(long, help_heading = "Scene", value_name = "DEGREES", default_value_t = 0.0, value_parser = north, allow_hyphen_values = true)]
    pub north: f64,

    /// Curved shapes as meshes: twice N sides around, N cells along a patch (rounded up to a power of two) or a box of an
    /// implicit surface
    #[arg(long, help_heading = "Scene", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub tessellate: Option<u32>,

    /// Sensors on faces: grid:SPACING puts one in the middle of each square cell of that side, in the scene's unit, and at
    /// least one on each face. They lie on the face itself, without offset
    #[arg(long, help_heading = "Sensors", value_name = "grid:SPACING", value_parser = grid_spacing, conflicts_with_all = ["points", "normals", "on_surface", "from"])]
    pub sensors: Option<f64>,

    /// Name of an object or a material whose faces have sensors; repeatable [default: all faces]
    #[arg(
        long,
        help_heading = "Sensors",
        value_name = "NAME",
        requires = "sensors"
    )]
    pub on: Vec<String>,

    /// Give each cell a second sensor on the back of its face
    #[arg(long, help_heading = "Sensors", requires = "sensors")]
    pub both_sides: bool,

    /// Sensors in world space: a NumPy array, float32 or float64, shape (n, 3), or a CSV file with columns x, y, z and
    /// perhaps nx, ny, nz
    #[arg(
        long,
        help_heading = "Sensors",
        value_name = "P.npy|P.csv",
        conflicts_with = "from"
    )]
    pub points: Option<PathBuf>,

    /// Normals of --points, any length: suns behind a sensor do not reach it, and the cosine counts in sums. Without, sensors
    /// see all directions
    #[arg(
        long,
        help_heading = "Sensors",
        value_name = "N.npy",
        requires = "points"
    )]
    pub normals: Option<PathBuf>,

    /// Take each of --points as lying on its nearest surface, up to rounding. Without normals, sensors face the way of
    /// that surface's front
    #[arg(long, help_heading = "Sensors", requires = "points")]
    pub on_surface: bool,

    /// How far one of --points may lie from its surface, in the scene's unit; inf for any distance [default: what rounding may
    /// have moved it]
    #[arg(long, help_heading = "Sensors", value_name = "DISTANCE", requires = "on_surface", value_parser = values::distance, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,

    /// Latitude in degrees, north positive: solar positions by the Solar Position Algorithm (SPA)
    #[arg(long, help_heading = "Suns", value_name = "DEGREES", value_parser = values::number, allow_hyphen_values = true, requires_all = ["longitude", "timezone", "year"], conflicts_with_all = ["epw", "wea", "suns", "sky", "from"])]
    pub latitude: Option<f64>,

    /// Longitude in degrees, east positive
    #[arg(long, help_heading = "Suns", value_name = "DEGREES", value_parser = values::number, allow_hyphen_values = true, requires = "latitude")]
    pub longitude: Option<f64>,

    /// Height above the sea in meters
    #[arg(long, help_heading = "Suns", value_name = "METERS", value_parser = values::number, default_value_t = 0.0, allow_hyphen_values = true, requires = "latitude")]
    pub altitude: f64,

    /// Hours that the clock is ahead of UTC, such as 1 or 5.5, the same all year: no daylight saving
    #[arg(long, help_heading = "Suns", value_name = "HOURS", value_parser = values::number, allow_hyphen_values = true, requires = "latitude")]
    pub timezone: Option<f64>,

    /// Year of the suns; with --epw and --wea it replaces those of the file [default: those of the file]
    #[arg(long, help_heading = "Suns", value_name = "YEAR", value_parser = clap::value_parser!(i32).range(1..=2999), conflicts_with_all = ["suns", "sky", "from"])]
    pub year: Option<i32>,

    /// Minutes from sun to sun, a divisor of 1440; with --suns what each stands for where the file has no hours
    #[arg(long, help_heading = "Suns", value_name = "MINUTES", default_value_t = 60, conflicts_with_all = ["epw", "wea", "sky", "from"], value_parser = clap::value_parser!(u32).range(1..=1440))]
    pub step: u32,

    /// Moment of each step that its sun is taken at
    #[arg(
        long,
        help_heading = "Suns",
        value_name = "MOMENT",
        value_enum,
        default_value_t,
        conflicts_with_all = ["suns", "sky", "from"]
    )]
    pub instant: Moment,

    /// Days of the year that count: MM-DD or MM-DD..MM-DD, which may run over the end of the year [default: all]
    #[arg(long, help_heading = "Suns", value_name = "DAYS", value_parser = Dates::parse, conflicts_with_all = ["suns", "sky", "from"])]
    pub dates: Option<Dates>,

    /// Weather file of EnergyPlus: place, times, and direct normal irradiance for sums in kWh/m2
    #[arg(long, help_heading = "Suns", value_name = "FILE.epw", conflicts_with_all = ["wea", "suns", "sky"])]
    pub epw: Option<PathBuf>,

    /// Weather file of daylight tools, as --epw
    #[arg(long, help_heading = "Suns", value_name = "FILE.wea", conflicts_with_all = ["suns", "sky"])]
    pub wea: Option<PathBuf>,

    /// List of suns: columns azimuth and elevation in degrees, and perhaps time, hours and weight (direct normal irradiance in
    /// W/m2)
    #[arg(long, help_heading = "Suns", value_name = "FILE.csv", conflicts_with_all = ["sky", "from"])]
    pub suns: Option<PathBuf>,

    /// Patches of the sky in place of suns, for sky view factors: tregenza (145 patches), or reinhart:N (144 N^2 and one; 2305
    /// for 4)
    #[arg(long, help_heading = "Suns", value_name = "SKY", value_parser = sky, conflicts_with = "from")]
    pub sky: Option<Sky>,

    /// Bend light by the air: positions are apparent ones. Without, they are geometric
    #[arg(long, help_heading = "Suns", conflicts_with_all = ["suns", "sky", "from"])]
    pub refraction: bool,

    /// Pressure of the air in hPa
    #[arg(long, help_heading = "Suns", value_name = "HPA", value_parser = values::number, default_value_t = 1013.25, requires = "refraction")]
    pub pressure: f64,

    /// Temperature of the air in degrees Celsius
    #[arg(long, help_heading = "Suns", value_name = "DEGREES", value_parser = values::number, default_value_t = 12.0, requires = "refraction", allow_hyphen_values = true)]
    pub temperature: f64,

    /// Angular diameter of the sun in degrees, 0.533 for the real one, at most 10: hours and irradiation count the visible
    /// share of its disc. Takes some microseconds for each sensor and sun
    #[arg(long, help_heading = "Light", value_name = "DEGREES", value_parser = sun_diameter, allow_hyphen_values = true, conflicts_with_all = ["sky", "from"])]
    pub sun_diameter: Option<f64>,

    /// Count what see-through surfaces let through, in place of all of it
    #[arg(long, help_heading = "Light", conflicts_with = "from")]
    pub through_glass: bool,

    /// Add the light of an isotropic sky to irradiation: diffuse horizontal irradiance of --epw or --wea times the sky view factor
    /// of each sensor. The ground reflects nothing
    #[arg(long, help_heading = "Light", conflicts_with_all = ["suns", "sky", "from"])]
    pub diffuse: bool,

    /// Study to take in place of a scene: its bits are not asked again. With --epw or --wea, sums are those of that weather,
    /// row by row of the same day and time
    #[arg(long, help_heading = "Suns", value_name = "STUDY.npz", conflicts_with_all = ["scene", "up", "north", "tessellate"])]
    pub from: Option<PathBuf>,

    /// File to write; its ending says the format: .npz, .zarr or .nc with all bits, or .csv with a row for each sensor
    #[arg(long, short, help_heading = "Output", value_name = "FILE")]
    pub output: PathBuf,

    /// Table of what blocks the suns: hours, and kWh/m2 with weather, that each object takes from each sensor as the first in
    /// the way
    #[arg(long, help_heading = "Output", value_name = "FILE.csv", conflicts_with_all = ["sky", "from"])]
    pub blockers: Option<PathBuf>,

    /// Layout of a CSV file
    #[arg(
        long,
        help_heading = "Output",
        value_name = "LAYOUT",
        value_enum,
        default_value_t,
        conflicts_with = "from"
    )]
    pub layout: Layout,

    /// Picture of the scene in the colors of its hours of sun; of irradiation with weather, and of the visible share of
    /// the sky with --sky. Faces without sensors are grey
    #[arg(
        long,
        help_heading = "Output",
        value_name = "FILE.png",
        group = "drawn",
        conflicts_with = "from"
    )]
    pub picture: Option<PathBuf>,

    /// Folder for a page about the study, index.html: picture, distribution, totals by object or material, the course of a
    /// day, settings. It needs no other file and no network
    #[arg(long, help_heading = "Output", value_name = "DIR", group = "drawn")]
    pub report: Option<PathBuf>,

    /// Picture size in pixels, legend included [default: the file's, else 800x600]
    #[arg(help_heading = "Output", long, value_name = "WxH", value_parser = values::size, requires = "drawn")]
    pub size: Option<[u32; 2]>,

    /// Camera: eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES. Parts left out come from the file's camera; without one, up is
    /// the scene's and fov 45 [default: the file's, else one that frames the scene]
    #[arg(help_heading = "Output", long, value_name = "PARTS", value_parser = values::camera, allow_hyphen_values = true, requires = "drawn")]
    pub camera: Option<CameraParts>,

    /// Memory limit, such as 2GiB; work that is predicted to need more is refused [default: three
    /// quarters of the machine's]
    #[arg(long, help_heading = "Memory", value_name = "SIZE", value_parser = values::bytes)]
    pub memory_limit: Option<u64>,

    #[command(flatten)]
    pub threads: Threads,
}

impl SunStudy {
    /// Returns how much of a sun counts.
    pub fn light(&self) -> Light {
        Light {
            sun_diameter: self.sun_diameter,
            through_glass: self.through_glass,
        }
    }
}

/// Subdivision of the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sky {
    Tregenza,
    Reinhart(u32),
}

/// Layout of a CSV file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// A row for each sensor, with what its bits amount to
    #[default]
    Sensors,
    /// A row for each step of a year, a column for each object with the share of its area that is sunlit, as EnergyPlus
    /// imports it
    Energyplus,
}

/// Moment of a step of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Moment {
    /// Its begin
    Start,
    /// Its middle
    #[default]
    Middle,
    /// Its end
    End,
}

impl Moment {
    /// Returns the moment as studies have it.
    pub fn instant(self) -> Instant {
        match self {
            Self::Start => Instant::Start,
            Self::Middle => Instant::Middle,
            Self::End => Instant::End,
        }
    }
}

/// Reads `grid:SPACING`.
fn grid_spacing(text: &str) -> Result<f64, String> {
    let spacing = text.strip_prefix("grid:").map(values::number);
    match spacing {
        Some(Ok(spacing)) if spacing > 0.0 => Ok(spacing),
        _ => Err(format!(
            "expected grid:SPACING with a number above 0, such as grid:0.5, found `{text}`"
        )),
    }
}

/// Reads `tregenza` or `reinhart:N`.
fn sky(text: &str) -> Result<Sky, String> {
    let factor = text.strip_prefix("reinhart:").and_then(|n| n.parse().ok());
    match (text, factor) {
        ("tregenza", _) => Ok(Sky::Tregenza),
        (_, Some(factor)) if (1..=MOST_FACTOR).contains(&factor) => Ok(Sky::Reinhart(factor)),
        _ => Err(format!(
            "expected tregenza or reinhart:N with N from 1 to {MOST_FACTOR}, found `{text}`"
        )),
    }
}

/// Reads the diameter of the sun.
fn sun_diameter(text: &str) -> Result<f64, String> {
    match values::number(text) {
        Ok(degrees) if degrees > 0.0 && degrees <= LARGEST_SUN => Ok(degrees),
        _ => Err(format!(
            "expected degrees above 0 and at most {LARGEST_SUN}, such as 0.533, found `{text}`"
        )),
    }
}

/// Reads an angle of the compass.
fn north(text: &str) -> Result<f64, String> {
    let degrees = values::number(text)?;
    match degrees.abs() <= 360.0 {
        true => Ok(degrees),
        false => Err(format!("expected -360 to 360 degrees, found `{text}`")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suns_have_up_to_ten_degrees() {
        assert_eq!(sun_diameter("0.533"), Ok(0.533));
        assert_eq!(sun_diameter("10"), Ok(10.0));
        for bad in ["", "0", "-1", "10.1", "nan", "inf", "wide"] {
            let error = sun_diameter(bad).unwrap_err();
            assert!(error.contains("expected degrees above 0"), "{bad}: {error}");
        }
    }

    #[test]
    fn grids_and_skies() {
        assert_eq!(grid_spacing("grid:0.5"), Ok(0.5));
        for bad in ["0.5", "grid:", "grid:0", "grid:-1", "grid:nan", "grid:x"] {
            assert!(
                grid_spacing(bad)
                    .unwrap_err()
                    .contains("expected grid:SPACING"),
                "{bad}"
            );
        }
        assert_eq!(sky("tregenza"), Ok(Sky::Tregenza));
        assert_eq!(sky("reinhart:4"), Ok(Sky::Reinhart(4)));
        for bad in [
            "",
            "reinhart",
            "reinhart:0",
            "reinhart:17",
            "reinhart:-1",
            "cie",
        ] {
            assert!(
                sky(bad).unwrap_err().contains("expected tregenza or"),
                "{bad}"
            );
        }
    }
}
