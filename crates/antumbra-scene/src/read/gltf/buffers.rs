//! The bytes behind a document.
//!
//! In: the document's buffers and a way to open files beside it. Out: slices by buffer view, those
//! of compressed views decoded. Invariant: a slice lies inside its view, the view inside its buffer,
//! the buffer inside bytes that are there; together the files hold at most [`MAX_FILE_BYTES`].

use std::{borrow::Cow, collections::HashMap, io, rc::Rc};

use crate::{read::MAX_FILE_BYTES, room::Room};

use super::{Fault, document::Document, uri};

/// Opens a file beside the scene by the name the scene gives it.
pub(super) type Open<'f> = dyn FnMut(&str) -> io::Result<Vec<u8>> + 'f;

/// All buffers of a document.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    buffers: Vec<Rc<Cow<'a, [u8]>>>,
    /// What compressed views hold, by view.
    decoded: HashMap<usize, Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Gets the bytes of every buffer, whether anything uses it or not.
    pub(super) fn load(
        document: &'a Document,
        binary: Option<&'a [u8]>,
        open: &mut Open<'_>,
        room: &mut Room,
    ) -> Result<Self, Fault> {
        let mut buffers = Vec::new();
        let mut files: HashMap<String, Rc<Cow<'a, [u8]>>> = HashMap::new();
        let mut total = 0_u64;
        for (index, buffer) in document.buffers.iter().enumerate() {
            let path = || format!("buffers[{index}]");
            let binary = binary.filter(|_| index == 0);
            // The buffer of compressed views is nowhere; some tools do not say that it is their fallback. Whoever
            // reads of it is refused.
            let is_nowhere = buffer.uri.is_none() && binary.is_none();
            if is_nowhere || buffer.extensions.is_fallback() {
                buffers.push(Rc::new(Cow::Borrowed(&[][..])));
                continue;
            }
            let bytes = match (&buffer.uri, binary) {
                (None, binary) => Rc::new(Cow::Borrowed(binary.unwrap_or_default())),
                (Some(uri), _) => match uri::resolve(uri) {
                    Err(problem) => return Err(Fault::at(path() + ".uri", problem, "")),
                    Ok(uri::Target::Bytes(bytes)) => {
                        take(room, bytes.len(), path)?;
                        Rc::new(Cow::Owned(bytes))
                    }
                    Ok(uri::Target::Name(name)) => match files.get(&name) {
                        Some(bytes) => Rc::clone(bytes),
                        None => {
                            let bytes = open(&name).map_err(|error| {
                                if let Some(over) = room.over_limit(&error, &name) {
                                    return Fault::over_limit(over);
                                }
                                let name = crate::error::quoted(&name);
                                let problem = format!("cannot read {name}: {error}");
                                let help = "put the file beside the scene";
                                Fault::at(path() + ".uri", problem, help)
                            })?;
                            total = total.saturating_add(bytes.len() as u64);
                            if total > MAX_FILE_BYTES {
                                let problem =
                                    format!("the files have more than {MAX_FILE_BYTES} bytes");
                                return Err(Fault::at(path(), problem, "split the scene"));
                            }
                            take(room, bytes.len(), path)?;
                            let bytes = Rc::new(Cow::Owned(bytes));
                            files.insert(name, Rc::clone(&bytes));
                            bytes
                        }
                    },
                },
            };
            if buffer.byte_length > bytes.len() as u64 {
                let problem = format!(
                    "the file says {} bytes, but there are {}",
                    buffer.byte_length,
                    bytes.len()
                );
                let help = "the file seems to be cut off; fetch it again";
                return Err(Fault::at(path() + ".byteLength", problem, help));
            }
            buffers.push(bytes);
        }
        Ok(Self {
            document,
            buffers,
            decoded: HashMap::new(),
        })
    }

    /// Takes what a compressed view holds.
    pub(super) fn add_decoded(&mut self, view: usize, bytes: Vec<u8>) {
        self.decoded.insert(view, bytes);
    }

    pub(super) fn document(&self) -> &'a Document {
        self.document
    }

    /// Returns the bytes of buffer view `index`; `path` is who asks.
    pub(super) fn view(&self, index: usize, path: impl Fn() -> String) -> Result<&[u8], Fault> {
        let views = &self.document.buffer_views;
        let Some(view) = views.get(index) else {
            return Err(Fault::missing(path(), "bufferViews", index, views.len()));
        };
        if let Some(decoded) = self.decoded.get(&index) {
            return Ok(decoded);
        }
        let here = || format!("bufferViews[{index}]");
        self.part(view.buffer, view.byte_offset, view.byte_length, here)
    }

    /// Returns `length` bytes of a buffer, from `offset` on; `path` is who asks.
    pub(super) fn part(
        &self,
        buffer: usize,
        offset: u64,
        length: u64,
        path: impl Fn() -> String,
    ) -> Result<&[u8], Fault> {
        let Some(bytes) = self.buffers.get(buffer) else {
            let path = path() + ".buffer";
            return Err(Fault::missing(path, "buffers", buffer, self.buffers.len()));
        };
        let buffer_length = self.document.buffers[buffer].byte_length;
        let found = slice(bytes, offset, length).filter(|_| offset + length <= buffer_length);
        found.ok_or_else(|| {
            let problem = if self.document.buffers[buffer].extensions.is_fallback() {
                format!("buffers[{buffer}] is for views that are compressed, and this one is not")
            } else if bytes.is_empty() && self.document.buffers[buffer].uri.is_none() {
                format!("buffers[{buffer}] has no `uri`, and there is no binary chunk for it")
            } else {
                format!(
                    "{length} bytes from byte {offset} on are not inside buffers[{buffer}] of \
                     {buffer_length} bytes"
                )
            };
            Fault::at(path(), problem, "")
        })
    }

    /// Returns where a byte of a view is, for messages.
    pub(super) fn place(&self, view: usize, byte: u64) -> String {
        match self.document.buffer_views.get(view) {
            Some(view) => {
                let byte = byte.saturating_add(view.byte_offset);
                format!("byte {byte} of buffers[{}]", view.buffer)
            }
            None => format!("byte {byte}"),
        }
    }
}

/// Returns `length` bytes from `offset` on, if they are there.
pub(super) fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = offset.checked_add(length)?;
    bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
}

fn take(room: &mut Room, bytes: usize, path: impl Fn() -> String) -> Result<(), Fault> {
    room.take(bytes as u64, path).map_err(Fault::over_limit)
}
