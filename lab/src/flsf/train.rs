//! `raywake-lab train flsf`.

use super::network::{D_MAX, FEATURES, Flsf, SCORES, TrainingSample};
use super::occupancy::wide_grid;
use super::pairs::{CellOwner, FlowPair, TwoSweeps};
use super::weights::{self, TrainedWeights};
use crate::curve::{Curve, OperatingPoint};
use crate::learning::Adam;
use crate::train::inputs::{Inputs, Visit};
use crate::train::report::{Counts, RECALLS};
use raywake_core::digest::Digest;
use raywake_io::Error;
use raywake_io::sink::atomic;
use raywake_sim::Rng;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Samples per step: two per thread.
const BATCH: usize = 4;
/// Adam's rate at the first step; it falls linearly to zero. The text's 1e-6 with one pair and one
/// map per step took two days on a GPU.
const RATE: f32 = 3e-4;
/// Steps between checkpoints and between lines of progress.
const CHECKPOINT: u32 = 50;
/// Samples used to judge the network.
const JUDGED: usize = 200;

/// Options of `train flsf`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    inputs: Inputs,
    /// Weights file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Results file to write.
    #[arg(long, value_name = "FILE.json")]
    report: Option<PathBuf>,
    /// Number of steps, of four samples each.
    #[arg(long, default_value_t = 1500, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,
    /// Checkpoint file to write, and to resume from if training was interrupted.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Report {
    inputs: String,
    steps: u32,
    /// Pairs of sweeps, and solid cells of objects in them.
    training: [usize; 2],
    held_out: [usize; 2],
    /// Mean losses of pairs (4.6) and of classes (4.7), every fifty steps.
    losses: Vec<[f32; 2]>,
    /// How well distances separate matching pairs from others, on held-out drives.
    matching_auc: f64,
    matching: Vec<OperatingPoint>,
}

/// Trains, writes and reports.
pub fn run(args: &Args) -> Result<(), Error> {
    let plan = args.inputs.plan()?;
    let (mut training, mut held_out) = (Vec::new(), Vec::new());
    for (pairs, planned) in args.inputs.visit(&plan, &of_drive)?.into_iter().zip(&plan) {
        if planned.held_out { &mut held_out } else { &mut training }.extend(pairs);
    }
    let counts = [&training, &held_out]
        .map(|pairs: &Vec<Material>| [pairs.len(), pairs.iter().map(|m| m.sources.len()).sum()]);
    for ([_, sources], part) in counts.into_iter().zip(["training", "held-out"]) {
        Counts { positive: sources, negative: 1 }.both(part, "cells of labelled objects", "")?;
    }
    let fitted = Fit::of(&training, args.inputs.seed, args.steps, args.checkpoint.as_deref())?;
    let trained = TrainedWeights {
        numbers: fitted.numbers,
        provenance: format!(
            "raywake-lab train flsf, {}, {} steps of {BATCH} samples",
            args.inputs.provenance(),
            args.steps
        ),
    };
    trained.write(&args.out)?;
    let curve = judge(&held_out, &trained.numbers);
    let [training, held_out] = counts;
    let report = Report {
        inputs: args.inputs.provenance(),
        steps: args.steps,
        training,
        held_out,
        losses: fitted.losses,
        matching_auc: curve.auc(),
        matching: RECALLS.map(|r| curve.at_recall(r)).to_vec(),
    };
    let text = serde_json::to_string_pretty(&report).expect("numbers and names serialise");
    println!("{text}");
    match &args.report {
        Some(path) => atomic::write(path, |file| writeln!(file, "{text}")),
        None => Ok(()),
    }
}

/// A pair of sweeps and the cells around which samples are centred.
pub struct Material {
    pair: FlowPair,
    sources: Vec<usize>,
}

impl Material {
    /// `None` if there is nothing to learn from.
    pub fn of(pair: FlowPair) -> Option<Material> {
        let sources = pair.sources();
        (!sources.is_empty()).then_some(Material { pair, sources })
    }

    fn sample(&self, rng: &mut Rng) -> TrainingSample {
        let source = self.sources[rng.bits() as usize % self.sources.len()];
        self.pair.sample(source, rng)
    }
}

fn of_drive(visit: Visit) -> Result<Vec<Material>, Error> {
    let mut grid = wide_grid();
    let (mut sweeps, mut pairs) = (TwoSweeps::default(), Vec::new());
    for index in visit.sweeps {
        if index + 1 < visit.drive.len() {
            let pair = FlowPair::read(&mut grid, visit.drive, index, &mut sweeps)?;
            pairs.extend(pair.and_then(Material::of));
        }
    }
    Ok(pairs)
}

/// Weights of background and foreground: inverse frequencies (4.7), with a frequency-weighted mean
/// of 1.
fn class_weights(pairs: &[Material]) -> [f32; SCORES] {
    let mut counts = [0.0f64; SCORES];
    for cell in pairs.iter().flat_map(|m| &m.pair.cells) {
        match cell.owner {
            CellOwner::Background => counts[0] += 1.0,
            CellOwner::Object(_) => counts[1] += 1.0,
            CellOwner::Unknown => {}
        }
    }
    let all = counts[0] + counts[1];
    counts.map(|n| (all / (SCORES as f64 * n.max(1.0))) as f32)
}

/// Result of training.
pub struct Fit {
    /// Parameters of the network.
    pub numbers: Vec<f32>,
    /// Mean losses of pairs and of classes, every [`CHECKPOINT`] steps.
    pub losses: Vec<[f32; 2]>,
}

impl Fit {
    /// Identifies the training that a checkpoint belongs to.
    pub fn identity(pairs: &[Material], seed: u64, steps: u32) -> u64 {
        let weights = class_weights(pairs);
        Digest::of(format!("{seed} {steps} {} {weights:?}", pairs.len()).as_bytes())
    }

    /// Learns from pairs of sweeps, or resumes from a checkpoint.
    pub fn of(
        pairs: &[Material],
        seed: u64,
        steps: u32,
        checkpoint: Option<&Path>,
    ) -> Result<Fit, Error> {
        let network = Flsf::new(true);
        let weights = class_weights(pairs);
        let of = Fit::identity(pairs, seed, steps);
        let (mut numbers, mut state) = match checkpoint.filter(|c| c.exists()) {
            Some(file) => weights::read_state(file, of, network.numbers())?,
            None => {
                let numbers = network.drawn(&mut Rng::split(seed, 3 << 32));
                let state = Adam::new(numbers.len());
                (numbers, state)
            }
        };
        let (mut losses, mut sums) = (Vec::new(), [0.0; 2]);
        while state.step < steps {
            let mut rng = Rng::split(seed, (4 << 32) + u64::from(state.step));
            let mut drawn = || (rng.bits() as usize % pairs.len(), Rng::new(rng.bits()));
            let batch: Vec<(usize, Rng)> = (0..BATCH).map(|_| drawn()).collect();
            let (slope, loss) = gradient(&network, &numbers, pairs, weights, &batch);
            sums = [0, 1].map(|n| sums[n] + loss[n] / CHECKPOINT as f32);
            let left = 1.0 - state.step as f32 / steps as f32;
            state.advance(&mut numbers, &slope, RATE * left);
            if state.step.is_multiple_of(CHECKPOINT) {
                let [matching, classes] = sums;
                eprintln!("step {} of {steps}: {matching:.3} {classes:.3}", state.step);
                losses.push(std::mem::take(&mut sums));
                if let Some(file) = checkpoint {
                    weights::write_state(file, of, &numbers, &state)?;
                }
            }
        }
        Ok(Fit { numbers, losses })
    }
}

/// Mean gradient and mean losses of a batch, half of it on each of two threads.
fn gradient(
    network: &Flsf,
    numbers: &[f32],
    pairs: &[Material],
    weights: [f32; SCORES],
    batch: &[(usize, Rng)],
) -> (Vec<f32>, [f32; 2]) {
    let part = |part: &[(usize, Rng)]| {
        let (mut slope, mut sums) = (vec![0.0; numbers.len()], [0.0; 2]);
        for (pair, rng) in part {
            let mut rng = rng.clone();
            let sample = pairs[*pair].sample(&mut rng);
            let losses = network.learn(numbers, &sample, weights, &mut rng, &mut slope);
            sums = [0, 1].map(|n| sums[n] + losses[n]);
        }
        (slope, sums)
    };
    let (first, second) = batch.split_at(batch.len() / 2);
    let [(mut slope, losses), (other, more)] = std::thread::scope(|scope| {
        let second = scope.spawn(|| part(second));
        [part(first), second.join().expect("a working thread panicked")]
    });
    let share = 1.0 / batch.len() as f32;
    slope.iter_mut().zip(&other).for_each(|(s, o)| *s = share * (*s + o));
    (slope, [0, 1].map(|n| share * (losses[n] + more[n])))
}

/// How well distances separate matching pairs of held-out drives from others: the smaller, the more
/// likely a match.
fn judge(pairs: &[Material], numbers: &[f32]) -> Curve {
    let network = Flsf::new(false);
    let of_encoder = &numbers[..network.encoder.numbers()];
    let mut rng = Rng::split(0, 5 << 32);
    let mut rows = Vec::new();
    for _ in 0..JUDGED {
        let sample = pairs[rng.bits() as usize % pairs.len()].sample(&mut rng);
        let maps = sample.maps.each_ref().map(|map| network.encoder.apply(of_encoder, map));
        rows.extend(sample.pairs.iter().map(|p| {
            let [a, b] =
                [&maps[0].values[p.first * FEATURES..], &maps[1].values[p.second * FEATURES..]];
            let (d, _) = crate::learning::pair_loss(&a[..FEATURES], &b[..FEATURES], true, D_MAX);
            (-f64::from(d), p.matching, 1.0)
        }));
    }
    Curve::of(rows.into_iter()).expect("samples have matching pairs and others")
}
