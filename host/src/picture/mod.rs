//! Pictures of what the program finds, seen from above.

#[cfg(not(feature = "png"))]
mod absent;
#[cfg(feature = "png")]
mod flow;
#[cfg(feature = "png")]
mod map;
#[cfg(feature = "png")]
mod pictures;
#[cfg(feature = "png")]
mod tracks;

#[cfg(all(test, feature = "png"))]
mod tests;

use raywake_core::output::ColumnFlow;
use raywake_core::params::Profile;
use raywake_io::sink::feather::Voxel;
use raywake_objects::front_end::Track;

use crate::args::PictureFrame;

#[cfg(not(feature = "png"))]
pub use absent::Pictures;
#[cfg(feature = "png")]
pub use pictures::Pictures;

/// What a picture shows besides the returns of its sweep.
pub enum Scene<'a> {
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
