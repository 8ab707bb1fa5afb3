//! PLY: whatever the bytes are, the reader ends in order; what it reads is written as PLY
//! and OBJ and read back with the same faces.
#![no_main]

use std::path::Path;

use antumbra_scene::read::read_ply;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(first) = read_ply(Path::new("a.ply"), bytes, &Default::default()) {
        antumbra_fuzz::check(&first);
        antumbra_fuzz::check_ply(&first.scene);
        antumbra_fuzz::check_obj(&first.scene);
    }
});
