//! What the tests share.

use std::{io, path::Path, path::PathBuf};

use antumbra_scene::{
    Loaded, ReadError, ReadOptions,
    read::{read_nff, read_obj},
};

/// Reads NFF text under the name `a.nff`.
pub(crate) fn nff(text: &str) -> Result<Loaded, ReadError> {
    read_nff(Path::new("a.nff"), text.as_bytes())
}

/// Reads OBJ text under the name `a.obj`, with one library called `a.mtl`.
pub(crate) fn obj(text: &str, library: &str) -> Result<Loaded, ReadError> {
    read_obj(
        Path::new("a.obj"),
        text.as_bytes(),
        &ReadOptions::default(),
        &mut |name| {
            if name == "a.mtl" {
                Ok(library.into())
            } else {
                Err(io::ErrorKind::NotFound.into())
            }
        },
    )
}

/// Returns what is said of a scene, apart from what lets light through.
pub(crate) fn beside_shadows(loaded: &Loaded) -> Vec<String> {
    let is_about_shadows = |text: &String| {
        text.contains("light through") || text.contains("nothing in this scene casts a shadow")
    };
    let texts = loaded.warnings.iter().map(ToString::to_string);
    texts.filter(|text| !is_about_shadows(text)).collect()
}

pub(crate) use antumbra_testkit::absent::shared_scenes;

/// Returns all files below a folder that end in `.{extension}`, sorted.
pub(crate) fn files_below(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Small deterministic random numbers (Weyl sequence through a mixer, as in SplitMix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    /// A number of any size up to 2^90, often small or whole.
    pub(crate) fn number(&mut self) -> f64 {
        let mantissa = self.next() as i64 as f64 / i64::MAX as f64;
        match self.below(4) {
            0 => (mantissa * 10.0).round(),
            1 => mantissa,
            _ => mantissa * 2.0_f64.powi(self.below(180) as i32 - 90),
        }
    }
}
