//! A recording's files by name and size: detects changes without reading them.

use std::fs::Metadata;
use std::path::Path;

use raywake_core::digest::Digest;
use raywake_io::Error;
use raywake_io::source::beside;

/// Returns a line for a file, or for a folder and everything in it except linked folders, with what
/// is read from beside it; it changes if names or sizes do. Modification times are left out: a copy
/// local to the machine that processes it has different ones.
///
/// # Errors
/// Something in it cannot be accessed.
pub fn inventory(path: &Path) -> Result<String, Error> {
    let mut found = Vec::new();
    let metadata = path.metadata().map_err(Error::reading(path))?;
    list(path, "", &metadata, &mut found)?;
    for file in beside(path) {
        let metadata = file.metadata().map_err(Error::reading(&file))?;
        let name = file.file_name().unwrap_or_default();
        found.push((format!("../{}", name.display()), metadata.len()));
    }
    found.sort();
    let bytes: u64 = found.iter().map(|(_, bytes)| bytes).sum();
    let digest = Digest::of(format!("{found:?}").as_bytes());
    Ok(format!("{} files of {bytes} bytes, {digest:016x}", found.len()))
}

/// Adds the files at a path, whose name relative to the recording is `name`, with their sizes.
fn list(
    path: &Path,
    name: &str,
    metadata: &Metadata,
    found: &mut Vec<(String, u64)>,
) -> Result<(), Error> {
    if !metadata.is_dir() {
        found.push((name.to_string(), metadata.len()));
        return Ok(());
    }
    for entry in path.read_dir().map_err(Error::reading(path))? {
        let entry = entry.map_err(Error::reading(path))?;
        let within = entry.path();
        let own = entry.metadata().map_err(Error::reading(&within))?;
        let linked = within.metadata().ok().filter(|linked| own.is_symlink() && linked.is_file());
        let metadata = linked.unwrap_or(own);
        let name = format!("{name}/{}", entry.file_name().display());
        list(&within, &name, &metadata, found)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn other_names_and_sizes_make_another_inventory() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let now = || inventory(folder.path()).unwrap();
        fs::create_dir(at("data")).unwrap();
        fs::write(at("data/0.bin"), [0; 16]).unwrap();
        fs::write(at("poses.txt"), "1").unwrap();
        let before = now();
        assert!(before.starts_with("2 files of 17 bytes, "), "{before}");
        fs::write(at("poses.txt"), "2").unwrap();
        assert_eq!(now(), before);
        fs::rename(at("data/0.bin"), at("data/1.bin")).unwrap();
        assert_ne!(now(), before);
        fs::rename(at("data/1.bin"), at("data/0.bin")).unwrap();
        assert_eq!(now(), before);
        fs::write(at("poses.txt"), "12").unwrap();
        assert_ne!(now(), before);
        assert!(inventory(&at("poses.txt")).unwrap().starts_with("1 files of 2 bytes, "));
        assert!(inventory(&at("missing")).is_err());
    }

    #[test]
    fn what_lies_beside_a_capture_counts() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("day.pcap"), [0; 16]).unwrap();
        let now = || inventory(&at("day.pcap")).unwrap();
        let alone = now();
        fs::write(at("other.json"), "1").unwrap();
        assert_eq!(now(), alone);
        fs::write(at("day.json"), "1").unwrap();
        let described = now();
        assert!(described.starts_with("2 files of 17 bytes, "), "{described}");
        fs::write(at("day.json"), "12").unwrap();
        assert_ne!(now(), described);
    }
}
