//! Every byte a run uses, known before its first sweep: `raywake budget` and `memory-layout.md`.

mod markdown;
mod parameters;
mod traffic;

use raywake_core::map::Bands;
use raywake_core::params::Profile;
use raywake_core::pipeline::Pipeline;
use raywake_core::refinement::Refinement;
use raywake_core::stages::{FLOW_PROGRAMS, MAP_PROGRAMS};
use raywake_core::stages::{background_filter, occupancy_constancy};
use raywake_core::sweep::Point;
use raywake_core::tracklet::Tracklets;
use raywake_gpu::{Buffer, Heap};
use raywake_kernels::schedule::Schedule;

use crate::args;
use crate::backend::{Backend, Scalar};
use crate::config;
use crate::console::{self, bytes, say};
use crate::drive::Drive;
use crate::error::RunError;
use crate::map::Mapper;
use crate::statistics::BUDGET_MS;
use crate::team;
use crate::track::Tracker;
use raywake_io::Error;
use raywake_objects::tracked::ObjectTracker;
use serde::Serialize;

pub use markdown::memory_layout;
pub use parameters::parameters;

/// Every buffer begins at a multiple of this, bytes, or of more if the device requires it.
pub const ALIGNMENT: u64 = 16;

const HEAPS: [Heap; 3] = [Heap::Upload, Heap::Device, Heap::Readback];

/// The profiles described in `memory-layout.md`.
pub fn shipped() -> Vec<Profile> {
    Profile::shipped().into_iter().chain([Profile::map()]).collect()
}

/// `raywake budget`: the layout of a profile, or of all shipped ones if none is named. Fails if one
/// of them needs more than the limit.
pub fn budget(args: &args::BudgetArgs) -> Result<(), RunError> {
    if args.parameters {
        say(false, &parameters())?;
        return Ok(());
    }
    let profiles = profiles(&args.profile)?;
    let text = if args.json { json(&profiles)? } else { memory_layout(&profiles) };
    say(false, &text)?;
    let most = profiles.iter().map(|p| device_bytes(p) + host_bytes(p, false)).max();
    match (most, args.limit) {
        (Some(bytes), Some(limit)) if bytes > limit => Err(RunError::OverBudget { bytes, limit }),
        _ => Ok(()),
    }
}

/// The memory of a profile, for JSON.
#[derive(Serialize)]
struct ProfileBudget {
    profile: String,
    device_bytes: u64,
    host_bytes: u64,
    buffers: Vec<BufferBudget>,
    host_parts: Vec<Part>,
}

#[derive(Serialize)]
struct BufferBudget {
    name: &'static str,
    heap: String,
    bytes: u64,
}

fn json(profiles: &[Profile]) -> Result<String, Error> {
    let of = |profile: &Profile| {
        let buffer = |b: &Buffer| {
            let heap = format!("{:?}", b.heap).to_lowercase();
            BufferBudget { name: b.name, heap, bytes: b.bytes }
        };
        ProfileBudget {
            profile: profile.name.to_string(),
            device_bytes: device_bytes(profile),
            host_bytes: host_bytes(profile, false),
            buffers: schedule(profile).buffers(profile).iter().map(buffer).collect(),
            host_parts: host_parts(profile, false),
        }
    };
    console::json(&profiles.iter().map(of).collect::<Vec<_>>())
}

/// The profiles asked for. `map` counts as one only here: nothing but `raywake map` uses it.
fn profiles(choice: &args::ProfileChoice) -> Result<Vec<Profile>, Error> {
    let map = Profile::map();
    match (&choice.profile, &choice.config) {
        (None, None) if choice.set.is_empty() => Ok(shipped().to_vec()),
        (Some(name), _) if *name == map.name.as_str() => Ok(vec![map]),
        _ => Ok(vec![config::profile(choice)?]),
    }
}

fn is_map(profile: &Profile) -> bool {
    *profile == Profile::map()
}

fn schedule(profile: &Profile) -> Schedule {
    Schedule::new(if is_map(profile) { MAP_PROGRAMS } else { FLOW_PROGRAMS }, profile)
}

/// Bytes of a heap, padding between buffers included.
pub fn heap_bytes(heap: Heap, profile: &Profile) -> u64 {
    let buffers = schedule(profile).buffers(profile);
    let of_heap = buffers.iter().filter(|b| b.heap == heap);
    of_heap.map(|b| b.bytes.next_multiple_of(ALIGNMENT)).sum()
}

/// Bytes of all heaps.
pub fn device_bytes(profile: &Profile) -> u64 {
    HEAPS.iter().map(|heap| heap_bytes(*heap, profile)).sum()
}

/// A part of the host's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Part {
    /// Description.
    pub name: &'static str,
    /// The type it consists of.
    pub kind: &'static str,
    /// Its size.
    pub bytes: u64,
}

/// The parts of the host's memory held throughout a run, including the buffers of the scalar
/// backend. Sweeps grow to the largest one read; they are counted at full capacity.
pub fn host_parts(profile: &Profile, scalar: bool) -> Vec<Part> {
    if is_map(profile) { map_parts(profile, scalar) } else { flow_parts(profile, scalar) }
}

fn part(name: &'static str, kind: &'static str, bytes: usize) -> Part {
    Part { name, kind, bytes: bytes as u64 }
}

/// [`host_parts`] of `raywake run`.
fn flow_parts(profile: &Profile, scalar: bool) -> Vec<Part> {
    let (tracklets, refinement) = (size_of::<Tracklets>(), size_of::<Refinement>());
    let pipeline = size_of::<Pipeline>();
    let words = background_filter::TABLE_WORDS
        + occupancy_constancy::WEIGHT_WORDS
        + occupancy_constancy::SCORES_MAX;
    let mut parts = vec![
        part("tracklets", "Tracklets", tracklets),
        part("clusters and their returns", "Refinement", refinement),
        part("rest of the pipeline", "Pipeline", pipeline - tracklets - refinement),
        part(
            "flow of columns and returns",
            "ColumnFlow, ReturnFlow",
            Drive::bytes(profile) - pipeline,
        ),
        part("two sweeps at capacity", "Point", 2 * profile.returns() * size_of::<Point>()),
        part("learned tables", "Tables", 4 * words),
    ];
    if scalar {
        parts.push(part("buffers of the scalar backend", "Scalar", 4 * Scalar::words(profile)));
    }
    parts
}

/// [`host_parts`] of `raywake map`. Its scalar backend has no buffers beyond the device's.
fn map_parts(profile: &Profile, scalar: bool) -> Vec<Part> {
    let mut parts = vec![
        part("mapper", "Mapper", size_of::<Mapper>()),
        part("bands", "Bands", size_of::<Bands>()),
        part("columns of the rays", "u32", profile.returns() * size_of::<u32>()),
        part("one sweep at capacity", "Point", profile.returns() * size_of::<Point>()),
    ];
    if scalar {
        let most = Mapper::bytes(profile);
        parts.push(part("buffers of the scalar backend, at most", "ScalarMap", most));
    }
    parts
}

/// What `raywake track` holds besides two sweeps and, with the flow, the parts of a run; on board,
/// the last one replaces all others.
pub fn track_parts() -> Vec<Part> {
    let on_board = part("objects on board", "ObjectTracker", size_of::<ObjectTracker>());
    let parts = Tracker::parts().map(|(name, kind, bytes)| part(name, kind, bytes));
    parts.into_iter().chain([on_board]).collect()
}

/// Bytes of all parts.
pub fn host_bytes(profile: &Profile, scalar: bool) -> u64 {
    host_parts(profile, scalar).iter().map(|p| p.bytes).sum()
}

/// A run's backend and its memory and time budgets, for the head of its report.
pub fn paragraph(profile: &Profile, drive: &Drive, filter: &str) -> String {
    let backend = drive.backend();
    let scalar = matches!(backend, Backend::Scalar(_));
    let device = match backend.census() {
        None => "no device memory".to_string(),
        Some(c) => format!(
            "device {} in {} allocations (upload {}, device {}, readback {})",
            bytes(c.upload_bytes + c.device_bytes + c.readback_bytes),
            c.memory_allocations,
            bytes(c.upload_bytes),
            bytes(c.device_bytes),
            bytes(c.readback_bytes)
        ),
    };
    let parts = host_parts(profile, scalar);
    let parts = parts.iter().map(|p| format!("{} {}", p.name, bytes(p.bytes)));
    format!(
        "profile {}, {} backend ({}), background filter: {filter}\n\
         memory budget: {device}; host {} ({})\n\
         time budget: {BUDGET_MS:.0} ms per sweep; threads on the CPU: {}, {}\n",
        profile.name,
        backend.name(),
        backend.device(),
        bytes(host_bytes(profile, scalar)),
        parts.collect::<Vec<_>>().join(", "),
        team::threads(),
        drive.simd().name()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::stages::{BUFFERS, BufferRow};

    #[test]
    fn the_map_alone() {
        let text = memory_layout(&[Profile::map()]);
        assert!(text.contains("\n### Totals\n") && !text.contains("\n## Totals\n"), "{text}");
        assert!(text.contains("| `updates` |") && !text.contains("| `pair_cost` |"), "{text}");
        assert!(device_bytes(&Profile::map()) >= Mapper::bytes(&Profile::map()) as u64);
        let named = |name: &str| {
            let profile = Some(name.to_string());
            profiles(&args::ProfileChoice { profile, ..Default::default() }).ok()
        };
        assert_eq!(named("map"), Some(vec![Profile::map()]));
        assert_eq!((named("wide"), named("maps")), (Some(vec![Profile::wide()]), None));
    }

    #[test]
    fn sums() {
        let p = Profile::hdl64();
        let (device, scalar) = (device_bytes(&p), host_bytes(&p, true) - host_bytes(&p, false));
        // With room for 262,144 returns.
        assert!((1 << 20..=40 << 20).contains(&device), "{device}");
        assert!(host_bytes(&p, true) <= 88 << 20, "{}", host_bytes(&p, true));
        assert!(scalar < device && scalar > heap_bytes(Heap::Upload, &p), "{scalar}");
        let text = memory_layout(&shipped());
        assert!(text.contains("| hdl64 | wide |"), "{text}");
        let mut renamed = p.clone();
        renamed.name = "renamed".try_into().unwrap_or_default();
        let shared = memory_layout(&[p, renamed, Profile::wide()]);
        assert!(shared.contains("| hdl64, renamed | wide |"), "equal sizes, one column: {shared}");
        let named = |row: &BufferRow| text.contains(&format!("| `{}` |", row.name));
        assert!(BUFFERS.iter().all(named), "{text}");
        assert!(text.contains("\n## Sparse map\n") && text.contains("\n## Records\n"));
    }
}
