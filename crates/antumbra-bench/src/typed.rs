//! What was typed after `antumbra-bench`.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use serde::Serialize;

use antumbra_cli::commands::on_threads;
use antumbra_cli::failure::Failure;
use antumbra_cli::light_values::LightValue;
use antumbra_cli::methods::Shadows as Ours;
use antumbra_cli::outputs::{Content, Outputs, write_json};
use antumbra_cli::typed::{
    self as cli, EXIT_CODES, HELP_WIDTH, IndexCost, SUN_HELP, SceneFile, Threads, Up, Verbosity,
    saving_methods,
};
use antumbra_cli::values::{self, CameraParts, PointLight, Sun};

use super::contender::Contender;
use super::record::Aim;

/// Measure antumbra against Embree, and against the rivals of the paper's time.
#[derive(Debug, Parser)]
#[command(name = "antumbra-bench", version, after_help = EXIT_CODES, max_term_width = HELP_WIDTH)]
pub(crate) struct Bench {
    #[command(flatten)]
    pub(crate) verbosity: Verbosity,

    #[command(subcommand)]
    pub(crate) what: What,
}

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Time recorded shadow queries, and judge every different answer
    Shadows(Shadows),
    /// Time frame after frame from the first query on, with values computed on the way
    Frames(Frames),
    /// Rebuild the tables of the paper on its scenes
    Paper(Paper),
    /// Time a new process until its first million answers, with saved values and without
    Kept(Kept),
    /// Time shadow rays to many samples of a light with a size
    Soft(Soft),
    /// Time what share of a view ray's way a light reaches, by intervals and by marching
    Fog(Fog),
    /// Time which of many sensors on a mesh which suns of a year reach
    Sun(SunStudy),
    /// Time the question which of many lights reach a point, in rooms
    Lights(Lights),
    /// Count rays that leak through the vertices and edges they are aimed at
    Watertight(Watertight),
    /// Compare rivals of the paper's time with the reference, beside our methods
    Verify(Box<Verify>),
}

/// File that the figures of a run are written to.
#[derive(Args, Debug)]
#[command(next_help_heading = "Output")]
pub(crate) struct FiguresFile {
    /// File to write the figures to, as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

impl FiguresFile {
    /// Returns what is written, which is none of the files that are read.
    pub(super) fn outputs<'a>(
        &self,
        read: impl IntoIterator<Item = &'a PathBuf>,
    ) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::none();
        outputs.add_if("--json", self.json.as_ref(), Content::Json)?;
        outputs.spare(read)?;
        Ok(outputs)
    }

    /// Writes the figures, if a file was named.
    pub(super) fn write(&self, figures: &impl Serialize) -> Result<(), Failure> {
        match &self.json {
            Some(path) => write_json(path, figures),
            None => Ok(()),
        }
    }
}

/// Number of threads of what is timed.
#[derive(Args, Debug)]
#[command(next_help_heading = "Threads")]
pub(crate) struct TimedThreads {
    /// Number of threads; with 1 processor time is measured, with more wall-clock time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
}

impl TimedThreads {
    /// Returns how many they are.
    pub(super) fn count(&self) -> usize {
        self.threads.into()
    }

    /// Runs the work on them.
    pub(super) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
        let threads = Threads {
            threads: Some(self.threads),
        };
        on_threads(&threads, work)
    }
}

/// Scenes and the light to ask about.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scenes and lights")]
pub(crate) struct LightOfScenes {
    /// Axis that points up, for formats that do not say, default cameras and suns
    #[arg(long, value_name = "AXIS")]
    up: Option<Up>,

    /// Light that replaces the files' lights: point:X,Y,Z
    #[arg(long, value_name = "LIGHT", value_parser = values::light, allow_hyphen_values = true)]
    light: Option<PointLight>,

    #[arg(long, help = SUN_HELP, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun, allow_hyphen_values = true, conflicts_with = "light")]
    sun: Option<Sun>,
}

impl LightOfScenes {
    /// Returns what would have been typed for one scene alone.
    pub(super) fn file(&self, scene: &std::path::Path) -> SceneFile {
        SceneFile {
            scene: scene.to_owned(),
            up: self.up,
            tessellate: None,
            lights: self.light.into_iter().map(LightValue::Point).collect(),
            sun: self.sun,
            // Nobody sees it.
            background: None,
        }
    }

    /// Returns whether a light was typed.
    pub(super) fn is_given(&self) -> bool {
        self.light.is_some() || self.sun.is_some()
    }
}

/// What is asked about, and of whom.
#[derive(Args, Debug)]
pub(crate) struct Subjects {
    /// Scene files
    #[arg(
        help_heading = "Scenes and lights",
        required = true,
        value_name = "SCENE"
    )]
    pub(crate) scenes: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) light: LightOfScenes,

    /// Number of the scene's light to ask about, from 0
    #[arg(
        help_heading = "Scenes and lights",
        long,
        value_name = "N",
        default_value_t = 0
    )]
    pub(crate) light_number: usize,

    /// Camera: eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES [default: the file's, else one that frames
    /// the scene]
    #[arg(help_heading = "Queries", long, value_name = "PARTS", value_parser = values::camera, allow_hyphen_values = true)]
    pub(crate) camera: Option<CameraParts>,

    /// Number of differing answers, per scene and set of queries, to judge by testing every surface
    #[arg(
        help_heading = "Queries",
        long,
        value_name = "N",
        default_value_t = 200
    )]
    pub(crate) judge: usize,

    /// Seed of shuffling, jitter and free points
    #[arg(help_heading = "Queries", long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) figures: FiguresFile,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    #[command(flatten)]
    pub(crate) timed: TimedThreads,
}

impl Subjects {
    /// Returns what is written, which is none of the scenes.
    pub(super) fn outputs(&self) -> Result<Outputs, Failure> {
        self.figures.outputs(&self.scenes)
    }

    /// Returns where eye rays go through pixels in one of several jittered frames.
    pub(super) fn jitter(&self, frame: u32) -> Aim {
        Aim::Jittered(self.seed.wrapping_mul(1024).wrapping_add(frame.into()))
    }
}

#[derive(Args, Debug)]
pub(crate) struct Shadows {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of the frame whose eye rays find the points that are asked about
    #[arg(help_heading = "Queries", long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub(crate) size: [u32; 2],

    /// Method to time; repeatable [default: all of ours but naive]
    #[arg(
        help_heading = "Method",
        long = "shadows",
        value_enum,
        value_name = "METHOD"
    )]
    pub(crate) methods: Vec<Contender>,

    /// Number of rounds, in each of which all methods take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Also print how many queries lie in voxels, of a 64^3 and a 256^3 grid, whose surface points all
    /// have the same answer
    #[arg(help_heading = "Queries", long)]
    pub(crate) oracle: bool,
}

#[derive(Args, Debug)]
pub(crate) struct Soft {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of the frame whose eye rays find the points that are asked about
    #[arg(help_heading = "Queries", long, value_name = "WxH", value_parser = values::size, default_value = "128x128")]
    pub(crate) size: [u32; 2],

    /// Angles that the light spans seen from the middle of the scene, in degrees
    #[arg(
        help_heading = "Queries",
        long,
        value_name = "DEGREES",
        value_delimiter = ',',
        default_value = "0.5,2,6,15"
    )]
    pub(crate) degrees: Vec<f64>,

    /// Way to time; repeatable: ours, walk, rays, embree, embree8, embree16 [default: all]
    #[arg(help_heading = "Method", long = "way", value_name = "WAY", value_parser = WAYS)]
    pub(crate) ways: Vec<String>,

    /// Number of rounds, in each of which all methods take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,
}

/// Options of `sun`.
#[derive(Args, Debug)]
pub(crate) struct SunStudy {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Distance of sensors on a face, in the scene's unit [default: a thousandth of the scene's larger horizontal extent]
    #[arg(help_heading = "Queries", long, value_name = "LENGTH", value_parser = values::distance)]
    pub(crate) spacing: Option<f64>,

    /// Number of sensors to ask about, in blocks of 64 neighbors
    #[arg(help_heading = "Queries", long, value_name = "N", default_value_t = 1024, value_parser = positive_count)]
    pub(crate) sensors: usize,

    /// Directions to ask about
    #[arg(
        help_heading = "Queries",
        long = "sky",
        value_name = "SKY",
        value_enum,
        value_delimiter = ',',
        default_value = "hours"
    )]
    pub(crate) skies: Vec<Sky>,

    /// Way to time; repeatable: ours, rays, "embree by sensor", "embree16 by sun" and the like [default: all]
    #[arg(help_heading = "Method", long = "way", value_name = "WAY")]
    pub(crate) ways: Vec<String>,

    /// Number of rounds, in each of which all ways take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,
}

/// Directions of a sun study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Sky {
    /// Suns of a year at 48 degrees north, one an hour: 4376
    Hours,
    /// Suns of a year at 48 degrees north, one in ten minutes
    Tenths,
    /// Patches of a sky by Tregenza: 145
    Tregenza,
    /// Patches of a sky by Reinhart, each of Tregenza's in 4 by 4: 2305
    Reinhart,
}

impl Sky {
    /// Returns what is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Hours => "hours",
            Self::Tenths => "tenths",
            Self::Tregenza => "tregenza",
            Self::Reinhart => "reinhart",
        }
    }
}

#[derive(Args, Debug)]
pub(crate) struct Fog {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of the frame whose eye rays are asked about
    #[arg(help_heading = "Queries", long, value_name = "WxH", value_parser = values::size, default_value = "1024x1024")]
    pub(crate) size: [u32; 2],

    /// Number of the frame's tiles of 8 by 8 pixels to take, chosen by the seed
    #[arg(help_heading = "Queries", long, value_name = "N", default_value_t = 64, value_parser = positive_count)]
    pub(crate) tiles: usize,

    /// Numbers of steps that marches take along a ray
    #[arg(help_heading = "Queries", long, value_name = "N", value_delimiter = ',', default_value = "64,256", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) steps: Vec<u32>,

    /// Number of steps of the exact march that errors are told by, a power of two up to 65536
    #[arg(help_heading = "Queries", long, value_name = "N", default_value_t = 4096, value_parser = power_of_two)]
    pub(crate) reference: u32,

    /// Number of rounds, in each of which all ways take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,
}

/// Reads a number of at least 1.
fn positive_count(typed: &str) -> Result<usize, String> {
    match typed.parse() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("give a whole number of at least 1".into()),
    }
}

/// Reads a power of two up to 2^16.
fn power_of_two(typed: &str) -> Result<u32, String> {
    match typed.parse::<u32>() {
        Ok(steps) if steps.is_power_of_two() && steps <= 1 << 16 => Ok(steps),
        _ => Err("give a power of two up to 65536".into()),
    }
}

#[derive(Args, Debug)]
pub(crate) struct Frames {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of each frame
    #[arg(help_heading = "Frames", long, value_name = "WxH", value_parser = values::size, default_value = "1024x1024")]
    pub(crate) size: [u32; 2],

    /// Number of frames of the fly-around, once around the scene, with one sample per pixel
    #[arg(help_heading = "Frames", long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=9999))]
    pub(crate) frames: u32,

    /// Samples per pixel of the still frame
    #[arg(help_heading = "Frames", long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) samples: u32,

    /// Number of rounds, each with new indices without values; in each frame all methods take turns;
    /// figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,
}

/// Names of the paper's scenes.
pub(super) const PAPER_SCENES: [&str; 6] = ["graph", "quadric", "dgp", "bars", "flakes", "tetra"];

#[derive(Args, Debug)]
pub(crate) struct Paper {
    /// Scene of the paper to measure; repeatable [default: all six]
    #[arg(help_heading = "Scenes", long = "scene", value_name = "NAME", value_parser = PAPER_SCENES)]
    pub(crate) scenes: Vec<String>,

    /// Size of the pictures; sweeps use half of it, and from an eighth to twice of it
    #[arg(help_heading = "Scenes", long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub(crate) size: [u32; 2],

    /// Number of rounds, in each of which all methods prepare anew and take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Number of rounds for each grid level, picture size and number of lights
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) sweep_rounds: u32,

    /// Skip the sweeps over grid levels, picture sizes and numbers of lights
    #[arg(help_heading = "Rounds", long)]
    pub(crate) no_sweeps: bool,

    #[command(flatten)]
    pub(crate) figures: FiguresFile,

    /// Folder to write the report to: index.html with plots and pictures, and README.md
    #[arg(help_heading = "Output", long, value_name = "DIR")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Watertight {
    /// Files of closed meshes beside the built-in height field and sphere
    #[arg(help_heading = "Scenes and lights", value_name = "MESH")]
    pub(crate) meshes: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) light: LightOfScenes,

    #[command(flatten)]
    pub(crate) figures: FiguresFile,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    #[command(flatten)]
    pub(crate) threads: Threads,
}

/// Who can be timed.
pub(super) const WAYS: [&str; 6] = ["ours", "walk", "rays", "embree", "embree8", "embree16"];

#[derive(Args, Debug)]
pub(crate) struct Kept {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of the jittered frames whose eye rays find the points that are asked about
    #[arg(long, help_heading = "Queries", value_name = "WxH", value_parser = values::size, default_value = "1024x1024")]
    pub(crate) size: [u32; 2],

    /// Number of answers to time
    #[arg(long, help_heading = "Queries", value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    pub(crate) queries: u64,

    /// Method whose files are measured: auto or voxel
    #[arg(long, value_parser = saving_methods(), default_value_t = Ours::Voxel, value_name = "METHOD", help_heading = "Method")]
    pub(crate) shadows: Ours,

    /// Save all values beforehand, as `antumbra bake` does
    #[arg(long, help_heading = "Saved values")]
    pub(crate) baked: bool,

    /// Number of frames that an earlier process answers before it saves its values, without --baked
    #[arg(long, help_heading = "Saved values", value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) learn: u32,

    /// Number of pairs of processes, one with the file and one without; figures are medians
    #[arg(long, help_heading = "Rounds", value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Be the second process: answer these queries
    #[arg(long, hide = true)]
    pub(crate) child: Option<PathBuf>,

    /// The file that it takes
    #[arg(long, hide = true)]
    pub(crate) occlusion: Option<PathBuf>,
}

// The flattened arguments are a group of this name already.
#[derive(Args, Debug)]
#[group(skip)]
pub(crate) struct Verify {
    #[command(flatten)]
    pub(crate) ours: cli::Verify,

    /// Rival to compare, too; repeatable. For shadow-map the share of wrong answers is printed; they do not count as
    /// differences
    #[arg(help_heading = "Comparison", long = "rival", value_parser = rivals(), value_name = "RIVAL")]
    pub(crate) rivals: Vec<Contender>,
}

/// Returns what reads the name of a rival and offers no others.
fn rivals() -> impl TypedValueParser<Value = Contender> {
    let names = Contender::value_variants()
        .iter()
        .filter(|contender| matches!(contender, Contender::Rival(_)))
        .filter_map(ValueEnum::to_possible_value);
    PossibleValuesParser::new(names).try_map(|name| Contender::from_str(&name, false))
}

/// Options of `lights`.
#[derive(Args, Debug)]
pub(crate) struct Lights {
    /// Numbers of lights
    #[arg(
        help_heading = "Scenes",
        long,
        value_name = "N",
        value_delimiter = ',',
        default_value = "1,10,100"
    )]
    pub(crate) counts: Vec<u32>,

    /// Number of rooms along a side
    #[arg(help_heading = "Scenes", long, value_name = "N", default_value_t = 3)]
    pub(crate) rooms: u32,

    /// Size of the frame whose eye rays find the points that are asked about
    #[arg(help_heading = "Queries", long, value_name = "WxH", value_parser = values::size, default_value = "256x256")]
    pub(crate) size: [u32; 2],

    /// Number of jittered frames whose points rows are made for
    #[arg(help_heading = "Queries", long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub(crate) frames: u32,

    /// Number of rounds, in each of which all ways take turns; figures are medians
    #[arg(help_heading = "Rounds", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    #[command(flatten)]
    pub(crate) figures: FiguresFile,

    #[command(flatten)]
    pub(crate) timed: TimedThreads,
}
