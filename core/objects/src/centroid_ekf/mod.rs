//! The baseline of 2.4: an extended Kalman filter that takes the centroid of an object's returns as
//! its position.
//!
//! State (2.2): x, y, z, heading, speed, climb, turn rate; the process is the unicycle of (2.6).
//! Positions are metres from the track's anchor, times seconds after its start. The first centroid
//! gives no velocity, and a polar state without speed could only ever learn motion along its own
//! heading: the filter rests until a centroid lies farther from the first than noise explains, or
//! for [`CentroidParams::rest_max_s`], and is then initialised from both. If it turns out to have
//! its object backwards, it reverses its heading, once. In either case [`Revision`] corrects the
//! earlier states too, so that no history jumps by half a turn.

#[cfg(test)]
mod tests;

use crate::ObjectState;
use crate::noise::ProcessNoise;
use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};
use raywake_core::ctrv::TwoPointStart;
use raywake_core::params::CHI2_99_2DOF;

/// Elements of the state.
pub const STATE: usize = 7;
type StateVector = SVector<f64, STATE>;
type Covariance = SMatrix<f64, STATE, STATE>;

raywake_core::params! {
    /// The centroid filter.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CentroidParams {
        /// Standard deviation of a centroid along each axis.
        pub centroid_sigma_m: f64 = 0.2, "m", (above 0);
        /// Standard deviation of the velocity at birth, along x and y each.
        pub birth_sigma_mps: f64 = 10.0, "m/s", (above 0);
        /// Standard deviation of the climb at birth.
        pub birth_climb_sigma_mps: f64 = 0.5, "m/s", (above 0);
        /// Standard deviation of the turn rate at birth.
        pub birth_turn_rate_sigma_radps: f64 = 0.2, "rad/s", (above 0);
        /// Longest rest after the first centroid.
        pub rest_max_s: f64 = 0.5, "s", (0 to 10);
        /// Squared Mahalanobis distance from the first centroid at which the filter leaves its
        /// rest.
        pub departure_d2: f64 = CHI2_99_2DOF, "", (above 0),
            "99 % quantile of chi-square with two degrees of freedom.";
        /// Speed above which a departure is taken for another sensor's view of another side.
        pub departure_max_mps: f64 = 60.0, "m/s", (above 0);
        /// Number of standard deviations from zero beyond which the sign of a speed is certain.
        pub facing_sigmas: f64 = 3.0, "", (above 0);
    } and {
        /// Process noise.
        pub noise: ProcessNoise = ProcessNoise::DEFAULT;
    }
}

/// What an update implies for the earlier states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Revision {
    /// Nothing.
    None,
    /// The filter left its rest: heading and speed were these all along.
    Departed,
    /// The filter had its object backwards.
    Turned,
}

impl Revision {
    /// Revises the states of a track before `now`, the state after the update.
    pub fn revise(self, now: &ObjectState, before: &mut [ObjectState]) {
        for state in before {
            match self {
                Revision::None => {}
                Revision::Departed => (state.heading, state.speed) = (now.heading, now.speed),
                Revision::Turned => {
                    state.heading += core::f64::consts::PI;
                    state.speed = -state.speed;
                }
            }
        }
    }
}

/// How much of the motion is known. Starts at 1, so that no filter is all zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u8)]
enum Phase {
    /// Nothing: only where and when the first centroid was seen.
    Resting { first: [f64; 2], since_s: f64 } = 1,
    /// It may still be backwards.
    Moving,
    /// The heading is known to point forwards: from now on a negative speed means reversing.
    Facing,
}

/// The filter of one track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentroidEkf {
    time_s: f64,
    mean: StateVector,
    covariance: Covariance,
    phase: Phase,
}

impl CentroidEkf {
    /// Creates the filter of an object first seen at `centroid` at `time_s`.
    pub fn birth(params: &CentroidParams, time_s: f64, centroid: [f64; 3]) -> CentroidEkf {
        let [x, y, z] = centroid;
        let measured = params.centroid_sigma_m;
        let deviations = [
            measured,
            measured,
            measured,
            0.0,
            params.birth_sigma_mps,
            params.birth_climb_sigma_mps,
            params.birth_turn_rate_sigma_radps,
        ];
        CentroidEkf {
            time_s,
            mean: StateVector::from([x, y, z, 0.0, 0.0, 0.0, 0.0]),
            covariance: Covariance::from_diagonal(&StateVector::from(deviations.map(|s| s * s))),
            phase: Phase::Resting { first: [x, y], since_s: time_s },
        }
    }

    /// Predicts to `time_s`; does nothing if that is not later.
    pub fn predict(&mut self, params: &CentroidParams, time_s: f64) {
        let dt = time_s - self.time_s;
        if dt.is_nan() || dt <= 0.0 {
            return;
        }
        self.time_s = time_s;
        let mut transition = if let Phase::Resting { .. } = self.phase {
            // All directions are equally likely.
            let spread = params.birth_sigma_mps * params.birth_sigma_mps * dt * dt;
            self.covariance[(0, 0)] += spread;
            self.covariance[(1, 1)] += spread;
            Covariance::identity()
        } else {
            jacobian(&self.mean, dt)
        };
        transition[(2, 5)] = dt;
        // Noise enters throughout, half of it propagated: exact to second order.
        let noise = Covariance::from_diagonal(&StateVector::from(
            params.noise.sigmas().map(|s| 0.5 * s * s * dt),
        ));
        self.covariance = transition * (self.covariance + noise) * transition.transpose() + noise;
        self.mean = advance(&self.mean, dt);
    }

    /// Squared Mahalanobis distance between a centroid and its prediction: chi-square with three
    /// degrees of freedom.
    pub fn distance2(&self, params: &CentroidParams, centroid: [f64; 3]) -> f64 {
        let innovation = self.innovation(centroid);
        (innovation.transpose() * self.weight(params) * innovation)[0]
    }

    /// Observes a centroid (Joseph form).
    pub fn update(&mut self, params: &CentroidParams, centroid: [f64; 3]) -> Revision {
        if let Phase::Resting { first, since_s } = self.phase {
            return self.rest(params, centroid, first, since_s);
        }
        let r = params.centroid_sigma_m * params.centroid_sigma_m;
        let innovation = self.innovation(centroid);
        let gain = self.covariance.fixed_view::<STATE, 3>(0, 0) * self.weight(params);
        self.mean += gain * innovation;
        let mut keep = Covariance::identity();
        let mut seen_part = keep.fixed_view_mut::<STATE, 3>(0, 0);
        seen_part -= gain;
        let joseph = keep * self.covariance * keep.transpose() + gain * gain.transpose() * r;
        self.covariance = (joseph + joseph.transpose()) * 0.5;
        self.face(params.facing_sigmas)
    }

    /// Time of the state, s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The state; the heading does not jump by a full turn.
    pub fn state(&self) -> ObjectState {
        let m = &self.mean;
        ObjectState {
            time_s: self.time_s,
            position: [m[0], m[1], m[2]],
            heading: m[3],
            speed: m[4],
            climb: m[5],
            turn_rate: m[6],
        }
    }

    /// Covariance of the state, in the order of [`ProcessNoise::sigmas`].
    pub fn covariance(&self) -> &SMatrix<f64, STATE, STATE> {
        &self.covariance
    }

    /// Velocity along x and y, m/s, and its covariance (xx, xy, yy).
    pub fn velocity(&self) -> ([f64; 2], [f64; 3]) {
        let (sin, cos) = (libm::sin(self.mean[3]), libm::cos(self.mean[3]));
        let (p, speed) = (&self.covariance, self.mean[4]);
        if let Phase::Resting { .. } = self.phase {
            return ([0.0; 2], [p[(4, 4)], 0.0, p[(4, 4)]]);
        }
        let (a, b) = ([-speed * sin, cos], [speed * cos, sin]);
        let product = |l: [f64; 2], r: [f64; 2]| {
            l[0] * r[0] * p[(3, 3)]
                + (l[0] * r[1] + l[1] * r[0]) * p[(3, 4)]
                + l[1] * r[1] * p[(4, 4)]
        };
        ([speed * cos, speed * sin], [product(a, a), product(a, b), product(b, b)])
    }

    fn innovation(&self, centroid: [f64; 3]) -> Vector3<f64> {
        Vector3::from(centroid) - self.mean.fixed_rows::<3>(0)
    }

    /// Inverse covariance of the innovation.
    fn weight(&self, params: &CentroidParams) -> Matrix3<f64> {
        let measured =
            Matrix3::from_diagonal_element(params.centroid_sigma_m * params.centroid_sigma_m);
        // Positive definite because of the noise.
        (self.covariance.fixed_view::<3, 3>(0, 0) + measured).try_inverse().unwrap_or_default()
    }

    /// Handles a further centroid while at rest; the filter may depart.
    fn rest(
        &mut self,
        params: &CentroidParams,
        centroid: [f64; 3],
        first: [f64; 2],
        since_s: f64,
    ) -> Revision {
        let born = CentroidEkf::birth(params, self.time_s, centroid);
        let (elapsed, measured) =
            (self.time_s - since_s, params.centroid_sigma_m * params.centroid_sigma_m);
        let moved = [centroid[0] - first[0], centroid[1] - first[1]];
        let moved2 = moved[0] * moved[0] + moved[1] * moved[1];
        let departs = moved2 > 2.0 * measured * params.departure_d2 || elapsed >= params.rest_max_s;
        let fastest = params.departure_max_mps * elapsed.max(0.0);
        if !departs || moved2 > fastest * fastest || moved2 == 0.0 {
            *self = CentroidEkf { phase: self.phase, ..born };
            return Revision::None;
        }
        *self = CentroidEkf { phase: Phase::Moving, ..born };
        let start = TwoPointStart::of(
            Matrix2::from_diagonal_element(measured as f32),
            moved.map(|v| v as f32),
            elapsed as f32,
        );
        (self.mean[3], self.mean[4]) = (start.heading as f64, start.speed as f64);
        for (a, to) in [0, 1, 3, 4].into_iter().enumerate() {
            for (b, and) in [0, 1, 3, 4].into_iter().enumerate() {
                self.covariance[(to, and)] = start.covariance[(a, b)] as f64;
            }
        }
        Revision::Departed
    }

    /// Makes the heading point forwards once the sign of the speed is certain.
    fn face(&mut self, sure: f64) -> Revision {
        let (speed, variance) = (self.mean[4], self.covariance[(4, 4)]);
        if self.phase == Phase::Facing || speed * speed <= sure * sure * variance {
            return Revision::None;
        }
        self.phase = Phase::Facing;
        if speed > 0.0 {
            return Revision::None;
        }
        self.mean[4] = -speed;
        self.mean[3] += core::f64::consts::PI;
        for n in (0..STATE).filter(|n| *n != 4) {
            self.covariance[(4, n)] = -self.covariance[(4, n)];
            self.covariance[(n, 4)] = -self.covariance[(n, 4)];
        }
        Revision::Turned
    }
}

/// The unicycle of (2.6) after `dt` seconds: along the chord of its arc, whose length is taken to
/// be that of the arc.
fn advance(m: &StateVector, dt: f64) -> StateVector {
    let course = m[3] + 0.5 * dt * m[6];
    let mut next = *m;
    next[0] += m[4] * libm::cos(course) * dt;
    next[1] += m[4] * libm::sin(course) * dt;
    next[2] += m[5] * dt;
    next[3] += m[6] * dt;
    next
}

/// Derivative of [`advance`] with respect to the state.
fn jacobian(m: &StateVector, dt: f64) -> Covariance {
    let course = m[3] + 0.5 * dt * m[6];
    let (along_x, along_y) = (libm::cos(course) * dt, libm::sin(course) * dt);
    let mut f = Covariance::identity();
    (f[(0, 3)], f[(0, 4)], f[(0, 6)]) = (-m[4] * along_y, along_x, -0.5 * dt * m[4] * along_y);
    (f[(1, 3)], f[(1, 4)], f[(1, 6)]) = (m[4] * along_x, along_y, 0.5 * dt * m[4] * along_x);
    f[(2, 5)] = dt;
    f[(3, 6)] = dt;
    f
}
