//! From a file's bytes to JSON text and the binary chunk.
//!
//! In: the bytes of a .gltf or .glb file. Out: its JSON and, of a GLB, the binary chunk. Which of
//! the two it is, the content says, not the name. Invariant: both lie inside the file.

use crate::{
    error::{Place, ReadErrorKind},
    warning::WarningLog,
};

use super::Fault;

/// The parts of a file.
pub(super) struct Container<'a> {
    /// JSON text.
    pub(super) json: &'a [u8],
    /// Where the JSON begins in the file, in bytes.
    pub(super) json_start: u64,
    /// The second chunk of a GLB.
    pub(super) binary: Option<&'a [u8]>,
    /// Whether the file is a GLB.
    pub(super) is_binary: bool,
}

/// Names of chunks (glTF 2.0, 4.4.3).
const JSON: [u8; 4] = *b"JSON";
const BIN: [u8; 4] = *b"BIN\0";
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Takes a file apart.
pub(super) fn open<'a>(bytes: &'a [u8], warnings: &mut WarningLog) -> Result<Container<'a>, Fault> {
    if bytes.starts_with(b"version https://git-lfs.github.com/spec/") {
        return Err(Fault {
            place: Place::Whole,
            kind: ReadErrorKind::LfsPointer,
        });
    }
    if bytes.starts_with(b"glTF") {
        return open_glb(bytes, warnings);
    }
    let start = if bytes.starts_with(BYTE_ORDER_MARK) {
        BYTE_ORDER_MARK.len()
    } else {
        0
    };
    let json = &bytes[start..];
    if json.trim_ascii_start().first() != Some(&b'{') {
        let problem = "expected a file that begins with `glTF` (GLB) or `{` (JSON)";
        return Err(byte(0, problem, "check that this is the scene file"));
    }
    Ok(Container {
        json,
        json_start: start as u64,
        binary: None,
        is_binary: false,
    })
}

/// A header of 12 bytes, then chunks: length, name, content.
fn open_glb<'a>(bytes: &'a [u8], warnings: &mut WarningLog) -> Result<Container<'a>, Fault> {
    const CUT: &str = "the file seems to be cut off; fetch it again";
    let (Some(version), Some(length)) = (number_at(bytes, 4), number_at(bytes, 8)) else {
        return Err(byte(0, "expected 12 bytes of header", CUT));
    };
    if version != 2 {
        let problem = format!("this is GLB version {version}; expected version 2");
        return Err(byte(4, problem, "convert the scene to glTF 2.0"));
    }
    let length = length as usize;
    if length > bytes.len() {
        let problem = format!(
            "the header says {length} bytes, the file has {}",
            bytes.len()
        );
        return Err(byte(8, problem, CUT));
    }
    if length < bytes.len() {
        let surplus = bytes.len() - length;
        let message = format!("{surplus} bytes after the end of the GLB are not read");
        warnings.add(Place::Byte(length as u64), message);
    }
    let mut rest = &bytes[..length];
    let mut at = 12;
    let mut json = None;
    let mut binary = None;
    rest = rest.get(at..).unwrap_or_default();
    while !rest.is_empty() {
        let (Some(size), Some(name)) = (number_at(rest, 0), rest.get(4..8)) else {
            return Err(byte(at, "expected 8 bytes of chunk header", CUT));
        };
        let Some(content) = rest[8..].get(..size as usize) else {
            let problem = format!(
                "the chunk says {size} bytes, only {} follow",
                rest.len() - 8
            );
            return Err(byte(at, problem, CUT));
        };
        match (&json, name == JSON, name == BIN) {
            (None, true, _) => json = Some((content, at + 8)),
            (None, false, _) => {
                return Err(byte(at + 4, "expected the chunk `JSON` first", ""));
            }
            (Some(_), _, true) if binary.is_none() => binary = Some(content),
            _ => warnings.add(Place::Byte(at as u64), "a chunk of the GLB is not read"),
        }
        at += 8 + content.len();
        rest = &rest[8 + content.len()..];
    }
    let Some((json, start)) = json else {
        return Err(byte(12, "expected a chunk `JSON`", CUT));
    };
    Ok(Container {
        json,
        json_start: start as u64,
        binary,
        is_binary: true,
    })
}

fn number_at(bytes: &[u8], at: usize) -> Option<u32> {
    let number = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(number.try_into().ok()?))
}

fn byte(at: usize, problem: impl Into<Box<str>>, help: &'static str) -> Fault {
    Fault {
        place: Place::Byte(at as u64),
        kind: ReadErrorKind::Invalid {
            entity: "",
            problem: problem.into(),
            help,
        },
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn chunk(name: &[u8; 4], content: &[u8]) -> Vec<u8> {
        [&(content.len() as u32).to_le_bytes(), &name[..], content].concat()
    }

    fn glb(chunks: &[Vec<u8>]) -> Vec<u8> {
        let body = chunks.concat();
        let length = 12 + body.len() as u32;
        [
            &b"glTF"[..],
            &2_u32.to_le_bytes(),
            &length.to_le_bytes(),
            &*body,
        ]
        .concat()
    }

    fn log() -> WarningLog {
        WarningLog::new(Path::new("a.glb"))
    }

    #[test]
    fn chunks_in_order_and_strange_ones() {
        let bytes = glb(&[
            chunk(b"JSON", b"{}"),
            chunk(b"what", b"?"),
            chunk(&BIN, b"12"),
        ]);
        let mut warnings = log();
        let container = open(&bytes, &mut warnings).ok().unwrap();
        assert_eq!((container.json, container.json_start), (&b"{}"[..], 20));
        assert_eq!(container.binary, Some(&b"12"[..]));
        assert_eq!(warnings.finish().len(), 1);
    }

    #[test]
    fn every_cut_is_refused() {
        let bytes = glb(&[chunk(b"JSON", b"{}"), chunk(&BIN, b"12")]);
        for end in 0..bytes.len() {
            assert!(open(&bytes[..end], &mut log()).is_err(), "{end}");
            // The same with a length that agrees.
            let mut cut = bytes[..end].to_vec();
            if end >= 12 {
                cut[8..12].copy_from_slice(&(end as u32).to_le_bytes());
            }
            let whole = end == 12 + 10;
            assert_eq!(open(&cut, &mut log()).is_ok(), whole, "{end}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let old = [&b"glTF"[..], &1_u32.to_le_bytes(), &12_u32.to_le_bytes()].concat();
        for bytes in [&b""[..], b"\0\0\0\0", b"[]", &old] {
            assert!(open(bytes, &mut log()).is_err());
        }
        assert!(open(&glb(&[chunk(&BIN, b"12")]), &mut log()).is_err());
    }
}
