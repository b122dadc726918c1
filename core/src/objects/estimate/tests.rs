extern crate std;

use super::synthetic::{self, Errors, drive, errors, history_errors};
use super::*;
use std::boxed::Box;
use std::vec::Vec;
use std::{println, time::Instant};

fn root_mean(all: &[Errors]) -> Errors {
    core::array::from_fn(|i| {
        (all.iter().map(|e| e[i] * e[i]).sum::<f64>() / all.len() as f64).sqrt()
    })
}

#[test]
#[ignore = "an experiment: prints the errors of variants"]
fn experiment() {
    let d = EstimateParams::default();
    let variants = [
        ("dissertation", EstimateParams::dissertation()),
        ("default", d),
        ("default it 5", EstimateParams { iterations: 5, ..d }),
        ("stages 1 it 6", EstimateParams { iterations: 6, stages: 1, ..d }),
        ("robust 5", EstimateParams { robust: 5.0, ..d }),
        ("undamped", EstimateParams { damping: false, ..d }),
    ];
    let mut estimator = Box::new(Estimator::new());
    for (set, plan) in
        [("parked", synthetic::parked as fn(u64) -> synthetic::Plan), ("moving", synthetic::moving)]
    {
        let drives: Vec<synthetic::Drive> = (0..16).map(|seed| drive(plan(seed))).collect();
        let counts: Vec<usize> = drives.iter().map(|d| d.returns.len()).collect();
        println!("{set} {counts:?}");
        let base: Vec<Errors> = drives.iter().map(history_errors).collect();
        println!("{:14} {:.3?}", "history", root_mean(&base));
        for (name, params) in &variants {
            let (mut all, mut iterations, mut rest) = (Vec::new(), 0, 0);
            let start = Instant::now();
            for drive in &drives {
                let report = estimator.solve(params, &drive.returns, &drive.history);
                iterations += report.iterations;
                rest += usize::from(report.from_rest);
                all.push(errors(&drive.truth, |time| estimator.state(time)));
            }
            let better = all.iter().zip(&base).filter(|(a, b)| a[0] < b[0]).count();
            let ms = start.elapsed().as_secs_f64() * 1e3 / drives.len() as f64;
            println!(
                "{name:14} {:.3?} better {better} rest {rest} iterations {} {ms:.1} ms",
                root_mean(&all),
                iterations / drives.len()
            );
            if std::env::var("EACH").is_ok() {
                for (e, b) in all.iter().zip(&base) {
                    println!("    {e:.3?} {b:.3?}");
                }
            }
        }
    }
}

#[test]
#[ignore = "an experiment"]
fn from_truth() {
    let d = EstimateParams { ..EstimateParams::default() };
    let mut estimator = Box::new(Estimator::new());
    for seed in [2, 6, 8, 9, 10, 19, 23] {
        let drive = drive(synthetic::moving(seed));
        let a = estimator.solve(&d, &drive.returns, &drive.history);
        let ea = errors(&drive.truth, |time| estimator.state(time));
        let g = EstimateParams { grows: false, starts: false, ..d };
        let b = estimator.solve(&g, &drive.returns, &drive.truth);
        let eb = errors(&drive.truth, |time| estimator.state(time));
        let (ca, cb) = (a.costs.last().unwrap(), b.costs.last().unwrap());
        println!(
            "{seed} {:.3?} {ea:.3?} | {eb:.3?} | {:.0} {:.0} {:.3} | {:.0} {:.0} {:.3}",
            history_errors(&drive),
            ca.process,
            ca.returns,
            ca.residual_m,
            cb.process,
            cb.returns,
            cb.residual_m
        );
        if std::env::var("EACH").is_ok() {
            _ = estimator.solve(&d, &drive.returns, &drive.history);
            let mut last = 0;
            for (i, t) in drive.truth.iter().enumerate().step_by(4) {
                let e = estimator.state(t.time_s);
                let o = drive.returns[..].iter().filter(|r| f64::from(r.time_s) < t.time_s).count();
                let (s, c) = t.heading.sin_cos();
                let d = [e.position[0] - t.position[0], e.position[1] - t.position[1]];
                let r = drive.returns[last.min(drive.returns.len() - 1)];
                let h = [
                    f64::from(r.origin[0]) - t.position[0],
                    f64::from(r.origin[1]) - t.position[1],
                ];
                println!(
                    "  {i} {:.1} n {} along {:.2} across {:.2} up {:.2} sensor {:.1} {:.1}",
                    t.time_s,
                    o - last,
                    c * d[0] + s * d[1],
                    c * d[1] - s * d[0],
                    e.position[2],
                    c * h[0] + s * h[1],
                    c * h[1] - s * h[0]
                );
                last = o;
            }
        }
    }
}

#[test]
#[ignore = "timing"]
fn time_of_an_iteration() {
    let mut estimator = Box::new(Estimator::new());
    let drive = drive(synthetic::parked(1));
    let d = EstimateParams { ..EstimateParams::dissertation() };
    let start = Instant::now();
    let mut iterations = 0;
    for _ in 0..20 {
        iterations += estimator.solve(&d, &drive.returns, &drive.history).iterations;
    }
    println!("{:.3} ms per iteration", start.elapsed().as_secs_f64() * 1e3 / iterations as f64);
}

#[test]
#[ignore = "x"]
fn traced() {
    let mut estimator = Box::new(Estimator::new());
    for seed in [9, 19] {
        println!("SEED {seed}");
        let drive = drive(synthetic::moving(seed));
        for t in &drive.truth {
            println!(
                "T {:.3} {:.4} {:.4} {:.4} {:.4}",
                t.time_s, t.position[0], t.position[1], t.heading, t.speed
            );
        }
        _ = estimator.solve(&EstimateParams::default(), &drive.returns, &drive.history);
    }
}

#[test]
#[ignore = "an experiment"]
fn lagged() {
    let mut estimator = Box::new(Estimator::new());
    println!("{} bytes an object, {} the workspace", size_of::<FixedLag>(), size_of::<Estimator>());
    for (set, plan) in
        [("parked", synthetic::parked as fn(u64) -> synthetic::Plan), ("moving", synthetic::moving)]
    {
        let (mut all, mut base) = (Vec::new(), Vec::new());
        let (mut ms, mut sweeps, mut worst) = (0.0, 0, 0f64);
        for seed in 0..16 {
            let drive = drive(plan(seed));
            let mut lag = Box::new(FixedLag::new());
            let mut states = Vec::new();
            let mut from = 0;
            let mut history = drive.history.iter();
            for &until in &drive.until {
                if until == from {
                    continue;
                }
                let state = history.next().unwrap();
                let start = Instant::now();
                let params = EstimateParams::default();
                states.push(lag.push(&mut estimator, &params, &drive.returns[from..until], state));
                let took = start.elapsed().as_secs_f64() * 1e3;
                ms += took;
                worst = worst.max(took);
                sweeps += 1;
                from = until;
            }
            let drive_truth: Vec<ObjectState> =
                states.iter().skip(15).map(|s| drive.truth_at(s.time_s)).collect();
            let at = |time: f64| {
                *states
                    .iter()
                    .min_by(|a, b| (a.time_s - time).abs().total_cmp(&(b.time_s - time).abs()))
                    .unwrap()
            };
            let e = errors(&drive_truth, at);
            let late = synthetic::Drive {
                truth: drive.truth[15..].into(),
                history: drive.history,
                ..drive
            };
            let b = history_errors(&late);
            println!("  {e:.3?} {b:.3?} restarts {} model {}", lag.restarts(), lag.points());
            all.push(e);
            base.push(b);
        }
        println!(
            "{set} {:.3?} against {:.3?}, {:.3} ms a sweep, {worst:.3} at most",
            root_mean(&all),
            root_mean(&base),
            ms / f64::from(sweeps)
        );
    }
}
