//! Generated weights files.

use raywake_core::digest::Digest;
use std::fmt::Write;

use crate::random::Random;

/// A weights file with as many values as its shape requires, plus the bias.
pub fn file(
    kind: &str,
    shape: &[usize],
    scale: u32,
    bias: i32,
    mut value: impl FnMut() -> i32,
) -> String {
    let shape_text: Vec<_> = shape.iter().map(usize::to_string).collect();
    let mut body =
        format!("kind {kind}\nshape {}\nscale {scale}\nprovenance test\n", shape_text.join(" "));
    for _ in 0..shape.iter().product::<usize>() {
        // Writing to a string cannot fail.
        let _ = writeln!(body, "{}", value());
    }
    let _ = writeln!(body, "{bias}");
    format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
}

/// A background filter with weights up to `most` and the given bias.
pub fn filter(seed: u64, levels: usize, most: i32, bias: i32) -> String {
    let mut random = Random::new(seed);
    file("background", &[25, 2, levels], 1000, bias, || random.between(-most, most))
}

/// A background filter that keeps nothing.
pub fn closed_filter(levels: usize) -> String {
    file("background", &[25, 2, levels], 1000, -1, || 0)
}

/// A background filter that keeps columns with something more than 0.7 m above the ground, on a
/// grid of 0.3 m whose centre lies 1.73 m above it.
pub fn tall_filter(levels: usize) -> String {
    let mut at = 0;
    let values = || {
        let [patch, occupied, level] = [at / (2 * levels), at / levels % 2, at % levels];
        at += 1;
        let centre = patch == 12 && occupied == 1;
        if centre && level >= levels / 2 - 3 { 1000 } else { 0 }
    };
    file("background", &[25, 2, levels], 1000, -1, values)
}

/// A constancy classifier with weights up to `most` hundredths.
pub fn constancy(seed: u64, levels: usize, most: i32) -> String {
    let mut random = Random::new(seed);
    let bias = random.between(-most, most);
    file("constancy", &[3, levels], 100, bias, || random.between(-most, most))
}
