//! NumPy's `.npy` files: points in, answers out.
//!
//! In: a path. Out: points, or a refusal that names the file. Invariant: nothing is taken for an array before
//! the file is known to hold it, and no header makes the reader panic or recurse deeply.

use std::fs::File;
use std::io::{self, BufReader, Write as _};
use std::path::{Path, PathBuf};

use antumbra_geometry::Precision;
use npyz::{AutoSerialize, DType, NpyFile, NpyHeader, Order, WriteOptions, WriterBuilder as _};

use crate::failure::Failure;
use crate::outputs;

/// Longest header that is read; NumPy's own limit.
const MAX_HEADER: usize = 10_000;

/// Most brackets and digits of a header, far more than those of an array of points. The parser of npyz
/// recurses for each bracket and multiplies the axes, which this many digits keep below 2^63.
const MAX_BRACKETS: usize = 32;
const MAX_DIGITS: usize = 18;

/// An array of points that is not read yet.
pub(in crate::commands) struct PointFile {
    pub(super) path: PathBuf,
    /// How many points.
    pub(in crate::commands) count: u64,
    is_double: bool,
    header: NpyHeader,
    data: BufReader<File>,
}

impl PointFile {
    /// Opens a file and checks its header and its length.
    pub(in crate::commands) fn open(path: &Path) -> Result<Self, Failure> {
        let unreadable = |error: io::Error| {
            let message = format!("cannot read {}: {error}", path.display());
            Failure::input(message, "give a file that numpy.save wrote")
        };
        let file = antumbra_files::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let mut data = BufReader::new(file);
        let prefix = header_bytes(&mut data).map_err(unreadable)?;
        let header = NpyHeader::from_reader(&prefix[..]).map_err(unreadable)?;

        let refused = |message: String, help: &str| {
            Failure::input(format!("{}: {message}", path.display()), help)
        };
        let is_double = match type_name(&header.dtype()).as_str() {
            "f4" => false,
            "f8" => true,
            _ => {
                let found = header.dtype().descr();
                let message = format!("expected float32 or float64, found {found}");
                return Err(refused(message, "convert it with .astype(numpy.float64)"));
            }
        };
        let &[count, 3] = header.shape() else {
            let found: Vec<String> = header.shape().iter().map(u64::to_string).collect();
            let message = format!("expected shape (n, 3), found ({})", found.join(", "));
            return Err(refused(message, "give a point a row"));
        };
        if header.order() != Order::C && count > 1 {
            let message = "expected C order, found Fortran order".to_owned();
            return Err(refused(message, "save numpy.ascontiguousarray(...)"));
        }
        let due = prefix.len() as u64 + count * if is_double { 24 } else { 12 };
        if length != due {
            let message = format!("{count} points make a file of {due} bytes, found {length}");
            return Err(refused(message, "save it again"));
        }
        Ok(Self {
            path: path.to_owned(),
            count,
            is_double,
            header,
            data,
        })
    }

    /// Returns the bytes that the points take once they are read.
    pub(in crate::commands) fn bytes(&self) -> u64 {
        24 * self.count
    }

    /// Returns how finely they are given.
    pub(in crate::commands) fn precision(&self) -> Precision {
        match self.is_double {
            true => Precision::Double,
            false => Precision::Single,
        }
    }

    /// Reads the points.
    pub(in crate::commands) fn read(self) -> Result<Vec<[f64; 3]>, Failure> {
        let Self {
            path,
            count,
            is_double,
            header,
            data,
        } = self;
        let file = NpyFile::with_header(header, data);
        let points = if is_double {
            file.data::<f64>()
                .map_err(invalid)
                .and_then(|numbers| triples(count, numbers))
        } else {
            file.data::<f32>()
                .map_err(invalid)
                .and_then(|numbers| triples(count, numbers.map(|x| x.map(f64::from))))
        };
        // It was whole when it was opened.
        points.map_err(|error| Failure::system(format!("cannot read {}: {error}", path.display())))
    }
}

/// Reads up to the data, if that looks like the header of an array of points.
fn header_bytes(data: &mut impl io::Read) -> io::Result<Vec<u8>> {
    let mut start = [0; 12];
    data.read_exact(&mut start[..10])?;
    if &start[..6] != b"\x93NUMPY" {
        return Err(invalid("it does not begin as a .npy file"));
    }
    let (start, length) = if start[6] == 1 {
        let length = u16::from_le_bytes([start[8], start[9]]);
        (&start[..10], usize::from(length))
    } else {
        data.read_exact(&mut start[10..])?;
        let length = u32::from_le_bytes([start[8], start[9], start[10], start[11]]);
        (&start[..], usize::try_from(length).unwrap_or(usize::MAX))
    };
    if length > MAX_HEADER {
        let message = format!("its header has {length} bytes; at most {MAX_HEADER} are read");
        return Err(invalid(message));
    }
    let mut header = start.to_vec();
    header.resize(start.len() + length, 0);
    data.read_exact(&mut header[start.len()..])?;
    let text = &header[start.len()..];
    let count = |is_one: fn(&u8) -> bool| text.iter().filter(|byte| is_one(byte)).count();
    if count(|byte| b"([{".contains(byte)) > MAX_BRACKETS || count(u8::is_ascii_digit) > MAX_DIGITS
    {
        return Err(invalid(
            "its header is longer than that of an array of points",
        ));
    }
    Ok(header)
}

fn invalid(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, error)
}

/// Returns a type's name without its byte order, `f8`; empty for structures.
fn type_name(dtype: &DType) -> String {
    match dtype {
        DType::Plain(name) => name
            .to_string()
            .trim_start_matches(['<', '>', '|', '='])
            .into(),
        DType::Array(..) | DType::Record(_) => String::new(),
    }
}

fn triples(
    count: u64,
    mut numbers: impl Iterator<Item = io::Result<f64>>,
) -> io::Result<Vec<[f64; 3]>> {
    let mut next = || {
        numbers
            .next()
            .unwrap_or_else(|| Err(invalid("it ends early")))
    };
    // The file is as long as that, and the memory limit allows it.
    let mut points = Vec::with_capacity(count as usize);
    for _ in 0..count {
        points.push([next()?, next()?, next()?]);
    }
    Ok(points)
}

/// Writes numbers of a shape, whole or not at all.
pub(super) fn write_shares(path: &Path, shape: &[u64], numbers: &[f32]) -> Result<(), Failure> {
    write_numbers(path, shape, numbers)
}

/// Writes numbers of a shape, whole or not at all.
pub(super) fn write_doubles(path: &Path, shape: &[u64], numbers: &[f64]) -> Result<(), Failure> {
    write_numbers(path, shape, numbers)
}

fn write_numbers<T: AutoSerialize + Copy>(
    path: &Path,
    shape: &[u64],
    numbers: &[T],
) -> Result<(), Failure> {
    let written = antumbra_files::write(
        path,
        |error| error,
        |file| {
            let mut writer = WriteOptions::<T>::new()
                .default_dtype()
                .shape(shape)
                .writer(&mut *file)
                .begin_nd()?;
            writer.extend(numbers.iter().copied())?;
            writer.finish()
        },
    );
    written.map_err(|error: io::Error| outputs::unwritable(path, error))
}

/// Writes bytes of a shape, whole or not at all.
pub(in crate::commands) fn write(path: &Path, shape: &[u64], bytes: &[u8]) -> Result<(), Failure> {
    let written = antumbra_files::write(
        path,
        |error| error,
        |file| {
            WriteOptions::<u8>::new()
                .default_dtype()
                .shape(shape)
                .writer(&mut *file)
                .write_header_only()?;
            file.write_all(bytes)
        },
    );
    written.map_err(|error: io::Error| outputs::unwritable(path, error))
}
