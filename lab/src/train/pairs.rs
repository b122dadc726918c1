//! Two sweeps on one lattice, and where the columns of the first really went.

use super::drives::{Labelled, LabelledSweep};
use super::owner::{Owner, owners};
use crate::grid::Grid;
use raywake::error::Error;
use raywake_core::continuity::Limits;
use raywake_core::grid::shift::shift;
use raywake_core::params::REACH;
use raywake_core::record::{Column, Step};
use std::collections::HashMap;

/// Over ground faster than this an object moves, m/s; labels of parked cars jitter below it.
const MOVING_MPS: f64 = 1.0;

/// A column of an object, and where it went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Its index in the window of the second sweep.
    pub source: usize,
    /// True displacement, cells, at most [`REACH`] either way and inside the window.
    pub displacement: [i32; 2],
    /// Whether the object moves.
    pub moving: bool,
}

/// Columns of two consecutive sweeps in the window of the second, with the truth.
pub struct Pair {
    /// Sizes of the window and its shift.
    pub step: Step,
    /// First sweep.
    pub before: Vec<Column>,
    /// Second sweep.
    pub now: Vec<Column>,
    /// Solid columns of objects.
    pub matches: Vec<Match>,
}

/// What is worked with, kept so that its memory is reused.
#[derive(Default)]
pub struct Sweeps {
    first: LabelledSweep,
    second: LabelledSweep,
}

/// The pair that begins at sweep `index` of a drive; none where the second does not continue the
/// first.
pub fn pair(
    grid: &mut Grid,
    drive: &mut dyn Labelled,
    index: usize,
    sweeps: &mut Sweeps,
) -> Result<Option<Pair>, Error> {
    let Sweeps { first, second } = sweeps;
    drive.read(index, first)?;
    drive.read(index + 1, second)?;
    let (a, b) = (&first.data, &second.data);
    let dt_s = b.stamp_s - a.stamp_s;
    if Limits::DEFAULT.broken(&a.world_from_vehicle, &b.world_from_vehicle, dt_s).is_some() {
        return Ok(None);
    }
    let then = grid.sweep(drive.rig(), &a.sweep());
    let sources = displaced(grid, &then, drive, first, second, dt_s);
    let first_columns = grid.columns.clone();
    let now = grid.sweep(drive.rig(), &b.sweep());
    let [shift_x, shift_y, shift_z] = [0, 1, 2].map(|n| now.corner[n] - then.corner[n]);
    let step = Step { shift_x, shift_y, shift_z, ..grid.step };
    let mut before = vec![[0; 2]; first_columns.len()];
    shift(&step, &first_columns, &mut before);
    let side = step.side;
    let inside = |i: i32, j: i32| (0..side).contains(&i) && (0..side).contains(&j);
    let matches = sources.into_iter().filter_map(|m| {
        let (i, j) = (m.source as i32 / side - shift_x, m.source as i32 % side - shift_y);
        let [du, dv] = m.displacement;
        let kept = inside(i, j) && inside(i + du, j + dv);
        let source = (i * side + j) as usize;
        (kept && before[source][1] != 0).then_some(Match { source, ..m })
    });
    let matches = matches.collect();
    Ok(Some(Pair { step, before, now: grid.columns.clone(), matches }))
}

/// The solid columns of objects that both sweeps know, in the window of the first, which is in the
/// grid; those that go farther than the search are left out.
fn displaced(
    grid: &Grid,
    window: &raywake_core::prepare::Window,
    drive: &dyn Labelled,
    first: &LabelledSweep,
    second: &LabelledSweep,
    dt_s: f64,
) -> Vec<Match> {
    let later: HashMap<usize, _> = second.objects.iter().map(|o| (o.id, o)).collect();
    let motions: Vec<_> = first
        .objects
        .iter()
        .map(|o| {
            let later = later.get(&o.id)?;
            let (from, to) = (first.world_from_box(o), second.world_from_box(later));
            let speed = (to.translation - from.translation).truncate().length() / dt_s;
            Some((to * from.inverse(), speed > MOVING_MPS))
        })
        .collect();
    let owned = owners(grid, window, drive, first);
    let moved = owned.into_iter().filter_map(|(source, owner)| {
        let Owner::Object(object) = owner else {
            return None;
        };
        let (motion, moving) = motions[object]?;
        let at = first.data.world_from_vehicle.transform(grid.centre(window, source));
        let by = (motion.transform(at) - at) / grid.voxel_m();
        let displacement = [by.x, by.y].map(|d| d.round() as i32);
        let near = displacement.iter().all(|d| d.abs() <= REACH);
        near.then_some(Match { source, displacement, moving })
    });
    moved.collect()
}
