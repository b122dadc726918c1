//! Labelled columns for the background filter.

use super::drives::{Labelled, LabelledSweep};
use super::features::WeightTying;
use super::owner::{Owner, owners};
use crate::grid::Grid;
use crate::labels::Kind;
use raywake_io::Error;
use raywake_sim::Rng;

/// Share of the background columns that are kept.
pub const BACKGROUND_KEPT: f64 = 0.2;

pub struct Sample {
    pub features: Vec<u8>,
    /// What it belongs to, whether moving or not; `None` for the background.
    pub kind: Option<Kind>,
}

impl Sample {
    /// Whether it belongs to something that could move.
    pub fn foreground(&self) -> bool {
        self.kind.is_some()
    }
}

/// Samples of one sweep after another.
pub struct Sampling<'a> {
    pub grid: &'a mut Grid,
    pub rng: &'a mut Rng,
    pub tying: WeightTying,
    /// Working memory, kept for reuse.
    pub sweep: LabelledSweep,
    pub samples: Vec<Sample>,
}

impl Sampling<'_> {
    /// Adds the samples of a sweep.
    pub fn add(&mut self, drive: &mut dyn Labelled, index: usize) -> Result<(), Error> {
        let Sampling { grid, rng, tying, sweep, samples } = self;
        drive.read(index, sweep)?;
        let window = grid.sweep(drive.rig(), &sweep.data.sweep());
        for (column, owner) in owners(grid, &window, drive, sweep) {
            let kind = match owner {
                Owner::Object(n) => Some(sweep.objects[n].kind),
                Owner::Background if rng.chance(BACKGROUND_KEPT) => None,
                _ => continue,
            };
            let features = tying.features(&grid.step, &grid.columns, column);
            samples.push(Sample { features, kind });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::simulated::Simulated;
    use raywake_core::params::Profile;
    use raywake_sim::{Class, Drive, Options, Path, Scene, SensorRig, Shape, Surface};

    #[test]
    fn a_car_is_foreground_and_a_wall_is_not() {
        let of = |car: bool, wall: bool| {
            let mut scene = Scene::empty();
            if car {
                scene.add_car(Path::stationary(10.0, 0.0, 0.3), 1);
            }
            if wall {
                let pose = raywake_core::pose::Pose::planar(0.0, 9.0, 1.5, 0.0);
                scene.put(Class::Building, Shape::cuboid(20.0, 0.5, 3.0), pose, Surface::matt(0.5));
            }
            let options = Options { sweeps: 1, rig: SensorRig::ideal(), ..Options::default() };
            let path = Path::stationary(0.0, 0.0, 0.0);
            let mut drive = Simulated::new(Drive::through(scene, path, 1, options));
            let mut sampling = Sampling {
                grid: &mut Grid::new(Profile::hdl64()),
                rng: &mut Rng::new(1),
                tying: WeightTying::Square,
                sweep: LabelledSweep::default(),
                samples: Vec::new(),
            };
            sampling.add(&mut drive, 0).unwrap();
            sampling.samples
        };
        let foreground = |samples: &[Sample]| samples.iter().filter(|s| s.foreground()).count();
        let (nothing, wall, car) = (of(false, false), of(false, true), of(true, false));
        assert_eq!((foreground(&nothing), foreground(&wall)), (0, 0));
        assert!((10..150).contains(&foreground(&car)), "{}", foreground(&car));
        assert!(nothing.len() > 100);
    }
}
