//! Two sweeps, each in the frame of its vehicle pose, and where every cell of the first went.

use super::occupancy::{BORDER, OccupancyMap, SIDE, WIDE};
use crate::grid::Grid;
use crate::labels::{Footprint, Kind};
use crate::train::drives::{Labelled, LabelledSweep, Seen};
use glam::DVec3;
use raywake_core::continuity::ContinuityLimits;
use raywake_core::frame::Window;
use raywake_core::pose::Pose;
use raywake_core::record::Column;
use raywake_io::Error;
use std::collections::HashMap;

/// What a cell of the first sweep belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellOwner {
    /// In an object's footprint: an index of [`FlowPair::objects`].
    Object(u16),
    /// Nothing labelled.
    Background,
    /// An object of no known kind, or a place where nothing is labelled.
    Unknown,
}

/// A cell of the first sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// What it belongs to.
    pub owner: CellOwner,
    /// Whether there is a return in it.
    pub solid: bool,
    /// Where it went, cells along both axes; `None` if unknown.
    pub displacement: Option<[f32; 2]>,
    /// Where it would have gone if static.
    pub odometry: [f32; 2],
}

/// A labelled object of the first sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabelledObject {
    /// Kind of the object.
    pub kind: Kind,
    /// Speed over ground, m/s; `None` if it is missing from the second sweep.
    pub speed_mps: Option<f64>,
}

/// Two sweeps with the truth, on the cells of the flow's window.
pub struct FlowPair {
    /// Occupancy of both.
    pub maps: [OccupancyMap; 2],
    /// `SIDE` x `SIDE` cells of the first.
    pub cells: Vec<Cell>,
    /// Columns of both, in the same cells.
    pub columns: [Vec<Column>; 2],
    /// Objects of the first.
    pub objects: Vec<LabelledObject>,
}

/// Working memory, kept for reuse.
#[derive(Default)]
pub struct TwoSweeps([LabelledSweep; 2]);

impl FlowPair {
    /// The pair that begins at a sweep of a drive; `None` if the next sweep does not continue it.
    pub fn read(
        grid: &mut Grid,
        drive: &mut dyn Labelled,
        index: usize,
        sweeps: &mut TwoSweeps,
    ) -> Result<Option<FlowPair>, Error> {
        for (n, sweep) in sweeps.0.iter_mut().enumerate() {
            drive.read(index + n, sweep)?;
        }
        let [first, second] = &sweeps.0;
        let dt_s = second.data.stamp_s - first.data.stamp_s;
        let poses = [first, second].map(|s| s.data.world_from_vehicle);
        if ContinuityLimits::DEFAULT.broken(&poses[0], &poses[1], dt_s).is_some() {
            return Ok(None);
        }
        let (later, _) = OccupancyMap::of(grid, drive.rig(), &second.data.sweep());
        let columns_later = inner(&grid.columns);
        let (map, window) = OccupancyMap::of(grid, drive.rig(), &first.data.sweep());
        let motions = motions(first, second, dt_s);
        let cells = cells(grid, &window, drive, first, &poses, &motions);
        let objects = first.objects.iter().zip(&motions).map(|(o, motion)| LabelledObject {
            kind: o.kind,
            speed_mps: motion.map(|(_, speed)| speed),
        });
        let columns = [inner(&grid.columns), columns_later];
        Ok(Some(FlowPair { maps: [map, later], cells, columns, objects: objects.collect() }))
    }

    /// Rounded displacement of a cell, if it is known and within the search.
    pub fn step(&self, cell: usize) -> Option<[i32; 2]> {
        let step = self.cells[cell].displacement?.map(|d| d.round() as i32);
        let near = step.iter().all(|d| d.abs() <= raywake_core::params::REACH);
        near.then_some(step)
    }

    /// Indices of solid cells of objects whose displacement is known and within the search.
    pub fn sources(&self) -> Vec<usize> {
        let foreground = |c: &Cell| c.solid && matches!(c.owner, CellOwner::Object(_));
        (0..SIDE * SIDE)
            .filter(|n| foreground(&self.cells[*n]) && self.step(*n).is_some())
            .collect()
    }
}

/// Motion in the world of each object, and its speed over ground, m/s.
fn motions(first: &LabelledSweep, second: &LabelledSweep, dt_s: f64) -> Vec<Option<(Pose, f64)>> {
    let later: HashMap<usize, &Seen> = second.objects.iter().map(|o| (o.id, o)).collect();
    let motion = |o: &Seen| {
        let (from, to) = (first.world_from_box(o), second.world_from_box(later.get(&o.id)?));
        let speed = (to.translation - from.translation).truncate().length() / dt_s;
        Some((to * from.inverse(), speed))
    };
    first.objects.iter().map(motion).collect()
}

/// The columns of the flow's window.
fn inner(wide: &[Column]) -> Vec<Column> {
    let rows = wide.chunks_exact(WIDE).skip(BORDER).take(SIDE);
    rows.flat_map(|row| &row[BORDER..][..SIDE]).copied().collect()
}

fn cells(
    grid: &Grid,
    window: &Window,
    drive: &dyn Labelled,
    first: &LabelledSweep,
    poses: &[Pose; 2],
    motions: &[Option<(Pose, f64)>],
) -> Vec<Cell> {
    let footprints: Vec<(usize, Footprint)> = first
        .objects
        .iter()
        .enumerate()
        .filter(|(_, o)| {
            o.vehicle_from_box.translation.truncate().length() < grid.reach_m() + o.size[0]
        })
        .map(|(n, o)| (n, Footprint::new(o.vehicle_from_box, o.size[0], o.size[1])))
        .collect();
    let vehicle_from_world = poses[1].inverse();
    let moved = |at, motion: &Pose| {
        vehicle_from_world.transform(motion.transform(poses[0].transform(at))) - at
    };
    let cell = |n: usize| {
        let wide = (n / SIDE + BORDER) * WIDE + n % SIDE + BORDER;
        let at = grid.centre(window, wide);
        let within = footprints.iter().find(|(_, f)| f.holds(at, 0.0));
        let owner = match within {
            Some((n, _)) if first.objects[*n].kind == Kind::Other => CellOwner::Unknown,
            Some((n, _)) => CellOwner::Object(*n as u16),
            None if !drive.sees(at) => CellOwner::Unknown,
            None => CellOwner::Background,
        };
        let cells = |by: DVec3| [by.x, by.y].map(|d| (d / grid.voxel_m()) as f32);
        let odometry = cells(moved(at, &Pose::IDENTITY));
        let displacement = match owner {
            CellOwner::Object(n) => {
                motions[usize::from(n)].map(|(motion, _)| cells(moved(at, &motion)))
            }
            CellOwner::Background => Some(odometry),
            CellOwner::Unknown => None,
        };
        Cell { owner, solid: grid.columns[wide][1] != 0, displacement, odometry }
    };
    (0..SIDE * SIDE).map(cell).collect()
}
