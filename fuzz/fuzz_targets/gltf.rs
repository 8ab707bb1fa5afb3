//! glTF: whatever the bytes are, the reader ends in order; what it reads is written as GLB and read
//! back with the same faces.
#![no_main]

use std::{io, path::Path};

use antumbra_scene::{ReadOptions, read::read_gltf};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let no_files = &mut |_: &str| Err(io::ErrorKind::NotFound.into());
    // What a machine for fuzzing has room for.
    let options = ReadOptions {
        memory_limit: 1 << 30,
        ..ReadOptions::default()
    };
    let Ok(first) = read_gltf(Path::new("a.gltf"), bytes, &options, no_files) else {
        return;
    };
    antumbra_fuzz::check(&first);
    // A few bytes may ask for a great many copies.
    if first.scene.objects.len() < 100 {
        antumbra_fuzz::check_glb(&first.scene);
    }
});
