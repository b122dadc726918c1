//! The network against its formulas, and against core's.

use super::network::Input;
use super::samples::Sample;
use super::*;
use crate::grid::Grid;
use crate::scratch::Scratch;
use crate::train::drives::{Labelled, LabelledSweep};
use crate::train::simulated::Simulated;
use raywake_core::encoder::{SHIPPED, could_move as nats};
use raywake_core::params::Profile;
use raywake_core::stages::background_filter::{self, TABLE_WORDS, score};
use raywake_core::sweep::{Rig, Sweep};
use raywake_sim::{Drive, Options, Path, SensorRig, State};
use std::collections::BTreeMap;

/// A window of a simulated street.
fn street() -> Sample {
    let options = Options { sweeps: 1, rig: SensorRig::vlp32x2(), ..Options::default() };
    let mut drive = Simulated::new(Drive::new(5, options));
    let mut grid = Grid::new(Profile::hdl64());
    let mut sweep = LabelledSweep::default();
    drive.read(0, &mut sweep).unwrap();
    samples::sample(&mut grid, &drive, &sweep)
}

/// A few of its columns.
fn few(sample: &Sample, side: usize) -> Sample {
    let from = (sample.side - side) / 2;
    let cells = || (0..side * side).map(|n| (from + n / side) * sample.side + from + n % side);
    Sample {
        side,
        corner: sample.corner.map(|c| c + from as i32),
        masks: cells().map(|c| sample.masks[c]).collect(),
        labels: cells().map(|c| sample.labels[c]).collect(),
    }
}

#[test]
fn gradients_are_those_of_central_differences() {
    let (input, labels) = few(&street(), 24).input();
    let mut state = Optimiser::new(3);
    // Biases above zero, so that few activations are clamped, where differences would step across
    // the kink.
    state.parameters.biases.iter_mut().for_each(|b| *b = 0.3);
    let network = Network::new(false);
    let of = |p: &Parameters| loss(network.forward(p, &input).scores(), &labels).0;
    let (_, slopes) = slope(&network, &state.parameters, (clone(&input), labels.clone()));
    for (n, layer) in LAYERS.iter().enumerate() {
        let [weights, biases] = before(n);
        let weights = (0..layer.inputs * layer.outputs).map(|w| weights + w);
        let largest = |of: &[f32], range: &mut dyn Iterator<Item = usize>| {
            range.max_by(|a, b| of[*a].abs().total_cmp(&of[*b].abs())).unwrap()
        };
        let weight = largest(&slopes.weights, &mut { weights });
        let bias = largest(&slopes.biases, &mut (biases..biases + layer.outputs));
        let differ = |change: &dyn Fn(&mut Parameters, f32)| {
            let [up, down] = [1e-3, -1e-3].map(|step| {
                let mut p = state.parameters.clone();
                change(&mut p, step);
                of(&p)
            });
            (up - down) / 2e-3
        };
        let by_weight = differ(&|p, step| p.weights[weight] += step);
        let by_bias = differ(&|p, step| p.biases[bias] += step);
        for (is, should) in [(slopes.weights[weight], by_weight), (slopes.biases[bias], by_bias)] {
            let off = (f64::from(is) - should).abs();
            assert!(off < 0.03 * should.abs() + 2e-4, "layer {n}: {is}, not {should}");
        }
    }
}

fn clone(input: &Input) -> Input {
    Input { side: input.side, masks: input.masks.clone(), asked: input.asked.clone() }
}

#[test]
fn rounded_it_is_core_s_bit_for_bit() {
    let sample = street();
    let mut state = Optimiser::new(8);
    let mut rng = Rng::new(4);
    state.parameters.biases.iter_mut().for_each(|b| *b = rng.range(-0.2, 0.4) as f32);
    state.choose_shifts();
    let (input, _) = sample.input();
    let tape = Network::new(true).forward(&state.rounded(), &input);
    let numbers = state.numbers();
    let mut weights = EncoderWeights::new();
    weights.load(&text("encoder", &[NUMBERS], 16.0, &numbers, "test"), LEVELS).unwrap();
    let mut encoder = raywake_alloc_guard::boxed!(Encoder, Encoder::new());
    encoder.set_weights(Some(&weights));
    encoder.keep(&sample.columns(), sample.side, sample.corner);
    encoder.encode(&SingleThread);
    let asked = (0..sample.labels.len()).filter(|c| sample.labels[*c] != UNKNOWN);
    let mut kinds = std::collections::BTreeSet::new();
    for (column, scores) in asked.zip(tape.scores()) {
        let is = encoder.scores()[column].map(|s| f32::from(s) / 16.0);
        assert!(is == *scores, "column {column}: {is:?}, not {scores:?}");
        kinds.insert(encoder.scores()[column]);
    }
    assert!(kinds.len() > 1000, "{} kinds of scores", kinds.len());
}

#[test]
fn training_overfits_one_window_and_can_be_interrupted() {
    let scratch = Scratch::new();
    let samples = [few(&street(), 40)];
    let file = scratch.path().join("checkpoint");
    let steps = 350;
    let (state, losses) = fit(&samples, steps, 1, Some(&file)).unwrap();
    assert!(losses[2] < 0.6 * losses[0], "{losses:?}");
    // Interrupted after the last checkpoint, it reaches the same end; other trainings reject the
    // file.
    let (again, _) = fit(&samples, steps, 1, Some(&file)).unwrap();
    assert!(again.numbers() == state.numbers());
    let error = |e: Result<_, Error>| e.map(|_: (Optimiser, _)| ()).unwrap_err().to_string();
    let other = error(fit(&samples, steps, 2, Some(&file)));
    assert!(other.contains("another training"), "{other}");
    let mut bytes = std::fs::read(&file).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    std::fs::write(&file, &bytes).unwrap();
    let damaged = error(fit(&samples, steps, 1, Some(&file)));
    assert!(damaged.contains("damaged"), "{damaged}");
    std::fs::write(&file, &bytes[..100]).unwrap();
    let short = error(fit(&samples, steps, 1, Some(&file)));
    assert!(short.contains("another length"), "{short}");
}

/// By column of the world, whether it is foreground: by the filter at its threshold, and by the
/// encoder at 0, from where it could move rather than not.
type Foreground = BTreeMap<[i32; 2], [bool; 2]>;

fn foreground(grid: &mut Grid, rig: &Rig, sweep: &Sweep) -> Foreground {
    let mut table = vec![0; TABLE_WORDS];
    background_filter::load(background_filter::SHIPPED, LEVELS, &mut table).unwrap();
    let mut encoder = raywake_alloc_guard::boxed!(Encoder, Encoder::new());
    encoder.load_weights(|weights| weights.load(SHIPPED, LEVELS)).unwrap();
    let window = grid.sweep(rig, sweep);
    let (side, corner) = (grid.step.side as usize, [window.corner[0], window.corner[1]]);
    encoder.keep(&grid.columns, side, corner);
    encoder.encode(&SingleThread);
    let solid = (0..side * side).filter(|c| grid.columns[*c][1] != 0);
    let of = |column: usize| {
        let at = [corner[0] + (column / side) as i32, corner[1] + (column % side) as i32];
        let by_filter = score(&grid.step, &table, &grid.columns, column) > 0;
        (at, [by_filter, nats(&encoder.scores()[column]) >= 0.0])
    };
    solid.map(of).collect()
}

/// Of the columns that are solid in both of two successive sweeps of a street in which nothing
/// moves, how many are foreground in one of them alone. At `could_move_min`, where almost nothing
/// is lost, more flip with the encoder than with the filter.
fn flipped(rig: &SensorRig, path: Path) -> [usize; 2] {
    let options = Options { sweeps: 2, rig: rig.clone(), ..Options::default() };
    let mut scene = Drive::new(11, options.clone()).scene().clone();
    scene.objects.retain(|o| o.path.is_static());
    let mut drive = Simulated::new(Drive::through(scene, path, 11, options));
    let (mut grid, mut sweep) = (Grid::new(Profile::hdl64()), LabelledSweep::default());
    let [first, second] = [0, 1].map(|index| {
        drive.read(index, &mut sweep).unwrap();
        foreground(&mut grid, drive.rig(), &sweep.data.sweep())
    });
    let both: Vec<_> = first.iter().filter_map(|(at, a)| Some((a, second.get(at)?))).collect();
    assert!(both.len() > 2000, "{}", both.len());
    [0, 1].map(|n| both.iter().filter(|(a, b)| a[n] != b[n]).count())
}

#[test]
fn where_nothing_moves_less_flips_than_with_the_filter() {
    for rig in [SensorRig::hdl64(), SensorRig::vlp32x2()] {
        for speed in [0.0, 8.0] {
            let path = Path::from(State { y: -1.75, speed, ..State::default() });
            let [filter, encoder] = flipped(&rig, path);
            assert!(0 < encoder && 2 * encoder < filter, "{encoder} of {filter}");
        }
    }
}
