//! The modules of a crate, as its source says.
//!
//! In: the root file of a crate. Out: its modules, with what each defines, brings in by `use`, and names by path. What is
//! for tests alone is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use proc_macro2::{TokenStream, TokenTree};
use syn::spanned::Spanned as _;
use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree};

/// A path that stands in the source, and where.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    pub(super) segments: Vec<String>,
    pub(super) line: usize,
}

/// A module of a crate.
#[derive(Debug, Default)]
pub(super) struct Module {
    /// Place among the crate's files; modules that stand in one file share it.
    pub(super) file: usize,
    pub(super) parent: Option<usize>,
    pub(super) children: BTreeMap<String, usize>,
    /// Names of what is defined here.
    pub(super) items: BTreeSet<String>,
    /// What `use` gives a name here.
    pub(super) names: BTreeMap<String, Vec<String>>,
    /// Modules whose names are all brought in.
    pub(super) globs: Vec<Vec<String>>,
    pub(super) references: Vec<Reference>,
}

/// All modules of a crate; the first is the root.
#[derive(Debug, Default)]
pub(super) struct Crate {
    pub(super) modules: Vec<Module>,
    pub(super) files: Vec<PathBuf>,
}

impl Crate {
    /// Reads a crate from its root file.
    pub(super) fn read(root: &Path) -> Result<Self> {
        let mut crate_ = Self::default();
        let folder = root.parent().context("a root file lies in a folder")?;
        crate_.read_file(root, folder, None)?;
        Ok(crate_)
    }

    /// Reads a file; modules below it lie in `folder`. Returns the number of its module.
    fn read_file(&mut self, path: &Path, folder: &Path, parent: Option<usize>) -> Result<usize> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let parsed = syn::parse_file(&text).with_context(|| path.display().to_string())?;
        let file = self.files.len();
        self.files.push(path.to_owned());
        self.add_module(&parsed.items, file, folder, parent)
    }

    fn add_module(
        &mut self,
        items: &[Item],
        file: usize,
        folder: &Path,
        parent: Option<usize>,
    ) -> Result<usize> {
        let number = self.modules.len();
        self.modules.push(Module {
            file,
            parent,
            ..Module::default()
        });
        let mut reader = Reader {
            module: Module::default(),
        };
        for item in items {
            if is_for_tests(attributes(item)) {
                continue;
            }
            let Item::Mod(child) = item else {
                reader.module.items.extend(name_of(item));
                reader.visit_item(item);
                continue;
            };
            let name = child.ident.to_string();
            let below = folder.join(&name);
            let child = match &child.content {
                Some((_, items)) => self.add_module(items, file, &below, Some(number))?,
                None => {
                    let path = file_of(folder, &name)?;
                    self.read_file(&path, &below, Some(number))?
                }
            };
            reader.module.children.insert(name, child);
        }
        self.modules[number] = Module {
            file,
            parent,
            ..reader.module
        };
        Ok(number)
    }
}

fn file_of(folder: &Path, name: &str) -> Result<PathBuf> {
    let places = [
        folder.join(format!("{name}.rs")),
        folder.join(name).join("mod.rs"),
    ];
    match places.into_iter().find(|path| path.is_file()) {
        Some(path) => Ok(path),
        None => bail!("no file of module {name} in {}", folder.display()),
    }
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::List(list) => {
            attribute.path().is_ident("cfg") && list.tokens.to_string() == "test"
        }
        _ => attribute.path().is_ident("test"),
    })
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name_of(item: &Item) -> Option<String> {
    let name = match item {
        Item::Const(item) => &item.ident,
        Item::Enum(item) => &item.ident,
        Item::Fn(item) => &item.sig.ident,
        Item::Macro(item) => item.ident.as_ref()?,
        Item::Static(item) => &item.ident,
        Item::Struct(item) => &item.ident,
        Item::Trait(item) => &item.ident,
        Item::Type(item) => &item.ident,
        Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(name.to_string())
}

/// Collects what a module's items name.
struct Reader {
    module: Module,
}

impl Reader {
    fn note(&mut self, segments: Vec<String>, line: usize) {
        self.module.references.push(Reference { segments, line });
    }

    fn add_use(&mut self, tree: &UseTree, prefix: &[String], line: usize) {
        let with = |name: &syn::Ident| [prefix, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.add_use(&path.tree, &with(&path.ident), line),
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.add_use(tree, prefix, line);
                }
            }
            UseTree::Glob(_) => {
                self.note(prefix.to_vec(), line);
                self.module.globs.push(prefix.to_vec());
            }
            UseTree::Name(name) => self.bring(with(&name.ident), &name.ident.to_string(), line),
            UseTree::Rename(name) => self.bring(with(&name.ident), &name.rename.to_string(), line),
        }
    }

    fn bring(&mut self, mut segments: Vec<String>, name: &str, line: usize) {
        let mut name = name.to_owned();
        if segments.last().is_some_and(|last| last == "self") {
            segments.pop();
            if name == "self" {
                name = segments.last().cloned().unwrap_or_default();
            }
        }
        self.note(segments.clone(), line);
        // A name that stands for itself is that of another crate.
        if segments.len() > 1 || segments.first() != Some(&name) {
            self.module.names.insert(name, segments);
        }
    }

    /// Notes the paths in the tokens of a macro call.
    fn add_tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = Vec::new();
        let mut line = 0;
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Punct(punct) if punct.as_char() == ':' && !path.is_empty() => {
                    colons += 1;
                }
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.note(std::mem::take(&mut path), line);
                        line = ident.span().start().line;
                    }
                    path.push(ident.to_string());
                    colons = 0;
                }
                other => {
                    self.note(std::mem::take(&mut path), line);
                    colons = 0;
                    if let TokenTree::Group(group) = other {
                        self.add_tokens(group.stream());
                    }
                }
            }
        }
        self.note(path, line);
    }
}

impl<'ast> Visit<'ast> for Reader {
    fn visit_item(&mut self, item: &'ast Item) {
        if !is_for_tests(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.add_use(&item.tree, &[], item.span().start().line);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let segments = path.segments.iter().map(|part| part.ident.to_string());
        self.note(segments.collect(), path.span().start().line);
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        visit::visit_macro(self, call);
        self.add_tokens(call.tokens.clone());
    }

    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {
        // `pub(in path)` is no import.
    }

    fn visit_attribute(&mut self, _: &'ast Attribute) {}
}
