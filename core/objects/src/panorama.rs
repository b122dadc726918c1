//! Free space beside what a sensor sees: rays that pass an object and end farther away.
//!
//! An object's own returns do not show whether it ends or is merely hidden by another; the rays
//! next to them do. Directions from a sensor are binned by azimuth and rise, and each bin holds the
//! nearest and the farthest return. Without this, a tram that drives past a gap between houses
//! would pass for a static object: its visible part begins and ends with the gap.

/// Bins per revolution; they are 0.22 to 0.45 degrees wide.
const AZIMUTHS: usize = 1024;
/// Bins of the rise, height over horizontal distance, from the lowest up.
const RISES: usize = 64;
const LOWEST: f32 = -0.6;
const RISE: f32 = 0.015;
/// Number of bins beside a return whose rays may pass.
const BESIDE: usize = 3;
raywake_core::params! {
    /// Rays that pass an object.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PassingParams {
        /// Margin: a return farther than another by more than this is of another object.
        pub passing_margin_m: f32 = 1.0, "m", (0 to 10);
        /// Increase of the margin per metre of distance: a side seen at a slant recedes that much.
        pub passing_margin_ratio: f32 = 0.05, "", (0 to 1);
        /// Number of directions in which rays must pass for each one in which they end at the
        /// object or before it.
        pub passing_ratio: u32 = 3, "", (1 to 100);
    }
}

/// Nearest and farthest distance, m; if there is no return, the first exceeds the second.
type Reach = [f32; 2];
const NOTHING: Reach = [f32::INFINITY, 0.0];

/// What a sensor sees around it in about 100 ms.
pub struct Panorama {
    reach: [[Reach; RISES]; AZIMUTHS],
}

impl Default for Panorama {
    fn default() -> Panorama {
        Panorama::new()
    }
}

impl Panorama {
    /// A panorama with nothing seen. 512 KB: keep it in a box.
    pub const fn new() -> Panorama {
        Panorama { reach: [[[0.0; 2]; RISES]; AZIMUTHS] }
    }

    /// Finds which rays pass the returns that are `wanted` by their index, among all returns of
    /// about 100 ms. `ray` gives a return's sensor and where its ray began and ended, m; `found`
    /// receives whether the neighbouring rays pass on its left and on its right.
    pub fn look<T>(
        &mut self,
        params: &PassingParams,
        returns: &mut [T],
        ray: impl Fn(&T) -> (u8, [f32; 3], [f32; 3]),
        wanted: impl Fn(usize) -> bool,
        found: impl Fn(&mut T, [bool; 2]),
    ) {
        let sensors = returns.iter().map(|one| ray(one).0.saturating_add(1)).max();
        for sensor in 0..sensors.unwrap_or(0) {
            self.clear();
            for (_, from, to) in returns.iter().map(&ray).filter(|ray| ray.0 == sensor) {
                self.add(from, to);
            }
            for (n, one) in returns.iter_mut().enumerate() {
                let (of, from, to) = ray(one);
                if of == sensor && wanted(n) {
                    found(one, self.passed(params, from, to));
                }
            }
        }
    }

    /// Clears it for the next sensor.
    fn clear(&mut self) {
        self.reach.fill([NOTHING; RISES]);
    }

    /// Adds a return and the origin of its ray.
    fn add(&mut self, from: [f32; 3], to: [f32; 3]) {
        let Some(Direction { azimuth, rise, range }) = direction(from, to) else { return };
        let [near, far] = &mut self.reach[azimuth][rise];
        (*near, *far) = (near.min(range), far.max(range));
    }

    /// Whether the neighbouring rays to the left and to the right of a return, as the sensor sees
    /// it, pass its object: over the object's whole height, nearly all that have a return end
    /// farther away. Through a window or between wheels, only some do.
    fn passed(&self, params: &PassingParams, from: [f32; 3], to: [f32; 3]) -> [bool; 2] {
        let Some(Direction { azimuth, rise: own, range }) = direction(from, to) else {
            return [false; 2];
        };
        let margin_m = params.passing_margin_m;
        let farther = range + margin_m + params.passing_margin_ratio * range;
        [1, AZIMUTHS - 1].map(|step| {
            let beside: [_; BESIDE] =
                core::array::from_fn(|n| &self.reach[(azimuth + (n + 1) * step) % AZIMUTHS]);
            let ends = |rise: usize| beside.iter().any(|bins| bins[rise][0] < farther);
            // This settles most returns early.
            if ends(own) {
                return false;
            }
            let (mut pass, mut end) = (0, 0);
            for (rise, [near, far]) in self.reach[azimuth].iter().enumerate() {
                if *near > range + margin_m || *far < range - margin_m {
                    continue;
                }
                if ends(rise) {
                    end += 1;
                } else if beside.iter().any(|bins| bins[rise][1] > farther) {
                    pass += 1;
                }
            }
            pass > params.passing_ratio * end
        })
    }
}

struct Direction {
    azimuth: usize,
    rise: usize,
    /// Horizontal distance, m.
    range: f32,
}

/// None below and above the binned range, and for input that is not finite.
fn direction(from: [f32; 3], to: [f32; 3]) -> Option<Direction> {
    let [x, y, z]: [f32; 3] = core::array::from_fn(|d| to[d] - from[d]);
    let range = libm::sqrtf(x * x + y * y);
    let rise = (z / range - LOWEST) / RISE;
    if !(range > 0.0 && range.is_finite() && (0.0..RISES as f32).contains(&rise)) {
        return None;
    }
    // Grows with the azimuth from 0 to 4, without trigonometric functions.
    let share = y / (x.abs() + y.abs());
    let quarters = match (x < 0.0, y < 0.0) {
        (true, _) => 2.0 - share,
        (false, true) => 4.0 + share,
        (false, false) => share,
    };
    let azimuth = ((quarters * (AZIMUTHS / 4) as f32) as usize).min(AZIMUTHS - 1);
    Some(Direction { azimuth, rise: rise as usize, range })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::boxed::Box;
    use std::vec::Vec;

    const PARAMS: PassingParams = PassingParams::DEFAULT;
    const FROM: [f32; 3] = [3.0, -2.0, 1.8];
    const BEAMS: [f32; 5] = [-0.06, -0.04, -0.02, 0.0, 0.02];

    fn at(degrees: f32, beam: usize, range: f32) -> [f32; 3] {
        let (s, c) = degrees.to_radians().sin_cos();
        [FROM[0] + range * c, FROM[1] + range * s, FROM[2] + range * BEAMS[beam]]
    }

    /// A wall at 40 m and an object at 20 m from 10 degrees before to 10 degrees after `middle`,
    /// except where `other` gives the range of something else, by beam and offset in degrees.
    fn scene(middle: f32, other: impl Fn(usize, f32) -> Option<f32>) -> Box<Panorama> {
        let mut panorama = raywake_alloc_guard::boxed!(Panorama, Panorama::new());
        panorama.clear();
        for n in 0..1800 {
            let degrees = 0.2 * n as f32;
            let off = (degrees - middle + 540.0) % 360.0 - 180.0;
            for beam in 0..BEAMS.len() {
                let range = other(beam, off).unwrap_or(if off.abs() < 10.1 { 20.0 } else { 40.0 });
                panorama.add(FROM, at(degrees, beam, range));
            }
        }
        panorama
    }

    #[test]
    fn rays_pass_at_the_ends_of_an_object_alone() {
        for middle in [0.0, 45.0, 90.0, 179.0, 230.0, 300.0] {
            let panorama = scene(middle, |_, _| None);
            for beam in 0..BEAMS.len() {
                let passed =
                    |off: f32| panorama.passed(&PARAMS, FROM, at(middle + off, beam, 20.0));
                assert_eq!(passed(10.0), [true, false], "{middle}");
                assert_eq!(passed(-10.0), [false, true], "{middle}");
                assert_eq!(passed(0.0), [false, false], "{middle}");
            }
        }
    }

    #[test]
    fn no_ray_passes_where_something_is_in_front_or_beside() {
        for range in [8.0, 20.5] {
            let panorama = scene(60.0, |_, off| (9.1..15.0).contains(&off).then_some(range));
            assert_eq!(panorama.passed(&PARAMS, FROM, at(60.0 + 9.0, 1, 20.0)), [false, false]);
            assert_eq!(panorama.passed(&PARAMS, FROM, at(60.0 - 10.0, 1, 20.0)), [false, true]);
        }
    }

    #[test]
    fn rays_through_a_window_do_not_count_as_passing() {
        let window = |beam, off: f32| (beam == 2 && off.abs() < 2.9).then_some(40.0);
        let panorama = scene(60.0, window);
        for beam in 0..BEAMS.len() {
            assert_eq!(panorama.passed(&PARAMS, FROM, at(60.0 - 3.0, beam, 20.0)), [false, false]);
        }
    }

    #[test]
    fn every_sensor_looks_for_itself() {
        let mut panorama = raywake_alloc_guard::boxed!(Panorama, Panorama::new());
        panorama.clear();
        // An edge at 60 degrees; the wall beyond it is seen by the other sensor or by the same one.
        for (of_wall, expected) in [(1, [false; 2]), (0, [true, false])] {
            let returns = (0..100).map(|n| 50.0 + 0.2 * n as f32);
            let mut returns: Vec<_> = returns
                .map(|degrees| match degrees < 60.1 {
                    true => (0, at(degrees, 1, 20.0), [false; 2]),
                    false => (of_wall, at(degrees, 1, 40.0), [false; 2]),
                })
                .collect();
            panorama.look(
                &PARAMS,
                &mut returns,
                |(sensor, to, _)| (*sensor, FROM, *to),
                |n| n != 49,
                |one, passed| one.2 = passed,
            );
            assert_eq!(returns[50].2, expected);
            assert_eq!(returns[49].2, [false; 2], "not wanted");
            assert_eq!(returns[20].2, [false; 2]);
        }
    }

    #[test]
    fn nothing_passes_through_unknown_space() {
        let mut panorama = scene(60.0, |_, _| None);
        panorama.clear();
        assert_eq!(panorama.passed(&PARAMS, FROM, at(70.0, 1, 20.0)), [false; 2]);
        for odd in [[f32::NAN; 3], FROM, [FROM[0], FROM[1], 9.0], [3.1, -2.0, 90.0], [f32::MAX; 3]]
        {
            panorama.add(FROM, odd);
            assert_eq!(panorama.passed(&PARAMS, FROM, odd), [false; 2]);
        }
        let seen: Vec<_> =
            panorama.reach.iter().flatten().filter(|reach| **reach != NOTHING).collect();
        assert!(seen.is_empty(), "{seen:?}");
    }
}
