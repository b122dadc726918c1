//! Nothing is allocated, created or recorded between the first sweep and the last, however many
//! threads share the work; and several threads produce the same results as one.

#![forbid(unsafe_code)]

use std::hint::black_box;

use raywake::backend::Backend;
use raywake::config::Settings;
use raywake::error::RunError;
use raywake::team::{self, ThreadTeam};
use raywake::track::{Ended, Tracker};
use raywake_alloc_guard::{Allocation, Guard, Sealed};
use raywake_core::digest::Digest;
use raywake_core::params::Profile;
use raywake_core::stages::{FLOW_PROGRAMS, background_filter};
use raywake_core::team::Team as _;
use raywake_gpu::{Census, Options};
use raywake_io::source::SweepData;
use raywake_kernels::schedule::Schedule;
use raywake_objects::params::TrackingParams;
use raywake_tests::drives::{Setup, pairs, street, sweep};

#[global_allocator]
static ALLOCATOR: Guard<std::alloc::System> = Guard(std::alloc::System);

/// Maximum memory on a device for a window of 50 m.
const DEVICE_BYTES: u64 = 40 << 20;

/// Numbers of threads, independent of the machine.
const THREADS: [usize; 2] = [3, 1];

fn main() {
    let [several, one] = THREADS.map(|threads| {
        let worker = std::thread::spawn(move || team::lead(threads, run));
        worker.join().expect("all pass")
    });
    assert!(several == one, "{several:x?}, alone {one:x?}");
}

/// Runs all checks. Returns digests of the results.
fn run() -> Vec<u64> {
    println!("threads: {}", team::threads());
    the_team_is_guarded();
    let mut passed = 1;
    let mut digests = Vec::new();
    for filter in [None, Some(background_filter::SHIPPED.to_string())] {
        let setup = Setup::new(Profile::hdl64(), filter);
        digests.push(check(&setup, setup.scalar()));
        passed += 1;
        if let Some(device) = setup.device(&Options::default()) {
            digests.push(check(&setup, device));
            passed += 1;
        }
    }
    for flow in [false, true] {
        check_tracks(flow);
        passed += 1;
    }
    println!("frozen: {passed} passed, 0 failed");
    digests
}

/// A deliberate allocation, in a step or in work that another thread may take over from it.
fn the_team_is_guarded() {
    let allocate = || drop(black_box(vec![1u8; 100]));
    let told = |section, work: &dyn Fn()| {
        let step = Sealed::new(section, ()).step(|()| {
            work();
            Ok::<_, Allocation>(())
        });
        let e = step.expect_err("an allocation");
        assert!([section, "helper thread"].contains(&e.section) && e.bytes == 100, "{e}");
    };
    told("alone", &allocate);
    told("shared", &|| ThreadTeam::new(None).join(|| (), allocate));
    println!("an allocation in a step is an error ... ok");
}

/// Runs ten sweeps, none of which may allocate. Returns a digest of their flow.
fn check(setup: &Setup, backend: Backend) -> u64 {
    let name = backend.name();
    let filter = if setup.filter.is_some() { "on" } else { "off" };
    let sweeps = street();
    assert_eq!(sweeps.len(), 10);
    let mut drive = setup.drive(backend);
    let (mut columns, mut digest) = (0, Digest::default());
    for (now, earlier) in pairs(sweeps) {
        let points = earlier.map_or(&[][..], |e| &e.points);
        let stepped = drive.step(&sweep(now), points).unwrap_or_else(|e| panic!("{e}"));
        if let Some(flows) = stepped.output.flows {
            columns += flows.valid;
            flows.columns.iter().for_each(|c| digest.column(c));
        }
    }
    let mut drive = Sealed::new("tracklets", drive);
    let tracklets = drive.step(|drive| Ok::<_, RunError>(drive.tracklets().count()));
    let tracklets = tracklets.unwrap_or_else(|e| panic!("{e}"));
    assert!(columns > 1000 && tracklets > 10, "{columns} flows, {tracklets} tracklets");
    let census = drive.backend().census();
    let bytes = census.map_or(0, |census| check_census(&census));
    println!("{name}, filter {filter}: {columns} flows, {bytes} bytes on the device ... ok");
    digest.value()
}

/// Runs ten sweeps through the front end of the tracks, and the estimates of these.
fn check_tracks(flow: bool) {
    let setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.to_string()));
    let drive = flow.then(|| setup.drive(setup.scalar()));
    let (profile, objects) = (setup.profile.clone(), TrackingParams::DEFAULT);
    let settings = Settings { profile, objects };
    let mut tracker = Tracker::new(&setup.rig, &settings, drive, None, true).expect("room");
    let sweeps: Vec<SweepData> = street()
        .iter()
        .map(|s| SweepData {
            stamp_s: s.stamp_s,
            points: s.points.clone(),
            world_from_vehicle: s.world_from_vehicle,
            twist: s.twist,
            ..SweepData::default()
        })
        .collect();
    let mut updates = 0;
    for (n, now) in sweeps.iter().enumerate() {
        let earlier = n.checked_sub(1).map(|n| &sweeps[n]);
        let turnover = tracker.sweep(now, earlier).unwrap_or_else(|e| panic!("{e}"));
        updates += turnover.map_or(0, |t| t.updated);
    }
    let ended = tracker.finish().unwrap_or_else(|e| panic!("{e}"));
    let mut estimated = 0;
    let show = |ended: &Ended| {
        let lag = ended.lag.expect("asked for");
        assert_eq!(lag.len() as u32, ended.track.observations);
        estimated += (ended.report.returns > 0) as u64;
        Ok(())
    };
    tracker.ended(show).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        updates > 100 && estimated > 10 && estimated <= ended,
        "{updates}, {ended}, {estimated}"
    );
    println!("tracks, flow {flow}: {updates} updates, {estimated} estimates ... ok");
}

/// Checks a census; returns the bytes on the device.
fn check_census(census: &Census) -> u64 {
    let bytes = census.upload_bytes + census.device_bytes + census.readback_bytes;
    assert!(census.memory_allocations <= 3, "{census:?}");
    assert!(bytes <= DEVICE_BYTES, "{census:?}");
    // As many as `raywake budget` states, whatever the device.
    let schedule = Schedule::new(FLOW_PROGRAMS, &Profile::hdl64());
    for programs in [schedule.programs, schedule.on_cpus] {
        let barriers = programs.iter().map(|p| p.commands(schedule.rows.len()).barriers as u64);
        assert_eq!(barriers.sum::<u64>(), census.barriers, "{census:?}");
    }
    bytes
}
