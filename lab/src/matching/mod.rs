//! `raywake-lab match`: compares the poses that `raywake odometry` finds with the drive's own.

mod differences;

use differences::Differences;
use raywake::error::RunError;
use raywake::locate::{LocatedSweeps, Locator};
use raywake_core::pose::Pose;
use raywake_io::source::simulated::Simulated;
use raywake_io::source::{OpenOptions, Source, SweepData, open};
use std::error::Error;
use std::path::PathBuf;

/// Options of `match`.
#[derive(clap::Args)]
pub struct Args {
    /// Recorded drive with poses, in any format that `raywake run` reads.
    #[arg(value_name = "DRIVE", required_unless_present = "simulated")]
    drive: Option<PathBuf>,
    /// A simulated drive with this seed instead, whose poses are exact.
    #[arg(long, value_name = "SEED", conflicts_with = "drive")]
    simulated: Option<u64>,
    /// Whether sweeps still contain motion distortion; as the format defines it unless given.
    #[arg(long, value_name = "on|off", hide_possible_values = true)]
    #[arg(value_parser = clap::builder::BoolishValueParser::new())]
    deskew: Option<bool>,
    /// Use only the first sweeps.
    #[arg(short = 'n', value_name = "COUNT", value_parser = clap::value_parser!(u32).range(2..))]
    count: Option<u32>,
}

/// Sweeps of a simulated drive unless a count is given.
const SIMULATED_SWEEPS: u32 = 30;

/// Locates and compares.
pub fn run(args: &Args) -> Result<(), Box<dyn Error>> {
    let mut source: Box<dyn Source> = match (&args.drive, args.simulated) {
        (Some(drive), _) => {
            open(drive, &OpenOptions { deskew: args.deskew, ..Default::default() })?
        }
        (None, seed) => {
            let sweeps = args.count.unwrap_or(SIMULATED_SWEEPS);
            Box::new(Simulated::new(seed.unwrap_or_default(), sweeps as usize))
        }
    };
    println!("{}", source.describe());
    let count = args.count.map_or(source.len(), |n| source.len().min(n as usize));
    let found = located(source.as_mut(), count)?;
    print!("{}{}", found.differences.table(&found.last[0], &found.last[1])?, found.located.text());
    Ok(())
}

/// Results of a drive.
struct Found {
    differences: Differences,
    /// The last pose, found and given, relative to the first sweep.
    last: [Pose; 2],
    located: LocatedSweeps,
}

fn located(source: &mut dyn Source, count: usize) -> Result<Found, RunError> {
    let mut locator = Locator::finding()?;
    let mut sweep = SweepData::default();
    let mut differences = Differences::default();
    let mut last = [Pose::IDENTITY; 2];
    for index in 0..count {
        source.read(index, &mut sweep)?;
        let given = source.pose(0).inverse() * sweep.world_from_vehicle;
        locator.locate(source.rig(), &mut sweep)?;
        let now = [sweep.world_from_vehicle, given];
        if index > 0 {
            let step = |n: usize| last[n].inverse() * now[n];
            differences.add(&step(0), &step(1));
        }
        last = now;
    }
    Ok(Found { differences, last, located: locator.located() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(found: &Found) -> f64 {
        (found.last[0].inverse() * found.last[1]).translation.length() / found.differences.path_m()
    }

    #[test]
    fn a_simulated_drive() {
        let found = located(&mut Simulated::new(2, 12), 12).unwrap();
        assert_eq!((found.located.registered, found.located.lost), (11, 0));
        assert!(off(&found) < 0.003, "{}", off(&found));
    }

    /// The drives' own poses are off by about as much.
    #[test]
    #[ignore = "needs RAYWAKE_DATA"]
    fn recorded_drives() {
        let folder = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA names a folder");
        for (name, deskew) in
            [("kitti_raw_0005", None), ("kitti360", None), ("kitti_odometry_00", Some(false))]
        {
            let path = std::path::Path::new(&folder).join(name);
            let mut source = open(&path, &OpenOptions { deskew, ..Default::default() }).unwrap();
            let count = source.len();
            let found = located(source.as_mut(), count).unwrap();
            println!("{name}: {:.4} of the way off; {}", off(&found), found.located.text());
            assert_eq!(found.located.registered, count as u64 - 1);
            assert!(off(&found) < 0.01 && found.differences.worst_m() < 0.1);
        }
    }
}
