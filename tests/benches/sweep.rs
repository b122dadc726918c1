//! The cost of a sweep: variants side by side in one run, medians over simulated sweeps, digests of
//! the results. Variants that must agree are compared; the program fails if they do not.
//!
//! `cargo bench -p raywake-tests` measures; anything else, such as `cargo test --benches` or the
//! argument `--test`, runs two sweeps, just to check that everything works.

#![forbid(unsafe_code)]

use glam::DVec3;
use raywake::map::{MapBackend, Mapper, device::DeviceMap, scalar::ScalarMap};
use raywake::team::lead;
use raywake_core::params::Profile;
use raywake_core::stages::background_filter;
use raywake_core::sweep::Point;
use raywake_embed::{EstimatorOptions, FlowEstimator, ReturnsBy, SweepPlace, TeamEstimator};
use raywake_gpu::Options;
use raywake_objects::centroid_ekf::{CentroidEkf, CentroidParams};
use raywake_objects::estimate::{EstimateParams, Estimator, FixedLag, MODEL_MAX};
use raywake_objects::{ObjectReturn, ObjectState};
use raywake_sim::{Drive, Ego, SimSweep};
use raywake_tests::drives::{Setup, pairs, sweep};
use raywake_tests::table::{Variant, table};
use raywake_tests::vulkan;
use std::collections::BTreeMap;
use std::thread;
use std::time::Instant;

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// The whole pipeline: with and without the background filter, on either backend.
fn flow(sweeps: &[SimSweep]) {
    let mut variants = Vec::new();
    let setups = [("every solid column", None), ("filtered", Some(background_filter::SHIPPED))]
        .map(|(name, filter)| (name, Setup::new(Profile::hdl64(), filter.map(String::from))));
    let scalar = setups.each_ref().map(|(name, s)| (*name, s, Some(s.scalar())));
    let device = setups.each_ref().map(|(name, s)| (*name, s, s.device(&Options::default())));
    for (name, setup, backend) in scalar.into_iter().chain(device) {
        let Some(backend) = backend else { continue };
        let mut variant = Variant::new(format!("{}, {name}", backend.device()));
        let mut drive = setup.drive(backend);
        for (n, (now, before)) in pairs(sweeps).enumerate() {
            let points = before.map_or(&[][..], |b| &b.points);
            let stepped = drive.step(&sweep(now), points).unwrap_or_else(|e| panic!("{e}"));
            for (stage, ms) in stepped.laps.stages() {
                let parts = ["expectation", "maximisation"];
                variant.add(n, if parts.contains(&stage) { "flow" } else { stage }, ms);
                variant.add(n, "total", ms);
            }
            variant.add(n, "foreground columns", stepped.output.foreground as f64);
            variant.add(n, "rays traced", stepped.output.rays as f64);
            let columns = stepped.output.flows.iter().flat_map(|f| f.columns);
            columns.for_each(|c| variant.digest.column(c));
            drive.tracklets().for_each(|t| variant.digest.tracklet(&t));
        }
        variants.push(variant);
    }
    let title = "flow, profile hdl64, ms a sweep";
    table(title, &variants, &[(0, 2), (1, 3), (0, 1), (2, 3)], &[(0, 2), (1, 3)]);
}

/// A sweep as callers of the libraries keep it.
struct PointColumns {
    positions: Vec<[f32; 3]>,
    times: Vec<f32>,
    sensors: Vec<u8>,
}

impl PointColumns {
    fn of(sweep: &SimSweep) -> PointColumns {
        let points = sweep.points.iter();
        PointColumns {
            positions: points.clone().map(|p| p.position).collect(),
            times: points.clone().map(|p| p.offset_s).collect(),
            sensors: points.map(|p| p.sensor as u8).collect(),
        }
    }
}

/// A step of the program next to one of the estimator behind the C and Python libraries, which
/// copies the sweep and hands it to a thread of its own. They take turns sweep by sweep.
fn embedded(threads: usize, sweeps: &[SimSweep]) {
    let setup = Setup::new(Profile::hdl64(), Some(background_filter::SHIPPED.into()));
    let mut drive = setup.drive(setup.scalar());
    let options = EstimatorOptions {
        profile: setup.profile.clone(),
        rig: setup.rig.clone(),
        points_max: setup.profile.returns(),
        registers: false,
        objects: false,
    };
    let mut team = TeamEstimator::on_heap(&options, threads).unwrap_or_else(|e| panic!("{e}"));
    let mut variants = ["program", "library"].map(|name| Variant::new(format!("step, {name}")));
    let columns: Vec<PointColumns> = pairs(sweeps).map(|(now, _)| PointColumns::of(now)).collect();
    for (n, (now, before)) in pairs(sweeps).enumerate() {
        let columns = &columns[n];
        let at = |n: usize| Point {
            position: columns.positions[n],
            intensity: 0.0,
            offset_s: columns.times[n],
            sensor: u32::from(columns.sensors[n]),
        };
        for turn in 0..2 {
            let which = (n + turn) % 2;
            let variant = &mut variants[which];
            let clock = Instant::now();
            if which == 0 {
                let points = before.map_or(&[][..], |b| &b.points);
                let stepped = drive.step(&sweep(now), points).unwrap_or_else(|e| panic!("{e}"));
                variant.add(n, "total", milliseconds(clock));
                let columns = stepped.output.flows.iter().flat_map(|f| f.columns);
                columns.for_each(|c| variant.digest.column(c));
            } else {
                let pose = Some(now.world_from_vehicle);
                let place = SweepPlace { stamp_s: now.stamp_s, pose, twist: Some(now.twist) };
                let stepped = team.step(&place, ReturnsBy { count: now.points.len(), at });
                variant.add(n, "total", milliseconds(clock));
                stepped.unwrap_or_else(|e| panic!("{e}"));
                let columns = |e: &FlowEstimator| {
                    e.columns().iter().for_each(|c| variant.digest.column(c));
                };
                team.read(columns).unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
    let title = format!("libraries, profile hdl64, threads: {threads}, ms a sweep");
    table(&title, &variants, &[(1, 0)], &[(0, 1)]);
}

/// The sparse map on either backend.
fn map(sweeps: &[SimSweep]) {
    let profile = Profile::map();
    let device = vulkan::expect(DeviceMap::new(&profile, &Options::default()));
    let device = device.map(|d| MapBackend::Device(Box::new(d)));
    let scalar = MapBackend::Scalar(Box::new(ScalarMap::new(&profile)));
    let mut variants = Vec::new();
    for backend in [Some(scalar), device].into_iter().flatten() {
        let mut variant = Variant::new(backend.name().into());
        let rig = Setup::new(profile.clone(), None).rig;
        let mut mapper = Mapper::new(profile.clone(), rig, backend);
        let mut voxels = Vec::new();
        for (n, now) in sweeps.iter().enumerate() {
            voxels.clear();
            let clock = Instant::now();
            let mapped = mapper.map(&sweep(now), &mut |band| voxels.extend_from_slice(band));
            variant.add(n, "total", milliseconds(clock));
            mapped.unwrap_or_else(|e| panic!("{e}"));
            variant.add(n, "voxels", voxels.len() as f64);
            voxels.iter().flatten().for_each(|word| variant.digest.word(*word));
        }
        variants.push(variant);
    }
    table("sparse map, profile map, ms a sweep", &variants, &[(0, 1)], &[(0, 1)]);
}

/// Number of objects that appear in one sweep, each a copy of the given one; and number of tries: a
/// sweep takes as long as its fastest try, to exclude other load on the machine.
const OBJECTS: usize = 20;
const TRIES: usize = 5;

/// The longest sweep of the fixed lag when many objects appear at once.
fn simultaneous_births(
    estimator: &mut Estimator,
    batches: &[Vec<ObjectReturn>],
    history: &[ObjectState],
) {
    let mut fastest = vec![f64::MAX; batches.len()];
    for _ in 0..TRIES {
        let mut lags: Vec<FixedLag> = (0..OBJECTS).map(|_| FixedLag::new()).collect();
        for ((batch, baseline), fastest) in batches.iter().zip(history).zip(&mut fastest) {
            let clock = Instant::now();
            for lag in &mut lags {
                lag.push(estimator, &EstimateParams::DEFAULT, batch, baseline);
            }
            *fastest = fastest.min(milliseconds(clock));
        }
    }
    let longest = fastest.into_iter().fold(0.0, f64::max);
    println!(
        "\nfixed lag of {OBJECTS} objects born in one sweep: {longest:.1} ms the longest sweep"
    );
}

/// Trajectory and shape of the object with the most returns: one iteration of the batch over all
/// sweeps (2.6.6), and one push of the fixed lag with every sweep.
fn tracks(sweeps: &[SimSweep]) {
    let all =
        || sweeps.iter().flat_map(|s| s.points.iter().zip(&s.truth).map(move |(p, t)| (s, p, t)));
    let mut counts = BTreeMap::new();
    all()
        .filter(|(.., t)| t.object != 0)
        .for_each(|(.., t)| *counts.entry(t.object).or_insert(0) += 1);
    let Some((&most, _)) = counts.iter().max_by_key(|(_, count)| **count) else { return };
    let seen = |s: &SimSweep| -> Vec<ObjectReturn> {
        let own = s.points.iter().zip(&s.truth).filter(|(_, t)| t.object == most);
        own.map(|(p, _)| {
            let then = s.world_from_vehicle * s.twist.over(f64::from(p.offset_s));
            let at = then.transform(DVec3::from_array(p.position.map(f64::from)));
            let time_s = s.stamp_s as f32 + p.offset_s;
            let [position, origin] = [at, then.translation].map(|v| v.as_vec3().to_array());
            ObjectReturn { position, origin, time_s, ..ObjectReturn::default() }
        })
        .collect()
    };
    let batches: Vec<Vec<ObjectReturn>> =
        sweeps.iter().map(seen).filter(|b| !b.is_empty()).collect();
    let filter = CentroidParams::DEFAULT;
    let mut ekf: Option<CentroidEkf> = None;
    let mut history: Vec<ObjectState> = Vec::new();
    for batch in &batches {
        let mean = |of: &dyn Fn(&ObjectReturn) -> f32| {
            batch.iter().map(|r| f64::from(of(r))).sum::<f64>() / batch.len() as f64
        };
        let centroid = [0, 1, 2].map(|a| mean(&|r| r.position[a]));
        let time_s = mean(&|r| r.time_s);
        let ekf = match &mut ekf {
            None => ekf.insert(CentroidEkf::birth(&filter, time_s, centroid)),
            Some(ekf) => {
                ekf.predict(&filter, time_s);
                let revision = ekf.update(&filter, centroid);
                revision.revise(&ekf.state(), &mut history);
                ekf
            }
        };
        history.push(ekf.state());
    }
    let returns = batches.concat();
    let mut estimator = raywake_alloc_guard::boxed!(Estimator, Estimator::new());
    let mut variants = Vec::new();
    for (name, model) in [("batch, n_m = 300", 300), ("batch, n_m = 3000", MODEL_MAX)] {
        let mut variant = Variant::new(format!(
            "{name}, {} returns of {}",
            5000.min(returns.len()),
            returns.len()
        ));
        let mut solve = |iterations: usize| {
            let params =
                EstimateParams { iterations, model_points: model, ..EstimateParams::DISSERTATION };
            let clock = Instant::now();
            let report = estimator.solve(&params, &returns, &history);
            (milliseconds(clock), report.iterations)
        };
        for n in 0..batches.len() {
            let ([short, long], [one, many]): ([f64; 2], [usize; 2]) = {
                let (a, b) = (solve(1), solve(8));
                ([a.0, b.0], [a.1, b.1])
            };
            variant.add(n, "total", (long - short) / (many - one).max(1) as f64);
        }
        estimator.model().as_flattened().iter().for_each(|v| variant.digest.word(v.to_bits()));
        variants.push(variant);
    }
    simultaneous_births(&mut estimator, &batches, &history);
    let mut variant = Variant::new("fixed lag, a push".into());
    let mut lag = FixedLag::new();
    for (n, (batch, baseline)) in batches.iter().zip(&history).enumerate() {
        let clock = Instant::now();
        let state = lag.push(&mut estimator, &EstimateParams::DEFAULT, batch, baseline);
        variant.add(n, "total", milliseconds(clock));
        state.position.iter().for_each(|v| variant.digest.double(*v));
    }
    variants.push(variant);
    table(
        "trajectory and shape of one object, ms an iteration or a push",
        &variants,
        &[(1, 0), (2, 0)],
        &[],
    );
}

fn main() {
    let given = |argument: &str| std::env::args().any(|a| a == argument);
    let count = if given("--bench") && !given("--test") { 20 } else { 2 };
    let ego = Ego::Turn { left: true, speed: 6.0 };
    // One more, as the start of the first pair.
    let options = raywake_sim::Options { sweeps: count + 1, ego, ..Default::default() };
    let sweeps: Vec<SimSweep> = Drive::new(3, options).collect();
    let points = sweeps.iter().map(|s| s.points.len()).sum::<usize>() / sweeps.len();
    println!(
        "{count} simulated sweeps of {points} returns; medians; a/b: median of a divided by b"
    );
    flow(&sweeps);
    for threads in [1, 2] {
        // A thread leads one team.
        thread::scope(|scope| {
            scope.spawn(|| lead(threads, || embedded(threads, &sweeps)));
        });
    }
    map(&sweeps);
    tracks(&sweeps);
}
