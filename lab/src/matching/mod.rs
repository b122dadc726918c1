//! `raywake-lab match`: ego motion of a drive by scan matching, against the drive's own poses.

mod differences;
mod sequence;

use differences::Differences;
use raywake::order_statistics::quantiles;
use raywake_core::pose::Pose;
use raywake_io::sink::atomic;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Source, SweepData, open, pose_row};
use sequence::{Matched, Matcher};
use std::error::Error;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Where each registration starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Initial {
    /// At the drive's own motion, as in the dissertation (section 3.8.3).
    Given,
    /// At the motion found before.
    ConstantVelocity,
    /// At no motion.
    Identity,
}

/// Options of `match`.
#[derive(clap::Args)]
pub struct Args {
    /// Recorded drive, in any format that `raywake run` reads.
    #[arg(value_name = "DRIVE", required_unless_present = "simulated")]
    drive: Option<PathBuf>,
    /// A simulated drive with this seed instead, whose poses are exact.
    #[arg(long, value_name = "SEED", conflicts_with = "drive")]
    simulated: Option<u64>,
    /// File of poses to write: world from vehicle, rows of 3x4, one per sweep matched. The world is
    /// that of the drive's first pose. Readable by `raywake run --poses` (KITTI odometry:
    /// `--poses-frame vehicle`).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Where each registration starts.
    #[arg(long, value_enum, default_value_t = Initial::Given)]
    initial: Initial,
    /// The first sweeps only.
    #[arg(short = 'n', value_name = "COUNT", value_parser = clap::value_parser!(u32).range(2..))]
    count: Option<u32>,
}

/// Sweeps of a simulated drive unless the count says otherwise.
const SIMULATED_SWEEPS: u32 = 30;

/// Matches, writes and compares.
pub fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    let mut source: Box<dyn Source> = match (&args.drive, args.simulated) {
        (Some(drive), _) => open(drive, &OpenOptions::default())?,
        (None, seed) => {
            let sweeps = args.count.unwrap_or(SIMULATED_SWEEPS);
            Box::new(Simulated::new(seed.unwrap_or_default(), sweeps as usize))
        }
    };
    println!("{}", source.describe());
    let count = args.count.map_or(source.len(), |n| source.len().min(n as usize));
    let chain = chain(source.as_mut(), count, args.initial)?;
    write(&args.out, &chain.poses)?;
    print!("{}", chain.report()?);
    Ok(())
}

struct Chain {
    /// `world_from_vehicle` of every sweep.
    poses: Vec<Pose>,
    given: Vec<Pose>,
    matched: Vec<Matched>,
    /// Of every pair, in ms.
    times_ms: Vec<f64>,
}

fn chain(source: &mut dyn Source, count: usize, initial: Initial) -> Result<Chain, Box<dyn Error>> {
    let mut matcher = Matcher::new(source.rig());
    let mut sweep = SweepData::default();
    let (mut poses, mut given, mut matched) = (Vec::new(), Vec::<Pose>::new(), Vec::new());
    let mut times_ms = Vec::new();
    let mut last = Pose::IDENTITY;
    for index in 0..count {
        source.read(index, &mut sweep)?;
        let start = match (initial, given.last()) {
            (Initial::Given, Some(before)) => before.inverse() * sweep.world_from_vehicle,
            (Initial::ConstantVelocity, Some(_)) => last,
            _ => Pose::IDENTITY,
        };
        let begin = Instant::now();
        let pose = match matcher.next(sweep.stamp_s, &sweep.points, start) {
            Some(found) => {
                times_ms.push(1e3 * begin.elapsed().as_secs_f64());
                matched.push(found);
                last = found.motion;
                poses[index - 1] * found.motion
            }
            None => sweep.world_from_vehicle,
        };
        poses.push(pose);
        given.push(sweep.world_from_vehicle);
    }
    Ok(Chain { poses, given, matched, times_ms })
}

impl Chain {
    fn report(&self) -> Result<String, Box<dyn Error>> {
        let mut differences = Differences::default();
        for (n, found) in self.matched.iter().enumerate() {
            differences.add(&found.motion, &(self.given[n].inverse() * self.given[n + 1]));
        }
        let count = |of: &dyn Fn(&Matched) -> bool| self.matched.iter().filter(|m| of(m)).count();
        let of = |value: fn(&Matched) -> f64| self.matched.iter().map(value);
        let median_and_max = |value| quantiles(of(value), [0.5, 1.0]);
        let rms = median_and_max(|m| m.registration.rms_m);
        let steps = median_and_max(|m| m.registration.iterations as f64);
        let rounds = median_and_max(|m| m.rounds as f64);
        let time = quantiles(self.times_ms.iter().copied(), [0.5, 0.95, 1.0]);
        let least = of(|m| m.registration.least_eigenvalue).fold(f64::INFINITY, f64::min);
        let (found, given) = match (self.poses.last(), self.given.last()) {
            (Some(found), Some(given)) => (found, given),
            _ => return Ok(String::new()),
        };
        Ok(format!(
            "{}converged       {} of {} pairs; the others keep their initial motion\n\
             undetermined    {} pairs, least eigenvalue {:.4}\n\
             inliers' rms    median {:.4} m, max {:.4} m\n\
             steps           median {}, max {}; rounds of deskewing median {}, max {}\n\
             time            median {:.0} ms, 95 % {:.0} ms, max {:.0} ms a pair\n",
            differences.table(found, given)?,
            count(&|m| m.registration.converged),
            self.matched.len(),
            count(&|m| m.registration.unobserved.count() > 0),
            least,
            rms[0],
            rms[1],
            steps[0],
            steps[1],
            rounds[0],
            rounds[1],
            time[0],
            time[1],
            time[2],
        ))
    }
}

/// Writes poses as rows of 3x4 numbers that read back as they are.
fn write(path: &Path, poses: &[Pose]) -> Result<(), raywake_io::Error> {
    atomic::write(path, |to| poses.iter().try_for_each(|pose| writeln!(to, "{}", pose_row(pose))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_drive_and_its_file() {
        let mut source = Simulated::new(2, 3);
        let chain = chain(&mut source, 3, Initial::ConstantVelocity).unwrap();
        assert_eq!((chain.poses.len(), chain.matched.len()), (3, 2));
        assert_eq!(chain.poses[0], chain.given[0]);
        let report = chain.report().unwrap();
        assert!(report.contains("converged       2 of 2 pairs"), "{report}");
        for pose in &chain.poses {
            let numbers: Vec<f64> =
                pose_row(pose).split_whitespace().map(|w| w.parse().unwrap()).collect();
            let back = Pose::from_rows(&numbers.try_into().unwrap()).unwrap();
            assert!((back.translation - pose.translation).length() == 0.0);
            assert!(back.rotation.dot(pose.rotation).abs() > 1.0 - 1e-14);
        }
    }
}
