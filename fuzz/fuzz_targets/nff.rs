//! NFF: whatever the bytes are, the reader ends in order; what it reads is written and read back
//! equal.
#![no_main]

use std::path::Path;

use antumbra_scene::{
    read::read_nff,
    write::{Precision, write_nff},
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("a.nff");
    let Ok(first) = read_nff(file, bytes) else {
        return;
    };
    antumbra_fuzz::check(&first);
    let mut text = Vec::new();
    write_nff(&first.scene, Precision::Exact, &mut text).unwrap();
    assert_eq!(read_nff(file, &text).unwrap().scene, first.scene);
});
