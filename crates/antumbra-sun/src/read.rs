//! Studies read back from `.npz` files.
//!
//! In: a file that [`write_npz`](crate::write_npz) wrote, or `numpy.savez` from its arrays. Out: a [`Study`]. Invariants: every
//! length fits every other; no header makes the reader panic or take more memory than the file has bytes, twice.

use std::io::{self, BufReader};
use std::path::Path;

use crate::calendar::Time;
use crate::error::FileError;
use crate::record::{About, Study, VERSION};
use crate::study::Bits;
use crate::suns::Sun;
use crate::write::zip::{ZipReader, damaged};

/// Reads a study.
///
/// # Errors
/// The file cannot be read, is damaged, or is not what [`write_npz`](crate::write_npz) writes.
pub fn read_npz(path: &Path) -> Result<Study, FileError> {
    read(path).map_err(|error| FileError::whole(path, format!("it is no study: {error}")))
}

fn read(path: &Path) -> io::Result<Study> {
    let file = antumbra_files::open(path)?;
    let mut zip = ZipReader::new(BufReader::new(file))?;
    let mut part = |name: &str| -> io::Result<Option<Npy>> {
        let bytes = zip.read(&format!("{name}.npy"))?;
        let array = bytes.map(|bytes| Npy::new(bytes, name)).transpose();
        antumbra_task::check();
        array
    };
    let due = |array: Option<Npy>, name: &str| {
        array.ok_or_else(|| damaged(&format!("it has no array `{name}`")))
    };
    let about = due(part("about")?, "about")?;
    let about: About = serde_json::from_slice(about.data(1)?)
        .map_err(|error| damaged(&format!("`about`: {error}")))?;
    if about.antumbra_sun != VERSION {
        let version = about.antumbra_sun;
        return Err(damaged(&format!(
            "it has version {version}: expected {VERSION}"
        )));
    }
    let points = due(part("points")?, "points")?.rows()?;
    let count = points.len();
    let azimuth = due(part("azimuth")?, "azimuth")?.doubles()?;
    let suns = azimuth.len();
    let fits = |found: usize, due: usize, name: &str| match found == due {
        true => Ok(()),
        false => Err(damaged(&format!(
            "`{name}` has {found} rows: expected {due}"
        ))),
    };
    let mut column = |name: &str, length: usize| -> io::Result<Option<Vec<f64>>> {
        let list = part(name)?.map(|array| array.doubles()).transpose()?;
        if let Some(list) = &list {
            fits(list.len(), length, name)?;
        }
        Ok(list)
    };
    let due_column = |list: Option<Vec<f64>>, name: &str| {
        list.ok_or_else(|| damaged(&format!("it has no array `{name}`")))
    };
    let elevation = due_column(column("elevation", suns)?, "elevation")?;
    let weights = due_column(column("weights", suns)?, "weights")?;
    let direct_normal = column("direct_normal", suns)?;
    let offsets = column("utc_offsets", suns)?;
    let areas = column("areas", count)?;
    let normals = part("normals")?.map(|array| array.rows()).transpose()?;
    if let Some(normals) = &normals {
        fits(normals.len(), count, "normals")?;
    }
    let surfaces = part("surfaces")?.map(|array| array.numbers("<u4", u32::from_le_bytes));
    let surfaces = surfaces.transpose()?;
    if let Some(surfaces) = &surfaces {
        fits(surfaces.len(), count, "surfaces")?;
    }
    let times = part("times")?.map(|array| array.numbers("<M8[s]", i64::from_le_bytes));
    let times = times.transpose()?;
    if let Some(times) = &times {
        fits(times.len(), suns, "times")?;
    }
    let directions = due(part("directions")?, "directions")?.rows()?;
    fits(directions.len(), suns, "directions")?;
    let bits = bits(&due(part("sunlit")?, "sunlit")?, count, suns)?;
    let shares = match about.sun_diameter.is_some() || about.through_glass {
        true => Some(shares(&due(part("shares")?, "shares")?, [count, suns])?),
        false => None,
    };
    let sky_view_factor = match about.diffuse {
        Some(_) => Some(due(part("sky_view_factor")?, "sky_view_factor")?.doubles()?),
        None => None,
    };
    if let Some(factors) = &sky_view_factor {
        fits(factors.len(), count, "sky_view_factor")?;
    }
    let time = |sun: usize| {
        let offset = offsets.as_ref().map_or(0.0, |offsets| offsets[sun]);
        Some(Time {
            local: times.as_ref()?[sun],
            offset_minutes: offset as i32,
        })
    };
    // Times far beyond the calendar would overflow later.
    let most = i64::from(3000) * 366 * 86_400;
    if times.iter().flatten().any(|time| time.abs() > most) {
        return Err(damaged("`times` has a time beyond the year 2999"));
    }
    let is_weight = |weight: &f64| (0.0..=1e9).contains(weight);
    if !weights.iter().all(is_weight) {
        return Err(damaged(
            "`weights` has a number that is negative or not finite",
        ));
    }
    let list = (0..suns).map(|sun| Sun {
        azimuth: azimuth[sun],
        elevation: elevation[sun],
        weight: weights[sun],
        time: time(sun),
        direct_normal: direct_normal
            .as_ref()
            .and_then(|of| Some(of[sun]).filter(|x| x.is_finite())),
    });
    Ok(Study {
        points,
        normals,
        surfaces,
        areas,
        suns: list.collect(),
        directions,
        bits,
        shares,
        sky_view_factor,
        about,
    })
}

/// Reads shares of suns.
fn shares(array: &Npy, shape: [usize; 2]) -> io::Result<Vec<f32>> {
    if array.shape != shape {
        let found = &array.shape;
        return Err(damaged(&format!(
            "`shares` has shape {found:?}: expected {shape:?}"
        )));
    }
    let shares = array.numbers("<f4", f32::from_le_bytes)?;
    // Not for NaN.
    match shares.iter().all(|share| (0.0..=1.0).contains(share)) {
        true => Ok(shares),
        false => Err(damaged("`shares` has a number that is not from 0 to 1")),
    }
}

/// Widens rows of bytes to rows of words.
fn bits(array: &Npy, sensors: usize, suns: usize) -> io::Result<Bits> {
    let row = suns.div_ceil(8);
    if array.shape != [sensors, row] {
        return Err(damaged(&format!(
            "`sunlit` has shape {:?}: expected {:?}",
            array.shape,
            [sensors, row]
        )));
    }
    let stride = suns.div_ceil(64);
    let data = array.data(1)?;
    let mut words = Vec::with_capacity(stride * sensors);
    for row in antumbra_task::checked(data.chunks(row.max(1))) {
        for bytes in row.chunks(8) {
            let mut word = [0; 8];
            word[..bytes.len()].copy_from_slice(bytes);
            words.push(u64::from_le_bytes(word));
        }
        // Bits beyond the last sun mean nothing.
        if let (Some(last), over) = (words.last_mut(), suns % 64)
            && over > 0
        {
            *last &= (1 << over) - 1;
        }
    }
    Ok(Bits { stride, words })
}

/// An array of NumPy's format, in C order.
struct Npy {
    name: String,
    bytes: Vec<u8>,
    begin: usize,
    descr: String,
    shape: Vec<usize>,
}

impl Npy {
    fn new(bytes: Vec<u8>, name: &str) -> io::Result<Self> {
        let fault = |what: &str| damaged(&format!("`{name}`: {what}"));
        let is_npy = bytes.starts_with(b"\x93NUMPY\x01") && bytes.len() >= 10;
        if !is_npy {
            return Err(fault("it is no array of format 1.0"));
        }
        let begin = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = bytes
            .get(10..begin)
            .ok_or_else(|| fault("its header ends early"))?;
        let text = std::str::from_utf8(text).map_err(|_| fault("its header is no text"))?;
        let behind = |key: &str| text.split_once(key).map(|(_, rest)| rest.trim_start());
        let descr = behind("'descr':")
            .and_then(|rest| rest.strip_prefix('\'')?.split_once('\''))
            .ok_or_else(|| fault("its header has no type"))?
            .0;
        if !behind("'fortran_order':").is_some_and(|rest| rest.starts_with("False")) {
            return Err(fault("expected C order"));
        }
        let shape = behind("'shape':")
            .and_then(|rest| rest.strip_prefix('(')?.split_once(')'))
            .ok_or_else(|| fault("its header has no shape"))?
            .0;
        let lengths = shape
            .split(',')
            .map(str::trim)
            .filter(|length| !length.is_empty());
        let shape: Option<Vec<usize>> = lengths.map(|length| length.parse().ok()).collect();
        let shape = shape.filter(|shape| !shape.is_empty());
        Ok(Self {
            name: name.to_owned(),
            descr: descr.to_owned(),
            shape: shape.ok_or_else(|| fault("its shape is not one of numbers"))?,
            bytes,
            begin,
        })
    }

    fn fault(&self, what: &str) -> io::Error {
        damaged(&format!("`{}`: {what}", self.name))
    }

    /// Returns the bytes of all numbers, of so many bytes each.
    fn data(&self, size: usize) -> io::Result<&[u8]> {
        let count = self
            .shape
            .iter()
            .try_fold(size, |all, &length| all.checked_mul(length));
        let data = &self.bytes[self.begin..];
        match count == Some(data.len()) {
            true => Ok(data),
            false => Err(self.fault("its length is not that of its shape")),
        }
    }

    fn numbers<T, const N: usize>(
        &self,
        descr: &str,
        read: fn([u8; N]) -> T,
    ) -> io::Result<Vec<T>> {
        if self.descr != descr {
            return Err(self.fault(&format!("its type is {}: expected {descr}", self.descr)));
        }
        let chunks = self.data(N)?.as_chunks::<N>().0;
        Ok(chunks.iter().map(|&bytes| read(bytes)).collect())
    }

    fn doubles(&self) -> io::Result<Vec<f64>> {
        self.numbers("<f8", f64::from_le_bytes)
    }

    fn rows(&self) -> io::Result<Vec<[f64; 3]>> {
        if self.shape.len() != 2 || self.shape[1] != 3 {
            return Err(self.fault("expected shape (n, 3)"));
        }
        Ok(self.doubles()?.as_chunks::<3>().0.to_vec())
    }
}
