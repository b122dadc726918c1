//! Results of both methods for the pairs of the drives, against the labels.

use super::distances::{Distances, moving};
use super::matching::{Constancy, Encoded, Features, Matched, place};
use super::occupancy::{SIDE, wide_grid};
use super::pairs::{CellOwner, FlowPair, TwoSweeps};
use super::tally::{Errors, METHODS, Tally};
use crate::labels::Kind;
use crate::train::drives::Labelled;
use raywake_core::params::{REACH, SIDE as SEARCH};
use raywake_io::Error;
use raywake_sim::Rng;
use std::collections::BTreeMap;
use std::time::Instant;

/// Total time of each method over all pairs, s.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Occupancy constancy: costs and minimisation.
    pub constancy: f64,
    /// The network, one sweep per pair.
    pub encoder: f64,
    /// Distances and minimisation.
    pub features: f64,
}

/// A pair of cells, whether the first went to the second, and the costs by each metric: constancy
/// of the column alone, of its window, and distance of features; the lower the more likely.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    /// Whether it went there.
    pub matching: bool,
    /// Cost by each metric.
    pub costs: [f64; 3],
}

/// Kinds shown in figures 4.6 and 4.7.
pub const PICTURED: [Kind; 2] = [Kind::Car, Kind::Pedestrian];

/// Results over all drives.
#[derive(Default)]
pub struct Outcome {
    /// Pairs of sweeps.
    pub pairs: usize,
    /// Counted as in chapter 3, and as in chapter 4's program.
    pub tallies: [Tally; 2],
    /// For figure 4.8.
    pub compared: Vec<Compared>,
    /// Over all pairs.
    pub seconds: Seconds,
    /// For figures 4.6 and 4.7: from the pair with most moving cells of a kind.
    pub distances: BTreeMap<Kind, Distances>,
}

/// Processes all pairs of a drive.
pub fn walk(
    drive: &mut dyn Labelled,
    count: Option<usize>,
    methods: &(Constancy, Features),
    rng: &mut Rng,
    outcome: &mut Outcome,
) -> Result<(), Error> {
    let mut grid = wide_grid();
    let mut sweeps = TwoSweeps::default();
    let mut last: Option<Encoded> = None;
    let count = count.map_or(drive.len(), |n| drive.len().min(n));
    for index in 0..count.saturating_sub(1) {
        let Some(pair) = FlowPair::read(&mut grid, drive, index, &mut sweeps)? else {
            last = None;
            continue;
        };
        last = Some(outcome.add(&pair, methods, last.take(), rng));
    }
    Ok(())
}

impl Outcome {
    /// Adds a pair of sweeps; `first` is the network's output for its first sweep, if known.
    /// Returns that for the second.
    fn add(
        &mut self,
        pair: &FlowPair,
        (constancy, features): &(Constancy, Features),
        first: Option<Encoded>,
        rng: &mut Rng,
    ) -> Encoded {
        let first = first.unwrap_or_else(|| features.encode(&pair.maps[0]));
        let begin = Instant::now();
        let second = features.encode(&pair.maps[1]);
        self.seconds.encoder += begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let learned = features.flow([&first, &second]);
        self.seconds.features += begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        let printed = constancy.flow(pair);
        self.seconds.constancy += begin.elapsed().as_secs_f64();
        self.pairs += 1;
        self.count(pair, [&printed, &learned]);
        let sources: Vec<u32> = pair.sources().into_iter().map(|n| n as u32).collect();
        let costs = constancy.costs(pair, &sources);
        let distances = features.costs([&first, &second], &sources);
        self.look(pair, features, [&first, &second]);
        for (n, &source) in sources.iter().enumerate() {
            let Some((step, matching)) = drawn(pair, source as usize, rng) else { continue };
            let costs = [&costs[0], &costs[1], &distances].map(|c| c[n][place(step)].into());
            self.compared.push(Compared { matching, costs });
        }
        second
    }

    /// Keeps the distances around moving cells, if there are more of them than before.
    fn look(&mut self, pair: &FlowPair, features: &Features, both: [&Encoded; 2]) {
        for kind in PICTURED {
            let cells = moving(pair, kind);
            if cells.len() > self.distances.get(&kind).map_or(0, |d| d.cells) {
                self.distances.insert(kind, Distances::of(pair, &cells, features, both));
            }
        }
    }

    /// Counts the errors of every solid cell of an object.
    fn count(&mut self, pair: &FlowPair, methods: [&Matched; 2]) {
        for (n, cell) in pair.cells.iter().enumerate().filter(|(_, c)| c.solid) {
            let (CellOwner::Object(object), Some(truth)) = (cell.owner, cell.displacement) else {
                continue;
            };
            let object = pair.objects[usize::from(object)];
            let Some(speed_mps) = object.speed_mps else { continue };
            let error = |flow: [f32; 2]| {
                let off = [0, 1].map(|a| f64::from(flow[a] - truth[a]));
                0.3 * off[0].hypot(off[1])
            };
            let flow = |m: &Matched| m.displacement(n).map(|d| d.map(|d| d as f32));
            let references = [error([0.0; 2]), error(cell.odometry), error(truth.map(f32::round))];
            let filled = methods.map(|m| Some(error(flow(m).unwrap_or(cell.odometry))));
            let valid = methods.map(|m| flow(m).filter(|_| m.takes(n)).map(error));
            for (tally, own) in self.tallies.iter_mut().zip([filled, valid]) {
                let errors: Errors = std::array::from_fn(|method| match method {
                    n if n < references.len() => Some(references[n]),
                    n => own[n - references.len()],
                });
                const { assert!(METHODS.len() == 5) };
                tally.add(object.kind, speed_mps, errors);
            }
        }
    }
}

/// A displacement of a source: half the time the true one, otherwise any other within the window.
fn drawn(pair: &FlowPair, source: usize, rng: &mut Rng) -> Option<([i32; 2], bool)> {
    let inside = |step: [i32; 2]| {
        let at = [source / SIDE, source % SIDE];
        [0, 1].iter().all(|&a| (0..SIDE as i32).contains(&(at[a] as i32 + step[a])))
    };
    let truth = pair.step(source).filter(|step| inside(*step))?;
    if rng.chance(0.5) {
        return Some((truth, true));
    }
    loop {
        let step = [(); 2].map(|()| (rng.bits() as usize % SEARCH) as i32 - REACH);
        if step != truth && inside(step) {
            return Some((step, false));
        }
    }
}
