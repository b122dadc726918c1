//! A recording without history: every pair of sweeps on its own.

use raywake_io::Error;
use raywake_io::source::{Overview, PoseTrack, Source, SweepData};

/// The sweeps of a recording in the order 0, 1, 1, 2, 2, 3: no time passes at a repeat, so the
/// pipeline discards all its history there.
pub struct PairByPair<'a> {
    source: &'a mut dyn Source,
    overview: Overview,
}

impl<'a> PairByPair<'a> {
    /// Pairs of at most the first `sweeps` sweeps.
    pub fn of(source: &'a mut dyn Source, sweeps: usize) -> PairByPair<'a> {
        let pairs = sweeps.min(source.len()).saturating_sub(1);
        let indices = || (0..(2 * pairs).max(1)).map(Self::sweep);
        let overview = Overview {
            name: source.name().into(),
            rig: source.rig().clone(),
            frames: indices().map(|n| source.frame(n)).collect(),
            track: PoseTrack {
                stamps_s: indices().map(|n| source.stamp_s(n)).collect(),
                poses: indices().map(|n| source.pose(n)).collect(),
            },
            epoch_ns: source.overview().epoch_ns,
            // Every other step has zero length.
            trusted: true,
            notes: source.notes().to_vec(),
        };
        PairByPair { source, overview }
    }

    /// Index in the recording of the sweep delivered as number `index`.
    pub fn sweep(index: usize) -> usize {
        index.div_ceil(2)
    }
}

impl Source for PairByPair<'_> {
    fn overview(&self) -> &Overview {
        &self.overview
    }

    fn describe(&self) -> String {
        self.source.describe()
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.source.read(Self::sweep(index), into)
    }
}
