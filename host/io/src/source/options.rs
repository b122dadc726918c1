//! What the user says about a recording instead of what its folder tells.

use std::path::{Path, PathBuf};

use raywake_core::sweep::Rig;

use super::Format;
use super::bin::BinFields;
use crate::Error;

/// Frame whose motion a file of poses tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PosesFrame {
    /// The left camera of KITTI; `calib.txt` tells where it sits.
    Camera,
    /// The frame of the clouds.
    Vehicle,
}

/// Whether a recording may be opened without poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unlocated {
    /// It fails to open.
    #[default]
    Refuse,
    /// Where it has none.
    Accept,
    /// Those that it has are left out.
    Always,
}

/// What the user says about a recording instead of what its folder tells.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Kind of recording.
    pub format: Option<Format>,
    /// Topics whose clouds are the sweeps, for [`Format::Mcap`]; where there are none, the only one
    /// or those of all lidars. For [`Format::Pcap`] a sensor, as `ADDRESS:PORT`; for
    /// [`Format::NuScenes`] and [`Format::Waymo`] a scene or segment.
    pub topics: Vec<String>,
    /// File of poses: 3x4 numbers or a `.npy` of 4x4, one row per sweep of the first, or of TUM.
    pub poses: Option<PathBuf>,
    /// Whether poses are needed at all.
    pub unlocated: Unlocated,
    /// See [`super::Overview::trusted`].
    pub trusted: bool,
    /// Frame of the poses; the camera for [`Format::KittiOdometry`], otherwise the vehicle.
    pub poses_frame: Option<PosesFrame>,
    /// Where lidars sit, for [`Format::Mcap`].
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
    /// Leaves the poses of a recording unknown, in which this was found instead, or fails where
    /// they are needed.
    pub(super) fn go_without_poses(&self, root: &Path, found: &str) -> Result<(), Error> {
        match self.unlocated {
            Unlocated::Refuse => {
                let what = format!("{found}: poses are needed, give a file with --poses");
                Err(Error::input(root, "", what))
            }
            Unlocated::Accept | Unlocated::Always => Ok(()),
        }
    }
}

/// What the user's options change in a rig.
pub(super) fn apply(options: &OpenOptions, rig: &mut Rig) {
    rig.distorted = options.deskew.unwrap_or(rig.distorted);
    rig.ground_m = options.ground_m.unwrap_or(rig.ground_m);
    rig.own_vehicle = options.own_vehicle.or(rig.own_vehicle);
}
