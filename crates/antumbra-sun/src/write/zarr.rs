//! Zarr, version 3: a folder with all arrays of a study, uncompressed.
//!
//! Chunks are runs of sensors, so that whoever reads some sensors reads little else. Times have the attributes of the
//! climate and forecast conventions, by which xarray knows them.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde_json::json;

use crate::arrays::{Array, Numbers, arrays};
use crate::record::Study;
use crate::sums::Sums;

/// Mark in the group's metadata, by which a folder is known as one of ours.
const MARK: &str = "antumbra sun study";

/// Bytes of a chunk, about.
const CHUNK: usize = 8 << 20;

/// Refuses a path where a folder would replace something else than an earlier study.
///
/// # Errors
/// A file, a link or a folder that antumbra did not write is there.
pub fn check_zarr(path: &Path) -> io::Result<()> {
    let found = match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        found => found?,
    };
    let is_own =
        found.is_dir() && antumbra_files::is_own(&path.join("zarr.json"), MARK).unwrap_or(false);
    match is_own {
        true => Ok(()),
        false => Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            "something is there that is no sun study of antumbra",
        )),
    }
}

/// Writes the folder of a study: beside its place first, then by renaming. An earlier study is replaced.
///
/// # Errors
/// The system refuses, or something else is there ([`check_zarr`]).
pub fn write_zarr(path: &Path, study: &Study, sums: &Sums) -> io::Result<()> {
    check_zarr(path)?;
    let beside = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let temporary = tempfile::Builder::new()
        .prefix(".antumbra-")
        .tempdir_in(beside)?;
    let new = temporary.path().join("new");
    fs::create_dir(&new)?;
    let about = json!({
        "zarr_format": 3,
        "node_type": "group",
        "attributes": { "made_by": MARK, "about": study.about },
    });
    write_json(&new.join("zarr.json"), &about)?;
    for array in arrays(study, sums) {
        antumbra_task::check();
        write_array(&new.join(array.name), &array)?;
    }
    if path.is_dir() {
        fs::rename(path, temporary.path().join("old"))?;
    }
    fs::rename(&new, path)
}

fn write_json(path: &Path, value: &serde_json::Value) -> io::Result<()> {
    antumbra_files::write_bytes(path, &serde_json::to_vec_pretty(value)?)
}

fn write_array(folder: &Path, array: &Array) -> io::Result<()> {
    fs::create_dir(folder)?;
    let kind = match array.numbers {
        Numbers::F64(_) => "float64",
        Numbers::F32(_) => "float32",
        Numbers::I32(_) => "int32",
        Numbers::U32(_) => "uint32",
        Numbers::U8(_) | Numbers::Bits(..) => "uint8",
        Numbers::Time(_) => "int64",
    };
    let lengths: Vec<usize> = array.axes.iter().map(|&(_, length)| length).collect();
    let row_bytes = array.numbers.size() * lengths[1..].iter().product::<usize>();
    let rows = (CHUNK / row_bytes.max(1)).clamp(1, lengths[0].max(1));
    let mut chunk_shape = lengths.clone();
    chunk_shape[0] = rows;
    let mut attributes = json!({ "unit": array.unit });
    if matches!(array.numbers, Numbers::Time(_)) {
        attributes = json!({
            "units": "seconds since 1970-01-01 00:00:00",
            "calendar": "proleptic_gregorian",
            "clock": array.unit,
        });
    }
    let mut codec = json!({ "name": "bytes" });
    if array.numbers.size() > 1 {
        codec = json!({ "name": "bytes", "configuration": { "endian": "little" } });
    }
    let fill = match array.numbers {
        Numbers::F64(_) | Numbers::F32(_) => json!(0.0),
        _ => json!(0),
    };
    let names: Vec<&str> = array.axes.iter().map(|&(name, _)| name).collect();
    let about = json!({
        "zarr_format": 3,
        "node_type": "array",
        "shape": lengths,
        "data_type": kind,
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": chunk_shape } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": fill,
        "codecs": [codec],
        "dimension_names": names,
        "attributes": attributes,
    });
    write_json(&folder.join("zarr.json"), &about)?;
    let mut chunks = Chunks {
        folder,
        axis_count: lengths.len(),
        length: (rows * row_bytes).max(1),
        buffer: Vec::new(),
        number: 0,
    };
    array.numbers.write(&mut chunks)?;
    chunks.finish()
}

/// Cuts bytes into files of one length; the last one is filled up with zeros.
struct Chunks<'a> {
    folder: &'a Path,
    axis_count: usize,
    length: usize,
    buffer: Vec<u8>,
    number: usize,
}

impl Chunks<'_> {
    fn put(&mut self) -> io::Result<()> {
        self.buffer.resize(self.length, 0);
        let mut path = self.folder.join("c");
        path.push(self.number.to_string());
        for _ in 1..self.axis_count {
            fs::create_dir_all(&path)?;
            path.push("0");
        }
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        antumbra_files::write_bytes(&path, &self.buffer)?;
        self.buffer.clear();
        self.number += 1;
        Ok(())
    }

    fn finish(mut self) -> io::Result<()> {
        match self.buffer.is_empty() {
            true => Ok(()),
            false => self.put(),
        }
    }
}

impl Write for Chunks<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = bytes.len().min(self.length - self.buffer.len());
        self.buffer.extend_from_slice(&bytes[..taken]);
        if self.buffer.len() == self.length {
            self.put()?;
        }
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
