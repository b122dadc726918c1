//! `raywake-lab train moves`: P(moves) from the cues of columns in results of `raywake-lab eval`.

use super::logistic::{Data, Progress};
use super::report::{Counts, Outputs, RECALLS};
use crate::curve::{Curve, OperatingPoint};
use crate::eval::{Row, rows_of};
use clap::builder::PossibleValuesParser;
use raywake_core::params::{MovesParams, Parameters, Value};
use raywake_core::refinement::cues::Cues;
use raywake_io::Error;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Weight of the squared weights: there are few of them and many rows.
const RIDGE: f64 = 1e-6;
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
    /// Fit this weight alone; the others stay as they are
    #[arg(long, value_name = "WEIGHT", value_parser = PossibleValuesParser::new(names()))]
    only: Option<String>,
    #[command(flatten)]
    outputs: Outputs,
}

#[derive(Debug, Serialize)]
struct Report {
    training: Counts,
    held_out: Counts,
    progress: Vec<Progress>,
    /// Mean squared difference between P(moves) and the truth, held-out columns.
    brier: f64,
    /// By tenths of P(moves), held-out columns: its mean, how many moved, and out of how many.
    reliability: Vec<(f64, u64, u64)>,
    curve: Vec<OperatingPoint>,
}

/// Fits, writes a configuration file and reports.
pub fn run(args: &Args) -> Result<(), Error> {
    let [training, held_out] = samples(&args.results)?;
    let counts = [&training, &held_out].map(|d| Counts::of(d.labels.iter().copied()));
    counts[0].both("training", "columns that move", "columns that are static")?;
    counts[1].both("held-out", "columns that move", "columns that are static")?;
    let mut progress = Vec::new();
    let mut report = |weights: &[f64], training| {
        progress.push(Progress { training, held_out: held_out.loss(weights) });
    };
    let weights = match &args.only {
        Some(only) => {
            let free = names().position(|name| name == only);
            training.fit_from(shipped(), |n| Some(n) == free, &mut report)
        }
        None => training.fit(&mut report),
    };
    let scored = || {
        let rows = held_out.rows.chunks_exact(held_out.width).zip(&held_out.labels);
        rows.map(|(row, &moves)| (Data::score(&weights, row), moves))
    };
    let (brier, reliability) = reliability(scored());
    let curve =
        Curve::of(scored().map(|(score, moves)| (score, moves, 1.0))).expect("both are there");
    let curve = RECALLS.map(|r| curve.at_recall(r)).to_vec();
    let [training, held_out] = counts;
    let report = Report { training, held_out, progress, brier, reliability, curve };
    args.outputs.write(&configuration(&weights), &report)
}

/// Samples of all drives: to learn from, and held out.
fn samples(results: &[PathBuf]) -> Result<[Data<f32>; 2], Error> {
    let empty = || Data {
        width: Cues::WEIGHTS.len(),
        rows: Vec::new(),
        labels: Vec::new(),
        weights: Vec::new(),
        ridge: 0.0,
    };
    let (mut parts, mut before) = ([empty(), empty()], 0);
    for out in results {
        before += rows_of(out, |drive, row| {
            if counts(row) {
                let held_out = (before + drive) % HELD_OUT == HELD_OUT - 1;
                let part = &mut parts[usize::from(held_out)];
                part.rows.extend(row.cues().values());
                part.labels.push(row.is_moving());
            }
        })?;
    }
    for part in &mut parts {
        part.weights = vec![1.0 / part.labels.len().max(1) as f32; part.labels.len()];
    }
    parts[0].ridge = RIDGE;
    Ok(parts)
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

/// Names of the weights, bias last.
fn names() -> impl Iterator<Item = &'static str> {
    Cues::WEIGHTS.iter().copied().chain(["moves_bias"])
}

/// The weights of the built-in profiles.
fn shipped() -> Vec<f64> {
    let value = |name| match MovesParams::DEFAULT.get(name) {
        Some(Value::Single(weight)) => f64::from(weight),
        other => unreachable!("{name} is {other:?}"),
    };
    names().map(value).collect()
}

/// The text of a file for `--config`.
fn configuration(weights: &[f64]) -> String {
    names().zip(weights).fold("base = \"hdl64\"\n".to_string(), |mut text, (name, weight)| {
        let _ = writeln!(text, "{name} = {weight:.2}");
        text
    })
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
    fn probabilities_beside_frequencies() {
        // P = 0.75 three times, twice true; P = 0.25 once.
        let logit = 3f64.ln();
        let scored = [(logit, true), (logit, true), (logit, false), (-logit, false)];
        let (brier, bins) = reliability(scored.into_iter());
        assert!((brier - (2.0 * 0.0625 + 0.5625 + 0.0625) / 4.0).abs() < 1e-12);
        assert_eq!((bins[7].1, bins[7].2, bins[2].1, bins[2].2), (2, 3, 0, 1));
        assert!((bins[7].0 - 0.75).abs() < 1e-12);
    }

    #[test]
    fn shipped_weights_give_the_shipped_probability() {
        let cues = Cues { margin: 0.3, returns: 4.0, no_history: true, ..Cues::NONE };
        let score = Data::score(&shipped(), &cues.values());
        let expected = f64::from(cues.probability(&MovesParams::DEFAULT));
        assert!((1.0 / (1.0 + (-score).exp()) - expected).abs() < 1e-6);
    }

    #[test]
    fn weights_are_a_configuration() {
        let mut weights = vec![1.0; Cues::WEIGHTS.len()];
        weights.push(-7.125);
        let text = configuration(&weights);
        assert!(
            text.starts_with("base = \"hdl64\"\nmoves_margin = 1.00\n")
                && text.ends_with("moves_bias = -7.12\n")
        );
    }
}
