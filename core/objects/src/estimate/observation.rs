//! A return as an iteration sees it: its place on the object, its residual and its derivatives.
//!
//! A return `z` at time `t`, with model point `m`, has the residual `e = R(φ)'(z - p) - m`. Rotated
//! into the world's axes, which preserves its length, its derivatives contain no sine: with `d = z
//! - p`, `-1` for the position, `(d_y, -d_x)` for the heading, `-R` for `m`.

use super::samples::Sample;
use super::state::ControlPoint;
use super::surface::Surface;

/// A return observed from a trajectory. The axes of residual and precision are those of its model
/// point's surface: across, along and up.
#[derive(Clone, Copy)]
pub(super) struct Observation {
    /// From the object's origin to the return, m, in the world's axes.
    offset: [f64; 3],
    cos: f64,
    sin: f64,
    /// Nearest model point.
    pub nearest: u16,
    /// The first two axes, in the world's plane.
    pub axes: [[f64; 2]; 2],
    /// Derivatives of the return along them with respect to the heading, m/rad.
    pub by_heading: [f64; 2],
    /// m.
    pub residual: [f64; 3],
    /// 1/m².
    pub precision: [f64; 3],
}

impl Observation {
    pub const NONE: Observation = Observation {
        offset: [0.0; 3],
        cos: 0.0,
        sin: 0.0,
        nearest: 0,
        axes: [[0.0; 2]; 2],
        by_heading: [0.0; 2],
        residual: [0.0; 3],
        precision: [0.0; 3],
    };

    /// Observes a return from the object's pose at its time.
    pub fn of(control_points: &[ControlPoint], sample: &Sample) -> Observation {
        let [x, y, z, heading] = sample.basis.pose(control_points);
        let (sin, cos) = libm::sincos(heading);
        let [u, v, w] = sample.position.map(f64::from);
        Observation { offset: [u - x, v - y, w - z], cos, sin, ..Observation::NONE }
    }

    /// The return in the object's frame, m.
    pub fn local(&self) -> [f64; 3] {
        self.local_beyond([0.0; 3])
    }

    /// The same in single precision, like model points.
    pub fn local_f32(&self) -> [f32; 3] {
        self.local().map(|value| value as f32)
    }

    /// The point at `beyond` (m, along the world's axes) from the return, in the object's frame.
    pub fn local_beyond(&self, beyond: [f64; 3]) -> [f64; 3] {
        let [x, y, z]: [f64; 3] = core::array::from_fn(|d| self.offset[d] + beyond[d]);
        [self.cos * x + self.sin * y, self.cos * y - self.sin * x, z]
    }

    /// Evaluates residual and derivatives at a model point; returns the cost.
    pub fn evaluate(&mut self, model: &[f32; 3], surface: &Surface) -> f64 {
        let [nx, ny] = surface.normal;
        let [x, y, z] = self.local();
        let off = [x - f64::from(model[0]), y - f64::from(model[1]), z - f64::from(model[2])];
        let across = [self.cos * nx - self.sin * ny, self.sin * nx + self.cos * ny];
        let along = [-across[1], across[0]];
        let turn = [self.offset[1], -self.offset[0]];
        self.axes = [across, along];
        self.by_heading =
            [across[0] * turn[0] + across[1] * turn[1], along[0] * turn[0] + along[1] * turn[1]];
        self.residual = [nx * off[0] + ny * off[1], nx * off[1] - ny * off[0], off[2]];
        self.precision = surface.precision;
        let mut square = 0.0;
        for (residual, precision) in self.residual.iter().zip(surface.precision) {
            square += precision * residual * residual;
        }
        0.5 * square
    }
}
