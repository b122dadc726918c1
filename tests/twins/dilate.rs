//! The grown foreground.

use raywake_core::stages::grid::dilate::dilate;
use raywake_gpu::Kernel;
use raywake_kernels::kernel::DILATE;
use raywake_tests::bench::Bench;
use raywake_tests::random::Random;

use super::{POISON, window};

pub const KERNELS: &[&Kernel] = &[&DILATE];

#[test]
fn marks_of_every_density() {
    let mut random = Random::new(70);
    for side in [1, 15, 16, 17, 255] {
        for share in [1, 5, 100] {
            let count = (side * side) as usize;
            let marks: Vec<u32> = (0..count).map(|_| (random.below(share) == 0) as u32).collect();
            let mut dilated = vec![POISON; count];
            let sweep = window(side, 14);
            let bench = Bench::new(Some(&sweep))
                .buffer("foreground_marks", marks.clone())
                .buffer("dilated_marks", dilated.clone())
                .threads(&DILATE, count);
            dilate(&sweep, &marks, &mut dilated);
            if let Some(outcome) = bench.run() {
                outcome.check(&format!("side {side}"), &[("dilated_marks", &dilated)]);
            }
        }
    }
}
