//! The check of words: how doc comments begin, and words that have a better one (docs/glossary.md).

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use crate::run;

/// First words of doc comments of public items: the first word is the thing ("Maximum number of ...", "Returns ...").
const NO_FIRST_WORDS: &[&str] = &[
    "As few ",
    "As many ",
    "So few ",
    "So many ",
    "The same ",
    "What ",
    "Where ",
    "Who ",
];

/// Words that stand nowhere in the source, each with the better one.
const NO_WORDS: &[(&str, &str)] = &[
    ("colour", "color"),
    ("Colour", "Color"),
    ("behaviour", "behavior"),
    ("KeptLight", "SavedLight"),
    ("kept_lights", "saved_lights"),
    ("is_told", "is_reported"),
];

/// Checks the source of all crates.
pub(crate) fn check() -> Result<()> {
    let mut faults = Vec::new();
    for entry in std::fs::read_dir(run::root().join("crates"))? {
        check_folder(&entry?.path().join("src"), &mut faults)?;
    }
    if faults.is_empty() {
        return Ok(());
    }
    faults.sort();
    bail!("words (docs/glossary.md):\n{}", faults.join("\n"))
}

fn check_folder(folder: &Path, faults: &mut Vec<String>) -> Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            check_folder(&path, faults)?;
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            check_file(&path, &std::fs::read_to_string(&path)?, faults);
        }
    }
    Ok(())
}

fn check_file(path: &Path, text: &str, faults: &mut Vec<String>) {
    let shown: PathBuf = path.strip_prefix(run::root()).unwrap_or(path).to_owned();
    let mut report = |line: usize, fault: String| {
        faults.push(format!("{}:{}: {fault}", shown.display(), line + 1));
    };
    let lines: Vec<&str> = text.lines().map(str::trim_start).collect();
    for (number, line) in lines.iter().enumerate() {
        for (word, better) in NO_WORDS {
            if line.contains(word) {
                report(number, format!("`{word}`: write `{better}`"));
            }
        }
        let Some(words) = line.strip_prefix("/// ") else {
            continue;
        };
        if number > 0 && lines[number - 1].starts_with("///") {
            continue;
        }
        let is_before = |line: &&&str| line.starts_with("///") || line.starts_with("#[");
        let item = lines[number..].iter().find(|line| !is_before(line));
        if item.is_some_and(|item| item.starts_with("pub "))
            && let Some(first) = NO_FIRST_WORDS
                .iter()
                .find(|first| words.starts_with(**first))
        {
            let first = first.trim_end();
            report(
                number,
                format!("a doc comment begins with the thing, not with `{first}`"),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_words_of_public_items_and_spellings_are_told() {
        let told = |text: &str| {
            let mut faults = Vec::new();
            check_file(Path::new("a.rs"), text, &mut faults);
            faults
        };
        assert_eq!(
            told("/// What it is.\n#[derive(Debug)]\npub struct A;\n").len(),
            1
        );
        assert_eq!(told("/// What it is.\nstruct A;\n"), [""; 0]);
        assert_eq!(told("/// Kind.\n/// What else.\npub struct A;\n"), [""; 0]);
        assert_eq!(told("let colour = 1;\n").len(), 1);
    }
}
