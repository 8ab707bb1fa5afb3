//! How long loading takes: the median of five, in milliseconds, for each file named.
//!
//! `cargo run --release -p antumbra-scene --example load_time -- a.obj b.ply`

use std::{path::Path, time::Instant};

use antumbra_scene::{ReadError, ReadOptions, read_file};

#[expect(clippy::print_stdout, reason = "its output is what it is for")]
fn main() -> Result<(), ReadError> {
    for file in std::env::args().skip(1) {
        let mut milliseconds = Vec::new();
        let mut face_count = 0;
        for _ in 0..5 {
            let start = Instant::now();
            let loaded = read_file(Path::new(&file), &ReadOptions::default())?;
            milliseconds.push(start.elapsed().as_secs_f64() * 1e3);
            let faces = loaded
                .scene
                .objects
                .iter()
                .map(|object| object.shape.mesh().map_or(1, |mesh| mesh.face_ends.len()));
            face_count = faces.sum();
        }
        milliseconds.sort_by(f64::total_cmp);
        println!("{:8.1} ms  {face_count:7} faces  {file}", milliseconds[2]);
    }
    Ok(())
}
