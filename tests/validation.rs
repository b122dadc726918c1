//! The validation layer and `spirv-val` have no complaints.

#![forbid(unsafe_code)]

use raywake::backend::Backend;
use raywake_core::params::Profile;
use raywake_gpu::Validation;
use raywake_kernels::kernel::KERNELS;
use raywake_tests::drives::{Setup, pairs, street, sweep};
use raywake_tests::{vulkan, weights};
use std::process::Command;

/// Runs the pipeline over the street.
fn check(profile: Profile, validation: Validation) {
    let Some(options) = vulkan::under(validation) else { return };
    let setup = Setup::new(profile, Some(weights::filter(50, 14, 100, 0)));
    let backend = setup.device(&options).expect("the device that has just been there");
    let mut drive = setup.drive(backend);
    let mut valid = 0;
    // Twice: twenty sweeps, with a reset in between.
    for (now, before) in pairs(street()).chain(pairs(street())) {
        let points = before.map_or(&[][..], |b| &b.points);
        let stepped = drive.step(&sweep(now), points).unwrap_or_else(|e| panic!("{e}"));
        valid += stepped.output.flows.map_or(0, |flows| flows.valid);
    }
    assert!(valid > 100, "{valid} flows");
    let Backend::Device(device) = drive.backend() else { unreachable!("made above") };
    assert_eq!(device.messages(), [""; 0], "{validation:?}");
}

#[test]
fn no_hazard_is_found() {
    check(Profile::hdl64(), Validation::Sync);
}

#[test]
fn no_access_out_of_bounds_is_found() {
    check(Profile::hdl64(), Validation::GpuAssisted);
}

#[test]
fn no_access_out_of_bounds_is_found_in_the_largest_window() {
    check(Profile { side: 337, ..Profile::wide() }, Validation::GpuAssisted);
}

/// What newer versions report about the strides that naga puts on arrays in workgroup memory:
/// harmless.
const KNOWN: &str = "VUID-StandaloneSpirv-None-10684";

#[test]
fn kernels_are_valid() {
    if Command::new("spirv-val").arg("--version").output().is_err() {
        eprintln!("skipped: no spirv-val");
        return;
    }
    let folder = std::env::temp_dir().join(format!("raywake-spirv-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    for kernel in KERNELS {
        let name = kernel.name;
        let path = folder.join(name);
        std::fs::write(&path, bytemuck::cast_slice(kernel.spirv.words()))
            .expect("a temporary file");
        let arguments = ["--target-env", "vulkan1.1"];
        let said = Command::new("spirv-val").args(arguments).arg(&path).output().expect("it runs");
        let text = String::from_utf8_lossy(&[said.stdout, said.stderr].concat()).into_owned();
        let errors = text.lines().filter(|line| line.starts_with("error"));
        let others = errors.filter(|line| !line.contains(KNOWN)).count();
        assert!(said.status.success() || others == 0 && text.contains(KNOWN), "{name}: {text}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
