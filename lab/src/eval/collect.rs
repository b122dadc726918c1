//! From a pair of sweeps to rows: every solid column with its truth.

use super::exact::owners;
use super::objects::{Objects, Present};
use super::row::{Row, class_of};
use crate::grid::Grid;
use crate::labels::trajectory::MOVING_MPS;
use crate::labels::{Motion, View};
use crate::simulate::truth::PointTruth;
use glam::DVec3;
use raywake::backend::Tables;
use raywake::engine::Pair;
use raywake_core::encoder::{Encoder, EncoderWeights, could_move};
use raywake_core::frame::{Window, place};
use raywake_core::output::{ColumnFlow, PointFlow};
use raywake_core::params::{Frame, Profile};
use raywake_core::pose::Pose;
use raywake_core::record::{Column, NONE, SweepUniform};
use raywake_core::stages::background_filter::score;
use raywake_core::stages::grid::shift::shift;
use raywake_core::sweep::Rig;
use raywake_core::team::SingleThread;
use raywake_io::source::SweepData;

/// A copy of a pair, for another thread.
#[derive(Clone)]
pub struct PairData {
    /// Index of the first sweep in the drive.
    pub index: usize,
    /// The first sweep.
    pub first: SweepData,
    /// Pose of the vehicle in the second sweep.
    pub then: Pose,
    /// Time between them, s.
    pub dt_s: f64,
    /// Flow of the first sweep's columns.
    pub columns: Vec<ColumnFlow>,
    /// Flow of the first sweep's returns.
    pub points: Vec<PointFlow>,
}

impl PairData {
    /// Copies a pair.
    pub fn of(pair: &Pair) -> PairData {
        PairData {
            index: pair.index,
            first: pair.first.clone(),
            then: pair.second.world_from_vehicle,
            dt_s: pair.flows.dt_s,
            columns: pair.flows.columns.to_vec(),
            points: pair.flows.points.iter().collect(),
        }
    }

    /// Pose of the vehicle in the first sweep.
    pub fn now(&self) -> Pose {
        self.first.world_from_vehicle
    }
}

/// Displacements over ground of a column between the sweeps, m, in world axes.
struct Displacements {
    /// By the labels as given.
    truth: DVec3,
    /// By the smoothed labels.
    smooth: DVec3,
    /// When at rest relative to the vehicle.
    carried: DVec3,
    /// The truth rounded to whole cells of the grid.
    rounded: DVec3,
    /// Whether labels are complete at both ends.
    in_view: bool,
}

/// Makes rows of the pairs of one drive.
pub struct Collector<'a> {
    profile: Profile,
    rig: Rig,
    /// Table of the background filter.
    filter: Vec<i32>,
    /// Without weights if the run has none.
    encoder: Box<Encoder>,
    view: View,
    /// How far boxes are extended beyond their sides, m.
    margin_m: f64,
    objects: &'a Objects,
    grid: Grid,
    /// Columns of the first sweep in the second's window, where the filter sees them.
    before: Vec<Column>,
    /// Whether each column of the first sweep's window has flow and is not reported as moving.
    reported_static: Vec<bool>,
}

impl<'a> Collector<'a> {
    /// For a drive whose first sweep was taken at `start`.
    pub fn new(
        profile: Profile,
        rig: Rig,
        start: Pose,
        tables: Tables,
        objects: &'a Objects,
        view: View,
        margin_m: f64,
    ) -> Collector<'a> {
        let grid = Grid::on_lattice(profile.clone(), place(&profile, &rig, &start, None));
        let (before, reported_static) =
            (vec![[0; 2]; profile.columns()], vec![false; profile.columns()]);
        Collector {
            profile,
            rig,
            encoder: encoder(tables.encoder.as_deref()),
            filter: tables.filter,
            view,
            margin_m,
            objects,
            grid,
            before,
            reported_static,
        }
    }

    /// Edge of a column, m.
    pub fn cell_m(&self) -> f64 {
        self.profile.voxel_m
    }

    /// The labelled objects of the first sweep.
    pub fn present(&self, seen: &PairData) -> &'a [Present] {
        self.objects.at(seen.first.frame)
    }

    /// Distance from a point of the first sweep's vehicle frame to what moves, m.
    pub fn mover_m(&self, seen: &PairData, at: DVec3) -> f32 {
        self.objects.mover_m(seen.first.frame, at)
    }

    /// Rows of the first sweep's solid columns. With exact truth, a column belongs to whatever its
    /// returns above the ground hit. Columns without such returns, or without exact truth, belong
    /// to the box that contains their centre; with exact truth they are then of the road below it
    /// ([`Row::below`]).
    pub fn rows(&mut self, seen: &PairData, exact: Option<&[PointTruth]>) -> Vec<Row> {
        let window = self.grid.sweep(&self.rig, &seen.first.sweep());
        let columns = self.grid.columns.len();
        self.encoder.keep(
            &self.grid.columns,
            self.grid.step.side as usize,
            [window.corner[0], window.corner[1]],
        );
        self.encoder.encode(&SingleThread);
        let owners = exact.map(|returns| owners(&self.grid.of_point, returns, columns));
        let next = place(&self.profile, &self.rig, &seen.then, Some(window.lattice_origin));
        let [shift_x, shift_y, shift_z] = [0, 1, 2].map(|a| next.corner[a] - window.corner[a]);
        let step = SweepUniform { shift_x, shift_y, shift_z, ..self.grid.step };
        shift(&step, &self.grid.columns, &mut self.before);
        let present = self.present(seen);
        let mut rows = Vec::with_capacity(seen.columns.len());
        self.reported_static.fill(false);
        for flow in &seen.columns {
            let column = |window: &Window| {
                let [i, j] = [0, 1].map(|n| flow.cell[n] - window.corner[n]);
                (i * step.side + j) as usize
            };
            let hit = owners.as_ref().map(|owners| owners[column(&window)]);
            let owner = match hit.flatten() {
                Some(id) => present.iter().find(|p| p.id == Some(id)),
                None => present.iter().find(|p| p.footprint.holds(flat(flow), self.margin_m)),
            };
            let (here, column) = (column(&window), column(&next));
            let occupied = self.before[column][0] >> 16;
            let row = Row {
                below: hit == Some(None) && owner.is_some(),
                voxels: occupied.count_ones() as u8,
                score: score(&step, &self.filter, &self.before, column),
                encoder_score: self.encoder.scores().get(here).map_or(0.0, could_move),
                ..self.row(seen, flow, owner)
            };
            self.reported_static[here] = !row.is_reported_moving();
            rows.push(row);
        }
        rows
    }

    /// Whether each return of the first sweep is reported as moving: with a velocity of
    /// [`MOVING_MPS`] or more, and together with its column if that is solid. Applies to the sweep
    /// whose rows were made last.
    pub fn returns_reported_moving(&self, seen: &PairData) -> Vec<bool> {
        let moving = |(flow, &column): (&PointFlow, &u32)| {
            let [x, y] = flow.velocity_world_mps.map(f64::from);
            let with_column = column == NONE || !self.reported_static[column as usize];
            x.hypot(y) >= MOVING_MPS && with_column
        };
        seen.points.iter().zip(&self.grid.of_point).map(moving).collect()
    }

    fn row(&self, seen: &PairData, flow: &ColumnFlow, object: Option<&Present>) -> Row {
        let [x, y] = flow.position_vehicle_m;
        let Displacements { truth, smooth, carried, rounded, in_view } =
            self.displacements(seen, flat(flow), object);
        Row {
            sweep: seen.index as u32,
            frame: seen.first.frame,
            stamp_s: seen.first.stamp_s,
            cell_i: flow.cell[0],
            cell_j: flow.cell[1],
            x,
            y,
            class: object.map_or(0, |p| class_of(p.kind)),
            track: object.map_or(0, |p| p.track + 1),
            in_view,
            motion: object.map_or(0, |p| motion(p.motion)),
            mover_m: self.mover_m(seen, flat(flow)),
            basis: flow.basis as u8,
            flow_x: flow.displacement_m[0],
            flow_y: flow.displacement_m[1],
            flow_cov_xx: flow.displacement_covariance[0],
            flow_cov_xy: flow.displacement_covariance[1],
            flow_cov_yy: flow.displacement_covariance[2],
            true_x: truth.x as f32,
            true_y: truth.y as f32,
            smooth_x: smooth.x as f32,
            smooth_y: smooth.y as f32,
            carried_x: carried.x as f32,
            carried_y: carried.y as f32,
            rounded_x: rounded.x as f32,
            rounded_y: rounded.y as f32,
            velocity_x: flow.velocity_world_mps[0],
            velocity_y: flow.velocity_world_mps[1],
            covariance_xx: flow.covariance[0],
            covariance_xy: flow.covariance[1],
            covariance_yy: flow.covariance[2],
            age: flow.age,
            dt: seen.dt_s as f32,
            probability: flow.probability,
            ..Row::from_cues(flow.cues)
        }
    }

    /// The true displacements of a column with its centre `at`, and the references.
    fn displacements(&self, seen: &PairData, at: DVec3, object: Option<&Present>) -> Displacements {
        // Flow is planar; the height matters a little when the vehicle pitches.
        let height = object.map_or(self.rig.ground_m, |p| p.vehicle_from_box.translation.z);
        let at = DVec3::new(at.x, at.y, height);
        let world = seen.now().transform(at);
        let step = object.and_then(|p| p.step);
        let vanishes = object.is_some() && step.is_none();
        let moved = |by: Option<Pose>| by.map_or(world, |m| m.transform(world)) - world;
        let (truth, smooth) = (moved(step.map(|s| s.raw)), moved(step.map(|s| s.smooth)));
        let ends = [at, seen.then.inverse().transform(world + truth)];
        let cell = self.profile.voxel_m;
        let rounded = (self.in_grid(seen, at, truth) / cell).round() * cell;
        Displacements {
            truth,
            smooth,
            carried: seen.then.transform(at) - world,
            rounded: self.over_ground(seen, at, DVec3::new(rounded.x, rounded.y, 0.0)),
            in_view: !vanishes && ends.iter().all(|end| self.view.holds(*end)),
        }
    }

    /// Converts a displacement in the frame of the grid to one over ground.
    fn over_ground(&self, seen: &PairData, at: DVec3, by: DVec3) -> DVec3 {
        match self.profile.frame {
            Frame::Lattice => by,
            Frame::Sensor => seen.then.transform(at + by) - seen.now().transform(at),
        }
    }

    /// Converts a displacement over ground to one in the frame of the grid.
    fn in_grid(&self, seen: &PairData, at: DVec3, by: DVec3) -> DVec3 {
        match self.profile.frame {
            Frame::Lattice => by,
            Frame::Sensor => seen.then.inverse().transform(seen.now().transform(at) + by) - at,
        }
    }
}

/// Centre of a column on the plane of the vehicle frame, m.
fn flat(flow: &ColumnFlow) -> DVec3 {
    let [x, y] = flow.position_vehicle_m.map(f64::from);
    DVec3::new(x, y, 0.0)
}

/// Encoded as in [`Row::motion`].
fn motion(motion: Motion) -> u8 {
    match motion {
        Motion::Parked => 0,
        Motion::Slow => 1,
        Motion::Moving => 2,
    }
}

fn encoder(weights: Option<&EncoderWeights>) -> Box<Encoder> {
    let mut encoder = raywake_alloc_guard::boxed!(Encoder, Encoder::new());
    encoder.set_weights(weights);
    encoder
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::row::CLASSES;
    use crate::labels::{Kind, Labels, Track};
    use raywake_core::encoder::SHIPPED;
    use raywake_core::output::FlowBasis;
    use raywake_core::refinement::forest;
    use raywake_core::stages::occupancy_constancy;
    use raywake_core::sweep::Point;
    use raywake_io::source::Source;
    use raywake_io::source::simulated::Simulated;
    use raywake_sim::Class;

    /// A truck of 8 m that moves 0.6 m, with returns within its footprint and beside it.
    #[test]
    fn static_structure_beneath_a_truck_is_not_the_truck() {
        let source = Simulated::new(1, 2);
        let [now, then] = [0, 1].map(|n| source.pose(n));
        let ahead = now.rotation * DVec3::new(0.6, 0.0, 0.0);
        let truck = Pose { translation: DVec3::new(12.0, 4.0, 0.3), ..Pose::IDENTITY };
        let moved = now * truck;
        let moved = then.inverse() * Pose { translation: moved.translation + ahead, ..moved };
        let track = Track {
            id: "7".into(),
            class: "Truck".into(),
            kind: Kind::Truck,
            size: [8.0, 2.4, 3.2],
            boxes: [(0, truck), (1, moved)].into(),
        };
        let (tracks, notes) = (vec![track], Vec::new());
        let objects =
            Objects::new(&Labels { tracks, view: View::All, exact: true, notes }, &source);
        let seen = [
            ([12.0, 4.0, -1.6], 0, Class::Ground),
            ([10.0, 3.2, 0.2], 7, Class::Truck),
            ([14.0, 4.8, -1.0], 0, Class::Fixture),
            ([11.0, -4.0, -1.0], 0, Class::Pole),
        ];
        let truth = seen.map(|(_, object, class)| PointTruth {
            offset_s: 0.0,
            sensor: 0,
            object,
            class,
            flow: [0.0; 3],
        });
        let points = seen.map(|(position, ..)| Point { position, ..Point::default() }).to_vec();
        let first = SweepData { points, world_from_vehicle: now, ..SweepData::default() };
        let profile = Profile::hdl64();
        let tables = Tables::load(
            &profile,
            None,
            occupancy_constancy::shipped(profile.frame),
            Some(SHIPPED),
            forest::SHIPPED,
        )
        .unwrap();
        let rig = source.rig().clone();
        let mut collector =
            Collector::new(profile, rig.clone(), now, tables, &objects, View::All, 0.0);
        let window = collector.grid.sweep(&rig, &first.sweep());
        let column = |n: usize| {
            let column = collector.grid.of_point[n] as i32;
            let side = collector.grid.step.side;
            let at = collector.grid.centre(&window, column as usize);
            ColumnFlow {
                cell: [column / side + window.corner[0], column % side + window.corner[1]],
                position_vehicle_m: [at.x as f32, at.y as f32],
                basis: FlowBasis::Unmatched,
                ..ColumnFlow::default()
            }
        };
        let columns = (0..4).map(column).collect();
        let seen = PairData { index: 0, first, then, dt_s: 0.1, columns, points: Vec::new() };
        let classes =
            |rows: &[Row]| rows.iter().map(|r| CLASSES[r.class as usize]).collect::<Vec<_>>();
        let rows = collector.rows(&seen, Some(&truth));
        assert_eq!(classes(&rows), ["Truck", "Truck", "Background", "Background"]);
        assert!(rows.iter().map(|r| r.below).eq([true, false, false, false]));
        assert!(rows.iter().all(|r| r.score == 0 && r.encoder_score != 0.0));
        let motion: Vec<_> = rows.iter().map(|r| (r.motion, r.true_x.hypot(r.true_y))).collect();
        // The street slopes a little.
        for (class, by) in &motion[..2] {
            assert!(*class == 2 && (by - 0.6).abs() < 1e-3, "{motion:?}");
        }
        assert!(motion[2..] == [(0, 0.0); 2], "{motion:?}");
        // With the boxes alone.
        let rows = collector.rows(&seen, None);
        assert_eq!(classes(&rows), ["Truck", "Truck", "Truck", "Background"]);
        assert!(rows.iter().all(|r| !r.below));
    }
}
