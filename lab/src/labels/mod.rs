//! Labelled objects of a recorded or simulated drive: boxes over time, from any of the file
//! formats.

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
pub(crate) mod tests;

pub use footprint::Footprint;
pub use kind::kind;
pub use open::{find, open};
pub use raywake_io::Error;
pub(crate) use sweeps::turn;
pub use trajectory::{Motion, Trajectory, trajectories};

use glam::DVec3;
use raywake_core::pose::Pose;
use std::collections::BTreeMap;

/// Kinds of objects shared by the data sets; their own names are kept in [`Track::class`].
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
    /// All of them, in order.
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
    /// Unique in the drive, as given in the file.
    pub id: String,
    /// Class as named in the file.
    pub class: String,
    /// The class in common terms.
    pub kind: Kind,
    /// Length, width and height of the box, m.
    pub size: [f64; 3],
    /// Where it is, by frame (as counted by [`raywake_io::source::Source::frame`]):
    /// `vehicle_from_box`, the box's frame centred in it, x forward, y left, z up.
    pub boxes: BTreeMap<u64, Pose>,
}

/// Where objects are labelled; outside nothing is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// All round.
    All,
    /// In the view of a forward-looking camera (KITTI).
    Camera,
    /// Nowhere: the drive has no boxes.
    Nowhere,
}

/// Half of the camera's view in which KITTI's labels are reliably complete, degrees; at its border
/// boxes are cut off.
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
    /// Whether they come from a simulator, without noise: smoothing gains nothing.
    pub exact: bool,
    /// What was left out, and why: one readable line each.
    pub notes: Vec<String>,
}

impl Labels {
    /// The labels of a drive without boxes.
    pub fn none() -> Labels {
        Labels { tracks: Vec::new(), view: View::Nowhere, exact: false, notes: Vec::new() }
    }
}
