//! `raywake-lab train moves`: P(moves) from the cues of columns in results of `raywake-lab eval`.

use super::boosting::{self, Boosted, SCALE, Samples};
use super::logistic::Progress;
use super::report::{Counts, Outputs, RECALLS};
use super::weights_file;
use crate::curve::{Curve, OperatingPoint};
use crate::eval::{Row, rows_of};
use raywake_core::refinement::cues::Cues;
use raywake_core::refinement::forest::{MovesForest, NUMBERS, TREES, TREES_TOTAL};
use raywake_io::Error;
use serde::Serialize;
use std::path::PathBuf;

/// One in this many drives is held out.
const HELD_OUT: usize = 5;
/// Number of bins in which probabilities are compared with frequencies.
const BINS: usize = 10;

/// Options of `train moves`.
#[derive(clap::Args)]
pub struct Args {
    /// Folders of results of `raywake-lab eval --moving 0`; every fifth drive is held out
    #[arg(required = true, value_name = "OUT")]
    results: Vec<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

#[derive(Debug, Serialize)]
struct Report {
    training: Counts,
    held_out: Counts,
    /// Of what was found to move, and of what stands.
    progress: [Vec<Progress>; 2],
    /// Mean squared difference between P(moves) and the truth, held-out columns.
    brier: f64,
    /// By tenths of P(moves), held-out columns: its mean, how many moved, and out of how many.
    reliability: Vec<(f64, u64, u64)>,
    curve: Vec<OperatingPoint>,
}

/// Fits, writes the weights and reports.
pub fn run(args: &Args) -> Result<(), Error> {
    let ([training, held_out], drives) = samples(&args.results)?;
    let counts = [&training, &held_out].map(|part| Counts::of(part.iter().map(|s| s.1)));
    counts[0].both("training", "columns that move", "columns that are static")?;
    counts[1].both("held-out", "columns that move", "columns that are static")?;
    let fitted = [false, true].map(|stands| {
        let [training, held_out] = [&training, &held_out].map(|part| part_of(part, stands));
        boosting::fit(TREES[usize::from(stands)], &training, &held_out)
    });
    let losses = fitted.each_ref().map(|f| f.progress.last().map_or(0.0, |p| p.held_out));
    let provenance = format!(
        "raywake-lab train moves, {drives} evaluations of drives, boosted trees, held-out loss of \
         what was found to move {:.4}, of what stands {:.4}",
        losses[0], losses[1]
    );
    let text = text(&fitted, &provenance);
    let forest = MovesForest::load(&text).map_err(|e| Error::Usage(e.to_string()))?;
    let scored = || held_out.iter().map(|(cues, moves)| (f64::from(forest.logit(cues)), *moves));
    let (brier, reliability) = reliability(scored());
    let curve =
        Curve::of(scored().map(|(score, moves)| (score, moves, 1.0))).expect("both are there");
    let curve = RECALLS.map(|r| curve.at_recall(r)).to_vec();
    let [training, held_out] = counts;
    let progress = fitted.map(|f| f.progress);
    let report = Report { training, held_out, progress, brier, reliability, curve };
    args.outputs.write(&text, &report)
}

/// The text of a weights file.
fn text(fitted: &[Boosted; 2], provenance: &str) -> String {
    let trees = fitted.iter().flat_map(|f| &f.trees);
    let numbers: Vec<i32> = trees.chain(fitted.iter().map(|f| &f.bias)).copied().collect();
    weights_file::text("moves", &[TREES_TOTAL, NUMBERS], SCALE, &numbers, provenance)
}

/// The cues of a column, and whether it moves.
type Sample = (Cues, bool);

/// Columns of all drives, to learn from and held out, and the number of drives.
fn samples(results: &[PathBuf]) -> Result<([Vec<Sample>; 2], usize), Error> {
    let (mut parts, mut before) = ([Vec::new(), Vec::new()], 0);
    for out in results {
        before += rows_of(out, |drive, row| {
            if counts(row) {
                let held_out = (before + drive) % HELD_OUT == HELD_OUT - 1;
                parts[usize::from(held_out)].push((row.cues(), row.is_moving()));
            }
        })?;
    }
    Ok((parts, before))
}

/// Those that stand, or those that do not.
fn part_of(all: &[Sample], stands: bool) -> Samples {
    let part = || all.iter().filter(|(cues, _)| cues.stands == stands);
    Samples {
        width: Cues::NAMES.len(),
        rows: part().flat_map(|(cues, _)| cues.values()).collect(),
        labels: part().map(|(_, moves)| *moves).collect(),
    }
}

/// Whether the column's truth is known, and it is either moving or static.
fn counts(row: &Row) -> bool {
    row.is_matched() && row.moves().is_some()
}

/// Brier score and reliability of logits, given the truth.
fn reliability(scored: impl Iterator<Item = (f64, bool)>) -> (f64, Vec<(f64, u64, u64)>) {
    let (mut squares, mut bins) = (0.0, vec![(0.0, 0, 0); BINS]);
    for (score, moves) in scored {
        let p = 1.0 / (1.0 + (-score).exp());
        squares += (p - f64::from(u8::from(moves))).powi(2);
        let bin = &mut bins[((p * BINS as f64) as usize).min(BINS - 1)];
        *bin = (bin.0 + p, bin.1 + u64::from(moves), bin.2 + 1);
    }
    let count: u64 = bins.iter().map(|b| b.2).sum();
    bins.iter_mut().for_each(|b| b.0 /= b.2.max(1) as f64);
    (squares / count.max(1) as f64, bins)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_and_static_objects_count() {
        let row = Row { in_view: true, basis: 2, motion: 2, ..Row::default() };
        assert!(counts(&row) && counts(&Row { motion: 0, ..row }));
        assert!(!counts(&Row { motion: 1, ..row }) && !counts(&Row { basis: 1, ..row }));
        assert!(!counts(&Row { in_view: false, ..row }) && !counts(&Row { below: true, ..row }));
    }

    #[test]
    fn what_is_read_is_what_was_fitted() {
        let mut rng = raywake_sim::Rng::new(3);
        let mut samples: Vec<Sample> = Vec::new();
        for n in 0..600 {
            let [margin, worn, misfit] = [(); 3].map(|()| rng.range(-1.0, 1.0) as f32);
            let cues = Cues { margin, worn, misfit, stands: n % 3 == 0, ..Cues::NONE };
            samples.push((cues, margin * worn > 0.2 * misfit));
        }
        let fitted = [false, true].map(|stands| {
            let part = part_of(&samples, stands);
            boosting::fit(TREES[usize::from(stands)], &part, &part)
        });
        let forest = MovesForest::load(&text(&fitted, "test")).unwrap();
        for stands in [false, true] {
            let part: Vec<&Sample> = samples.iter().filter(|s| s.0.stands == stands).collect();
            let loss = part.iter().map(|(cues, moves)| {
                let logit = f64::from(forest.logit(cues));
                (if *moves { -logit } else { logit }).exp().ln_1p()
            });
            let loss = loss.sum::<f64>() / part.len() as f64;
            let expected = fitted[usize::from(stands)].progress.last().unwrap().held_out;
            assert!((loss - expected).abs() < 1e-5, "{loss} {expected}");
        }
    }

    #[test]
    fn probabilities_beside_frequencies() {
        // P = 0.75 three times, twice true; P = 0.25 once.
        let logit = 3f64.ln();
        let scored = [(logit, true), (logit, true), (logit, false), (-logit, false)];
        let (brier, bins) = reliability(scored.into_iter());
        assert!((brier - (2.0 * 0.0625 + 0.5625 + 0.0625) / 4.0).abs() < 1e-12);
        assert_eq!((bins[7].1, bins[7].2, bins[2].1, bins[2].2), (2, 3, 0, 1));
        assert!((bins[7].0 - 0.75).abs() < 1e-12);
    }
}
