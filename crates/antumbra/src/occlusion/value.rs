//! The paper's occlusion values in two bits; the only file that knows the bits.

/// What is known of all starts of one kind in a voxel, for one light (Paper 6, 6.2).
///
/// A dense store keeps one value per voxel for starts of all kinds. A store of bricks keeps one per
/// [`ReceiverClass`], and knows by it whom the value speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occlusion {
    /// `00`. Every start is lit. In a dense store, for a voxel with surfaces (the paper's *null one*):
    /// every point of its surfaces is lit that no own rule shadows; points between are not known.
    Null,
    /// `01`. Every start is in shadow.
    Full,
    /// `10`. Starts differ, or nothing is known of them. In a store of bricks finer voxels may say more,
    /// and a list of the few possible blockers until then.
    Complicated,
    /// `11`, in stores of bricks. As complicated, but there will be no finer voxels: there is a list, or
    /// rays answer.
    Listed,
}

/// Starts that values speak of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReceiverClass {
    /// Starts on surfaces, the light on the side of the normal.
    Front,
    /// Starts on surfaces, the light behind.
    Back,
    /// All points of space.
    Free,
}

impl ReceiverClass {
    pub(crate) const ALL: [Self; 3] = [Self::Front, Self::Back, Self::Free];
}

impl Occlusion {
    pub(crate) const fn bits(self) -> u8 {
        match self {
            Self::Null => 0b00,
            Self::Full => 0b01,
            Self::Complicated => 0b10,
            Self::Listed => 0b11,
        }
    }

    pub(crate) const fn from_bits(bits: u8) -> Self {
        match bits & 0b11 {
            0b00 => Self::Null,
            0b01 => Self::Full,
            0b10 => Self::Complicated,
            _ => Self::Listed,
        }
    }

    /// Returns the value of starts that all have one answer.
    pub(crate) const fn known(is_shadowed: bool) -> Self {
        if is_shadowed { Self::Full } else { Self::Null }
    }

    /// Returns whether starts on surfaces in the voxel are in shadow, `None` if not known (first
    /// pass).
    pub(crate) const fn of_surface_point(self) -> Option<bool> {
        match self {
            Self::Null => Some(false),
            Self::Full => Some(true),
            Self::Complicated | Self::Listed => None,
        }
    }

    /// Returns whether any point of a voxel of a dense store is in shadow, `None` if not known
    /// (intermediate test and free queries).
    pub(crate) const fn of_any_point(self, holds_surface: bool) -> Option<bool> {
        match self {
            Self::Full => Some(true),
            Self::Null if !holds_surface => Some(false),
            _ => None,
        }
    }
}

/// Sixty-four values, a bit plane for each bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Values64 {
    low: u64,
    high: u64,
}

impl Values64 {
    pub(crate) fn set(&mut self, place: u32, value: Occlusion) {
        let bits = value.bits();
        let put = |plane: u64, bit: u8| plane & !(1 << place) | u64::from(bit & 1) << place;
        self.low = put(self.low, bits);
        self.high = put(self.high, bits >> 1);
    }

    /// Returns the planes in words, the lower values first.
    pub(crate) fn words(&self) -> [u32; 4] {
        let Self { low, high } = *self;
        [
            low as u32,
            (low >> 32) as u32,
            high as u32,
            (high >> 32) as u32,
        ]
    }

    /// Returns how many values of the planes' words are complicated or listed.
    pub(crate) fn undecided(planes: &[u32; 4]) -> usize {
        (planes[2].count_ones() + planes[3].count_ones()) as usize
    }

    /// Reads one value from the planes' words, and how many before it are complicated or listed.
    #[inline(always)]
    pub(crate) fn read(place: u32, word: impl Fn(usize) -> u32) -> (Occlusion, usize) {
        let (half, bit) = ((place >> 5) as usize, place & 31);
        let (low, high) = (word(half), word(2 + half));
        let bits = low >> bit & 1 | (high >> bit & 1) << 1;
        // All of the lower half, if the value is in the upper.
        let lower = word(2) & 0_u32.wrapping_sub(half as u32);
        let before = (high & ((1 << bit) - 1)).count_ones() + lower.count_ones();
        (Occlusion::from_bits(bits as u8), before as usize)
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
        assert_eq!(Occlusion::Listed.of_any_point(true), None);
        assert_eq!(Occlusion::Full.of_surface_point(), Some(true));
    }

    #[test]
    fn sixty_four_values_are_kept_and_counted() {
        let value = |place: u32| Occlusion::from_bits((place * 7 % 5 % 4) as u8);
        let mut values = Values64::default();
        for place in (0..64).rev() {
            values.set(place, Occlusion::Listed);
            values.set(place, value(place));
        }
        let words = values.words();
        let mut undecided = 0;
        for place in 0..64 {
            let (read, before) = Values64::read(place, |word| words[word]);
            assert_eq!((read, before), (value(place), undecided));
            undecided += usize::from(read.of_surface_point().is_none());
        }
        assert_eq!(Values64::undecided(&words), undecided);
    }
}
