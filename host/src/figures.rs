//! The file with a command's figures: `--summary FILE`, or `summary.json` among the results.

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
    /// `named` by the user, otherwise in the folder `out`. Creates the folder, so that a wrong path
    /// fails before the first sweep.
    pub fn create(named: Option<&Path>, out: Option<&Path>) -> Result<FiguresFile, Error> {
        let path = named.map(Path::to_path_buf).or(out.map(|out| out.join("summary.json")));
        // The file of an earlier run would pass for this one's, should this run fail.
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

    /// Writes the figures as JSON, whole or not at all; to something other than a file (a pipe, a
    /// terminal) directly, as a file must not replace it.
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
