//! A spinning 64-beam sensor in the manner of the HDL-64E.

use crate::rng::Rng;

/// Columns of one turn: 0.176 degrees each, so that a sweep never exceeds 2^17 returns.
const COLUMNS: usize = 2048;

/// One laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Above the sensor's horizontal plane, rad.
    pub elevation: f64,
    /// Ahead of the column's azimuth (counter-clockwise), rad.
    pub azimuth: f64,
}

/// A sensor that spins clockwise seen from above and starts and ends its turn at the rear.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Lasers from top to bottom; all of a column fire at once.
    pub beams: Vec<Beam>,
    /// Firings a turn.
    pub columns: usize,
    /// Duration of a turn, s.
    pub turn_s: f64,
    /// Height above the ground, m.
    pub height: f64,
    /// Nearest and farthest range that is reported, m.
    pub range: [f64; 2],
    /// Deviation of the range, m.
    pub range_noise: f64,
    /// Deviation of a ray's true direction from the reported one, rad.
    pub angle_noise: f64,
    /// Probability that a ray gives no return for no reason of the scene.
    pub dropout: f64,
    /// Signal at 1 m, normal incidence and reflectivity 1 in units of the detection threshold:
    /// what makes returns fade with range and grazing incidence. Infinite: none fade.
    pub signal: f64,
}

impl Sensor {
    /// The HDL-64E on a car's roof: 32 beams from +2 to -8.33 degrees, 32 from -8.83 to -24.33
    /// degrees, 10 turns a second, 120 m. Each laser sits a little off its place, as in any copy
    /// of the device; the offsets are known to the calibration and the same in every simulation.
    pub fn hdl64() -> Sensor {
        let mut rng = Rng::new(0x64);
        let degrees = |i: usize| match i {
            0..32 => 2.0 - 10.33 * i as f64 / 31.0,
            _ => -8.83 - 15.5 * (i - 32) as f64 / 31.0,
        };
        let mut beam = |i: usize| Beam {
            elevation: (degrees(i) + rng.range(-0.04, 0.04)).to_radians(),
            azimuth: rng.range(-0.08, 0.08f64).to_radians(),
        };
        Sensor {
            beams: (0..64).map(&mut beam).collect(),
            columns: COLUMNS,
            turn_s: 0.1,
            height: 1.73,
            range: [1.0, 120.0],
            range_noise: 0.02,
            angle_noise: 3e-4,
            dropout: 0.01,
            signal: 7e5,
        }
    }

    /// The same sensor without noise and dropout, for comparison with closed forms.
    pub fn ideal() -> Sensor {
        let signal = f64::INFINITY;
        Sensor { range_noise: 0.0, angle_noise: 0.0, dropout: 0.0, signal, ..Sensor::hdl64() }
    }

    /// Azimuth of a column in the sensor's frame, rad in (-pi, pi): from the rear through left,
    /// forward and right.
    pub fn azimuth(&self, column: usize) -> f64 {
        let turned = (column as f64 + 0.5) / self.columns as f64;
        std::f64::consts::PI * (1.0 - 2.0 * turned)
    }

    /// Time of a column after the moment the sensor looks forward, s.
    pub fn offset_s(&self, column: usize) -> f64 {
        self.turn_s * ((column as f64 + 0.5) / self.columns as f64 - 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_and_turn() {
        let s = Sensor::hdl64();
        assert_eq!(s.beams.len(), 64);
        assert!(s.beams.len() * s.columns <= 131_072);
        assert!((s.beams[0].elevation.to_degrees() - 2.0).abs() < 0.05);
        assert!((s.beams[31].elevation.to_degrees() + 8.33).abs() < 0.05);
        assert!((s.beams[63].elevation.to_degrees() + 24.33).abs() < 0.05);
        assert!(s.beams.windows(2).all(|b| b[0].elevation > b[1].elevation));
        // A quarter into the turn it looks left, at three quarters right.
        assert!((s.azimuth(511) - 1.5723).abs() < 1e-3 && (s.offset_s(511) + 0.025).abs() < 1e-4);
        assert!((s.azimuth(1536) + 1.5723).abs() < 1e-3 && (s.offset_s(1536) - 0.025).abs() < 1e-4);
    }
}
