//! Checksums of what is in a file: they detect damage.
//!
//! In: bytes or words. Out: 16 bytes (XXH3, 128 bits), as fast to make as memory is to read.

use twox_hash::XxHash3_128;

pub(super) type Checksum = [u8; 16];

/// Returns the checksum of bytes.
pub(super) fn of_bytes(bytes: &[u8]) -> Checksum {
    XxHash3_128::oneshot(bytes).to_le_bytes()
}

/// Returns the checksum of words as they are in a file, one run behind the other, the lowest byte first.
pub(super) fn of_runs<'a>(runs: impl IntoIterator<Item = &'a [u32]>) -> Checksum {
    let mut hasher = XxHash3_128::new();
    for words in runs {
        if cfg!(target_endian = "little") {
            hasher.write(bytemuck::cast_slice(words));
            continue;
        }
        for words in words.chunks(1 << 12) {
            let turned: Vec<u32> = words.iter().map(|word| word.to_le()).collect();
            hasher.write(bytemuck::cast_slice(&turned));
        }
    }
    hasher.finish_128().to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_have_the_checksum_of_their_bytes() {
        let words: Vec<u32> = (0..5000_u32)
            .map(|word| word.wrapping_mul(0x9e37_79b9))
            .collect();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        for cut in [0, 1, 7, 4999, 5000] {
            let (first, second) = words.split_at(cut);
            assert_eq!(of_runs([first, second]), of_bytes(&bytes));
        }
        // So that files made elsewhere are read here (xxhsum -H2).
        assert_eq!(
            of_bytes(b"")[..],
            0x99aa_06d3_0147_98d8_6001_c324_468d_497f_u128.to_le_bytes()
        );
    }
}
