//! A build without pictures.

use std::path::Path;

use raywake_io::Error;
use raywake_io::source::SweepData;

use super::Scene;

/// None: this build has no pictures.
pub enum Pictures {}

impl Pictures {
    /// Fails.
    pub fn folder(_: &Path, _: &str) -> Result<Pictures, Error> {
        Err(Error::Unsupported("--png needs the feature `png`, which is not compiled in".into()))
    }

    /// Fails.
    pub fn file(path: &Path, name: &str) -> Result<Pictures, Error> {
        Pictures::folder(path, name)
    }

    /// Is never called.
    pub fn write(&mut self, _: &SweepData, _: &Scene) -> Result<(), Error> {
        match *self {}
    }
}
