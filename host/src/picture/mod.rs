//! Pictures of what the program finds, seen from above.

#[cfg(feature = "png")]
mod drawing;
#[cfg(feature = "png")]
mod flow;
#[cfg(feature = "png")]
mod map;
#[cfg(feature = "png")]
mod page;
#[cfg_attr(not(feature = "png"), path = "absent.rs")]
mod pictures;
#[cfg(feature = "png")]
mod tracks;

#[cfg(all(test, feature = "png"))]
mod tests;

use std::path::PathBuf;

use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_io::sink::feather::Voxel;
use raywake_objects::tracked::TrackedObject;

use crate::args::{PictureFrame, Views};

pub use pictures::{Pictures, write_one};

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
    /// The objects in the sweep.
    Objects {
        /// What they are.
        objects: &'a [TrackedObject],
        /// The way of each so far, in the world, m.
        ways: &'a [Vec<[f64; 3]>],
    },
}

/// Where the pictures of a recording go.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PictureFiles {
    /// Folder for one of each sweep, FRAME.png.
    pub folder: Option<PathBuf>,
    /// File of an animated PNG.
    pub film: Option<PathBuf>,
    /// File of an HTML page.
    pub page: Option<PathBuf>,
}

impl PictureFiles {
    /// What the command line asks for, and a folder for single pictures where there is one.
    pub fn of(views: &Views, folder: Option<PathBuf>) -> PictureFiles {
        PictureFiles { folder, film: views.film.clone(), page: views.page.clone() }
    }

    /// Whether nothing is asked for.
    pub fn is_empty(&self) -> bool {
        *self == PictureFiles::default()
    }
}

/// What the charts of a page show of every sweep: a name and the sweep's number.
pub type SweepFigures = [(&'static str, f64); 2];
