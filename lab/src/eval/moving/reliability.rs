//! P(moves) against what moves: is it calibrated, and what does each operating point yield?

use super::percent;
use crate::eval::calibration::truth;
use crate::eval::row::Row;
use crate::report::{Axis, Cell, Chart, Guide, Lines, Plot, Series, Style, Table, TableRow};

/// Bins of P(moves), of equal width.
const BINS: usize = 20;

/// Operating points shown.
const POINTS: [f64; 9] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 0.9];

/// Columns whose P(moves) lies in a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    columns: u64,
    /// Those that move.
    moving: u64,
    /// Sum of P(moves).
    sum: f64,
}

/// Columns in view with one kind of truth, except slow ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct TruthReliability {
    bins: [Bin; BINS],
    /// Sum of squared differences between P(moves) and the truth, 0 or 1.
    squares: f64,
}

impl TruthReliability {
    fn sums(&self, from: usize) -> (u64, u64) {
        let bins = self.bins[from..].iter();
        bins.fold((0, 0), |(columns, moving), b| (columns + b.columns, moving + b.moving))
    }
}

/// P(moves) of the columns of drives with smoothed and with exact labels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MovesReliability([TruthReliability; 2]);

impl MovesReliability {
    /// Counts a row; `exact`: it is from a drive with exact labels.
    pub fn row(&mut self, row: &Row, exact: bool) {
        let Some(moves) = row.moves() else { return };
        let of = &mut self.0[usize::from(exact)];
        let p = f64::from(row.probability);
        // A hundredth of a bin: 0.3 in single precision counts as 0.3.
        let bin = &mut of.bins[((p * BINS as f64 + 0.01) as usize).min(BINS - 1)];
        bin.columns += 1;
        bin.moving += u64::from(moves);
        bin.sum += p;
        of.squares += (p - f64::from(u8::from(moves))).powi(2);
    }

    /// Results at the operating points.
    pub fn table(&self) -> Table {
        let mut rows = Vec::new();
        for exact in [true, false] {
            let of = &self.0[usize::from(exact)];
            let (columns, moving) = of.sums(0);
            if columns == 0 {
                continue;
            }
            for point in POINTS {
                let (found, right) = of.sums((point * BINS as f64).round() as usize);
                rows.push(TableRow::new([
                    truth(exact).into(),
                    Cell::Number(point, 2),
                    Cell::Count(found),
                    percent(right, found),
                    percent(right, moving),
                    Cell::Number(of.squares / columns as f64, 4),
                ]));
            }
        }
        let caption = "Columns in view with at least this P(moves), whatever their velocity, and \
            how many of those move; `--moving` selects the threshold. The Brier score is the mean \
            squared difference between P(moves) and the truth, over all columns.";
        let columns = ["Truth", "P(moves)", "Columns", "Precision, %", "Recall, %", "Brier score"];
        Table::new("p-moves", caption, &columns, rows)
    }

    /// Share of moving columns in every bin.
    pub fn chart(&self) -> Chart {
        let part = |exact: bool| {
            let bins = self.0[usize::from(exact)].bins;
            let seen = bins.iter().filter(|b| b.columns > 0);
            let points: Vec<[f64; 2]> =
                seen.map(|b| [b.sum, b.moving as f64].map(|v| v / b.columns as f64)).collect();
            let mut lines = Lines::new(
                Axis::new("mean P(moves)").range(0.0, 1.0),
                Axis::new("share that moves").range(0.0, 1.0),
            );
            lines.series.push(Series::line("columns in view", points.clone()));
            lines.series.push(Series {
                name: "bins of 0.05".into(),
                points,
                style: Style::Dots,
                marks: Vec::new(),
            });
            lines.guides.push(Guide::Diagonal("as claimed".into()));
            (format!("truth: {}", truth(exact)), Plot::Lines(lines))
        };
        let there = [true, false].into_iter().filter(|e| self.0[usize::from(*e)].sums(0).0 > 0);
        let caption = "Reliability of P(moves): below the diagonal it is overconfident, above it \
            too cautious.";
        Chart::small_multiples("figure-p-moves", caption, there.map(part).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::row::Row;

    #[test]
    fn by_hand() {
        let mut reliability = MovesReliability::default();
        let row =
            |probability, motion| Row { probability, motion, in_view: true, ..Row::default() };
        for r in [row(0.0, 0), row(0.3, 2), row(0.32, 0), row(0.9, 2), row(1.0, 2), row(0.2, 2)] {
            reliability.row(&r, false);
        }
        // Slow objects, and those out of view, are neither.
        reliability.row(&row(0.7, 1), false);
        reliability.row(&Row { in_view: false, ..row(0.7, 2) }, false);
        let of = reliability.0[0];
        assert_eq!((of.sums(0), of.sums(6), of.sums(18)), ((6, 4), (4, 3), (2, 2)));
        assert!((of.bins[6].sum - 0.62).abs() < 1e-6 && of.bins[19].columns == 1);
        let squares = 0.49 + 0.32f64.powi(2) + 0.01 + 0.64;
        assert!((of.squares - squares).abs() < 1e-6);
        assert_eq!(reliability.table().rows.len(), POINTS.len());
    }
}
