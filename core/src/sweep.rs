//! Input from a source: one sweep of returns, and the rig that made it.

use crate::params::SENSORS_MAX;
use crate::pose::{Pose, Twist};

/// One return.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Position in the vehicle frame, m.
    pub position: [f32; 3],
    /// 0..1 if the source has it.
    pub intensity: f32,
    /// Time of the return after the sweep's stamp, s (may be negative); 0 if unknown.
    pub offset_s: f32,
    /// Index of the sensor in [`Rig::sensors`].
    pub sensor: u32,
}

/// A return placed in the window of its sweep; NaN if it was left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placed {
    /// Voxels from the window's corner, at its own time rather than its slot's: in half a slot a
    /// fast vehicle moves a centimetre.
    pub at: [f32; 3],
    /// Time after the sweep's stamp, s.
    pub offset_s: f32,
}

impl Placed {
    /// A return that was left out.
    pub(crate) const LEFT_OUT: Placed = Placed { at: [f32::NAN; 3], offset_s: 0.0 };
}

/// One sweep as received.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// Time of the stamp, s.
    pub stamp_s: f64,
    /// Returns in the source's order.
    pub points: &'a [Point],
    /// Pose of the vehicle at the stamp.
    pub world_from_vehicle: Pose,
    /// Velocity of the vehicle at the stamp.
    pub twist: Twist,
}

/// Where a return's time within the sweep comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Timing {
    /// Unknown: every return is assumed to be at the stamp.
    AtStamp,
    /// [`Point::offset_s`]; the sweep extends from `from_s` to `from_s + span_s` around the stamp.
    Offset {
        /// Earliest offset, s.
        from_s: f64,
        /// Duration of the sweep, s.
        span_s: f64,
    },
    /// A sensor that spins clockwise seen from above, starts and ends at the rear, and is stamped
    /// when it looks forward (KITTI's HDL-64E): the azimuth gives the time.
    Azimuth {
        /// Duration of one revolution, s.
        span_s: f64,
    },
}

impl Timing {
    /// Whether its times are finite and the sweep has a duration.
    pub fn is_valid(&self) -> bool {
        match *self {
            Timing::AtStamp => true,
            Timing::Offset { from_s, span_s } => from_s.is_finite() && is_span(span_s),
            Timing::Azimuth { span_s } => is_span(span_s),
        }
    }
}

fn is_span(span_s: f64) -> bool {
    span_s.is_finite() && span_s > 0.0
}

/// The fixed properties of a source of sweeps.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// `vehicle_from_sensor` of every sensor, at most [`SENSORS_MAX`].
    pub sensors: heapless::Vec<Pose, SENSORS_MAX>,
    /// Where a return's time comes from.
    pub timing: Timing,
    /// Whether returns are still distorted by the vehicle's motion, so that each must be moved to
    /// the stamp according to its time. A declared property of the source: Argoverse 2 has times
    /// and is already compensated, KITTI has none and is not.
    pub distorted: bool,
    /// Height of the ground under the vehicle in the vehicle frame, m.
    pub ground_m: f64,
    /// Returns from the ego vehicle lie in this box of the vehicle frame: (x, y) minimum and
    /// maximum, m, at any height.
    pub own_vehicle: Option<[[f32; 2]; 2]>,
}

impl Rig {
    /// Whether a position in the vehicle frame, m, lies on the ego vehicle.
    #[inline]
    pub fn is_own_vehicle(&self, [x, y, _]: [f32; 3]) -> bool {
        self.own_vehicle
            .is_some_and(|[low, high]| x > low[0] && x < high[0] && y > low[1] && y < high[1])
    }
}
