//! Imports within a crate: none goes round in a circle, and none goes up.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use super::imports::{Import, cycles};
use super::modules::Crate;
use crate::run;

/// Checks the imports of every crate.
pub(super) fn check(floors: &[(&str, &[&str])]) -> Result<()> {
    let mut roots = Vec::new();
    for folder in ["crates", "."] {
        for entry in std::fs::read_dir(run::root().join(folder))? {
            let source = entry?.path().join("src");
            roots.extend(["lib.rs", "main.rs"].map(|name| source.join(name)));
        }
    }
    roots.retain(|root| root.is_file());
    roots.sort();
    let mut faults = Vec::new();
    for root in roots {
        faults.extend(faults_of(&root, floors)?);
    }
    if faults.is_empty() {
        return Ok(());
    }
    bail!("{} faults of imports:\n{}", faults.len(), faults.join("\n"))
}

fn faults_of(root: &Path, floors: &[(&str, &[&str])]) -> Result<Vec<String>> {
    let crate_ = Crate::read(root)?;
    let imports = crate_.imports();
    let source = root.parent().unwrap_or(root);
    let name = |file: usize| -> PathBuf {
        let path = &crate_.files[file];
        path.strip_prefix(run::root()).unwrap_or(path).to_owned()
    };
    let told = |import: &Import| {
        let (from, to) = (name(import.from), name(import.to));
        format!("  {}:{} uses {}", from.display(), import.line, to.display())
    };
    let mut faults = Vec::new();

    let edges = imports.iter().map(|import| (import.from, import.to));
    for group in cycles(&edges.collect()) {
        let is_inside =
            |import: &&Import| group.contains(&import.from) && group.contains(&import.to);
        let lines: Vec<_> = imports.iter().filter(is_inside).map(told).collect();
        faults.push(format!("files in a circle:\n{}", lines.join("\n")));
    }

    // Folders: at each level what lies beside one another.
    let rooms = |import: &Import| {
        let (from, to) = (&crate_.files[import.from], &crate_.files[import.to]);
        rooms_of(source, from, to)
    };
    let mut levels: BTreeMap<PathBuf, BTreeSet<(String, String)>> = BTreeMap::new();
    for import in &imports {
        if let Some((level, from, to)) = rooms(import) {
            levels.entry(level).or_default().insert((from, to));
        }
    }
    for (level, edges) in &levels {
        let edges: BTreeSet<(&str, &str)> =
            edges.iter().map(|(from, to)| (&**from, &**to)).collect();
        for group in cycles(&edges) {
            let is_inside = |import: &&Import| {
                rooms(import).is_some_and(|(at, from, to)| {
                    at == *level && group.contains(&*from) && group.contains(&*to)
                })
            };
            let lines: Vec<_> = imports.iter().filter(is_inside).map(told).collect();
            let group: Vec<&str> = group.into_iter().collect();
            faults.push(format!(
                "folders in a circle in {}: {}\n{}",
                level.strip_prefix(run::root()).unwrap_or(level).display(),
                group.join(", "),
                lines.join("\n")
            ));
        }
    }

    for (folder, floors) in floors {
        if run::root().join(folder) != source {
            continue;
        }
        let floor = |room: &str| {
            floors
                .iter()
                .position(|rooms| rooms.split(' ').any(|r| r == room))
        };
        for import in &imports {
            let Some((level, from, to)) = rooms(import) else {
                continue;
            };
            if level != source {
                continue;
            }
            match (floor(&from), floor(&to)) {
                (Some(from), Some(to)) if from > to => {}
                (None, _) => faults.push(format!("{from} has no floor in xtask's layers")),
                (_, None) => faults.push(format!("{to} has no floor in xtask's layers")),
                _ => faults.push(format!(
                    "an import that does not go down:\n{}",
                    told(import)
                )),
            }
        }
    }
    faults.sort();
    faults.dedup();
    Ok(faults)
}

/// Returns the folder in which the ways to two files part, and which of its rooms each lies in. `None` where one is the
/// folder's own file: `mod.rs`, or the root.
fn rooms_of(source: &Path, from: &Path, to: &Path) -> Option<(PathBuf, String, String)> {
    let parts = |path: &Path| -> Vec<String> {
        let path = path.strip_prefix(source).unwrap_or(path).with_extension("");
        let parts = path.iter().map(|part| part.to_string_lossy().into_owned());
        let is_own = |part: &String| ["mod", "lib", "main"].contains(&&**part);
        parts.filter(|part| !is_own(part)).collect()
    };
    let (from, to) = (parts(from), parts(to));
    let common = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let level = from[..common]
        .iter()
        .fold(source.to_owned(), |at, part| at.join(part));
    Some((level, from.get(common)?.clone(), to.get(common)?.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the faults of a crate of files, each a path and its text.
    fn faults(files: &[(&str, &str)], floors: &[(&str, &[&str])]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = folder.path().join(path);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        let source = folder.path().to_str().unwrap();
        let floors: Vec<_> = floors.iter().map(|&(_, floors)| (source, floors)).collect();
        faults_of(&folder.path().join("lib.rs"), &floors).unwrap()
    }

    #[test]
    fn a_path_in_an_expression_and_a_use_make_a_circle() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            ("a.rs", "pub struct A; fn f() { crate::b::g() }"),
            ("b.rs", "use crate::a::A; pub fn g() {} fn h(_: A) {}"),
        ];
        let found = faults(&files, &[]);
        assert_eq!(found.len(), 2, "of files, and of rooms: {found:?}");
        assert!(found.iter().all(|fault| fault.contains("a.rs:1 uses")));
    }

    #[test]
    fn a_file_that_takes_from_its_parent_makes_a_circle_with_it() {
        let files = [
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod b; pub use b::B; pub struct Shared;"),
            ("a/b.rs", "use super::Shared; pub struct B(Shared);"),
        ];
        assert_eq!(faults(&files, &[]).len(), 1);
        // From a leaf file it takes no harm, by whatever way.
        let files = [
            ("lib.rs", "mod a;"),
            ("a/mod.rs", "mod b; mod leaf; pub use b::B; use leaf::*;"),
            ("a/b.rs", "use super::Shared; pub struct B(Shared);"),
            ("a/leaf.rs", "pub struct Shared;"),
        ];
        assert_eq!(faults(&files, &[]), [""; 0]);
    }

    #[test]
    fn tests_may_look_anywhere_and_names_in_macros_count() {
        let files = [
            ("lib.rs", "mod a; mod b;"),
            (
                "a.rs",
                "pub struct A; #[cfg(test)] mod tests { use crate::b; }",
            ),
            ("b.rs", "fn f() { assert!(matches!(1, crate::a::A::ONE)) }"),
        ];
        assert_eq!(faults(&files, &[]), [""; 0]);
        let up = faults(&files, &[("", &["b", "a"])]);
        assert_eq!(up.len(), 1, "{up:?}");
        assert!(up[0].contains("does not go down"), "{up:?}");
        let unknown = faults(&files, &[("", &["a"])]);
        assert!(unknown[0].contains("has no floor"), "{unknown:?}");
    }
}
