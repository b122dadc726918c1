//! Recorded drives, in the folder named by `RAYWAKE_DATA`.

#![forbid(unsafe_code)]

use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_gpu::Options;
use raywake_io::source::{self, OpenOptions, Source, SweepData};
use raywake_tests::drives::Setup;
use std::path::PathBuf;

fn open(name: &str) -> Box<dyn Source> {
    let folder = std::env::var_os("RAYWAKE_DATA").expect("RAYWAKE_DATA");
    let path = PathBuf::from(folder).join(name);
    source::open(&path, &OpenOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// Result of several sweeps.
struct Run {
    digest: u64,
    /// Matched columns of every pair.
    valid: Vec<usize>,
    points: usize,
}

fn run(setup: &Setup, backend: raywake::backend::Backend, source: &mut dyn Source) -> Run {
    let mut drive = setup.drive(backend);
    let (mut now, mut before) = (SweepData::default(), SweepData::default());
    let mut digest = Digest::default();
    let mut run = Run { digest: 0, valid: Vec::new(), points: 0 };
    for index in 0..source.len().min(20) {
        source.read(index, &mut now).unwrap_or_else(|e| panic!("{e}"));
        let stepped = drive.step(&now.sweep(), &before.points).unwrap_or_else(|e| panic!("{e}"));
        if let Some(flows) = stepped.output.flows {
            flows.columns.iter().for_each(|c| digest.column(c));
            run.valid.push(flows.valid);
            flows.points.iter().for_each(|p| digest.point(&p));
            run.points += flows.points.count();
        }
        drive.tracklets().for_each(|t| digest.tracklet(&t));
        std::mem::swap(&mut now, &mut before);
    }
    Run { digest: digest.value(), ..run }
}

fn setup(profile: Profile, source: &dyn Source) -> Setup {
    Setup { profile, rig: source.rig().clone(), filter: None }
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn kitti_flows_on_every_backend() {
    let mut source = open("kitti_raw_0005");
    let setup = setup(Profile::hdl64(), &*source);
    let scalar = run(&setup, setup.scalar(), &mut *source);
    assert_eq!(scalar.valid.len(), 19);
    assert!(scalar.valid.iter().all(|v| *v >= 1000), "{:?}", scalar.valid);
    let Some(device) = setup.device(&Options::default()) else { return };
    let device = run(&setup, device, &mut *source);
    assert_eq!(format!("{:016x}", device.digest), format!("{:016x}", scalar.digest));
    assert_eq!((device.valid, device.points), (scalar.valid, scalar.points));
}

#[test]
#[ignore = "needs RAYWAKE_DATA"]
fn argoverse_flows_in_the_wide_window() {
    let mut source = open("av2_log");
    let setup = setup(Profile::wide(), &*source);
    let scalar = run(&setup, setup.scalar(), &mut *source);
    assert!(!scalar.valid.is_empty() && scalar.points > 50_000, "{} points", scalar.points);
    assert!(scalar.valid.iter().all(|v| *v >= 1000), "{:?}", scalar.valid);
    let Some(device) = setup.device(&Options::default()) else { return };
    assert_eq!(run(&setup, device, &mut *source).digest, scalar.digest);
}
