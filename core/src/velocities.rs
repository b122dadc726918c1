//! Output: a velocity for every column and every return (section 3.7).

use crate::dropped::ReturnKind;
use crate::encoder::{ColumnClass, ColumnScores, class_of};
use crate::frame::{SweepPair, centre_of};
use crate::output::{ColumnFlow, FlowBasis, Output, PairFlows, PointFlows, ReturnFlow, Status};
use crate::params::{COLUMNS_MAX, Profile};
use crate::perceive::Perceived;
use crate::prepare::Setup;
use crate::record::{NONE, SweepUniform, VALID, flow_displacement};
use crate::refinement::Refinement;
use crate::refinement::cues::Cues;
use crate::returns::Returns;
use crate::sweep::Point;
use crate::team::{self, Team};
use crate::thinning::TakenPoints;
use crate::tracklet::observe::Observations;
use crate::tracklet::{TrackletTurnover, Tracklets};
use core::ops::Range;
use glam::DVec3;

/// Maximum number of returns a thread processes in one piece: an eighth of an HDL-64E sweep.
const PIECE_RETURNS_MAX: usize = 1 << 14;

/// Record index of every column of the first sweep's window, [`NONE`] if it has none.
pub(crate) struct FlowOfColumn([u32; COLUMNS_MAX]);

impl FlowOfColumn {
    /// For [`Found::columns`] to fill.
    pub const fn new() -> FlowOfColumn {
        FlowOfColumn([0; COLUMNS_MAX])
    }
}

/// Everything known about a pair of sweeps.
pub(crate) struct Found<'a> {
    pub pair: &'a SweepPair<'a>,
    pub setup: &'a Setup,
    pub sweep: &'a SweepUniform,
    pub perceived: &'a Perceived<'a>,
    pub observations: &'a Observations,
    pub tracklets: &'a Tracklets,
    pub refinement: &'a Refinement,
    pub returns: &'a Returns,
    /// Scores of the columns of the first sweep's window; empty without an encoder.
    pub scores: &'a [ColumnScores],
}

impl Found<'_> {
    /// Writes a velocity for every solid column and every return of the first sweep.
    pub fn write_velocities<'o>(
        &self,
        team: &impl Team,
        points: &'o [Point],
        turnover: TrackletTurnover,
        index: &mut FlowOfColumn,
        out: Output<'o>,
    ) -> PairFlows<'o> {
        let (solid, valid, unlisted) = self.columns(index, out.columns);
        let (records, unplaced) = self.clusters(index, out.columns, solid);
        let (columns, thinning) = (&out.columns[..records], self.pair.before.points);
        // With another sweep's points, velocities would go to the wrong returns.
        assert_eq!(points.len(), thinning.of(), "returns of the sweep before");
        let of_points = TakenPoints::new(points, thinning.taken());
        let taken = &mut out.points[..of_points.count()];
        self.points(team, of_points, columns, index, taken);
        let beyond = self.perceived.marked - self.perceived.foreground.len();
        let observed = self.observations.beyond_capacity + self.refinement.beyond_capacity();
        PairFlows {
            columns: &columns[..solid],
            points: PointFlows { columns, taken, points, thinning, ego: self.pair.ego },
            dt_s: self.pair.dt_s,
            turnover,
            valid,
            foreground_dropped: beyond + observed + unlisted + unplaced,
        }
    }

    /// Writes one record per solid column of the first sweep; returns how many, how many of them
    /// are matched, and how many there was no room for.
    fn columns(&self, index: &mut FlowOfColumn, out: &mut [ColumnFlow]) -> (usize, usize, usize) {
        let vehicle_from_grid = self.pair.vehicle_from_grid();
        let mut foreground = self.perceived.foreground.iter().enumerate().peekable();
        let mut observed = self.observations.all.iter().peekable();
        let (mut count, mut valid, mut beyond) = (0, 0, 0);
        index.0[..self.perceived.columns_before.len()].fill(NONE);
        for (column, record) in self.perceived.columns_before.iter().enumerate() {
            let rank = foreground.next_if(|(_, c)| **c as usize == column).map(|(n, _)| n);
            if record[1] == 0 {
                continue;
            }
            let side = self.sweep.side;
            let (i, j) = (column as i32 / side, column as i32 % side);
            let at = vehicle_from_grid.transform(centre_of(self.pair.profile, i, j));
            let mut flow = self.column_at(i, j, at);
            let matched = self.set_match(&mut flow, column, rank);
            valid += matched as usize;
            if let Some(o) = observed.next_if(|o| o.column as usize == column) {
                flow.basis = if matched { FlowBasis::Matched } else { FlowBasis::Joined };
                let tracklet = self.tracklets.all().get(o.slot as usize);
                flow.age = tracklet.map_or(0, |t| t.age);
                (flow.probability, flow.cues) = (o.probability, o.cues);
                self.pair.set_motion(at, o, tracklet, &mut flow);
                if !self.moves(&o.cues, o.probability) {
                    self.pair.set_static(at, &mut flow);
                }
            } else {
                self.pair.set_relative(at, &mut flow);
            }
            match out.get_mut(count) {
                Some(out) => {
                    *out = flow;
                    if let Some(column) = self.in_first_window(i, j) {
                        index.0[column] = count as u32;
                    }
                    count += 1;
                }
                None => beyond += 1,
            }
        }
        (count, valid, beyond)
    }

    /// Appends to the first `count` records one per column that is not solid but part of a moving
    /// cluster; returns how many there are then, and how many there was no room for.
    fn clusters(
        &self,
        index: &mut FlowOfColumn,
        out: &mut [ColumnFlow],
        mut count: usize,
    ) -> (usize, usize) {
        let (mut beyond, columns) = (0, self.perceived.columns_before.len());
        if self.pair.profile.refinement_sweeps == 0 {
            return (count, beyond);
        }
        let (r, dt) = (self.pair.profile.voxel_m as f32, self.pair.dt_s as f32);
        for (column, record) in (0..).zip(&mut index.0[..columns]) {
            if *record != NONE {
                continue;
            }
            let Some(found) = self.refinement.at(column) else { continue };
            let probability = self.setup.moves.probability(&found.cues);
            let mut flow =
                ColumnFlow { basis: FlowBasis::Joined, probability, ..Default::default() };
            if self.moves(&found.cues, probability) {
                flow.velocity_world_mps = found.by.map(|v| v * r / dt);
                flow.covariance = found.covariance.map(|v| v * (r / dt) * (r / dt));
            }
            match out.get_mut(count) {
                Some(out) => {
                    *out = flow;
                    *record = count as u32;
                    count += 1;
                }
                None => beyond += 1,
            }
        }
        (count, beyond)
    }

    /// Index in the first sweep's window of a column of the new one.
    fn in_first_window(&self, i: i32, j: i32) -> Option<usize> {
        let [i, j] = [i + self.sweep.shift_x, j + self.sweep.shift_y];
        let side = self.sweep.side;
        let inside = (0..side).contains(&i) && (0..side).contains(&j);
        inside.then_some((i * side + j) as usize)
    }

    /// Whether something with these cues and this P(moves) is output as moving. Whole cells have no
    /// other evidence.
    fn moves(&self, cues: &Cues, probability: f32) -> bool {
        let Profile { refinement_sweeps, moves, .. } = self.pair.profile;
        let first = if cues.no_history { moves.moves_min_first } else { 0.0 };
        *refinement_sweeps == 0 || probability >= moves.moves_min.max(first)
    }

    /// The record of a column whose centre is at `at` in the first sweep's vehicle frame.
    fn column_at(&self, i: i32, j: i32, at: DVec3) -> ColumnFlow {
        let corner = self.pair.current.window.corner;
        let world = self.pair.before.pose.transform(at);
        ColumnFlow {
            cell: [corner[0] + i, corner[1] + j],
            position_world_m: [world.x, world.y],
            position_vehicle_m: [at.x as f32, at.y as f32],
            class: self.class_at(i, j),
            ..Default::default()
        }
    }

    /// The class of a column that both windows contain.
    fn class_at(&self, i: i32, j: i32) -> Option<ColumnClass> {
        Some(class_of(self.scores.get(self.in_first_window(i, j)?)?))
    }

    /// Sets the match of a column that is `rank`-th of the foreground; returns whether it has one.
    fn set_match(&self, flow: &mut ColumnFlow, column: usize, rank: Option<usize>) -> bool {
        let Some(rank) = rank else { return false };
        flow.basis = FlowBasis::Unmatched;
        let found = self.perceived.flow[column];
        if found & VALID == 0 {
            return false;
        }
        flow.displacement_cells = flow_displacement(found);
        flow.energy = self.perceived.proposal[rank][1] as i32;
        true
    }

    /// Writes the [`ReturnFlow`] of every return taken from the first sweep, in its order.
    fn points(
        &self,
        team: &impl Team,
        points: TakenPoints,
        columns: &[ColumnFlow],
        index: &FlowOfColumn,
        out: &mut [ReturnFlow],
    ) {
        let part = |rows: Range<usize>, out: &mut [ReturnFlow]| {
            let places = self.returns.before(rows.start);
            let points = points.range(rows);
            for (((column, is_apart), point), out) in places.zip(points).zip(out) {
                let record = index.0.get(column as usize).filter(|r| !is_apart && **r != NONE);
                let flow = record.and_then(|r| columns.get(*r as usize));
                *out = ReturnFlow::new(record.copied(), self.status(column, point, flow));
            }
        };
        team::share(team, PIECE_RETURNS_MAX, 0..out.len(), out, 1, &part);
    }

    /// The status of a return, given the flow of its column.
    #[inline]
    fn status(&self, column: u32, point: &Point, flow: Option<&ColumnFlow>) -> Status {
        match ReturnKind::of(&self.setup.rig, point) {
            ReturnKind::Valid if column == NONE => Status::OutsideWindow,
            ReturnKind::Valid => flow.map_or(Status::Static, |flow| match flow.basis {
                FlowBasis::Unmatched => Status::Unmatched,
                _ if self.is_moving(flow) => Status::Moving,
                _ => Status::Static,
            }),
            ReturnKind::OwnVehicle => Status::OwnVehicle,
            ReturnKind::NoEcho => Status::NoEcho,
            ReturnKind::NotFinite | ReturnKind::UnknownSensor => Status::Invalid,
        }
    }

    /// Whether a column is output as moving. Whole cells, tracked by a filter, are never quite at
    /// rest.
    fn is_moving(&self, flow: &ColumnFlow) -> bool {
        flow.probability >= self.pair.profile.moves.moves_min && flow.velocity_world_mps != [0.0; 2]
    }
}
