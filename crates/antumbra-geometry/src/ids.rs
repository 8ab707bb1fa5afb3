//! Names of surfaces and elements.

/// Names one surface: a triangle of a face, a sphere, a tube (cone wall) or a disk.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::TransparentWrapper,
)]
#[repr(transparent)]
pub struct SurfaceId(pub u32);

impl SurfaceId {
    /// Returns the numbers of some surfaces, without a copy.
    pub fn numbers(surfaces: &[Self]) -> &[u32] {
        bytemuck::TransparentWrapper::peel_slice(surfaces)
    }
}

impl From<u32> for SurfaceId {
    fn from(number: u32) -> Self {
        Self(number)
    }
}

/// Names one element: a face, a sphere, a cone or a disk. Numbered in the order of adding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ElementId(pub u32);
