//! Which file of a package uses names that another one defines. A module's files using names that
//! the module itself defines does not count.

use crate::source::Source;
use std::collections::{BTreeMap, BTreeSet};
use syn::visit::{self, Visit};
use syn::{ItemUse, UseTree, Visibility};

/// Maximum number of steps from a re-export to the definition.
const STEPS: usize = 8;

type Names = Vec<String>;

/// The modules of one package.
#[derive(Default)]
struct Package<'a> {
    /// File of every module.
    modules: BTreeMap<Names, &'a str>,
    /// Names that a module re-exports.
    reexports: BTreeMap<(Names, String), Names>,
}

/// Groups of files that depend on each other in a circle.
pub fn circles(sources: &[Source]) -> Vec<Vec<&str>> {
    let mut packages: BTreeMap<&str, Vec<(&Source, Names)>> = BTreeMap::new();
    for source in sources.iter().filter(|s| s.syntax.is_some()) {
        if let Some(module) = module(source) {
            packages.entry(&source.package).or_default().push((source, module));
        }
    }
    packages.values().flat_map(|files| of_package(files)).collect()
}

/// The path of a file's module; `None` outside `src`.
fn module(source: &Source) -> Option<Names> {
    let inside = source.path.strip_prefix(&source.package)?.strip_prefix("/src/")?;
    let names = inside.strip_suffix(".rs")?.split('/').map(String::from);
    let mut names: Names = names.collect();
    if names.last().is_some_and(|last| last == "mod" || last == "lib") {
        names.pop();
    }
    Some(names)
}

fn of_package<'a>(files: &[(&'a Source, Names)]) -> Vec<Vec<&'a str>> {
    let mut package = Package::default();
    package.modules.extend(files.iter().map(|(source, m)| (m.clone(), source.path.as_str())));
    let named: Vec<_> = files.iter().map(|(source, m)| paths(source, m, &mut package)).collect();
    let mut edges: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for ((source, module), paths) in files.iter().zip(&named) {
        let above: Vec<_> =
            (0..=module.len()).filter_map(|n| package.modules.get(&module[..n])).collect();
        let others = paths.iter().map(|path| package.file(path)).filter(|f| !above.contains(&f));
        edges.insert(&source.path, others.collect());
    }
    groups(&edges)
}

/// Every path in a file that begins in its own package, made absolute.
fn paths(source: &Source, module: &Names, package: &mut Package) -> BTreeSet<Names> {
    let file = source.syntax.as_ref().expect("only parsed files");
    let mut found = Paths { module, package, found: BTreeSet::new() };
    found.visit_file(file);
    found.found
}

impl<'a> Package<'a> {
    /// The file that defines what a path refers to.
    fn file(&self, path: &Names) -> &'a str {
        let mut path = path.clone();
        for _ in 0..STEPS {
            let length = (0..=path.len()).rev().find(|n| self.modules.contains_key(&path[..*n]));
            let (module, rest) = path.split_at(length.unwrap_or(0));
            let reexports = rest.first().map(|name| (module.to_vec(), name.clone()));
            match reexports.and_then(|key| self.reexports.get(&key)) {
                Some(target) => path = [target, &rest[1..]].concat(),
                None => return self.modules.get(module).copied().unwrap_or_default(),
            }
        }
        ""
    }
}

struct Paths<'a, 'b> {
    module: &'a Names,
    package: &'a mut Package<'b>,
    found: BTreeSet<Names>,
}

impl Paths<'_, '_> {
    /// The path from the root; `None` if it begins elsewhere.
    fn absolute(&self, path: &[String]) -> Option<Names> {
        let (first, rest) = path.split_first()?;
        let mut start = self.module.clone();
        match first.as_str() {
            "crate" => start.clear(),
            "self" => {}
            "super" => {
                start.pop();
                let more = rest.iter().take_while(|name| *name == "super").count();
                start.truncate(start.len().saturating_sub(more));
                return Some([&start[..], &rest[more..]].concat());
            }
            child => {
                start.push(child.to_string());
                return self
                    .package
                    .modules
                    .contains_key(&start)
                    .then(|| [&start[..], rest].concat());
            }
        }
        Some([&start[..], rest].concat())
    }

    fn tree(&mut self, tree: &UseTree, before: &[String], public: bool) {
        let with = |name: &dyn ToString| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.tree(&path.tree, &with(&path.ident), public),
            UseTree::Group(group) => group.items.iter().for_each(|t| self.tree(t, before, public)),
            UseTree::Glob(_) => self.found.extend(self.absolute(before)),
            UseTree::Name(name) if name.ident == "self" => self.named(before, None, public),
            UseTree::Name(name) => self.named(&with(&name.ident), None, public),
            UseTree::Rename(name) => {
                self.named(&with(&name.ident), Some(name.rename.to_string()), public);
            }
        }
    }

    fn named(&mut self, path: &[String], renamed: Option<String>, public: bool) {
        let (Some(target), Some(last)) = (self.absolute(path), path.last()) else { return };
        if public {
            let name = renamed.unwrap_or_else(|| last.clone());
            self.package.reexports.insert((self.module.clone(), name), target);
        } else {
            self.found.insert(target);
        }
    }
}

impl<'a> Visit<'a> for Paths<'_, '_> {
    fn visit_item_use(&mut self, item: &'a ItemUse) {
        let public = !matches!(item.vis, Visibility::Inherited);
        self.tree(&item.tree, &[], public);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Names = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1 {
            self.found.extend(self.absolute(&names));
        }
        visit::visit_path(self, path);
    }

    /// Paths within an inline module begin elsewhere.
    fn visit_item_mod(&mut self, _: &'a syn::ItemMod) {}
}

/// Groups of files that reach each other.
fn groups<'a>(edges: &BTreeMap<&'a str, BTreeSet<&'a str>>) -> Vec<Vec<&'a str>> {
    let reached: BTreeMap<_, _> = edges.keys().map(|file| (*file, reach(edges, file))).collect();
    let mut groups = BTreeSet::new();
    for (file, others) in &reached {
        let back = |other: &&str| reached.get(other).is_some_and(|from| from.contains(file));
        let group: Vec<_> = others.iter().copied().filter(back).collect();
        if group.len() > 1 {
            groups.insert(group);
        }
    }
    groups.into_iter().collect()
}

fn reach<'a>(edges: &BTreeMap<&'a str, BTreeSet<&'a str>>, from: &str) -> BTreeSet<&'a str> {
    let (mut reached, mut next) = (BTreeSet::new(), vec![from]);
    while let Some(file) = next.pop() {
        for other in edges.get(file).into_iter().flatten() {
            if reached.insert(*other) {
                next.push(other);
            }
        }
    }
    reached
}
