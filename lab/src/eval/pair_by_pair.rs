//! A recording without history: every pair of sweeps on its own.

use raywake_core::pose::Pose;
use raywake_core::sweep::Rig;
use raywake_io::Error;
use raywake_io::source::{Source, SweepData};

/// The sweeps of a recording in the order 0, 1, 1, 2, 2, 3: where one comes again no time passes,
/// at which the pipeline drops all that it knows.
pub struct PairByPair<'a> {
    source: &'a mut dyn Source,
    pairs: usize,
}

impl<'a> PairByPair<'a> {
    /// Of the first `sweeps` sweeps at most.
    pub fn of(source: &'a mut dyn Source, sweeps: usize) -> PairByPair<'a> {
        let pairs = sweeps.min(source.len()).saturating_sub(1);
        PairByPair { source, pairs }
    }

    /// Index in the recording of the sweep that comes as number `index`.
    pub fn sweep(index: usize) -> usize {
        index.div_ceil(2)
    }
}

impl Source for PairByPair<'_> {
    fn name(&self) -> &str {
        self.source.name()
    }

    fn rig(&self) -> &Rig {
        self.source.rig()
    }

    fn len(&self) -> usize {
        (2 * self.pairs).max(1)
    }

    fn describe(&self) -> String {
        self.source.describe()
    }

    fn frame(&self, index: usize) -> u64 {
        self.source.frame(Self::sweep(index))
    }

    fn stamp_s(&self, index: usize) -> f64 {
        self.source.stamp_s(Self::sweep(index))
    }

    fn pose(&self, index: usize) -> Pose {
        self.source.pose(Self::sweep(index))
    }

    fn read(&mut self, index: usize, into: &mut SweepData) -> Result<(), Error> {
        self.source.read(Self::sweep(index), into)
    }

    fn notes(&self) -> &[String] {
        self.source.notes()
    }
}
