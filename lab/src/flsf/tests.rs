use super::matching::{Constancy, Features, place};
use super::network::{FEATURES, Flsf, LEVELS};
use super::occupancy::{BORDER, OccupancyMap, SIDE, Symmetry, WIDE, wide_grid};
use super::outcome::{Outcome, walk};
use super::pairs::{CellOwner, FlowPair, TwoSweeps};
use super::train::{Fit, Material};
use super::weights::{self, TrainedWeights};
use crate::learning::Adam;
use crate::scratch::Scratch;
use crate::train::simulated::Simulated;
use raywake::args::Learned;
use raywake::weight_files::WeightFiles;
use raywake_core::params::{Profile, REACH, SIDE as SEARCH};
use raywake_sim::{Drive, Options, Path, Rng, Scene, SensorRig, State};
use std::collections::BTreeSet;

/// A car ahead moving left at 9 m/s, and one parked; the vehicle drives at 6 m/s.
fn scene() -> Simulated {
    let mut scene = Scene::empty();
    let way = |x, y, yaw, speed| Path::from(State { x, y, yaw, speed });
    scene.add_car(way(12.0, 0.0, std::f64::consts::FRAC_PI_2, 9.0), 1);
    scene.add_car(Path::stationary(5.0, -8.0, 0.3), 2);
    let options = Options { sweeps: 3, rig: SensorRig::ideal(), ..Options::default() };
    Simulated::new(Drive::through(scene, way(0.0, 0.0, 0.0, 6.0), 1, options))
}

fn pair() -> FlowPair {
    let mut sweeps = TwoSweeps::default();
    FlowPair::read(&mut wide_grid(), &mut scene(), 1, &mut sweeps).unwrap().unwrap()
}

/// The parked car comes 0.6 m nearer; the other also moves 0.9 m to the left.
#[test]
fn cells_of_a_scene_made_by_hand() {
    let pair = pair();
    let sources = pair.sources();
    assert!(sources.len() > 15, "{}", sources.len());
    for source in sources {
        let CellOwner::Object(object) = pair.cells[source].owner else { panic!("no object") };
        let moves = pair.objects[usize::from(object)].speed_mps.unwrap() > 1.0;
        assert_eq!(pair.step(source), Some(if moves { [-2, 3] } else { [-2, 0] }));
        assert!(pair.cells[source].odometry[0] < -1.9);
        assert!(pair.columns[0][source][1] != 0);
    }
    assert_eq!(pair.cells.len(), SIDE * SIDE);
    let background = pair.cells.iter().filter(|c| c.owner == CellOwner::Background);
    assert!(background.clone().count() > 27_000);
    assert!(background.into_iter().all(|c| c.displacement == Some(c.odometry)));
}

/// The eight images of a square form the group: all differ, each contains every cell once, and the
/// product of any two is again one of them.
#[test]
fn symmetries() {
    let side = 5;
    let image = |s: u8| -> Vec<[usize; 2]> {
        (0..side * side).map(|n| Symmetry(s).of([n / side, n % side], side)).collect()
    };
    let all: BTreeSet<_> = (0..8).map(image).collect();
    assert_eq!(all.len(), 8);
    for first in &all {
        assert_eq!(first.iter().collect::<BTreeSet<_>>().len(), side * side);
        for second in &all {
            let both = first.iter().map(|[i, j]| second[i * side + j]).collect();
            assert!(all.contains::<Vec<_>>(&both));
        }
    }
}

#[test]
fn occupancy_of_a_square() {
    let mut tenths = vec![0; WIDE * WIDE * LEVELS];
    tenths[(40 * WIDE + 50) * LEVELS + 3] = 30;
    tenths[(40 * WIDE + 51) * LEVELS] = -10;
    let map = OccupancyMap::from_tenths(tenths);
    let square = map.square([38, 49], 4, Symmetry(0));
    assert!((square.cell(2, 1)[3] - 0.452_574).abs() < 1e-5);
    assert!((square.cell(2, 2)[0] + 0.231_059).abs() < 1e-5);
    assert_eq!(square.values.iter().filter(|v| **v != 0.0).count(), 2);
    // Mirrored along the first axis; and beyond the map everything is unknown.
    assert_eq!(map.square([38, 49], 4, Symmetry(1)).cell(1, 1), square.cell(2, 1));
    assert!(map.square([-50, 180], 60, Symmetry(0)).values.iter().all(|v| *v == 0.0));
}

/// The pairs of a sample agree with the two maps, however the square is rotated.
#[test]
fn samples_match_where_cells_went() {
    let pair = pair();
    let mut rng = Rng::new(1);
    let half = (SEARCH / 2) as i32;
    let mut seen = [0, 0];
    for n in 0..16 {
        let sources = pair.sources();
        let source = sources[n * 7 % sources.len()];
        let sample = pair.sample(source, &mut rng.clone());
        let symmetry = Symmetry((rng.bits() & 7) as u8);
        let cell = |place: usize| {
            let at = symmetry.of([place / SEARCH, place % SEARCH], SEARCH);
            [source / SIDE, source % SIDE]
                .iter()
                .zip(at)
                .map(|(s, a)| *s as i32 - half + a as i32)
                .fold(0, |all, n| all * SIDE as i32 + n) as usize
        };
        for p in &sample.pairs {
            let [a, b] = [cell(p.first), cell(p.second)];
            let step = pair.step(a).unwrap();
            let went = a as i32 + step[0] * SIDE as i32 + step[1];
            assert_eq!(went as usize == b, p.matching);
            seen[usize::from(p.matching)] += 1;
        }
        assert_eq!(sample.classes.len(), (SEARCH - 2).pow(2));
        assert!(sample.classes.contains(&Some(true)));
        let wide = SEARCH + 2 * super::network::SEEN;
        assert_eq!([sample.maps[0].rows, sample.maps[1].columns], [wide, wide]);
    }
    assert!(seen[0] == seen[1] && seen[0] > 50, "{seen:?}");
}

/// "Intentionally only a single layer between encoding and filter": the classifier reads only the
/// encoding. The sizes are those of the text and of the author's program, except for one extra
/// level.
#[test]
fn sizes_of_the_network() {
    let network = Flsf::new(true);
    assert_eq!(network.numbers(), 1_329_667 + 81 * 200);
    let [layer] = network.classifier.layers[..] else { panic!("one layer") };
    assert_eq!((layer.kernel, layer.inputs, layer.outputs), (3, FEATURES, 2));
    let cells: usize = network.encoder.layers.iter().map(|l| l.kernel - 1).sum();
    assert_eq!(cells, 2 * super::network::SEEN);
    assert_eq!(BORDER, super::network::SEEN + 1);
}

/// Training that takes little time: one pair of sweeps, few steps. Interrupted, it ends with the
/// same result; the checkpoint of another training is refused.
#[test]
fn training_goes_on_where_it_was() {
    let material = || vec![Material::of(pair()).unwrap()];
    let scratch = Scratch::new();
    let file = scratch.path().join("checkpoint");
    let whole = Fit::of(&material(), 1, 2, None).unwrap();
    let network = Flsf::new(true);
    assert_eq!(whole.numbers.len(), network.numbers());
    // The state after both steps: nothing is left to do.
    let state = Adam { step: 2, ..Adam::new(whole.numbers.len()) };
    let of = Fit::identity(&material(), 1, 2);
    weights::write_state(&file, of, &whole.numbers, &state).unwrap();
    let again = Fit::of(&material(), 1, 2, Some(&file)).unwrap();
    assert!(again.numbers == whole.numbers);
    let error = Fit::of(&material(), 2, 2, Some(&file)).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("another training"), "{error}");

    let out = scratch.path().join("weights");
    let (numbers, provenance) = (whole.numbers, "by hand".to_string());
    let trained = TrainedWeights { numbers, provenance };
    trained.write(&out).unwrap();
    let count = trained.numbers.len();
    let again = TrainedWeights::read(&out, count).unwrap();
    assert!(again.numbers == trained.numbers && again.provenance == "by hand");
    let refused = |file: &std::path::Path, count: usize| {
        TrainedWeights::read(file, count).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(&out, 7).contains("another length"));
    assert!(refused(&file, 7).contains("raywake-flsf-weights"));
    let mut bytes = std::fs::read(&out).unwrap();
    bytes[999] ^= 4;
    std::fs::write(&out, &bytes).unwrap();
    let damaged = refused(&out, count);
    assert!(damaged.contains("damaged"), "{damaged}");
}

/// Both methods over a synthetic scene: everything in a labelled box is counted once per method,
/// whatever the parameters of the network, and all counts add up.
#[test]
fn both_methods_are_counted_on_the_same_cells() {
    let profile = Profile::dissertation();
    let files = WeightFiles::read(&Learned::default(), &profile).unwrap();
    let constancy = Constancy::new(files.tables(&profile).unwrap());
    let numbers = Flsf::new(false).drawn(&mut Rng::new(3));
    let methods = (constancy, Features::new(numbers));
    let mut outcome = Outcome::default();
    walk(&mut scene(), Some(2), &methods, &mut Rng::new(1), &mut outcome).unwrap();
    assert_eq!(outcome.pairs, 1);
    let [filled, valid] = outcome.tallies.each_ref().map(|t| t.of(|_, _| true));
    assert!(filled.iter().all(|s| s.count == filled[0].count) && filled[0].count > 15);
    assert!(valid[3].count <= filled[3].count && valid[0].count == filled[0].count);
    // Rounding errs by less than a cell's diagonal, and assuming no motion by the car's
    // displacement.
    assert!(filled[2].mean_cm() < 22.0 && filled[1].mean_cm() > 20.0);
    assert_eq!(outcome.compared.len(), filled[0].count);
    assert!(outcome.compared.iter().any(|c| c.matching));
    let [(kind, distances)] = &outcome.distances.iter().collect::<Vec<_>>()[..] else {
        panic!("one kind moves");
    };
    assert!(**kind == crate::labels::Kind::Car && distances.cells > 8);
    let scratch = Scratch::new();
    let results = super::conclude::conclude(&outcome, &[], scratch.path()).unwrap();
    assert_eq!(results.tables.len(), 4);
    for file in ["pictures/figure-4-6.png", "charts/figure-4-8.svg", "charts/figure-4-5.csv"] {
        assert!(scratch.path().join(file).exists(), "{file}");
    }
}

#[test]
fn rows_hold_every_displacement() {
    let places: BTreeSet<usize> = (0..SEARCH * SEARCH)
        .map(|n| place([n / SEARCH, n % SEARCH].map(|d| d as i32 - REACH)))
        .collect();
    assert_eq!(places.len(), SEARCH * SEARCH);
    assert!(places.iter().all(|p| *p < raywake_core::params::ROW));
}
