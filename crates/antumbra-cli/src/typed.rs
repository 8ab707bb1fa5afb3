//! What was typed: the command line, before it is set against a scene.

use std::path::PathBuf;

use antumbra::{GridResolution, Method, QuickCheck, RayMethod, Refine, Refinement};
use antumbra_baselines::RivalKind;
use antumbra_render::film::Show;
use antumbra_scene::model::Color;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::values::{self, CameraParts, Exposure, LightChoice, PointLight, Sun};

const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    verify or bench found answers that differ
  2    the command line or a scene cannot be used
  3    the system refused something, such as writing a file
  130  stopped by Ctrl-C; render leaves the partial picture";

/// Exact shadow answers for static scenes, mostly without tracing a ray.
#[derive(Debug, Parser)]
#[command(name = "antumbra", version, after_help = EXIT_CODES)]
pub(crate) struct Typed {
    /// Print errors and results only
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,

    /// Print what goes on
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene to PNG or OpenEXR
    Render(Box<Render>),
    /// Say what a scene holds and what it would cost
    Inspect(Inspect),
    /// Answer shadow queries of points in a file
    Query(Query),
    /// Compare every exact shadow method with the reference
    Verify(Verify),
    /// Make all occlusion values of a scene and keep them in a file
    Bake(crate::commands::bake::Bake),
    /// Write occlusion values as a regular grid of cells
    Export(crate::commands::export::Export),
    /// Write one of the built-in scenes
    Scene(Scene),
    /// Write a scene in another format
    Convert(Convert),
    /// Measure antumbra against Embree
    Bench(Box<crate::commands::bench::typed::Bench>),
}

/// The scene and its lights.
#[derive(Args, Debug)]
pub(crate) struct SceneFile {
    /// Scene file; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    pub(crate) scene: PathBuf,

    /// Which axis is up, for default cameras and suns; nothing is turned [default: the format's: y
    /// for OBJ and glTF, z for PLY and STL, the file's for NFF]
    #[arg(long, value_name = "AXIS")]
    pub(crate) up: Option<Up>,

    /// Light instead of the file's lights: point:X,Y,Z or point:X,Y,Z/R,G,B; repeatable
    #[arg(long = "light", value_name = "LIGHT", value_parser = values::light)]
    pub(crate) lights: Vec<PointLight>,

    /// Sun instead of the file's lights, in degrees: azimuth clockwise from north, elevation
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun, allow_hyphen_values = true)]
    pub(crate) sun: Option<Sun>,

    /// What a ray sees that hits nothing, linear [default: the file's; for formats that have none a
    /// grey-blue, and black where lights are in candela and lux]
    #[arg(long, value_name = "R,G,B", value_parser = values::background)]
    pub(crate) background: Option<Color>,
}

/// What a scene and its index cost.
#[derive(Args, Debug)]
pub(crate) struct IndexCost {
    /// Voxels: N or NxNxN [default: by Woo's rule]
    #[arg(long, value_name = "N", value_parser = values::grid)]
    pub(crate) grid: Option<GridResolution>,

    /// Most memory to take, such as 2GiB; what needs more is refused before it is taken [default:
    /// three quarters of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub(crate) memory_limit: Option<u64>,

    /// Finest voxels of method voxel along the longest axis, where surfaces are [default: 2048]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=4096))]
    pub(crate) resolution: Option<u32>,

    /// How few possible blockers method voxel lists instead of refining, and in its finest voxels;
    /// 0 lists none; for free points, eight times SHORT [default: 1,32]
    #[arg(long, value_name = "SHORT,LONG", value_parser = values::lists)]
    pub(crate) lists: Option<[usize; 2]>,

    /// When method voxel makes its values [default: lazy; for verify and inspect eager]
    #[arg(long, value_name = "WHEN", value_enum)]
    pub(crate) refine: Option<RefineWhen>,

    /// Most memory for the values of method voxel, such as 64MiB, up to 4GiB; values that find no room are made
    /// again, and answers do not change [default: 512MiB]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub(crate) occlusion_memory: Option<u64>,
}

/// When method `voxel` makes its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RefineWhen {
    /// While queries are answered, where it pays
    Lazy,
    /// While queries are answered, wherever they are, whether it pays or not
    Asked,
    /// All before the first query
    Eager,
}

impl IndexCost {
    /// Returns how far method `voxel` refines its values.
    pub(crate) fn refinement(&self, usual: Refine) -> Refinement {
        let mut refinement = Refinement::default();
        if let Some(resolution) = self.resolution {
            refinement.resolution = resolution;
            refinement.space_resolution = resolution;
        }
        if let Some([short, long]) = self.lists {
            refinement.short_list = short;
            refinement.space_list = 8 * short;
            refinement.long_list = long;
        }
        refinement.refine = match self.refine {
            None => usual,
            Some(RefineWhen::Lazy) => Refine::Lazy,
            Some(RefineWhen::Asked) => Refine::Asked,
            Some(RefineWhen::Eager) => Refine::Eager,
        };
        if let Some(memory) = self.occlusion_memory {
            refinement.memory = memory;
        }
        refinement
    }
}

/// How many threads.
#[derive(Args, Debug)]
pub(crate) struct Threads {
    /// Threads [default: one a processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
}

#[derive(Args, Debug)]
pub(crate) struct Render {
    #[command(flatten)]
    pub(crate) file: SceneFile,

    /// Picture to write, .png or .exr; with --orbit, frames get -0001 and so on before the ending
    #[arg(long, short, value_name = "FILE")]
    pub(crate) output: PathBuf,

    /// Layers, separated by commas: beside a PNG as NAME.shadow.LIGHT.png and NAME.decided-by.png,
    /// in OpenEXR as parts [default: all in OpenEXR, none beside PNG]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LAYERS")]
    pub(crate) aov: Vec<Aov>,

    /// How shadow queries are answered; the picture is the same, but for shadow-map
    #[arg(long, value_enum, default_value_t, value_name = "METHOD")]
    pub(crate) shadows: Shadows,

    /// What finds where eye rays, mirrored and refracted rays hit; the picture is the same
    #[arg(long, value_enum, default_value_t, value_name = "METHOD")]
    pub(crate) rays: Rays,

    /// Evaluate the quick check of the paper, and say or do what it advises
    #[arg(long, value_enum, value_name = "ACTION")]
    pub(crate) quick_check: Option<QuickCheckAction>,

    #[command(flatten)]
    pub(crate) kept: crate::commands::kept::KeptFiles,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    /// Picture size in pixels [default: the file's, else 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub(crate) size: Option<[u32; 2]>,

    /// Samples a pixel, stratified; 1 is the pixel's centre
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) spp: u32,

    /// Send rays through pixel corners and average four a pixel, as the SPD test procedure asks
    #[arg(long, conflicts_with = "spp")]
    pub(crate) corner_rays: bool,

    /// Longest chain of rays; the eye ray is number 1, as in the SPD test procedure. 0 and 1: no
    /// mirrored and refracted rays. Looking through blended surfaces does not count (up to 32)
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(0..=32))]
    pub(crate) max_depth: u32,

    /// Brighten a PNG by so many stops; auto: until the log-average luminance of what is not
    /// background is 0.18, one value for all frames of an orbit [default: auto where lights are in
    /// candela and lux, else 0]
    #[arg(long, value_name = "auto|EV", value_parser = values::exposure, allow_hyphen_values = true)]
    pub(crate) exposure: Option<Exposure>,

    /// Camera: eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES; what is left out comes from the file's
    /// camera. Without one, eye and at are due, up is the scene's and fov 45
    #[arg(long, value_name = "PARTS", value_parser = values::camera)]
    pub(crate) camera: Option<CameraParts>,

    /// Render so many frames of a fly-around; the index is prepared once
    #[arg(long, value_name = "FRAMES", value_parser = clap::value_parser!(u32).range(1..=9999))]
    pub(crate) orbit: Option<u32>,

    /// What to show: the scene, or how each point's shadow queries were decided
    #[arg(long, value_enum, default_value_t, value_name = "WHAT")]
    pub(crate) show: ShowWhat,

    #[command(flatten)]
    pub(crate) threads: Threads,

    /// Changes the jitter of --spp
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,

    /// Print figures on standard error
    #[arg(long)]
    pub(crate) stats: bool,

    /// Write figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) stats_json: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Inspect {
    #[command(flatten)]
    pub(crate) file: SceneFile,

    #[command(flatten)]
    pub(crate) cost: IndexCost,
}

#[derive(Args, Debug)]
pub(crate) struct Verify {
    #[command(flatten)]
    pub(crate) file: SceneFile,

    /// How many queries to compare
    #[arg(long, value_name = "N", default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub(crate) queries: u64,

    /// Compare this method only; repeatable [default: all of ours; with --against bvh all but naive and
    /// bvh]. Of shadow-map the share of wrong answers is told, which are no differences
    #[arg(long, value_enum, value_name = "METHOD")]
    pub(crate) shadows: Vec<Shadows>,

    /// What answers are compared with
    #[arg(long, value_enum, default_value_t, value_name = "JUDGE")]
    pub(crate) against: Against,

    /// Start at delicate places: between voxels, at vertices, edges and creases, on edges of
    /// shadows, a rounding off them
    #[arg(long)]
    pub(crate) attack: bool,

    /// Ask about so many more lights at delicate places, beside the scene's
    #[arg(long = "lights", value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) more_lights: u32,

    /// Changes the queries
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Args, Debug)]
pub(crate) struct Query {
    /// Scene file; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    pub(crate) scene: PathBuf,

    /// Points in world space: float32 or float64, shape (n, 3)
    #[arg(long, value_name = "P.npy")]
    pub(crate) points: PathBuf,

    /// Normals of the points: float32 or float64, shape (n, 3), any length. A point whose light is not on
    /// its normal's side is in shadow. With --on-surface, choose among surfaces that meet at a point instead
    #[arg(long, value_name = "N.npy")]
    pub(crate) normals: Option<PathBuf>,

    /// The points lie on surfaces up to rounding: on the nearest. Without, they are points of space
    #[arg(long)]
    pub(crate) on_surface: bool,

    /// How far a point may lie from its surface, in the scene's unit [default: what rounding may have moved it: 2^-21
    /// of the coordinates of the point and the surface for float32, 2^-42 for float64]
    #[arg(long, value_name = "DISTANCE", requires = "on_surface", value_parser = values::distance)]
    pub(crate) tolerance: Option<f64>,

    /// Light to ask about: a name, as the shadow layers of render have it, or point:X,Y,Z, which replaces
    /// the file's lights; repeatable [default: all, in the file's order]
    #[arg(long = "light", value_name = "LIGHT", value_parser = values::light_choice)]
    pub(crate) lights: Vec<LightChoice>,

    /// Sun instead of the file's lights, in degrees: azimuth clockwise from north, elevation
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun, allow_hyphen_values = true)]
    pub(crate) sun: Option<Sun>,

    /// Which axis is up, for suns [default: the format's]
    #[arg(long, value_name = "AXIS")]
    pub(crate) up: Option<Up>,

    /// Answers to write, 1 where a light is blocked: uint8, shape (n,) for one light, (n, lights) for more
    #[arg(long, short, value_name = "OUT.npy")]
    pub(crate) output: PathBuf,

    /// Write bits, eight points a byte, the first lowest (numpy.packbits with bitorder="little"): shape
    /// (ceil(n / 8),) for one light, (lights, ceil(n / 8)) for more
    #[arg(long)]
    pub(crate) packed: bool,

    /// How shadow queries are answered, by a method of ours; the answers are the same
    #[arg(long, value_enum, default_value_t, value_name = "METHOD")]
    pub(crate) shadows: Shadows,

    #[command(flatten)]
    pub(crate) kept: crate::commands::kept::KeptFiles,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    #[command(flatten)]
    pub(crate) threads: Threads,
}

#[derive(Args, Debug)]
pub(crate) struct Scene {
    /// Which one
    #[arg(value_name = "NAME", value_parser = crate::scene_source::name)]
    pub(crate) name: String,

    /// How large; what it counts depends on the scene [default: the scene's own]
    #[arg(long, value_name = "N")]
    pub(crate) size: Option<u32>,

    /// How many lights, for rooms, which has 10 by default
    #[arg(long, value_name = "N")]
    pub(crate) lights: Option<u32>,

    /// NFF file to write
    #[arg(long, short, value_name = "FILE.nff")]
    pub(crate) output: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Convert {
    /// Scene file to read; its ending says the format
    #[arg(value_name = "IN")]
    pub(crate) input: PathBuf,

    /// Scene file to write; its ending says the format: .nff, .obj or .ply
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
}

/// A layer beside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Aov {
    /// One mask a light: the share of samples that it reaches; facing away counts as not, hitting
    /// nothing as reached
    Shadow,
    /// How shadow questions were decided, as shares
    Decided,
    /// No layer
    None,
}

/// An axis that can be up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Up {
    Y,
    Z,
}

/// Who answers shadow queries: our methods, then the rivals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shadows {
    /// Voxel occlusion testing as published in 1990
    #[value(name = "voxel-1990")]
    Voxel1990,
    /// Exact values on any mesh, in voxels refined where it pays; lists of the few possible blockers;
    /// rays for the rest
    #[default]
    Voxel,
    /// A walk through the uniform grid for each query
    Grid,
    /// A ray through the bounding volume hierarchy for each query
    Bvh,
    /// Every surface is tested
    Naive,
    /// Haines and Greenberg 1986: planes of cells round the light, with sorted candidates
    LightBuffer,
    /// Eo and Kyung 1989: shadow polygons in the voxels of the grid, a walk where they are many
    Hybrid,
    /// Crow 1977: shadow volumes, counted at each point
    ShadowVolumes,
    /// Williams 1978: a depth buffer seen from the light. Not exact: the picture differs
    ShadowMap,
}

impl Shadows {
    /// Our methods: each gives the reference's answers.
    pub(crate) const OURS: [Self; 5] = [
        Self::Voxel,
        Self::Voxel1990,
        Self::Grid,
        Self::Bvh,
        Self::Naive,
    ];

    /// Returns our method; for rivals the one that their shadow rays are walked by.
    pub(crate) fn method(self) -> Method {
        match self {
            Self::Voxel1990 => Method::Voxel1990,
            Self::Voxel => Method::Voxel,
            Self::Grid => Method::Grid,
            Self::Bvh => Method::Bvh,
            Self::Naive => Method::Naive,
            Self::LightBuffer | Self::Hybrid | Self::ShadowVolumes | Self::ShadowMap => {
                Method::Grid
            }
        }
    }

    /// Returns the rival that answers, if it is one.
    pub(crate) fn rival(self) -> Option<RivalKind> {
        match self {
            Self::Voxel1990 | Self::Voxel | Self::Grid | Self::Bvh | Self::Naive => None,
            Self::LightBuffer => Some(RivalKind::LightBuffer),
            Self::Hybrid => Some(RivalKind::Hybrid),
            Self::ShadowVolumes => Some(RivalKind::ShadowVolumes),
            Self::ShadowMap => Some(RivalKind::ShadowMap),
        }
    }

    /// Returns whether all answers are the reference's.
    pub(crate) fn is_exact(self) -> bool {
        self.rival().is_none_or(RivalKind::is_exact)
    }

    pub(crate) fn of(method: Method) -> Self {
        match method {
            Method::Voxel1990 => Self::Voxel1990,
            Method::Voxel => Self::Voxel,
            Method::Grid => Self::Grid,
            Method::Bvh => Self::Bvh,
            Method::Naive => Self::Naive,
        }
    }

    /// Returns the name as it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Voxel1990 => "voxel-1990",
            Self::Voxel => "voxel",
            Self::Grid => "grid",
            Self::Bvh => "bvh",
            Self::Naive => "naive",
            Self::LightBuffer => RivalKind::LightBuffer.name(),
            Self::Hybrid => RivalKind::Hybrid.name(),
            Self::ShadowVolumes => RivalKind::ShadowVolumes.name(),
            Self::ShadowMap => RivalKind::ShadowMap.name(),
        }
    }
}

/// What the answers of `verify` are compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Against {
    /// A test of every surface
    #[default]
    Reference,
    /// A ray through the bounding volume hierarchy: as exact, and fast enough for many millions
    Bvh,
}

/// What finds the nearest hit of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rays {
    /// The bounding volume hierarchy
    #[default]
    Bvh,
    /// The uniform grid
    Grid,
}

impl Rays {
    pub(crate) fn method(self) -> RayMethod {
        match self {
            Self::Bvh => RayMethod::Bvh,
            Self::Grid => RayMethod::Grid,
        }
    }

    /// Returns the name as it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Grid => "grid",
        }
    }
}

/// What to do with the quick check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum QuickCheckAction {
    /// Say what it advises
    Report,
    /// Leave voxel occlusion testing out where it advises so
    Obey,
}

impl QuickCheckAction {
    pub(crate) fn quick_check(typed: Option<Self>) -> QuickCheck {
        match typed {
            None => QuickCheck::Off,
            Some(Self::Report) => QuickCheck::Report,
            Some(Self::Obey) => QuickCheck::Obey,
        }
    }
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum ShowWhat {
    /// The scene
    #[default]
    Scene,
    /// How queries were decided: green first pass, blue intermediate, yellow blocker list,
    /// vermilion ray, grey facing away, violet outside the spot's cone; shadowed is darker
    Occlusion,
}

impl ShowWhat {
    pub(crate) fn show(self) -> Show {
        match self {
            Self::Scene => Show::Scene,
            Self::Occlusion => Show::Occlusion,
        }
    }

    pub(crate) fn name(self) -> &'static str {
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

    #[test]
    fn names_are_what_is_typed() {
        for &shadows in Shadows::value_variants() {
            assert_eq!(Shadows::from_str(shadows.name(), false), Ok(shadows));
        }
        for shadows in Shadows::OURS {
            assert_eq!(Shadows::of(shadows.method()), shadows);
            assert!(shadows.is_exact() && shadows.rival().is_none());
        }
        for rays in [Rays::Bvh, Rays::Grid] {
            assert_eq!(Rays::from_str(rays.name(), false), Ok(rays));
        }
    }
}
