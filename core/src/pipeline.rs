//! Figure 3.1, a sweep at a time.
//!
//! ```text
//! sweep, pose -> [prepare] -> rays -> [perceive] -> flow of columns -> [follow] -> velocities
//!                             ray_merge, ray_trace, columns, shift,
//!                             background_filter, compact, occupancy_constancy,
//!                             window, expectation / maximisation x n_em
//! ```
//! [`Pipeline::prepare`] and [`Pipeline::follow`] run on the CPU, [`Pipeline::take`] too, while a
//! device perceives. What lies between them is integers and bits: [`perceive`] does it here, the
//! kernels do the same on a device, with the same result.

use crate::background_filter::background_filter;
use crate::compact::compact;
use crate::continuity::Reset;
use crate::dropped::DroppedReturns;
use crate::flow::Em;
use crate::grid::columns::columns;
use crate::grid::ray_merge::ray_merge;
use crate::grid::ray_trace::ray_trace;
use crate::grid::shift::shift;
use crate::motion_compensation::{EgoMotion, turn};
use crate::occupancy_constancy::{Scores, occupancy_constancy};
use crate::output::{ColumnFlow, Origin, PointFlow, TrackletState};
use crate::params::{COLUMNS_MAX, FOREGROUND_MAX, Frame, POINTS_MAX, Profile};
use crate::pose::{Pose, Twist};
use crate::prepare::{Placed, Preparation, Window, central, place, step_of};
use crate::record::{Column, Flow, NONE, Proposal, Ray, Step, VALID, flow_displacement};
use crate::refinement::Refinement;
use crate::sweep::{Point, Rig, Sweep};
use crate::team::Team;
use crate::tracklet::{Observation, Tracklet, TrackletTurnover, Tracklets};
use crate::window::window;
use glam::DVec3;

/// Storage of the scalar backend, one slice per buffer of the layout, and the learned tables.
pub struct Storage<'a> {
    /// Table of the background filter, see [`crate::background_filter::load`].
    pub filter_table: &'a [i32],
    /// Weights of the constancy classifier, see [`crate::occupancy_constancy::load`].
    pub constancy_weights: &'a [i32],
    /// Its table of costs.
    pub constancy_costs: &'a [u32],
    /// [`crate::params::MERGE_SLOTS`] elements.
    pub slots: &'a mut [[u32; 2]],
    /// [`POINTS_MAX`] elements.
    pub distinct: &'a mut [u32],
    /// One element per voxel.
    pub log_odds: &'a mut [i32],
    /// One element per column, kept from sweep to sweep.
    pub now: &'a mut [Column],
    /// One element per column.
    pub before: &'a mut [Column],
    /// One element per column.
    pub marks: &'a mut [u32],
    /// One element per column.
    pub rank: &'a mut [u32],
    /// [`FOREGROUND_MAX`] elements.
    pub foreground: &'a mut [u32],
    /// [`crate::params::ROW`] elements per foreground column.
    pub cost: &'a mut [u16],
    /// As many.
    pub matching: &'a mut [u16],
    /// State of the energy minimisation.
    pub em: Em<'a>,
}

/// What perception finds in a pair of sweeps.
#[derive(Clone, Copy, Debug)]
pub struct Perceived<'a> {
    /// Columns of the sweep before, in the new window.
    pub before: &'a [Column],
    /// Columns of the new sweep.
    pub now: &'a [Column],
    /// Foreground columns, ascending.
    pub foreground: &'a [u32],
    /// Foreground columns found, those beyond the capacity included.
    pub marked: usize,
    /// Distinct rays traced.
    pub rays: usize,
    /// Flow of every column.
    pub state: &'a [Flow],
    /// Last proposal of every foreground column: the energy of its flow.
    pub proposal: &'a [Proposal],
}

/// From rays to flow. `lap` is called with the name of each stage when it is done.
pub fn perceive<'a>(
    mut s: Storage<'a>,
    step: &Step,
    rounds: u32,
    rays: &[Ray],
    origins: &[[i32; 4]],
    lap: &mut dyn FnMut(&'static str),
) -> Perceived<'a> {
    shift(step, s.now, s.before);
    s.slots.fill([0; 2]);
    let used = ray_merge(rays, s.slots, s.distinct);
    lap("ray_merge");
    s.log_odds.fill(0);
    ray_trace(step, origins, rays, s.slots, &s.distinct[..used], s.log_odds);
    lap("ray_trace");
    columns(step, s.log_odds, s.now);
    lap("columns");
    background_filter(step, s.filter_table, s.before, s.marks);
    lap("background_filter");
    let (count, marked) = compact(s.marks, s.rank, s.foreground);
    let foreground = &s.foreground[..count];
    lap("compact");
    occupancy_constancy(
        step,
        s.constancy_weights,
        s.constancy_costs,
        foreground,
        s.before,
        s.now,
        s.cost,
    );
    lap("occupancy_constancy");
    window(step, foreground, s.rank, s.cost, s.matching);
    lap("window");
    s.em.run(step, rounds, foreground, s.matching);
    lap("flow");
    Perceived {
        before: s.before,
        now: s.now,
        foreground,
        marked,
        rays: used,
        state: s.em.state,
        proposal: &s.em.proposal[..count],
    }
}

/// One sweep's side of a pair.
#[derive(Clone, Copy, Debug)]
struct Side {
    window: Window,
    pose: Pose,
    twist: Twist,
    stamp_s: f64,
    points: usize,
}

/// What [`Pipeline::prepare`] hands to perception.
#[derive(Clone, Copy, Debug)]
pub struct Prepared {
    /// Sizes, shift and costs.
    pub step: Step,
    /// Returns left out.
    pub dropped: DroppedReturns,
    /// Set where this sweep has no usable predecessor.
    pub reset: Option<Reset>,
}

/// What one pair of sweeps yields. Borrowed from the pipeline until its next step.
#[derive(Clone, Copy, Debug)]
pub struct Flows<'a> {
    /// Solid columns of the first sweep.
    pub columns: &'a [ColumnFlow],
    /// Points of the first sweep, in the source's order.
    pub points: &'a [PointFlow],
    /// Time between the sweeps, s.
    pub dt_s: f64,
    /// What happened to tracklets.
    pub turnover: TrackletTurnover,
    /// Matched columns.
    pub valid: usize,
    /// Solid columns beyond the capacity for foreground, which count as background, and those beyond
    /// as many that moved, which count as unmatched.
    pub foreground_dropped: usize,
}

/// The CPU's part of the pipeline and its state between sweeps. Large (see `memory-layout.md`):
/// keep it in a box or a static.
pub struct Pipeline {
    profile: Profile,
    rig: Rig,
    unfiltered: bool,
    scores: Scores,
    preparation: Preparation,
    lattice_origin: Option<DVec3>,
    before: Option<Side>,
    current: Option<Side>,
    tracklets: Tracklets,
    observed: heapless::Vec<Observation, FOREGROUND_MAX>,
    unobserved: usize,
    column_of_point: [[u32; POINTS_MAX]; 2],
    is_apart: [[bool; POINTS_MAX]; 2],
    placed: [Placed; POINTS_MAX],
    refinement: Refinement,
    flow_of_column: [u32; COLUMNS_MAX],
}

/// Caller-owned output of [`Pipeline::follow`].
pub struct Output<'a> {
    /// [`COLUMNS_MAX`] elements (as many as the profile has columns suffice).
    pub columns: &'a mut [ColumnFlow],
    /// [`POINTS_MAX`] elements.
    pub points: &'a mut [PointFlow],
}

impl Pipeline {
    /// A pipeline at rest. The profile must pass [`Profile::check`]; `unfiltered` makes every
    /// solid column foreground.
    pub fn new(profile: Profile, rig: Rig, scores: Scores, unfiltered: bool) -> Pipeline {
        Pipeline {
            profile,
            rig,
            unfiltered,
            scores,
            preparation: Preparation::new(),
            lattice_origin: None,
            before: None,
            current: None,
            tracklets: Tracklets::new(),
            observed: heapless::Vec::new(),
            unobserved: 0,
            column_of_point: [[NONE; POINTS_MAX]; 2],
            is_apart: [[false; POINTS_MAX]; 2],
            placed: [const { Placed { at: [0.0; 3], offset_s: 0.0 } }; POINTS_MAX],
            refinement: Refinement::new(),
            flow_of_column: [NONE; COLUMNS_MAX],
        }
    }

    /// The profile it runs.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Turns a sweep into rays: `rays` must hold [`POINTS_MAX`] elements, `origins`
    /// [`crate::params::ORIGINS_MAX`].
    pub fn prepare(
        &mut self,
        team: &impl Team,
        sweep: &Sweep,
        rays: &mut [Ray],
        origins: &mut [[i32; 4]],
    ) -> Prepared {
        self.before = self.current.take();
        let reset = self.check_continuity(sweep);
        if reset.is_some() {
            self.tracklets.clear();
            self.refinement.clear();
            self.before = None;
        }
        let window =
            place(&self.profile, &self.rig, &sweep.world_from_vehicle, self.lattice_origin);
        if self.lattice_origin.is_none() {
            self.lattice_origin = Some(window.lattice_origin);
        }
        self.column_of_point.swap(0, 1);
        self.is_apart.swap(0, 1);
        let (count, dropped) = self.preparation.prepare(
            team,
            &self.profile,
            &self.rig,
            &window,
            sweep,
            rays,
            &mut self.column_of_point[0],
            &mut self.placed,
            origins,
        );
        self.current = Some(Side {
            window,
            pose: sweep.world_from_vehicle,
            twist: sweep.twist,
            stamp_s: sweep.stamp_s,
            points: sweep.points.len().min(POINTS_MAX),
        });
        let side = self.profile.side as i32;
        let shift = match (&self.before, self.profile.frame) {
            (Some(b), Frame::Lattice) => core::array::from_fn(|a| {
                window.corner[a].saturating_sub(b.window.corner[a]).clamp(-side, side)
            }),
            (Some(_), Frame::Sensor) => [0; 3],
            // Nothing of what was before comes into view.
            (None, _) => [side, 0, 0],
        };
        let step = Step {
            shift_x: shift[0],
            shift_y: shift[1],
            shift_z: shift[2],
            unfiltered: self.unfiltered as i32,
            smoothing: self.profile.smoothing as i32,
            displacement_cost: self.profile.displacement_cost as i32,
            outside_cost: self.profile.outside_cost as i32,
            score_min: self.scores.min,
            ..step_of(&self.profile, count)
        };
        Prepared { step, dropped, reset }
    }

    /// Hands the sweep that was just prepared to the refinement: needed before [`Pipeline::follow`],
    /// but not by perception, which may go on meanwhile. Returns how many returns it had no room for:
    /// it does not see them.
    pub fn take(&mut self, sweep: &Sweep) -> usize {
        let Some(current) = self.current.filter(|_| self.profile.refinement_sweeps > 0) else {
            return 0;
        };
        let taken = sweep.points.len().min(POINTS_MAX);
        let side = self.profile.side as f32;
        let inside = |v: f32| v >= 0.0 && v < side;
        let columns = &mut self.column_of_point[0][..taken];
        // Things on slopes reach out of the window's levels: their returns belong to its columns all
        // the same.
        for (column, Placed { at: [x, y, _], .. }) in columns.iter_mut().zip(&self.placed) {
            if *column == NONE && inside(*x) && inside(*y) {
                *column = *x as u32 * self.profile.side + *y as u32;
            }
        }
        let placed = &self.placed[..taken];
        let points = &sweep.points[..taken];
        let (refinement, corner) = (&mut self.refinement, current.window.corner);
        let apart = &mut self.is_apart[0][..taken];
        refinement.take(&self.profile, corner, sweep.stamp_s, points, placed, columns, apart)
    }

    /// Whether the sweep continues the one before.
    fn check_continuity(&self, sweep: &Sweep) -> Option<Reset> {
        let Some(before) = &self.before else {
            return Some(Reset::First);
        };
        let dt_s = sweep.stamp_s - before.stamp_s;
        self.profile.limits.broken(&before.pose, &sweep.world_from_vehicle, dt_s)
    }

    /// From the flow of columns to velocities: refinement, tracklets, motion compensation, columns
    /// and points. `lap` is called with the name of the refinement when that is done.
    /// `points` are those of the pair's first sweep, `output` must hold one element per solid
    /// column and per point. After a reset there is no pair and nothing comes back. How many are in the
    /// `team` makes no difference to what does.
    pub fn follow<'o>(
        &mut self,
        team: &impl Team,
        step: &Step,
        perceived: &Perceived,
        points: &[Point],
        output: Output<'o>,
        lap: &mut dyn FnMut(&'static str),
    ) -> Option<Flows<'o>> {
        let (before, current) = (self.before?, self.current?);
        let dt = current.stamp_s - before.stamp_s;
        let moved = before.pose.inverse() * current.pose;
        let turned = moved.yaw_rad() as f32;
        let left = self.tracklets.place(step);
        if self.profile.refinement_sweeps > 0 {
            let (tracklets, r) = (&self.tracklets, self.profile.voxel_m as f32);
            self.refinement.run(team, step, perceived, |c| {
                let t = tracklets.at(c).filter(|t| t.age > 0)?;
                Some(t.ekf.velocity().0.map(|v| v * dt as f32 / r))
            });
            lap("refinement");
        }
        self.observe(step, perceived);
        let turnover =
            self.tracklets.update(&self.profile, step, dt as f32, turned, left, &mut self.observed);
        // The odometry flow of the pair: the vehicle's motion from the one sweep to the other.
        let ego = EgoMotion::new(&before.pose, &moved.twist(dt));
        let (count, valid) = self.flow_of_columns(
            step,
            perceived,
            &before,
            &current,
            &ego,
            dt as f32,
            turned,
            output.columns,
        );
        let (columns, dt_s) = (&output.columns[..count], dt as f32);
        let half = points.len().min(output.points.len()) / 2;
        let (first, second) = output.points.split_at_mut(half);
        team.join(
            || self.flow_of_points(step, 0, &points[..half], &ego, columns, dt_s, first),
            || self.flow_of_points(step, half, &points[half..], &ego, columns, dt_s, second),
        );
        Some(Flows {
            columns: &output.columns[..count],
            points: &output.points[..before.points],
            dt_s: dt,
            turnover,
            valid,
            foreground_dropped: perceived.marked - perceived.foreground.len() + self.unobserved,
        })
    }

    /// Lists how solid columns moved: those with a match, and those that a moving thing took along.
    fn observe(&mut self, step: &Step, perceived: &Perceived) {
        let refined = self.profile.refinement_sweeps > 0;
        let r = self.profile.voxel_m as f32;
        let of_cells = self.profile.tracklet.measurement_cells * r;
        self.observed.clear();
        self.unobserved = 0;
        for (column, record) in perceived.before.iter().enumerate() {
            let flow = perceived.state[column];
            if record[1] == 0 {
                continue;
            }
            let valid = flow & VALID != 0;
            let (moved, covariance) = if refined {
                let found = self.refinement.of(step, column, flow);
                if !found.moves && !valid {
                    continue;
                }
                (found.by.map(|v| v * r), found.covariance.map(|v| v * r * r))
            } else if valid {
                let variance = 2.0 * of_cells * of_cells;
                let cells = flow_displacement(flow);
                (cells.map(|c| c as f32 * r), [variance, 0.0, variance])
            } else {
                continue;
            };
            let o = Observation { column: column as u32, moved, covariance, slot: NONE };
            // As many as there may be foreground columns: the last ones put out no motion.
            self.unobserved += self.observed.push(o).is_err() as usize;
        }
    }

    /// Writes one record per solid column of the first sweep; returns how many, and how many of
    /// them are matched.
    fn flow_of_columns(
        &mut self,
        step: &Step,
        perceived: &Perceived,
        before: &Side,
        current: &Side,
        ego: &EgoMotion,
        dt: f32,
        turned: f32,
        out: &mut [ColumnFlow],
    ) -> (usize, usize) {
        // The first sweep's vehicle in the second's window: the corners differ by whole cells.
        let moved = core::array::from_fn(|a| {
            (before.window.corner[a] - current.window.corner[a]) as f64 * self.profile.voxel_m
        });
        let mut grid_from_vehicle = before.window.grid_from_vehicle;
        grid_from_vehicle.translation += DVec3::from_array(moved);
        let vehicle_from_grid = grid_from_vehicle.inverse();
        let mut foreground = perceived.foreground.iter().enumerate().peekable();
        let mut observed = self.observed.iter().peekable();
        let (mut count, mut valid) = (0, 0);
        for (column, record) in perceived.before.iter().enumerate() {
            let rank = foreground.next_if(|(_, c)| **c as usize == column).map(|(n, _)| n);
            self.flow_of_column[column] = NONE;
            if record[1] == 0 {
                continue;
            }
            let (i, j) = (column as i32 / step.side, column as i32 % step.side);
            let at = vehicle_from_grid.transform(self.centre_of(i, j));
            let world = before.pose.transform(at);
            let mut flow = ColumnFlow {
                cell: [current.window.corner[0] + i, current.window.corner[1] + j],
                position_world_m: [world.x, world.y],
                position_vehicle_m: [at.x as f32, at.y as f32],
                ..Default::default()
            };
            if rank.is_some() {
                flow.origin = Origin::Unmatched;
            }
            let matched = rank.filter(|_| perceived.state[column] & VALID != 0);
            if let Some(rank) = matched {
                valid += 1;
                flow.displacement_cells = flow_displacement(perceived.state[column]);
                flow.energy = perceived.proposal[rank][1] as i32;
            }
            if let Some(observation) = observed.next_if(|o| o.column as usize == column) {
                flow.origin = if matched.is_some() { Origin::Matched } else { Origin::Joined };
                self.set_flow(&mut flow, observation, before, current, at, dt, turned);
            }
            let planar = DVec3::new(at.x, at.y, 0.0);
            if flow.origin >= Origin::Matched && self.profile.frame == Frame::Sensor {
                let relative = flow.velocity_ego_mps;
                flow.velocity_world_mps = ego.world_from_ego(planar, relative);
                flow.covariance = ego.turn_covariance(flow.covariance);
            } else {
                let [x, y, _] = ego.ego_from_world(planar, flow.velocity_world_mps);
                flow.velocity_ego_mps = [x, y];
            }
            self.flow_of_column[column] = count as u32;
            out[count] = flow;
            count += 1;
        }
        (count, valid)
    }

    /// Displacement and velocity of an observed column at `at` (first sweep's vehicle frame): its
    /// tracklet's velocity, or, where there was no room for one, that of the displacement.
    fn set_flow(
        &self,
        flow: &mut ColumnFlow,
        o: &Observation,
        before: &Side,
        current: &Side,
        at: DVec3,
        dt: f32,
        turned: f32,
    ) {
        flow.displacement_m = o.moved;
        flow.displacement_covariance = o.covariance;
        let of_pair = (o.moved.map(|v| v / dt), o.covariance.map(|v| v / (dt * dt)));
        let tracklet = self.tracklets.all().get(o.slot as usize);
        flow.age = tracklet.map_or(0, |t| t.age);
        match self.profile.frame {
            Frame::Lattice => {
                let (velocity, covariance) = tracklet.map_or(of_pair, |t| t.ekf.velocity());
                (flow.velocity_world_mps, flow.covariance) = (velocity, covariance);
            }
            Frame::Sensor => {
                let by = DVec3::new(o.moved[0] as f64, o.moved[1] as f64, 0.0);
                let by = current.pose.transform(at + by) - before.pose.transform(at);
                flow.displacement_m = [by.x as f32, by.y as f32];
                // The tracklet has gone over to the second sweep's axes.
                let turned_back = |t: &Tracklet| {
                    let (velocity, covariance) = t.ekf.velocity();
                    turn(turned, velocity, covariance)
                };
                let (velocity, covariance) = tracklet.map_or(of_pair, turned_back);
                (flow.velocity_ego_mps, flow.covariance) = (velocity, covariance);
            }
        }
    }

    /// Every point moves with its column; outside the window, and where nothing is solid, with the
    /// ground. `points` are the sweep's from the index `from` on.
    fn flow_of_points(
        &self,
        step: &Step,
        from: usize,
        points: &[Point],
        ego: &EgoMotion,
        columns: &[ColumnFlow],
        dt: f32,
        out: &mut [PointFlow],
    ) {
        let refined = self.profile.refinement_sweeps > 0;
        let r = self.profile.voxel_m as f32;
        let side = step.side;
        let places = self.column_of_point[1][from..].iter().zip(&self.is_apart[1][from..]);
        for (((&column, &is_apart), point), out) in places.zip(points).zip(out) {
            let i = (column / side as u32) as i32 - step.shift_x;
            let j = (column % side as u32) as i32 - step.shift_y;
            let seen = column != NONE && (0..side).contains(&i) && (0..side).contains(&j);
            let flow = if seen { self.flow_of_column[(i * side + j) as usize] } else { NONE };
            *out = PointFlow::default();
            if let Some(flow) = columns.get(flow as usize).filter(|_| !is_apart) {
                out.velocity_world_mps = flow.velocity_world_mps;
                out.covariance = flow.covariance;
                out.age = flow.age;
                out.origin = flow.origin;
            } else if refined && !is_apart && column != NONE {
                // Its column is not solid, but part of a thing.
                if let Some(found) = self.refinement.at(column) {
                    out.velocity_world_mps = found.by.map(|v| v * r / dt);
                    out.covariance = found.covariance.map(|v| v * (r / dt) * (r / dt));
                    out.origin = Origin::Joined;
                }
            }
            let [x, y, z] = point.position.map(|c| if c.is_finite() { c as f64 } else { 0.0 });
            out.velocity_ego_mps = ego.ego_from_world(DVec3::new(x, y, z), out.velocity_world_mps);
        }
    }

    /// The tracklets after the last step, at the time of its second sweep.
    pub fn tracklets(&self) -> impl Iterator<Item = TrackletState> {
        let current = self.current;
        self.tracklets.all().iter().filter_map(move |t| Some(self.state_of(t, &current?)))
    }

    /// The centre of a column, at the level of the anchor, from the window's central voxel, m.
    fn centre_of(&self, i: i32, j: i32) -> DVec3 {
        let [ci, cj, _] = central(&self.profile);
        DVec3::new((i - ci) as f64, (j - cj) as f64, 0.0) * self.profile.voxel_m
    }

    fn state_of(&self, t: &crate::tracklet::Tracklet, current: &Side) -> TrackletState {
        let side = self.profile.side as i32;
        let (i, j) = (t.column as i32 / side, t.column as i32 % side);
        let r = self.profile.voxel_m;
        let place = |a: usize| (t.place[a] as f64 - 0.5) * r + t.ekf.mean[a] as f64;
        let grid = self.centre_of(i, j) + DVec3::new(place(0), place(1), 0.0);
        let at = current.window.grid_from_vehicle.inverse().transform(grid);
        let world = current.pose.transform(at);
        let ego = EgoMotion::new(&current.pose, &current.twist);
        let planar = DVec3::new(at.x, at.y, 0.0);
        let (v, _) = t.ekf.velocity();
        let (heading, world_velocity, ego_velocity) = match self.profile.frame {
            Frame::Lattice => {
                let [x, y, _] = ego.ego_from_world(planar, v);
                (t.ekf.mean[2], v, [x, y])
            }
            Frame::Sensor => {
                let w = ego.world_from_ego(planar, v);
                (libm::atan2f(w[1], w[0]), w, v)
            }
        };
        let speed = match self.profile.frame {
            Frame::Lattice => t.ekf.mean[3],
            Frame::Sensor => libm::sqrtf(
                world_velocity[0] * world_velocity[0] + world_velocity[1] * world_velocity[1],
            ),
        };
        TrackletState {
            cell: [current.window.corner[0] + i, current.window.corner[1] + j],
            position_world_m: [world.x, world.y],
            position_vehicle_m: [at.x as f32, at.y as f32],
            heading_rad: heading,
            speed_mps: speed,
            turn_rate_radps: t.ekf.mean[4],
            velocity_world_mps: world_velocity,
            velocity_ego_mps: ego_velocity,
            covariance: core::array::from_fn(|a| {
                core::array::from_fn(|b| t.ekf.scale * t.ekf.covariance[(a, b)])
            }),
            age: t.age,
        }
    }
}
