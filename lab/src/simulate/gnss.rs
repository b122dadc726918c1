//! Errors of a GNSS-aided inertial unit, as real poses have them.
//!
//! - Clock: the unit reports every 10 ms, and a sweep gets the report nearest to its stamp. The
//!   scanner's period is not a multiple of 10 ms (KITTI's is 103.6 ms), so the report is up to 5 ms
//!   off and drifts by 3.6 ms a sweep; the drive's own timestamps do not show this.
//! - Position: a first-order Gauss-Markov process of 4 cm along each axis with a time constant of
//!   20 s (a random walk over a few seconds, 0.4 cm a sweep), plus 1 cm drawn anew for every sweep.
//! - Attitude: the same process with 0.2 degrees of heading and 0.05 degrees of roll and pitch,
//!   plus a tenth of that drawn anew for every sweep.
//!
//! For comparison: on KITTI's raw drive 0005 (4.6 m/s) the unit's steps from sweep to sweep differ
//! from those of scan matching by 2.5 cm along, 1.8 cm across and 0.047 degrees; here, at that
//! speed, by 2.6 cm, 1.5 cm and 0.035 degrees, as follows from the above.

use glam::{DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_sim::{PERIOD_S, Rng};

/// Time between two reports of the unit, and by how much the scanner's period exceeds a multiple of
/// it, s.
const REPORT_S: f64 = 0.01;
const WALK_S: f64 = 0.0036;
/// Time in which the slow errors decay to about a third, s.
const MEMORY_S: f64 = 20.0;
/// Standard deviations: of the slow error, and of the error of every sweep. Position in m; roll,
/// pitch and heading in degrees.
const POSITION_M: [f64; 2] = [0.04, 0.01];
const TILT_DEG: f64 = 0.05;
const HEADING_DEG: f64 = 0.2;
/// Share of the attitude's slow deviation that is drawn anew on every sweep.
const QUICK: f64 = 0.1;

/// The errors of a drive, sweep by sweep.
pub struct Errors {
    rng: Rng,
    clock_s: f64,
    /// Slow errors in units of their standard deviations: position, then roll, pitch and heading.
    slow: [f64; 6],
}

/// The errors of one sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// How much later than stated a pose was taken, s.
    pub late_s: f64,
    position: DVec3,
    /// Rotation about the world's axes, rad.
    turn: DVec3,
}

impl Errors {
    /// Errors of the drive with this seed, in their steady state.
    pub fn new(seed: u64) -> Errors {
        let mut rng = Rng::split(seed, 8);
        let clock_s = rng.range(0.0, REPORT_S);
        let slow = [0; 6].map(|_| rng.bell());
        Errors { rng, clock_s, slow }
    }

    /// The errors of the next sweep.
    pub fn next(&mut self) -> Error {
        let kept = (-PERIOD_S / MEMORY_S).exp();
        self.clock_s = (self.clock_s + WALK_S).rem_euclid(REPORT_S);
        for slow in &mut self.slow {
            *slow = kept * *slow + (1.0 - kept * kept).sqrt() * self.rng.bell();
        }
        let mut drawn =
            |n: usize, slow: f64, quick: f64| slow * self.slow[n] + quick * self.rng.bell();
        let [slow, quick] = POSITION_M;
        let position = [0, 1, 2].map(|n| drawn(n, slow, quick));
        let degrees = [TILT_DEG, TILT_DEG, HEADING_DEG];
        let turn = [0, 1, 2].map(|n| drawn(3 + n, degrees[n], QUICK * degrees[n]).to_radians());
        let late_s = self.clock_s - 0.5 * REPORT_S;
        let [position, turn] = [position, turn].map(DVec3::from_array);
        Error { late_s, position, turn }
    }
}

impl Error {
    /// The pose that the unit reports for its true pose.
    pub fn of(&self, world_from_unit: Pose) -> Pose {
        let rotation = DQuat::from_scaled_axis(self.turn) * world_from_unit.rotation;
        Pose::new(rotation, world_from_unit.translation + self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations() {
        let (mut position, mut step, mut heading, mut late) = (0.0, 0.0, 0.0, 0.0f64);
        let count = 400 * 50;
        for seed in 0..400 {
            let mut errors = Errors::new(seed);
            let mut before = errors.next();
            for _ in 0..50 {
                let now = errors.next();
                position += now.position.x.powi(2) / f64::from(count);
                step += (now.position.x - before.position.x).powi(2) / f64::from(count);
                heading += now.turn.z.powi(2) / f64::from(count);
                late = late.max(now.late_s.abs());
                before = now;
            }
        }
        let [position, step] = [position, step].map(f64::sqrt);
        let heading = heading.sqrt().to_degrees();
        assert!((0.037..0.045).contains(&position), "{position} m");
        // 0.4 cm from the slow error, plus the difference of two errors of 1 cm.
        assert!((0.0135..0.016).contains(&step), "{step} m");
        assert!((0.18..0.22).contains(&heading), "{heading} degrees");
        assert!((0.004..=0.005).contains(&late), "{late} s");
    }

    #[test]
    fn the_vehicle_turns_where_it_is() {
        let error = Error { late_s: 0.0, position: DVec3::X, turn: DVec3::new(0.0, 0.0, 0.1) };
        let pose = error.of(Pose::planar(500.0, 20.0, 1.0, 0.3));
        assert!((pose.yaw_rad() - 0.4).abs() < 1e-12);
        assert!((pose.translation - DVec3::new(501.0, 20.0, 1.0)).length() < 1e-12);
    }
}
