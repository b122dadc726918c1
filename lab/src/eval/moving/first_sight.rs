//! Time from the first sight of a mover until it is reported as moving.

use crate::eval::calibration::truth;
use crate::eval::groups::ClassGroup;
use crate::eval::row::Row;
use crate::eval::statistics::{Errors, Weight};
use crate::report::{Cell, Table, TableRow};
use std::collections::BTreeMap;

/// Columns of a mover in one sweep.
#[derive(Clone, Copy, Debug, Default)]
struct Glimpse {
    /// Solid columns in view.
    columns: u32,
    /// Reported as moving.
    moving: u32,
    stamp_s: f64,
    dt_s: f64,
}

/// All glimpses of a mover, by sweep.
#[derive(Clone, Debug, Default)]
struct Sight {
    class: u8,
    exact: bool,
    glimpses: BTreeMap<u32, Glimpse>,
}

impl Sight {
    /// Time from the first sweep in which any column of it is solid and in view until the end of
    /// the first pair in which `enough` of its columns are reported as moving, s; infinite if that
    /// never happens.
    fn delay_s(&self, enough: impl Fn(&Glimpse) -> bool) -> f64 {
        let mut glimpses = self.glimpses.values();
        let first = self.glimpses.values().next().map_or(0.0, |g| g.stamp_s);
        let found = glimpses.find(|g| enough(g));
        found.map_or(f64::INFINITY, |g| g.stamp_s + g.dt_s - first)
    }
}

/// The movers of all drives, by drive and track.
#[derive(Clone, Debug, Default)]
pub struct FirstSights(BTreeMap<(String, u32), Sight>);

impl FirstSights {
    /// Counts a row of a drive; `exact`: its labels are exact.
    pub fn row(&mut self, drive: &str, row: &Row, exact: bool) {
        if row.moves() != Some(true) {
            return;
        }
        let sight = self.0.entry((drive.into(), row.track)).or_default();
        (sight.class, sight.exact) = (row.class, exact);
        let glimpse = sight.glimpses.entry(row.sweep).or_default();
        (glimpse.stamp_s, glimpse.dt_s) = (row.stamp_s, f64::from(row.dt));
        glimpse.columns += 1;
        glimpse.moving += u32::from(row.is_reported_moving());
    }

    /// Median and 90 % quantile by class.
    pub fn table(&self) -> Table {
        let mut rows = Vec::new();
        for exact in [true, false] {
            for group in ClassGroup::labelled() {
                let of = |s: &&Sight| s.exact == exact && group.holds(s.class as usize);
                let sights: Vec<&Sight> = self.0.values().filter(of).collect();
                if !sights.is_empty() {
                    rows.push(row(truth(exact), group, &sights));
                }
            }
        }
        let columns = [
            "Truth",
            "Class",
            "Movers",
            "Never",
            "Median, s",
            "90 %, s",
            "Half of it: never",
            "Half of it: median, s",
            "Half of it: 90 %, s",
        ];
        let caption = "Time from the first sight of a mover, a solid column in view while it \
            moves, until it is reported as moving: one of its columns, or half of them.";
        let note = "A pair of sweeps is output with the second: the minimum is one period. A mover \
            that is never reported counts as infinitely late.";
        Table::new("first-sight", caption, &columns, rows).note(note)
    }
}

fn row(truth: &str, group: ClassGroup, sights: &[&Sight]) -> TableRow {
    let delays = |enough: fn(&Glimpse) -> bool| {
        let mut delays = Errors::default();
        sights.iter().for_each(|s| delays.push(s.delay_s(enough) as f32, 1));
        let delays = delays.sorted(Weight::Column);
        let ever = (delays.share_below(f64::INFINITY) * sights.len() as f64).round() as usize;
        let quantiles = [0.5, 0.9].map(|q| Cell::Number(delays.quantile(q), 2));
        [Cell::from(sights.len() - ever)].into_iter().chain(quantiles)
    };
    let head = [truth.into(), group.label().into(), Cell::from(sights.len())];
    let (one, half) = (delays(|g| g.moving > 0), delays(|g| 2 * g.moving >= g.columns));
    TableRow::new(head.into_iter().chain(one).chain(half))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_count_from_the_first_column_in_view() {
        let mut sights = FirstSights::default();
        let row = |sweep: u32, motion, speed: f32| Row {
            sweep,
            track: 3,
            class: 8,
            motion,
            in_view: true,
            stamp_s: 7.0 + 0.1 * f64::from(sweep),
            dt: 0.1,
            flow_x: 0.1 * speed,
            velocity_x: speed,
            ..Row::default()
        };
        // Static, hidden, moving: seen from the third sweep on.
        for row in [
            row(0, 0, 2.0),
            Row { in_view: false, ..row(1, 2, 2.0) },
            row(2, 2, 0.0),
            row(4, 2, 0.0),
            row(4, 2, 0.0),
            row(4, 2, 1.0),
            row(6, 2, 1.0),
        ] {
            sights.row("a", &row, false);
            sights.row("b", &Row { flow_x: 0.0, ..row }, false);
        }
        let delay = |drive: &str, enough: fn(&Glimpse) -> bool| {
            sights.0[&(drive.to_string(), 3)].delay_s(enough)
        };
        assert!((delay("a", |g| g.moving > 0) - 0.3).abs() < 1e-6);
        assert!((delay("a", |g| 2 * g.moving >= g.columns) - 0.5).abs() < 1e-6);
        assert_eq!(delay("b", |g| g.moving > 0), f64::INFINITY);
        // Pedestrians, and all: one of two is never found.
        let rows = format!("{:?}", sights.table().rows);
        assert_eq!(rows.matches("Count(2), Count(1)").count(), 2, "{rows}");
    }
}
