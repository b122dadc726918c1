use super::network::FeatureTape;
use super::*;
use raywake_sim::Rng;

fn network(activations: [Activation; 2], dropout: f64) -> FeatureNetwork {
    let layer =
        |kernel, inputs, outputs, activation| Convolution { kernel, inputs, outputs, activation };
    let [first, second] = activations;
    FeatureNetwork { layers: vec![layer(3, 2, 3, first), layer(2, 3, 2, second)], dropout }
}

fn drawn(rng: &mut Rng, count: usize) -> Vec<f32> {
    (0..count).map(|_| rng.range(-1.0, 1.0) as f32).collect()
}

/// Weighted sum of the output.
fn of_output(tape: &FeatureTape, weights: &[f32]) -> f64 {
    tape.output().values.iter().zip(weights).map(|(v, w)| f64::from(v * w)).sum()
}

/// Every gradient, of the numbers and of the input, matches its central difference.
#[test]
fn gradients_are_central_differences() {
    use Activation::*;
    for (kinds, dropout) in
        [([Tanh, Sigmoid], 0.0), ([LeakyRelu(0.2), Linear], 0.0), ([Tanh, LeakyRelu(0.2)], 0.2)]
    {
        let network = network(kinds, dropout);
        let mut rng = Rng::new(5);
        let numbers = network.drawn(&mut rng);
        let input = FeatureMap { rows: 6, columns: 5, channels: 2, values: drawn(&mut rng, 60) };
        let weights = drawn(&mut rng, 3 * 2 * 2);
        let with = |numbers: &[f32], input: &FeatureMap| {
            of_output(&network.forward(numbers, input.clone(), &mut Rng::new(9)), &weights)
        };
        let tape = network.forward(&numbers, input.clone(), &mut Rng::new(9));
        let mut slope = vec![0.0; network.numbers()];
        let below = network
            .backward(&numbers, &tape, weights.clone(), &mut slope, true)
            .expect("asked for");
        let close = |slope: f32, more: f64, less: f64, what: &str| {
            let wanted = (more - less) / 2e-3;
            let off = (f64::from(slope) - wanted).abs();
            assert!(off < 2e-3 + 5e-3 * wanted.abs(), "{kinds:?}, {what}: {slope}, {wanted}");
        };
        let moved = |values: &[f32], n: usize, by: f32| {
            let mut values = values.to_vec();
            values[n] += by;
            values
        };
        for (n, own) in slope.iter().enumerate() {
            let at = |by| with(&moved(&numbers, n, by), &input);
            close(*own, at(1e-3), at(-1e-3), "number");
        }
        for (n, own) in below.iter().enumerate() {
            let at = |by| {
                with(&numbers, &FeatureMap { values: moved(&input.values, n, by), ..input.clone() })
            };
            close(*own, at(1e-3), at(-1e-3), "input");
        }
    }
}

#[test]
fn a_convolution_by_hand() {
    let layer = Convolution { kernel: 2, inputs: 1, outputs: 1, activation: Activation::Linear };
    let x = FeatureMap { rows: 2, columns: 3, channels: 1, values: vec![1., 2., 3., 4., 5., 6.] };
    let out = layer.forward(&[1.0, 10.0, 100.0, 1000.0, 0.5], &x);
    assert_eq!((out.rows, out.columns), (1, 2));
    assert_eq!(out.values, [1.0 + 20.0 + 400.0 + 5000.5, 2.0 + 30.0 + 500.0 + 6000.5]);
    assert_eq!(out.cell(0, 1), [6532.5]);
}

#[test]
fn applied_is_forward_without_dropout() {
    let network = network([Activation::Tanh, Activation::Linear], 0.0);
    let mut rng = Rng::new(1);
    let numbers = network.drawn(&mut rng);
    let input = FeatureMap { rows: 7, columns: 7, channels: 2, values: drawn(&mut rng, 98) };
    let tape = network.forward(&numbers, input.clone(), &mut rng);
    assert_eq!(*tape.output(), network.apply(&numbers, &input));
}

#[test]
fn dropout_drops_a_fifth_and_preserves_the_mean() {
    let network = FeatureNetwork { layers: Vec::new(), dropout: 0.2 };
    let input = FeatureMap::row(1, vec![1.0; 100_000]);
    let out = network.forward(&[], input, &mut Rng::new(3));
    let values = &out.output().values;
    let zeros = values.iter().filter(|v| **v == 0.0).count();
    assert!((19_000..21_000).contains(&zeros), "{zeros}");
    let mean = values.iter().sum::<f32>() / 1e5;
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
}

/// (4.6) on either side of its kinks.
#[test]
fn loss_of_a_pair() {
    let loss = |b: f32, matching| pair_loss(&[0.0, 0.0], &[b, 0.0], matching, 5.0);
    assert_eq!(loss(3.0, true), (3.0, 1.0 / 3.0));
    assert_eq!(loss(3.0, false), (2.0, -1.0 / 3.0));
    assert_eq!(loss(5.0, false), (0.0, 0.0));
    assert_eq!(loss(6.0, false), (0.0, 0.0));
    assert!(loss(4.999, false).0 < 0.002 && loss(4.999, false).1 < 0.0);
    for matching in [true, false] {
        let (value, factor) = loss(0.0, matching);
        assert!(value.is_finite() && factor.is_finite());
    }
}

#[test]
fn loss_of_a_class() {
    let mut slope = [0.0; 3];
    let loss = cross_entropy(&[1.0, 1.0, 1.0], 2, 2.0, &mut slope);
    assert!((loss - 2.0 * 3f32.ln()).abs() < 1e-6);
    let wanted = [2.0 / 3.0, 2.0 / 3.0, -4.0 / 3.0];
    assert!(slope.iter().zip(wanted).all(|(s, w)| (s - w).abs() < 1e-6), "{slope:?}");
}

/// A single pair can be pulled together and pushed apart.
#[test]
fn one_pair_is_learned() {
    let network = network([Activation::LeakyRelu(0.2), Activation::LeakyRelu(0.2)], 0.0);
    for (matching, wanted) in [(true, 0.0), (false, 10.0)] {
        let mut rng = Rng::new(2);
        let mut numbers = network.drawn(&mut rng);
        let mut state = Adam::new(numbers.len());
        let inputs = [(); 2].map(|()| FeatureMap {
            rows: 4,
            columns: 4,
            channels: 2,
            values: drawn(&mut rng, 32),
        });
        let mut loss = f32::MAX;
        for _ in 0..400 {
            let tapes = inputs.clone().map(|x| network.forward(&numbers, x, &mut rng));
            let [a, b] = tapes.each_ref().map(|t| t.output().values.as_slice());
            let (now, factor) = pair_loss(a, b, matching, 10.0);
            loss = now;
            let slope: Vec<f32> = a.iter().zip(b).map(|(a, b)| factor * (a - b)).collect();
            let other = slope.iter().map(|s| -s).collect();
            let mut total = vec![0.0; numbers.len()];
            network.backward(&numbers, &tapes[0], slope, &mut total, false);
            network.backward(&numbers, &tapes[1], other, &mut total, false);
            state.advance(&mut numbers, &total, 0.02);
        }
        assert!(loss < 0.2, "{loss} for a distance of {wanted}");
    }
}

#[test]
fn first_steps_of_adam() {
    let (mut state, mut numbers) = (Adam::new(2), [1.0, 2.0]);
    state.advance(&mut numbers, &[0.5, -3.0], 0.1);
    // Whatever its size, the first gradient makes a step of length `rate`.
    assert!((numbers[0] - 0.9).abs() < 1e-6 && (numbers[1] - 2.1).abs() < 1e-6, "{numbers:?}");
}
