//! Limits on the code's sizes and shapes, and what still exceeds them.
//!
//! `limits.txt` lists every excess with its size. The list only shrinks: a new or larger excess
//! fails, and so does one that has become smaller until the list is updated. `UPDATE=1` writes
//! those that have become smaller, and nothing else.

#![forbid(unsafe_code)]

mod functions;
mod imports;
mod source;

use functions::{Contents, lengths, quantile};
use raywake_tests::{read, root};
use source::{Source, sources};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Maximum number of columns of a line.
const COLUMNS: usize = 100;
/// Maximum number of lines of a file.
const FILE_LINES: usize = 400;
/// Maximum number of lines of a function.
const FUNCTION_LINES: usize = 60;
/// Maximum number of lines of half of a package's functions, and of nine tenths.
const SHARES: [(&str, f64, usize); 2] = [("median", 0.5, 8), ("ninth-decile", 0.9, 24)];

/// Excesses over a limit, by kind and place.
type Excesses = BTreeMap<String, usize>;

fn measure(all: &[Source]) -> Excesses {
    let contents: Vec<_> = all.iter().map(|source| (source, Contents::of(source))).collect();
    let mut found = Excesses::new();
    let mut over = |kind: &str, place: &str, value: usize, limit: usize| {
        if value > limit {
            let most = found.entry(format!("{kind} {place}")).or_default();
            *most = value.max(*most);
        }
    };
    for source in all {
        let long = source.text.lines().filter(|line| line.chars().count() > COLUMNS).count();
        over("long-lines", &source.path, long, 0);
        over("file-lines", &source.path, source.text.lines().count(), FILE_LINES);
    }
    for (source, contents) in &contents {
        for (name, lines) in &contents.functions {
            over("function-lines", &format!("{} {name}", source.path), *lines, FUNCTION_LINES);
        }
        let floats =
            if source.core() && !source.path.contains("/params") { contents.floats } else { 0 };
        over("unnamed-floats", &source.path, floats, 0);
    }
    for (package, mut lengths) in lengths(&contents) {
        for (name, share, limit) in SHARES {
            over(&format!("{name}-function-lines"), package, quantile(&mut lengths, share), limit);
        }
    }
    let mut types = BTreeMap::new();
    for name in contents.iter().filter(|(s, _)| s.shipped()).flat_map(|(_, c)| &c.types) {
        *types.entry(name.as_str()).or_default() += 1;
    }
    types.iter().for_each(|(name, count)| over("types-of-one-name", name, *count, 1));
    for circle in imports::circles(all) {
        over("circle", &circle.join(" "), circle.len(), 0);
    }
    found
}

fn list() -> PathBuf {
    root().join("tests/tidy/limits.txt")
}

#[test]
fn nothing_exceeds_its_limit_by_more_than_the_list_says() {
    let found = measure(&sources(&root()));
    let mut listed = listed();
    if std::env::var_os("UPDATE").is_some() {
        // New or larger excesses remain errors: the list never grows.
        listed.retain(|excess, _| found.contains_key(excess));
        listed.iter_mut().for_each(|(excess, size)| *size = found[excess].min(*size));
        let lines = listed.iter().map(|(excess, size)| format!("{excess} {size}\n"));
        std::fs::write(list(), lines.collect::<String>()).expect("the list can be written");
    }
    let differences = differences(&found, &listed);
    assert!(differences.is_empty(), "\n{}\n", differences.join("\n"));
}

/// The current list.
fn listed() -> Excesses {
    let split = |line: &str| {
        let (excess, size) = line.rsplit_once(' ').expect("an excess and its size");
        (excess.to_string(), size.parse().expect("a size"))
    };
    read(&list()).lines().map(split).collect()
}

fn differences(found: &Excesses, listed: &Excesses) -> Vec<String> {
    let worse = found.iter().filter_map(|(excess, &size)| match listed.get(excess) {
        None => Some(format!("new: {excess} {size}")),
        Some(&before) if size > before => Some(format!("worse: {excess} {size}, was {before}")),
        _ => None,
    });
    let better = listed.iter().filter_map(|(excess, &before)| match found.get(excess) {
        None => Some(format!("gone, take it off the list: {excess} {before}")),
        Some(&size) if size < before => Some(format!("better, write {size}: {excess} {before}")),
        _ => None,
    });
    worse.chain(better).collect()
}

#[test]
fn the_list_only_shrinks() {
    let of = |entries: &[(&str, usize)]| -> Excesses {
        entries.iter().map(|(excess, size)| (excess.to_string(), *size)).collect()
    };
    let listed = of(&[("a x", 3), ("b y", 5)]);
    assert!(differences(&listed, &listed).is_empty());
    let told = |found| differences(&of(found), &listed);
    assert_eq!(told(&[("a x", 3), ("b y", 6)]), ["worse: b y 6, was 5"]);
    assert_eq!(told(&[("a x", 3), ("b y", 4)]), ["better, write 4: b y 5"]);
    assert_eq!(told(&[("a x", 3)]), ["gone, take it off the list: b y 5"]);
    assert_eq!(told(&[("a x", 3), ("b y", 5), ("c z", 1)]), ["new: c z 1"]);
}

/// `cargo test -p raywake-tests --test tidy lines -- --nocapture` prints the counts; `RAYWAKE_TREE`
/// selects another tree.
#[test]
fn lines_of_product_are_counted() {
    let tree = std::env::var_os("RAYWAKE_TREE").map_or_else(root, PathBuf::from);
    let mut packages: BTreeMap<String, (usize, Vec<usize>)> = BTreeMap::new();
    for source in &sources(&tree) {
        let (lines, lengths) = packages.entry(source.package.clone()).or_default();
        *lines += source.lines;
        lengths.extend(Contents::of(source).functions.iter().map(|(_, lines)| lines));
    }
    println!("{:20} lines   functions: median, ninth decile, longest", "package");
    for (package, (lines, lengths)) in &mut packages {
        let [median, decile, longest] = [0.5, 0.9, 1.0].map(|share| quantile(lengths, share));
        println!("{package:20} {lines:5} {:5}: {median}, {decile}, {longest}", lengths.len());
    }
    let sum: usize = packages.values().map(|(lines, _)| lines).sum();
    println!("{:20} {sum:5}", "all");
    assert!(sum > 0);
}
