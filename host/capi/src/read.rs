//! Reading results.

use raywake_core::digest::Digest;
use raywake_embed::{
    ColumnRecord, FlowEstimator, OBJECTS_MAX, ObjectRecord, PointRecord, TrackletRecord,
};

use crate::handle::Handle;
use crate::status::{CallStatus, Refusal};

/// Initial value of a digest.
pub const RAYWAKE_DIGEST_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Writes records to the caller's array.
///
/// # Safety
/// `to` is null or has room for `room` elements; `count` is null or writable.
unsafe fn write<T>(
    records: impl ExactSizeIterator<Item = T>,
    to: *mut T,
    room: usize,
    count: *mut usize,
) -> Result<(), Refusal> {
    if to.is_null() && room > 0 {
        return Err(Refusal::null("records"));
    }
    if !count.is_null() {
        // SAFETY: guaranteed by the caller.
        unsafe { count.write_unaligned(records.len()) };
    }
    for (n, record) in records.take(room).enumerate() {
        // SAFETY: guaranteed by the caller.
        unsafe { to.add(n).write_unaligned(record) };
    }
    Ok(())
}

fn columns(found: &FlowEstimator) -> impl ExactSizeIterator<Item = ColumnRecord> {
    found.columns().iter().map(ColumnRecord::from)
}

fn tracklets(found: &FlowEstimator) -> impl ExactSizeIterator<Item = TrackletRecord> {
    let mut tracklets = found.tracklets().map(TrackletRecord::from);
    (0..found.tracklet_count()).map(move |_| tracklets.next().unwrap_or_default())
}

fn objects(found: &FlowEstimator) -> impl ExactSizeIterator<Item = ObjectRecord> {
    found.objects().iter().map(ObjectRecord::from)
}

/// # Safety
/// `estimator` as for every function.
unsafe fn read(
    estimator: *mut Handle,
    read: impl FnOnce(&FlowEstimator) -> Result<(), Refusal>,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    let result = unsafe { Handle::enter(estimator) }
        .and_then(|mut turn| turn.team().read(read).map_err(Refusal::from)?);
    CallStatus::of(result)
}

/// Reads the flow of the solid columns of the sweep before the last: writes the first `room` of
/// them to `records`, which may be null if `room` is 0, and their total to `count`, which may be
/// null.
///
/// # Safety
/// Pointers are null or valid; `estimator` is null, or was an estimator once and its memory still
/// exists.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_columns(
    estimator: *mut Handle,
    records: *mut ColumnRecord,
    room: usize,
    count: *mut usize,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { read(estimator, |found| write(columns(found), records, room, count)) }
}

/// Reads the flow of the returns of the sweep before the last, in their order. Like
/// `raywake_columns`.
///
/// # Safety
/// As for `raywake_columns`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_points(
    estimator: *mut Handle,
    records: *mut PointRecord,
    room: usize,
    count: *mut usize,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        read(estimator, |found| match found.points() {
            Some(points) => write(points.iter().map(PointRecord::from), records, room, count),
            None => write(std::iter::empty(), records, room, count),
        })
    }
}

/// Reads the tracklets at the time of the last sweep. Like `raywake_columns`.
///
/// # Safety
/// As for `raywake_columns`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_tracklets(
    estimator: *mut Handle,
    records: *mut TrackletRecord,
    room: usize,
    count: *mut usize,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { read(estimator, |found| write(tracklets(found), records, room, count)) }
}

/// Reads the objects in the sweep before the last, if the options ask for them: vehicles, people,
/// two-wheelers, and whatever else moves. Like `raywake_columns`.
///
/// # Safety
/// As for `raywake_columns`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_objects(
    estimator: *mut Handle,
    records: *mut ObjectRecord,
    room: usize,
    count: *mut usize,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { read(estimator, |found| write(objects(found), records, room, count)) }
}

/// Adds everything that can be read, except objects, to a digest that starts as
/// `RAYWAKE_DIGEST_START`. Called after every sweep of a recording, it gives the digest that the
/// program `raywake` prints.
///
/// # Safety
/// As for `raywake_columns`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn raywake_add_to_digest(
    estimator: *mut Handle,
    digest: *mut u64,
) -> CallStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        read(estimator, |found| {
            if digest.is_null() {
                return Err(Refusal::null("digest"));
            }
            let mut sum = Digest::resume(digest.read_unaligned());
            found.add_to(&mut sum);
            digest.write_unaligned(sum.value());
            Ok(())
        })
    }
}

/// Maximum number of objects.
pub const RAYWAKE_OBJECTS_MAX: usize = 160;

const _: () = assert!(RAYWAKE_OBJECTS_MAX == OBJECTS_MAX);
const _: () = assert!(Digest::START.value() == RAYWAKE_DIGEST_START);
