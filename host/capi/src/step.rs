//! Passing in a sweep.

use std::ffi::c_void;

use glam::DVec3;
use raywake_core::continuity::Reset;
use raywake_core::pose::Twist;
use raywake_core::sweep::Point;
use raywake_embed::{ReturnSource, ReturnsBy, StepSummary, SweepPlace};
use raywake_registration::odometry::PoseStatus;

use crate::create::CPose;
use crate::handle::Handle;
use crate::status::{CallStatus, ErrorText, Refusal, put, report};

/// Velocity of the vehicle, along its own axes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CTwist {
    /// m/s.
    pub linear: [f64; 3],
    /// Axis times rate, rad/s.
    pub angular: [f64; 3],
}

/// One sweep. The values of its returns may lie anywhere, `..._stride` bytes apart, like the fields
/// of a `PointCloud2`; the sweep is copied.
#[repr(C)]
pub struct SweepInput {
    /// Time of the stamp, s.
    pub stamp_s: f64,
    /// Pose of the vehicle at the stamp, used as it is, however much it jitters; null if poses are
    /// found.
    pub world_from_vehicle: *const CPose,
    /// Its velocity at the stamp; null: that between the previous pose and this one.
    pub twist: *const CTwist,
    /// Number of returns.
    pub count: usize,
    /// Three `float` each: x, y, z in the vehicle frame, m. (0, 0, 0) means no return.
    pub xyz: *const c_void,
    /// Bytes from one to the next; 0: 12.
    pub xyz_stride: usize,
    /// A `float` each: time after the stamp, s; null: 0.
    pub time_s: *const c_void,
    /// Bytes from one to the next; 0: 4.
    pub time_stride: usize,
    /// A byte each: index of the sensor; null: 0.
    pub sensor: *const c_void,
    /// Bytes from one to the next; 0: 1.
    pub sensor_stride: usize,
}

/// The sweep continues the previous one.
pub const RAYWAKE_RESET_NONE: u32 = 0;
/// It is the first sweep.
pub const RAYWAKE_RESET_FIRST: u32 = 1;
/// Time stood still or went backwards.
pub const RAYWAKE_RESET_BACKWARDS: u32 = 2;
/// Too much time has passed.
pub const RAYWAKE_RESET_GAP: u32 = 3;
/// The vehicle cannot have moved so fast.
pub const RAYWAKE_RESET_JUMP: u32 = 4;
/// The vehicle cannot have turned so fast.
pub const RAYWAKE_RESET_SPIN: u32 = 5;

/// The pose was given.
pub const RAYWAKE_POSE_GIVEN: u32 = 0;
/// The pose is that of the first sweep.
pub const RAYWAKE_POSE_START: u32 = 1;
/// The pose was found by registration.
pub const RAYWAKE_POSE_REGISTERED: u32 = 2;
/// The sweep shows too little: part of the motion is that of the previous sweep.
pub const RAYWAKE_POSE_DEGENERATE: u32 = 3;
/// The sweep matches nothing known: its motion is that of the previous sweep.
pub const RAYWAKE_POSE_LOST: u32 = 4;

/// Summary of a sweep.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct StepResult {
    /// Time from the previous sweep to this one, s; 0 if they are not a pair, and there is no flow.
    pub dt_s: f64,
    /// Solid columns of the previous sweep, whose flow can be read.
    pub columns: usize,
    /// Returns of the previous sweep, whose flow can be read.
    pub points: usize,
    /// Tracklets that can be read.
    pub tracklets: usize,
    /// Objects in the previous sweep that can be read.
    pub objects: usize,
    /// Columns with a valid match.
    pub matched: usize,
    /// Foreground columns of the sweep.
    pub foreground: usize,
    /// Foreground columns beyond the capacity.
    pub foreground_dropped: usize,
    /// Distinct rays of the sweep.
    pub rays: usize,
    /// Returns left out because the sweep has more than the profile takes.
    pub over_capacity: u64,
    /// Returns left out that have a NaN or an infinity.
    pub not_finite: u64,
    /// Returns left out at (0, 0, 0).
    pub no_return: u64,
    /// Returns left out that are too far away.
    pub too_far: u64,
    /// Returns left out because their sensor is not in the rig.
    pub unknown_sensor: u64,
    /// Returns of the own vehicle.
    pub own_vehicle: u64,
    /// Returns that the refinement had no room for.
    pub unrefined: u64,
    /// `RAYWAKE_RESET_...`: why the sweep does not continue the previous one.
    pub reset: u32,
    /// `RAYWAKE_POSE_...`: how its pose was obtained.
    pub pose_from: u32,
    /// Pose of the vehicle at the stamp.
    pub world_from_vehicle: CPose,
}

/// Numbers of the caller's, evenly spaced.
#[derive(Clone, Copy)]
struct Column {
    start: *const u8,
    stride: usize,
}

static ZERO: f32 = 0.0;

impl Column {
    /// The same zero for every element.
    const ZEROS: Column = Column { start: (&raw const ZERO).cast(), stride: 0 };

    fn new(
        start: *const c_void,
        stride: usize,
        bytes: usize,
        count: usize,
        what: &str,
    ) -> Result<Column, Refusal> {
        let stride = if stride == 0 { bytes } else { stride };
        if count > 0 && start.is_null() {
            return Err(Refusal::null(what));
        }
        if stride < bytes {
            let why = format_args!("`{what}_stride` is {stride}: less than {bytes} bytes");
            return Err(Refusal::invalid(why));
        }
        let all = stride.checked_mul(count).filter(|all| *all <= isize::MAX as usize);
        all.ok_or_else(|| {
            Refusal::invalid(format_args!("`count` times `{what}_stride` is too large"))
        })?;
        Ok(Column { start: start.cast(), stride })
    }

    /// # Safety
    /// The element exists.
    #[inline]
    unsafe fn get<T: Copy>(self, n: usize) -> T {
        // SAFETY: guaranteed by the caller.
        unsafe { self.start.add(n * self.stride).cast::<T>().read_unaligned() }
    }
}

/// # Safety
/// `from` is null or readable.
unsafe fn get<T: Copy>(from: *const T) -> Option<T> {
    // SAFETY: guaranteed by the caller.
    (!from.is_null()).then(|| unsafe { from.read_unaligned() })
}

impl CTwist {
    fn twist(&self) -> Twist {
        let [linear, angular] = [self.linear, self.angular].map(DVec3::from_array);
        Twist { linear, angular }
    }
}

impl SweepInput {
    /// # Safety
    /// As for [`raywake_step`].
    unsafe fn place(&self) -> SweepPlace {
        // SAFETY: guaranteed by the caller.
        let (pose, twist) = unsafe { (get(self.world_from_vehicle), get(self.twist)) };
        SweepPlace {
            stamp_s: self.stamp_s,
            pose: pose.map(|pose| pose.pose()),
            twist: twist.map(|twist| twist.twist()),
        }
    }

    /// # Safety
    /// As for [`raywake_step`].
    unsafe fn points(&self) -> Result<impl ReturnSource + use<>, Refusal> {
        let count = self.count;
        let xyz = Column::new(self.xyz, self.xyz_stride, 12, count, "xyz")?;
        let optional = |start: *const c_void, stride, bytes, what| match start.is_null() {
            true => Ok(Column::ZEROS),
            false => Column::new(start, stride, bytes, count, what),
        };
        let time = optional(self.time_s, self.time_stride, 4, "time")?;
        let sensor = optional(self.sensor, self.sensor_stride, 1, "sensor")?;
        let at = move |n| {
            // SAFETY: guaranteed by the caller.
            let (position, offset_s, sensor) =
                unsafe { (xyz.get(n), time.get(n), sensor.get::<u8>(n)) };
            Point { position, intensity: 0.0, offset_s, sensor: u32::from(sensor) }
        };
        Ok(ReturnsBy { count, at })
    }
}

const fn reset_code(reset: Option<Reset>) -> u32 {
    match reset {
        None => RAYWAKE_RESET_NONE,
        Some(Reset::First) => RAYWAKE_RESET_FIRST,
        Some(Reset::Backwards(_)) => RAYWAKE_RESET_BACKWARDS,
        Some(Reset::Gap(_)) => RAYWAKE_RESET_GAP,
        Some(Reset::Jump(_)) => RAYWAKE_RESET_JUMP,
        Some(Reset::Spin(_)) => RAYWAKE_RESET_SPIN,
    }
}

const fn pose_code(pose_status: Option<PoseStatus>) -> u32 {
    match pose_status {
        None => RAYWAKE_POSE_GIVEN,
        Some(PoseStatus::Start) => RAYWAKE_POSE_START,
        Some(PoseStatus::Registered) => RAYWAKE_POSE_REGISTERED,
        Some(PoseStatus::Degenerate) => RAYWAKE_POSE_DEGENERATE,
        Some(PoseStatus::Lost) => RAYWAKE_POSE_LOST,
    }
}

impl StepResult {
    fn new(summary: &StepSummary, tracklets: usize) -> StepResult {
        let (dropped, pair) = (&summary.dropped, summary.pair);
        StepResult {
            dt_s: pair.map_or(0.0, |pair| pair.dt_s),
            columns: pair.map_or(0, |pair| pair.columns),
            points: pair.map_or(0, |pair| pair.points),
            tracklets,
            objects: summary.objects,
            matched: pair.map_or(0, |pair| pair.valid),
            foreground: summary.foreground,
            foreground_dropped: pair.map_or(0, |pair| pair.foreground_dropped),
            rays: summary.rays,
            over_capacity: dropped.over_capacity,
            not_finite: dropped.not_finite,
            no_return: dropped.no_return,
            too_far: dropped.too_far,
            unknown_sensor: dropped.unknown_sensor,
            own_vehicle: dropped.own_vehicle,
            unrefined: summary.unrefined as u64,
            reset: reset_code(summary.reset),
            pose_from: pose_code(summary.pose_status),
            world_from_vehicle: CPose::from(&summary.pose),
        }
    }
}

/// Processes one sweep. The flow of the previous one can be read until the next call of this
/// function.
///
/// A sweep that is refused changes nothing.
///
/// # Safety
/// Pointers are null or valid, with `count` elements; `estimator` is null, or was an estimator once
/// and its memory still exists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_step(
    estimator: *mut Handle,
    sweep: *const SweepInput,
    result: *mut StepResult,
    error: *mut ErrorText,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    let stepped = unsafe { Handle::enter(estimator) }.and_then(|mut turn| {
        if sweep.is_null() {
            return Err(Refusal::null("sweep"));
        }
        // SAFETY: guaranteed by the caller.
        let sweep = unsafe { sweep.read_unaligned() };
        // SAFETY: guaranteed by the caller.
        let (place, points) = unsafe { (sweep.place(), sweep.points()?) };
        let team = turn.team();
        let summary = team.step(&place, points)?;
        Ok(StepResult::new(&summary, team.read(|e| e.tracklet_count())?))
    });
    // SAFETY: guaranteed by the caller.
    unsafe {
        let stepped = stepped.and_then(|found| match result.is_null() {
            true => Ok(()),
            false => put(found, result, "result"),
        });
        report(stepped, error)
    }
}
