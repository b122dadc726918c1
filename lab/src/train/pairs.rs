//! Two sweeps on one lattice, and where the columns of the first really went.

use super::drives::{Labelled, LabelledSweep};
use super::owner::{Owner, owners};
use crate::grid::Grid;
use raywake_core::continuity::ContinuityLimits;
use raywake_core::frame::Window;
use raywake_core::params::REACH;
use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::grid::shift::shift;
use raywake_io::Error;
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
    pub step: SweepUniform,
    pub before: Vec<Column>,
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
    if ContinuityLimits::DEFAULT
        .broken(&a.world_from_vehicle, &b.world_from_vehicle, dt_s)
        .is_some()
    {
        return Ok(None);
    }
    let then = grid.sweep(drive.rig(), &a.sweep());
    let sources = displaced(grid, &then, drive, first, second, dt_s);
    let first_columns = grid.columns.clone();
    let now = grid.sweep(drive.rig(), &b.sweep());
    let [shift_x, shift_y, shift_z] = [0, 1, 2].map(|n| now.corner[n] - then.corner[n]);
    let step = SweepUniform { shift_x, shift_y, shift_z, ..grid.step };
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
    window: &Window,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::simulated::Simulated;
    use raywake_core::params::Profile;
    use raywake_sim::{Drive, Options, Path, Scene, SensorRig, State};

    /// A car ahead at 9 m/s to the left, one parked, one that goes farther than the search; the
    /// vehicle drives at `speed`.
    fn scene(speed: f64) -> Simulated {
        let mut scene = Scene::empty();
        let way = |x, y, yaw, speed| Path::from(State { x, y, yaw, speed });
        scene.add_car(way(12.0, 0.0, std::f64::consts::FRAC_PI_2, 9.0), 1);
        scene.add_car(Path::standing(5.0, -8.0, 0.3), 2);
        scene.add_car(way(-10.0, 6.0, 0.0, 55.0), 3);
        let options = Options { sweeps: 3, rig: SensorRig::ideal(), ..Options::default() };
        Simulated::new(Drive::through(scene, way(0.0, 0.0, 0.0, speed), 1, options))
    }

    #[test]
    fn columns_of_a_scene_made_by_hand() {
        for speed in [0.0, 8.0] {
            let mut drive = scene(speed);
            let mut grid = Grid::new(Profile::hdl64());
            let pair = pair(&mut grid, &mut drive, 1, &mut Sweeps::default()).unwrap().unwrap();
            let count =
                |wanted: &dyn Fn(&Match) -> bool| pair.matches.iter().filter(|m| wanted(m)).count();
            // 0.9 m are three cells, whatever the vehicle does; a third of them seen.
            assert!(count(&|m| m.moving) > 8 && count(&|m| !m.moving) > 8);
            assert!(
                pair.matches
                    .iter()
                    .all(|m| { m.displacement == if m.moving { [0, 3] } else { [0, 0] } })
            );
            assert!(pair.matches.iter().all(|m| pair.before[m.source][1] != 0));
            // Where the parked car's columns were, they still are.
            let side = pair.step.side as usize;
            let stays = count(&|m| !m.moving && pair.now[m.source][1] != 0);
            assert!(stays * 10 > count(&|m| !m.moving) * 8);
            assert!(pair.now.len() == side * side && pair.before.len() == side * side);
        }
    }
}
