//! Weights files, in the format that `raywake_core::weights` reads.

use raywake_core::digest::Digest;

/// Maximum count of numbers on a line.
const LINE: usize = 32;

/// Weights as integers, `scale` per unit.
pub fn quantise(weights: &[f64], scale: f64) -> Vec<i32> {
    weights.iter().map(|w| (w * scale).round() as i32).collect()
}

/// Text of a file of `kind` and `shape`, whose last number is that of the levels: one line per
/// column of levels, then a line of what `weights` has beyond the shape, the biases. `provenance`
/// is one line.
pub fn text(kind: &str, shape: &[usize], scale: f64, weights: &[i32], provenance: &str) -> String {
    let (weights, biases) = weights.split_at(shape.iter().product());
    let shape_text: Vec<String> = shape.iter().map(usize::to_string).collect();
    let mut body = format!(
        "kind {kind}\nshape {}\nscale {scale}\nprovenance {provenance}\n",
        shape_text.join(" ")
    );
    let line = *shape.last().expect("a shape has levels");
    for levels in weights.chunks(line.min(LINE)).chain(biases.chunks(LINE)) {
        let line: Vec<String> = levels.iter().map(i32::to_string).collect();
        body += &line.join(" ");
        body.push('\n');
    }
    format!("raywake-weights 1\nchecksum {:016x}\n{body}", Digest::of(body.as_bytes()))
}
