//! Assembles packets into sweeps as they arrive, without allocating.

use std::ops::Range;
use std::time::Instant;

use super::firing::{Firing, TURN};
use super::live::LiveSensor;
use super::sensor::{Order, SET_NS};
use crate::source::{SourceGaps, SweepData};

/// Longest accepted time between two revolutions, ns: several lost ones of the slowest sensor.
/// After a longer one its clock was set, or it stood still.
const STEP_MAX_NS: i64 = 10_000_000_000;
/// Number of recent packets with which a late one is compared: it is a copy, or out of order.
const RECENT: usize = 64;
/// Stands for the packets before the first.
const NEVER: u64 = u64::MAX;
/// Accepted times of a revolution, ns.
const PERIOD_NS: Range<f64> = 1e7..1e9;
/// Weight of a new measurement in the time of a revolution, which drifts by parts in a thousand.
const TURN_SHARE: f64 = 0.125;

/// A sweep assembled from packets.
pub struct LiveSweep {
    /// Its returns; the pose is the identity.
    pub data: SweepData,
    /// Its stamp since 1970, ns: by the sensor's clock if that is set, otherwise by the arrival of
    /// its first packet.
    pub stamp_ns: u64,
    /// When its last packet arrived.
    pub arrived: Instant,
    /// Packets missing from it.
    pub lost_packets: u64,
    /// Time of a revolution as estimated by then, ns.
    pub period_ns: f64,
}

impl LiveSweep {
    /// An empty one with room for a revolution of a sensor.
    pub fn of(sensor: &LiveSensor) -> LiveSweep {
        let points = Vec::with_capacity(sensor.returns_max());
        let data = SweepData { points, ..SweepData::default() };
        LiveSweep { data, stamp_ns: 0, arrived: Instant::now(), lost_packets: 0, period_ns: 0.0 }
    }
}

/// What became of datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct PacketCounts {
    /// Packets of the sensor.
    pub packets: u64,
    /// Datagrams that are not packets of the sensor, or are from another sender.
    pub foreign: u64,
    /// Packets with a wrong checksum: left out.
    pub unsound: u64,
    /// Repeated packets: left out.
    pub duplicates: u64,
    /// Packets that arrived after later ones: left out.
    pub reordered: u64,
    /// Packets missing between others: lost on the way, or reordered.
    pub missing: u64,
    /// Returns that exceed the capacity of a revolution: the sensor stands still, or its clock
    /// does.
    pub over_capacity: u64,
    /// Number of times that the sensor's clock was set, or the sensor paused.
    pub clock_set: u64,
}

/// Where the current revolution began.
struct RevolutionStart {
    firing: Firing,
    /// Since the first whole revolution began, ns.
    stamp_ns: i64,
    number: u64,
}

/// Assembles sweeps.
pub struct Assembler {
    sensor: LiveSensor,
    counts: PacketCounts,
    /// `None` until a revolution begins: the one in progress at the start is left out.
    begun: Option<RevolutionStart>,
    last: Option<Firing>,
    /// Times of the first firing of the last packets by the sensor's clock, ns, the newest at `at`.
    recent: [u64; RECENT],
    at: usize,
    /// Time of a revolution, ns, once it is known.
    period_ns: Option<f64>,
    epoch_ns: u64,
    filling: LiveSweep,
}

impl Assembler {
    /// An assembler before its first packet.
    pub fn new(sensor: LiveSensor) -> Assembler {
        Assembler {
            filling: LiveSweep::of(&sensor),
            period_ns: sensor.period_ns(),
            sensor,
            counts: PacketCounts::default(),
            begun: None,
            last: None,
            recent: [NEVER; RECENT],
            at: 0,
            epoch_ns: 0,
        }
    }

    /// What has become of datagrams so far.
    pub fn counts(&self) -> PacketCounts {
        self.counts
    }

    /// [`LiveSweep::stamp_ns`] of the first sweep.
    pub fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Counts a datagram of another sender.
    pub fn foreign(&mut self) {
        self.counts.foreign += 1;
    }

    /// Takes a datagram that arrived at a moment, which is `now_ns` since 1970. Passes every sweep
    /// that it ends to `complete`, which leaves an empty one, or any other, in its place.
    pub fn take(
        &mut self,
        datagram: &[u8],
        arrived: Instant,
        now_ns: u64,
        mut complete: impl FnMut(&mut LiveSweep),
    ) {
        let sensor = self.sensor.0.clone();
        if !sensor.recognises(datagram) {
            return self.foreign();
        }
        if !sensor.has_valid_checksum(datagram) {
            self.counts.unsound += 1;
            return;
        }
        self.counts.packets += 1;
        if !self.in_order(datagram) {
            return;
        }
        for (number, firing) in sensor.firings(datagram) {
            match sensor.order(&firing, self.last.as_ref()) {
                Order::Late => continue,
                Order::Begins => self.begin(firing, (arrived, now_ns), &mut complete),
                Order::GoesOn => {}
            }
            self.last = Some(firing);
            let Some(begun) = &self.begun else { continue };
            let points = &mut self.filling.data.points;
            let room = points.capacity() - points.len();
            if room < sensor.returns_of_firing() {
                self.counts.over_capacity += sensor.returns_of_firing() as u64;
                continue;
            }
            let offset_ns = sensor.since(firing.clock_ns, begun.firing.clock_ns);
            sensor.returns(datagram, number, offset_ns, points);
        }
    }

    /// Whether a packet comes after those before it; counts those that do not, and those missing
    /// before it.
    fn in_order(&mut self, packet: &[u8]) -> bool {
        let sensor = &self.sensor.0;
        let Some((_, first)) = sensor.firings(packet).next() else { return true };
        let before = Some(self.recent[self.at]).filter(|ns| *ns != NEVER);
        let since_ns = before.map(|before| sensor.since(first.clock_ns, before));
        // Farther back or ahead, the clock was set.
        let since_ns = since_ns.filter(|ns| (-(SET_NS as i64)..STEP_MAX_NS).contains(ns));
        if since_ns.is_some_and(|ns| ns <= 0) {
            let again = self.recent.contains(&first.clock_ns);
            let count =
                if again { &mut self.counts.duplicates } else { &mut self.counts.reordered };
            *count += 1;
            return false;
        }
        if let Some(since_ns) = since_ns {
            let packets = since_ns as f64 / sensor.packet_ns(packet);
            let missing = (packets.round() as u64).saturating_sub(1);
            self.counts.missing += missing;
            self.filling.lost_packets += missing;
        }
        self.at = (self.at + 1) % RECENT;
        self.recent[self.at] = first.clock_ns;
        true
    }

    /// Ends the current revolution and begins another.
    fn begin(
        &mut self,
        firing: Firing,
        (arrived, now_ns): (Instant, u64),
        complete: &mut impl FnMut(&mut LiveSweep),
    ) {
        // Where the very first firing lies in its revolution is unknown.
        if self.last.is_none() {
            return;
        }
        let stamp_ns = self.sensor.0.epoch_ns(firing.clock_ns, now_ns);
        let (begun, sweeps_before) = match self.begun.take() {
            None => {
                self.epoch_ns = stamp_ns;
                (RevolutionStart { firing, stamp_ns: 0, number: 0 }, 0)
            }
            Some(begun) => {
                let (next, period_ns) = self.after(&begun, firing);
                self.period_ns = Some(period_ns);
                (self.filling.arrived, self.filling.period_ns) = (arrived, period_ns);
                complete(&mut self.filling);
                let sweeps_before = next.number - begun.number - 1;
                (next, sweeps_before)
            }
        };
        let data = &mut self.filling.data;
        data.points.clear();
        data.dropped = SourceGaps { sweeps_before, null_rows: 0 };
        data.frame = begun.number;
        data.stamp_s = begun.stamp_ns as f64 * 1e-9;
        (self.filling.stamp_ns, self.filling.lost_packets) = (stamp_ns, 0);
        self.begun = Some(begun);
    }

    /// Stamp and number of a revolution that follows another, and the resulting estimate of the
    /// time of one, ns.
    fn after(&mut self, begun: &RevolutionStart, firing: Firing) -> (RevolutionStart, f64) {
        let mut step_ns = self.sensor.0.since(firing.clock_ns, begun.firing.clock_ns);
        if !(1..=STEP_MAX_NS).contains(&step_ns) {
            self.counts.clock_set += 1;
            step_ns = self.period_ns.unwrap_or(PERIOD_NS.start) as i64;
        }
        // A sweep may begin within a revolution if packets are missing.
        let within = (f64::from(firing.angle) - f64::from(begun.firing.angle)) / TURN as f64;
        let period_ns =
            self.period_ns.unwrap_or(step_ns as f64).clamp(PERIOD_NS.start, PERIOD_NS.end);
        let turns = (step_ns as f64 / period_ns - within).round().max(1.0);
        let seen_ns = step_ns as f64 / (turns + within);
        // A revolution that lacks most of its packets gives no estimate.
        let likely = (0.5..2.0).contains(&(seen_ns / period_ns));
        let share = if likely { TURN_SHARE } else { 0.0 };
        let (stamp_ns, number) = (begun.stamp_ns + step_ns, begun.number + turns as u64);
        (RevolutionStart { firing, stamp_ns, number }, period_ns + share * (seen_ns - period_ns))
    }
}
