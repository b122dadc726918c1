//! Files next to the clouds of a drive in KITTI's raw layout, for clouds whose azimuths do not give
//! the time and sensor of a return: from several scanners, or one whose lasers do not fire column
//! by column.
//!
//! | in `velodyne_points` | content |
//! |---|---|
//! | `sensors.txt` | the lines below |
//! | `offset_s/N.bin` | little-endian float32 per return of `data/N.bin`: s after the stamp |
//! | `sensor/N.bin` | one byte per return: its sensor, counted from 0 |
//!
//! `span: FROM DURATION` is the earliest offset and the duration of a sweep, s; `ground: Z` the
//! height of the ground in the vehicle frame, m; then for each sensor one line `sensor:` with its
//! 3x4 row-major `vehicle_from_sensor`. A drive has all three or none.

use std::path::{Path, PathBuf};

use raywake_core::params::SENSORS_MAX;
use raywake_core::pose::Pose;
use raywake_core::sweep::{Point, Rig, Timing};

use super::poses::pose_from;
use super::{text, whole};
use crate::Error;

/// Longest accepted sweep, s.
pub(super) const SPAN_MAX_S: f64 = 1.0;

/// How far a return's time may lie outside the declared span, s: only rounding.
const SLACK_S: f32 = 1e-4;

/// The sidecars of a drive.
pub(super) struct Sidecars {
    /// `velodyne_points`.
    folder: PathBuf,
    /// Sensors, time span and ground, from `sensors.txt`.
    pub rig: Rig,
    /// Earliest and latest offset, s.
    limits_s: [f32; 2],
}

impl Sidecars {
    /// Opens those of the clouds in `velodyne_points`; `None` if there are no such files.
    ///
    /// Fails if one of the three is missing, and if `sensors.txt` is damaged.
    pub fn open(velodyne_points: &Path) -> Result<Option<Sidecars>, Error> {
        let path = velodyne_points.join("sensors.txt");
        let found = ["offset_s", "sensor"].map(|name| velodyne_points.join(name).is_dir());
        match (path.is_file(), found) {
            (false, [false, false]) => return Ok(None),
            (true, [true, true]) => {}
            _ => {
                let what = "`sensors.txt`, `offset_s` and `sensor` belong together; one is missing";
                return Err(Error::input(velodyne_points, "", what));
            }
        }
        let (rig, [from_s, span_s]) = read_rig(&path)?;
        let limits_s = [from_s as f32 - SLACK_S, (from_s + span_s) as f32 + SLACK_S];
        Ok(Some(Sidecars { folder: velodyne_points.to_path_buf(), rig, limits_s }))
    }

    /// Fills in the times and sensors of the returns of a cloud.
    ///
    /// Fails if a file is missing, does not have one value per return, or has an impossible one.
    pub fn fill(&self, cloud: &Path, points: &mut [Point]) -> Result<(), Error> {
        let (path, bytes) = self.read("offset_s", cloud, points.len(), 4)?;
        let (offsets, _) = bytes.as_chunks::<4>();
        for (n, (point, bytes)) in points.iter_mut().zip(offsets).enumerate() {
            let offset_s = f32::from_le_bytes(*bytes);
            // Written this way because NaN is in no range.
            if !(self.limits_s[0]..=self.limits_s[1]).contains(&offset_s) {
                let what = format!("{offset_s} s is outside the span of a sweep in sensors.txt");
                return Err(Error::input(&path, format!("return {n}"), what));
            }
            point.offset_s = offset_s;
        }
        let (path, sensors) = self.read("sensor", cloud, points.len(), 1)?;
        for (n, (point, &sensor)) in points.iter_mut().zip(&sensors).enumerate() {
            if usize::from(sensor) >= self.rig.sensors.len() {
                let what = format!("sensor {sensor} of {}, counted from 0", self.rig.sensors.len());
                return Err(Error::input(&path, format!("return {n}"), what));
            }
            point.sensor = sensor.into();
        }
        Ok(())
    }

    /// A sidecar's path and contents, `width` bytes for each of `returns`.
    fn read(
        &self,
        name: &str,
        cloud: &Path,
        returns: usize,
        width: usize,
    ) -> Result<(PathBuf, Vec<u8>), Error> {
        let path = self.folder.join(name).join(cloud.file_name().unwrap_or_default());
        let bytes = whole::read(&path)?;
        if bytes.len() != returns * width {
            let (size, wanted) = (bytes.len(), returns * width);
            let what = format!("{size} bytes, {wanted} expected for {returns} returns");
            return Err(Error::input(&path, "", what));
        }
        Ok((path, bytes))
    }
}

/// The rig of a `sensors.txt`, and the earliest offset and the duration of its sweeps, s.
fn read_rig(path: &Path) -> Result<(Rig, [f64; 2]), Error> {
    let text = whole::read_text(path)?;
    let (span, ground) = (text::keyed(path, &text, "span")?, text::keyed(path, &text, "ground")?);
    let (Some((span_line, [from_s, span_s])), Some((ground_line, [ground_m]))) = (span, ground)
    else {
        return Err(Error::input(path, "", "lines `span:` and `ground:` expected"));
    };
    if !(from_s.abs() <= SPAN_MAX_S && span_s > 0.0 && span_s <= SPAN_MAX_S) {
        let what = format!("a sweep from {from_s} s lasting {span_s} s; at most {SPAN_MAX_S} s");
        return Err(Error::input(path, format!("line {span_line}"), what));
    }
    if !ground_m.is_finite() {
        return Err(Error::input(path, format!("line {ground_line}"), "the height is not finite"));
    }
    let rig = Rig {
        sensors: read_sensors(path, &text)?.into_iter().collect(),
        timing: Timing::Offset { from_s, span_s },
        distorted: true,
        ground_m,
        own_vehicle: None,
    };
    Ok((rig, [from_s, span_s]))
}

/// `vehicle_from_sensor` of every line `sensor:`, 1 to [`SENSORS_MAX`] of them.
fn read_sensors(path: &Path, text: &str) -> Result<Vec<Pose>, Error> {
    let mut sensors = Vec::new();
    for (line, content) in text::lines(text) {
        let Some(rest) = content.strip_prefix("sensor:") else { continue };
        let place = format!("line {line}");
        if sensors.len() == SENSORS_MAX {
            return Err(Error::input(path, place, format!("more than {SENSORS_MAX} sensors")));
        }
        sensors.push(pose_from(&text::exactly(path, line, rest)?, path, place)?);
    }
    if sensors.is_empty() {
        return Err(Error::input(path, "", "no line `sensor:`"));
    }
    Ok(sensors)
}
