//! Figure 3.1, a sweep at a time.
//!
//! ```text
//! sweep -> rays -> perceive -> refine -> track -> out -> velocities of columns and returns
//! ```
//! Rays, refinement, tracklets and output are f32 on the CPU; perception is integers and bits, on the
//! CPU or on a device, with the same result.

use crate::frame::Sides;
use crate::output::{Flows, Output, Stepped, TrackletState};
use crate::params::Profile;
use crate::perceive::{Machine, Perceive, Timer};
use crate::prepare::Setup;
use crate::refinement::Refinement;
use crate::returns::Returns;
use crate::sweep::{Point, Sweep};
use crate::team::Team;
use crate::tracklet::Tracklets;
use crate::tracklet::observe::Observations;
use crate::tracklet::state::state_of;
use crate::velocities::{FlowOfColumn, Found};

/// The state between sweeps. Plain and large (see `memory-layout.md`): keep it in a static or a box.
pub struct Pipeline {
    sides: Sides,
    returns: Returns,
    refinement: Refinement,
    tracklets: Tracklets,
    observations: Observations,
    flow_of_column: FlowOfColumn,
}

impl Default for Pipeline {
    fn default() -> Pipeline {
        Pipeline::new()
    }
}

impl Pipeline {
    /// At rest, before the first sweep.
    pub const fn new() -> Pipeline {
        Pipeline {
            sides: Sides::new(),
            returns: Returns::new(),
            refinement: Refinement::new(),
            tracklets: Tracklets::new(),
            observations: Observations::new(),
            flow_of_column: FlowOfColumn::new(),
        }
    }

    /// One sweep. `before` holds the points of the sweep before, whose flow comes back; `out` must
    /// have room for a record of each of them and of every column.
    pub fn step<'o, P: Perceive>(
        &mut self,
        setup: &Setup,
        machine: Machine<P, impl Team, impl Timer + Send>,
        sweep: &Sweep,
        before: &[Point],
        out: Output<'o>,
    ) -> Result<Stepped<'o>, P::Error> {
        let Machine { backend, team, timer } = machine;
        let profile = &setup.profile;

        let arrival = self.sides.advance(setup, sweep);
        if arrival.reset.is_some() {
            self.tracklets.clear();
            self.refinement.clear();
        }
        let sent = self.returns.send(setup, team, sweep, &arrival, backend.input());
        timer.lap("rays");

        let (returns, refinement) = (&mut self.returns, &mut self.refinement);
        let mut unrefined = 0;
        let corner = arrival.window.corner;
        let insert_cloud = || unrefined = returns.insert(refinement, profile, corner, sweep);
        let perceived = backend.perceive(&sent.uniform, team, timer, insert_cloud)?;
        let stepped = Stepped {
            flows: None,
            dropped: sent.dropped,
            reset: arrival.reset,
            unrefined,
            foreground: perceived.foreground.len(),
            rays: perceived.rays,
        };
        let Some(pair) = self.sides.pair(profile) else { return Ok(stepped) };

        let left = self.tracklets.place(&sent.uniform);
        if profile.refinement_sweeps > 0 {
            let cells_per_mps = |v: f32| v * pair.dt_s as f32 / profile.voxel_m as f32;
            let tracklets = &self.tracklets;
            self.refinement.run(team, &sent.uniform, &perceived, |column| {
                let t = tracklets.at(column).filter(|t| t.age > 0)?;
                Some(t.ekf.velocity().0.map(cells_per_mps))
            });
        }
        timer.lap("refine");

        self.observations.collect(profile, &sent.uniform, &perceived, &self.refinement);
        let turnover = self.tracklets.update(
            profile,
            &sent.uniform,
            pair.dt_s as f32,
            pair.turned_rad,
            left,
            &mut self.observations.all,
        );
        timer.lap("track");

        let found = Found {
            pair: &pair,
            sweep: &sent.uniform,
            perceived: &perceived,
            observations: &self.observations,
            tracklets: &self.tracklets,
            refinement: &self.refinement,
            returns: &self.returns,
        };
        let (count, valid) = found.columns(&mut self.flow_of_column, out.columns);
        let columns = &out.columns[..count];
        found.points(team, before, columns, &self.flow_of_column, out.points);
        timer.lap("out");
        let beyond = perceived.marked - perceived.foreground.len();
        let flows = Flows {
            columns,
            points: &out.points[..pair.before.points],
            dt_s: pair.dt_s,
            turnover,
            valid,
            foreground_dropped: beyond + self.observations.beyond_capacity,
        };
        Ok(Stepped { flows: Some(flows), ..stepped })
    }

    /// The tracklets after the last step, at the time of its sweep.
    pub fn tracklets(&self, profile: &Profile) -> impl Iterator<Item = TrackletState> {
        let current = self.sides.current;
        self.tracklets.all().iter().filter_map(move |t| Some(state_of(profile, t, &current?)))
    }
}
