//! Poses received as datagrams.
//!
//! A datagram has 72 bytes, little-endian: `RWP1`, four bytes of zero, a u64, the time since 1970
//! in ns, and seven f64: x, y, z (m) and the quaternion x, y, z, w of the vehicle in the world,
//! that is, of the sensor, whose frame is the vehicle's.

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DQuat, DVec3};
use raywake_core::plausible::{WORLD_MAX_M, is_within};
use raywake_core::pose::{Pose, Twist};
use raywake_io::Error;
use raywake_io::source::rigid;
use serde::Serialize;

use super::receiver::{bind, for_each_datagram};

/// First bytes of a datagram, and its length.
const MAGIC: &[u8] = b"RWP1\0\0\0\0";
const DATAGRAM: usize = 72;
/// Number of poses kept: 2.5 s at 200 Hz.
const KEPT: usize = 512;
/// How far to extrapolate beyond the last pose, ns: two sweeps of most sensors.
const BEYOND_MAX_NS: u64 = 200_000_000;
/// A pose further than this from the last one, ns, means that the clock was set.
const SET_NS: u64 = 10_000_000_000;
const S_OF_NS: f64 = 1e-9;

/// Counts of received datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PoseCounts {
    /// Poses.
    pub poses: u64,
    /// Datagrams that are not poses.
    pub foreign: u64,
    /// Poses not later than the one before: dropped.
    pub late: u64,
}

/// A pose and its time since 1970, ns.
type Timed = (u64, Pose);

/// The latest poses, in time order.
#[derive(Default)]
pub struct RecentPoses {
    poses: heapless::Deque<Timed, KEPT>,
    counts: PoseCounts,
}

/// A socket that receives poses.
pub struct PoseReceiver {
    socket: UdpSocket,
    track: Mutex<RecentPoses>,
}

impl PoseReceiver {
    /// Opens a socket. Fails if the address is unavailable.
    pub fn bind(address: SocketAddr) -> Result<PoseReceiver, Error> {
        let socket = bind(address, "poses-from")?;
        Ok(PoseReceiver { socket, track: Mutex::default() })
    }

    fn track(&self) -> MutexGuard<'_, RecentPoses> {
        self.track.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts of datagrams so far.
    pub fn counts(&self) -> PoseCounts {
        self.track().counts()
    }

    /// Receives poses until `stop`.
    pub fn run(&self, stop: &AtomicBool) {
        raywake_alloc_guard::watch("poses", || {
            for_each_datagram(&self.socket, stop, |datagram, _| self.track().take(datagram));
        });
    }

    /// See [`RecentPoses::at`].
    pub fn at(&self, stamp_ns: u64, sweep_ns: u64) -> Option<(Pose, Twist)> {
        self.track().at(stamp_ns, sweep_ns)
    }
}

/// Parses the pose in a datagram.
fn parse(datagram: &[u8]) -> Option<Timed> {
    let numbers = datagram.strip_prefix(MAGIC).filter(|_| datagram.len() == DATAGRAM)?;
    let (stamp, numbers) = numbers.split_first_chunk()?;
    let number = |n: usize| f64::from_le_bytes(numbers[8 * n..][..8].try_into().unwrap_or([0; 8]));
    let place = [0, 1, 2].map(number);
    let stamp_ns = u64::from_le_bytes(*stamp);
    let pose = rigid(place, [3, 4, 5, 6].map(number)).ok()?;
    (stamp_ns > 0 && is_within(pose.translation, WORLD_MAX_M)).then_some((stamp_ns, pose))
}

impl RecentPoses {
    /// Counts of datagrams so far.
    pub fn counts(&self) -> PoseCounts {
        self.counts
    }

    /// Takes the pose in a datagram; counts what is none.
    pub fn take(&mut self, datagram: &[u8]) {
        let Some(timed) = parse(datagram) else {
            self.counts.foreign += 1;
            return;
        };
        let last_ns = self.poses.back().map_or(timed.0 - 1, |(last_ns, _)| *last_ns);
        if timed.0.abs_diff(last_ns) > SET_NS {
            // The clock was set: earlier poses are of no use.
            self.poses.clear();
        } else if timed.0 <= last_ns {
            self.counts.late += 1;
            return;
        }
        self.counts.poses += 1;
        if self.poses.is_full() {
            self.poses.pop_front();
        }
        // There is room.
        let _ = self.poses.push_back(timed);
    }

    /// Returns the vehicle's pose at a time since 1970, ns, and its twist over the duration of a
    /// sweep from then on. `None` if the poses around that time are missing.
    pub fn at(&self, stamp_ns: u64, sweep_ns: u64) -> Option<(Pose, Twist)> {
        let pose = self.pose(stamp_ns)?;
        let newest_ns = self.poses.back()?.0;
        // If poses later than the stamp have arrived, the twist is taken from them alone.
        let until_ns = match newest_ns > stamp_ns {
            true => newest_ns.min(stamp_ns.saturating_add(sweep_ns)),
            false => stamp_ns.saturating_add(sweep_ns),
        };
        let span_s = (until_ns - stamp_ns) as f64 * S_OF_NS;
        let then = self.pose(until_ns)?;
        (span_s > 0.0).then(|| (pose, (pose.inverse() * then).twist(span_s)))
    }

    fn pose(&self, at_ns: u64) -> Option<Pose> {
        let after = self.poses.iter().position(|(ns, _)| *ns >= at_ns);
        let Some(after) = after else { return self.beyond(at_ns) };
        let [(to_ns, to), (from_ns, from)] = [after, after.checked_sub(1).unwrap_or(after)]
            .map(|n| self.poses.iter().nth(n).copied().unwrap_or((0, Pose::IDENTITY)));
        match (at_ns == to_ns, to_ns > from_ns) {
            (true, _) => Some(to),
            (_, false) => None,
            _ => {
                let share = (at_ns - from_ns) as f64 / (to_ns - from_ns) as f64;
                Some(between(&from, &to, share))
            }
        }
    }

    /// Extrapolates the last two poses beyond the last one.
    fn beyond(&self, at_ns: u64) -> Option<Pose> {
        let mut newest = self.poses.iter().rev();
        let ((to_ns, to), (from_ns, from)) = (newest.next()?, newest.next()?);
        let beyond_ns = at_ns.checked_sub(*to_ns).filter(|ns| *ns <= BEYOND_MAX_NS)?;
        let twist = (from.inverse() * *to).twist((to_ns - from_ns) as f64 * S_OF_NS);
        Some(*to * twist.over(beyond_ns as f64 * S_OF_NS))
    }
}

/// Interpolates between two poses.
fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let place = |a: DVec3, b: DVec3| a + share * (b - a);
    let turned: DQuat = from.rotation.slerp(to.rotation, share);
    Pose::new(turned, place(from.translation, to.translation))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    fn datagram(ns: u64, numbers: [f64; 7]) -> Vec<u8> {
        let numbers = numbers.iter().flat_map(|n| n.to_le_bytes());
        MAGIC.iter().copied().chain(ns.to_le_bytes()).chain(numbers).collect()
    }

    /// Forwards at 10 m/s, turning at 0.2 rad/s.
    fn moving(seconds: std::ops::Range<u64>) -> RecentPoses {
        let mut track = RecentPoses::default();
        for tenth in seconds.start * 10..seconds.end * 10 {
            let t = tenth as f64 / 10.0;
            let (sin, cos) = (0.1 * t).sin_cos();
            track.take(&datagram(tenth * SECOND / 10, [10.0 * t, 0.0, 0.0, 0.0, 0.0, sin, cos]));
        }
        track
    }

    #[test]
    fn between_and_beyond_poses() {
        let track = moving(10..12);
        let (pose, twist) = track.at(10 * SECOND + SECOND / 20, SECOND / 10).unwrap();
        assert!((pose.translation.x - 100.5).abs() < 1e-9);
        assert!((pose.yaw_rad() - 2.01).abs() < 1e-9, "{}", pose.yaw_rad());
        assert!((twist.angular.z - 0.2).abs() < 1e-9 && (twist.linear.length() - 10.0).abs() < 0.1);
        // The last pose is that of 11.9 s.
        let (pose, _) = track.at(12 * SECOND, SECOND / 10).unwrap();
        assert!((pose.translation - DVec3::new(120.0, 0.0, 0.0)).length() < 0.1, "{pose:?}");
        assert!(track.at(13 * SECOND, SECOND / 10).is_none());
        assert!(track.at(9 * SECOND, SECOND / 10).is_none());
    }

    #[test]
    fn invalid_poses_are_counted() {
        let mut track = RecentPoses::default();
        assert!(track.at(0, 1).is_none());
        track.take(b"RWP1");
        track.take(&datagram(5, [0.0; 7]));
        track.take(&datagram(5, [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        track.take(&datagram(5, [1e308, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        track.take(&datagram(5, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        track.take(&datagram(5, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        assert_eq!(track.counts, PoseCounts { poses: 1, foreign: 4, late: 1 });
        (6..2000).for_each(|ns| track.take(&datagram(ns, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])));
        assert_eq!(track.poses.len(), KEPT);
        let mut jump = moving(1..2);
        jump.take(&datagram(u64::MAX, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        assert!(jump.at(u64::MAX, SECOND).is_none() && jump.poses.len() == 1);
        // And back: one wrong stamp does no lasting harm.
        jump.take(&datagram(2 * SECOND, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]));
        assert_eq!((jump.poses.len(), jump.counts.late), (1, 0));
    }
}
