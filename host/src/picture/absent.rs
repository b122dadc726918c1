//! Stand-in for pictures in a build without them.

use std::path::Path;

use raywake_io::Error;
use raywake_io::source::SweepData;

use super::{PictureFiles, Subject, SweepFigures};

/// No pictures.
pub struct NoPictures;

pub use NoPictures as Pictures;

impl NoPictures {
    /// Fails if any picture is asked for.
    pub fn create(files: &PictureFiles, _: &str, _: usize) -> Result<NoPictures, Error> {
        if files.is_empty() { Ok(NoPictures) } else { Err(lacking()) }
    }

    /// Returns `false`.
    pub fn are_enabled(&self) -> bool {
        false
    }

    /// Draws nothing.
    pub fn write(&mut self, _: &SweepData, _: &Subject, _: &SweepFigures) -> Result<(), Error> {
        Ok(())
    }

    /// Does nothing.
    pub fn finish(self, _: &str) -> Result<(), Error> {
        Ok(())
    }
}

/// Always fails.
pub fn write_one(_: &Path, _: &SweepData, _: &Subject, _: &str) -> Result<(), Error> {
    Err(lacking())
}

fn lacking() -> Error {
    Error::missing_feature("a picture", "png")
}
