//! The check that no code with wide registers calls its operations one by one.
//!
//! A function that is generic over `Simd` has wide registers only where it is inlined into what `dispatch` or `vectorize`
//! runs. Elsewhere each operation becomes a call, and our rays took two to five times as long, unnoticed,
//! on every processor without AVX-512. In: the release build of the program. Out: the functions that call such operations.
//! By hand, as the build takes minutes; objdump (binutils) must be there.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::run;

/// Part of the names of the functions that operations are where they are not inlined.
const OPERATION: &str = "__fearless_simd_kernel";

/// Builds the program and looks at it.
pub(crate) fn check() -> Result<()> {
    run::cargo(
        &[
            "build",
            "--release",
            "--locked",
            "--package",
            "antumbra-cli",
        ],
        &[],
    )?;
    let program = run::root().join("target/release/antumbra");
    let mut objdump = Command::new("objdump")
        .args(["-d", "-C", "--no-show-raw-insn"])
        .arg(&program)
        .stdout(Stdio::piped())
        .spawn()
        .context("objdump (binutils) does not start")?;
    let output = objdump.stdout.take().context("objdump says nothing")?;
    let calls = calls(BufReader::new(output))?;
    if !objdump.wait()?.success() {
        bail!("objdump failed");
    }
    let faults: Vec<String> = calls
        .iter()
        .map(|(function, count)| format!("{count} calls in {function}"))
        .collect();
    if faults.is_empty() {
        return Ok(());
    }
    bail!(
        "operations that are not inlined:\n{}\nwrap a function that is not inlined in `vectorize`; write a function for a closure",
        faults.join("\n")
    );
}

/// Returns which functions of a disassembly call operations, and how often.
fn calls(lines: impl BufRead) -> Result<BTreeMap<String, usize>> {
    let mut function = String::new();
    let mut calls = BTreeMap::new();
    for line in lines.split(b'\n') {
        let line = line?;
        let line = String::from_utf8_lossy(&line);
        if line.ends_with(">:") {
            function = line
                .split_once(" <")
                .map_or("", |(_, name)| name.trim_end_matches(">:"))
                .into();
        } else if line.contains("call ") && line.contains(OPERATION) {
            *calls.entry(function.clone()).or_default() += 1;
        }
    }
    Ok(calls)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_counted_for_each_function() {
        let text = "\
0000000000001000 <antumbra::near>:
    1000: call   2000 <<fearless_simd::generated::avx2::Avx2 as Simd>::mul_f32x8::kernel::__fearless_simd_kernel>
    1005: call   2000 <<fearless_simd::generated::sse4_2::Sse4_2 as Simd>::mul_f32x4::kernel::__fearless_simd_kernel>
    100a: call   3000 <memcpy>
0000000000001100 <antumbra::far>:
    1100: call   3000 <memcpy>
";
        let counted = calls(text.as_bytes()).expect("text");
        assert_eq!(counted, BTreeMap::from([("antumbra::near".to_owned(), 2)]));
    }
}
