//! Which devices there are, and which one to use.

use crate::GpuError;
use crate::error::failed;
use crate::instance::Instance;
use ash::vk;
use std::ffi::CStr;

/// The kind of a device, fastest kind first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// A GPU that shares the host's memory.
    Integrated,
    /// A GPU seen through a virtual machine.
    Virtual,
    /// None of the others.
    Other,
    /// A software implementation.
    Cpu,
}

/// The limits a schedule is checked against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest buffer a kernel can bind.
    pub storage_buffer_bytes: u64,
    /// Maximum number of storage buffers a kernel can bind.
    pub storage_buffers: u32,
    /// Alignment of storage buffers within a heap.
    pub storage_alignment_bytes: u64,
    /// Largest single allocation, hence the largest total of a heap's buffers.
    pub allocation_bytes: u64,
    /// Maximum number of invocations in a workgroup.
    pub invocations: u32,
    /// Largest workgroup along each axis.
    pub workgroup: [u32; 3],
    /// Maximum number of workgroups of a dispatch along each axis.
    pub workgroups: [u32; 3],
    /// Workgroup memory of a kernel. Not checked: a kernel does not declare its use.
    pub shared_bytes: u32,
    /// Length of a timestamp tick; zero if there are no timestamps.
    pub timestamp_ns: f32,
    /// Meaningful bits of a timestamp; zero if there are no timestamps.
    pub timestamp_bits: u32,
}

/// A device as the loader lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceInfo {
    /// Position in [`devices()`], for [`crate::Options::device`].
    pub index: usize,
    /// The driver's name for the device.
    pub name: String,
    /// Its kind.
    pub kind: DeviceKind,
    /// The Vulkan version it implements: major, minor, patch.
    pub api_version: [u32; 3],
    /// Name and version of the driver.
    pub driver: String,
    /// Its limits.
    pub limits: Limits,
    /// Requirements it does not meet; empty if it can be used.
    pub missing: Vec<String>,
}

/// Lists all devices, including those that lack something.
///
/// # Errors
/// `NoLoader`; `NoDevice` if there is no driver; `Vulkan`.
pub fn devices() -> Result<Vec<DeviceInfo>, GpuError> {
    let found = enumerate(&Instance::new(None)?)?;
    Ok(found.into_iter().map(|found| found.info).collect())
}

/// A listed device with what is needed to open it.
pub(crate) struct Physical {
    pub handle: vk::PhysicalDevice,
    pub queue_family: u32,
    pub info: DeviceInfo,
}

/// The requested device, or else the first of the fastest kind that lacks nothing.
pub(crate) fn select(instance: &Instance, index: Option<usize>) -> Result<Physical, GpuError> {
    let mut found = enumerate(instance)?.into_iter();
    let chosen = match index {
        Some(index) => found.nth(index),
        None => found.min_by_key(|d| (!d.info.missing.is_empty(), d.info.kind)),
    };
    let chosen = chosen.ok_or(GpuError::NoDevice)?;
    if chosen.info.missing.is_empty() {
        return Ok(chosen);
    }
    Err(GpuError::Unsupported { device: chosen.info.name, what: chosen.info.missing.join(", ") })
}

fn enumerate(instance: &Instance) -> Result<Vec<Physical>, GpuError> {
    // SAFETY: the instance is alive.
    let handles = unsafe { instance.raw().enumerate_physical_devices() }
        .map_err(failed("vkEnumeratePhysicalDevices"))?;
    let described = handles.into_iter().enumerate();
    Ok(described.map(|(i, h)| describe(instance.raw(), i, h)).collect())
}

fn describe(instance: &ash::Instance, index: usize, handle: vk::PhysicalDevice) -> Physical {
    // SAFETY: the handle was just enumerated from this instance.
    let (base, families) = unsafe {
        (
            instance.get_physical_device_properties(handle),
            instance.get_physical_device_queue_family_properties(handle),
        )
    };
    let supported = base.api_version >= vk::API_VERSION_1_1;
    let compute = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let family = families.iter().position(compute);
    let mut missing = Vec::new();
    if !supported {
        missing.push("Vulkan 1.1".to_owned());
    }
    if family.is_none() {
        missing.push("a compute queue".to_owned());
    }
    let bits = family.map_or(0, |f| families[f].timestamp_valid_bits);
    let allocation_bytes = if supported { allocation_limit(instance, handle) } else { 0 };
    let version = base.api_version;
    let info = DeviceInfo {
        index,
        name: text(base.device_name_as_c_str().ok()),
        kind: kind(base.device_type),
        api_version: [
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version),
        ],
        driver: driver(instance, handle, &base),
        limits: limits(&base.limits, allocation_bytes, bits),
        missing,
    };
    Physical { handle, queue_family: family.unwrap_or(0) as u32, info }
}

fn allocation_limit(instance: &ash::Instance, handle: vk::PhysicalDevice) -> u64 {
    let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
    let mut chain = vk::PhysicalDeviceProperties2::default().push_next(&mut maintenance);
    // SAFETY: the device implements Vulkan 1.1, which includes the query and the structure.
    unsafe { instance.get_physical_device_properties2(handle, &mut chain) };
    maintenance.max_memory_allocation_size
}

fn driver(
    instance: &ash::Instance,
    handle: vk::PhysicalDevice,
    base: &vk::PhysicalDeviceProperties,
) -> String {
    if base.api_version < vk::API_VERSION_1_2 {
        return format!("version {:#x}", base.driver_version);
    }
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut chain = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the device implements Vulkan 1.2, which includes the query and the structure.
    unsafe { instance.get_physical_device_properties2(handle, &mut chain) };
    let name = text(driver.driver_name_as_c_str().ok());
    format!("{name} {}", text(driver.driver_info_as_c_str().ok()))
}

fn limits(from: &vk::PhysicalDeviceLimits, allocation_bytes: u64, timestamp_bits: u32) -> Limits {
    let per_stage = from.max_per_stage_descriptor_storage_buffers;
    let per_set = from.max_descriptor_set_storage_buffers;
    Limits {
        storage_buffer_bytes: from.max_storage_buffer_range.into(),
        storage_buffers: per_stage.min(per_set).min(from.max_per_stage_resources),
        storage_alignment_bytes: from.min_storage_buffer_offset_alignment,
        allocation_bytes,
        invocations: from.max_compute_work_group_invocations,
        workgroup: from.max_compute_work_group_size,
        workgroups: from.max_compute_work_group_count,
        shared_bytes: from.max_compute_shared_memory_size,
        timestamp_ns: if timestamp_bits == 0 { 0.0 } else { from.timestamp_period },
        timestamp_bits,
    }
}

fn kind(of: vk::PhysicalDeviceType) -> DeviceKind {
    match of {
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
        vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
        _ => DeviceKind::Other,
    }
}

fn text(name: Option<&CStr>) -> String {
    name.unwrap_or_default().to_string_lossy().into_owned()
}
