//! Methods, by the names that are typed: who answers shadow queries, who judges, what finds nearest hits.

use antumbra::{Method, RayMethod};
use clap::ValueEnum;

/// Method that answers shadow queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Shadows {
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
}

impl std::fmt::Display for Shadows {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl Shadows {
    /// All of them: each gives the reference's answers.
    pub const ALL: [Self; 6] = [
        Self::Auto,
        Self::Voxel,
        Self::Voxel1990,
        Self::Grid,
        Self::Bvh,
        Self::Naive,
    ];

    /// Returns the library's method.
    pub fn method(self) -> Method {
        match self {
            Self::Voxel1990 => Method::Voxel1990,
            Self::Auto => Method::Auto,
            Self::Voxel => Method::Voxel,
            Self::Grid => Method::Grid,
            Self::Bvh => Method::Bvh,
            Self::Naive => Method::Naive,
        }
    }

    /// Returns the name of a method; `auto` for one that has none here.
    pub fn of(method: Method) -> Self {
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
    pub fn name(self) -> &'static str {
        match self {
            Self::Voxel1990 => "voxel-1990",
            Self::Auto => "auto",
            Self::Voxel => "voxel",
            Self::Grid => "grid",
            Self::Bvh => "bvh",
            Self::Naive => "naive",
        }
    }
}

/// Method that `verify` compares answers with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Against {
    /// A test of every surface
    #[default]
    Reference,
    /// A ray through the bounding volume hierarchy: as exact, and fast enough for many millions
    Bvh,
}

/// Method that finds the nearest hit of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Rays {
    /// The bounding volume hierarchy
    #[default]
    Bvh,
    /// The uniform grid
    Grid,
}

impl Rays {
    pub fn method(self) -> RayMethod {
        match self {
            Self::Bvh => RayMethod::Bvh,
            Self::Grid => RayMethod::Grid,
        }
    }

    /// Returns the name as it is typed.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bvh => "bvh",
            Self::Grid => "grid",
        }
    }
}

/// An axis that can be up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Up {
    Y,
    Z,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_what_is_typed() {
        for &shadows in Shadows::value_variants() {
            assert_eq!(Shadows::from_str(shadows.name(), false), Ok(shadows));
        }
        assert_eq!(Shadows::ALL.len(), Shadows::value_variants().len());
        for shadows in Shadows::ALL {
            assert_eq!(Shadows::of(shadows.method()), shadows);
        }
        for rays in [Rays::Bvh, Rays::Grid] {
            assert_eq!(Rays::from_str(rays.name(), false), Ok(rays));
        }
    }
}
