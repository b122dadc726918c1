//! Labelled objects of a recorded or simulated drive: boxes over time, whatever file they are from.

mod boxes_csv;
mod feather;
mod footprint;
mod gather;
mod kind;
mod kitti_tracking;
mod open;
pub mod semantic_kitti;
mod smooth;
mod sweeps;
mod tracklets;
pub mod trajectory;

#[cfg(test)]
mod tests;

pub use footprint::Footprint;
pub use kind::kind;
pub use open::{find, open};
pub use raywake_io::Error;
pub(crate) use sweeps::turn;
pub use trajectory::{Motion, Trajectory, trajectories};

use glam::DVec3;
use raywake_core::pose::Pose;
use std::collections::BTreeMap;

/// Kinds of objects that the data sets share; their own names stay in [`Track::class`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Passenger cars.
    Car,
    /// Vans and small delivery vehicles.
    Van,
    /// Lorries.
    Truck,
    /// Buses.
    Bus,
    /// Trams and trains.
    Tram,
    /// Motorcycles, with or without a rider.
    Motorcycle,
    /// Bicycles with a rider.
    Cyclist,
    /// People on foot, standing or sitting.
    Pedestrian,
    /// Whatever else is labelled.
    Other,
}

impl Kind {
    /// All of them, in their order.
    pub const ALL: [Kind; 9] = [
        Kind::Car,
        Kind::Van,
        Kind::Truck,
        Kind::Bus,
        Kind::Tram,
        Kind::Motorcycle,
        Kind::Cyclist,
        Kind::Pedestrian,
        Kind::Other,
    ];
}

/// One labelled object.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Unlike any other's in the drive, as the file has it.
    pub id: String,
    /// Class as the file names it.
    pub class: String,
    /// The same in common terms.
    pub kind: Kind,
    /// Length, width and height of the box, m.
    pub size: [f64; 3],
    /// Where it is, by frame (as [`raywake_io::source::Source::frame`] counts): `vehicle_from_box`,
    /// the box's frame lying in its centre, x forward, y left, z up.
    pub boxes: BTreeMap<u64, Pose>,
}

/// Where objects are labelled; outside nothing is known of what is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// All around.
    All,
    /// In the view of a camera that looks forward (KITTI).
    Camera,
    /// Nowhere: the drive has no boxes.
    Nowhere,
}

/// Half of the camera's view in which KITTI has labels for certain, degrees; at its border boxes
/// are cut off.
pub const CAMERA_DEG: f64 = 40.0;

impl View {
    /// Whether labels are complete at a point of the vehicle frame.
    pub fn holds(self, at: DVec3) -> bool {
        match self {
            View::All => true,
            View::Camera => at.x > 0.0 && at.y.atan2(at.x).abs().to_degrees() <= CAMERA_DEG,
            View::Nowhere => false,
        }
    }
}

/// All labels of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    /// In the order of the file.
    pub tracks: Vec<Track>,
    /// Where they are complete.
    pub view: View,
    /// Whether they are a simulator's, without noise: nothing is gained by smoothing them.
    pub exact: bool,
    /// What was left out, and why: one line each for people.
    pub notes: Vec<String>,
}

impl Labels {
    /// Of a drive without boxes.
    pub fn none() -> Labels {
        Labels { tracks: Vec::new(), view: View::Nowhere, exact: false, notes: Vec::new() }
    }
}
