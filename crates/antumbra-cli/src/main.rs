//! The `antumbra` program's binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(antumbra_cli::run(std::env::args_os()))
}
