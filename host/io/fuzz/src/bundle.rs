//! A recording of many files as a single file, for a fuzzer to damage.
//!
//! ```text
//! day/drive scene-0061        what to open, below the folder; topics
//! \n%%% day/drive/times.txt\n file after file: where it belongs
//! 0.0                         and what is in it
//! ```

use std::collections::BTreeMap;
use std::path::{Component, Path};

const FILE: &[u8] = b"\n%%% ";

/// Files of a recording, by path below its folder.
#[derive(Debug, Default, PartialEq)]
pub struct Bundle {
    /// What is opened, below the folder.
    pub root: String,
    /// Topics chosen within it.
    pub topics: Vec<String>,
    /// Contents by path.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl Bundle {
    /// Parses what [`bytes`](Bundle::bytes) writes. `None` for anything else, and for paths outside
    /// the folder.
    pub fn parse(bytes: &[u8]) -> Option<Bundle> {
        let mut parts = split(bytes, FILE).into_iter();
        let mut words = str::from_utf8(parts.next()?).ok()?.split(' ');
        let root = words.next()?.to_string();
        let topics = words.map(str::to_string).collect();
        let files = parts.map(file).collect::<Option<BTreeMap<_, _>>>()?;
        let sound = inside(&root) && files.keys().all(|place| inside(place) && !place.is_empty());
        sound.then_some(Bundle { root, topics, files })
    }

    /// The recording as one file.
    pub fn bytes(&self) -> Vec<u8> {
        let words: Vec<&str> = [&self.root].into_iter().chain(&self.topics).map(|s| &**s).collect();
        let mut bytes = words.join(" ").into_bytes();
        for (place, content) in &self.files {
            bytes.extend([FILE, place.as_bytes(), b"\n", content].concat());
        }
        bytes
    }
}

/// A file's path, and its contents after the line break.
fn file(part: &[u8]) -> Option<(String, Vec<u8>)> {
    let end = part.iter().position(|byte| *byte == b'\n')?;
    Some((str::from_utf8(&part[..end]).ok()?.to_string(), part[end + 1..].to_vec()))
}

/// Whether a path is below the folder.
fn inside(place: &String) -> bool {
    let names = |part| matches!(part, Component::Normal(_));
    !place.contains('\0') && place.len() < 200 && Path::new(place).components().all(names)
}

/// Parts between separators.
fn split<'a>(bytes: &'a [u8], separator: &[u8]) -> Vec<&'a [u8]> {
    let (mut parts, mut rest) = (Vec::new(), bytes);
    while let Some(at) = rest.windows(separator.len()).position(|part| part == separator) {
        parts.push(&rest[..at]);
        rest = &rest[at + separator.len()..];
    }
    parts.push(rest);
    parts
}
