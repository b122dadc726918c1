//! Sweeps per second through random streets, for every rig or for one: `rate [SEEDS] [RIG]`.

use raywake_sim::{Drive, Options, SensorRig};
use std::time::Instant;

const SWEEPS: usize = 10;

fn main() {
    let seeds = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(4);
    let only = std::env::args().nth(2);
    let names = SensorRig::NAMES.into_iter().filter(|n| only.as_ref().is_none_or(|o| o == n));
    for name in names {
        let (mut laying, mut casting, mut returns, mut objects) = (0.0, 0.0, 0, 0);
        let mut fixtures = 0;
        for seed in 0..seeds {
            let rig: SensorRig = name.parse().expect("a name of its own");
            let options = Options { sweeps: 100, rig, threads: 2, ..Options::default() };
            let begin = Instant::now();
            let drive = Drive::new(seed, options);
            laying += begin.elapsed().as_secs_f64();
            fixtures += drive.scene().fixtures.len();
            objects += drive.scene().objects.len();
            let begin = Instant::now();
            returns += drive.take(SWEEPS).map(|s| s.points.len()).sum::<usize>();
            casting += begin.elapsed().as_secs_f64();
        }
        let (drives, sweeps) = (seeds as f64, (seeds as usize * SWEEPS) as f64);
        println!(
            "{name:8} {:5.1} sweeps/s, {:6.0} returns a sweep, {:4.0} objects and {:5.0} \
            fixtures, laid out in {:3.0} ms",
            sweeps / casting,
            returns as f64 / sweeps,
            objects as f64 / drives,
            fixtures as f64 / drives,
            1e3 * laying / drives,
        );
    }
}
