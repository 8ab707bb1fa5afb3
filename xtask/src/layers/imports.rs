//! Which file uses which, and the cycles among them.
//!
//! In: a crate's modules. Out: an import for each path that leads to another file, to the one that defines what is named:
//! re-exports are followed. A file that re-exports what a file below it defines uses that file, too, so a file below that
//! takes something defined in its parent makes a cycle with a parent that brings its names out.

use std::collections::{BTreeMap, BTreeSet};

use super::modules::Crate;

/// Re-exports of re-exports that are followed.
const MOST_STEPS: usize = 16;

/// One file uses what another defines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Import {
    /// The file that uses.
    pub(super) from: usize,
    /// The file that defines.
    pub(super) to: usize,
    /// First line where it is used.
    pub(super) line: usize,
}

/// Where a path leads.
#[derive(Clone, Copy)]
enum Found {
    Module(usize),
    /// Something that a module defines.
    ItemOf(usize),
}

impl Crate {
    /// Returns what files use of one another, each pair once.
    pub(super) fn imports(&self) -> Vec<Import> {
        let mut lines: BTreeMap<(usize, usize), usize> = BTreeMap::new();
        for (number, module) in self.modules.iter().enumerate() {
            for reference in &module.references {
                let found = self.resolve(number, &reference.segments, 0);
                let Some(Found::ItemOf(definer)) = found else {
                    continue;
                };
                let pair = (module.file, self.modules[definer].file);
                if pair.0 != pair.1 {
                    let line = lines.entry(pair).or_insert(reference.line);
                    *line = reference.line.min(*line);
                }
            }
        }
        let import = |((from, to), line)| Import { from, to, line };
        lines.into_iter().map(import).collect()
    }

    /// Follows a path as it stands in a module; `None` leads to another crate, or to what has no name of its own.
    fn resolve(&self, module: usize, segments: &[String], steps: usize) -> Option<Found> {
        let (first, rest) = segments.split_first()?;
        let here = &self.modules[module];
        match first.as_str() {
            "crate" => self.walk(0, rest, steps),
            "self" => self.walk(module, rest, steps),
            "super" => {
                let parent = here.parent?;
                match rest.first().map(String::as_str) {
                    Some("super") => self.resolve(parent, rest, steps),
                    _ => self.walk(parent, rest, steps),
                }
            }
            name => {
                if here.children.contains_key(name) || here.items.contains(name) {
                    return self.walk(module, segments, steps);
                }
                self.by_name(module, name, rest, steps)
            }
        }
    }

    /// Follows what a `use` of the module names.
    fn by_name(&self, module: usize, name: &str, rest: &[String], steps: usize) -> Option<Found> {
        if steps > MOST_STEPS {
            return None;
        }
        let here = &self.modules[module];
        if let Some(path) = here.names.get(name) {
            return match self.resolve(module, path, steps + 1)? {
                Found::Module(module) => self.walk(module, rest, steps + 1),
                item @ Found::ItemOf(_) => Some(item),
            };
        }
        let defines = |&module: &usize| {
            let there = &self.modules[module];
            there.items.contains(name)
                || there.children.contains_key(name)
                || there.names.contains_key(name)
        };
        let globs =
            here.globs
                .iter()
                .filter_map(|path| match self.resolve(module, path, steps + 1)? {
                    Found::Module(module) => Some(module),
                    Found::ItemOf(_) => None,
                });
        let module = globs.filter(|&glob| glob != module).find(defines)?;
        let segments = [&[name.to_owned()], rest].concat();
        self.walk(module, &segments, steps + 1)
    }

    /// Follows the rest of a path from a module.
    fn walk(&self, module: usize, rest: &[String], steps: usize) -> Option<Found> {
        let Some((first, after)) = rest.split_first() else {
            return Some(Found::Module(module));
        };
        let here = &self.modules[module];
        if let Some(&child) = here.children.get(first) {
            return self.walk(child, after, steps);
        }
        if here.items.contains(first) {
            return Some(Found::ItemOf(module));
        }
        self.by_name(module, first, after, steps)
    }
}

/// Returns the nodes that lie on cycles, each group of nodes that lead to one another together.
pub(super) fn cycles<T: Copy + Ord>(edges: &BTreeSet<(T, T)>) -> Vec<BTreeSet<T>> {
    let mut next: BTreeMap<T, Vec<T>> = BTreeMap::new();
    for &(from, to) in edges {
        next.entry(from).or_default().push(to);
    }
    let reached = |start: T| {
        let mut seen = BTreeSet::new();
        let mut waiting = vec![start];
        while let Some(node) = waiting.pop() {
            for &to in next.get(&node).into_iter().flatten() {
                if seen.insert(to) {
                    waiting.push(to);
                }
            }
        }
        seen
    };
    let all: BTreeMap<T, BTreeSet<T>> = next.keys().map(|&node| (node, reached(node))).collect();
    let mut groups: BTreeSet<BTreeSet<T>> = BTreeSet::new();
    for (&node, reached) in &all {
        let back = |other: &&T| all.get(other).is_some_and(|set| set.contains(&node));
        let group: BTreeSet<T> = reached.iter().filter(back).copied().collect();
        if group.len() > 1 {
            groups.insert(group);
        }
    }
    groups.into_iter().collect()
}
