//! Flow of a pair of sweeps by either metric, occupancy constancy (chapter 3) or distance of
//! features (4.9)-(4.14), with the same energy minimisation.

use super::network::{FEATURES, Flsf, SCORES};
use super::occupancy::{OccupancyMap, SIDE, WIDE};
use super::pairs::FlowPair;
use crate::learning::FeatureMap;
use raywake::backend::Tables;
use raywake_core::params::{LINE, Profile, REACH, ROW, SIDE as SEARCH};
use raywake_core::prepare::uniform_of;
use raywake_core::record::{Flow, MinCost, NONE, Proposal, SweepUniform, VALID, flow_displacement};
use raywake_core::stages::background_filter::background_filter_by_bytes;
use raywake_core::stages::flow::{expectation_by_rings::propose, maximisation::maximisation};
use raywake_core::stages::occupancy_constancy::occupancy_constancy_by_lines;
use raywake_core::stages::window::{Costs, WindowCosts, least};

/// Rounds of either minimisation (n_em, sections 3.8.1 and 4.5).
const ROUNDS: usize = 20;
/// Weight of the smoothing term, thousandths per cell² (w_p = 0.07, section 4.5).
const SMOOTHING: i32 = 70;
/// Thousandths per unit of distance.
const THOUSAND: f32 = 1000.0;

/// The flow of least energy.
pub struct Matched {
    /// Cells that take part, ascending.
    foreground: Vec<u32>,
    /// Flow of every cell of the window; 0 if it has none.
    flow: Vec<Flow>,
}

impl Matched {
    /// Displacement of a cell, in cells.
    pub fn displacement(&self, cell: usize) -> Option<[i32; 2]> {
        let flow = self.flow[cell];
        (flow & VALID != 0).then(|| flow_displacement(flow))
    }

    /// Whether a cell takes part.
    pub fn takes(&self, cell: usize) -> bool {
        self.foreground.binary_search(&(cell as u32)).is_ok()
    }

    /// Minimises the energy of some cells with a row of costs each.
    fn minimised(foreground: Vec<u32>, costs: &[[u16; ROW]], step: &SweepUniform) -> Matched {
        let mut flow = vec![0; SIDE * SIDE];
        let mut energies = vec![NONE; SIDE * SIDE];
        let mut winners = vec![NONE; SIDE * SIDE];
        let cells = || foreground.iter().zip(costs);
        let lowest: Vec<MinCost> = cells().map(|(n, row)| least(step, *n, row)).collect();
        for _ in 0..ROUNDS {
            let proposals: Vec<Proposal> = cells()
                .zip(&lowest)
                .map(|((n, row), lowest)| propose(step, *n, row, *lowest, &flow, &energies))
                .collect();
            energies.fill(NONE);
            winners.fill(NONE);
            maximisation(step, &foreground, &proposals, &mut energies, &mut winners, &mut flow);
        }
        Matched { foreground, flow }
    }
}

/// Index of a displacement in a row.
pub fn place([u, v]: [i32; 2]) -> usize {
    (u + REACH) as usize * LINE + (v + REACH) as usize
}

/// The flow of chapter 3.
pub struct Constancy {
    tables: Tables,
    step: SweepUniform,
}

impl Constancy {
    /// With these tables and the parameters of the dissertation's profile.
    pub fn new(tables: Tables) -> Constancy {
        let profile = Profile::dissertation();
        assert_eq!(profile.side as usize, SIDE, "one window for both");
        let step = SweepUniform {
            score_min: tables.scores.min,
            smoothing: profile.smoothing as i32,
            displacement_cost: profile.displacement_cost as i32,
            outside_cost: profile.outside_cost as i32,
            ..uniform_of(&profile, 0)
        };
        Constancy { tables, step }
    }

    /// Flow of the columns that the background filter keeps.
    pub fn flow(&self, pair: &FlowPair) -> Matched {
        let mut marks = vec![0; SIDE * SIDE];
        background_filter_by_bytes(&self.step, &self.tables.filter, &pair.columns[0], &mut marks);
        let foreground: Vec<u32> =
            (0..).zip(&marks).filter(|(_, m)| **m != 0).map(|(n, _)| n).collect();
        let [_, costs] = self.costs(pair, &foreground);
        Matched::minimised(foreground, &costs, &self.step)
    }

    /// Costs of some columns, each alone and with its window (3.13).
    pub fn costs(&self, pair: &FlowPair, foreground: &[u32]) -> [Vec<[u16; ROW]>; 2] {
        let mut rank = vec![NONE; SIDE * SIDE];
        (0..).zip(foreground).for_each(|(n, cell)| rank[*cell as usize] = n);
        let mut alone = vec![[0; ROW]; foreground.len()];
        let [before, now] = &pair.columns;
        let (weights, costs) = (&self.tables.constancy, &self.tables.costs);
        let pairs = alone.as_flattened_mut();
        occupancy_constancy_by_lines(&self.step, weights, costs, foreground, before, now, pairs);
        let mut around = vec![[0; ROW]; foreground.len()];
        for (row, cell) in around.iter_mut().zip(foreground) {
            WindowCosts::of(&self.step, &rank, pairs, *cell).fill_row(row);
        }
        [alone, around]
    }
}

/// The flow of chapter 4.
pub struct Features {
    network: Flsf,
    numbers: Vec<f32>,
}

/// The network's output for a sweep.
#[derive(Clone)]
pub struct Encoded {
    /// Encodings, one cell more on each side than the window.
    features: FeatureMap,
    /// Scores of the window's cells.
    scores: FeatureMap,
}

impl Encoded {
    /// The encoding of a cell of the window.
    pub fn of(&self, cell: usize) -> &[f32] {
        self.features.cell(cell / SIDE + 1, cell % SIDE + 1)
    }

    /// Whether a cell takes part: it is foreground with a probability of at least a half.
    fn takes(&self, cell: usize) -> bool {
        let scores = self.scores.cell(cell / SIDE, cell % SIDE);
        scores[1] >= scores[0]
    }
}

impl Features {
    /// With trained parameters.
    pub fn new(numbers: Vec<f32>) -> Features {
        Features { network: Flsf::new(false), numbers }
    }

    /// Encodes a sweep, half of it on each of two threads.
    pub fn encode(&self, map: &OccupancyMap) -> Encoded {
        let (of_encoder, of_classifier) = self.numbers.split_at(self.network.encoder.numbers());
        let whole = map.whole();
        let narrower = WIDE - SIDE - 2;
        let rows = WIDE - narrower;
        let part = |from: usize, to: usize| {
            let row = WIDE * whole.channels;
            let values = whole.values[from * row..(to + narrower) * row].to_vec();
            let rows = to + narrower - from;
            self.network.encoder.apply(of_encoder, &FeatureMap { rows, values, ..whole })
        };
        let mut features = std::thread::scope(|scope| {
            let second = scope.spawn(|| part(rows / 2, rows));
            let mut first = part(0, rows / 2);
            let second = second.join().expect("a working thread panicked");
            first.values.extend(second.values);
            first
        });
        features.rows = rows;
        let scores = self.network.classifier.apply(of_classifier, &features);
        assert!(features.channels == FEATURES && scores.channels == SCORES);
        Encoded { features, scores }
    }

    /// Costs of some cells: distances of features (4.9).
    pub fn costs(&self, [first, second]: [&Encoded; 2], foreground: &[u32]) -> Vec<[u16; ROW]> {
        let mut costs = vec![[u16::MAX; ROW]; foreground.len()];
        for (row, &cell) in costs.iter_mut().zip(foreground) {
            let (cell, own) = (cell as usize, first.of(cell as usize));
            for n in 0..SEARCH * SEARCH {
                let step = [n / SEARCH, n % SEARCH].map(|d| d as i32 - REACH);
                let at = [cell / SIDE, cell % SIDE];
                let [i, j] = [0, 1].map(|a| at[a] as i32 + step[a]);
                if (0..SIDE as i32).contains(&i) && (0..SIDE as i32).contains(&j) {
                    let other = second.of(i as usize * SIDE + j as usize);
                    let squares = own.iter().zip(other).map(|(a, b)| (a - b) * (a - b));
                    let distance = THOUSAND * squares.sum::<f32>().sqrt();
                    // Rounded towards zero; saturates at the largest value.
                    row[place(step)] = distance as u16;
                }
            }
        }
        costs
    }

    /// Flow of the cells that are not the background (4.10)-(4.14).
    pub fn flow(&self, both: [&Encoded; 2]) -> Matched {
        let foreground: Vec<u32> =
            (0..(SIDE * SIDE) as u32).filter(|n| both[0].takes(*n as usize)).collect();
        let costs = self.costs(both, &foreground);
        let step = SweepUniform {
            smoothing: SMOOTHING,
            displacement_cost: 0,
            outside_cost: 0,
            ..uniform_of(&Profile::dissertation(), 0)
        };
        Matched::minimised(foreground, &costs, &step)
    }
}
