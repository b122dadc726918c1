//! `raywake-lab train constancy`: the occupancy constancy (section 3.5.1).

use super::constancy_samples::{Negatives, Sample, WIDTH, samples};
use super::features::LEVELS;
use super::inputs::{Inputs, Visit};
use super::logistic::{Data, Progress};
use super::pairs::{Pair, Sweeps, pair};
use super::ranking::{Ranker, Ranking};
use super::report::{Counts, Outputs};
use super::weights_file::{quantise, text};
use crate::curve::Curve;
use raywake::backend::Tables;
use raywake_core::params::{Frame, Profile};
use raywake_core::refinement::forest;
use raywake_core::weights::Weights;
use raywake_io::Error;
use serde::Serialize;
use std::fs;
use std::path::PathBuf;

/// Weights per unit: scores index a table, so hundredths are what fits.
const SCALE: f64 = 100.0;
/// Weight of the squared weights in the loss.
const RIDGE: f64 = 1e-4;

/// Options of `train constancy`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    outputs: Outputs,
    /// Other weights to measure on the same held-out drives.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    beside: Vec<PathBuf>,
    /// Follow the recipe of section 3.5.1: the grid in the vehicle's frame, other columns from the
    /// whole search neighbourhood.
    #[arg(long)]
    as_printed: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    inputs: String,
    training: Counts,
    held_out: Counts,
    progress: Vec<Progress>,
    /// The newly trained weights first, then those to compare.
    measured: Vec<Measured>,
}

/// Performance of weights on held-out drives.
#[derive(Debug, Serialize)]
struct Measured {
    name: String,
    /// Mean negative log-likelihood with equal weight for both classes, nats.
    log_loss: f64,
    auc: f64,
    /// Columns of stationary objects; costs are summed over the 3x3 window.
    standing: Ranking,
    /// Columns of moving objects.
    moving: Ranking,
}

/// What a drive yields: samples, and its pairs if it is held out.
type Yield = (Vec<Sample>, Vec<Pair>);

/// Trains, writes and reports.
pub fn run(args: &Args) -> Result<(), Error> {
    let read = |path: &PathBuf| {
        let text = fs::read_to_string(path).map_err(Error::reading(path))?;
        Ok((path.display().to_string(), text))
    };
    let beside: Vec<(String, String)> =
        args.beside.iter().map(read).collect::<Result<_, Error>>()?;
    let inputs = match args.as_printed {
        true => Inputs { frame: Frame::Sensor, ..args.inputs.clone() },
        false => args.inputs.clone(),
    };
    let (text, report) = learn(&inputs, &beside)?;
    args.outputs.write(&text, &report)
}

/// Returns the weights file and the training report; `beside` holds names and texts of other
/// weights. In the vehicle's frame the recipe is the dissertation's.
fn learn(inputs: &Inputs, beside: &[(String, String)]) -> Result<(String, Report), Error> {
    let (negatives, option) = match inputs.frame {
        Frame::Lattice => (Negatives::Near, ""),
        Frame::Sensor => (Negatives::Search, " --as-printed"),
    };
    let plan = inputs.plan()?;
    let (mut training, mut held_out, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    let drives = inputs.visit(&plan, &|visit| of_drive(visit, negatives))?;
    for ((samples, of_drive), planned) in drives.into_iter().zip(&plan) {
        if planned.held_out { &mut held_out } else { &mut training }.extend(samples);
        pairs.extend(of_drive);
    }
    let counts = [&training, &held_out].map(|s| Counts::of(s.iter().map(|s| s.same)));
    for (count, part) in counts.iter().zip(["training", "held-out"]) {
        count.both(part, "columns of objects", "other columns to distinguish them from")?;
    }
    let (learned, checked) = (data(&training, RIDGE), data(&held_out, 0.0));
    let mut progress = Vec::new();
    let weights = learned.fit(&mut |weights, training| {
        progress.push(Progress { training, held_out: checked.loss(weights) });
    });
    let integers = quantise(&weights, SCALE);
    let inputs = inputs.provenance();
    let write = |provenance: &str| text("constancy", &[3, LEVELS], SCALE, &integers, provenance);
    let ours = measure("written", &write("untold"), &checked, &pairs)?;
    let provenance = format!(
        "raywake-lab train constancy{option}, {inputs}, logistic regression, held-out log loss \
         {:.4}, AUC {:.4}, true target first {:.3} stationary {:.3} moving",
        ours.log_loss, ours.auc, ours.standing.first, ours.moving.first
    );
    let mut measured = vec![ours];
    for (name, text) in beside {
        measured.push(measure(name, text, &checked, &pairs)?);
    }
    let [training, held_out] = counts;
    Ok((write(&provenance), Report { inputs, training, held_out, progress, measured }))
}

fn of_drive(mut visit: Visit, negatives: Negatives) -> Result<Yield, Error> {
    let (mut sweeps, mut of_drive, mut pairs) = (Sweeps::default(), Vec::new(), Vec::new());
    for index in visit.sweeps {
        if index + 1 == visit.drive.len() {
            break;
        }
        if let Some(pair) = pair(visit.grid, visit.drive, index, &mut sweeps)? {
            samples(&pair, negatives, &mut visit.rng, &mut of_drive);
            if visit.held_out {
                pairs.push(pair);
            }
        }
    }
    Ok((of_drive, pairs))
}

fn data(samples: &[Sample], ridge: f64) -> Data {
    let labels: Vec<bool> = samples.iter().map(|s| s.same).collect();
    Data {
        width: WIDTH,
        rows: samples.iter().flat_map(|s| s.features).collect(),
        weights: Data::balanced(&labels, samples.iter().map(|_| 1.0)),
        labels,
        ridge,
    }
}

fn measure(name: &str, text: &str, data: &Data, pairs: &[Pair]) -> Result<Measured, Error> {
    let tables = Tables::load(&Profile::hdl64(), None, text, None, forest::SHIPPED)
        .map_err(|e| Error::Usage(format!("{name}: {e}")))?;
    let mut counts = [Ranking::default(); 2];
    let mut ranker = Ranker::new(Profile::hdl64().columns());
    pairs.iter().for_each(|pair| ranker.add(&tables, pair, &mut counts));
    let file = Weights::parse(text, "constancy", &[3, LEVELS], 1)
        .map_err(|e| Error::Usage(format!("{name}: {e}")))?;
    let weights: Vec<f64> = file.values().map(|w| f64::from(w) / f64::from(file.scale)).collect();
    let rows = data.rows.chunks_exact(WIDTH).zip(&data.labels);
    let curve = Curve::of(rows.map(|(row, &same)| (Data::score(&weights, row), same, 1.0)))
        .expect("both classes were counted");
    let [standing, moving] = counts.map(Ranking::shares);
    let log_loss = data.loss(&weights);
    Ok(Measured { name: name.into(), log_loss, auc: curve.auc(), standing, moving })
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::stages::occupancy_constancy::SHIPPED;

    #[test]
    fn the_same_bytes_from_the_same_seed() {
        let inputs = Inputs { drives: 5, sweeps: 3, seed: 3, ..Inputs::default() };
        let shipped = [("shipped".to_string(), SHIPPED.to_string())];
        let (text, report) = learn(&inputs, &shipped).unwrap();
        let (again, _) = learn(&inputs, &[]).unwrap();
        assert!(text == again);
        let [ours, other] = &report.measured[..] else { panic!("two were measured") };
        assert!(ours.log_loss < std::f64::consts::LN_2 && ours.log_loss != other.log_loss);
        assert!(ours.standing.columns > 100 && ours.standing.first > 0.1, "{:?}", ours.standing);
    }

    #[test]
    fn damaged_weights_beside_are_named() {
        let checked = data(&[], 0.0);
        let error = measure("old.txt", "nothing", &checked, &[]).unwrap_err().to_string();
        assert!(error.contains("old.txt"), "{error}");
    }
}
