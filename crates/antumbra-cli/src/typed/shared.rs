//! Options that several commands share: the scene and its lights, what an index costs, threads.

use std::path::PathBuf;

use antumbra::{GridResolution, Refine, Refinement};
use antumbra_scene::model::Color;
use clap::{Args, ValueEnum};

use crate::light_values::{self, LightValue};
use crate::methods::Up;
use crate::values::{self, Sun};

/// Help of `--sun`, which says where north is.
pub const SUN_HELP: &str = "Sun that replaces the file's lights, in degrees: azimuth clockwise from north as seen from above, \
     and elevation above the horizon. With z up, north is +y and east is +x; with y up, north is -z \
     and east is +x";

/// Help of `--sun` where it may have a size.
pub const SUN_WITH_SIZE_HELP: &str = "Sun that replaces the file's lights, in degrees: azimuth clockwise from north as seen from above, \
     elevation above the horizon, and for render, query, verify and inspect its angular diameter (0.53 seen from the Earth), for soft shadows. With \
     z up, north is +y and east is +x; with y up, north is -z and east is +x";

/// Lights of pictures and queries that other commands do not take.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scene and lights")]
pub struct MoreLights {
    /// JSON file of lights that replace the file's, with size and without; docs/lights.md describes it
    #[arg(long = "lights", value_name = "FILE.json")]
    pub file: Option<PathBuf>,

    /// Make lights with size of faces that emit (glTF's emissiveFactor, MTL's Ke), one for each object
    #[arg(long = "emissive-lights")]
    pub emissive: bool,

    #[command(flatten)]
    pub soft: crate::soft::SoftShadows,
}

/// The scene and its lights.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scene and lights")]
pub struct SceneFile {
    /// Scene file; its ending says the format: .nff, .obj, .gltf, .glb, .ply or .stl
    pub scene: PathBuf,

    /// Axis that points up, for default cameras and suns; the scene is not turned [default: that of
    /// the format: y for OBJ and glTF, z for PLY and STL, the file's for NFF]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<Up>,

    /// Curved shapes as meshes: twice N sides around, N cells along a patch (rounded up to a power of two) or a box of an
    /// implicit surface. Shadows get polygonal outlines
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub tessellate: Option<u32>,

    /// Light that replaces the file's lights; repeatable. point:X,Y,Z; sun:AZIMUTH,ELEVATION as of --sun;
    /// spot:X,Y,Z/AXIS/INNER,OUTER (half-angles in degrees). With size, for render, query, verify and inspect:
    /// area:CENTER/EDGE1/EDGE2 (shines to the side of EDGE1 x EDGE2), disk:CENTER/NORMAL/RADIUS,
    /// sphere:X,Y,Z,RADIUS, segment:END/END, sun:AZIMUTH,ELEVATION,DIAMETER, sky or sky:R,G,B. All take /R,G,B behind; area and disk also
    /// /both, to shine to both sides
    #[arg(long = "light", value_name = "LIGHT", value_parser = light_values::light, allow_hyphen_values = true)]
    pub lights: Vec<LightValue>,

    #[arg(long, help = SUN_WITH_SIZE_HELP, value_name = "AZIMUTH,ELEVATION[,DIAMETER]", value_parser = values::sun_with_size, allow_hyphen_values = true)]
    pub sun: Option<Sun>,

    /// Color behind the scene, linear RGB [default: the file's; for formats that have none a
    /// grey-blue, and black where lights are in candela and lux]
    #[arg(long, value_name = "R,G,B", value_parser = values::background, allow_hyphen_values = true)]
    pub background: Option<Color>,
}

/// Options about the cost of a scene and its index.
#[derive(Args, Debug)]
#[command(next_help_heading = "Index and memory")]
pub struct IndexCost {
    /// Resolution of the uniform grid in voxels: N or NxNxN [default: by Woo's rule]
    #[arg(long, value_name = "N", value_parser = values::grid)]
    pub grid: Option<GridResolution>,

    /// Memory limit, such as 2GiB; work that is predicted to need more is refused [default: three
    /// quarters of the machine's]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub memory_limit: Option<u64>,

    /// Resolution of the finest voxels of method voxel along the longest axis [default: 2048]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=4096))]
    pub resolution: Option<u32>,

    /// Longest lists of potential blockers of method voxel: SHORT in voxels that could be subdivided,
    /// LONG in the finest ones; 0 disables lists; points of space use eight times SHORT [default: 3,32, and 8 for points of space]
    #[arg(long, value_name = "SHORT,LONG", value_parser = values::lists)]
    pub lists: Option<[usize; 2]>,

    /// When method voxel computes its values, and auto its maps [default: lazy; eager for verify, inspect, bake and export]
    #[arg(long, value_name = "WHEN", value_enum)]
    pub refine: Option<RefineWhen>,

    /// Memory for all that lights know of methods auto and voxel, such as 64MiB, up to 4GiB. What does not fit is computed
    /// again when needed, or rays answer; answers do not change [default: 512MiB]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub occlusion_memory: Option<u64>,
}

/// When methods `voxel` and `auto` compute what they know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RefineWhen {
    /// While queries are answered, where it is predicted to save time
    Lazy,
    /// While queries are answered, at the first query of each voxel
    #[value(alias = "asked")]
    Queried,
    /// All of them before the first query
    Eager,
}

impl IndexCost {
    /// Returns how far method `voxel` refines its values.
    pub fn refinement(&self, usual: Refine) -> Refinement {
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
            Some(RefineWhen::Queried) => Refine::Queried,
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
#[command(next_help_heading = "Threads")]
pub struct Threads {
    /// Number of threads [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}
