//! What the refinement receives of a sweep.

use crate::params::Profile;
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use crate::thinning::TakenPoints;

/// The returns of a sweep.
#[derive(Clone, Copy)]
pub struct SweepReturns<'a> {
    /// The profile it was placed with.
    pub profile: &'a Profile,
    /// Lattice index of the window's first voxel.
    pub corner: [i32; 3],
    /// Time of the sweep, s.
    pub stamp_s: f64,
    pub points: TakenPoints<'a>,
    /// Their places in the window, voxels.
    pub placed: &'a [Placed],
    /// Their columns, or [`NONE`](crate::record::NONE).
    pub columns: &'a [u32],
    pub sensors: &'a SensorPaths,
}
