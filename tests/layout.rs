//! Files that must agree with the code, and the dependency order of the packages.

#![forbid(unsafe_code)]

use raywake::budget;
use raywake_tests::{files, read, root};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Kernel files without a scalar twin: group counts, and the prelude of all others.
const WITHOUT_TWIN: [&str; 2] = ["plan.wgsl", "shared.wgsl"];

/// Packages of the project that each one may depend on. Packages not listed may depend on any.
const MAY_NAME: [(&str, &[&str]); 15] = [
    ("core", &["raywake-simd"]),
    ("core/objects", &["raywake-core"]),
    ("core/registration", &["raywake-core"]),
    ("gpu", &[]),
    ("gpu/alloc-guard", &[]),
    ("gpu/simd", &[]),
    ("kernels", &["raywake-core", "raywake-gpu"]),
    ("lab/sim", &["raywake-core"]),
    ("host/io", &["raywake-core", "raywake-objects", "raywake-registration", "raywake-sim"]),
    ("host/render", &[]),
    ("host/team", &["raywake-core", "raywake-simd", "raywake-alloc-guard"]),
    ("host/embed", &["raywake-core", "raywake-objects", "raywake-registration", "raywake-team"]),
    ("host/embed/bare", &["raywake-core", "raywake-embed"]),
    ("host/capi", &["raywake-core", "raywake-embed", "raywake-registration"]),
    (
        "host",
        &[
            "raywake-core",
            "raywake-simd",
            "raywake-objects",
            "raywake-registration",
            "raywake-kernels",
            "raywake-gpu",
            "raywake-alloc-guard",
            "raywake-team",
            "raywake-render",
            "raywake-io",
            "raywake-render",
            "raywake-sim",
        ],
    ),
];

/// Compares a file with what the code generates; with `UPDATE=1`, writes it.
fn assert_printed(name: &str, text: &str) {
    let path = root().join(name);
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, text).expect("the file can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == text, "{name} is out of date; UPDATE=1 rewrites it");
}

#[test]
fn the_memory_layout_matches_the_code() {
    assert_printed("memory-layout.md", &budget::memory_layout(&budget::shipped()));
}

#[test]
fn the_parameters_match_the_code() {
    assert_printed("PARAMETERS.md", &budget::parameters());
}

/// Structures of a source file, as tables of their fields: name, type, documentation.
fn fields(source: &str) -> String {
    let mut text = String::new();
    let mut said = Vec::new();
    for line in source.lines().map(str::trim) {
        if let Some(doc) = line.strip_prefix("/// ") {
            said.push(doc);
            continue;
        }
        let about = said.join(" ");
        if let Some(name) = line.strip_prefix("pub struct ") {
            let name = name.trim_end_matches("Record {");
            text += &format!("\n## {}_DTYPE\n\n{about}\n\n", name.to_uppercase());
            text += "| field | type | |\n| --- | --- | --- |\n";
        } else if let Some((name, kind)) =
            line.strip_prefix("pub ").and_then(|field| field.trim_end_matches(',').split_once(": "))
            && name != "reserved"
            && !name.contains(' ')
        {
            text += &format!("| `{name}` | {kind} | {about} |\n");
        }
        if !line.starts_with("#[") {
            said.clear();
        }
    }
    text
}

#[test]
fn fields_of_python_records_match_the_code() {
    let mut text = String::from(
        "# Fields of the arrays of records\n\nWritten by a test from the records' sources; \
         `UPDATE=1` rewrites it.\nFrames: x forward, y left, z up; the world's is that of the \
         poses. `[f32; 2]` is two numbers an\nelement.\n",
    );
    for file in ["host/embed/src/records.rs", "host/python/src/flow_record.rs"] {
        text += &fields(&read(&root().join(file)));
    }
    assert_printed("host/python/FIELDS.md", &text);
}

#[test]
fn every_kernel_is_placed_like_its_twin() {
    let folder = root().join("kernels/wgsl");
    let mut alone = BTreeSet::new();
    for file in files(&folder, ".wgsl") {
        let path = file.strip_prefix(&folder).expect("below").with_extension("rs");
        if !root().join("core/src/stages").join(&path).is_file() {
            alone.insert(path.with_extension("wgsl").display().to_string());
        }
    }
    assert_eq!(alone, WITHOUT_TWIN.map(String::from).into());
}

/// Packages of the project among a manifest's dependencies, excluding development ones.
fn dependencies(manifest: &str) -> Vec<&str> {
    let mut section = "";
    let mut found = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line;
        }
        let name = line.split(['.', ' ', '=']).next().unwrap_or_default();
        let counts = section.ends_with("dependencies]") && !section.contains("dev-");
        if counts && name.starts_with("raywake") {
            found.push(name);
        }
    }
    found
}

#[test]
fn dependencies_run_one_way() {
    for (package, allowed) in MAY_NAME {
        let manifest = read(&root().join(package).join("Cargo.toml"));
        for name in dependencies(&manifest) {
            assert!(allowed.contains(&name), "{package} depends on {name}");
        }
    }
    for package in ["host", "host/io"] {
        let manifest = read(&root().join(package).join("Cargo.toml"));
        let name = |line: &str| line.split(['.', ' ', '=']).next() == Some("raywake-sim");
        let simulator = manifest.lines().find(|line| name(line));
        assert!(simulator.is_none_or(|l| l.contains("optional = true")), "{simulator:?}");
    }
}

#[test]
fn dependencies_are_read() {
    let manifest = "[package]\nname = \"raywake\"\n[features]\nraywake-x = []\n\
                    [dependencies]\nraywake-core.workspace = true\nash = \"1\"\n\
                    [build-dependencies]\nraywake-gpu = { path = \"gpu\" }\n\
                    [dev-dependencies]\nraywake-lab.workspace = true\n";
    assert_eq!(dependencies(manifest), ["raywake-core", "raywake-gpu"]);
}

/// Lines in which a word occurs outside comments and strings.
fn lines_with(word: &str, source: &str) -> Vec<usize> {
    let has = |line: &str| {
        let code = line.split("//").next().unwrap_or_default();
        let outside = code.split('"').step_by(2);
        let parts = outside.flat_map(|part| part.split(|c: char| !c.is_alphanumeric() && c != '_'));
        parts.into_iter().any(|part| part == word)
    };
    (1..).zip(source.lines()).filter(|(_, line)| has(line)).map(|(n, _)| n).collect()
}

#[test]
fn words_are_found() {
    let source = "a b\n// b\nx(\"b\") + ab\nb{}\n#![forbid(b_code)]";
    assert_eq!(lines_with("b", source), [1, 4]);
}

/// Places outside `gpu` where unsafe code is allowed: taking over memory of others, the C
/// interface, a bare machine, and naga's output, which a device is to run.
const TRUSTED: [&str; 5] = [
    "host/embed/src/",
    "host/embed/bare/src/board.rs",
    "host/capi/src/",
    "kernels/src/lib.rs",
    "kernels/build.rs",
];

#[test]
fn only_borders_are_trusted() {
    for package in ["core", "kernels", "host", "lab", "tests"] {
        let trusted = |file: &PathBuf| {
            let path = file.strip_prefix(root()).expect("below").display().to_string();
            TRUSTED.iter().any(|start| path.starts_with(start))
        };
        for file in files(&root().join(package), ".rs").into_iter().filter(|f| !trusted(f)) {
            let lines = lines_with("unsafe", &read(&file));
            assert!(lines.is_empty(), "{}: lines {lines:?}", file.display());
        }
    }
    for library in [
        "core/src",
        "core/objects/src",
        "core/registration/src",
        "host/src",
        "host/io/src",
        "host/team/src",
        "lab/sim/src",
    ] {
        let text = read(&root().join(library).join("lib.rs"));
        assert!(text.contains("#![forbid(unsafe_code)]"), "{library}");
    }
    assert!(Path::new(&root().join("gpu/src/lib.rs")).is_file());
}
