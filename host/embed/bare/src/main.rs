//! The flow of a few sweeps without an operating system or a heap: on QEMU's `virt` board
//! (aarch64), and as a plain program on the host. Both print the same digest.
//!
//! ```sh
//! cargo run --release -p raywake-bare
//! cargo build --release -p raywake-bare --target aarch64-unknown-none
//! qemu-system-aarch64 -machine virt -cpu cortex-a72 -m 256M -nographic -nic none \
//!     -kernel target/aarch64-unknown-none/release/raywake-bare
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

mod scene;

#[cfg(target_os = "none")]
mod board;

use core::fmt::{self, Write};
#[cfg(not(target_os = "none"))]
use core::mem::MaybeUninit;

use glam::DVec3;
use raywake_core::digest::Digest;
use raywake_core::output::Status;
use raywake_core::params::Profile;
use raywake_core::pose::{Pose, Twist};
use raywake_core::sweep::{Rig, Timing};
use raywake_core::team::SingleThread;
use raywake_embed::{EstimatorOptions, FlowEstimator, Memory, SweepPlace};

/// Memory for the estimator: enough for what it asks for.
const BYTES: usize = 72 << 20;
/// Number of sweeps, 0.1 s apart.
const SWEEPS: u32 = 4;

/// A window of 12 m around a robot, with few returns.
fn options() -> EstimatorOptions {
    let profile = Profile { side: 81, returns_max: scene::RETURNS as u32, ..Profile::hdl64() };
    EstimatorOptions {
        profile,
        rig: Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing: Timing::AtStamp,
            distorted: false,
            ground_m: -scene::HEIGHT_M,
            own_vehicle: None,
        },
        points_max: scene::RETURNS,
        registers: false,
        objects: false,
    }
}

/// Steps through the sweeps and prints what was found.
fn run(memory: Memory, out: &mut impl Write) -> fmt::Result {
    let options = options();
    writeln!(out, "memory     {} bytes", options.bytes().unwrap_or(0))?;
    let mut estimator = match FlowEstimator::new(&options, memory) {
        Ok(estimator) => estimator,
        Err(e) => return writeln!(out, "{e}"),
    };
    let mut digest = Digest::default();
    for n in 0..SWEEPS {
        let time_s = 0.1 * f64::from(n);
        let pose = Pose { translation: DVec3::new(time_s, 0.0, 0.0), ..Pose::IDENTITY };
        let twist = Some(Twist { linear: DVec3::X, angular: DVec3::ZERO });
        let place = SweepPlace { stamp_s: time_s, pose: Some(pose), twist };
        match estimator.step(&SingleThread, &place, scene::returns(time_s)) {
            Ok(step) => writeln!(out, "sweep {n}    {} foreground columns", step.foreground)?,
            Err(e) => writeln!(out, "sweep {n}    {e}")?,
        }
        estimator.add_to(&mut digest);
    }
    let points = estimator.points().into_iter().flat_map(|points| points.iter());
    let moving = points.filter(|point| point.status == Status::Moving).count();
    writeln!(out, "moving     {moving} returns")?;
    writeln!(out, "digest     {:016x}", digest.value())
}

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), fmt::Error> {
    struct Terminal;
    impl Write for Terminal {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            print!("{text}");
            Ok(())
        }
    }
    run(vec![MaybeUninit::uninit(); BYTES].leak(), &mut Terminal)
}
