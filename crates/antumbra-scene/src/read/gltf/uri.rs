//! What a `uri` of a glTF file names.
//!
//! In: the URI. Out: the bytes of a `data:` URI, or the name of a file beside the scene, percent
//! signs decoded. Invariant: no other scheme is followed; whether the name stays inside the
//! scene's folder is for whoever opens it to check.

use base64::{
    Engine,
    alphabet::STANDARD,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};

use crate::error::quoted;

/// The target of a URI.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Bytes that the URI itself holds.
    Bytes(Vec<u8>),
    /// A relative path.
    Name(String),
}

/// Standard base64; some exporters leave the padding away.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// Returns what the URI names, or what is wrong with it.
pub(super) fn resolve(uri: &str) -> Result<Target, String> {
    let Some((scheme, rest)) = split_scheme(uri) else {
        return percent_decoded(uri)
            .map(Target::Name)
            .ok_or_else(|| format!("{} is not UTF-8 once decoded", quoted(uri)));
    };
    if !scheme.eq_ignore_ascii_case("data") {
        return Err(format!(
            "{} is not followed; expected a file beside the scene or a `data:` URI",
            quoted(uri)
        ));
    }
    let Some((media_type, payload)) = rest.split_once(',') else {
        return Err("the `data:` URI has no `,`".into());
    };
    if !media_type.to_ascii_lowercase().ends_with(";base64") {
        return Err("expected a `data:` URI in base64".into());
    }
    BASE64
        .decode(payload)
        .map(Target::Bytes)
        .map_err(|error| format!("the `data:` URI is no base64: {error}"))
}

/// Splits at the colon after a scheme (RFC 3986, 3.1).
fn split_scheme(uri: &str) -> Option<(&str, &str)> {
    let (scheme, rest) = uri.split_once(':')?;
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'));
    is_scheme.then_some((scheme, rest))
}

/// Replaces `%20` and the like; a percent sign that begins no such thing stands for itself.
fn percent_decoded(uri: &str) -> Option<String> {
    let digit = |byte: Option<&u8>| byte.and_then(|&b| char::from(b).to_digit(16));
    let bytes = uri.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        match (byte, digit(bytes.get(at + 1)), digit(bytes.get(at + 2))) {
            (b'%', Some(high), Some(low)) => {
                decoded.push((16 * high + low) as u8);
                at += 3;
            }
            _ => {
                decoded.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8(decoded).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(uri: &str) -> String {
        match resolve(uri) {
            Ok(Target::Name(name)) => name,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn names_are_decoded() {
        assert_eq!(name("a%20b%2Fc.bin"), "a b/c.bin");
        assert_eq!(name("100%.bin"), "100%.bin");
        assert_eq!(name("%2e%2e/x"), "../x");
        assert!(resolve("%ff").unwrap_err().contains("not UTF-8"));
    }

    #[test]
    fn only_data_is_followed() {
        for uri in ["http://x/y", "file:///etc/passwd", "C:/a.bin", "x-y+z.1:a"] {
            assert!(resolve(uri).unwrap_err().contains("not followed"), "{uri}");
        }
    }

    #[test]
    fn data_with_and_without_padding() {
        for uri in [
            "data:application/octet-stream;base64,AQI=",
            "DATA:;BASE64,AQI",
        ] {
            assert_eq!(resolve(uri), Ok(Target::Bytes(vec![1, 2])));
        }
        assert!(resolve("data:text/plain,AQI=").is_err());
        assert!(resolve("data:;base64").is_err());
        assert!(resolve("data:;base64,A?").unwrap_err().contains("base64"));
    }
}
