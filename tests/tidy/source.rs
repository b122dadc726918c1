//! The project's files, without anything that exists only for tests.

use proc_macro2::Span;
use std::path::{Path, PathBuf};
use syn::spanned::Spanned;
use syn::{Attribute, Expr, File, Item, ItemMod, Lit, Meta, MetaNameValue};

/// Folders of a package that do not count as product.
const FOR_TESTS: [&str; 3] = ["tests", "benches", "examples"];

/// One file of Rust or WGSL.
pub struct Source {
    /// Path from the root of the project.
    pub path: String,
    /// Folder of its package.
    pub package: String,
    /// The text, unchanged.
    pub text: String,
    /// Parsed, without test items; `None` for WGSL and for test files.
    pub syntax: Option<File>,
    /// Number of product lines.
    pub lines: usize,
}

impl Source {
    /// Whether it is part of what runs on board.
    pub fn shipped(&self) -> bool {
        !["lab", "tests"].contains(&self.package.split('/').next().unwrap_or_default())
    }

    /// Whether it belongs to a crate under `core`.
    pub fn core(&self) -> bool {
        self.package.split('/').next() == Some("core")
    }
}

/// All files, ordered by path.
pub fn sources(root: &Path) -> Vec<Source> {
    let mut paths = Vec::new();
    walk(root, &mut paths);
    paths.sort();
    let mut all: Vec<_> = paths.iter().map(|path| read(root, path)).collect();
    let modules: Vec<_> = all.iter_mut().flat_map(strip).collect();
    for source in &mut all {
        let path = source.path.as_str();
        let of_test = modules.iter().any(|m| {
            path.strip_prefix(m.as_str()).is_some_and(|rest| rest == ".rs" || rest.starts_with('/'))
        });
        if of_test {
            source.syntax = None;
            source.lines = 0;
        }
    }
    all
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let ending = path.extension().unwrap_or_default();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            walk(&path, found);
        } else if path.is_file() && (ending == "rs" || ending == "wgsl") {
            found.push(path);
        }
    }
}

fn read(root: &Path, path: &Path) -> Source {
    let text = std::fs::read_to_string(path).expect("a text file");
    let of_package = |folder: &&Path| folder.join("Cargo.toml").is_file();
    let package = path.ancestors().skip(1).find(of_package).expect("every file has a package");
    let inside = path.strip_prefix(package).expect("below its package");
    let below = |folder: &Path| folder.to_string_lossy().replace('\\', "/");
    let package = below(package.strip_prefix(root).expect("below the root"));
    let for_tests = package == "tests" || FOR_TESTS.iter().any(|f| inside.starts_with(f));
    let rust = !for_tests && path.extension().is_some_and(|e| e == "rs");
    let name = below(path.strip_prefix(root).expect("below the root"));
    Source {
        syntax: rust.then(|| syn::parse_file(&text).unwrap_or_else(|e| panic!("{name}: {e}"))),
        lines: if for_tests { 0 } else { text.lines().count() },
        path: name,
        package,
        text,
    }
}

/// Removes test items. Returns the paths, without extension, of modules that are for tests.
fn strip(source: &mut Source) -> Vec<String> {
    let mut modules = Vec::new();
    let Some(file) = &mut source.syntax else { return modules };
    source.lines -= strip_items(&mut file.items, &folder_of_modules(&source.path), &mut modules);
    modules
}

/// The folder in which the modules of a file lie.
fn folder_of_modules(path: &str) -> String {
    let (folder, name) = path.rsplit_once('/').unwrap_or(("", path));
    match name {
        "lib.rs" | "main.rs" | "mod.rs" | "build.rs" => folder.to_string(),
        _ => path.trim_end_matches(".rs").to_string(),
    }
}

fn strip_items(items: &mut Vec<Item>, folder: &str, modules: &mut Vec<String>) -> usize {
    let mut lines = 0;
    items.retain_mut(|item| {
        let test = attributes(item).iter().any(is_test);
        if test {
            lines += length(item.span());
        }
        if let Item::Mod(module) = item {
            match &mut module.content {
                Some((_, items)) if !test => lines += strip_items(items, folder, modules),
                None if test => modules.push(place(module, folder)),
                _ => {}
            }
        }
        !test
    });
    lines
}

/// The path, without extension, of a module in its own file.
fn place(module: &ItemMod, folder: &str) -> String {
    let named = module.attrs.iter().find_map(|a| match &a.meta {
        Meta::NameValue(MetaNameValue { path, value: Expr::Lit(value), .. }) => {
            let Lit::Str(text) = &value.lit else { return None };
            path.is_ident("path").then(|| text.value())
        }
        _ => None,
    });
    match named {
        // Next to the file that names it.
        Some(name) => {
            let beside = folder.rsplit_once('/').map_or("", |(beside, _)| beside);
            format!("{beside}/{}", name.trim_end_matches(".rs"))
        }
        None => format!("{folder}/{}", module.ident),
    }
}

/// Number of lines from the first to the last.
pub fn length(span: Span) -> usize {
    span.end().line + 1 - span.start().line
}

/// Whether this is `#[cfg(test)]`, perhaps with more conditions, or `#[test]`.
fn is_test(attribute: &Attribute) -> bool {
    let Meta::List(list) = &attribute.meta else { return attribute.path().is_ident("test") };
    let condition = list.tokens.to_string().replace(' ', "");
    list.path.is_ident("cfg") && (condition == "test" || condition.starts_with("all(test,"))
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}
