//! Labelled columns for the background filter.

use super::drives::{Labelled, LabelledSweep};
use super::features::{Features, features};
use super::owner::{Owner, owners};
use crate::grid::Grid;
use crate::labels::Kind;
use raywake_io::Error;
use raywake_sim::Rng;

/// Share of the background columns that is kept.
pub const BACKGROUND_KEPT: f64 = 0.2;

#[derive(Clone, Copy)]
pub struct Sample {
    pub features: Features,
    /// What it belongs to, whether that moves or not; `None`: to the background.
    pub kind: Option<Kind>,
}

impl Sample {
    /// Whether it belongs to something that could move.
    pub fn foreground(&self) -> bool {
        self.kind.is_some()
    }
}

pub fn of_sweep(
    grid: &mut Grid,
    drive: &mut dyn Labelled,
    index: usize,
    sweep: &mut LabelledSweep,
    rng: &mut Rng,
    samples: &mut Vec<Sample>,
) -> Result<(), Error> {
    drive.read(index, sweep)?;
    let window = grid.sweep(drive.rig(), &sweep.data.sweep());
    for (column, owner) in owners(grid, &window, drive, sweep) {
        let kind = match owner {
            Owner::Object(n) => Some(sweep.objects[n].kind),
            Owner::Background if rng.chance(BACKGROUND_KEPT) => None,
            _ => continue,
        };
        let features = features(&grid.step, &grid.columns, column);
        samples.push(Sample { features, kind });
    }
    Ok(())
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
                scene.add_car(Path::standing(10.0, 0.0, 0.3), 1);
            }
            if wall {
                let pose = raywake_core::pose::Pose::planar(0.0, 9.0, 1.5, 0.0);
                scene.put(Class::Building, Shape::cuboid(20.0, 0.5, 3.0), pose, Surface::matt(0.5));
            }
            let options = Options { sweeps: 1, rig: SensorRig::ideal(), ..Options::default() };
            let path = Path::standing(0.0, 0.0, 0.0);
            let mut drive = Simulated::new(Drive::through(scene, path, 1, options));
            let (mut grid, mut samples) = (Grid::new(Profile::hdl64()), Vec::new());
            let mut sweep = LabelledSweep::default();
            of_sweep(&mut grid, &mut drive, 0, &mut sweep, &mut Rng::new(1), &mut samples).unwrap();
            samples
        };
        let foreground = |samples: &[Sample]| samples.iter().filter(|s| s.foreground()).count();
        let (nothing, wall, car) = (of(false, false), of(false, true), of(true, false));
        assert_eq!((foreground(&nothing), foreground(&wall)), (0, 0));
        assert!((10..150).contains(&foreground(&car)), "{}", foreground(&car));
        assert!(nothing.len() > 100);
    }
}
