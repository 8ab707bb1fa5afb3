//! ZIP files without compression, as `numpy.savez` writes them, and such files read back.
//!
//! In: named parts of known length. Out: a file; parts of 4 GiB and more have the records of ZIP64. Invariants: the bytes
//! depend on the parts alone (no time stamps); a reader takes no more memory than the file has bytes.

use std::io::{self, Read, Seek, SeekFrom, Write};

const LOCAL: u32 = 0x0403_4b50;
const CENTRAL: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
const END_64: u32 = 0x0606_4b50;
const LOCATOR_64: u32 = 0x0706_4b50;

/// 1980-01-01, the earliest date that the format has.
const DATE: u16 = 0x0021;

/// Number that says: look in the record of ZIP64.
const IN_64: u32 = u32::MAX;

/// A part of a file.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) name: String,
    sum: u32,
    length: u64,
    /// Where its local header begins.
    at: u64,
}

/// Writes parts one after another.
pub(crate) struct ZipWriter<W> {
    out: W,
    at: u64,
    parts: Vec<Part>,
}

/// Counts and sums what is written.
struct Summed {
    sum: crc32fast::Hasher,
    length: u64,
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.sum.update(bytes);
        self.length += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<W: Write> ZipWriter<W> {
    pub(crate) fn new(out: W) -> Self {
        Self {
            out,
            at: 0,
            parts: Vec::new(),
        }
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    /// Writes a part. `fill` is called twice and writes the same both times: the header in front holds the sum.
    pub(crate) fn part(
        &mut self,
        name: &str,
        fill: impl Fn(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut summed = Summed {
            sum: crc32fast::Hasher::new(),
            length: 0,
        };
        fill(&mut io::BufWriter::new(&mut summed))?;
        let part = Part {
            name: name.to_owned(),
            sum: summed.sum.finalize(),
            length: summed.length,
            at: self.at,
        };
        // Every local header has room for long parts, as NumPy's have.
        let mut header = Vec::new();
        header.extend(LOCAL.to_le_bytes());
        for word in [45_u16, 0, 0, 0, DATE] {
            header.extend(word.to_le_bytes());
        }
        header.extend(part.sum.to_le_bytes());
        header.extend(IN_64.to_le_bytes());
        header.extend(IN_64.to_le_bytes());
        header.extend((name.len() as u16).to_le_bytes());
        header.extend(20_u16.to_le_bytes());
        header.extend(name.bytes());
        header.extend(1_u16.to_le_bytes());
        header.extend(16_u16.to_le_bytes());
        header.extend(part.length.to_le_bytes());
        header.extend(part.length.to_le_bytes());
        self.put(&header)?;
        fill(&mut self.out)?;
        self.at += part.length;
        self.parts.push(part);
        Ok(())
    }

    /// Writes the list of parts.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        let begin = self.at;
        for part in std::mem::take(&mut self.parts) {
            let mut entry = Vec::new();
            entry.extend(CENTRAL.to_le_bytes());
            for word in [45_u16, 45, 0, 0, 0, DATE] {
                entry.extend(word.to_le_bytes());
            }
            entry.extend(part.sum.to_le_bytes());
            entry.extend(IN_64.to_le_bytes());
            entry.extend(IN_64.to_le_bytes());
            entry.extend((part.name.len() as u16).to_le_bytes());
            entry.extend(28_u16.to_le_bytes());
            entry.extend([0; 10]);
            entry.extend(IN_64.to_le_bytes());
            entry.extend(part.name.bytes());
            entry.extend(1_u16.to_le_bytes());
            entry.extend(24_u16.to_le_bytes());
            for number in [part.length, part.length, part.at] {
                entry.extend(number.to_le_bytes());
            }
            self.put(&entry)?;
            self.parts.push(part);
        }
        let (end, count) = (self.at, self.parts.len() as u64);
        let mut tail = Vec::new();
        tail.extend(END_64.to_le_bytes());
        tail.extend(44_u64.to_le_bytes());
        tail.extend([45, 0, 45, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        for number in [count, count, end - begin, begin] {
            tail.extend(number.to_le_bytes());
        }
        tail.extend(LOCATOR_64.to_le_bytes());
        tail.extend(0_u32.to_le_bytes());
        tail.extend(end.to_le_bytes());
        tail.extend(1_u32.to_le_bytes());
        tail.extend(END.to_le_bytes());
        tail.extend([0; 4]);
        tail.extend((count.min(0xffff) as u16).to_le_bytes());
        tail.extend((count.min(0xffff) as u16).to_le_bytes());
        tail.extend(((end - begin).min(IN_64.into()) as u32).to_le_bytes());
        tail.extend(IN_64.to_le_bytes());
        tail.extend([0; 2]);
        self.put(&tail)
    }
}

/// Numbers of a record, read from its bytes.
struct Record<'a>(&'a [u8]);

impl Record<'_> {
    fn number<const N: usize>(&self, at: usize) -> io::Result<u64> {
        let bytes = self
            .0
            .get(at..at + N)
            .ok_or_else(|| damaged("it ends early"))?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, &byte| sum << 8 | u64::from(byte)))
    }
}

/// Reads parts of a file by name.
pub(crate) struct ZipReader<R> {
    file: R,
    parts: Vec<Part>,
}

impl<R: Read + Seek> ZipReader<R> {
    /// Reads the list of parts.
    pub(crate) fn new(mut file: R) -> io::Result<Self> {
        /// Bytes at the end that hold the last records, if nobody wrote a comment.
        const TAIL: u64 = 20 + 22;
        let whole = file.seek(SeekFrom::End(0))?;
        let short = whole.min(TAIL);
        let tail = read_at(&mut file, whole - short, short)?;
        let begin = tail.windows(4).rposition(|mark| mark == END.to_le_bytes());
        let begin = begin.filter(|begin| tail.len() - begin == 22);
        let begin = begin.ok_or_else(|| damaged("it has no list of parts at its end"))?;
        let end = Record(&tail[begin..]);
        let (mut count, mut size, mut at) = (
            end.number::<2>(10)?,
            end.number::<4>(12)?,
            end.number::<4>(16)?,
        );
        let locator = begin.checked_sub(20).map(|before| Record(&tail[before..]));
        if let Some(locator) = locator
            && locator.number::<4>(0)? == u64::from(LOCATOR_64)
        {
            let record = read_at(&mut file, locator.number::<8>(8)?, 56)?;
            let record = Record(&record);
            (count, size, at) = (
                record.number::<8>(32)?,
                record.number::<8>(40)?,
                record.number::<8>(48)?,
            );
        }
        if size > whole || at > whole {
            return Err(damaged("its list of parts lies outside"));
        }
        let list = read_at(&mut file, at, size)?;
        let mut parts = Vec::new();
        let mut rest = &list[..];
        for _ in 0..count {
            let entry = Record(rest);
            if entry.number::<4>(0)? != u64::from(CENTRAL) {
                return Err(damaged("its list of parts is no list"));
            }
            if entry.number::<2>(10)? != 0 {
                return Err(damaged(
                    "its parts are compressed; write it with numpy.savez, not savez_compressed",
                ));
            }
            let (name, extra) = (
                entry.number::<2>(28)? as usize,
                entry.number::<2>(30)? as usize,
            );
            let comment = entry.number::<2>(32)? as usize;
            let end = 46 + name + extra + comment;
            if rest.len() < end {
                return Err(damaged("its list of parts ends early"));
            }
            let mut part = Part {
                name: String::from_utf8_lossy(&rest[46..46 + name]).into_owned(),
                sum: entry.number::<4>(16)? as u32,
                length: entry.number::<4>(24)?,
                at: entry.number::<4>(42)?,
            };
            long_numbers(
                &mut part,
                entry.number::<4>(20)?,
                &rest[46 + name..][..extra],
            )?;
            if part.length > whole || part.at > whole {
                return Err(damaged("a part lies outside"));
            }
            parts.push(part);
            rest = &rest[end..];
        }
        Ok(Self { file, parts })
    }

    /// Returns the bytes of a part, whose sum is checked; `None` if there is no such part.
    pub(crate) fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        let Some(part) = self.parts.iter().find(|part| part.name == name).cloned() else {
            return Ok(None);
        };
        let header = read_at(&mut self.file, part.at, 30)?;
        let header = Record(&header);
        if header.number::<4>(0)? != u64::from(LOCAL) {
            return Err(damaged("a part has no header"));
        }
        let begin = part.at + 30 + header.number::<2>(26)? + header.number::<2>(28)?;
        let bytes = read_at(&mut self.file, begin, part.length)?;
        match crc32fast::hash(&bytes) == part.sum {
            true => Ok(Some(bytes)),
            false => Err(damaged("the sum of a part is wrong")),
        }
    }
}

/// Takes those numbers of an entry that stand in its record of ZIP64.
fn long_numbers(part: &mut Part, packed: u64, extra: &[u8]) -> io::Result<()> {
    let extra = Record(extra);
    let mut at = 0;
    while at + 4 <= extra.0.len() {
        let (kind, size) = (extra.number::<2>(at)?, extra.number::<2>(at + 2)? as usize);
        if kind == 1 {
            let mut place = at + 4;
            let mut take = |number: &mut u64| -> io::Result<()> {
                if *number == u64::from(IN_64) {
                    *number = extra.number::<8>(place)?;
                    place += 8;
                }
                Ok(())
            };
            let mut packed = packed;
            take(&mut part.length)?;
            take(&mut packed)?;
            take(&mut part.at)?;
        }
        at += 4 + size;
    }
    Ok(())
}

/// Reads bytes at a place; fails where there are fewer.
fn read_at(file: &mut (impl Read + Seek), at: u64, length: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    match bytes.len() as u64 == length {
        true => Ok(bytes),
        false => Err(damaged("it ends early")),
    }
}

pub(crate) fn damaged(why: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, why)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn sample() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut zip = ZipWriter::new(&mut bytes);
        zip.part("a", |out| out.write_all(b"one")).unwrap();
        zip.part("b.npy", |_| Ok(())).unwrap();
        zip.finish().unwrap();
        bytes
    }

    #[test]
    fn parts_come_back_as_they_were_written() {
        let mut zip = ZipReader::new(Cursor::new(sample())).unwrap();
        assert_eq!(zip.read("a").unwrap().unwrap(), b"one");
        assert_eq!(zip.read("b.npy").unwrap().unwrap(), b"");
        assert_eq!(zip.read("c").unwrap(), None);
    }

    #[test]
    fn a_file_that_is_cut_or_changed_is_refused_or_read_as_it_was() {
        let whole = sample();
        let read = |bytes: Vec<u8>| {
            let mut zip = ZipReader::new(Cursor::new(bytes))?;
            zip.read("a")
        };
        for length in 0..whole.len() {
            assert!(read(whole[..length].to_vec()).is_err(), "{length}");
        }
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut changed = whole.clone();
                changed[at] ^= 1 << bit;
                // No panic and no other bytes.
                if let Ok(Some(bytes)) = read(changed) {
                    assert_eq!(bytes, b"one", "{at} {bit}");
                }
            }
        }
    }
}
