//! Two sweeps in one window, and the true motion of the first one's columns.

use super::drives::{Labelled, LabelledSweep};
use super::owner::{Owner, owners};
use crate::grid::Grid;
use glam::DVec3;
use raywake_core::continuity::ContinuityLimits;
use raywake_core::frame::Window;
use raywake_core::params::REACH;
use raywake_core::record::{Column, SweepUniform};
use raywake_core::stages::grid::shift::shift;
use raywake_io::Error;
use std::collections::HashMap;

/// Speed over ground above which an object moves, m/s; labels of parked cars jitter below it.
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

/// Working memory, kept for reuse.
#[derive(Default)]
pub struct Sweeps {
    first: LabelledSweep,
    second: LabelledSweep,
}

/// The pair that begins at sweep `index` of a drive; `None` if the second does not continue the
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
    let places = places(grid, &then, drive, first, second, dt_s);
    let first_columns = grid.columns.clone();
    let now = grid.sweep(drive.rig(), &b.sweep());
    let shift_by = [0, 1, 2].map(|n| now.corner[n] - then.corner[n]);
    let [shift_x, shift_y, shift_z] = shift_by;
    let step = SweepUniform { shift_x, shift_y, shift_z, ..grid.step };
    let mut before = vec![[0; 2]; first_columns.len()];
    shift(&step, &first_columns, &mut before);
    let side = step.side;
    let inside = |[i, j]: [i32; 2]| (0..side).contains(&i) && (0..side).contains(&j);
    let matches = places.into_iter().filter_map(|p| {
        let from = then.grid_from_vehicle.transform(p.from) / grid.voxel_m();
        let to = now.grid_from_vehicle.transform(p.to) / grid.voxel_m();
        let cells = (to - from).to_array();
        let displacement = [0, 1].map(|n| (cells[n] + f64::from(shift_by[n])).round() as i32);
        let source = [p.source as i32 / side - shift_x, p.source as i32 % side - shift_y];
        let target = [0, 1].map(|n| source[n] + displacement[n]);
        let near = displacement.iter().all(|d| d.abs() <= REACH);
        let source_index = (source[0] * side + source[1]) as usize;
        let kept = near && inside(source) && inside(target) && before[source_index][1] != 0;
        kept.then_some(Match { source: source_index, displacement, moving: p.moving })
    });
    let matches = matches.collect();
    Ok(Some(Pair { step, before, now: grid.columns.clone(), matches }))
}

/// Where a solid column of an object was, and where it moved.
struct Place {
    /// Its index in the window of the first sweep.
    source: usize,
    /// Its centre, in the vehicle's frame of the first sweep, m.
    from: DVec3,
    /// Where its centre moved, in the vehicle's frame of the second sweep, m.
    to: DVec3,
    /// Whether the object moves.
    moving: bool,
}

/// The solid columns of objects that are labelled in both sweeps, in the window of the first, which
/// is in the grid.
fn places(
    grid: &Grid,
    window: &Window,
    drive: &dyn Labelled,
    first: &LabelledSweep,
    second: &LabelledSweep,
    dt_s: f64,
) -> Vec<Place> {
    let later: HashMap<usize, _> = second.objects.iter().map(|o| (o.id, o)).collect();
    let motions: Vec<_> = first
        .objects
        .iter()
        .map(|o| {
            let later = later.get(&o.id)?;
            let (from, to) = (first.world_from_box(o), second.world_from_box(later));
            let speed = (to.translation - from.translation).truncate().length() / dt_s;
            let moved = later.vehicle_from_box * o.vehicle_from_box.inverse();
            Some((moved, speed > MOVING_MPS))
        })
        .collect();
    let owned = owners(grid, window, drive, first).into_iter();
    let places = owned.filter_map(|(source, owner)| {
        let Owner::Object(object) = owner else {
            return None;
        };
        let (moved, moving) = motions[object]?;
        let from = grid.centre(window, source);
        Some(Place { source, from, to: moved.transform(from), moving })
    });
    places.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::simulated::Simulated;
    use raywake_core::params::Profile;
    use raywake_sim::{Drive, Options, Path, Scene, SensorRig, State};

    /// A car ahead moving left at 9 m/s, a parked one, and one that moves farther than the search;
    /// the vehicle drives at `speed`.
    fn scene(speed: f64) -> Simulated {
        let mut scene = Scene::empty();
        let way = |x, y, yaw, speed| Path::from(State { x, y, yaw, speed });
        scene.add_car(way(12.0, 0.0, std::f64::consts::FRAC_PI_2, 9.0), 1);
        scene.add_car(Path::stationary(5.0, -8.0, 0.3), 2);
        scene.add_car(way(-10.0, 6.0, 0.0, 55.0), 3);
        let options = Options { sweeps: 3, rig: SensorRig::ideal(), ..Options::default() };
        Simulated::new(Drive::through(scene, way(0.0, 0.0, 0.0, speed), 1, options))
    }

    #[test]
    fn static_structure_approaches_in_the_vehicle_frame() {
        let mut grid = Grid::new(Profile::dissertation());
        // 0.9 m a sweep are three cells.
        let mut drive = scene(9.0);
        let pair = pair(&mut grid, &mut drive, 1, &mut Sweeps::default()).unwrap().unwrap();
        assert_eq!([pair.step.shift_x, pair.step.shift_y], [0; 2]);
        let of = |moving| pair.matches.iter().filter(move |m| m.moving == moving);
        assert!(of(true).count() > 8 && of(false).count() > 8);
        assert!(of(false).all(|m| m.displacement == [-3, 0]));
        // The third car is 46 m/s faster, which the search still reaches.
        assert!(of(true).all(|m| [[-3, 3], [15, 0]].contains(&m.displacement)));
    }

    #[test]
    fn columns_of_a_scene_made_by_hand() {
        for speed in [0.0, 8.0] {
            let mut drive = scene(speed);
            let mut grid = Grid::new(Profile::hdl64());
            let pair = pair(&mut grid, &mut drive, 1, &mut Sweeps::default()).unwrap().unwrap();
            let count =
                |wanted: &dyn Fn(&Match) -> bool| pair.matches.iter().filter(|m| wanted(m)).count();
            // 0.9 m are three cells, whatever the vehicle does; a third of them are seen.
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
