//! Methods, by the names that are typed: who answers shadow queries, who judges, what finds nearest hits.

use antumbra::{Method, RayMethod};
use antumbra_baselines::RivalKind;
use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Who answers shadow queries: our methods, then the rivals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Shadows {
    /// Whatever is fastest: an exact shadow map for each light, where it pays, and rays for the rest
    #[default]
    Auto,
    /// Voxel occlusion testing as published in 1990
    #[value(name = "voxel-1990")]
    Voxel1990,
    /// Exact values in voxels, on any mesh, refined where that saves time; lists of few potential
    /// blockers; rays for the rest
    Voxel,
    /// A walk through the uniform grid for each query
    Grid,
    /// A shadow ray through the bounding volume hierarchy (BVH) for each query
    Bvh,
    /// A test of every surface: the reference
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

/// Returns what reads the name of one of our methods and offers no others.
pub(crate) fn ours() -> impl TypedValueParser<Value = Shadows> {
    let names = Shadows::OURS
        .iter()
        .filter_map(ValueEnum::to_possible_value);
    PossibleValuesParser::new(names).try_map(|name| Shadows::from_str(&name, false))
}

impl std::fmt::Display for Shadows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl Shadows {
    /// Our methods: each gives the reference's answers.
    pub(crate) const OURS: [Self; 6] = [
        Self::Auto,
        Self::Voxel,
        Self::Voxel1990,
        Self::Grid,
        Self::Bvh,
        Self::Naive,
    ];

    /// Returns the method of our own; for rivals the one that their shadow rays are walked by.
    pub(crate) fn method(self) -> Method {
        match self {
            Self::Voxel1990 => Method::Voxel1990,
            Self::Auto => Method::Auto,
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
            Self::Auto | Self::Voxel1990 | Self::Voxel | Self::Grid | Self::Bvh | Self::Naive => {
                None
            }
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

    /// Returns the name of a method; `auto` for one that has none here.
    pub(crate) fn of(method: Method) -> Self {
        match method {
            Method::Voxel1990 => Self::Voxel1990,
            Method::Voxel => Self::Voxel,
            Method::Grid => Self::Grid,
            Method::Bvh => Self::Bvh,
            Method::Naive => Self::Naive,
            _ => Self::Auto,
        }
    }

    /// Returns the name as it is typed.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Voxel1990 => "voxel-1990",
            Self::Auto => "auto",
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

/// Method that `verify` compares answers with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Against {
    /// A test of every surface
    #[default]
    Reference,
    /// A ray through the bounding volume hierarchy: as exact, and fast enough for many millions
    Bvh,
}

/// Method that finds the nearest hit of a ray.
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

#[cfg(test)]
mod tests {
    use super::*;

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
