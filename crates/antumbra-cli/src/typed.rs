//! What was typed: the command line, before it is set against a scene.

use std::path::PathBuf;

use antumbra::{QuickCheck, Volume};
use antumbra_render::film::Show;
use antumbra_render::fog::Fog;
use antumbra_scene::model::Bump;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

mod shared;
mod sun;

use crate::light_values::{self, LightChoice};
pub use crate::methods::{Against, Rays, Shadows, Up};
use crate::values::{self, CameraParts, Exposure, Sun};
pub use shared::{
    IndexCost, MoreLights, RefineWhen, SUN_HELP, SUN_WITH_SIZE_HELP, SceneFile, Threads,
};
pub use sun::{Layout, Moment, Sky, SunStudy};

/// End of the help of a program.
pub const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    answers that differ were found
  2    the command line or a scene cannot be used
  3    the system refused something, such as writing a file
  129  the terminal was closed (SIGHUP)
  130  stopped by Ctrl-C
  143  asked to terminate (SIGTERM)
When stopped, what has a partial result writes it: a picture, or what was measured";

/// Ends the help of the program.
pub const EXAMPLES: &str = "\
Examples:
  A picture of a mesh of your own with z up, a sun in the south and soft shadows:
    antumbra render house.obj --up z --sun 180,45,0.53 --soft exact -o house.png
  Which of many points, a NumPy array of shape (n, 3), that sun does not reach:
    antumbra query house.obj --up z --sun 180,45 --points P.npy --on-surface -o OUT.npy
";

/// Columns of help texts at most.
pub const HELP_WIDTH: usize = 100;

/// Exact shadow answers for static scenes, mostly without tracing a ray.
#[derive(Debug, Parser)]
#[command(name = "antumbra", version, after_help = format!("{EXAMPLES}\n{EXIT_CODES}"), max_term_width = HELP_WIDTH)]
pub struct Typed {
    #[command(flatten)]
    pub verbosity: Verbosity,

    #[command(subcommand)]
    pub command: Command,
}

/// How much is printed.
#[derive(Args, Clone, Copy, Debug)]
pub struct Verbosity {
    /// Print errors and results only
    #[arg(long, short, global = true)]
    pub quiet: bool,

    /// Also print details of the work
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to PNG or OpenEXR
    Render(Box<Render>),
    /// Print what a scene holds and how much memory its index would take
    Inspect(Inspect),
    /// Answer shadow queries for the points in a file
    Query(Query),
    /// Study the sun on sensors over a year: hours, spans, irradiation, sky view factors
    Sun(Box<SunStudy>),
    /// Compare every exact shadow method with the reference
    Verify(Verify),
    /// Precompute all occlusion values of a scene and save them to a file
    Bake(Bake),
    /// Write occlusion values as a regular grid of cells
    Export(Export),
    /// Write one of the built-in test scenes
    Scene(Scene),
    /// Write a scene in another format
    Convert(Convert),
}

#[derive(Args, Debug)]
pub struct Render {
    #[command(flatten)]
    pub file: SceneFile,

    #[command(flatten)]
    pub more_lights: MoreLights,

    /// Fog between all surfaces: its density is the share of light that it takes in each unit of length, of short lengths;
    /// ALBEDO is the share of that which it scatters, 0 to 1; G says where to, -1 to 1: above 0 forwards, so that it is
    /// bright towards lights. Lights show in it, shadows too; docs/fog.md describes it [default: none; 1 and 0 behind]
    #[arg(long, help_heading = "Scene and lights", value_name = "DENSITY[,ALBEDO[,G]]", value_parser = values::fog, allow_hyphen_values = true)]
    pub fog: Option<Fog>,

    /// Picture to write, .png or .exr; with --orbit, -0001 and so on is inserted before the ending
    #[arg(long, short, value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,

    /// Whether see-through surfaces color the light that reaches others through them, straight on; `off` lets it pass unchanged
    #[arg(long, help_heading = "Scene and lights", value_name = "WHETHER", value_enum, default_value_t = Whether::On)]
    pub shadows_through_glass: Whether,

    /// Whether surfaces have the reliefs of their bump and normal maps: in their shading, and where shadows of others end on
    /// them; docs/bumps.md describes it
    #[arg(long, help_heading = "Scene and lights", value_name = "WHETHER", value_enum, default_value_t = Whether::On)]
    pub bumps: Whether,

    /// Relief for all surfaces, in place of their maps: noise or ripples, HEIGHT from the lowest to the highest place and SIZE
    /// from bump to bump, in the scene's unit
    #[arg(long, help_heading = "Scene and lights", value_name = "KIND:HEIGHT,SIZE", value_parser = values::bump, conflicts_with = "bumps")]
    pub bump: Option<Bump>,

    /// Layers to write, separated by commas: beside a PNG as NAME.shadow.LIGHT.png, NAME.decided-by.png, NAME.fog.png
    /// and NAME.transmittance.png, in OpenEXR as parts [default: all in OpenEXR, none beside PNG]
    #[arg(
        long,
        help_heading = "Output",
        value_enum,
        value_delimiter = ',',
        value_name = "LAYERS"
    )]
    pub aov: Vec<Aov>,

    /// Method that answers shadow queries; the picture is the same for all
    #[arg(
        long,
        help_heading = "Method",
        value_enum,
        default_value_t,
        value_name = "METHOD"
    )]
    pub shadows: Shadows,

    /// Structure that eye rays, mirrored and refracted rays are traced through; the picture is the same
    #[arg(
        long,
        help_heading = "Method",
        value_enum,
        default_value_t,
        value_name = "METHOD"
    )]
    pub rays: Rays,

    /// Evaluate the quick check of the paper, and report or obey its advice
    #[arg(long, help_heading = "Method", value_enum, value_name = "ACTION")]
    pub quick_check: Option<QuickCheckAction>,

    #[command(flatten)]
    pub saved: crate::saved::SavedFiles,

    #[command(flatten)]
    pub cost: IndexCost,

    /// Picture size in pixels [default: the file's, else 512x512]
    #[arg(help_heading = "Picture", long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<[u32; 2]>,

    /// Samples a pixel, stratified; 1 is the pixel's centre
    #[arg(help_heading = "Picture", long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub spp: u32,

    /// Send rays through pixel corners and average four a pixel, as the SPD test procedure asks
    #[arg(help_heading = "Picture", long, conflicts_with = "spp")]
    pub corner_rays: bool,

    /// Longest chain of rays; the eye ray is number 1, as in the SPD test procedure. 0 and 1: no
    /// mirrored and refracted rays. Looking through blended surfaces does not count (up to 32)
    #[arg(help_heading = "Picture", long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(0..=32))]
    pub max_depth: u32,

    /// Stops to brighten a PNG by; auto: until the log-average luminance of what is not
    /// background is 0.18, one value for all frames of an orbit [default: auto where lights are in
    /// candela and lux, else 0]
    #[arg(help_heading = "Picture", long, value_name = "auto|EV", value_parser = values::exposure, allow_hyphen_values = true)]
    pub exposure: Option<Exposure>,

    /// Camera: eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES. Parts left out come from the file's camera;
    /// without one, eye and at are required, up is the scene's and fov is 45
    #[arg(help_heading = "Picture", long, value_name = "PARTS", value_parser = values::camera, allow_hyphen_values = true)]
    pub camera: Option<CameraParts>,

    /// Number of frames of a fly-around to render; the index is built once
    #[arg(help_heading = "Picture", long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=9999))]
    pub orbit: Option<u32>,

    /// What the picture shows: the scene, or how each point's shadow queries were decided
    #[arg(
        help_heading = "Picture",
        long,
        value_enum,
        default_value_t,
        value_name = "WHAT"
    )]
    pub show: ShowWhat,

    #[command(flatten)]
    pub threads: Threads,

    /// Seed of the jitter of --spp
    #[arg(help_heading = "Picture", long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Print statistics on standard error
    #[arg(help_heading = "Output", long)]
    pub stats: bool,

    /// File to write statistics to, as JSON
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    pub stats_json: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub struct Inspect {
    #[command(flatten)]
    pub file: SceneFile,

    #[command(flatten)]
    pub cost: IndexCost,
}

#[derive(Args, Debug)]
pub struct Verify {
    #[command(flatten)]
    pub file: SceneFile,

    /// Number of queries to compare
    #[arg(help_heading = "Comparison", long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub queries: u64,

    /// Method to compare; repeatable [default: all; with --against bvh all but naive and bvh]
    #[arg(help_heading = "Comparison", long, value_enum, value_name = "METHOD")]
    pub shadows: Vec<Shadows>,

    /// Judge that answers are compared with
    #[arg(
        help_heading = "Comparison",
        long,
        value_enum,
        default_value_t,
        value_name = "JUDGE"
    )]
    pub against: Against,

    /// Start at delicate places: on borders between voxels, at vertices, edges and creases, on edges
    /// of shadows, and one rounding off them
    #[arg(help_heading = "Comparison", long)]
    pub attack: bool,

    /// Number of lights at delicate places to add to the scene's
    #[arg(help_heading = "Comparison", long = "lights", value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub more_lights: u32,

    /// Seed of the random queries
    #[arg(
        help_heading = "Comparison",
        long,
        value_name = "N",
        default_value_t = 0
    )]
    pub seed: u64,

    #[command(flatten)]
    pub cost: IndexCost,

    #[command(flatten)]
    pub threads: Threads,
}

#[derive(Args, Debug)]
pub struct Query {
    /// Scene file; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    #[arg(help_heading = "Scene and lights")]
    pub scene: PathBuf,

    /// Points in world space: float32 or float64, shape (n, 3)
    #[arg(long, value_name = "P.npy", help_heading = "Points")]
    pub points: PathBuf,

    /// Normals of the points: float32 or float64, shape (n, 3), any length. A point that faces away from
    /// a light is in shadow. With --on-surface, normals choose among surfaces that meet at a point instead
    #[arg(long, value_name = "N.npy", help_heading = "Points")]
    pub normals: Option<PathBuf>,

    /// Take each point as lying on its nearest surface, up to rounding; without this, points are points
    /// of space, and one that lies on a surface may be in that surface's shadow
    #[arg(long, help_heading = "Points")]
    pub on_surface: bool,

    /// How far a point may lie from its surface, in the scene's unit; inf for any distance [default: what rounding may have moved it:
    /// 2^-21 of the coordinates of the point and the surface for float32, 2^-42 for float64]
    #[arg(long, value_name = "DISTANCE", help_heading = "Points", requires = "on_surface", value_parser = values::distance, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,

    /// Ends of segments that begin at the points, as many: asks which stretches of each the lights reach. Points of a segment
    /// are points of space. Lights have no size; a spot counts as a point
    #[arg(long, value_name = "ENDS.npy", help_heading = "Points", conflicts_with_all = ["normals", "on_surface", "ambient_occlusion", "sky_view_factor"])]
    pub intervals: Option<PathBuf>,

    /// Asks which shares of red, green and blue of each light reach the points: 0 behind opaque surfaces, else what
    /// see-through surfaces on the way let through
    #[arg(long, help_heading = "Points", conflicts_with_all = ["intervals", "ambient_occlusion", "sky_view_factor"])]
    pub transmittance: bool,

    /// Light to ask about: a name, as in the shadow layers of render, or a light as render takes it (point:X,Y,Z,
    /// area:CENTER/EDGE1/EDGE2 and so on), which replaces the file's lights; repeatable [default: all, in the file's order]
    #[arg(long = "light", help_heading = "Scene and lights", value_name = "LIGHT", value_parser = light_values::light_choice, allow_hyphen_values = true)]
    pub lights: Vec<LightChoice>,

    #[arg(long, help = SUN_WITH_SIZE_HELP, help_heading = "Scene and lights", value_name = "AZIMUTH,ELEVATION[,DIAMETER]", value_parser = values::sun_with_size, allow_hyphen_values = true)]
    pub sun: Option<Sun>,

    #[command(flatten)]
    pub more_lights: MoreLights,

    #[command(flatten)]
    pub shares: crate::soft::Shares,

    /// Axis that points up, for suns [default: that of the format]
    #[arg(long, help_heading = "Scene and lights", value_name = "AXIS")]
    pub up: Option<Up>,

    /// File to write answers to, 1 where a light is blocked: uint8, shape (n,) for one light, (n, lights) for more. If
    /// one of the lights has a size, visible fractions of all: float32, 1 where all of a light is seen. With --intervals a
    /// row for each lit interval: float64, shape (k, 4): segment, light, and begin and end as shares of the length. With
    /// --transmittance float64, three shares more at the end of the shape
    #[arg(long, short, value_name = "OUT.npy", help_heading = "Output")]
    pub output: PathBuf,

    /// Write bits, eight points a byte, the first lowest (numpy.packbits with bitorder="little"): shape
    /// (ceil(n / 8),) for one light, (lights, ceil(n / 8)) for more
    #[arg(long, help_heading = "Output")]
    pub packed: bool,

    /// Method that answers shadow queries; the answers are the same
    #[arg(
        long,
        value_enum,
        default_value_t,
        value_name = "METHOD",
        help_heading = "Method"
    )]
    pub shadows: Shadows,

    #[command(flatten)]
    pub saved: crate::saved::SavedFiles,

    #[command(flatten)]
    pub cost: IndexCost,

    #[command(flatten)]
    pub threads: Threads,
}

#[derive(Args, Debug)]
pub struct Bake {
    #[command(flatten)]
    pub file: SceneFile,

    /// File to write. What it already has is loaded, for all lights that have not changed
    #[arg(long, short, value_name = "FILE.antumbra", help_heading = "Output")]
    pub output: PathBuf,

    /// Method to precompute for: voxel takes seconds a light, loads fast and also describes whole cells of space; auto
    /// computes exact shadow maps, in about a second a light, which take about as long to load
    #[arg(long, value_parser = saving_methods(), default_value_t = Shadows::Voxel, value_name = "METHOD", help_heading = "Method")]
    pub shadows: Shadows,

    #[command(flatten)]
    pub cost: IndexCost,

    #[command(flatten)]
    pub threads: Threads,
}

/// Returns what reads the name of a method that keeps what it knows.
pub fn saving_methods() -> impl TypedValueParser<Value = Shadows> {
    PossibleValuesParser::new(["auto", "voxel"]).try_map(|name| Shadows::from_str(&name, false))
}

#[derive(Args, Debug)]
pub struct Export {
    #[command(flatten)]
    pub file: SceneFile,

    /// File of values to load, which `antumbra bake` wrote; lights that it lacks are computed
    #[arg(long, help_heading = "Saved values", value_name = "FILE.antumbra")]
    pub occlusion: Option<PathBuf>,

    /// Number of cells along the longest axis, rounded up to a power of two
    #[arg(long, help_heading = "Output", value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=i64::from(Volume::MOST_CELLS)))]
    pub cells: u32,

    /// Array to write: uint8, 0 where a light reaches every point of a cell, 1 where it reaches none, 2
    /// otherwise or where it is not known; shape (x, y, z) for one light, (x, y, z, lights) for more
    #[arg(long, short, help_heading = "Output", value_name = "OUT.npy")]
    pub output: PathBuf,

    /// File to write the place of the cells and the names of the lights to, as JSON
    #[arg(long, help_heading = "Output", value_name = "FILE")]
    pub json: Option<PathBuf>,

    #[command(flatten)]
    pub cost: IndexCost,

    #[command(flatten)]
    pub threads: Threads,
}

#[derive(Args, Debug)]
pub struct Scene {
    /// Built-in scene
    #[arg(value_name = "NAME", value_parser = crate::scene_source::names(), help_heading = "Scene")]
    pub name: String,

    /// Size of the scene, in what the scene counts; larger is more [default: that of the scene]
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub size: Option<u32>,

    /// Number of lights, only for rooms [default: 10]
    #[arg(long, value_name = "N", help_heading = "Scene")]
    pub lights: Option<u32>,

    /// Scene file to write; its ending says the format: .nff, .obj, .ply or .glb
    #[arg(long, short, value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,
}

#[derive(Args, Debug)]
pub struct Convert {
    /// Scene file to read; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    #[arg(value_name = "IN", help_heading = "Files")]
    pub input: PathBuf,

    /// Scene file to write; its ending says the format: .nff, .obj, .ply or .glb
    #[arg(value_name = "OUT", help_heading = "Files")]
    pub output: PathBuf,

    /// Curved shapes as meshes: twice N sides around, N cells along a patch (rounded up to a power of two) or a box of an
    /// implicit surface. Shadows get polygonal outlines
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub tessellate: Option<u32>,
}

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Aov {
    /// One mask per light: the share of samples that it reaches. Facing away counts as not reached,
    /// hitting nothing as reached
    Shadow,
    /// How shadow questions were decided, as shares
    Decided,
    /// Light that the air adds, and the share that it leaves; with --fog
    Fog,
    /// No layer
    None,
}

/// Whether something is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Whether {
    /// It is
    On,
    /// It is not
    Off,
}

/// Action on the quick check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QuickCheckAction {
    /// Say what it advises
    Report,
    /// Leave voxel occlusion testing out where it advises so
    Obey,
}

impl QuickCheckAction {
    pub fn quick_check(typed: Option<Self>) -> QuickCheck {
        match typed {
            None => QuickCheck::Off,
            Some(Self::Report) => QuickCheck::Report,
            Some(Self::Obey) => QuickCheck::Obey,
        }
    }
}

/// Subject of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ShowWhat {
    /// The scene
    #[default]
    Scene,
    /// How queries were decided: green first pass, blue intermediate, yellow blocker list,
    /// vermilion ray, grey facing away, violet outside the spot's cone; shadowed is darker. Lights
    /// with size: light grey wholly visible, orange penumbra, dark blue umbra
    Occlusion,
}

impl ShowWhat {
    pub fn show(self) -> Show {
        match self {
            Self::Scene => Show::Scene,
            Self::Occlusion => Show::Occlusion,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Occlusion => "occlusion",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        Typed::command().debug_assert();
    }
}
