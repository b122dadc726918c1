//! What a sweep costs: variants side by side in one run, medians over simulated sweeps, digests of
//! the results. Variants that must agree are compared; the program fails where they do not.
//!
//! `cargo bench -p raywake-tests` measures; any other start, as `cargo test --benches`, or the
//! argument `--test` takes two sweeps, just to see that everything runs.

#![forbid(unsafe_code)]

use glam::DVec3;
use raywake::map::{MapBackend, Mapper, device::DeviceMap, scalar::ScalarMap};
use raywake_core::background_filter;
use raywake_core::layout::{BUFFERS, Buffer, COUNTERS, DISTINCT_COUNT};
use raywake_core::params::{POINTS_MAX, Profile};
use raywake_core::prepare::place;
use raywake_gpu::{self as gpu, Executor, Heap, Op, Options, Program};
use raywake_kernels::schedule;
use raywake_objects::centroid_ekf::{CentroidEkf, CentroidParams};
use raywake_objects::estimate::{EstimateParams, Estimator, FixedLag, MODEL_MAX};
use raywake_objects::{ObjectReturn, ObjectState};
use raywake_sim::{Drive, Ego, SimSweep};
use raywake_tests::drives::{Setup, pairs, sweep};
use raywake_tests::grid::{Rays, Tracer};
use raywake_tests::table::{Variant, table};
use raywake_tests::vulkan;
use std::collections::BTreeMap;
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
            variant.add(n, "foreground columns", stepped.foreground as f64);
            variant.add(n, "rays traced", stepped.rays as f64);
            let columns = stepped.flows.iter().flat_map(|f| f.columns);
            columns.for_each(|c| variant.digest.column(c));
            drive.tracklets().for_each(|t| variant.digest.tracklet(&t));
        }
        variants.push(variant);
    }
    let title = "flow, profile hdl64, ms a sweep";
    table(title, &variants, &[(0, 2), (1, 3), (0, 1), (2, 3)], &[(0, 2), (1, 3)]);
}

/// The schedule up to the dense window; `merged` or with a list of single rays from the host, in
/// two more upload buffers behind the table. A third one takes the window out.
fn traced(profile: &Profile, merged: bool) -> Option<Executor> {
    let mut buffers = schedule::buffers(BUFFERS, profile);
    let more = buffers.len();
    let row = |name, heap, words| gpu::Buffer { name, heap, bytes: 4 * words as u64 };
    buffers.push(row("distinct_in", Heap::Upload, POINTS_MAX));
    buffers.push(row("counters_in", Heap::Upload, COUNTERS));
    buffers.push(row("log_odds_out", Heap::Readback, profile.voxels()));
    let mut ops = schedule::flow(profile).ops;
    let end = ops.iter().position(|op| op.name() == "ray_trace").expect("a stage");
    ops.truncate(end + 1);
    ops.retain(|op| op.name() != "shift");
    if !merged {
        let at = ops.iter().position(|op| op.name() == "ray_merge").expect("a stage");
        let list = Op::Copy { from: more, to: Buffer::Distinct as usize };
        ops.splice(at..=at, [list, Op::Copy { from: more + 1, to: Buffer::Counters as usize }]);
    }
    ops.push(Op::Copy { from: Buffer::LogOdds as usize, to: more + 2 });
    let program = Program { name: "dense window", ops };
    vulkan::expect(Executor::new(&Options::default(), &buffers, &[program]))
}

/// Merged rays against single ones in the dense window, on either backend.
fn dense(sweeps: &[SimSweep]) {
    let setup = Setup::new(Profile::hdl64(), None);
    let names = ["CPU, one thread, merged", "CPU, one thread, single rays"];
    let mut variants: Vec<Variant> = names.map(|n| Variant::new(n.into())).into();
    let mut executors: Vec<Executor> = Vec::new();
    for (merged, name) in [(true, "merged"), (false, "single rays")] {
        let Some(executor) = traced(&setup.profile, merged) else { continue };
        variants.push(Variant::new(format!("{}, {name}", executor.info().name)));
        executors.push(executor);
    }
    let (mut tracer, mut log_odds) = (Tracer::default(), vec![0; setup.profile.voxels()]);
    let mut lattice = None;
    for (n, now) in sweeps.iter().enumerate() {
        let window = place(&setup.profile, &setup.rig, &now.world_from_vehicle, lattice);
        lattice.get_or_insert(window.lattice_origin);
        let rays = Rays::new(&setup.profile, &setup.rig, &window, &sweep(now));
        for (v, merged) in variants.iter_mut().zip([true, false]) {
            let clock = Instant::now();
            let used = if merged { tracer.merge(&rays) } else { tracer.single(&rays).len() };
            let after_merge = milliseconds(clock);
            tracer.trace(&rays, &mut log_odds);
            let total = milliseconds(clock);
            let rest = total - after_merge;
            let listed = if merged { "ray_merge" } else { "list of rays" };
            let rows = [(listed, after_merge), ("ray_trace", rest), ("total", total)];
            rows.into_iter().for_each(|(row, ms)| v.add(n, row, ms));
            v.add(n, "rays traced", used as f64);
            log_odds.iter().for_each(|l| v.digest.word(*l as u32));
        }
        let more = BUFFERS.len();
        for (executor, v) in executors.iter_mut().zip(&mut variants[2..]) {
            let list = tracer.single(&rays);
            rays.step.write(executor.upload(Buffer::StepIn as usize));
            let fill = |to: &mut [u32], words: &[u32]| to[..words.len()].copy_from_slice(words);
            fill(executor.upload(Buffer::RaysIn as usize), rays.rays.as_flattened());
            let origins = bytemuck::cast_slice(rays.origins.as_flattened());
            fill(executor.upload(Buffer::OriginsIn as usize), origins);
            fill(executor.upload(more), list);
            executor.upload(more + 1)[DISTINCT_COUNT] = list.len() as u32;
            let clock = Instant::now();
            executor.run(0).unwrap_or_else(|e| panic!("{e}"));
            v.add(n, "total", milliseconds(clock));
            executor.times(0).for_each(|(stage, ms)| v.add(n, stage, ms));
            executor.readback(more + 2).iter().for_each(|l| v.digest.word(*l));
        }
    }
    let (ratios, equal) = ([(1, 0), (3, 2), (0, 2)], [(0, 1), (0, 2), (0, 3)]);
    table("dense window, profile hdl64, ms a sweep", &variants, &ratios, &equal);
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

/// Objects that appear in one sweep, each as the given one; and how often it is tried: a sweep takes as
/// long as its fastest try, as what else the machine does is none of ours.
const OBJECTS: usize = 20;
const TRIES: usize = 5;

/// The longest sweep of the fixed lag where many objects appear at once.
fn born_at_once(estimator: &mut Estimator, batches: &[Vec<ObjectReturn>], history: &[ObjectState]) {
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

/// Trajectory and shape of the object with most returns: one iteration of the batch over all sweeps
/// (2.6.6), and a push of the fixed lag with every sweep.
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
    let mut estimator = Box::new(Estimator::new());
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
    born_at_once(&mut estimator, &batches, &history);
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

/// The pipeline is made on the stack before it moves to the heap.
const STACK: usize = 64 << 20;

fn main() {
    let worker = std::thread::Builder::new().stack_size(STACK).spawn(run);
    worker.expect("the system has threads").join().expect("the thread that measures panicked");
}

fn run() {
    let given = |argument: &str| std::env::args().any(|a| a == argument);
    let count = if given("--bench") && !given("--test") { 20 } else { 2 };
    let ego = Ego::Turn { left: true, speed: 6.0 };
    // One more, which the first pair begins with.
    let options = raywake_sim::Options { sweeps: count + 1, ego, ..Default::default() };
    let sweeps: Vec<SimSweep> = Drive::new(3, options).collect();
    let points = sweeps.iter().map(|s| s.points.len()).sum::<usize>() / sweeps.len();
    println!("{count} simulated sweeps of {points} returns; medians; a/b: a divided by b");
    flow(&sweeps);
    dense(&sweeps);
    map(&sweeps);
    tracks(&sweeps);
}
