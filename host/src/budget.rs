//! Every byte a run takes, known before its first sweep: `raywake budget` and `memory-layout.md`.

mod markdown;
mod traffic;

use raywake_core::layout::{BUFFERS, Heap};
use raywake_core::params::{POINTS_MAX, Profile};
use raywake_core::pipeline::Pipeline;
use raywake_core::sweep::Point;
use raywake_core::tracklet::Tracklets;
use raywake_core::{background_filter, occupancy_constancy};

use crate::args;
use crate::backend::Backend;
use crate::backend::scalar::Scalar;
use crate::config;
use crate::drive::Drive;
use crate::engine::say;
use crate::error::Error;
use crate::report::bytes;
use crate::statistics::BUDGET_MS;

pub use markdown::memory_layout;

/// Every buffer begins at a multiple of this, bytes; of more where the device asks for it.
pub const ALIGNMENT: usize = 16;

const HEAPS: [Heap; 3] = [Heap::Upload, Heap::Device, Heap::Readback];

/// The profiles `memory-layout.md` is about.
pub fn shipped() -> [Profile; 3] {
    [Profile::hdl64(), Profile::wide(), Profile::dissertation()]
}

/// `raywake budget`: the layout of a profile, of all shipped ones where none is named. Fails where
/// one of them takes more than the limit.
pub fn budget(args: &args::Budget) -> Result<(), Error> {
    let one = args.profile.profile.is_some() || args.profile.config.is_some();
    let profiles = if one { vec![config::profile(&args.profile)?] } else { shipped().to_vec() };
    say(false, &memory_layout(&profiles))?;
    let most = profiles.iter().map(|p| device_bytes(p) + host_bytes(p, false)).max();
    match (most, args.limit) {
        (Some(bytes), Some(limit)) if bytes > limit => Err(Error::OverBudget { bytes, limit }),
        _ => Ok(()),
    }
}

/// Bytes of a heap, padding between buffers included.
pub fn heap_bytes(heap: Heap, profile: &Profile) -> u64 {
    let rows = BUFFERS.iter().filter(|b| b.heap == heap);
    rows.map(|b| b.bytes(profile).next_multiple_of(ALIGNMENT) as u64).sum()
}

/// Bytes of all heaps.
pub fn device_bytes(profile: &Profile) -> u64 {
    HEAPS.iter().map(|heap| heap_bytes(*heap, profile)).sum()
}

/// A part of the host's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What it is.
    pub name: &'static str,
    /// The type it is made of.
    pub kind: &'static str,
    /// Its size.
    pub bytes: u64,
}

/// The parts of the host's memory held throughout a run; the scalar backend has its buffers there
/// too. Sweeps grow to the largest one read; they are taken to be at the capacity.
pub fn host_parts(profile: &Profile, scalar: bool) -> Vec<Part> {
    let part = |name, kind, bytes: usize| Part { name, kind, bytes: bytes as u64 };
    let tracklets = size_of::<Tracklets>();
    let pipeline = size_of::<Pipeline>();
    let words = background_filter::TABLE_WORDS
        + occupancy_constancy::WEIGHT_WORDS
        + occupancy_constancy::SCORES_MAX;
    let mut parts = vec![
        part("tracklets", "Tracklets", tracklets),
        part("rest of the pipeline", "Pipeline", pipeline - tracklets),
        part(
            "flow of columns and returns",
            "ColumnFlow, PointFlow",
            Drive::bytes(profile) - pipeline,
        ),
        part("two sweeps at capacity", "Point", 2 * POINTS_MAX * size_of::<Point>()),
        part("learned tables", "Tables", 4 * words),
    ];
    if scalar {
        parts.push(part(
            "buffers of the scalar backend",
            "Scalar",
            Scalar::bytes(profile) + 4 * words,
        ));
    }
    parts
}

/// Bytes of all parts.
pub fn host_bytes(profile: &Profile, scalar: bool) -> u64 {
    host_parts(profile, scalar).iter().map(|p| p.bytes).sum()
}

/// What a run takes, for the head of its report.
pub fn paragraph(profile: &Profile, backend: &Backend, filter: &str) -> String {
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
         time budget: {BUDGET_MS:.0} ms per sweep\n",
        profile.name,
        backend.name(),
        backend.device(),
        bytes(host_bytes(profile, scalar)),
        parts.collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums() {
        let p = Profile::hdl64();
        let (device, scalar) = (device_bytes(&p), host_bytes(&p, true) - host_bytes(&p, false));
        assert!((1 << 20..64 << 20).contains(&device), "{device}");
        assert!(scalar < device && scalar > heap_bytes(Heap::Upload, &p), "{scalar}");
        let text = memory_layout(&shipped());
        assert!(text.contains("| hdl64, dissertation | wide |"), "{text}");
        assert!(BUFFERS.iter().all(|b| text.contains(&format!("| `{}` |", b.name))));
    }
}
