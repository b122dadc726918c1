//! What lies at the path of a recording: whether it is still the same can be told in no time.

use std::fmt;
use std::fs::Metadata;
use std::path::Path;

use raywake_core::digest::Digest;
use raywake_io::Error;

/// Files of a recording, by name and size. Times of change are left out: a copy beside the
/// processor that works on it has others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inventory {
    files: u64,
    bytes: u64,
    /// Of names and sizes.
    digest: u64,
}

impl Inventory {
    /// Of a file, or of a folder and of those in it, but for folders that links lead to.
    ///
    /// # Errors
    /// Something in it cannot be looked at.
    pub fn of(path: &Path) -> Result<Inventory, Error> {
        let mut found = Vec::new();
        let metadata = path.metadata().map_err(Error::reading(path))?;
        list(path, "", &metadata, &mut found)?;
        found.sort();
        Ok(Inventory {
            files: found.len() as u64,
            bytes: found.iter().map(|(_, bytes)| bytes).sum(),
            digest: Digest::of(format!("{found:?}").as_bytes()),
        })
    }
}

/// Adds the files at a path, called `name` below the recording's, with their sizes.
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

impl fmt::Display for Inventory {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Inventory { files, bytes, digest } = self;
        write!(f, "{files} files of {bytes} bytes, {digest:016x}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn other_names_and_sizes_make_another_inventory() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let now = || Inventory::of(folder.path()).unwrap();
        fs::create_dir(at("data")).unwrap();
        fs::write(at("data/0.bin"), [0; 16]).unwrap();
        fs::write(at("poses.txt"), "1").unwrap();
        let before = now();
        assert_eq!((before.files, before.bytes), (2, 17));
        fs::write(at("poses.txt"), "2").unwrap();
        assert_eq!(now(), before);
        fs::rename(at("data/0.bin"), at("data/1.bin")).unwrap();
        assert_ne!(now(), before);
        fs::rename(at("data/1.bin"), at("data/0.bin")).unwrap();
        assert_eq!(now(), before);
        fs::write(at("poses.txt"), "12").unwrap();
        assert_ne!(now(), before);
        let alone = Inventory::of(&at("poses.txt")).unwrap();
        assert_eq!((alone.files, alone.bytes), (1, 2));
        assert!(Inventory::of(&at("missing")).is_err());
    }
}
