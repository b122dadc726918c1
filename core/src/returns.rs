//! The returns of the last two sweeps: where each of them is.

use crate::dropped::DroppedReturns;
use crate::params::POINTS_MAX;
use crate::prepare::{Placement, RayBuffers, Setup, uniform_of};
use crate::record::{NONE, Ray, SweepUniform};
use crate::refinement::{Refinement, SweepReturns};
use crate::sensor_paths::SensorPaths;
use crate::sweep::Placed;
use crate::team::Team;
use crate::thinning::TakenPoints;

/// Where the returns of the last two sweeps are.
pub(crate) struct Returns {
    /// Which of the two belongs to this sweep and not to the previous one. Swapping them would copy
    /// both, by way of more than a megabyte of stack.
    now: usize,
    /// Column of every return, for two sweeps.
    column: [[u32; POINTS_MAX]; 2],
    /// Whether a return belongs to none of the clusters that its column is part of.
    is_apart: [[bool; POINTS_MAX]; 2],
    placed: [Placed; POINTS_MAX],
}

/// What the stages need of a sweep besides its rays.
pub(crate) struct PreparedSweep {
    pub uniform: SweepUniform,
    pub dropped: DroppedReturns,
}

impl Returns {
    /// No sweep yet.
    pub const fn new() -> Returns {
        Returns {
            now: 0,
            column: [[0; POINTS_MAX]; 2],
            is_apart: [[false; POINTS_MAX]; 2],
            placed: [const { Placed { at: [0.0; 3], offset_s: 0.0 } }; POINTS_MAX],
        }
    }

    /// Turns a new sweep into rays. The window is shifted by this many cells.
    pub fn send(
        &mut self,
        setup: &Setup,
        team: &impl Team,
        placement: &Placement,
        [shift_x, shift_y, shift_z]: [i32; 3],
        (rays, origins): (&mut [Ray], &mut [[i32; 4]]),
    ) -> PreparedSweep {
        let profile = &setup.profile;
        self.now = 1 - self.now;
        let (columns, placed) = (&mut self.column[self.now], &mut self.placed);
        let buffers = RayBuffers { rays, origins, columns, placed };
        let (count, dropped) = setup.preparation.prepare(team, placement, buffers);
        let uniform = SweepUniform {
            shift_x,
            shift_y,
            shift_z,
            unfiltered: setup.unfiltered as i32,
            smoothing: profile.smoothing as i32,
            displacement_cost: profile.displacement_cost as i32,
            outside_cost: profile.outside_cost as i32,
            score_min: setup.scores.min,
            ..uniform_of(profile, count)
        };
        PreparedSweep { uniform, dropped }
    }

    /// Passes the prepared sweep on to the refinement. Returns the number of returns for which
    /// this had no room, and which it ignores.
    pub fn insert(
        &mut self,
        refinement: &mut Refinement,
        team: &impl Team,
        placement: &Placement,
    ) -> usize {
        let Placement { profile, window, sweep, .. } = *placement;
        if profile.refinement_sweeps == 0 {
            return 0;
        }
        let points = TakenPoints::new(sweep.points, profile.returns());
        let taken = points.count();
        let side = profile.side as f32;
        let inside = |v: f32| v >= 0.0 && v < side;
        let columns = &mut self.column[self.now][..taken];
        // Clusters on slopes extend beyond the window's levels: their returns still belong to its
        // columns.
        for (column, Placed { at: [x, y, _], .. }) in columns.iter_mut().zip(&self.placed) {
            if *column == NONE && inside(*x) && inside(*y) {
                *column = *x as u32 * profile.side + *y as u32;
            }
        }
        let returns = SweepReturns {
            profile,
            corner: window.corner,
            stamp_s: sweep.stamp_s,
            points,
            placed: &self.placed[..taken],
            columns,
            sensors: &SensorPaths::new(placement),
        };
        refinement.insert_cloud(team, returns, &mut self.is_apart[self.now][..taken])
    }

    /// Columns of the returns taken from the previous sweep, from the `from`-th on, and whether
    /// they are apart.
    pub fn before(&self, from: usize) -> impl Iterator<Item = (u32, bool)> + '_ {
        let (column, is_apart) = (&self.column[1 - self.now], &self.is_apart[1 - self.now]);
        column[from..].iter().copied().zip(is_apart[from..].iter().copied())
    }
}
