//! Pictures of the results, seen from above.

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
        /// The sweep's columns.
        columns: &'a [ColumnFlow],
        /// Determines the window.
        profile: &'a Profile,
        /// Which velocity is drawn.
        frame: PictureFrame,
    },
    /// The sweep's sparse map, instead of its returns.
    Map {
        /// The map's voxels, those of a column next to each other.
        voxels: &'a [Voxel],
        /// Corner of the voxel (0, 0, 0) in the world, m.
        origin_m: [f64; 3],
        /// Size of a voxel, m.
        voxel_m: f64,
    },
    /// The objects in the sweep.
    Objects {
        /// The objects.
        objects: &'a [TrackedObject],
        /// The path of each so far, in the world, m.
        paths: &'a [Vec<[f64; 3]>],
    },
}

/// Where the pictures of a recording go.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PictureFiles {
    /// Folder for one picture per sweep, FRAME.png.
    pub folder: Option<PathBuf>,
    /// File of an animated PNG.
    pub film: Option<PathBuf>,
    /// File of an HTML page.
    pub page: Option<PathBuf>,
}

impl PictureFiles {
    /// The files the command line asks for, with a folder for single pictures, if any.
    pub fn of(views: &Views, folder: Option<PathBuf>) -> PictureFiles {
        PictureFiles { folder, film: views.film.clone(), page: views.page.clone() }
    }

    /// Whether nothing is asked for.
    pub fn is_empty(&self) -> bool {
        *self == PictureFiles::default()
    }
}

/// What the charts of a page show for every sweep: names and values.
pub type SweepFigures = [(&'static str, f64); 2];
