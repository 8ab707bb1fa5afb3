//! What was typed after `antumbra bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::failure::Failure;
use crate::outputs::{Content, Outputs};
use crate::typed::{IndexCost, SceneFile, Shadows as Method, Threads, Up};
use crate::values::{self, CameraParts, PointLight, Sun};

use super::record::Aim;

#[derive(Args, Debug)]
pub(crate) struct Bench {
    #[command(subcommand)]
    pub(crate) what: What,
}

#[derive(Debug, Subcommand)]
pub(crate) enum What {
    /// Time recorded shadow queries, and judge every different answer
    Shadows(Shadows),
    /// Time frame after frame from the first query on, with values that are made on the way
    Frames(Frames),
    /// Rebuild the tables of the paper on its scenes
    Paper(Paper),
    /// Time a second process to its first million answers, with a file of values and without
    Kept(super::kept::Kept),
    /// Count rays that leak through the vertices and edges they are aimed at
    Watertight(Watertight),
}

/// Scenes and the light to ask about.
#[derive(Args, Debug)]
pub(crate) struct LightOfScenes {
    /// Which axis is up, for formats that do not say, default cameras and suns
    #[arg(long, value_name = "AXIS")]
    up: Option<Up>,

    /// Light instead of the files' lights: point:X,Y,Z
    #[arg(long, value_name = "LIGHT", value_parser = values::light)]
    light: Option<PointLight>,

    /// Sun instead of the files' lights, in degrees: azimuth clockwise from north, elevation
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::sun, allow_hyphen_values = true, conflicts_with = "light")]
    sun: Option<Sun>,
}

impl LightOfScenes {
    /// Returns what would have been typed for one scene alone.
    pub(super) fn file(&self, scene: &std::path::Path) -> SceneFile {
        SceneFile {
            scene: scene.to_owned(),
            up: self.up,
            lights: self.light.into_iter().collect(),
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
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) light: LightOfScenes,

    /// Which of a scene's lights to ask about, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) light_number: usize,

    /// Camera: eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES [default: the file's, else one that frames
    /// the scene]
    #[arg(long, value_name = "PARTS", value_parser = values::camera)]
    pub(crate) camera: Option<CameraParts>,

    /// Judge at most so many different answers a scene and set of queries by testing every surface
    #[arg(long, value_name = "N", default_value_t = 200)]
    pub(crate) judge: usize,

    /// Changes what is random: shuffling, jitter and free points
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u64,

    /// Write figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    /// Threads that build and answer; with 1 their processor time is measured, with more the
    /// time on the wall
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: u16,
}

impl Subjects {
    /// Returns what is written, which is none of the scenes.
    pub(super) fn outputs(&self) -> Result<Outputs, Failure> {
        let mut outputs = Outputs::none();
        outputs.add_if("--json", self.json.as_ref(), Content::Json)?;
        outputs.spare(&self.scenes)?;
        Ok(outputs)
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

    /// Frame whose eye rays hit what is asked about
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub(crate) size: [u32; 2],

    /// Time this method only; repeatable [default: all of ours but naive]
    #[arg(long = "shadows", value_enum, value_name = "METHOD")]
    pub(crate) methods: Vec<Method>,

    /// Rounds; in each, all methods take turns. Figures are medians
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Say how many queries lie in voxels of a 64^3 and a 256^3 grid whose surface points all
    /// have one answer
    #[arg(long)]
    pub(crate) oracle: bool,
}

#[derive(Args, Debug)]
pub(crate) struct Frames {
    #[command(flatten)]
    pub(crate) subjects: Subjects,

    /// Size of each frame
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1024x1024")]
    pub(crate) size: [u32; 2],

    /// Frames of the fly-around, once around the scene, a sample a pixel each
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=9999))]
    pub(crate) frames: u32,

    /// Samples a pixel of the still frame, asked one after the other for all pixels
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) samples: u32,

    /// Rounds; each has its own indices, which begin without values; in each frame all methods
    /// take turns. Figures are medians
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,
}

#[derive(Args, Debug)]
pub(crate) struct Paper {
    /// Measure this scene of the paper only; repeatable [default: all six]
    #[arg(long = "scene", value_name = "NAME", value_parser = super::paper::NAMES)]
    pub(crate) scenes: Vec<String>,

    /// Size of the picture
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "512x512")]
    pub(crate) size: [u32; 2],

    /// Rounds; in each, all methods prepare anew and take turns. Figures are medians
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Rounds for each grid level, picture size and number of lights
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) sweep_rounds: u32,

    /// Leave out grid levels, picture sizes and numbers of lights
    #[arg(long)]
    pub(crate) no_sweeps: bool,

    /// Write figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,

    /// Write the report into this folder: index.html with plots and pictures, README.md
    #[arg(long, value_name = "DIR")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct Watertight {
    /// Files of closed meshes beside the built-in height field and sphere
    #[arg(value_name = "MESH")]
    pub(crate) meshes: Vec<PathBuf>,

    #[command(flatten)]
    pub(crate) light: LightOfScenes,

    /// Write figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) cost: IndexCost,

    #[command(flatten)]
    pub(crate) threads: Threads,
}
