//! Packets of Ouster's OS0, OS1 and OS2, with the metadata that a sensor provides about itself.
//!
//! A packet is a head, some columns and a foot; a column is a head, one measurement per beam and a
//! foot (Ouster firmware user manual, "LIDAR data packet format"; metadata: "get_sensor_info" and
//! similar, in one file).

use std::f64::consts::TAU;
use std::ops::Range;
use std::path::Path;

use crc::{CRC_64_XZ, Crc};
use glam::{DMat3, DQuat, DVec3};
use raywake_core::pose::Pose;
use raywake_core::sweep::Point;
use serde_json::Value;

use super::firing::{Firing, REFLECTIVITY_MAX, TURN};
use crate::Error;
use crate::source::whole;

/// Accepted numbers of beams, columns of a revolution and columns of a packet.
const BEAMS: Range<usize> = 1..257;
const COLUMNS: Range<usize> = 1..8193;
const PACKET_COLUMNS: Range<usize> = 1..65;
/// Accepted revolutions per second.
const TURNS_HZ: Range<f64> = 1.0..100.0;
const M_OF_MM: f64 = 1e-3;
/// Bytes of the checksum at the end of a packet's foot, and the values there if it has none (in
/// captures of firmware 2.3).
const SUM: usize = 8;
const NO_SUM: [u64; 2] = [0, 0xdead_beef_0000_c0de];

static CHECK: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// How a profile lays out its packets: sizes and offsets in bytes.
struct Profile {
    name: &'static str,
    packet_head: usize,
    packet_foot: usize,
    column_head: usize,
    column_foot: usize,
    measurement: usize,
    /// Bits of a range, from the least significant on, and mm of its unit.
    range_bits: u32,
    range_mm: u32,
    /// Bytes of a range.
    range_size: usize,
    reflectivity_at: usize,
    /// Offset of the frame number in a packet's head, or in each column's if the packet has none.
    frame_at: usize,
}

/// Only the first return of each measurement is read if there are two.
static PROFILES: [Profile; 4] = [
    Profile {
        name: "LEGACY",
        packet_head: 0,
        packet_foot: 0,
        column_head: 16,
        column_foot: 4,
        measurement: 12,
        range_bits: 20,
        range_mm: 1,
        range_size: 4,
        reflectivity_at: 4,
        frame_at: 10,
    },
    Profile {
        name: "RNG19_RFL8_SIG16_NIR16",
        packet_head: 32,
        packet_foot: 32,
        column_head: 12,
        column_foot: 0,
        measurement: 12,
        range_bits: 19,
        range_mm: 1,
        range_size: 4,
        reflectivity_at: 4,
        frame_at: 2,
    },
    Profile {
        name: "RNG19_RFL8_SIG16_NIR16_DUAL",
        packet_head: 32,
        packet_foot: 32,
        column_head: 12,
        column_foot: 0,
        measurement: 16,
        range_bits: 19,
        range_mm: 1,
        range_size: 4,
        reflectivity_at: 3,
        frame_at: 2,
    },
    Profile {
        name: "RNG15_RFL8_NIR8",
        packet_head: 32,
        packet_foot: 32,
        column_head: 12,
        column_foot: 0,
        measurement: 4,
        range_bits: 15,
        range_mm: 8,
        range_size: 2,
        reflectivity_at: 2,
        frame_at: 2,
    },
];

/// A sensor.
pub(super) struct Ouster {
    name: String,
    profile: &'static Profile,
    /// Directions of a column's beams at the angle 0.
    beams: Vec<DVec3>,
    /// Columns of a revolution, and of a packet.
    pub columns: usize,
    pub packet_columns: usize,
    /// Time of a revolution, ns.
    pub period_ns: f64,
    /// Where beams leave the axis: outwards and up, m.
    origin_m: [f64; 2],
    /// From the frame of the beams to that of the sensor: x ahead, y to the left, z up.
    sensor_from_lidar: Pose,
}

impl Ouster {
    /// Reads a sensor from its metadata file. Fails unless it has a known profile.
    pub fn read(path: &Path) -> Result<Ouster, Error> {
        let wrong = |what: String| Error::input(path, "", what);
        let json =
            serde_json::from_str(&whole::read_settings(path)?).map_err(|e| wrong(e.to_string()))?;
        Ouster::of(&Metadata(&json)).map_err(wrong)
    }

    fn of(metadata: &Metadata) -> Result<Ouster, String> {
        let elevations = metadata.numbers("beam_altitude_angles")?;
        let azimuths = metadata.numbers("beam_azimuth_angles")?;
        if !BEAMS.contains(&elevations.len()) || azimuths.len() != elevations.len() {
            let (a, b) = (elevations.len(), azimuths.len());
            return Err(format!("{a} beam_altitude_angles and {b} beam_azimuth_angles"));
        }
        let beam = |(elevation, azimuth): (&f64, &f64)| {
            let (up, aside) = (elevation.to_radians(), -azimuth.to_radians());
            let along = libm::cos(up);
            DVec3::new(along * libm::cos(aside), along * libm::sin(aside), libm::sin(up))
        };
        let [columns, packet_columns] = metadata.columns()?;
        Ok(Ouster {
            name: metadata.text("prod_line").unwrap_or("Ouster").into(),
            profile: metadata.profile()?,
            beams: elevations.iter().zip(&azimuths).map(beam).collect(),
            columns,
            packet_columns,
            period_ns: metadata.period_ns(),
            origin_m: metadata.origin_m()?,
            sensor_from_lidar: metadata.sensor_from_lidar()?,
        })
    }

    /// Beams of a column.
    pub fn beams(&self) -> usize {
        self.beams.len()
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether a packet may be one of its own, by its length.
    pub fn recognises(&self, packet: &[u8]) -> bool {
        let Profile { packet_head, packet_foot, .. } = self.profile;
        packet.len() == packet_head + self.packet_columns * self.column() + packet_foot
    }

    /// Whether the checksum of a packet is right, if it has one.
    pub fn has_valid_checksum(&self, packet: &[u8]) -> bool {
        let Some((content, sum)) = packet.split_last_chunk::<SUM>() else { return false };
        let sum = u64::from_le_bytes(*sum);
        self.profile.packet_foot == 0 || NO_SUM.contains(&sum) || CHECK.checksum(content) == sum
    }

    /// Time and angle of a column; `None` if it was not measured.
    pub fn firing(&self, packet: &[u8], column: usize) -> Option<Firing> {
        let (start, end) = self.place(column);
        let head = packet.get(start..end)?;
        let number = u64::from(short(head, 8));
        let valid = match self.profile.column_foot {
            0 => head[10] & 1 == 1,
            foot => head[head.len() - foot..].iter().all(|byte| *byte == u8::MAX),
        };
        let frame_of = if self.profile.packet_head == 0 { head } else { packet };
        let frame = Some(short(frame_of, self.profile.frame_at));
        let clock_ns = u64::from_le_bytes(*head.first_chunk()?);
        let angle = (number * TURN / self.columns as u64) as u16;
        let valid = valid && number < self.columns as u64;
        valid.then_some(Firing { clock_ns, angle, frame })
    }

    /// Adds the returns of a column, in the sensor's frame.
    pub fn returns(&self, packet: &[u8], column: usize, offset_ns: i64, into: &mut Vec<Point>) {
        let (start, _) = self.place(column);
        let number = short(&packet[start..], 8);
        let turned = DQuat::from_rotation_z(TAU * (1.0 - f64::from(number) / self.columns as f64));
        let turned = self.sensor_from_lidar.rotation * turned;
        let [outwards_m, up_m] = self.origin_m;
        let origin =
            turned * DVec3::new(outwards_m, 0.0, up_m) + self.sensor_from_lidar.translation;
        let turned = DMat3::from_quat(turned);
        let away_m = libm::hypot(outwards_m, up_m);
        let offset_s = (offset_ns as f64 * 1e-9) as f32;
        for (n, beam) in self.beams.iter().enumerate() {
            let (range_mm, reflectivity) = self.measurement(packet, start, n);
            if range_mm == 0 {
                continue;
            }
            let range_m = f64::from(range_mm) * M_OF_MM - away_m;
            let place = origin + turned * (range_m * *beam);
            let intensity = (f32::from(reflectivity) / REFLECTIVITY_MAX).min(1.0);
            into.push(Point {
                position: place.as_vec3().to_array(),
                intensity,
                offset_s,
                sensor: 0,
            });
        }
    }

    /// Range, mm, and reflectivity of a beam in the column that begins at a byte.
    pub fn measurement(&self, packet: &[u8], column: usize, beam: usize) -> (u32, u8) {
        let Profile { range_size, range_bits, range_mm, reflectivity_at, .. } = *self.profile;
        let at = column + self.profile.column_head + beam * self.profile.measurement;
        let mut range = [0; 4];
        range[..range_size].copy_from_slice(&packet[at..at + range_size]);
        let range = u32::from_le_bytes(range) & ((1 << range_bits) - 1);
        (range * range_mm, packet[at + reflectivity_at])
    }

    /// Bytes of a column.
    fn column(&self) -> usize {
        let Profile { column_head, measurement, column_foot, .. } = self.profile;
        column_head + self.beams.len() * measurement + column_foot
    }

    /// First byte of a column, and the one after its last.
    pub fn place(&self, column: usize) -> (usize, usize) {
        let start = self.profile.packet_head + column * self.column();
        (start, start + self.column())
    }
}

fn short(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// A sensor's metadata: one list of entries, or groups of them since firmware 3.
struct Metadata<'a>(&'a Value);

impl Metadata<'_> {
    fn find(&self, key: &str) -> Option<&Value> {
        let own = self.0.get(key);
        own.or_else(|| self.0.as_object()?.values().find_map(|group| group.get(key)))
    }

    fn text(&self, key: &str) -> Result<&str, String> {
        let found = self.find(key).and_then(Value::as_str);
        found.ok_or_else(|| format!("no `{key}`: not the metadata of an Ouster sensor"))
    }

    fn count(&self, key: &str) -> Result<Option<usize>, String> {
        let Some(value) = self.find(key) else { return Ok(None) };
        let count = value.as_u64().and_then(|n| usize::try_from(n).ok());
        count.map(Some).ok_or_else(|| format!("`{key}` is not a count"))
    }

    fn numbers(&self, key: &str) -> Result<Vec<f64>, String> {
        let list = self.find(key).and_then(Value::as_array);
        let numbers = list.and_then(|l| l.iter().map(Value::as_f64).collect::<Option<Vec<_>>>());
        let numbers = numbers.filter(|all| all.iter().all(|n| n.is_finite()));
        numbers
            .ok_or_else(|| format!("no numbers in `{key}`: not the metadata of an Ouster sensor"))
    }

    /// Columns of a revolution, and of a packet.
    fn columns(&self) -> Result<[usize; 2], String> {
        let mode = self.text("lidar_mode")?.split('x').next().and_then(|n| n.parse().ok());
        let of_turn = self.count("columns_per_frame")?.or(mode).unwrap_or(0);
        let of_packet = self.count("columns_per_packet")?.unwrap_or(16);
        if !COLUMNS.contains(&of_turn) || !PACKET_COLUMNS.contains(&of_packet) {
            return Err(format!("{of_turn} columns per revolution, {of_packet} per packet"));
        }
        Ok([of_turn, of_packet])
    }

    /// Time of a revolution by the mode, `COLUMNSxHZ`, ns: ten revolutions a second unless it says
    /// otherwise.
    fn period_ns(&self) -> f64 {
        let mode = self.text("lidar_mode").ok().and_then(|mode| mode.split('x').nth(1));
        let hz = mode.and_then(|hz| hz.parse().ok()).filter(|hz| TURNS_HZ.contains(hz));
        1e9 / hz.unwrap_or(10.0)
    }

    fn profile(&self) -> Result<&'static Profile, String> {
        let named = self.text("udp_profile_lidar").unwrap_or("LEGACY");
        PROFILES.iter().find(|p| p.name == named).ok_or_else(|| {
            let known: Vec<_> = PROFILES.iter().map(|p| p.name).collect();
            format!("unknown packet profile `{named}`; known: {}", known.join(", "))
        })
    }

    /// Where beams leave the axis: outwards and up, m.
    fn origin_m(&self) -> Result<[f64; 2], String> {
        if self.find("beam_to_lidar_transform").is_some() {
            let matrix = self.numbers("beam_to_lidar_transform")?;
            return match matrix[..] {
                [_, _, _, x, _, _, _, _, _, _, _, z, ..] => Ok([x, z].map(|mm| mm * M_OF_MM)),
                _ => Err("`beam_to_lidar_transform` is not a 4x4 matrix".into()),
            };
        }
        let outwards = self.find("lidar_origin_to_beam_origin_mm").and_then(Value::as_f64);
        Ok([outwards.unwrap_or(0.0) * M_OF_MM, 0.0])
    }

    fn sensor_from_lidar(&self) -> Result<Pose, String> {
        let m = self.numbers("lidar_to_sensor_transform")?;
        let rigid = "`lidar_to_sensor_transform` is not a rigid transform";
        let [a, b, c, x, d, e, f, y, g, h, i, z, ..] = m[..] else { return Err(rigid.into()) };
        let rows = [a, b, c, x, d, e, f, y, g, h, i, z];
        let pose = Pose::from_rows(&rows).map_err(|_| rigid)?;
        Ok(Pose { translation: pose.translation * M_OF_MM, ..pose })
    }
}
