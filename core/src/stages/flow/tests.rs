//! The rounds against equation (3.14) by brute force.

extern crate std;
use super::expectation::expectation;
use super::expectation_by_rings::expectation_by_rings;
use super::maximisation::{maximisation, target};
use crate::params::{LINE, REACH, ROW};
use crate::record::{
    Flow, MinCost, NONE, Proposal, SweepUniform, VALID, flow_displacement, pack_flow,
};
use crate::stages::window::{Costs, WindowCosts, outside_cost, window};
use std::vec;
use std::vec::Vec;

/// Equation 3.14 and sections 3.5.2.1-2 by brute force: every sum written out, no pruning.
fn brute_force(
    sweep: &SweepUniform,
    rounds: u32,
    foreground: &[u32],
    matching: &[u16],
) -> Vec<Flow> {
    let side = sweep.side;
    let mut flows: Vec<Option<[i32; 2]>> = vec![None; (side * side) as usize];
    let mut e_hat: Vec<Option<i64>> = vec![None; (side * side) as usize];
    for _ in 0..rounds {
        let mut chosen = Vec::new();
        for (n, &c) in foreground.iter().enumerate() {
            let (i, j) = (c as i32 / side, c as i32 % side);
            let mut best: Option<(i64, [i32; 2])> = None;
            for index in 0..ROW as i32 {
                let d = [index / LINE as i32 - REACH, index % LINE as i32 - REACH];
                let (ti, tj) = (i + d[0], j + d[1]);
                if d[1] > REACH || !(0..side).contains(&ti) || !(0..side).contains(&tj) {
                    continue;
                }
                let mut e = matching[n * ROW + index as usize] as i64
                    + outside_cost(sweep, c as usize) as i64
                    + (sweep.displacement_cost * (d[0] * d[0] + d[1] * d[1])) as i64;
                for pi in (i - 2).max(0)..=(i + 2).min(side - 1) {
                    for pj in (j - 2).max(0)..=(j + 2).min(side - 1) {
                        if let (true, Some(s)) =
                            ((pi, pj) != (i, j), flows[(pi * side + pj) as usize])
                        {
                            let q = (d[0] - s[0]).pow(2) + (d[1] - s[1]).pow(2);
                            e += (sweep.smoothing * q) as i64;
                        }
                    }
                }
                let feasible = e_hat[(ti * side + tj) as usize].is_none_or(|h| e < h)
                    || flows[c as usize] == Some(d);
                if feasible && best.is_none_or(|(b, _)| e < b) {
                    best = Some((e, d));
                }
            }
            chosen.push(best);
        }
        let mut winner: Vec<Option<(i64, usize)>> = vec![None; flows.len()];
        for (n, best) in chosen.iter().enumerate() {
            if let Some((e, d)) = best {
                let t = &mut winner[target(sweep, foreground[n], *d)];
                if t.is_none_or(|(w, _)| *e < w) {
                    *t = Some((*e, n));
                }
            }
        }
        e_hat = winner.iter().map(|w| w.map(|w| w.0)).collect();
        flows.fill(None);
        for (_, n) in winner.iter().flatten() {
            flows[foreground[*n] as usize] = chosen[*n].map(|c| c.1);
        }
    }
    flows.iter().map(|f| f.map_or(0, pack_flow)).collect()
}

type Expectation =
    fn(&SweepUniform, &[u32], &[u32], &[u16], &[Flow], &[u32], &[MinCost], &mut [Proposal]);

/// The rounds as in [`crate::stages::FLOW`].
fn run(
    step: Expectation,
    sweep: &SweepUniform,
    rounds: u32,
    [foreground, rank]: [&[u32]; 2],
    costs: &[u16],
) -> Vec<Flow> {
    let columns = (sweep.side * sweep.side) as usize;
    let (mut flows, mut energy) = (vec![0; columns], vec![NONE; columns]);
    let mut proposal = vec![[0; 2]; foreground.len()];
    let mut least = vec![[0; 2]; foreground.len()];
    window(sweep, foreground, rank, costs, &mut least);
    for _ in 0..rounds {
        step(sweep, foreground, rank, costs, &flows, &energy, &least, &mut proposal);
        energy.fill(NONE);
        let mut index = vec![NONE; columns];
        maximisation(sweep, foreground, &proposal, &mut energy, &mut index, &mut flows);
    }
    flows
}

#[test]
fn equals_brute_force() {
    for (seed, share, outside) in [(1u64, 3, 693), (2, 1, 693), (3, 2, 17_289), (4, 9, 693)] {
        let mut state = seed;
        let mut random = |n: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) % n
        };
        let sweep = SweepUniform {
            side: 37,
            smoothing: 1000,
            displacement_cost: 1,
            outside_cost: outside,
            ..Default::default()
        };
        let foreground: Vec<u32> = (0..37 * 37).filter(|_| random(share) == 0).collect();
        // Costs with few distinct values, so that ties are common, and a preferred displacement for
        // each half.
        let costs: Vec<u16> = (0..foreground.len() * ROW)
            .map(|n| {
                let liked = n % ROW == if 2 * n < foreground.len() * ROW { 500 } else { 333 };
                (if liked { random(3) * 200 } else { 500 + random(12) * 175 }) as u16
            })
            .collect();
        let mut rank = vec![NONE; 37 * 37];
        foreground.iter().enumerate().for_each(|(n, c)| rank[*c as usize] = n as u32);
        let mut matching = vec![[0; ROW]; foreground.len()];
        for (column, row) in foreground.iter().zip(&mut matching) {
            WindowCosts::of(&sweep, &rank, &costs, *column).fill_row(row);
        }
        let mut flows = vec![];
        for rounds in [1, 2, 6, 20] {
            let wanted = brute_force(&sweep, rounds, &foreground, matching.as_flattened());
            for step in [expectation as Expectation, expectation_by_rings] {
                flows = run(step, &sweep, rounds, [&foreground, &rank], &costs);
                assert!(flows == wanted, "seed {seed}, {rounds} rounds");
            }
        }
        let valid = flows.iter().filter(|f| **f & VALID != 0).count();
        assert!(valid * 2 > foreground.len(), "the case says something");
        let d = flows.iter().filter(|f| **f & VALID != 0).map(|f| flow_displacement(*f));
        assert!(d.collect::<std::collections::HashSet<_>>().len() > 1);
    }
}
