//! Sensors that send packets, and when their contents were measured.

use std::sync::Arc;

use raywake_core::sweep::Point;

use super::firing::{Firing, TURN};
use super::hdl64::{self, Hdl64};
use super::ouster::Ouster;
use super::velodyne::{self, Velodyne};

/// A firing this long after the previous one begins another sweep if the sensor does not count its
/// revolutions, ns: a revolution of the fastest sensor.
const PAUSE_NS: i64 = 50_000_000;
/// A firing not after the previous one is late or a copy; this far from it, ns, the clock was set.
pub(super) const SET_NS: u64 = 1_000_000_000;

/// Clocks beyond this count from 1970, ns: this is in 2001.
const EPOCH_MIN_NS: u64 = 1_000_000_000_000_000_000;
/// A Velodyne's clock, which counts from the full hour, is taken to be set if it differs from the
/// arrival time by less than this, ns: packets arrive within a second.
const SYNCHRONISED_NS: i64 = 1_000_000_000;

/// Where a firing belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Begins a sweep.
    Begins,
    GoesOn,
    /// Comes after later ones, or again.
    Late,
}

/// A sensor that sends packets.
#[derive(Clone)]
pub(super) enum Sensor {
    Velodyne(Arc<Velodyne>),
    Hdl64(Arc<Hdl64>),
    Ouster(Arc<Ouster>),
}

impl Sensor {
    pub fn name(&self) -> &str {
        match self {
            Sensor::Velodyne(sensor) => sensor.name(),
            Sensor::Hdl64(_) => Hdl64::NAME,
            Sensor::Ouster(sensor) => sensor.name(),
        }
    }

    pub fn recognises(&self, packet: &[u8]) -> bool {
        match self {
            Sensor::Velodyne(sensor) => sensor.recognises(packet),
            Sensor::Hdl64(sensor) => sensor.recognises(packet),
            Sensor::Ouster(sensor) => sensor.recognises(packet),
        }
    }

    pub fn has_valid_checksum(&self, packet: &[u8]) -> bool {
        match self {
            Sensor::Velodyne(_) | Sensor::Hdl64(_) => true,
            Sensor::Ouster(sensor) => sensor.has_valid_checksum(packet),
        }
    }

    /// Numbers and firings of a packet of its own.
    pub fn firings(&self, packet: &[u8]) -> impl Iterator<Item = (usize, Firing)> {
        let count = match self {
            Sensor::Velodyne(_) => velodyne::BLOCKS,
            Sensor::Hdl64(_) => hdl64::FIRINGS,
            Sensor::Ouster(sensor) => sensor.packet_columns,
        };
        let firing = |n| match self {
            Sensor::Velodyne(sensor) => sensor.firing(packet, n),
            Sensor::Hdl64(sensor) => sensor.firing(packet, n),
            Sensor::Ouster(sensor) => sensor.firing(packet, n),
        };
        (0..count).filter_map(move |n| Some((n, firing(n)?)))
    }

    pub fn returns(&self, packet: &[u8], firing: usize, offset_ns: i64, into: &mut Vec<Point>) {
        match self {
            Sensor::Velodyne(sensor) => sensor.returns(packet, firing, offset_ns, into),
            Sensor::Hdl64(sensor) => sensor.returns(packet, firing, offset_ns, into),
            Sensor::Ouster(sensor) => sensor.returns(packet, firing, offset_ns, into),
        }
    }

    /// Maximum number of returns of a firing.
    pub fn returns_of_firing(&self) -> usize {
        match self {
            Sensor::Velodyne(_) => velodyne::MEASUREMENTS,
            Sensor::Hdl64(_) => hdl64::LASERS,
            Sensor::Ouster(sensor) => sensor.beams(),
        }
    }

    /// Maximum number of returns in a revolution.
    pub fn returns_max(&self) -> usize {
        match self {
            Sensor::Velodyne(sensor) => sensor.returns_max(),
            Sensor::Hdl64(sensor) => sensor.returns_max(),
            Sensor::Ouster(sensor) => sensor.beams() * (sensor.columns + 1),
        }
    }

    /// Time from the first firing of a packet to that of the next, ns.
    pub fn packet_ns(&self, packet: &[u8]) -> f64 {
        match self {
            Sensor::Velodyne(sensor) => sensor.packet_ns(packet),
            Sensor::Hdl64(sensor) => sensor.packet_ns(packet),
            Sensor::Ouster(sensor) => {
                sensor.period_ns * sensor.packet_columns as f64 / sensor.columns as f64
            }
        }
    }

    /// Time of a revolution, ns, if the settings give it.
    pub fn period_ns(&self) -> Option<f64> {
        match self {
            Sensor::Velodyne(_) | Sensor::Hdl64(_) => None,
            Sensor::Ouster(sensor) => Some(sensor.period_ns),
        }
    }

    /// Converts a time of its clock to ns since 1970, for a packet that arrived at `now_ns`; if its
    /// clock is not set, the result is the arrival time.
    pub fn epoch_ns(&self, clock_ns: u64, now_ns: u64) -> u64 {
        let set = match self {
            Sensor::Ouster(_) => Some(clock_ns).filter(|ns| *ns >= EPOCH_MIN_NS),
            Sensor::Velodyne(_) | Sensor::Hdl64(_) => {
                let since_ns = self.since(now_ns % velodyne::CLOCK_NS, clock_ns);
                let set = since_ns.abs() < SYNCHRONISED_NS;
                set.then(|| now_ns.wrapping_sub(since_ns as u64))
            }
        };
        set.unwrap_or(now_ns)
    }

    /// Time from one reading of its clock to another, ns.
    pub fn since(&self, later_ns: u64, earlier_ns: u64) -> i64 {
        match self {
            Sensor::Velodyne(_) | Sensor::Hdl64(_) => {
                let clock = velodyne::CLOCK_NS;
                let ahead = (later_ns + clock - earlier_ns) % clock;
                if ahead < clock / 2 { ahead as i64 } else { ahead as i64 - clock as i64 }
            }
            Sensor::Ouster(_) => later_ns.wrapping_sub(earlier_ns) as i64,
        }
    }

    /// Where a firing belongs, given the one before.
    pub fn order(&self, firing: &Firing, before: Option<&Firing>) -> Order {
        let Some(before) = before else { return Order::Begins };
        let since_ns = self.since(firing.clock_ns, before.clock_ns);
        let turns = match (firing.frame, before.frame) {
            (Some(frame), Some(before)) => frame != before,
            _ if since_ns >= PAUSE_NS => true,
            _ => u64::from(before.angle.saturating_sub(firing.angle)) > TURN / 2,
        };
        match since_ns {
            _ if since_ns.unsigned_abs() >= SET_NS => Order::Begins,
            ..=0 => Order::Late,
            _ if turns => Order::Begins,
            _ => Order::GoesOn,
        }
    }
}
