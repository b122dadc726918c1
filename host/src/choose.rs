//! The choice of backend for a run, and `raywake devices`.

use raywake_core::params::Profile;
use raywake_core::sweep::Rig;
use raywake_gpu::{DeviceInfo, DeviceKind, GpuError, Options, Validation, devices};

use crate::args::{BackendChoice, BackendKind, Validate};
use crate::backend::Backend;
use crate::backend::device::Device;
use crate::budget;
use crate::console;
use crate::drive::Drive;
use crate::error::RunError;
use crate::memory;
use crate::weight_files::WeightFiles;
use raywake_io::Error;
use serde::Serialize;

/// The pipeline on a backend, with everything allocated.
pub struct Chosen {
    /// The pipeline.
    pub drive: Drive,
    /// Where the background filter comes from.
    pub filter: String,
    /// A note to the user on why it is not on a device, if one might be expected.
    pub note: Option<String>,
}

/// Where the grid and flow stages are to run.
pub struct Wanted {
    /// How to run on a device; `None` for the CPU.
    pub device: Option<Options>,
    /// Why it is not a device, if one might be expected.
    pub note: Option<String>,
}

/// Creates the pipeline for a rig on the backend asked for.
pub fn drive(
    choice: &BackendChoice,
    weights: &WeightFiles,
    profile: &Profile,
    rig: &Rig,
) -> Result<Chosen, RunError> {
    let tables = weights.tables(profile)?;
    let wanted = wanted(choice)?;
    memory::probe_memory(budget::host_bytes(profile, wanted.device.is_none()))?;
    let backend = match &wanted.device {
        Some(options) => Backend::Device(Box::new(Device::new(profile, &tables, options)?)),
        None => Backend::scalar(profile, &tables),
    };
    let drive = Drive::new(profile, rig, &tables, backend, choice.simd);
    let filter = tables.provenance.clone();
    Ok(Chosen { drive: drive.with_spare(tables), filter, note: wanted.note })
}

/// Decides between device and CPU.
pub fn wanted(choice: &BackendChoice) -> Result<Wanted, Error> {
    let device_wanted = choice.device.is_some() || choice.validation.is_some();
    let lacking = match choice.backend {
        BackendKind::Scalar if device_wanted => {
            let what = "--device needs the Vulkan backend, not --backend scalar";
            return Err(Error::Usage(what.into()));
        }
        BackendKind::Scalar => return Ok(Wanted { device: None, note: None }),
        BackendKind::Vulkan => None,
        BackendKind::Auto if device_wanted => None,
        BackendKind::Auto => no_device(),
    };
    Ok(match lacking {
        Some(why) => {
            Wanted { device: None, note: Some(format!("{why}: using the scalar backend")) }
        }
        None => Wanted { device: Some(options(choice)), note: None },
    })
}

/// Why `auto` finds no device; `None` if there is one.
fn no_device() -> Option<String> {
    match devices() {
        Ok(list) if list.iter().any(|d| usable(d) && d.kind != DeviceKind::Cpu) => None,
        Ok(_) => Some("no Vulkan GPU".into()),
        Err(e) => Some(e.to_string()),
    }
}

fn usable(device: &DeviceInfo) -> bool {
    device.missing.is_empty()
}

fn options(choice: &BackendChoice) -> Options {
    let validation = choice.validation.map(|v| match v {
        Validate::Sync => Validation::Sync,
        Validate::Gpu => Validation::GpuAssisted,
    });
    Options { device: choice.device, validation, timeout: choice.timeout }
}

/// A device, for JSON.
#[derive(Serialize)]
struct ListedDevice {
    index: usize,
    name: String,
    kind: &'static str,
    vulkan: String,
    driver: String,
    /// Features it lacks to be usable.
    missing: Vec<String>,
}

impl ListedDevice {
    fn of(d: &DeviceInfo) -> ListedDevice {
        ListedDevice {
            index: d.index,
            name: d.name.clone(),
            kind: kind(d.kind),
            vulkan: version(d),
            driver: d.driver.clone(),
            missing: d.missing.iter().map(|m| m.to_string()).collect(),
        }
    }
}

/// Returns a table of the Vulkan devices, or why there are none; or a list of them as JSON.
pub fn list_devices(json: bool) -> Result<String, RunError> {
    match devices() {
        Ok(list) if json => listed(&list),
        Err(GpuError::NoDevice | GpuError::NoLoader) if json => listed(&[]),
        Ok(list) if !list.is_empty() => Ok(table(&list)),
        Ok(_) | Err(GpuError::NoDevice) => Ok(without("device")),
        Err(GpuError::NoLoader) => Ok(without("loader")),
        Err(e) => Err(RunError::Device(e)),
    }
}

fn listed(list: &[DeviceInfo]) -> Result<String, RunError> {
    let list: Vec<ListedDevice> = list.iter().map(ListedDevice::of).collect();
    Ok(console::json(&list)?)
}

fn without(what: &str) -> String {
    format!("No Vulkan {what} found: the scalar backend will be used.\n")
}

fn table(list: &[DeviceInfo]) -> String {
    let head = ["index", "name", "kind", "Vulkan", "driver", "usable"].map(String::from);
    let rows: Vec<[String; 6]> = std::iter::once(head).chain(list.iter().map(row)).collect();
    let width = |n: usize| rows.iter().map(|r| r[n].chars().count()).max().unwrap_or(0);
    let widths: [usize; 6] = std::array::from_fn(width);
    let line = |row: &[String; 6]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    let of_cpu = list.iter().any(|d| d.kind == DeviceKind::Cpu).then(|| CPU_NOTE.to_string());
    let of_mesa = list.iter().find_map(|d| old_mesa(&d.driver)).map(of_old_mesa);
    rows.iter().map(line).chain(of_cpu).chain(of_mesa).collect()
}

/// Printed below a table that contains CPUs.
const CPU_NOTE: &str =
    "Vulkan on a CPU is meant for tests: the scalar backend computes the same flow in less time.\n";

/// First major version of Mesa taken to gather. Without AVX-512, older ones read memory lane by
/// lane: 22.3.6 does, 25.0.7 does not.
const GATHERING_MESA: u32 = 23;

/// The note on an older Mesa. A sweep of KITTI drive 0005 takes 125 ms with 22.3.6, 63 with 25.0.7
/// and 32 with the scalar backend (2 cores of an AMD EPYC, Zen 3, medians of 5 to 11 runs).
fn of_old_mesa(version: &str) -> String {
    format!(
        "Mesa {version} reads memory lane by lane on processors without AVX-512: with 25.0.7 a \
         sweep takes half the time.\n"
    )
}

/// The Mesa version in a driver description of llvmpipe, if it is that old.
fn old_mesa(driver: &str) -> Option<&str> {
    let (_, of_mesa) = driver.strip_prefix("llvmpipe")?.split_once("Mesa ")?;
    let version = of_mesa.split(' ').next()?;
    let major: u32 = version.split('.').next()?.parse().ok()?;
    (major < GATHERING_MESA).then_some(version)
}

fn row(d: &DeviceInfo) -> [String; 6] {
    let missing = match usable(d) {
        true => "yes".to_string(),
        false => format!("no: missing {}", d.missing.join(", ")),
    };
    let (kind, version) = (kind(d.kind).into(), version(d));
    [d.index.to_string(), d.name.clone(), kind, version, d.driver.clone(), missing]
}

fn kind(kind: DeviceKind) -> &'static str {
    match kind {
        DeviceKind::Discrete => "discrete GPU",
        DeviceKind::Integrated => "integrated GPU",
        DeviceKind::Virtual => "virtual GPU",
        DeviceKind::Other => "other",
        DeviceKind::Cpu => "CPU",
    }
}

fn version(d: &DeviceInfo) -> String {
    d.api_version.map(|v| v.to_string()).join(".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_mesa_is_recognised_by_its_driver() {
        assert_eq!(old_mesa("llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"), Some("22.3.6"));
        for driver in [
            "llvmpipe Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)",
            "llvmpipe Mesa git",
            "llvmpipe",
            "radv Mesa 22.3.6",
            "NVIDIA 570.1",
        ] {
            assert_eq!(old_mesa(driver), None, "{driver}");
        }
    }
}
