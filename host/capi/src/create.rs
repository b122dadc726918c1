//! Options for an estimator, and its creation from them.

use std::ffi::{CStr, c_char, c_void};

use glam::{DQuat, DVec3};
use raywake_core::params::{AssignError, ParameterSetting, Profile, SENSORS_MAX};
use raywake_core::pose::Pose;
use raywake_core::sweep::{Rig, Timing};
use raywake_embed::{EstimatorOptions, FlowEstimator, Memory, TeamEstimator};

use crate::RAYWAKE_ABI_VERSION;
use crate::handle::Handle;
use crate::status::{CallStatus, ErrorText, Refusal, put, report};

/// A rigid transform `target_from_source`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CPose {
    /// Origin of the source frame in the target frame, m.
    pub translation: [f64; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

/// All returns are measured at the sweep's stamp.
pub const RAYWAKE_TIMING_AT_STAMP: u32 = 0;
/// Every return carries its time after the stamp.
pub const RAYWAKE_TIMING_OFFSET: u32 = 1;
/// The azimuth gives the time: the sensor spins clockwise seen from above, starts and ends at the
/// rear, and is stamped when it faces forward (KITTI's HDL-64E).
pub const RAYWAKE_TIMING_AZIMUTH: u32 = 2;
/// Maximum number of sensors of a rig.
pub const RAYWAKE_SENSORS_MAX: usize = 8;

const _: () = assert!(RAYWAKE_SENSORS_MAX == SENSORS_MAX);

/// Options for creating an estimator. A value of zero means the default.
#[repr(C)]
pub struct CreateOptions {
    /// `RAYWAKE_ABI_VERSION`.
    pub abi_version: u32,
    /// Threads that share the work; 0: as many as pay off, 1: only the calling thread.
    pub threads: u32,
    /// Name of a profile: `hdl64` (the default), `wide`, `far` or `dissertation`.
    pub profile: *const c_char,
    /// Parameters to set, each as `NAME=VALUE`; PARAMETERS.md lists them.
    pub settings: *const *const c_char,
    /// Number of settings.
    pub settings_count: usize,
    /// Maximum number of returns of a sweep; 0: as many as the profile takes. Of a sweep with more
    /// than the profile takes, that many are taken, evenly.
    pub points_max: usize,
    /// Not 0: poses are found by registration instead of being given.
    pub find_poses: u32,
    /// `RAYWAKE_TIMING_...`.
    pub timing: u32,
    /// Not 0: objects are tracked too, which needs more memory.
    pub objects: u32,
    /// `RAYWAKE_TIMING_OFFSET`: earliest time of a return after the stamp, s.
    pub from_s: f64,
    /// Duration of a sweep, s; 0 means 0.1.
    pub span_s: f64,
    /// Not 0: returns are still distorted by the vehicle's motion. Each is moved to the stamp
    /// according to its time.
    pub distorted: u32,
    /// Number of sensors; 0: one at the vehicle's origin.
    pub sensor_count: u32,
    /// `vehicle_from_sensor` of each: rays begin there.
    pub sensors: [CPose; RAYWAKE_SENSORS_MAX],
    /// Height of the ground under the vehicle in the vehicle frame, m: -1.73 if the vehicle's
    /// origin is 1.73 m above the ground.
    pub ground_m: f64,
    /// Returns in this box of the vehicle frame belong to the vehicle itself: minimum x and y,
    /// maximum x and y, m. All 0: no box.
    pub own_vehicle_m: [f32; 4],
}

/// A string given by the caller; none if it is null.
///
/// # Safety
/// `text` is null or a NUL-terminated string that does not change.
unsafe fn text<'a>(text: *const c_char, what: &str) -> Result<Option<&'a str>, Refusal> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: guaranteed by the caller.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(Some).map_err(|_| Refusal::invalid(format_args!("`{what}` is not UTF-8")))
}

/// Sets a parameter by `NAME=VALUE`.
fn assign(profile: &mut Profile, setting: &str) -> Result<(), Refusal> {
    let refuse = |is, requirement| Refusal::invalid(format_args!("`{setting}`: {is}{requirement}"));
    let to = ParameterSetting::parse(setting).ok_or_else(|| refuse("it must be ", "NAME=VALUE"))?;
    profile.assign(&to).map_err(|e| match e {
        AssignError::Unknown => refuse("there is no such parameter", ""),
        AssignError::InvalidValue(requirement) => refuse("it must be ", requirement),
    })
}

impl CPose {
    pub(crate) fn pose(&self) -> Pose {
        let translation = DVec3::from_array(self.translation);
        Pose { rotation: DQuat::from_array(self.rotation), translation }
    }
}

impl From<&Pose> for CPose {
    fn from(pose: &Pose) -> CPose {
        let (translation, rotation) = (pose.translation.to_array(), pose.rotation.to_array());
        CPose { translation, rotation }
    }
}

impl CreateOptions {
    fn rig(&self) -> Result<Rig, Refusal> {
        Ok(Rig {
            sensors: self.sensors()?,
            timing: self.timing()?,
            distorted: self.distorted != 0,
            ground_m: self.ground_m,
            own_vehicle: self.own_vehicle(),
        })
    }

    fn sensors(&self) -> Result<heapless::Vec<Pose, SENSORS_MAX>, Refusal> {
        const WHY: &str = "`sensor_count` is more than RAYWAKE_SENSORS_MAX";
        match self.sensors.get(..self.sensor_count as usize) {
            Some([]) => Ok([Pose::IDENTITY].into_iter().collect()),
            Some(sensors) => Ok(sensors.iter().map(CPose::pose).collect()),
            None => Err(Refusal::invalid(WHY)),
        }
    }

    fn timing(&self) -> Result<Timing, Refusal> {
        match self.timing {
            RAYWAKE_TIMING_AT_STAMP => Ok(Timing::AtStamp),
            RAYWAKE_TIMING_OFFSET => {
                Ok(Timing::Offset { from_s: self.from_s, span_s: self.span_s() })
            }
            RAYWAKE_TIMING_AZIMUTH => Ok(Timing::Azimuth { span_s: self.span_s() }),
            _ => Err(Refusal::invalid("`timing` must be RAYWAKE_TIMING_...")),
        }
    }

    fn span_s(&self) -> f64 {
        if self.span_s == 0.0 { 0.1 } else { self.span_s }
    }

    fn own_vehicle(&self) -> Option<[[f32; 2]; 2]> {
        let [x0, y0, x1, y1] = self.own_vehicle_m;
        (self.own_vehicle_m != [0.0; 4]).then_some([[x0, y0], [x1, y1]])
    }

    /// # Safety
    /// As for [`raywake_create`].
    unsafe fn profile(&self) -> Result<Profile, Refusal> {
        // SAFETY: guaranteed by the caller.
        let name = unsafe { text(self.profile, "profile") }?.unwrap_or("hdl64");
        let mut profile = Profile::named(name)
            .ok_or_else(|| Refusal::invalid(format_args!("there is no profile `{name}`")))?;
        if self.settings.is_null() && self.settings_count > 0 {
            return Err(Refusal::null("settings"));
        }
        for n in 0..self.settings_count {
            // SAFETY: guaranteed by the caller.
            let setting = unsafe { text(self.settings.add(n).read_unaligned(), "settings") }?;
            assign(&mut profile, setting.ok_or_else(|| Refusal::null("settings"))?)?;
        }
        Ok(profile)
    }

    /// # Safety
    /// As for [`raywake_create`].
    unsafe fn read(options: *const CreateOptions) -> Result<(EstimatorOptions, usize), Refusal> {
        if options.is_null() {
            return Err(Refusal::null("options"));
        }
        // The struct of another version may be shorter.
        // SAFETY: guaranteed by the caller.
        let abi = unsafe { options.cast::<u32>().read_unaligned() };
        if abi != RAYWAKE_ABI_VERSION {
            let why = format_args!("the program uses ABI {abi}, the library {RAYWAKE_ABI_VERSION}");
            return Err(Refusal::new(CallStatus::OtherAbi, why));
        }
        // SAFETY: guaranteed by the caller.
        let options = unsafe { options.read_unaligned() };
        // SAFETY: guaranteed by the caller.
        let profile = unsafe { options.profile() }?;
        Ok((options.about(profile)?, options.threads as usize))
    }

    fn about(&self, profile: Profile) -> Result<EstimatorOptions, Refusal> {
        let points_max = if self.points_max == 0 { profile.returns() } else { self.points_max };
        let (rig, registers, objects) = (self.rig()?, self.find_poses != 0, self.objects != 0);
        Ok(EstimatorOptions { profile, rig, points_max, registers, objects })
    }
}

fn needed(options: &EstimatorOptions) -> Result<usize, Refusal> {
    Ok(options.bytes()? + Handle::BYTES)
}

/// Takes over the caller's memory: as much of it as is needed.
///
/// # Safety
/// `memory` is null or points to `bytes` bytes that nobody else uses.
unsafe fn own(memory: *mut c_void, bytes: usize, needed: usize) -> Result<Memory, Refusal> {
    if memory.is_null() {
        return Err(Refusal::null("memory"));
    }
    if bytes < needed {
        let why = format_args!("{bytes} bytes were given, {needed} are needed");
        return Err(Refusal::new(CallStatus::MemoryTooSmall, why));
    }
    // SAFETY: guaranteed by the caller; `EstimatorOptions::bytes` is at most the size of an object.
    Ok(unsafe { std::slice::from_raw_parts_mut(memory.cast(), needed) })
}

fn make(
    options: &EstimatorOptions,
    threads: usize,
    memory: Memory,
) -> Result<*mut Handle, Refusal> {
    let (handle, memory) = memory.split_at_mut(Handle::BYTES);
    let team = TeamEstimator::new(FlowEstimator::new(options, memory)?, threads);
    Ok(Handle::put(team.map_err(|e| Refusal::new(CallStatus::NoThreads, e))?, handle))
}

/// Writes how many bytes of memory `raywake_create` needs, at any alignment.
///
/// # Safety
/// Pointers are null or valid; strings are NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_memory_needed(
    options: *const CreateOptions,
    bytes: *mut usize,
    error: *mut ErrorText,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    let found = unsafe { CreateOptions::read(options) }.and_then(|(options, _)| needed(&options));
    // SAFETY: guaranteed by the caller.
    let result = found.and_then(|found| unsafe { put(found, bytes, "bytes") });
    // SAFETY: guaranteed by the caller.
    unsafe { report(result, error) }
}

/// Creates an estimator in the caller's memory, which is the library's until `raywake_destroy`.
///
/// Threads are started here, and what they need is allocated on the heap; nothing is later.
///
/// # Safety
/// Pointers are null or valid; strings are NUL-terminated; `memory` has `bytes` bytes that nobody
/// else uses until the estimator is destroyed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_create(
    options: *const CreateOptions,
    memory: *mut c_void,
    bytes: usize,
    estimator: *mut *mut Handle,
    error: *mut ErrorText,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    let made = unsafe { CreateOptions::read(options) }.and_then(|(options, threads)| {
        if estimator.is_null() {
            return Err(Refusal::null("estimator"));
        }
        // SAFETY: guaranteed by the caller.
        let memory = unsafe { own(memory, bytes, needed(&options)?) }?;
        make(&options, threads, memory)
    });
    // SAFETY: guaranteed by the caller.
    let result = made.and_then(|handle| unsafe { put(handle, estimator, "estimator") });
    // SAFETY: guaranteed by the caller.
    unsafe { report(result, error) }
}
