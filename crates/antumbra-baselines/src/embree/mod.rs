//! Embree 4, loaded at run time.
//!
//! | step | module |
//! |---|---|
//! | where the library is | `find` |
//! | calls into it, the only unsafe code | `library` |
//! | a scene as Embree takes it, `f32` | [`Geometry`] |
//! | queries as Embree takes them, `f32` | `rays` |
//!
//! Fairness: medium build quality; no robust flag unless asked; rays are converted before, and
//! copied one by one only because Embree writes into them. A start on a surface is lifted off it by
//! 2^-18 of the scene's largest coordinate, 64 roundings of it in `f32`; a point light ends the ray
//! at its full length. Packets carry the coherent flag where the batch is coherent.

mod error;
mod find;
mod geometry;
#[expect(unsafe_code, reason = "calls into a library loaded at run time")]
mod library;
mod rays;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use geometry::Geometry;

use crate::{Batch, LoadedBatch, ShadowMethod, TargetBatch};
pub use error::EmbreeError;
use library::{BuiltScene, Device, Library};
use rays::{Packet, RayToLight};

/// A device of an Embree that was found.
#[derive(Debug)]
pub struct Embree {
    device: Arc<Device>,
    path: PathBuf,
}

impl Embree {
    /// Finds and loads Embree: the file that `ANTUMBRA_EMBREE` names and no other, or else the one
    /// in a Python environment's `embreex.libs`, or else the system's.
    ///
    /// # Errors
    /// There is none, it is not Embree 4, or it refuses `thread_count` threads.
    pub fn load(thread_count: usize) -> Result<Self, EmbreeError> {
        let tried = find::candidates();
        let mut unusable = None;
        for path in &tried {
            match Library::open(path) {
                Ok(library) => {
                    return Ok(Self {
                        device: Arc::new(Device::new(library, thread_count)?),
                        path: path.clone(),
                    });
                }
                Err(message) if path.is_file() => {
                    let path = path.clone();
                    unusable.get_or_insert(EmbreeError::Unusable { path, message });
                }
                Err(_) => {}
            }
        }
        Err(unusable.unwrap_or(EmbreeError::NotFound { tried }))
    }

    /// Returns where the library is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Builds a scene of medium quality.
    ///
    /// # Errors
    /// Embree refuses, as for want of memory.
    pub fn build(&self, geometry: &Geometry, is_robust: bool) -> Result<EmbreeScene, EmbreeError> {
        Ok(EmbreeScene {
            scene: BuiltScene::new(&self.device, geometry, is_robust)?,
            lift: geometry.largest_coordinate() / 262_144.0,
        })
    }
}

/// A scene that Embree has built.
#[derive(Debug)]
pub struct EmbreeScene {
    scene: BuiltScene,
    /// How far starts are lifted off their surfaces.
    lift: f64,
}

impl EmbreeScene {
    /// Returns the methods that ask by each way, those of [`EmbreeWay::ALL`].
    pub fn methods(&self) -> [EmbreeMethod<'_>; 3] {
        EmbreeWay::ALL.map(|way| self.method(way))
    }

    /// Returns the method that asks by a way.
    pub fn method(&self, way: EmbreeWay) -> EmbreeMethod<'_> {
        EmbreeMethod { scene: self, way }
    }

    fn load(
        &self,
        rays: impl Iterator<Item = RayToLight>,
        way: EmbreeWay,
        is_coherent: bool,
    ) -> Box<dyn LoadedBatch + '_> {
        let scene = &self.scene;
        let rays: Vec<_> = rays.collect();
        match way {
            EmbreeWay::Single => Box::new(LoadedSingle { scene, rays }),
            EmbreeWay::Packets8 => Box::new(LoadedPackets::<8> {
                scene,
                packets: rays.chunks(8).map(Packet::of).collect(),
                is_coherent,
            }),
            EmbreeWay::Packets16 => Box::new(LoadedPackets::<16> {
                scene,
                packets: rays.chunks(16).map(Packet::of).collect(),
                is_coherent,
            }),
        }
    }
}

/// How Embree is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmbreeWay {
    /// `rtcOccluded1`, a query after the other.
    Single,
    /// `rtcOccluded8`, neighbouring queries together.
    Packets8,
    /// `rtcOccluded16`, as eight.
    Packets16,
}

impl EmbreeWay {
    /// All ways.
    pub const ALL: [Self; 3] = [Self::Single, Self::Packets8, Self::Packets16];

    /// Returns the name of rows and figures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "embree",
            Self::Packets8 => "embree8",
            Self::Packets16 => "embree16",
        }
    }
}

/// Embree, asked by one of its ways.
#[derive(Clone, Copy, Debug)]
pub struct EmbreeMethod<'a> {
    scene: &'a EmbreeScene,
    way: EmbreeWay,
}

impl ShadowMethod for EmbreeMethod<'_> {
    fn name(&self) -> &str {
        self.way.name()
    }

    fn load<'a>(&'a self, batch: &'a Batch) -> Box<dyn LoadedBatch + 'a> {
        let rays = rays::rays_of(batch, self.scene.lift);
        self.scene.load(rays, self.way, batch.is_coherent)
    }
}

struct LoadedSingle<'a> {
    scene: &'a BuiltScene,
    rays: Vec<RayToLight>,
}

impl LoadedBatch for LoadedSingle<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        let rays = &self.rays[first..first + is_shadowed.len()];
        for (&ray, is_shadowed) in rays.iter().zip(is_shadowed) {
            *is_shadowed = self.scene.is_occluded(ray);
        }
    }
}

struct LoadedPackets<'a, const N: usize> {
    scene: &'a BuiltScene,
    packets: Vec<Packet<N>>,
    is_coherent: bool,
}

impl<const N: usize> LoadedPackets<'_, N> {
    /// Answers by whole packets.
    fn answer_by(
        &self,
        first: usize,
        is_shadowed: &mut [bool],
        ask: impl Fn(&Packet<N>) -> [bool; N],
    ) {
        assert!(
            first.is_multiple_of(N),
            "packets begin at multiples of their size"
        );
        let packets = &self.packets[first / N..];
        assert!(is_shadowed.len().div_ceil(N) <= packets.len());
        for (packet, is_shadowed) in packets.iter().zip(is_shadowed.chunks_mut(N)) {
            let found = ask(packet);
            is_shadowed.copy_from_slice(&found[..is_shadowed.len()]);
        }
    }
}

impl LoadedBatch for LoadedPackets<'_, 8> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        self.answer_by(first, is_shadowed, |packet| {
            self.scene.are_occluded8(packet, self.is_coherent)
        });
    }
}

impl LoadedBatch for LoadedPackets<'_, 16> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        self.answer_by(first, is_shadowed, |packet| {
            self.scene.are_occluded16(packet, self.is_coherent)
        });
    }
}

impl EmbreeScene {
    /// Brings starts with their targets into the form that a way takes. A query is a pair of a start and a target;
    /// those of a start lie together.
    pub fn load_targets<'a>(
        &'a self,
        batch: &TargetBatch,
        way: EmbreeWay,
    ) -> Box<dyn LoadedBatch + 'a> {
        // Samples of one light lie close together.
        self.load(rays::rays_to(batch, self.lift), way, true)
    }
}
