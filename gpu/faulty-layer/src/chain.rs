//! How the loader reaches this layer, and this layer the next one. Structures as in the loader's
//! `vk_layer.h`.

use crate::calls::{fault, take};
use ash::vk;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The interface of layers that this one has.
const INTERFACE: u32 = 2;
/// What the loader adds to the information of `vkCreateInstance` and `vkCreateDevice`.
const LOADER_INSTANCE: i32 = 47;
const LOADER_DEVICE: i32 = 48;
/// Of these, that which leads to the next layer.
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

/// A member of a chain of information.
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
    /// Of a device's chain; of an instance's it is something else.
    device: vk::PFN_vkGetDeviceProcAddr,
}

static NEXT_INSTANCE: AtomicUsize = AtomicUsize::new(0);
static NEXT_DEVICE: AtomicUsize = AtomicUsize::new(0);
static INSTANCE: AtomicUsize = AtomicUsize::new(0);

/// Agrees with the loader.
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

/// The next layer in a chain; the one after it takes its place there.
///
/// # Safety
/// A chain as the loader makes it.
unsafe fn advance<'a>(mut at: *mut Information, kind: i32) -> Option<&'a Link> {
    // SAFETY: the caller's promise: members are valid, and end with a null pointer.
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

/// # Safety
/// As `vkCreateInstance`, called by the loader.
unsafe extern "system" fn create_instance(
    info: *const vk::InstanceCreateInfo<'static>,
    allocator: *const vk::AllocationCallbacks<'static>,
    instance: *mut vk::Instance,
) -> vk::Result {
    // SAFETY: the caller's promise throughout.
    unsafe {
        let Some(link) = advance((*info).p_next.cast_mut().cast(), LOADER_INSTANCE) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let next = link.instance;
        NEXT_INSTANCE.store(next as usize, Relaxed);
        let Some(create) = next(vk::Instance::null(), c"vkCreateInstance".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create: vk::PFN_vkCreateInstance = std::mem::transmute(create);
        let result = create(info, allocator, instance);
        INSTANCE.store(std::mem::transmute::<vk::Instance, usize>(*instance), Relaxed);
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
        let Some(link) = advance((*info).p_next.cast_mut().cast(), LOADER_DEVICE) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let next = link.instance;
        NEXT_DEVICE.store(link.device as usize, Relaxed);
        let owner = std::mem::transmute::<usize, vk::Instance>(INSTANCE.load(Relaxed));
        let Some(create) = next(owner, c"vkCreateDevice".as_ptr()) else {
            return vk::Result::ERROR_INITIALIZATION_FAILED;
        };
        let create: vk::PFN_vkCreateDevice = std::mem::transmute(create);
        create(physical, info, allocator, device)
    }
}

/// # Safety
/// As `vkGetInstanceProcAddr`.
unsafe extern "system" fn instance_function(
    instance: vk::Instance,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise; functions are cast to the types of their names by who asks.
    unsafe {
        let own = match CStr::from_ptr(name).to_bytes() {
            b"vkGetInstanceProcAddr" => instance_function as *const c_void,
            b"vkGetDeviceProcAddr" => device_function as *const c_void,
            b"vkCreateInstance" => create_instance as *const c_void,
            b"vkCreateDevice" => create_device as *const c_void,
            name_bytes => {
                let next = NEXT_INSTANCE.load(Relaxed);
                if next == 0 {
                    return None;
                }
                let next: vk::PFN_vkGetInstanceProcAddr = std::mem::transmute(next);
                return take(name_bytes, next(instance, name));
            }
        };
        std::mem::transmute::<*const c_void, vk::PFN_vkVoidFunction>(own)
    }
}

/// # Safety
/// As `vkGetDeviceProcAddr`.
unsafe extern "system" fn device_function(
    device: vk::Device,
    name: *const c_char,
) -> vk::PFN_vkVoidFunction {
    // SAFETY: the caller's promise; functions are cast to the types of their names by who asks.
    unsafe {
        let bytes = CStr::from_ptr(name).to_bytes();
        if bytes == b"vkGetDeviceProcAddr" {
            let own = device_function as *const c_void;
            return std::mem::transmute::<*const c_void, vk::PFN_vkVoidFunction>(own);
        }
        let next: vk::PFN_vkGetDeviceProcAddr = std::mem::transmute(NEXT_DEVICE.load(Relaxed));
        take(bytes, next(device, name))
    }
}
