//! The memory limit: what it is, and what is left of it after the picture.

use crate::failure::Failure;
use crate::machine;
use crate::values::format_bytes;

/// What to allow where the system does not say how much there is.
const UNKNOWN_MACHINE: u64 = 4 << 30;

/// Returns the limit in bytes: as typed, or three quarters of the machine's memory.
pub(crate) fn limit(typed: Option<u64>) -> u64 {
    typed.unwrap_or_else(|| machine::memory_bytes().map_or(UNKNOWN_MACHINE, |all| all / 4 * 3))
}

/// Returns what is left of `limit` for the index after a picture of `picture_bytes`.
pub(crate) fn left_after(limit: u64, picture_bytes: u64) -> Result<u64, Failure> {
    limit.checked_sub(picture_bytes).ok_or_else(|| {
        Failure::input(
            format!(
                "the picture alone needs {}, more than the limit of {}",
                format_bytes(picture_bytes),
                format_bytes(limit)
            ),
            "give a smaller --size, or raise --memory-limit",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_comes_out_of_the_limit() {
        assert_eq!(left_after(limit(Some(100)), 40), Ok(60));
        assert!(left_after(100, 101).is_err());
        assert!(limit(None) > 0);
    }
}
