//! When in its sweep a return was measured, and how far the vehicle had moved by then.
//!
//! A sweep is divided into [`SLOTS`] time slots of equal length; times are counted in slots from
//! its beginning.

use crate::params::SLOTS;
use crate::pose::Pose;
use crate::sweep::{Point, Rig, Sweep, Timing};
use raywake_simd::integer_part;

/// Entries of the table from azimuth to time.
const AZIMUTHS: usize = 1024;

/// Finds the time of a return from its offset or, for a spinning sensor, from its azimuth.
pub struct ReturnClock {
    /// Slots since the beginning of the revolution, by [`pseudo_angle`].
    slot_of_azimuth: [f32; AZIMUTHS + 1],
}

impl Default for ReturnClock {
    fn default() -> Self {
        ReturnClock::new()
    }
}

impl ReturnClock {
    /// Builds the table.
    pub fn new() -> ReturnClock {
        let mut slot_of_azimuth = [0.0; AZIMUTHS + 1];
        for (n, slot) in slot_of_azimuth.iter_mut().enumerate() {
            // The inverse of `pseudo_angle`.
            let p = n as f64 * f64::from(TURN) / AZIMUTHS as f64;
            let x = if p < 2.0 { p - 1.0 } else { 3.0 - p };
            let y = libm::copysign(1.0 - libm::fabs(x), 2.0 - p);
            let turn = 0.5 - libm::atan2(y, x) / core::f64::consts::TAU;
            *slot = (turn * SLOTS as f64) as f32;
        }
        ReturnClock { slot_of_azimuth }
    }

    /// Time of a return, slots from the beginning of its sweep.
    pub fn slots(&self, rig: &Rig, point: &Point) -> f32 {
        let [x, y, _] = point.position.map(|v| [v]);
        let [slots] = self.slots_of(rig.timing, [&x, &y], &[point.offset_s]);
        slots
    }

    /// The same for several at once, from their positions and offsets.
    #[inline(always)]
    pub(crate) fn slots_of<const N: usize>(
        &self,
        timing: Timing,
        [x, y]: [&[f32; N]; 2],
        offset_s: &[f32; N],
    ) -> [f32; N] {
        let mut slots = [0.0; N];
        match timing {
            Timing::AtStamp => {}
            Timing::Offset { from_s, span_s } => {
                let (from_s, per_s) = (from_s as f32, SLOTS as f32 / span_s as f32);
                for (slots, offset_s) in slots.iter_mut().zip(offset_s) {
                    let since = (offset_s - from_s) * per_s;
                    *slots = if since > 0.0 { since.min(SLOTS as f32) } else { 0.0 };
                }
            }
            Timing::Azimuth { .. } => {
                let (mut angle, mut entry) = ([0.0; N], [0; N]);
                for n in 0..N {
                    angle[n] = pseudo_angle(x[n], y[n]) * (AZIMUTHS as f32 / TURN);
                    entry[n] = integer_part(angle[n]).clamp(0, AZIMUTHS as i32 - 1);
                }
                let slot_of = |entry: i32| self.slot_of_azimuth[entry as usize];
                let (low, high) = (entry.map(slot_of), entry.map(|entry| slot_of(entry + 1)));
                for n in 0..N {
                    slots[n] = low[n] + (angle[n] - entry[n] as f32) * (high[n] - low[n]);
                }
            }
        }
        slots
    }

    /// Time of a return after the sweep's stamp, s.
    #[inline]
    pub fn offset_s(&self, rig: &Rig, point: &Point) -> f64 {
        rig.timing.offset_s(f64::from(self.slots(rig, point)))
    }
}

/// The slot that contains a time in slots.
#[inline(always)]
pub fn slot_of(slots: f32) -> usize {
    integer_part(slots).clamp(0, SLOTS as i32 - 1) as usize
}

impl Timing {
    /// Offset from the stamp, s, of a time in slots from the beginning of the sweep.
    #[inline]
    pub fn offset_s(self, slots: f64) -> f64 {
        self.at(slots / SLOTS as f64)
    }

    /// Offset from the stamp, s, at a fraction of the sweep, 0 to 1.
    #[inline]
    pub fn at(self, turn: f64) -> f64 {
        match self {
            Timing::AtStamp => 0.0,
            Timing::Offset { from_s, span_s } => from_s + turn * span_s,
            Timing::Azimuth { span_s } => (turn - 0.5) * span_s,
        }
    }
}

impl Sweep<'_> {
    /// Pose of the vehicle at the middle of a slot, in its frame at the stamp.
    pub fn motion(&self, rig: &Rig, slot: usize) -> Pose {
        self.twist.over(rig.timing.offset_s(slot as f64 + 0.5))
    }
}

/// A full revolution in [`pseudo_angle`].
pub(crate) const TURN: f32 = 4.0;

/// A monotonic stand-in for the azimuth that needs no trigonometry, from 0 to 4, clockwise: 0 at
/// the rear, 1 to the left, 2 in front, 3 to the right.
#[inline(always)]
pub(crate) fn pseudo_angle(x: f32, y: f32) -> f32 {
    // Without a branch: several are computed at once.
    let sum = x.abs() + y.abs();
    let c = x / sum;
    let angle = if y >= 0.0 { 1.0 + c } else { 3.0 - c };
    if sum == 0.0 { 2.0 } else { angle }
}
