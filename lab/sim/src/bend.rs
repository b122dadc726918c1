//! Lines of constant curvature: the axis of a road that curves evenly.

use crate::path::{Path, State};

/// Curvature below which a line is treated as straight, 1/m: after a kilometre it deviates from the
/// straight line by half a millimetre.
const STRAIGHT: f64 = 1e-9;

/// A line through the origin of the street frame, where it runs along +x. Places beside it are
/// given by station (m along it) and offset (m to the left).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bend {
    /// 1/m, left positive.
    pub(crate) curvature: f64,
}

impl Bend {
    /// Offset of a place from the line.
    pub(crate) fn offset(&self, x: f64, y: f64) -> f64 {
        if self.curvature.abs() < STRAIGHT {
            return y;
        }
        let radius = 1.0 / self.curvature;
        let down = radius - y;
        radius - radius.signum() * (x * x + down * down).sqrt()
    }

    /// Place and heading (rad) at this station and offset.
    pub(crate) fn at(&self, station: f64, offset: f64) -> [f64; 3] {
        if self.curvature.abs() < STRAIGHT {
            return [station, offset, 0.0];
        }
        let (radius, yaw) = (1.0 / self.curvature, station * self.curvature);
        let (s, c) = yaw.sin_cos();
        [(radius - offset) * s, radius - (radius - offset) * c, yaw]
    }

    /// State of someone at this station and offset who moves along the line (`sign` 1) or back
    /// (-1).
    pub(crate) fn state(&self, [station, offset]: [f64; 2], sign: f64, speed: f64) -> State {
        let [x, y, yaw] = self.at(station, offset);
        let turned = if sign < 0.0 { std::f64::consts::PI } else { 0.0 };
        State { x, y, yaw: yaw + turned, speed }
    }

    /// Curvature of the path of someone at this offset.
    pub(crate) fn turn(&self, offset: f64, sign: f64) -> f64 {
        sign * self.curvature / (1.0 - self.curvature * offset)
    }

    /// Path along the line at a constant offset for this long, s; at station `place[0]` at time 0.
    pub(crate) fn follow(&self, place: [f64; 2], sign: f64, speed: f64, long_s: f64) -> Path {
        Path::from(self.state(place, sign, speed)).then(long_s, 0.0, self.turn(place[1], sign))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back() {
        for curvature in [0.0, 0.01, -0.004] {
            let bend = Bend { curvature };
            for place in [[30.0, 5.0], [-80.0, -12.0], [120.0, 0.0]] {
                let [x, y, yaw] = bend.at(place[0], place[1]);
                assert!((bend.offset(x, y) - place[1]).abs() < 1e-9);
                assert_eq!(yaw, place[0] * curvature);
            }
        }
    }

    #[test]
    fn followers_keep_their_offset() {
        for (curvature, sign) in [(0.01, 1.0), (0.01, -1.0), (-0.02, 1.0), (0.0, -1.0)] {
            let bend = Bend { curvature };
            let path = bend.follow([10.0, -3.0], sign, 9.0, 20.0);
            for t in [-2.0, 1.0, 5.0] {
                let at = path.at(t);
                let gone = sign * 9.0 * t / (1.0 + 3.0 * curvature);
                let [x, y, _] = bend.at(10.0 + gone, -3.0);
                assert!((at.x - x).hypot(at.y - y) < 1e-9, "{at:?}");
            }
        }
    }
}
