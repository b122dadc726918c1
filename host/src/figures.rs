//! The file of a command's figures: `--summary FILE`, or `summary.json` among the results.

use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::console::json;
use raywake_io::Error;
use raywake_io::sink::atomic;
use serde::Serialize;

/// Where the figures go, if anywhere.
pub struct FiguresFile(Option<PathBuf>);

impl FiguresFile {
    /// `named` by the user, else in the folder `out`. Makes the folder, so that a wrong path shows
    /// before the first sweep.
    pub fn create(named: Option<&Path>, out: Option<&Path>) -> Result<FiguresFile, Error> {
        let path = named.map(Path::to_path_buf).or(out.map(|out| out.join("summary.json")));
        // That of an earlier run would vouch for this one, should this one fail.
        if let Some(old) = path.as_deref().filter(|p| p.is_file()) {
            fs::remove_file(old).map_err(Error::writing(old))?;
        }
        match path.as_deref().and_then(Path::parent) {
            Some(folder) if !folder.as_os_str().is_empty() => atomic::create_folder(folder)?,
            _ => (),
        }
        if let Some(folder) = path.as_deref().filter(|p| p.is_dir()) {
            return Err(Error::writing(folder)(ErrorKind::IsADirectory.into()));
        }
        Ok(FiguresFile(path))
    }

    /// Writes the figures as JSON, whole or not at all; to what is not a file (a pipe, a terminal)
    /// as it comes, because a file must not take its place.
    pub fn write(&self, figures: &impl Serialize) -> Result<(), Error> {
        let Some(path) = &self.0 else { return Ok(()) };
        let text = json(figures)?;
        if fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir()) {
            let mut out = File::options().write(true).open(path).map_err(Error::writing(path))?;
            return out.write_all(text.as_bytes()).map_err(Error::writing(path));
        }
        atomic::write(path, |out| out.write_all(text.as_bytes()))
    }
}
