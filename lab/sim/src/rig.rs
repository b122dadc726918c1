//! Sensors on a vehicle: where they are mounted, when they fire, and where the vehicle frame lies.

use crate::sensor::Sensor;
use glam::{DQuat, DVec3};
use raywake_core::params::SENSORS_MAX;
use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};
use std::fmt;
use std::str::FromStr;

/// Duration of a sweep, s: everything that the sensors fire from half of it before the stamp to
/// half of it after.
pub const PERIOD_S: f64 = 0.1;

/// Interval between firings of all beams of an HDL-32E, s (Velodyne, HDL-32E user manual 63-9113).
const HDL32_FIRING_S: f64 = 46.08e-6;

/// Stamp of sweep `index`, s.
pub fn stamp_s(index: usize) -> f64 {
    index as f64 / 10.0
}

/// A sensor in its mounting position.
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    /// The sensor.
    pub sensor: Sensor,
    /// Its pose on the vehicle.
    pub vehicle_from_sensor: Pose,
    /// Time at which it first looks along its x axis, s: two sensors with equal periods and
    /// different phases look apart for ever, and sensors with different periods drift apart.
    pub phase_s: f64,
}

impl Mount {
    /// A return of a firing at this place in the sensor's frame.
    pub(crate) fn point(&self, firing: &Firing, at: DVec3, intensity: f64) -> Point {
        Point {
            position: self.vehicle_from_sensor.transform(at).as_vec3().to_array(),
            intensity: intensity as f32,
            offset_s: firing.offset_s as f32,
            sensor: firing.mount as u32,
        }
    }
}

/// One to [`SENSORS_MAX`] sensors on a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorRig {
    /// Sensors, indexed by [`raywake_core::sweep::Point::sensor`].
    pub mounts: Vec<Mount>,
    /// Origin of the vehicle frame relative to the ground point beneath the vehicle's centre (x
    /// forward, y left, z up), m.
    pub origin: DVec3,
}

/// A name that is not a rig's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownRig(String);

impl fmt::Display for UnknownRig {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "no sensor rig is called `{}`; the available ones are {}",
            self.0,
            SensorRig::NAMES.join(", ")
        )
    }
}

impl std::error::Error for UnknownRig {}

/// Everything that one sensor fires at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Firing {
    /// Index of the mount.
    pub(crate) mount: usize,
    /// Time after the sweep's stamp, s.
    pub(crate) offset_s: f64,
    /// Azimuth of the column in the sensor's frame, rad.
    pub(crate) azimuth: f64,
}

/// Centre of the rear axle of an average car.
const REAR_AXLE: DVec3 = DVec3::new(-1.4, 0.0, 0.33);

/// Upright at (x, y, z), m.
fn upright(x: f64, y: f64, z: f64) -> Pose {
    Pose { rotation: DQuat::IDENTITY, translation: DVec3::new(x, y, z) }
}

impl SensorRig {
    /// The names that [`SensorRig::from_str`] accepts.
    pub const NAMES: [&str; 5] = ["hdl64", "hdl32x4", "hdl32x4-full", "vlp32x2", "beam128"];

    /// One sensor, upright, `height` above the ground (m) over the vehicle's centre; the vehicle
    /// frame is the sensor's.
    pub fn single(sensor: Sensor, height: f64) -> SensorRig {
        SensorRig {
            mounts: vec![Mount { sensor, vehicle_from_sensor: Pose::IDENTITY, phase_s: 0.0 }],
            origin: DVec3::new(0.0, 0.0, height),
        }
    }

    /// KITTI's rig: an HDL-64E 1.73 m above the ground, its frame the vehicle's. 131,072 rays a
    /// sweep.
    pub fn hdl64() -> SensorRig {
        SensorRig::single(Sensor::hdl64(), 1.73)
    }

    /// The same without noise and dropout, for comparison with closed forms.
    pub fn ideal() -> SensorRig {
        SensorRig::single(Sensor::ideal(), 1.73)
    }

    /// The dissertation's vehicle: four HDL-32E on the roof "spinning at roughly 10 Hz" (section
    /// 1.2), here at 9.90 to 10.06 Hz, unsynchronised. Their positions are not published; assumed
    /// here: two upright in front, two behind leaning outwards by 12 degrees, 1.9 m above the
    /// ground. The vehicle frame lies in the rear axle. At most 127,872 rays a sweep.
    pub fn hdl32x4() -> SensorRig {
        let places = [[1.5, 0.3, 0.0], [1.5, -0.3, 0.0], [0.9, 0.55, -12.0], [0.9, -0.55, 12.0]];
        let rates = [10.0, 10.06, 9.95, 9.9];
        let phases = [0.0, 0.031, 0.057, 0.083];
        let mount = |i: usize| {
            let [x, y, lean] = places[i];
            let roll = DQuat::from_rotation_x(f64::to_radians(lean));
            Mount {
                sensor: Sensor { period_s: 1.0 / rates[i], ..Sensor::hdl32() },
                vehicle_from_sensor: Pose::new(roll, DVec3::new(x, y, 1.57)),
                phase_s: phases[i],
            }
        };
        SensorRig { mounts: (0..4).map(mount).collect(), origin: REAR_AXLE }
    }

    /// The same four at the device's full rate, which is independent of the spin rate: 32 beams
    /// every 46.08 us are 694,444 rays a second each. 277,778 rays a sweep, of which those into the
    /// sky do not return: about 243,000 returns in a street.
    pub fn hdl32x4_full() -> SensorRig {
        let mut rig = SensorRig::hdl32x4();
        for Mount { sensor, .. } in &mut rig.mounts {
            sensor.columns = (sensor.period_s / HDL32_FIRING_S).round() as usize;
        }
        rig
    }

    /// Argoverse 2's rig: two VLP-32C stacked on the roof, 1.64 and 1.56 m above the rear axle,
    /// where the vehicle frame lies; the lower one is mounted upside down (poses as in the
    /// calibrations published with the logs, rounded) and fires half a revolution apart. 115,712
    /// rays a sweep.
    pub fn vlp32x2() -> SensorRig {
        let mount = |vehicle_from_sensor, phase_s| Mount {
            sensor: Sensor::vlp32c(),
            vehicle_from_sensor,
            phase_s,
        };
        let hanging = DQuat::from_rotation_x(std::f64::consts::PI);
        let mounts = vec![
            mount(upright(1.35, 0.0, 1.64), 0.0),
            mount(Pose::new(hanging, DVec3::new(1.355, 0.0, 1.565)), 0.05),
        ];
        SensorRig { mounts, origin: REAR_AXLE }
    }

    /// A single OS1-128 on the roof, 1.9 m above the ground; the vehicle frame lies in the rear
    /// axle. 131,072 rays a sweep.
    pub fn beam128() -> SensorRig {
        let vehicle_from_sensor = upright(1.2, 0.0, 1.57);
        let mount = Mount { sensor: Sensor::os1_128(), vehicle_from_sensor, phase_s: 0.0 };
        SensorRig { mounts: vec![mount], origin: REAR_AXLE }
    }

    /// The rig as a source declares it: every return has its own time, and sweeps are distorted.
    ///
    /// # Panics
    /// If there are more than [`SENSORS_MAX`] sensors.
    pub(crate) fn declared(&self) -> Rig {
        assert!(self.mounts.len() <= SENSORS_MAX, "a rig has at most {SENSORS_MAX} sensors");
        Rig {
            sensors: self.mounts.iter().map(|m| m.vehicle_from_sensor).collect(),
            timing: Timing::Offset { from_s: -0.5 * PERIOD_S, span_s: PERIOD_S },
            distorted: true,
            ground_m: -self.origin.z,
            own_vehicle: None,
        }
    }

    /// All firings of sweep `index`, by time and then by sensor. Every firing belongs to exactly
    /// one sweep.
    pub(crate) fn firings(&self, index: usize) -> Vec<Firing> {
        let mut all = Vec::new();
        for (number, mount) in self.mounts.iter().enumerate() {
            let Sensor { columns, period_s, .. } = mount.sensor;
            let first = mount.phase_s - 0.5 * period_s;
            let per_s = columns as f64 / period_s;
            // The first firing not before the boundary of two sweeps.
            let from = |sweeps: f64| ((sweeps / 10.0 - first) * per_s - 0.5).ceil() as i64;
            for k in from(index as f64 - 0.5)..from(index as f64 + 0.5) {
                let t = first + (k as f64 + 0.5) / per_s;
                all.push(Firing {
                    mount: number,
                    offset_s: t - stamp_s(index),
                    azimuth: mount.sensor.azimuth(k.rem_euclid(columns as i64) as usize),
                });
            }
        }
        all.sort_by(|a, b| a.offset_s.total_cmp(&b.offset_s).then(a.mount.cmp(&b.mount)));
        all
    }
}

impl FromStr for SensorRig {
    type Err = UnknownRig;

    fn from_str(name: &str) -> Result<SensorRig, UnknownRig> {
        match name {
            "hdl64" => Ok(SensorRig::hdl64()),
            "hdl32x4" => Ok(SensorRig::hdl32x4()),
            "hdl32x4-full" => Ok(SensorRig::hdl32x4_full()),
            "vlp32x2" => Ok(SensorRig::vlp32x2()),
            "beam128" => Ok(SensorRig::beam128()),
            _ => Err(UnknownRig(name.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_core::params::POINTS_MAX;

    #[test]
    fn names() {
        for name in SensorRig::NAMES {
            assert!(name.parse::<SensorRig>().is_ok(), "{name}");
        }
        let error = "hdl65".parse::<SensorRig>().unwrap_err().to_string();
        assert!(error.contains("hdl65") && error.contains("hdl32x4"), "{error}");
    }

    #[test]
    fn every_firing_belongs_to_one_sweep() {
        for name in SensorRig::NAMES {
            let rig: SensorRig = name.parse().unwrap();
            let mut before = vec![None; rig.mounts.len()];
            for index in 0..50 {
                let firings = rig.firings(index);
                let rays: usize =
                    firings.iter().map(|f| rig.mounts[f.mount].sensor.beams.len()).sum();
                let wanted = match name {
                    "hdl32x4-full" => 277_600..=277_900,
                    _ => 110_000..=POINTS_MAX,
                };
                assert!(wanted.contains(&rays), "{name}: {rays} rays");
                assert!(firings.windows(2).all(|f| f[0].offset_s <= f[1].offset_s));
                for f in firings {
                    assert!((-0.05 - 1e-12..0.05).contains(&f.offset_s), "{name}: {f:?}");
                    let Sensor { columns, period_s, .. } = rig.mounts[f.mount].sensor;
                    let t = stamp_s(index) + f.offset_s;
                    let step = period_s / columns as f64;
                    let gap = before[f.mount].map_or(step, |b: f64| t - b);
                    assert!((gap - step).abs() < 1e-9, "{name}: {gap} after the firing before");
                    before[f.mount] = Some(t);
                }
            }
        }
    }

    #[test]
    fn four_sensors_drift_apart() {
        let rig = SensorRig::hdl32x4();
        let looks = |index: usize, mount: usize| {
            let firings = rig.firings(index);
            firings.iter().find(|f| f.mount == mount).unwrap().azimuth
        };
        let [a, b] = [0, 40].map(|i| (looks(i, 1) - looks(i, 0)).rem_euclid(std::f64::consts::TAU));
        assert!((a - b).abs() > 0.5, "{a} {b}");
    }
}
