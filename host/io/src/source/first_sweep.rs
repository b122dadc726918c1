//! What the first sweep reveals about an otherwise unknown rig: when its returns were measured,
//! where the ground is, and how high sensors are above it.

use raywake_core::sweep::Point;
#[cfg(any(feature = "mcap", feature = "pcap"))]
use raywake_core::{
    params::SENSORS_MAX,
    pose::Pose,
    sweep::{Rig, Timing},
};

use super::sidecars::SPAN_MAX_S;
#[cfg(any(feature = "mcap", feature = "pcap"))]
use super::{OpenOptions, Overview, PoseTrack, mounting};

/// Earliest time after the stamp and duration of a sweep, s; `None` if all times are the same.
///
/// Fails if the times cannot be those of a sweep.
pub(super) fn span(points: &[Point]) -> Result<Option<[f64; 2]>, String> {
    let times = points.iter().map(|p| f64::from(p.offset_s)).filter(|t| t.is_finite());
    let limits = (f64::INFINITY, f64::NEG_INFINITY);
    let (from_s, to_s) = times.fold(limits, |l, t| (l.0.min(t), l.1.max(t)));
    let span_s = to_s - from_s;
    if [from_s.abs(), span_s].iter().any(|s| s.is_finite() && *s > SPAN_MAX_S) {
        return Err(format!(
            "returns from {from_s:.3} to {to_s:.3} s around the stamp of a sweep; {SPAN_MAX_S} s \
             at most"
        ));
    }
    Ok((span_s > 0.0).then_some([from_s, span_s]))
}

/// What is known of a recording of some sensors before its first sweep is read.
#[cfg(any(feature = "mcap", feature = "pcap"))]
pub(super) fn before(
    name: String,
    sensors: heapless::Vec<Pose, SENSORS_MAX>,
    notes: Vec<String>,
    options: &OpenOptions,
) -> Overview {
    let timing = Timing::AtStamp;
    Overview {
        name,
        rig: Rig { sensors, timing, distorted: true, ground_m: 0.0, own_vehicle: None },
        frames: Vec::new(),
        track: PoseTrack::default(),
        epoch_ns: 0,
        trusted: options.trusted,
        notes,
    }
}

/// Completes what is known of a recording from its first sweep; `timed` says whether its returns
/// have times, `names` are those of its sensors, for messages.
///
/// Fails if the times cannot be those of a sweep, and if no ground is found and the user gives
/// none.
#[cfg(any(feature = "mcap", feature = "pcap"))]
pub(super) fn learn(
    overview: &mut Overview,
    (points, timed): (&[Point], bool),
    names: &[&str],
    options: &OpenOptions,
) -> Result<(), String> {
    let Overview { rig, notes, .. } = overview;
    let span = span(points).map_err(|what| format!("{}: {what}", names.join(" and ")))?;
    let offsets = |[from_s, span_s]: [f64; 2]| Timing::Offset { from_s, span_s };
    rig.timing = span.map_or(Timing::AtStamp, offsets);
    if !timed {
        notes.push("returns have no times: motion within a sweep is not corrected".into());
    }
    let found = options.ground_m.or_else(|| raywake_registration::ground::ground_height(points));
    let ground_m =
        found.ok_or("no ground found in the first sweep: give its height with --ground")?;
    if options.ground_m.is_none() {
        notes.push(format!("ground estimated at {ground_m:.2} m"));
    }
    rig.ground_m = ground_m;
    mount(rig, names, notes);
    super::apply(options, rig);
    Ok(())
}

/// Lifts sensors above the ground if their clouds are in a frame that lies on it.
#[cfg(any(feature = "mcap", feature = "pcap"))]
fn mount(rig: &mut Rig, names: &[&str], notes: &mut Vec<String>) {
    let ground_m = rig.ground_m;
    for (pose, name) in rig.sensors.iter_mut().zip(names) {
        let own_frame = *pose == Pose::IDENTITY;
        if let Some(place) = mounting::above(ground_m).filter(|_| own_frame) {
            pose.translation = place;
            notes.push(format!(
                "{name}: the origin is close to the ground; the sensor is assumed to be {:.2} m \
                 above it",
                place.z - ground_m
            ));
        }
    }
}
