//! Figure 3.1, one sweep at a time.
//!
//! ```text
//! sweep -> rays -> perceive -> refine -> track -> out -> velocities of columns and returns
//! ```
//! Rays, refinement, tracklets and output use f32 on the CPU; perception uses integers and bits, on
//! the CPU or on a device, with the same result.

use crate::encoder::Encoder;
use crate::frame::{Sides, SweepPair};
use crate::output::{Output, SweepOutput, TrackletState};
use crate::params::Profile;
use crate::perceive::{Perceive, Perceived, StageTimer, StepContext};
use crate::prepare::{Placement, Setup};
use crate::record::SweepUniform;
use crate::refinement::Refinement;
use crate::returns::Returns;
use crate::sweep::{Point, Sweep};
use crate::team::Team;
use crate::tracklet::{TrackletTurnover, Tracklets, observe::Observations, state::state_of};
use crate::velocities::{FlowOfColumn, Found};

/// The state between sweeps. Plain and large (see `memory-layout.md`): keep it in a static or a
/// box.
pub struct Pipeline {
    sides: Sides,
    returns: Returns,
    refinement: Refinement,
    tracklets: Tracklets,
    observations: Observations,
    flow_of_column: FlowOfColumn,
    /// Classifies columns; off until it has weights.
    pub encoder: Encoder,
}

impl Default for Pipeline {
    fn default() -> Pipeline {
        Pipeline::new()
    }
}

impl Pipeline {
    /// The state before the first sweep.
    pub const fn new() -> Pipeline {
        Pipeline {
            sides: Sides::new(),
            returns: Returns::new(),
            refinement: Refinement::new(),
            tracklets: Tracklets::new(),
            observations: Observations::new(),
            flow_of_column: FlowOfColumn::new(),
            encoder: Encoder::new(),
        }
    }

    /// Processes one sweep. `before` holds the points of the previous sweep, whose flow is
    /// returned; `out` must have room for a record of each of them and of every column.
    ///
    /// # Panics
    /// If this sweep continues the previous one and `before` has a different number of points than
    /// that had. Also if an invariant does not hold, which is a bug.
    pub fn step<'o, P: Perceive>(
        &mut self,
        setup: &Setup,
        context: StepContext<P, impl Team, impl StageTimer + Send>,
        sweep: &Sweep,
        before: &'o [Point],
        out: Output<'o>,
    ) -> Result<SweepOutput<'o>, P::Error> {
        let StepContext { backend, team, timer } = context;
        let profile = &setup.profile;
        let sweep = &Sweep { twist: sweep.twist.to_grain(), ..*sweep };
        let arrival = self.sides.advance(profile, &setup.rig, sweep);
        if arrival.reset.is_some() {
            self.tracklets.clear();
            self.refinement.clear();
            self.encoder.clear();
        }
        let placement = Placement { profile, rig: &setup.rig, window: &arrival.window, sweep };
        let sent = self.returns.send(setup, team, &placement, arrival.shift, backend.input()?);
        timer.lap("rays");

        let (mut unrefined, corner) = (0, arrival.window.corner);
        let Pipeline { returns, refinement, encoder, .. } = self;
        let meanwhile = || {
            let insert = || unrefined = returns.insert(refinement, team, &placement);
            team.join(insert, || encoder.encode(team));
        };
        let perceived = backend.perceive(&sent.uniform, team, timer, meanwhile)?;

        let mut flows = None;
        if let Some(pair) = self.sides.pair(profile) {
            let left = self.refine(team, &pair, &sent.uniform, &perceived);
            timer.lap("refine");
            let turnover = self.track(setup, &pair, &sent.uniform, &perceived, left);
            timer.lap("track");
            let found = Found {
                pair: &pair,
                setup,
                sweep: &sent.uniform,
                perceived: &perceived,
                observations: &self.observations,
                tracklets: &self.tracklets,
                refinement: &self.refinement,
                returns: &self.returns,
                scores: self.encoder.scores(),
            };
            flows =
                Some(found.write_velocities(team, before, turnover, &mut self.flow_of_column, out));
            timer.lap("out");
        }
        self.encoder.keep(perceived.columns_now, profile.side as usize, [corner[0], corner[1]]);
        Ok(SweepOutput {
            flows,
            dropped: sent.dropped,
            reset: arrival.reset,
            unrefined,
            foreground: perceived.foreground.len(),
            rays: perceived.rays,
        })
    }

    /// Moves the tracklets into the new window, then refines displacements below the cell's size,
    /// with the tracklets' velocities as priors. Returns the number of tracklets that left the
    /// window.
    fn refine(
        &mut self,
        team: &impl Team,
        pair: &SweepPair,
        sweep: &SweepUniform,
        perceived: &Perceived,
    ) -> u32 {
        let left = self.tracklets.place(sweep);
        let [dt_s, voxel_m] = [pair.dt_s, pair.profile.voxel_m].map(|v| v as f32);
        let predicted = |column| self.tracklets.predict(column, dt_s, voxel_m);
        self.refinement.run(team, sweep, perceived.flow, self.encoder.scores(), predicted);
        left
    }

    /// Updates the tracklets with the displacements of columns.
    fn track(
        &mut self,
        setup: &Setup,
        pair: &SweepPair,
        sweep: &SweepUniform,
        perceived: &Perceived,
        left: u32,
    ) -> TrackletTurnover {
        let (profile, observed) = (pair.profile, &mut self.observations);
        observed.collect(setup, sweep, perceived, &self.refinement);
        let (dt, turned) = (pair.dt_s as f32, pair.turned_rad);
        self.tracklets.update(profile, sweep, dt, turned, left, &mut observed.all)
    }

    /// Number of tracklets after the last step.
    pub fn tracklet_count(&self) -> usize {
        self.sides.current.map_or(0, |_| self.tracklets.all().len())
    }

    /// The tracklets after the last step, at the time of its sweep.
    pub fn tracklets(&self, profile: &Profile) -> impl Iterator<Item = TrackletState> + Clone {
        let current = self.sides.current;
        self.tracklets.all().iter().filter_map(move |t| Some(state_of(profile, t, &current?)))
    }
}
