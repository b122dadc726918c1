//! The input side: what a pair of sweeps says about the motion of columns.

use super::Observation;
use crate::params::{FOREGROUND_MAX, Profile};
use crate::perceive::Perceived;
use crate::prepare::Setup;
use crate::record::{NONE, SweepUniform, VALID, flow_displacement};
use crate::refinement::Refinement;
use crate::refinement::cues::Cues;

/// How solid columns moved: those with a match and those that a moving cluster took along.
pub(crate) struct Observations {
    /// Ascending by column.
    pub all: heapless::Vec<Observation, FOREGROUND_MAX>,
    /// Number of observed columns beyond the capacity, the last in column order: no motion is
    /// output for them.
    pub beyond_capacity: usize,
}

impl Observations {
    pub const fn new() -> Observations {
        Observations { all: heapless::Vec::new(), beyond_capacity: 0 }
    }

    /// Collects those of a pair.
    pub fn collect(
        &mut self,
        Setup { profile, moves, .. }: &Setup,
        sweep: &SweepUniform,
        perceived: &Perceived,
        refinement: &Refinement,
    ) {
        self.all.clear();
        self.beyond_capacity = 0;
        for (column, record) in perceived.columns_before.iter().enumerate() {
            if record[1] == 0 {
                continue;
            }
            let flow = perceived.flow[column];
            let moved = if profile.refinement_sweeps > 0 {
                refined(profile, sweep, refinement, column, flow)
            } else {
                whole_cells(profile, flow)
            };
            let Some((moved, covariance, cues)) = moved else { continue };
            let probability = match cues {
                Some(cues) => moves.probability(&cues),
                None => (moved != [0.0; 2]) as u8 as f32,
            };
            let cues = cues.unwrap_or(Cues::NONE);
            let column = column as u32;
            let o = Observation { column, moved, covariance, cues, probability, slot: NONE };
            self.beyond_capacity += self.all.push(o).is_err() as usize;
        }
    }
}

/// Displacement, m, its covariance, m², and, if it was refined, cues to whether it moves.
type Moved = ([f32; 2], [f32; 3], Option<Cues>);

/// What the refinement found.
fn refined(
    profile: &Profile,
    sweep: &SweepUniform,
    refinement: &Refinement,
    column: usize,
    flow: u32,
) -> Option<Moved> {
    let r = profile.voxel_m as f32;
    let found = refinement.of(sweep, column, flow);
    let observed = found.is_dynamic || flow & VALID != 0;
    observed
        .then(|| (found.by.map(|v| v * r), found.covariance.map(|v| v * r * r), Some(found.cues)))
}

/// The match itself: whole cells.
fn whole_cells(profile: &Profile, flow: u32) -> Option<Moved> {
    let r = profile.voxel_m as f32;
    let sigma_m = profile.tracklet.measurement_cells * r;
    let variance = 2.0 * sigma_m * sigma_m;
    let moved = flow_displacement(flow).map(|c| c as f32 * r);
    (flow & VALID != 0).then_some((moved, [variance, 0.0, variance], None))
}
