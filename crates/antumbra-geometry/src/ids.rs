//! Names of surfaces, elements and lights.

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

/// Names one light of an index by its place in the list of lights, counted from 0.
///
/// Lights with size are no lights of an index and have no number.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::TransparentWrapper,
)]
#[repr(transparent)]
pub struct LightId(pub u32);

impl LightId {
    /// Returns the name of the light at a place of a list.
    ///
    /// # Panics
    /// The place is 2^32 or more: no list of lights has it.
    pub fn from_index(index: usize) -> Self {
        Self(u32::try_from(index).expect("lights are numbered in 32 bits"))
    }

    /// Returns the light's place in the list of lights.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Returns the numbers of some lights, without a copy.
    pub fn numbers(lights: &[Self]) -> &[u32] {
        bytemuck::TransparentWrapper::peel_slice(lights)
    }

    /// Returns the lights that some numbers name, without a copy.
    pub fn from_numbers(numbers: &[u32]) -> &[Self] {
        bytemuck::TransparentWrapper::wrap_slice(numbers)
    }
}

impl From<u32> for LightId {
    fn from(number: u32) -> Self {
        Self(number)
    }
}

impl std::fmt::Display for LightId {
    /// Writes the number alone.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
