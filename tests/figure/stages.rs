//! The device against the scalar backend, stage by stage.

use raywake::backend::device::Device;
use raywake::backend::{Backend, Tables};
use raywake_core::params::Profile;
use raywake_core::pipeline::Pipeline;
use raywake_core::refinement::forest;
use raywake_core::stages::background_filter;
use raywake_gpu::Options;
use raywake_tests::drives::{Setup, pairs, street};
use raywake_tests::pair::Side;
use raywake_tests::weights;
use std::sync::Mutex;

/// Compares both backends over the first sweeps of the street.
fn check(profile: Profile, filter: Option<String>, sweeps: usize) {
    let setup = Setup::new(profile, filter);
    let Some(device) = setup.device(&Options::default()) else { return };
    let (mut scalar, mut device) = (Side::new(&setup, setup.scalar()), Side::new(&setup, device));
    let mut most = [0; 3];
    for (n, (now, before)) in pairs(&street()[..sweeps]).enumerate() {
        let (wanted, found) = (scalar.step(now, before), device.step(now, before));
        if let Some(what) = found.difference(&wanted) {
            panic!("{}, sweep {n}: {what}", setup.profile.name);
        }
        let counts = [&wanted.columns.len(), &wanted.points.len(), &wanted.tracklets.len()];
        most = std::array::from_fn(|k| most[k].max(*counts[k]));
    }
    assert!(most.iter().all(|m| *m > 100), "the case says something: {most:?}");
}

/// The filter that the program runs with.
fn shipped_filter() -> Option<String> {
    Some(background_filter::SHIPPED.into())
}

/// Keeps about half of the columns, arbitrarily.
fn some_filter() -> Option<String> {
    Some(weights::filter(40, 14, 100, 0))
}

#[test]
fn hdl64_unfiltered() {
    check(Profile::hdl64(), None, 5);
}

#[test]
fn hdl64_filtered() {
    check(Profile::hdl64(), some_filter(), 5);
}

#[test]
fn hdl64_as_shipped() {
    check(Profile::hdl64(), shipped_filter(), 5);
}

#[test]
fn wide_unfiltered() {
    check(Profile::wide(), None, 3);
}

#[test]
fn wide_filtered() {
    check(Profile::wide(), some_filter(), 3);
}

#[test]
fn dissertation_unfiltered() {
    check(Profile::dissertation(), None, 4);
}

#[test]
fn dissertation_filtered() {
    check(Profile::dissertation(), some_filter(), 4);
}

#[test]
fn windows_of_other_sizes() {
    let profile = Profile { side: 31, levels: 16, em_rounds: 3, ..Profile::hdl64() };
    let setup = Setup::new(profile, Some(weights::filter(41, 16, 100, 0)));
    // The shipped classifier has 14 levels, so another one is used for 16.
    let text = weights::constancy(42, 16, 150);
    let tables =
        Tables::load(&setup.profile, setup.filter.as_deref(), &text, None, forest::SHIPPED)
            .expect("set");
    let device = Device::new(&setup.profile, &tables, &Options::default());
    let Some(device) = raywake_tests::vulkan::expect(device) else { return };
    let scalar = Backend::scalar(&setup.profile, &tables);
    let mut sides =
        [scalar, Backend::Device(Box::new(device))].map(|b| Side::with(&setup, &tables, b));
    for (now, before) in pairs(&street()[..5]) {
        let [wanted, found] = sides.each_mut().map(|s| s.step(now, before));
        assert_eq!(found.difference(&wanted), None);
    }
}

#[test]
fn a_pipeline_may_be_a_static() {
    static PIPELINE: Mutex<Pipeline> = Mutex::new(Pipeline::new());
    let setup = Setup::new(Profile::hdl64(), some_filter());
    let kept = PIPELINE.lock().expect("nobody else has it");
    let mut fixed = Side::on(kept, &setup, &setup.tables(), setup.scalar());
    let mut boxed = Side::new(&setup, setup.scalar());
    for (now, before) in pairs(&street()[..3]) {
        let wanted = boxed.step(now, before);
        assert_eq!(fixed.step(now, before).difference(&wanted), None);
    }
}
