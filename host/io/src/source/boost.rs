//! XML as serialised by boost: tracklets of KITTI drives, calibrations of Velodyne sensors.

use std::path::Path;

use roxmltree::{Document, ParsingOptions};

use super::whole;
use crate::Error;

/// Maximum accepted number of elements, texts and attributes: labels of 25 sweeps of a full
/// simulated street have 46,000.
const NODES_MAX: u32 = 1 << 20;
/// Maximum accepted number of attributes per element: such files have five at most.
const ATTRIBUTES_MAX: usize = 100;

/// Parses a file and returns what `each` makes of it.
///
/// # Errors
/// The file cannot be read, is not complete XML, or would take memory or time out of proportion to
/// its size: text defined once and inserted many times, and attributes and namespaces, each of
/// which is compared with those before it. Or what `each` returns.
pub fn read<T>(path: &Path, each: impl FnOnce(&Document) -> Result<T, Error>) -> Result<T, Error> {
    let text = whole::read_settings(path)?;
    check_size(&text).map_err(|what| Error::input(path, "", what))?;
    let options =
        ParsingOptions { allow_dtd: true, nodes_limit: NODES_MAX, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|e| {
        Error::input(path, format!("line {}", e.pos().row), format!("not valid XML: {e}"))
    })?;
    each(&document)
}

fn check_size(text: &str) -> Result<(), String> {
    if text.contains("<!ENTITY") {
        return Err("defines entities, which boost does not".into());
    }
    if text.contains("xmlns") {
        return Err("has namespaces, which boost does not".into());
    }
    // The value of an attribute may contain a `>`, but not a `<`.
    match text.split('<').map(|tag| tag.matches('=').count()).max() {
        Some(most) if most > ATTRIBUTES_MAX => Err(format!("{most} attributes in one element")),
        _ => Ok(()),
    }
}
