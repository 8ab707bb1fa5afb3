//! Inputs of rivals, and code that they share.

use antumbra::{Answer, Counters, Decided, QueryError, Shadow, ShadowIndex};
use antumbra_geometry::{DVec3, ReceiverPoint, Segment};
use std::fmt;

use super::formulas::PaperMemory;

/// The rivals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RivalKind {
    /// A grid of directions round the light with sorted candidates.
    LightBuffer,
    /// Shadow polygons in the voxels of the grid, or a walk where they are many.
    Hybrid,
    /// The number of shadow volumes that hold the start.
    ShadowVolumes,
    /// A depth buffer seen from the light: not exact.
    ShadowMap,
}

impl RivalKind {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::LightBuffer,
        Self::Hybrid,
        Self::ShadowVolumes,
        Self::ShadowMap,
    ];

    /// Returns the name for tables and command lines.
    pub fn name(self) -> &'static str {
        match self {
            Self::LightBuffer => "light-buffer",
            Self::Hybrid => "hybrid",
            Self::ShadowVolumes => "shadow-volumes",
            Self::ShadowMap => "shadow-map",
        }
    }

    /// Returns whether its answers are the reference's.
    pub fn is_exact(self) -> bool {
        self != Self::ShadowMap
    }
}

/// Options of rivals.
#[derive(Clone, Copy, Debug)]
pub struct RivalOptions {
    /// Viewpoint, world space: `hybrid` counts from there.
    pub viewpoint: Option<DVec3>,
    /// The most shadow polygons that `hybrid` tests before it sends a shadow ray; without it what costs least for
    /// some sample queries.
    pub most_polygons: Option<u64>,
    /// Cells along each side of a plane of `light-buffer`, rounded up to a power of two, at most 4096;
    /// without it the number of surfaces tells.
    pub buffer_resolution: Option<u32>,
    /// Texels along each side of a plane of `shadow-map`, 1 to 8192.
    pub map_resolution: u32,
    /// Most bytes that the rival may keep for all lights together.
    pub memory_limit: u64,
}

impl Default for RivalOptions {
    fn default() -> Self {
        Self {
            viewpoint: None,
            most_polygons: None,
            buffer_resolution: None,
            map_resolution: 1024,
            memory_limit: u64::MAX,
        }
    }
}

/// Why a rival cannot be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RivalError {
    /// It grew beyond what it may take. Nobody knows before.
    #[error("{} needs more than the {limit} bytes that it may take", kind.name())]
    Memory {
        /// Who.
        kind: RivalKind,
        /// Allowed bytes.
        limit: u64,
    },
}

/// Cost of queries to a rival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Steps: cells looked up, and voxels entered. Intersections: surfaces asked of the exact rule, shadow
    /// polygons and shadow volumes tested.
    pub counters: Counters,
    /// Surfaces, shadow polygons or shadow volumes that were listed where the queries looked.
    pub candidates: u64,
}

impl Work {
    /// Adds another count to this one.
    pub fn add(&mut self, other: &Self) {
        self.counters.add(&other.counters);
        self.candidates += other.candidates;
    }
}

/// A rival, ready for the queries of one index.
pub trait Rival: fmt::Debug + Send + Sync {
    /// Returns who it is.
    fn kind(&self) -> RivalKind;

    /// Answers one query; counts under `work`, the answer under `work.counters.shadow`. `index` is the one
    /// that the rival was built for.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    fn shadow(
        &self,
        index: &ShadowIndex,
        start: &ReceiverPoint,
        light: usize,
        work: &mut Work,
    ) -> Result<Answer, QueryError>;

    /// Returns the bytes kept for one light, beside surfaces, grid and tree.
    ///
    /// # Panics
    /// There is no such light.
    fn bytes(&self, light: usize) -> u64;

    /// Returns what the paper expects it to keep for one light, where it says.
    fn paper_memory(&self, index: &ShadowIndex) -> Option<PaperMemory>;
}

pub(super) fn answer(is_shadowed: bool, decided: Decided) -> Answer {
    Answer {
        shadow: if is_shadowed {
            Shadow::Shadowed
        } else {
            Shadow::Lit
        },
        decided,
    }
}

/// Answers by the exact rule for some surfaces, in order, up to the first that blocks.
pub(super) fn any_blocks(
    index: &ShadowIndex,
    segment: &Segment,
    surfaces: impl IntoIterator<Item = antumbra_geometry::SurfaceId>,
    work: &mut Work,
) -> bool {
    surfaces.into_iter().any(|surface| {
        work.counters.intersections += 1;
        index.occluders().blocks(surface, segment)
    })
}

/// Answers by the exact rule for all surfaces: where a rival has nothing to say.
pub(super) fn by_all(index: &ShadowIndex, segment: &Segment, work: &mut Work) -> Answer {
    let all = index.occluders().surfaces();
    answer(any_blocks(index, segment, all, work), Decided::Ray)
}
