//! How the loader reaches this layer, and this layer the next one. Structures are as in the
//! loader's `vk_layer.h`.

use crate::calls::{fault, handed_out, kept, take};
use ash::vk::{self, Handle};
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

/// Version of the layer interface that this one implements.
const INTERFACE: u32 = 2;
/// Types of what the loader adds to the create info of `vkCreateInstance` and `vkCreateDevice`.
const LOADER_INSTANCE: i32 = 47;
const LOADER_DEVICE: i32 = 48;
/// Of these, the kind that leads to the next layer.
const LINK: i32 = 0;

#[repr(C)]
struct Negotiation {
    kind: u32,
    next: *const c_void,
    version: u32,
    instance: vk::PFN_vkGetInstanceProcAddr,
    device: vk::PFN_vkGetDeviceProcAddr,
    physical: *const c_void,
}

/// A member of a create info's chain.
#[repr(C)]
struct Information {
    kind: i32,
    next: *mut Information,
    function: i32,
    link: *mut Link,
}

/// The next layer.
#[repr(C)]
struct Link {
    next: *mut Link,
    instance: vk::PFN_vkGetInstanceProcAddr,
    /// Only in a device's chain; in an instance's it is something else.
    device: vk::PFN_vkGetDeviceProcAddr,
}

static NEXT_INSTANCE: AtomicUsize = AtomicUsize::new(0);
static NEXT_DEVICE: AtomicUsize = AtomicUsize::new(0);
static INSTANCE: AtomicU64 = AtomicU64::new(0);

/// The instance that was created last.
fn instance() -> vk::Instance {
    vk::Instance::from_raw(INSTANCE.load(Relaxed))
}

/// Agrees on the interface with the loader.
///
/// # Safety
/// The loader's promise: `with` is a valid structure of its kind.
#[unsafe(no_mangle)]
unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(with: *mut c_void) -> vk::Result {
    // SAFETY: the caller's promise.
    let with = unsafe { &mut *with.cast::<Negotiation>() };
    with.version = INTERFACE;
    (with.instance, with.device) = (instance_function, device_function);
    with.physical = std::ptr::null();
    vk::Result::SUCCESS
}

/// Takes the next layer from a chain; the one after it takes its place there.
///
/// # Safety
/// The chain is as the loader makes it.
unsafe fn advance<'a>(mut at: *mut Information, kind: i32) -> Option<&'a Link> {
    // SAFETY: the caller's promise: members are valid and end with a null pointer.
    unsafe {
        while !at.is_null() {
            let member = &mut *at;
            if member.kind == kind && member.function == LINK {
                let link = &*member.link;
                member.link = link.next;
                return Some(link);
            }
            at = member.next;
        }
    }
    None
}

/// The next layer's function of a name.
fn next_of(
    link: Option<&Link>,
    owner: vk::Instance,
    name: &CStr,
) -> Result<vk::PFN_vkVoidFunction, vk::Result> {
    let link = link.ok_or(vk::Result::ERROR_INITIALIZATION_FAILED)?;
    // SAFETY: the loader's function.
    Ok(unsafe { (link.instance)(owner, name.as_ptr()) })
}

/// # Safety
/// As `vkCreateInstance`, called by the loader.
unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'static>,
    allocator: *const vk::AllocationCallbacks<'static>,
    instance: *mut vk::Instance,
) -> vk::Result {
    if let Some(result) = fault("vkCreateInstance") {
        return vk::Result::from_raw(result);
    }
    // SAFETY: the caller's promise throughout.
    unsafe {
        let link = advance((*info).p_next.cast_mut().cast(), LOADER_INSTANCE);
        NEXT_INSTANCE.store(link.map_or(0, |link| link.instance as usize), Relaxed);
        let result = match next_of(link, vk::Instance::null(), c"vkCreateInstance") {
            Ok(create) => {
                let create: vk::PFN_vkCreateInstance = std::mem::transmute(create);
                create(info, allocator, instance)
            }
            Err(result) => return result,
        };
        INSTANCE.store((*instance).as_raw(), Relaxed);
        result
    }
}

/// # Safety
/// As `vkCreateDevice`, called by the loader.
unsafe extern "system" fn create_device(
    physical: vk::PhysicalDevice,
    info: *const vk::DeviceCreateInfo<'static>,
    allocator: *const vk::AllocationCallbacks<'static>,
    device: *mut vk::Device,
) -> vk::Result {
    if let Some(result) = fault("vkCreateDevice") {
        return vk::Result::from_raw(result);
    }
    // SAFETY: the caller's promise throughout.
    unsafe {
        let link = advance((*info).p_next.cast_mut().cast(), LOADER_DEVICE);
        NEXT_DEVICE.store(link.map_or(0, |link| link.device as usize), Relaxed);
        match next_of(link, instance(), c"vkCreateDevice") {
            Ok(create) => {
                let create: vk::PFN_vkCreateDevice = std::mem::transmute(create);
                create(physical, info, allocator, device)
            }
            Err(result) => result,
        }
    }
}

/// The functions that this layer implements itself, apart from those of `take`.
fn of_the_chain(name: &[u8]) -> Option<*const c_void> {
    match name {
        b"vkGetInstanceProcAddr" => Some(instance_function as *const c_void),
        b"vkGetDeviceProcAddr" => Some(device_function as *const c_void),
        b"vkCreateInstance" => Some(create_instance as *const c_void),
        b"vkCreateDevice" => Some(create_device as *const c_void),
        _ => None,
    }
}

/// # Safety
/// As `vkGetInstanceProcAddr`.
unsafe extern "system" fn instance_function(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    let bytes = unsafe { CStr::from_ptr(name) }.to_bytes();
    match of_the_chain(bytes) {
        Some(own) => handed_out(own),
        // Called before there is an instance.
        None if NEXT_INSTANCE.load(Relaxed) == 0 => None,
        None => {
            // SAFETY: put there by `create_instance`.
            let next: vk::PFN_vkGetInstanceProcAddr = unsafe { kept(&NEXT_INSTANCE) };
            // SAFETY: as this one was called.
            take(bytes, unsafe { next(instance, name) })
        }
    }
}

/// # Safety
/// As `vkGetDeviceProcAddr`, with a device of this layer.
unsafe extern "system" fn device_function(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise.
    let bytes = unsafe { CStr::from_ptr(name) }.to_bytes();
    if bytes == b"vkGetDeviceProcAddr" {
        return handed_out(device_function as *const c_void);
    }
    // SAFETY: put there by `create_device`.
    let next: vk::PFN_vkGetDeviceProcAddr = unsafe { kept(&NEXT_DEVICE) };
    // SAFETY: as this one was called.
    take(bytes, unsafe { next(device, name) })
}
