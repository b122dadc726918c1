#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Support code shared by the tests of raywake.

pub mod bench;
pub mod drives;
pub mod grid;
pub mod pair;
pub mod random;
pub mod table;
pub mod vulkan;
pub mod weights;

use std::path::{Path, PathBuf};

/// The folder containing all packages.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a package of a workspace").into()
}

/// Every file below a folder whose name ends like this, in order.
pub fn files(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.to_string_lossy().ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Content of a text file.
pub fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Where two sequences first differ, as text; `None` if they are equal.
pub fn difference<T: PartialEq + std::fmt::Debug>(found: &[T], wanted: &[T]) -> Option<String> {
    if let Some(n) = found.iter().zip(wanted).position(|(f, w)| f != w) {
        return Some(format!("element {n} is {:?} instead of {:?}", found[n], wanted[n]));
    }
    let (f, w) = (found.len(), wanted.len());
    (f != w).then(|| format!("{f} elements instead of {w}"))
}
