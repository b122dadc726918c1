//! A drive processed backwards in time: an object that is missed forwards, having only just come
//! into view, has been in view for a long time backwards.

use raywake_core::pose::Twist;
use raywake_core::return_clock::ReturnClock;
use raywake_core::sweep::{Rig, Timing};
use raywake_io::source::SweepData;

/// Reverses the sweeps of a rig in time.
pub struct Backwards {
    forwards: Rig,
    clock: ReturnClock,
}

impl Backwards {
    /// For the sweeps of a rig.
    pub fn new(rig: &Rig) -> Backwards {
        Backwards { forwards: rig.clone(), clock: ReturnClock::new() }
    }

    /// Returns the rig of the reversed sweeps.
    pub fn rig(&self) -> Rig {
        let timing = match self.forwards.timing {
            Timing::AtStamp => Timing::AtStamp,
            // From the last return to the first.
            timing => {
                let [from_s, to_s] = [1.0, 0.0].map(|turn| -timing.at(turn));
                Timing::Offset { from_s, span_s: to_s - from_s }
            }
        };
        Rig { timing, ..self.forwards.clone() }
    }

    /// Reverses a sweep: what was after the stamp comes before it, and all motion is reversed.
    pub fn turn(&self, sweep: &mut SweepData) {
        sweep.stamp_s = -sweep.stamp_s;
        let Twist { linear, angular } = sweep.twist;
        sweep.twist = Twist { linear: -linear, angular: -angular };
        for point in &mut sweep.points {
            point.offset_s = -self.clock.offset_s(&self.forwards, point) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::pose::Pose;
    use raywake_core::sweep::Point;

    #[test]
    fn times_are_turned_around() {
        let rig = |timing| Rig {
            sensors: [Pose::IDENTITY].into_iter().collect(),
            timing,
            distorted: true,
            ground_m: -1.7,
            own_vehicle: None,
        };
        let ahead = Point { position: [10.0, 1e-6, 0.0], offset_s: 0.03, ..Point::default() };
        let left = Point { position: [0.0, 10.0, 0.0], offset_s: -0.05, ..Point::default() };
        let turned = |timing| {
            let backwards = Backwards::new(&rig(timing));
            let twist = Twist { linear: glam::DVec3::X, angular: glam::DVec3::Z };
            let points = vec![ahead, left];
            let mut sweep = SweepData { stamp_s: 2.0, twist, points, ..SweepData::default() };
            backwards.turn(&mut sweep);
            assert_eq!((sweep.stamp_s, sweep.twist.linear), (-2.0, -glam::DVec3::X));
            (backwards.rig().timing, [sweep.points[0].offset_s, sweep.points[1].offset_s])
        };
        let offset = Timing::Offset { from_s: -0.05, span_s: 0.125 };
        let (timing, times) = turned(offset);
        assert_eq!(timing, Timing::Offset { from_s: -0.075, span_s: 0.125 });
        assert!((times[0] + 0.03).abs() < 1e-6 && (times[1] - 0.05).abs() < 1e-6, "{times:?}");
        // Clockwise from the rear: left comes a quarter of a revolution before the stamp.
        let (timing, times) = turned(Timing::Azimuth { span_s: 0.1 });
        assert_eq!(timing, Timing::Offset { from_s: -0.05, span_s: 0.1 });
        assert!(times[0].abs() < 1e-4 && (times[1] - 0.025).abs() < 1e-4, "{times:?}");
        assert_eq!(turned(Timing::AtStamp), (Timing::AtStamp, [0.0, 0.0]));
    }
}
