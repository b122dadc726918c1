//! Losses of chapter 4, with their gradients.

/// Added to a squared distance so that its root has a gradient at zero, too.
const NEAR: f32 = 1e-12;

/// Loss of a pair of features (4.2), (4.6): their distance if they match, otherwise what it falls
/// short of `d_max`. Also returns the factor that turns their difference into the gradient with
/// respect to the first; that with respect to the second is its negative.
pub fn pair_loss(first: &[f32], second: &[f32], matching: bool, d_max: f32) -> (f32, f32) {
    let squares = first.iter().zip(second).map(|(a, b)| (a - b) * (a - b));
    let distance = (squares.sum::<f32>() + NEAR).sqrt();
    match matching {
        true => (distance, 1.0 / distance),
        false if distance < d_max => (d_max - distance, -1.0 / distance),
        false => (0.0, 0.0),
    }
}

/// Weighted softmax cross-entropy of a row of scores for class `class`; adds its gradient to
/// `slope`.
pub fn cross_entropy(scores: &[f32], class: usize, weight: f32, slope: &mut [f32]) -> f32 {
    let top = scores.iter().fold(f32::MIN, |a, b| a.max(*b));
    let sum: f32 = scores.iter().map(|s| libm::expf(s - top)).sum();
    for (n, (score, slope)) in scores.iter().zip(slope).enumerate() {
        let is = f32::from(u8::from(n == class));
        *slope += weight * (libm::expf(score - top) / sum - is);
    }
    weight * (libm::logf(sum) - (scores[class] - top))
}
