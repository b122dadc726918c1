//! The sweeps that the refinement remembers.

use super::cloud::{Cloud, CloudDetail, DetailedCloud, Scratch, SweepReturns};
use super::motion::TARGETS_MAX;
use super::scans::Target;
use crate::params::{Profile, REFINEMENT_SWEEPS_MAX};
use raywake_simd::Simd;

pub type Targets<'a> = heapless::Vec<Target<'a>, TARGETS_MAX>;

/// The last sweeps.
pub struct CloudRing {
    clouds: [Cloud; REFINEMENT_SWEEPS_MAX],
    /// Of the newest and of the one before, in turn.
    details: [CloudDetail; 2],
    /// Sweeps held in `clouds`.
    held: usize,
    /// Where the newest is.
    newest: usize,
    /// Where its detail is.
    newest_detail: usize,
}

impl CloudRing {
    pub const fn new() -> CloudRing {
        CloudRing {
            clouds: [const { Cloud::new() }; REFINEMENT_SWEEPS_MAX],
            details: [const { CloudDetail::new() }; 2],
            held: 0,
            newest: 0,
            newest_detail: 0,
        }
    }

    pub fn clear(&mut self) {
        self.held = 0;
    }

    /// Inserts a sweep instead of the oldest: see [`Cloud::fill`].
    pub fn insert(
        &mut self,
        profile: &Profile,
        simd: Simd,
        returns: SweepReturns,
        apart: &mut [bool],
        scratch: &mut Scratch,
    ) -> usize {
        self.newest = (self.newest + 1) % REFINEMENT_SWEEPS_MAX;
        self.newest_detail = 1 - self.newest_detail;
        self.held = (self.held + 1).min(profile.refinement_sweeps as usize);
        let cloud = &mut self.clouds[self.newest];
        cloud.simd = simd;
        cloud.fill(&mut self.details[self.newest_detail], profile, returns, apart, scratch)
    }

    /// The cloud `age` sweeps before the newest.
    fn of_age(&self, age: usize) -> &Cloud {
        &self.clouds[(self.newest + REFINEMENT_SWEEPS_MAX - age) % REFINEMENT_SWEEPS_MAX]
    }

    /// The first sweep of the newest pair.
    pub fn first(&self) -> DetailedCloud<'_> {
        DetailedCloud { cloud: self.of_age(1), detail: &self.details[1 - self.newest_detail] }
    }

    /// The second sweep of the newest pair.
    pub fn second(&self) -> DetailedCloud<'_> {
        DetailedCloud { cloud: self.of_age(0), detail: &self.details[self.newest_detail] }
    }

    /// From the stamp of the newest pair's first sweep to that of its second, s; nothing where
    /// there is no pair.
    pub fn span_s(&self) -> Option<f64> {
        (self.held >= 2).then(|| self.second().stamp_s - self.first().stamp_s)
    }

    /// What clusters of the first sweep are compared with: the second, and every other sweep before
    /// the first.
    pub fn targets(&self, span_s: f64) -> Targets<'_> {
        let first = self.first();
        let ages = (0..self.held).step_by(2).map(|age| self.of_age(age));
        ages.enumerate()
            .map(|(index, cloud)| Target {
                index,
                cloud,
                offset: core::array::from_fn(|a| (first.corner[a] - cloud.corner[a]) as f32),
                share: ((cloud.stamp_s - first.stamp_s) / span_s) as f32,
            })
            .collect()
    }
}
