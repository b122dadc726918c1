//! What the user specifies about a recording in place of what its folder contains.

use std::path::{Path, PathBuf};

use raywake_core::sweep::Rig;

use super::Format;
use super::bin::BinFields;
use crate::Error;

/// Frame whose motion a pose file describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PosesFrame {
    /// KITTI's left camera; `calib.txt` gives its mounting pose.
    Camera,
    /// The frame of the clouds.
    Vehicle,
}

/// Whether a recording may be opened without poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unlocated {
    /// Fails to open.
    #[default]
    Refuse,
    /// Accepted if it has none.
    Accept,
    /// Any that it has are ignored.
    Always,
}

/// What the user specifies about a recording in place of what its folder contains.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Kind of recording.
    pub format: Option<Format>,
    /// Topics whose clouds are the sweeps, for [`Format::Mcap`]; if empty, the only one or those of
    /// all lidars. For [`Format::Pcap`] a sensor, as `ADDRESS:PORT`; for [`Format::NuScenes`] and
    /// [`Format::Waymo`] a scene or segment.
    pub topics: Vec<String>,
    /// File of poses: 3x4 numbers or a `.npy` of 4x4, one row per sweep from the first on, or TUM's
    /// format.
    pub poses: Option<PathBuf>,
    /// Whether poses are needed at all.
    pub unlocated: Unlocated,
    /// See [`super::Overview::trusted`].
    pub trusted: bool,
    /// Frame of the poses; the camera for [`Format::KittiOdometry`], otherwise the vehicle.
    pub poses_frame: Option<PosesFrame>,
    /// Mounting poses of lidars, for [`Format::Mcap`].
    pub extrinsics: Option<PathBuf>,
    /// What the numbers of a return are, for `.bin` and `.npy` files.
    pub bin_fields: Option<BinFields>,
    /// Overrides [`Rig::distorted`].
    pub deskew: Option<bool>,
    /// Overrides [`Rig::ground_m`], m.
    pub ground_m: Option<f64>,
    /// Overrides [`Rig::own_vehicle`].
    pub own_vehicle: Option<[[f32; 2]; 2]>,
}

impl OpenOptions {
    /// Leaves the poses of a recording unknown, or fails if they are needed; `found` says what was
    /// found instead.
    pub(super) fn proceed_without_poses(&self, root: &Path, found: &str) -> Result<(), Error> {
        match self.unlocated {
            Unlocated::Refuse => {
                let what = format!("{found}: poses are needed, give a file with --poses");
                Err(Error::input(root, "", what))
            }
            Unlocated::Accept | Unlocated::Always => Ok(()),
        }
    }
}

/// Applies the user's options to a rig.
pub(super) fn apply(options: &OpenOptions, rig: &mut Rig) {
    rig.distorted = options.deskew.unwrap_or(rig.distorted);
    rig.ground_m = options.ground_m.unwrap_or(rig.ground_m);
    rig.own_vehicle = options.own_vehicle.or(rig.own_vehicle);
}
