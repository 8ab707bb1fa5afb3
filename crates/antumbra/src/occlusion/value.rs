//! The paper's occlusion values in two bits; the only file that knows the bits.

/// What is known of all starts in a voxel, for one light (Paper 6, 6.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occlusion {
    /// `00`. In a voxel without surfaces: every point is lit. In a voxel with surfaces (the paper's
    /// *null one*): every point of its surfaces is lit that no own rule shadows; points between are
    /// not known.
    Null,
    /// `01`. Every point is in shadow.
    Full,
    /// `10`. Nothing is known.
    Complicated,
    /// `11`. Every point of the voxel's surfaces is in shadow; points between are not known.
    SurfacesFull,
}

impl Occlusion {
    pub(crate) const fn bits(self) -> u8 {
        match self {
            Self::Null => 0b00,
            Self::Full => 0b01,
            Self::Complicated => 0b10,
            Self::SurfacesFull => 0b11,
        }
    }

    pub(crate) const fn from_bits(bits: u8) -> Self {
        match bits & 0b11 {
            0b00 => Self::Null,
            0b01 => Self::Full,
            0b10 => Self::Complicated,
            _ => Self::SurfacesFull,
        }
    }

    /// Returns whether starts on surfaces in the voxel are in shadow, `None` if not known (first
    /// pass).
    pub(crate) const fn of_surface_point(self) -> Option<bool> {
        match self {
            Self::Null => Some(false),
            Self::Full | Self::SurfacesFull => Some(true),
            Self::Complicated => None,
        }
    }

    /// Returns whether any point of the voxel is in shadow, `None` if not known (intermediate test
    /// and free queries).
    pub(crate) const fn of_any_point(self, holds_surface: bool) -> Option<bool> {
        match self {
            Self::Full => Some(true),
            Self::Null if !holds_surface => Some(false),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_round_trip() {
        for bits in 0..4 {
            assert_eq!(Occlusion::from_bits(bits).bits(), bits);
        }
    }

    #[test]
    fn null_one_says_nothing_about_free_points() {
        assert_eq!(Occlusion::Null.of_any_point(false), Some(false));
        assert_eq!(Occlusion::Null.of_any_point(true), None);
        assert_eq!(Occlusion::SurfacesFull.of_any_point(true), None);
        assert_eq!(Occlusion::SurfacesFull.of_surface_point(), Some(true));
    }
}
