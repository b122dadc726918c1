//! The weights file of the background filter, as `raywake_core::weights` reads it.

use super::features::{LEVELS, expand};
use raywake_core::background_filter::PATCH;
use raywake_core::digest::Digest;
use std::fmt::Write;

/// Integers per unit.
pub const SCALE: f64 = 1000.0;

/// Weights as integers, bias last.
pub fn quantise(weights: &[f64]) -> Vec<i32> {
    weights.iter().map(|w| (w * SCALE).round() as i32).collect()
}

/// Text of the file, from integer weights per orbit, bias last.
pub fn text(weights: &[i32], provenance: &str) -> String {
    let (bias, weights) = weights.split_last().expect("there is a bias");
    let mut body = format!(
        "kind background\nshape {} 2 {LEVELS}\nscale {SCALE}\nprovenance {provenance}\n",
        PATCH * PATCH
    );
    for levels in expand(weights).chunks(LEVELS) {
        let line: Vec<String> = levels.iter().map(i32::to_string).collect();
        body += &line.join(" ");
        body.push('\n');
    }
    let _ = writeln!(body, "{bias}");
    format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::features::{WIDTH, features};
    use raywake_core::background_filter::{TABLE_WORDS, load, score};
    use raywake_core::record::{Column, Step};

    #[test]
    fn read_back_with_identical_scores() {
        let mut rng = raywake_sim::Rng::new(3);
        let weights: Vec<f64> = (0..WIDTH + 1).map(|_| rng.range(-2.0, 2.0)).collect();
        let weights = quantise(&weights);
        let mut table = vec![0; TABLE_WORDS];
        load(&text(&weights, "test"), LEVELS, &mut table).unwrap();
        let step = Step { side: 7, levels: 14, ..Default::default() };
        let columns: Vec<Column> = (0..49)
            .map(|_| {
                let free = rng.bits() as u32 & 0x3fff;
                [free | (!free & rng.bits() as u32 & 0x3fff) << 16, 1]
            })
            .collect();
        for index in 0..49 {
            let row = features(&step, &columns, index);
            let sum: i32 = row.iter().zip(&weights).map(|(x, w)| i32::from(*x) * w).sum();
            assert_eq!(score(&step, &table, &columns, index), sum + weights[WIDTH]);
        }
    }
}
