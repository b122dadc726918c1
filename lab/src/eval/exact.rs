//! The exact truth of every return of a simulated drive, and so of every column.

use crate::simulate::truth::{self, PointTruth};
use raywake_core::record::NONE;
use raywake_io::Error;
use raywake_io::source::{SweepData, recognise};
use raywake_sim::Class;
use std::path::{Path, PathBuf};

/// The truth of a simulated drive's returns.
pub struct Exact(PathBuf);

impl Exact {
    /// The truth of the drive in a folder; `None` if it is not a simulated one.
    pub fn of(drive: &Path) -> Option<Exact> {
        // As for the labels: in the only recording below the folder.
        let drive = recognise(drive).map_or_else(|_| drive.to_path_buf(), |found| found.1);
        truth::objects_path(&drive).is_file().then_some(Exact(drive))
    }

    /// The truth of a sweep's returns, in their order. Fails if the file does not fit.
    pub fn returns(&self, sweep: &SweepData) -> Result<Vec<PointTruth>, Error> {
        let path = truth::points_path(&self.0, sweep.frame);
        let rows = truth::read_points(&path)?;
        if rows.len() != sweep.points.len() {
            let what = format!("{} rows for {} returns", rows.len(), sweep.points.len());
            return Err(Error::input(&path, "", what));
        }
        Ok(rows)
    }
}

/// What every column belongs to: the object hit by most of its returns above the ground (on a tie
/// the first id); 0 if more hit the background, `None` if there are no such returns. `of_point` has
/// the column of every return.
pub fn owners(of_point: &[u32], returns: &[PointTruth], columns: usize) -> Vec<Option<u32>> {
    let hits =
        of_point.iter().zip(returns).filter(|(c, t)| **c != NONE && t.class != Class::Ground);
    let mut hits: Vec<(u32, u32)> = hits.map(|(&column, t)| (column, t.object)).collect();
    hits.sort_unstable();
    let (mut owners, mut most) = (vec![None; columns], vec![0; columns]);
    for same in hits.chunk_by(|a, b| a == b) {
        let (column, object) = (same[0].0 as usize, same[0].1);
        // The background comes first, and yields to an object with equally many.
        if same.len() > most[column] || same.len() == most[column] && owners[column] == Some(0) {
            (owners[column], most[column]) = (Some(object), same.len());
        }
    }
    owners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_returns_above_the_ground_decide() {
        let of = |object: u32, class: Class| PointTruth {
            offset_s: 0.0,
            sensor: 0,
            object,
            class,
            flow: [0.0; 3],
        };
        let (ground, wall) = (of(0, Class::Ground), of(0, Class::Building));
        let [truck, car] = [of(7, Class::Truck), of(3, Class::Car)];
        let columns = [
            (None, vec![]),
            (None, vec![ground, ground]),
            (Some(7), vec![ground, truck, ground, ground]),
            (Some(0), vec![wall, truck, wall]),
            (Some(7), vec![wall, truck]),
            (Some(7), vec![car, truck, wall, truck]),
            (Some(3), vec![truck, car, ground]),
        ];
        let returns = columns.iter().enumerate();
        let returns = returns.flat_map(|(n, (_, all))| all.iter().map(move |t| (n as u32, *t)));
        // Reversed, with some outside the window.
        let (of_point, truth): (Vec<u32>, Vec<PointTruth>) =
            returns.rev().chain([(NONE, car), (NONE, wall)]).unzip();
        let expected: Vec<Option<u32>> = columns.iter().map(|c| c.0).collect();
        assert_eq!(owners(&of_point, &truth, columns.len()), expected);
    }
}
