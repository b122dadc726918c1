//! The filter of a flow tracklet (section 3.6.1): an extended Kalman filter with a model of
//! constant turn rate and velocity (CTRV).
//!
//! State (3.15): position, heading, speed, turn rate. Positions are metres from the point the
//! tracklet follows, so that they keep their precision wherever the vehicle drives. The normalised
//! innovations squared (NIS; Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to
//! Tracking and Navigation", 2001, section 5.4) scale all noise together, which leaves the gains
//! unchanged. The noise has to be measured because poses, stamps and drivers differ from one
//! recording to the next.
//!
//! The poses themselves are not corrected. Static clusters do show a common displacement, about
//! 6 mm per sweep on KITTI drive 0005, but the errors of dynamic ones do not follow it.

use crate::ctrv::TwoPointStart;
use crate::params::{Birth, TrackletParams};
use nalgebra::{Matrix2, Matrix5, Matrix5x2, Vector2, Vector5};

/// Mean and covariance of (x, y, heading, speed, turn rate).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ekf {
    /// m, m, rad, m/s, rad/s.
    pub mean: Vector5<f32>,
    /// Symmetric, under the assumed noise; the estimated covariance is `scale` times this.
    pub covariance: Matrix5<f32>,
    /// Factor on the variances of all noise, of the process and of the measurements, estimated from
    /// the innovations over [`TrackletParams::innovation_sweeps`].
    pub scale: f32,
}

/// Standard deviations at birth in the author's program, in units of the state.
const BIRTH_SOURCE: [f32; 5] = [0.1, 0.1, 0.2, 1.5, 0.2];

impl Ekf {
    /// A tracklet born from the displacement `moved` (m) of its first match over `dt` seconds,
    /// relative to where it moved to; `noise` is the covariance of a measured position, m².
    ///
    /// At the target: as in [`TwoPointStart`]. At the source: the author's start, one step late.
    pub fn birth(params: &TrackletParams, noise: Matrix2<f32>, moved: [f32; 2], dt: f32) -> Ekf {
        let TwoPointStart { heading, speed, covariance } = TwoPointStart::of(noise, moved, dt);
        let mut mean = Vector5::new(0.0, 0.0, heading, speed, 0.0);
        let mut p = Matrix5::zeros();
        match params.birth {
            Birth::Source => {
                (mean[0], mean[1]) = (-moved[0], -moved[1]);
                p.set_diagonal(&Vector5::from(BIRTH_SOURCE.map(|s| s * s)));
            }
            Birth::Target => {
                p.fixed_view_mut::<4, 4>(0, 0).copy_from(&covariance);
                p[(4, 4)] = params.turn_birth_radps * params.turn_birth_radps;
            }
        }
        Ekf { mean, covariance: p, scale: 1.0 }
    }

    /// Whether it has not moved since birth. Its speed is then zero and its heading, without which
    /// the speed of a polar state cannot grow, is unknown.
    pub fn at_rest(&self) -> bool {
        self.mean[3] == 0.0
    }

    /// A tracklet at rest after its first displacement, `elapsed` seconds after the match before
    /// its birth: reborn from that displacement over that time, or `None` if it is outside the
    /// gate, which is isotropic here. The filter alone would only pick up motion along its x axis.
    pub fn depart(
        &self,
        params: &TrackletParams,
        noise: Matrix2<f32>,
        moved: [f32; 2],
        elapsed: f32,
        dt: f32,
    ) -> Option<Ekf> {
        let p = &self.covariance;
        let ahead = p[(0, 0)] + (2.0 * p[(0, 3)] + p[(3, 3)] * dt) * dt;
        let measured = noise[(0, 0)].max(noise[(1, 1)]);
        let d2 = (moved[0] * moved[0] + moved[1] * moved[1]) / (ahead + measured);
        (d2 <= params.gate_d2).then(|| Ekf::birth(params, noise, moved, elapsed))
    }

    /// Prediction over `dt` seconds (3.16, 3.20, 3.21).
    pub fn predict(&mut self, params: &TrackletParams, dt: f32) {
        let [heading, speed, turn] = [self.mean[2], self.mean[3], self.mean[4]];
        let (sin, cos) = (libm::sinf(heading), libm::cosf(heading));
        self.mean[0] += speed * cos * dt;
        self.mean[1] += speed * sin * dt;
        self.mean[2] = wrap(heading + turn * dt);
        let mut f = Matrix5::identity();
        (f[(0, 2)], f[(0, 3)]) = (-speed * sin * dt, cos * dt);
        (f[(1, 2)], f[(1, 3)]) = (speed * cos * dt, sin * dt);
        f[(2, 4)] = dt;
        self.covariance = f * self.covariance * f.transpose();
        let (of_speed, of_turn) = (params.speed_noise_mps2 * dt, params.turn_noise_radps2 * dt);
        self.covariance[(3, 3)] += of_speed * of_speed;
        self.covariance[(4, 4)] += of_turn * of_turn;
    }

    /// Resets the position to zero, measured with errors of covariance `noise` that are independent
    /// of those of the velocity.
    pub fn measure_place(&mut self, noise: Matrix2<f32>) {
        let mut keep = Matrix5::identity();
        keep.fixed_view_mut::<2, 2>(0, 0).fill(0.0);
        self.mean = keep * self.mean;
        self.covariance = keep * self.covariance * keep;
        self.covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&noise);
    }

    /// Observes a position (3.22-3.24, Joseph form). Returns `false` and changes nothing if it is
    /// outside the gate (3.25). The gate widens with the scale of the noise.
    pub fn update(
        &mut self,
        params: &TrackletParams,
        noise: Matrix2<f32>,
        observed: [f32; 2],
    ) -> bool {
        let p = &self.covariance;
        let r = noise;
        let innovation = Vector2::new(observed[0] - self.mean[0], observed[1] - self.mean[1]);
        let s = p.fixed_view::<2, 2>(0, 0) + r;
        let determinant = s[(0, 0)] * s[(1, 1)] - s[(0, 1)] * s[(1, 0)];
        let inverse =
            Matrix2::new(s[(1, 1)], -s[(0, 1)], -s[(1, 0)], s[(0, 0)]) * (1.0 / determinant);
        let d2 = (innovation.transpose() * inverse * innovation)[0];
        // A NaN, should one ever occur, ends the tracklet.
        if d2 > params.gate_d2 * self.scale.max(1.0) || d2.is_nan() {
            return false;
        }
        let gain: Matrix5x2<f32> = p.fixed_view::<5, 2>(0, 0) * inverse;
        self.mean += gain * innovation;
        let mut keep = Matrix5::identity();
        let mut of_position = keep.fixed_view_mut::<5, 2>(0, 0);
        of_position -= gain;
        let joseph = keep * p * keep.transpose() + gain * r * gain.transpose();
        self.covariance = (joseph + joseph.transpose()) * 0.5;
        // At rest innovations say nothing: the displacement of static columns is exactly zero.
        if params.innovation_sweeps > 0.0 && !self.at_rest() {
            let per_axis = 0.5 * d2;
            let scale = self.scale + (per_axis - self.scale) / params.innovation_sweeps;
            self.scale = scale.clamp(params.scale_min, params.scale_max);
        }
        self.face_forward();
        true
    }

    /// Flips a state with negative speed: backwards at one heading is forwards at the opposite one.
    fn face_forward(&mut self) {
        if self.mean[3] < 0.0 {
            self.mean[3] = -self.mean[3];
            self.mean[2] += core::f32::consts::PI;
            for n in [0, 1, 2, 4] {
                self.covariance[(3, n)] = -self.covariance[(3, n)];
                self.covariance[(n, 3)] = -self.covariance[(n, 3)];
            }
        }
        self.mean[2] = wrap(self.mean[2]);
    }

    /// Expresses the state in axes rotated by `angle`, rad (a vehicle frame that turned, section
    /// 3.7).
    pub fn turn_axes(&mut self, angle: f32) {
        let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
        let (x, y) = (self.mean[0], self.mean[1]);
        (self.mean[0], self.mean[1]) = (cos * x + sin * y, cos * y - sin * x);
        self.mean[2] = wrap(self.mean[2] - angle);
        let mut t = Matrix5::identity();
        (t[(0, 0)], t[(0, 1)], t[(1, 0)], t[(1, 1)]) = (cos, sin, -sin, cos);
        self.covariance = t * self.covariance * t.transpose();
    }

    /// Velocity along the axes of the state, m/s, and its covariance (xx, xy, yy).
    pub fn velocity(&self) -> ([f32; 2], [f32; 3]) {
        let (sin, cos) = (libm::sinf(self.mean[2]), libm::cosf(self.mean[2]));
        let speed = self.mean[3];
        let [hh, hs, ss] = [(2, 2), (2, 3), (3, 3)].map(|at| self.scale * self.covariance[at]);
        if self.at_rest() {
            // All directions are equally likely.
            return ([0.0; 2], [ss, 0.0, ss]);
        }
        // Rows of the Jacobian of (v cos h, v sin h) with respect to (h, v).
        let (a, b) = ([-speed * sin, cos], [speed * cos, sin]);
        let product = |l: [f32; 2], r: [f32; 2]| {
            l[0] * r[0] * hh + (l[0] * r[1] + l[1] * r[0]) * hs + l[1] * r[1] * ss
        };
        ([speed * cos, speed * sin], [product(a, a), product(a, b), product(b, b)])
    }
}

impl Ekf {
    /// log(1 + speed / its standard deviation).
    pub fn certainty(&self) -> f32 {
        let sigma = libm::sqrtf(self.scale * self.covariance[(3, 3)]).max(SIGMA_MIN_MPS);
        libm::log1pf(self.mean[3].abs() / sigma)
    }
}

/// Lower bound on the standard deviation of a speed, m/s: a filter that has long seen the same
/// becomes overconfident.
const SIGMA_MIN_MPS: f32 = 0.05;

/// The same angle in (-pi, pi]; the argument must lie within three turns of it.
fn wrap(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    let mut a = angle;
    for _ in 0..3 {
        if a > PI {
            a -= TAU;
        } else if a <= -PI {
            a += TAU;
        }
    }
    a
}

#[cfg(test)]
mod tests;
