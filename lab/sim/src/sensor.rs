//! Spinning sensors: beams, revolution, range and noise of several devices.

use crate::rng::Rng;
use std::f64::consts::PI;

/// One laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Angle above the sensor's horizontal plane, rad.
    pub elevation: f64,
    /// Angle ahead of the column's azimuth (counter-clockwise), rad.
    pub azimuth: f64,
}

/// A sensor that spins clockwise as seen from its own top, with revolutions from rear to rear.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Lasers; all those of a column fire at once.
    pub beams: Vec<Beam>,
    /// Firings per revolution.
    pub columns: usize,
    /// Duration of a revolution, s.
    pub period_s: f64,
    /// Minimum and maximum reported range, m.
    pub range: [f64; 2],
    /// Standard deviation of the range, m.
    pub range_noise: f64,
    /// Standard deviation of a ray's true direction from the reported one, rad.
    pub angle_noise: f64,
    /// Probability that a ray gives no return for reasons unrelated to the scene.
    pub dropout: f64,
    /// Signal at 1 m, normal incidence and reflectivity 1, in units of the detection threshold: it
    /// makes returns fade with range and grazing incidence. Infinite: none fade.
    pub signal: f64,
}

/// Elevation and azimuth offset of the VLP-32C's lasers in the order of their numbers, degrees
/// (Velodyne, VLP-32C user manual 63-9325, table of laser channels).
const VLP32C: [[f64; 2]; 32] = [
    [-25.0, 1.4],
    [-1.0, -4.2],
    [-1.667, 1.4],
    [-15.639, -1.4],
    [-11.31, 1.4],
    [0.0, -1.4],
    [-0.667, 4.2],
    [-8.843, -1.4],
    [-7.254, 1.4],
    [0.333, -4.2],
    [-0.333, 1.4],
    [-6.148, -1.4],
    [-5.333, 4.2],
    [1.333, -1.4],
    [0.667, 4.2],
    [-4.0, -1.4],
    [-4.667, 1.4],
    [1.667, -4.2],
    [1.0, 1.4],
    [-3.667, -4.2],
    [-3.333, 4.2],
    [3.333, -1.4],
    [2.333, 1.4],
    [-2.667, -1.4],
    [-3.0, 1.4],
    [7.0, -1.4],
    [4.667, 1.4],
    [-2.333, -4.2],
    [-2.0, 4.2],
    [15.0, -1.4],
    [10.333, 1.4],
    [-1.333, -1.4],
];

impl Beam {
    fn degrees(elevation: f64, azimuth: f64) -> Beam {
        Beam { elevation: elevation.to_radians(), azimuth: azimuth.to_radians() }
    }
}

impl Sensor {
    /// The HDL-64E: 32 beams from +2 to -8.33 degrees, 32 from -8.83 to -24.33 degrees, 10
    /// revolutions a second, 120 m. Each laser is a little off its nominal direction, as in any
    /// individual device; the offsets are known to the calibration and the same in every
    /// simulation. 2048 firings per revolution: 131,072 rays.
    pub fn hdl64() -> Sensor {
        let mut rng = Rng::new(0x64);
        let degrees = |i: usize| match i {
            0..32 => 2.0 - 10.33 * i as f64 / 31.0,
            _ => -8.83 - 15.5 * (i - 32) as f64 / 31.0,
        };
        let mut beam =
            |i| Beam::degrees(degrees(i) + rng.range(-0.04, 0.04), rng.range(-0.08, 0.08));
        Sensor {
            beams: (0..64).map(&mut beam).collect(),
            columns: 2048,
            period_s: 0.1,
            range: [1.0, 120.0],
            range_noise: 0.02,
            angle_noise: 3e-4,
            dropout: 0.01,
            signal: 7e5,
        }
    }

    /// The HDL-32E: 32 beams from +10.67 to -30.67 degrees in steps of 1.33, 100 m. 1000 firings
    /// per revolution, fewer than half of the device's 2170 at 10 revolutions a second, so that
    /// four of them fit into a sweep; [`crate::SensorRig::hdl32x4_full`] has them all.
    pub fn hdl32() -> Sensor {
        let beam = |i| Beam::degrees((32.0 - 4.0 * f64::from(i)) / 3.0, 0.0);
        let beams = (0..32).map(beam).collect();
        Sensor { beams, columns: 1000, range: [1.0, 100.0], ..Sensor::hdl64() }
    }

    /// The VLP-32C: 32 beams, dense around the horizon and sparse below, with individual azimuths,
    /// 200 m; 1808 firings per revolution as in the device at 10 revolutions a second (one per
    /// 55.296 us).
    pub fn vlp32c() -> Sensor {
        let beams = VLP32C.iter().map(|&[elevation, azimuth]| Beam::degrees(elevation, azimuth));
        Sensor {
            beams: beams.collect(),
            columns: 1808,
            range: [1.0, 200.0],
            signal: 1.4e6,
            ..Sensor::hdl64()
        }
    }

    /// The Ouster OS1-128 in its mode 1024x10: 128 beams evenly spaced from +22.5 to -22.5 degrees,
    /// four alternating azimuths, 120 m; 131,072 rays.
    pub fn os1_128() -> Sensor {
        let beam =
            |i: usize| Beam::degrees(22.5 - 45.0 * i as f64 / 127.0, [4.2, 1.4, -1.4, -4.2][i % 4]);
        Sensor { beams: (0..128).map(beam).collect(), columns: 1024, ..Sensor::hdl64() }
    }

    /// The HDL-64E without noise and dropout, for comparison with closed forms.
    pub fn ideal() -> Sensor {
        let signal = f64::INFINITY;
        Sensor { range_noise: 0.0, angle_noise: 0.0, dropout: 0.0, signal, ..Sensor::hdl64() }
    }

    /// Azimuth of a column in the sensor's frame, rad in (-pi, pi): from the rear through left,
    /// forward and right.
    pub fn azimuth(&self, column: usize) -> f64 {
        let turned = (column as f64 + 0.5) / self.columns as f64;
        PI * (1.0 - 2.0 * turned)
    }

    /// Maximum distance of a ray from its column's half plane, per metre ahead: the beams' own
    /// azimuths plus the largest deviation of [`Rng::bell`].
    pub(crate) fn spread(&self) -> f64 {
        let widest = self.beams.iter().map(|b| b.azimuth.abs()).fold(0.0, f64::max);
        1e-4 + 1.01 * (widest + 3.5 * self.angle_noise).tan()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elevations(s: &Sensor) -> Vec<f64> {
        s.beams.iter().map(|b| b.elevation.to_degrees()).collect()
    }

    #[test]
    fn hdl64_table_and_turn() {
        let s = Sensor::hdl64();
        assert_eq!(s.beams.len(), 64);
        assert!((s.beams[0].elevation.to_degrees() - 2.0).abs() < 0.05);
        assert!((s.beams[31].elevation.to_degrees() + 8.33).abs() < 0.05);
        assert!((s.beams[63].elevation.to_degrees() + 24.33).abs() < 0.05);
        assert!(s.beams.windows(2).all(|b| b[0].elevation > b[1].elevation));
        // A quarter into the revolution it looks left, at three quarters right.
        assert!((s.azimuth(511) - 1.5723).abs() < 1e-3 && (s.azimuth(1536) + 1.5723).abs() < 1e-3);
    }

    #[test]
    fn tables_of_the_others() {
        let e = elevations(&Sensor::hdl32());
        assert!((e[0] - 10.67).abs() < 0.01 && (e[31] + 30.67).abs() < 0.01);
        assert!(e.windows(2).all(|p| (p[0] - p[1] - 1.3333).abs() < 1e-3));
        let mut e = elevations(&Sensor::vlp32c());
        e.sort_by(f64::total_cmp);
        assert!((e[0] + 25.0).abs() < 1e-9 && (e[31] - 15.0).abs() < 1e-9);
        assert!(e.windows(2).all(|p| p[1] - p[0] > 0.33), "no elevation twice");
        let near = e.iter().filter(|e| (-4.1..1.8).contains(*e)).count();
        assert_eq!(near, 18, "a third of a degree apart around the horizon");
        let s = Sensor::os1_128();
        assert_eq!(s.beams.len(), 128);
        assert!((elevations(&s)[127] + 22.5).abs() < 1e-9);
    }

    #[test]
    fn rays_stay_within_the_spread() {
        let s = Sensor { angle_noise: 1e-3, ..Sensor::vlp32c() };
        assert!(s.spread() > (4.2f64.to_radians() + 3.47e-3).tan());
        assert!(Sensor::ideal().spread() < 2e-3);
    }
}
