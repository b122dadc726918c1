//! A simulated drive as a recording, with ground truth.

use raywake_sim::{Drive, Options, Truth, stamp_s};

use super::{Overview, PoseTrack, Source, SourceGaps, SweepData};
use crate::Error;

/// A drive through a street generated from a seed.
pub struct Simulated {
    overview: Overview,
    drive: Drive,
    seed: u64,
    /// Truth of the last two sweeps read: index of the sweep and truth of every return.
    truth: [(usize, Vec<Truth>); 2],
}

impl Simulated {
    /// A drive of this many sweeps, at least one.
    pub fn new(seed: u64, sweeps: usize) -> Simulated {
        let drive = Drive::new(seed, Options { sweeps: sweeps.max(1), ..Options::default() });
        let stamps_s: Vec<f64> = (0..drive.sweeps()).map(stamp_s).collect();
        let poses = stamps_s.iter().map(|t| drive.world_from_vehicle(*t)).collect();
        let overview = Overview {
            name: "simulated".into(),
            rig: drive.rig(),
            frames: (0..drive.sweeps() as u64).collect(),
            track: PoseTrack { stamps_s, poses },
            epoch_ns: 0,
            trusted: true,
            notes: Vec::new(),
        };
        let none = || (usize::MAX, Vec::new());
        Simulated { overview, drive, seed, truth: [none(), none()] }
    }

    /// The drive of `raywake demo`.
    pub fn demo() -> Simulated {
        Simulated::new(1, 20)
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
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        let (seed, length) = (self.seed, self.overview.length());
        format!("simulated street, seed {seed}: {length}, exact poses")
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        let sweep = self.drive.sweep(index);
        self.overview.begin(index, into);
        // Exact, whereas that of a track is derived from differences.
        into.twist = sweep.twist;
        into.points = sweep.points;
        into.dropped = SourceGaps::default();
        self.truth.swap(0, 1);
        self.truth[1] = (index, sweep.truth);
        Ok(())
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
