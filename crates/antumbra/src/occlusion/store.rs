//! One light's values for every voxel, two bits each (Paper 6.1).

use super::Occlusion;

/// Two bits for each voxel of a grid.
#[derive(Debug)]
pub(crate) struct DenseValues {
    words: Vec<u64>,
}

const VALUES_PER_WORD: usize = 32;

impl DenseValues {
    /// Packs the values, in the order of the voxels.
    pub(crate) fn pack(values: impl ExactSizeIterator<Item = Occlusion>) -> Self {
        let mut words = vec![0u64; values.len().div_ceil(VALUES_PER_WORD)];
        for (i, value) in values.enumerate() {
            words[i / VALUES_PER_WORD] |= u64::from(value.bits()) << (2 * (i % VALUES_PER_WORD));
        }
        Self { words }
    }

    pub(crate) fn get(&self, voxel: usize) -> Occlusion {
        let word = self.words[voxel / VALUES_PER_WORD];
        Occlusion::from_bits((word >> (2 * (voxel % VALUES_PER_WORD))) as u8)
    }

    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }

    /// Returns the bytes for a number of voxels: `2 N^3` bits in whole words.
    pub(crate) fn bytes_for(voxel_count: usize) -> u64 {
        (voxel_count.div_ceil(VALUES_PER_WORD) * size_of::<u64>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_two_bits_per_voxel() {
        let value = |i: usize| Occlusion::from_bits((i * 7 % 4) as u8);
        let store = DenseValues::pack((0..1000).map(value));
        assert!((0..1000).all(|i| store.get(i) == value(i)));
        assert_eq!(store.bytes(), DenseValues::bytes_for(1000));
        // The paper's 2 N^3 bits, for a grid of 40 voxels an axis.
        assert_eq!(DenseValues::bytes_for(40 * 40 * 40) * 8, 2 * 40 * 40 * 40);
    }
}
