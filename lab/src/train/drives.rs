//! Drives to learn from, simulated or recorded, behind one interface.

use crate::labels::Kind;
use glam::DVec3;
use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_io::Error;
use raywake_io::source::SweepData;

/// A labelled object as seen in a sweep.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The same for the same object in every sweep of the drive.
    pub id: usize,
    pub kind: Kind,
    /// Pose of its box: origin at the centre, x forward, y left, z up.
    pub vehicle_from_box: Pose,
    /// Length, width and height, m.
    pub size: [f64; 3],
}

#[derive(Default)]
pub struct LabelledSweep {
    /// Returns, pose and times.
    pub data: SweepData,
    pub objects: Vec<Seen>,
    /// What every return comes from: an index into `objects`, or [`raywake_core::record::NONE`] for
    /// the background. Empty if only boxes are known.
    pub object_of_point: Vec<u32>,
    /// Class of what every return comes from. Empty if only boxes are known.
    pub class_of_point: Vec<raywake_sim::Class>,
}

impl LabelledSweep {
    pub fn world_from_box(&self, seen: &Seen) -> Pose {
        self.data.world_from_vehicle * seen.vehicle_from_box
    }
}

pub trait Labelled {
    /// Sensors, timing and frame of the vehicle.
    fn rig(&self) -> &Rig;

    fn len(&self) -> usize;

    /// Reads a sweep, replacing what `into` held.
    fn read(&mut self, index: usize, into: &mut LabelledSweep) -> Result<(), Error>;

    /// Whether objects are labelled at a place in the vehicle frame.
    fn sees(&self, at: DVec3) -> bool;
}
