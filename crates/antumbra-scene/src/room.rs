//! How much memory reading may take.
//!
//! In: what is about to be taken, in bytes. Out: leave, or a refusal that names it. Invariant: what
//! all leaves together allow is at most the limit.

use std::io;

use crate::error::{ReadErrorKind, quoted};

/// Bytes that a reader may still take.
#[derive(Clone, Debug)]
pub(crate) struct Room {
    left: u64,
    limit: u64,
}

/// Something does not fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OverLimit {
    what: String,
    bytes: u64,
    limit: u64,
}

impl Room {
    pub(crate) const fn new(limit: u64) -> Self {
        Self { left: limit, limit }
    }

    /// Returns the bytes that may still be taken.
    pub(crate) const fn left(&self) -> u64 {
        self.left
    }

    /// Refuses what does not fit, and takes nothing.
    pub(crate) fn check(&self, bytes: u64, what: impl FnOnce() -> String) -> Result<(), OverLimit> {
        if bytes <= self.left {
            return Ok(());
        }
        Err(OverLimit {
            what: what(),
            bytes,
            limit: self.limit,
        })
    }

    /// Returns the refusal that opening `file` ended with, if it was too large to be read.
    pub(crate) fn over_limit(&self, error: &io::Error, file: &str) -> Option<OverLimit> {
        match error.get_ref()?.downcast_ref()? {
            ReadErrorKind::OverLimit { bytes, .. } => Some(OverLimit {
                what: quoted(file),
                bytes: *bytes,
                limit: self.limit,
            }),
            _ => None,
        }
    }

    /// Takes bytes for good.
    pub(crate) fn take(
        &mut self,
        bytes: u64,
        what: impl FnOnce() -> String,
    ) -> Result<(), OverLimit> {
        self.check(bytes, what)?;
        self.left -= bytes;
        Ok(())
    }
}

impl OverLimit {
    /// Says where what does not fit is.
    pub(crate) fn inside(self, place: &str) -> Self {
        Self {
            what: format!("{place}, {}", self.what),
            ..self
        }
    }
}

impl From<OverLimit> for ReadErrorKind {
    fn from(error: OverLimit) -> Self {
        let OverLimit { what, bytes, limit } = error;
        Self::OverLimit {
            what: what.into(),
            bytes,
            limit,
        }
    }
}
