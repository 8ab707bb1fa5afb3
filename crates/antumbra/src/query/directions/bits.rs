//! Bits of 64 starts for 64 directions, turned.

/// Turns a square of bits: bit `i` of word `j` becomes bit `j` of word `i`.
#[inline]
pub(super) fn transpose(words: &mut [u64; 64]) {
    let mut width = 32;
    let mut mask = u64::MAX >> 32;
    while width != 0 {
        let mut row = 0;
        while row < 64 {
            for i in row..row + width {
                let swapped = (words[i] >> width ^ words[i + width]) & mask;
                words[i + width] ^= swapped;
                words[i] ^= swapped << width;
            }
            row += 2 * width;
        }
        width /= 2;
        mask ^= mask << width;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_columns() {
        let words: [u64; 64] =
            std::array::from_fn(|i| (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut turned = words;
        transpose(&mut turned);
        for (i, word) in words.iter().enumerate() {
            for (j, column) in turned.iter().enumerate() {
                assert_eq!(word >> j & 1, column >> i & 1);
            }
        }
    }
}
