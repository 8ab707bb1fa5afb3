//! OBJ: whatever the bytes are, the reader ends in order; what it reads is written and read back
//! equal.
#![no_main]

use std::{io, path::Path};

use antumbra_scene::read::read_obj;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let file = Path::new("a.obj");
    let library = b"newmtl m\nKd 1 0 0\nnewmtl n\nTf 1 0 0\nillum 4\n";
    let open = &mut |name: &str| match name {
        "a.mtl" => Ok(library.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    if let Ok(first) = read_obj(file, bytes, &Default::default(), open) {
        antumbra_fuzz::check(&first);
        antumbra_fuzz::check_obj(&first.scene);
        antumbra_fuzz::check_ply(&first.scene);
        antumbra_fuzz::check_glb(&first.scene);
    }
});
