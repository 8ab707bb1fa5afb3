//! One number of an accessor.
//!
//! In: bytes, at least as many as the type has. Out: `f64`, which holds every value of every type
//! exactly, or `u32`. Invariant: little-endian on every platform.

/// The type of one number (glTF 2.0, 3.6.2.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// Returns the type of a code.
    pub(super) fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// Returns the number of bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Reads a number from the beginning of `bytes`; with `is_normalized`, integers become
    /// 0 to 1 or -1 to 1 (glTF 2.0, 3.6.2.2; exact but for the division).
    pub(super) fn read(self, bytes: &[u8], is_normalized: bool) -> f64 {
        let whole = |number: f64, largest: f64| {
            if is_normalized {
                (number / largest).max(-1.0)
            } else {
                number
            }
        };
        match self {
            Self::I8 => whole(f64::from(bytes[0].cast_signed()), 127.0),
            Self::U8 => whole(f64::from(bytes[0]), 255.0),
            Self::I16 => whole(f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Self::U16 => whole(f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Self::U32 => f64::from(four(bytes)),
            Self::F32 => f64::from(f32::from_bits(four(bytes))),
        }
    }

    /// Reads an unsigned whole number; other types give 0.
    pub(super) fn read_whole(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => bytes[0].into(),
            Self::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
            Self::U32 => four(bytes),
            Self::I8 | Self::I16 | Self::F32 => 0,
        }
    }

    pub(super) fn is_unsigned(self) -> bool {
        matches!(self, Self::U8 | Self::U16 | Self::U32)
    }
}

fn four(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_normalised_as_the_format_says() {
        for (component, bytes, whole, share) in [
            (Component::I8, &[0x80][..], -128.0, -1.0),
            (Component::I8, &[0x81], -127.0, -1.0),
            (Component::I8, &[127], 127.0, 1.0),
            (Component::U8, &[51], 51.0, 0.2),
            (Component::I16, &[1, 0x80], -32767.0, -1.0),
            (Component::I16, &[0, 0x80], -32768.0, -1.0),
            (Component::U16, &[0xff, 0xff], 65535.0, 1.0),
            (Component::F32, &[0, 0, 0x80, 0x3f], 1.0, 1.0),
        ] {
            assert_eq!(component.size(), bytes.len());
            assert_eq!(component.read(bytes, false), whole, "{component:?}");
            assert_eq!(component.read(bytes, true), share, "{component:?}");
        }
        assert_eq!(Component::U32.read_whole(&[1, 0, 0, 0x80]), 0x8000_0001);
        assert_eq!(
            Component::of(5124),
            None,
            "signed 32-bit numbers are not in glTF"
        );
    }
}
