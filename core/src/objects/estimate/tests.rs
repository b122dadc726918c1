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
        ("diss 3000", EstimateParams { model: 3000, ..EstimateParams::dissertation() }),
        ("default", d),
        ("no starts", EstimateParams { starts: false, ..d }),
        ("no surfaces", EstimateParams { surfaces: false, ..d }),
        ("no robust", EstimateParams { robust: 0.0, ..d }),
        ("no damping", EstimateParams { damping: false, ..d }),
        ("no stages", EstimateParams { stages: 0, ..d }),
    ];
    let mut estimator = Box::new(Estimator::new());
    for (set, plan) in
        [("parked", synthetic::parked as fn(u64) -> synthetic::Plan), ("moving", synthetic::moving)]
    {
        let drives: Vec<_> = (0..24).map(|seed| drive(plan(seed))).collect();
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
