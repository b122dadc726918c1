//! Distribution of false motion: class, range, age of the tracklet, height, basis.

use super::{ZONES, per_sweep, percent, zone};
use crate::eval::calibration::truth;
use crate::eval::row::{CLASSES, Row};
use crate::report::{Cell, Table, TableRow};

/// A property by which columns are binned.
struct Aspect {
    name: &'static str,
    bins: &'static [&'static str],
    bin: fn(&Row) -> usize,
}

/// Ends of the bins of ranges, m: each about a third of the default window's reach.
const RANGES_M: [f32; 3] = [10.0, 20.0, 30.0];
/// First ages of the bins: from 10 on tracklets count as settled.
const AGES: [u32; 4] = [1, 3, 6, 10];
/// First numbers of occupied voxels of the bins.
const VOXELS: [u8; 3] = [2, 3, 5];

fn bin<T: PartialOrd>(starts: &[T], value: T) -> usize {
    starts.iter().filter(|start| value >= **start).count()
}

const ASPECTS: [Aspect; 6] = [
    Aspect { name: "all", bins: &["all"], bin: |_| 0 },
    Aspect { name: "class", bins: &CLASSES, bin: |row| row.class as usize },
    Aspect {
        name: "range",
        bins: &["to 10 m", "10 to 20 m", "20 to 30 m", "30 m or more"],
        bin: |row| bin(&RANGES_M, row.x.hypot(row.y)),
    },
    Aspect {
        name: "age of the tracklet",
        bins: &["0", "1 to 2", "3 to 5", "6 to 9", "10 or more"],
        bin: |row| bin(&AGES, row.age),
    },
    Aspect {
        name: "occupied voxels",
        bins: &["to 1", "2", "3 to 4", "5 or more"],
        bin: |row| bin(&VOXELS, row.voxels),
    },
    Aspect {
        name: "basis",
        bins: &["background", "unmatched", "matched", "joined"],
        bin: |row| row.basis.min(3) as usize,
    },
];

/// Static columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct StaticColumns {
    columns: u64,
    /// Reported as moving, by zone.
    wrong: [u64; 3],
}

/// Static columns, by aspect and bin.
#[derive(Clone, Debug, Default)]
pub struct FalseMotion([[StaticColumns; CLASSES.len()]; ASPECTS.len()]);

impl FalseMotion {
    /// Counts a static column; `reported`: it is reported as moving.
    pub fn add_static(&mut self, row: &Row, reported: bool) {
        for (aspect, bins) in ASPECTS.iter().zip(&mut self.0) {
            let standing = &mut bins[(aspect.bin)(row)];
            standing.columns += 1;
            standing.wrong[zone(row.mover_m)] += u64::from(reported);
        }
    }

    /// Builds the table from, for each kind of truth: whether it is exact, the sweeps, and what was
    /// counted in them.
    pub fn table(all: [(bool, u64, &FalseMotion); 2]) -> Table {
        let mut rows = Vec::new();
        for (exact, sweeps, counted) in all {
            for (aspect, bins) in ASPECTS.iter().zip(&counted.0) {
                let bins = aspect.bins.iter().zip(bins).filter(|(_, s)| s.columns > 0);
                rows.extend(bins.map(|(bin, s)| {
                    let wrong = s.wrong.iter().sum();
                    let head = [truth(exact), aspect.name, bin].map(Cell::from).into_iter();
                    let counts = [Cell::Count(s.columns), percent(wrong, s.columns)];
                    let zones = [wrong].into_iter().chain(s.wrong).map(|n| per_sweep(n, sweeps));
                    TableRow::new(head.chain(counts).chain(zones))
                }));
            }
        }
        let head = ["Truth", "By", "Of", "Static columns", "Reported as moving, %"];
        let columns = [&head[..], &["False per sweep"], &ZONES[..]].concat();
        let caption = "False motion: static columns, the share of them reported as moving, and how \
            many of those there are per sweep by their distance from the nearest mover's box.";
        Table::new("false-motion", caption, &columns, rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_is_in_one_bin_of_every_aspect() {
        let mut counted = FalseMotion::default();
        let row = |x, age, voxels, basis| Row { x, age, voxels, basis, ..Row::default() };
        let rows = [row(9.9, 0, 1, 0), row(10.0, 3, 2, 2), row(45.0, 400, 14, 3)];
        for (row, mover_m) in rows.iter().zip([0.4, 1.0, f32::INFINITY]) {
            counted.add_static(&Row { mover_m, ..*row }, row.age > 0);
        }
        for (aspect, bins) in ASPECTS.iter().zip(&counted.0) {
            assert_eq!(bins.iter().map(|b| b.columns).sum::<u64>(), 3, "{}", aspect.name);
            assert!(bins[aspect.bins.len()..].iter().all(|b| b.columns == 0), "{}", aspect.name);
        }
        assert_eq!(counted.0[0][0], StaticColumns { columns: 3, wrong: [0, 1, 1] });
        let ranges: Vec<u64> = counted.0[2].iter().map(|b| b.columns).take(4).collect();
        assert_eq!(ranges, [1, 1, 0, 1]);
        let none = FalseMotion::default();
        // All, background, and three bins of each of the others.
        assert_eq!(FalseMotion::table([(true, 0, &none), (false, 2, &counted)]).rows.len(), 14);
    }
}
