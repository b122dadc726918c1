//! Which backend a run gets, and `raywake devices`.

use raywake_core::params::Profile;
use raywake_gpu::{DeviceInfo, DeviceKind, GpuError, Options, Validation, devices};

use crate::args::{BackendChoice, BackendKind, Validate};
use crate::backend::device::Device;
use crate::backend::scalar::Scalar;
use crate::backend::{Backend, Tables};
use crate::error::Error;

/// A backend with everything allocated, and why it is not a device where one might be expected.
pub struct Chosen {
    /// The backend, not yet sealed.
    pub backend: Backend,
    /// For the user.
    pub note: Option<String>,
}

/// Makes the backend asked for.
pub fn backend(choice: &BackendChoice, profile: &Profile, tables: Tables) -> Result<Chosen, Error> {
    let device_wanted = choice.device.is_some() || choice.validation.is_some();
    let lacking = match choice.backend {
        BackendKind::Scalar if device_wanted => {
            let what = "--device and --validation are for Vulkan, --backend scalar is not";
            return Err(Error::Usage(what.into()));
        }
        BackendKind::Scalar => return Ok(scalar(profile, tables, None)),
        BackendKind::Vulkan => None,
        BackendKind::Auto if device_wanted => None,
        BackendKind::Auto => no_device(),
    };
    if let Some(why) = lacking {
        return Ok(scalar(profile, tables, Some(format!("{why}: scalar backend"))));
    }
    let device = Device::new(profile, &tables, &options(choice))?;
    Ok(Chosen { backend: Backend::Device(Box::new(device)), note: None })
}

fn scalar(profile: &Profile, tables: Tables, note: Option<String>) -> Chosen {
    Chosen { backend: Backend::Scalar(Box::new(Scalar::new(profile, tables))), note }
}

/// Why `auto` finds no device; none where there is one.
fn no_device() -> Option<String> {
    match devices() {
        Ok(list) if list.iter().any(|d| usable(d) && d.kind != DeviceKind::Cpu) => None,
        Ok(_) => Some("no Vulkan device other than a CPU".into()),
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

/// The table of Vulkan devices, or why there is none.
pub fn list_devices() -> Result<String, Error> {
    match devices() {
        Ok(list) => Ok(table(&list)),
        Err(GpuError::NoLoader) => {
            Ok("No Vulkan loader on this machine: runs use the scalar backend.\n".into())
        }
        Err(GpuError::NoDevice) => {
            Ok("No Vulkan device on this machine: runs use the scalar backend.\n".into())
        }
        Err(e) => Err(Error::Device(e)),
    }
}

fn table(list: &[DeviceInfo]) -> String {
    if list.is_empty() {
        return "No Vulkan device on this machine: runs use the scalar backend.\n".into();
    }
    let head = ["index", "name", "kind", "Vulkan", "driver", "usable"].map(String::from);
    let rows: Vec<[String; 6]> = std::iter::once(head).chain(list.iter().map(row)).collect();
    let width = |n: usize| rows.iter().map(|r| r[n].chars().count()).max().unwrap_or(0);
    let widths: [usize; 6] = std::array::from_fn(width);
    let line = |row: &[String; 6]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    rows.iter().map(line).collect()
}

fn row(d: &DeviceInfo) -> [String; 6] {
    let missing = match usable(d) {
        true => "yes".to_string(),
        false => format!("no: lacks {}", d.missing.join(", ")),
    };
    let kind = match d.kind {
        DeviceKind::Discrete => "discrete GPU",
        DeviceKind::Integrated => "integrated GPU",
        DeviceKind::Virtual => "virtual GPU",
        DeviceKind::Other => "other",
        DeviceKind::Cpu => "CPU",
    };
    let version = d.api_version.map(|v| v.to_string()).join(".");
    [d.index.to_string(), d.name.clone(), kind.into(), version, d.driver.clone(), missing]
}
