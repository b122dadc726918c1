//! Which object a column belongs to.

use super::drives::{Labelled, LabelledSweep};
use crate::grid::Grid;
use crate::labels::{Footprint, Kind};
use raywake_core::frame::Window;
use raywake_core::record::NONE;

/// A column without a return of an object is left out if its centre lies this close outside one:
/// which side it belongs to is only a matter of rounding, m.
const DOUBT_M: f64 = 0.15;

/// What a solid column belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The object of this index in the sweep.
    Object(usize),
    /// Nothing that could move.
    Background,
    /// At the edge of an object, in one of unknown kind, or where nothing is labelled.
    Unknown,
}

/// Owners of the solid columns of the sweep in the grid. An object owns a column if a return in it
/// comes from the object or if the column's centre lies in its footprint.
pub fn owners(
    grid: &Grid,
    window: &Window,
    drive: &dyn Labelled,
    sweep: &LabelledSweep,
) -> Vec<(usize, Owner)> {
    let mut hit = vec![NONE; grid.columns.len()];
    for (&column, &object) in grid.of_point.iter().zip(&sweep.object_of_point) {
        if column != NONE && object != NONE {
            hit[column as usize] = object;
        }
    }
    let reach = grid.reach_m();
    let footprints: Vec<(usize, Footprint)> = sweep
        .objects
        .iter()
        .enumerate()
        .filter(|(_, o)| o.vehicle_from_box.translation.truncate().length() < reach + o.size[0])
        .map(|(n, o)| (n, Footprint::new(o.vehicle_from_box, o.size[0], o.size[1])))
        .collect();
    let owner = |column: usize| {
        let at = grid.centre(window, column);
        if hit[column] != NONE {
            return Owner::Object(hit[column] as usize);
        }
        let within = |margin| footprints.iter().find(|(_, f)| f.holds(at, margin));
        match within(0.0) {
            Some((n, _)) if sweep.objects[*n].kind == Kind::Other => Owner::Unknown,
            Some((n, _)) => Owner::Object(*n),
            None if within(DOUBT_M).is_some() || !drive.sees(at) => Owner::Unknown,
            None => Owner::Background,
        }
    };
    grid.solid().map(|column| (column, owner(column))).collect()
}
