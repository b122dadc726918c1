//! `raywake-lab train encoder`: the encoder (after chapter 4).
//!
//! Every step takes a batch of windows, half of it on each of two threads. The gradients are summed
//! in the order of the batch and nothing depends on the machine's instructions: the same weights
//! come out everywhere. After [`UNROUNDED`] of the steps the numbers are rounded as core's are, and
//! the rest of the training adapts to that (quantisation-aware training).

mod network;
mod optimiser;
mod parameters;
mod planes;
mod samples;
#[cfg(test)]
mod tests;

use super::inputs::{Inputs, Visit};
use super::report::{Counts, Outputs, RECALLS};
use super::weights_file::text;
use crate::curve::{Curve, OperatingPoint};
use network::Network;
use optimiser::{Optimiser, Schedule};
use parameters::Parameters;
use raywake_core::digest::Digest;
use raywake_core::encoder::layers::*;
use raywake_core::encoder::{ColumnClass, Encoder, EncoderWeights, class_of};
use raywake_core::team::SingleThread;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_sim::Rng;
use samples::{Sample, UNKNOWN, could_move};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Windows of a batch.
const BATCH: usize = 8;
/// Weights of the classes in the loss: rare and important ones count for more.
const CLASS_WEIGHTS: [f32; 8] = [0.5, 1.0, 1.0, 2.0, 1.0, 1.5, 4.0, 4.0];
/// Weight of columns that could move relative to those that could not.
const MOVES_WEIGHT: f32 = 3.0;
/// Share of the steps before rounding begins.
const UNROUNDED: f64 = 0.6;
/// Steps between checkpoints.
const CHECKPOINT: usize = 100;

/// Options of `train encoder`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    #[command(flatten)]
    outputs: Outputs,
    /// How many times every window is used, on average.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    epochs: u32,
    /// File to resume from if training was interrupted.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Report {
    inputs: String,
    training: Counts,
    held_out: Counts,
    /// Mean loss of every hundred steps.
    losses: Vec<f64>,
    auc: f64,
    curve: Vec<OperatingPoint>,
    /// Share of the columns of a class (row) that are classified as another (column).
    confusion: Vec<Vec<f64>>,
}

/// Trains, writes and reports.
pub fn run(args: &Args) -> Result<(), Error> {
    let inputs = Inputs { varied: true, ..args.inputs.clone() };
    let (text, report) = learn(&inputs, args)?;
    args.outputs.write(&text, &report)
}

fn learn(inputs: &Inputs, args: &Args) -> Result<(String, Report), Error> {
    let plan = inputs.plan()?;
    let drives = inputs.visit(&plan, &|visit: Visit| samples::of_drive(visit))?;
    let (mut training, mut held_out) = (Vec::new(), Vec::new());
    for (samples, planned) in drives.into_iter().zip(&plan) {
        if planned.held_out { &mut held_out } else { &mut training }.extend(samples);
    }
    let counts = [&training, &held_out].map(|s| {
        let labels = s.iter().flat_map(|s: &Sample| &s.labels).filter(|l| **l != UNKNOWN);
        Counts::of(labels.map(|l| could_move(*l)))
    });
    counts[0].both("training", "columns of objects", "columns of the background")?;
    counts[1].both("held-out", "columns of objects", "columns of the background")?;
    let steps = (training.len() * args.epochs as usize).div_ceil(BATCH);
    let (state, losses) = fit(&training, steps, inputs.seed, args.checkpoint.as_deref())?;
    let numbers = state.numbers();
    let (curve, confusion) = judge(&held_out, &numbers, &inputs.provenance())?;
    let at_95 = curve.at_recall(0.95);
    let provenance = format!(
        "raywake-lab train encoder, {}, {} epochs, held out: AUC {:.4}, background rejected at \
         recall 0.95 {:.3}",
        inputs.provenance(),
        args.epochs,
        curve.auc(),
        at_95.background_accuracy
    );
    let [training, held_out] = counts;
    let report = Report {
        inputs: inputs.provenance(),
        training,
        held_out,
        losses,
        auc: curve.auc(),
        curve: RECALLS.map(|r| curve.at_recall(r)).to_vec(),
        confusion,
    };
    Ok((text("encoder", &[NUMBERS], f64::from(ONE), &numbers, &provenance), report))
}

/// Trains on the samples; returns the final state and the mean loss of every hundred steps.
fn fit(
    samples: &[Sample],
    steps: usize,
    seed: u64,
    checkpoint: Option<&Path>,
) -> Result<(Optimiser, Vec<f64>), Error> {
    let schedule = Schedule { steps, rounded: (UNROUNDED * steps as f64) as usize };
    let of = Digest::of(format!("{seed} {steps} {}", samples.len()).as_bytes());
    let mut state = match checkpoint.filter(|c| c.exists()) {
        Some(file) => Optimiser::read(file, of)?,
        None => Optimiser::new(seed),
    };
    let (mut losses, mut sum) = (Vec::new(), 0.0);
    while state.step < steps {
        let rounded = state.step >= schedule.rounded;
        if state.step == schedule.rounded {
            state.choose_shifts();
        }
        let network = Network::new(rounded);
        let parameters = if rounded { state.rounded() } else { state.parameters.clone() };
        let mut rng = Rng::split(seed, (2 << 32) + state.step as u64);
        let batch: Vec<(usize, Rng)> = (0..BATCH)
            .map(|_| (rng.bits() as usize % samples.len(), Rng::new(rng.bits())))
            .collect();
        let part = |part: &[(usize, Rng)]| -> Vec<(f64, Parameters)> {
            let one = |(n, rng): &(usize, Rng)| {
                slope(&network, &parameters, samples[*n].drawn(&mut rng.clone()))
            };
            part.iter().map(one).collect()
        };
        let (first, second) = batch.split_at(BATCH / 2);
        let [first, second] = std::thread::scope(|scope| {
            let second = scope.spawn(|| part(second));
            [part(first), second.join().expect("a working thread panicked")]
        });
        let mut total = Parameters::zeros();
        for (loss, slope) in first.into_iter().chain(second) {
            sum += loss / BATCH as f64;
            let both = total.each_mut().zip(slope.each());
            both.for_each(|(t, s)| *t += s / BATCH as f32);
        }
        state.advance(&total, schedule.rate(state.step));
        if state.step.is_multiple_of(CHECKPOINT) {
            losses.push(sum / CHECKPOINT as f64);
            eprintln!("step {} of {steps}: loss {:.4}", state.step, sum / CHECKPOINT as f64);
            sum = 0.0;
            if let Some(file) = checkpoint {
                atomic::write(file, |to| state.write(to, of))?;
            }
        }
    }
    Ok((state, losses))
}

/// The loss of a window, and its gradient.
fn slope(
    network: &Network,
    parameters: &Parameters,
    (input, labels): (network::Input, Vec<u8>),
) -> (f64, Parameters) {
    let tape = network.forward(parameters, &input);
    let (loss, slopes) = loss(tape.scores(), &labels);
    let mut into = Parameters::zeros();
    network.backward(parameters, &input, &tape, slopes, &mut into);
    (loss, into)
}

/// Weighted cross-entropy of the classes (4.7) plus logistic loss of what could move, with the
/// gradient with respect to every score.
fn loss(scores: &[[f32; SCORES]], labels: &[u8]) -> (f64, Vec<f32>) {
    let (mut loss, mut slopes) = (0.0, Vec::with_capacity(scores.len() * SCORES));
    let share = 1.0 / labels.len().max(1) as f32;
    for (scores, &label) in scores.iter().zip(labels) {
        let (classes, &[moves]) = scores.split_last_chunk().expect("scores end in one");
        let top = classes.iter().fold(f32::MIN, |a, b| a.max(*b));
        let powers: [f32; 8] = std::array::from_fn(|n| libm::expf(classes[n] - top));
        let sum: f32 = powers.iter().sum();
        let weight = CLASS_WEIGHTS.get(label as usize).map_or(0.0, |w| w * share);
        for (n, power) in powers.iter().enumerate() {
            let is = f32::from(u8::from(n == label as usize));
            slopes.push(weight * (power / sum - is));
        }
        if let Some(own) = powers.get(label as usize) {
            loss -= f64::from(weight * libm::logf((own / sum).max(1e-30)));
        }
        let could = could_move(label);
        let p = 1.0 / (1.0 + libm::expf(-moves));
        let weight = if could { MOVES_WEIGHT * share } else { share };
        slopes.push(weight * if could { p - 1.0 } else { p });
        loss -= f64::from(weight * libm::logf(if could { p } else { 1.0 - p }.max(1e-30)));
    }
    (loss, slopes)
}

/// Evaluates core's results on the held-out windows: how well it recognises what could move, and
/// the confusion of the classes.
fn judge(
    samples: &[Sample],
    numbers: &[i32],
    provenance: &str,
) -> Result<(Curve, Vec<Vec<f64>>), Error> {
    let file = text("encoder", &[NUMBERS], f64::from(ONE), numbers, provenance);
    let mut weights = EncoderWeights::new();
    weights
        .load(&file, LEVELS)
        .map_err(|e| Error::Usage(format!("the weights learned cannot be used: {e}")))?;
    let mut encoder = raywake_alloc_guard::boxed!(Encoder, Encoder::new());
    encoder.set_weights(Some(&weights));
    let (mut rows, mut confusion) = (Vec::new(), vec![vec![0.0; 8]; 8]);
    for sample in samples {
        encoder.keep(&sample.columns(), sample.side, sample.corner);
        encoder.encode(&SingleThread);
        for (scores, &label) in encoder.scores().iter().zip(&sample.labels) {
            if label != UNKNOWN {
                rows.push((f64::from(scores[SCORES - 1]), could_move(label), 1.0));
            }
            if let Some(row) = confusion.get_mut(label as usize) {
                row[class_of(scores) as usize] += 1.0;
            }
        }
    }
    for row in &mut confusion {
        let sum: f64 = row.iter().sum();
        row.iter_mut().for_each(|n| *n /= sum.max(1.0));
    }
    const { assert!(ColumnClass::ALL.len() == 8) };
    Ok((Curve::of(rows.into_iter()).expect("both classes were counted"), confusion))
}
