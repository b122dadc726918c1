//! The sweeps that the refinement remembers.

use super::cloud::{Cloud, DetailedCloud, Scratch};
use super::cloud_detail::CloudDetail;
use super::motion::TARGETS_MAX;
use super::scaled::Scaled;
use super::scans::Target;
use super::sweep_returns::SweepReturns;
use crate::params::REFINEMENT_SWEEPS_MAX;
use crate::team::Team;

pub type Targets<'a> = heapless::Vec<Target<'a>, TARGETS_MAX>;

/// Number of sweeps that detail is kept for: those of a pair.
const DETAILS: usize = 2;
/// Number of sweeps after which the slots of both a cloud and its detail repeat.
const CYCLE: usize = REFINEMENT_SWEEPS_MAX * DETAILS;

/// The last sweeps.
pub struct CloudRing {
    clouds: [Cloud; REFINEMENT_SWEEPS_MAX],
    details: [CloudDetail; DETAILS],
    /// Sweeps held in `clouds`.
    held: usize,
    /// The newest sweep's number in its cycle: modulo the length of either array it is its slot.
    newest: usize,
}

impl CloudRing {
    pub const fn new() -> CloudRing {
        CloudRing {
            clouds: [const { Cloud::new() }; REFINEMENT_SWEEPS_MAX],
            details: [const { CloudDetail::new() }; DETAILS],
            held: 0,
            newest: 0,
        }
    }

    pub fn clear(&mut self) {
        self.held = 0;
    }

    /// Inserts a sweep in place of the oldest: see [`Cloud::fill`].
    pub fn insert(
        &mut self,
        team: &impl Team,
        scaled: &Scaled,
        returns: SweepReturns,
        apart: &mut [bool],
        scratch: &mut Scratch,
    ) -> usize {
        self.newest = (self.newest + 1) % CYCLE;
        self.held = (self.held + 1).min(returns.profile.refinement_sweeps as usize);
        let cloud = &mut self.clouds[self.newest % REFINEMENT_SWEEPS_MAX];
        let detail = &mut self.details[self.newest % DETAILS];
        cloud.fill(detail, team, scaled, returns, apart, scratch)
    }

    /// The cloud `age` sweeps before the newest; the detail is only its own for sweeps of the pair.
    fn of_age(&self, age: usize) -> DetailedCloud<'_> {
        let number = self.newest + CYCLE - age;
        let cloud = &self.clouds[number % REFINEMENT_SWEEPS_MAX];
        DetailedCloud { cloud, detail: &self.details[number % DETAILS] }
    }

    /// The first sweep of the newest pair.
    pub fn first(&self) -> DetailedCloud<'_> {
        self.of_age(1)
    }

    /// The second sweep of the newest pair.
    pub fn second(&self) -> DetailedCloud<'_> {
        self.of_age(0)
    }

    /// Time from the stamp of the newest pair's first sweep to that of its second, s; `None` if
    /// there is no pair.
    pub fn span_s(&self) -> Option<f64> {
        (self.held >= 2).then(|| self.second().stamp_s - self.first().stamp_s)
    }

    /// What clusters of the first sweep are compared with: the pair's second sweep and, if the ring
    /// reaches that far back, the last sweep before the pair and the oldest.
    pub fn targets(&self, span_s: f64) -> Targets<'_> {
        let first = self.first();
        let ages = [0, 2, self.held.saturating_sub(1)];
        let known = ages.len().min(self.held.saturating_sub(1));
        ages[..known]
            .iter()
            .map(|age| self.of_age(*age).cloud)
            .enumerate()
            .map(|(index, cloud)| Target {
                index,
                cloud,
                offset: core::array::from_fn(|a| (first.corner[a] - cloud.corner[a]) as f32),
                share: ((cloud.stamp_s - first.stamp_s) / span_s) as f32,
            })
            .collect()
    }
}
