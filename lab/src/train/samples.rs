//! Labelled columns of simulated drives.

use super::features::{Features, features};
use crate::grid::Grid;
use crate::labels::Footprint;
use raywake_core::params::Profile;
use raywake_core::record::NONE;
use raywake_core::sweep::Sweep;
use raywake_sim::{Drive, Options, Rng, Sensor, SensorRig, SimSweep};

/// Height of the sensor above the ground, m.
const HEIGHT_M: f64 = 1.73;
/// Sweeps between those that are used: neighbours are nearly the same.
const STRIDE: usize = 7;
/// Share of the background columns that is kept.
pub const BACKGROUND_KEPT: f64 = 0.2;
/// A column without a point of an object, its centre this close outside one, is left out: to which
/// of them it belongs is no more than a matter of rounding, m.
const DOUBT: f64 = 0.15;

/// One column.
#[derive(Clone, Copy)]
pub struct Sample {
    /// What the classifier sees.
    pub features: Features,
    /// Whether it belongs to something that could move, even if it does not.
    pub foreground: bool,
}

/// Samples of drive `index` of a seed.
pub fn of_drive(grid: &mut Grid, seed: u64, index: usize, sweeps: usize) -> Vec<Sample> {
    let mut rng = Rng::split(seed, index as u64);
    let options = Options {
        sweeps: STRIDE * (sweeps - 1) + 1,
        density: rng.range(0.3, 1.3),
        rig: SensorRig::single(sensor(&mut rng), HEIGHT_M),
        threads: 1,
        ..Options::default()
    };
    let drive = Drive::new(rng.bits(), options);
    grid.restart();
    let mut samples = Vec::new();
    for n in 0..sweeps {
        of_sweep(grid, &drive, &drive.sweep(n * STRIDE), &mut rng, &mut samples);
    }
    samples
}

/// An HDL-64E that differs a little from any other in noise, strength and pitch of its beams, so
/// that the filter does not come to rely on one copy of it.
fn sensor(rng: &mut Rng) -> Sensor {
    let base = Sensor::hdl64();
    let mut beams = base.beams;
    let pitch = rng.range(-0.005, 0.005);
    beams.iter_mut().for_each(|b| b.elevation += pitch);
    Sensor {
        beams,
        range_noise: rng.range(0.01, 0.05),
        angle_noise: rng.range(2e-4, 1e-3),
        dropout: rng.range(0.0, 0.15),
        signal: base.signal * rng.range(0.4, 1.2),
        ..base
    }
}

/// Foreground where a return comes from an object, or the centre lies in an object's footprint.
fn of_sweep(
    grid: &mut Grid,
    drive: &Drive,
    sim: &SimSweep,
    rng: &mut Rng,
    samples: &mut Vec<Sample>,
) {
    let sweep = Sweep {
        stamp_s: sim.stamp_s,
        points: &sim.points,
        world_from_vehicle: sim.world_from_vehicle,
        twist: sim.twist,
    };
    let window = grid.sweep(&drive.rig(), &sweep);
    let mut hit = vec![false; grid.columns.len()];
    for (&column, truth) in grid.of_point.iter().zip(&sim.truth) {
        if column != NONE && truth.class.is_foreground() {
            hit[column as usize] = true;
        }
    }
    let vehicle_from_world = sim.world_from_vehicle.inverse();
    let objects = drive.objects(sim.stamp_s);
    let footprints: Vec<Footprint> = objects
        .iter()
        .map(|o| (vehicle_from_world * o.world_from_object, o.size))
        .filter(|(pose, _)| pose.translation.length() < 60.0)
        .map(|(pose, size)| Footprint::new(pose, size[0], size[1]))
        .collect();
    for column in grid.solid() {
        let at = grid.centre(&window, column);
        let within = |margin: f64| footprints.iter().any(|f| f.holds(at, margin));
        let foreground = hit[column] || within(0.0);
        if foreground || (rng.chance(BACKGROUND_KEPT) && !within(DOUBT)) {
            let features = features(&grid.step, &grid.columns, column);
            samples.push(Sample { features, foreground });
        }
    }
}

/// Samples of all drives, in their order; two threads, the number of which does not show.
pub fn of_drives(seed: u64, drives: usize, sweeps: usize) -> Vec<Vec<Sample>> {
    let part = |first: usize| {
        let mut grid = Grid::new(Profile::hdl64());
        let numbers = (first..drives).step_by(2);
        numbers.map(|n| of_drive(&mut grid, seed, n, sweeps)).collect::<Vec<_>>()
    };
    let [even, odd] = std::thread::scope(|scope| {
        let odd = scope.spawn(|| part(1));
        [part(0), odd.join().expect("a simulating thread panicked")]
    });
    let (mut even, mut odd) = (even.into_iter(), odd.into_iter());
    (0..drives).filter_map(|n| if n % 2 == 0 { even.next() } else { odd.next() }).collect()
}
