//! Pictures of what the program finds, seen from above.

#[cfg(feature = "png")]
mod drawing;
#[cfg(feature = "png")]
mod flow;
#[cfg(feature = "png")]
mod map;
#[cfg(feature = "png")]
mod tracks;

#[cfg(all(test, feature = "png"))]
mod tests;

use std::io::Write;
use std::path::{Path, PathBuf};

use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_io::Error;
use raywake_io::sink::{atomic, feather::Voxel};
use raywake_io::source::SweepData;
use raywake_objects::front_end::Track;

use crate::args::PictureFrame;

/// What a picture shows besides the returns of its sweep.
pub enum Subject<'a> {
    /// The flow of the sweep's columns.
    Flow {
        /// Its columns.
        columns: &'a [ColumnFlow],
        /// Gives the window.
        profile: &'a Profile,
        /// Which velocity is drawn.
        frame: PictureFrame,
    },
    /// The sweep's sparse map, in place of its returns.
    Map {
        /// Its voxels, those of a column one after the other.
        voxels: &'a [Voxel],
        /// Corner of the voxel (0, 0, 0) in the world, m.
        origin_m: [f64; 3],
        /// Edge of a voxel, m.
        voxel_m: f64,
    },
    /// The tracks after the sweep; those that are not live are left out.
    Tracks(&'a [Track]),
}

/// The pictures of a recording.
pub struct Pictures {
    path: PathBuf,
    /// Whether `path` is the one picture's file.
    single: bool,
    name: String,
    /// Stamp of the first sweep drawn, s.
    start_s: Option<f64>,
}

impl Pictures {
    /// One picture for each sweep of the recording `name`: FRAME.png in this folder, which is made
    /// where it is missing.
    ///
    /// # Errors
    /// Where the folder cannot be made, or this build has no pictures.
    pub fn folder(path: &Path, name: &str) -> Result<Pictures, Error> {
        available()?;
        atomic::create_folder(path)?;
        Ok(Pictures { path: path.into(), single: false, name: name.into(), start_s: None })
    }

    /// A single picture.
    ///
    /// # Errors
    /// Where this build has no pictures.
    pub fn file(path: &Path, name: &str) -> Result<Pictures, Error> {
        available()?;
        Ok(Pictures { path: path.into(), single: true, name: name.into(), start_s: None })
    }

    /// Draws a sweep. The time is counted from the first sweep drawn.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&mut self, sweep: &SweepData, subject: &Subject) -> Result<(), Error> {
        let after_s = sweep.stamp_s - *self.start_s.get_or_insert(sweep.stamp_s);
        let (path, note) = match self.single {
            true => (self.path.clone(), String::new()),
            false => (
                self.path.join(format!("{:010}.png", sweep.frame)),
                format!("frame {}, {after_s:.2} s", sweep.frame),
            ),
        };
        let png = png(sweep, subject, &self.name, note)?;
        atomic::write(&path, |out| out.write_all(&png))
    }
}

fn available() -> Result<(), Error> {
    match cfg!(feature = "png") {
        true => Ok(()),
        false => {
            let what = "--png needs the feature `png`, which is not compiled in";
            Err(Error::Unsupported(what.into()))
        }
    }
}

#[cfg(feature = "png")]
fn draw(
    sweep: &SweepData,
    subject: &Subject,
    name: &str,
    note: String,
) -> Result<raywake_render::Canvas, Error> {
    let (panel, look) = match subject {
        Subject::Flow { columns, profile, frame } => flow::view(sweep, columns, profile, *frame),
        Subject::Map { voxels, origin_m, voxel_m } => {
            map::view(&sweep.world_from_vehicle, voxels, *origin_m, *voxel_m)
        }
        Subject::Tracks(tracks) => tracks::view(sweep, tracks),
    };
    let title = format!("{}, {name}", panel.title);
    let panel = raywake_render::Panel { title, note, vehicle: true, ..panel };
    raywake_render::birds_eye(&[panel], &look).map_err(|e| Error::Unsupported(e.to_string()))
}

#[cfg(feature = "png")]
fn png(sweep: &SweepData, subject: &Subject, name: &str, note: String) -> Result<Vec<u8>, Error> {
    Ok(draw(sweep, subject, name, note)?.png())
}

#[cfg(not(feature = "png"))]
fn png(_: &SweepData, _: &Subject, _: &str, _: String) -> Result<Vec<u8>, Error> {
    available().map(|()| Vec::new())
}
