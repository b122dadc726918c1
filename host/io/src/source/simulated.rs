//! A simulated drive as a recording, with its truth.

use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_sim::{Drive, Options, Truth, stamp_s};

use super::{Source, SourceGaps, SweepData};
use crate::Error;

/// A drive through a street that a seed draws.
pub struct Simulated {
    drive: Drive,
    rig: Rig,
    seed: u64,
    notes: Vec<String>,
    /// Truth of the last two sweeps read: index and truth of every return.
    truth: [(usize, Vec<Truth>); 2],
}

impl Simulated {
    /// A drive of some sweeps, at least one.
    pub fn new(seed: u64, sweeps: usize) -> Simulated {
        let drive = Drive::new(seed, Options { sweeps: sweeps.max(1), ..Options::default() });
        let rig = drive.rig();
        let none = || (usize::MAX, Vec::new());
        Simulated { drive, rig, seed, notes: Vec::new(), truth: [none(), none()] }
    }

    /// The simulator.
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Truth of the returns of sweep `index`, in their order; empty unless it is one of the last
    /// two read.
    pub fn truth(&self, index: usize) -> &[Truth] {
        self.truth.iter().find(|t| t.0 == index).map_or(&[], |t| &t.1)
    }
}

impl Source for Simulated {
    fn name(&self) -> &str {
        "simulated"
    }

    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn len(&self) -> usize {
        self.drive.sweeps()
    }

    fn describe(&self) -> String {
        let (sweeps, span_s) = (self.len(), stamp_s(self.len() - 1));
        format!("simulated street, seed {}: {sweeps} sweeps, {span_s:.1} s, exact poses", self.seed)
    }

    fn frame(&self, index: usize) -> u64 {
        index as u64
    }

    fn stamp_s(&self, index: usize) -> f64 {
        stamp_s(index)
    }

    fn pose(&self, index: usize) -> Pose {
        self.drive.world_from_vehicle(self.stamp_s(index))
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        let sweep = self.drive.sweep(index);
        *into = SweepData {
            frame: index as u64,
            stamp_s: sweep.stamp_s,
            points: sweep.points,
            world_from_vehicle: sweep.world_from_vehicle,
            twist: sweep.twist,
            dropped: SourceGaps::default(),
        };
        self.truth.swap(0, 1);
        self.truth[1] = (index, sweep.truth);
        Ok(())
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_with_truth() {
        let mut source = Simulated::new(1, 3);
        let mut sweep = SweepData::default();
        for index in 0..3 {
            source.read(index, &mut sweep).unwrap();
            assert!(sweep.points.len() > 1000);
            assert_eq!(source.truth(index).len(), sweep.points.len());
        }
        assert!(!source.truth(1).is_empty() && source.truth(0).is_empty());
        assert_eq!((source.len(), source.frame(2), sweep.frame), (3, 2, 2));
        assert_eq!(sweep.stamp_s, 0.2);
        assert_eq!((source.stamp_s(2), source.pose(2)), (0.2, sweep.world_from_vehicle));
    }
}
