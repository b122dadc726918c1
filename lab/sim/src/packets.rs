//! A simulated Ouster's packets, as in a capture of network traffic: input for packet readers.
//!
//! Profile `RNG19_RFL8_SIG16_NIR16` (Ouster firmware user manual, "LIDAR data packet format"),
//! without checksums; ranges in whole millimetres.

use std::f64::consts::{PI, TAU};
use std::io::{self, Write};

use raywake_core::sweep::Point;

use crate::{Sensor, SimSweep};

/// Columns of a packet.
const PACKET_COLUMNS: usize = 16;
/// Bytes of a packet's header (and of its footer), of a column's header and of a measurement.
const HEAD: usize = 32;
const COLUMN_HEAD: usize = 12;
const MEASUREMENT: usize = 12;
/// Time of the first revolution's first column, ns since 1970.
const START_NS: u64 = 1_700_000_000_000_000_000;
/// Ranges have 19 bits.
const RANGE_MAX_MM: f64 = 524_287.0;
/// The port it sends to, and its address.
const PORT: u16 = 7502;
const ADDRESS: [u8; 4] = [192, 168, 1, 11];

/// The packets of a sensor whose beams originate at its origin and whose frame is the vehicle's.
pub struct OusterPackets {
    sensor: Sensor,
}

impl OusterPackets {
    /// Creates them for a sensor with a multiple of 16 columns.
    pub fn of(sensor: &Sensor) -> OusterPackets {
        OusterPackets { sensor: sensor.clone() }
    }

    /// Time of a column after the revolution's first one, ns.
    fn column_ns(&self, column: usize) -> u64 {
        (self.sensor.period_s * 1e9 * column as f64 / self.sensor.columns as f64) as u64
    }

    /// The sensor's metadata.
    pub fn metadata(&self) -> String {
        let Sensor { beams, columns, period_s, .. } = &self.sensor;
        // A column's azimuth is that of its centre.
        let half = 180.0 / *columns as f64;
        let list = |numbers: Vec<f64>| format!("{numbers:?}");
        let elevations = list(beams.iter().map(|b| b.elevation.to_degrees()).collect());
        let azimuths = list(beams.iter().map(|b| half - b.azimuth.to_degrees()).collect());
        let hz = (1.0 / period_s).round();
        format!(
            "{{\"prod_line\": \"simulated OS1-128\", \"lidar_mode\": \"{columns}x{hz}\",\n\
             \"udp_profile_lidar\": \"RNG19_RFL8_SIG16_NIR16\",\n\
             \"columns_per_frame\": {columns}, \"columns_per_packet\": {PACKET_COLUMNS},\n\
             \"beam_altitude_angles\": {elevations},\n\"beam_azimuth_angles\": {azimuths},\n\
             \"lidar_to_sensor_transform\": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}\n"
        )
    }

    /// The packets of a revolution, each with its time, ns. `returns` are those of a sweep of this
    /// sensor alone, in its frame, each measured at its own time.
    fn turn(&self, number: usize, returns: &[Point]) -> Vec<(u64, Vec<u8>)> {
        let columns = self.sensor.columns;
        let begins_ns = START_NS + number as u64 * self.column_ns(columns);
        let column_size = COLUMN_HEAD + self.sensor.beams.len() * MEASUREMENT;
        let packet = |n: usize| {
            let mut bytes = vec![0; 2 * HEAD + PACKET_COLUMNS * column_size];
            bytes[0] = 1;
            bytes[2..4].copy_from_slice(&(number as u16).to_le_bytes());
            for k in 0..PACKET_COLUMNS {
                let (column, at) = (n * PACKET_COLUMNS + k, HEAD + k * column_size);
                let time_ns = begins_ns + self.column_ns(column);
                bytes[at..at + 8].copy_from_slice(&time_ns.to_le_bytes());
                bytes[at + 8..at + 10].copy_from_slice(&(column as u16).to_le_bytes());
                bytes[at + 10] = 1;
            }
            (begins_ns + self.column_ns((n + 1) * PACKET_COLUMNS - 1), bytes)
        };
        let mut packets: Vec<_> = (0..columns / PACKET_COLUMNS).map(packet).collect();
        for point in returns {
            let [x, y, z] = point.position.map(f64::from);
            let (along, range_mm) = (x.hypot(y), (x.hypot(y).hypot(z) * 1e3).round());
            let beam = self.beam(z.atan2(along));
            let ahead = PI - y.atan2(x) + self.sensor.beams[beam].azimuth;
            let column = (ahead / TAU * columns as f64 - 0.5).round() as i64;
            let column = column.rem_euclid(columns as i64) as usize;
            if range_mm > RANGE_MAX_MM {
                continue;
            }
            let (_, bytes) = &mut packets[column / PACKET_COLUMNS];
            let at = HEAD + column % PACKET_COLUMNS * column_size + COLUMN_HEAD;
            let at = at + beam * MEASUREMENT;
            bytes[at..at + 4].copy_from_slice(&(range_mm as u32).to_le_bytes());
            bytes[at + 4] = (point.intensity * 255.0) as u8;
        }
        packets
    }

    /// Writes a capture of revolutions, one per sweep. It begins within the first one, like a
    /// capture of a running sensor.
    pub fn capture(
        &self,
        out: &mut impl Write,
        sweeps: impl Iterator<Item = SimSweep>,
    ) -> io::Result<()> {
        head(out)?;
        for (number, sweep) in sweeps.enumerate() {
            let turn = self.turn(number, &sweep.points);
            let from = if number == 0 { turn.len() / 2 } else { 0 };
            turn[from..].iter().try_for_each(|(ns, packet)| datagram(out, *ns, packet))?;
        }
        Ok(())
    }

    /// The beam nearest to an elevation, rad.
    fn beam(&self, elevation: f64) -> usize {
        let off = |n: &usize| (self.sensor.beams[*n].elevation - elevation).abs();
        let beams = 0..self.sensor.beams.len();
        beams.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }
}

/// Writes the header of a capture (libpcap, times in ns, frames of IPv4).
fn head(out: &mut impl Write) -> io::Result<()> {
    let head: [u32; 6] = [0xa1b2_3c4d, 0x0004_0002, 0, 0, 1 << 17, 101];
    head.iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))
}

/// Appends a datagram of the sensor.
fn datagram(out: &mut impl Write, time_ns: u64, payload: &[u8]) -> io::Result<()> {
    let (udp, all) = (8 + payload.len() as u16, 28 + payload.len() as u32);
    let time = [(time_ns / 1_000_000_000) as u32, (time_ns % 1_000_000_000) as u32];
    let head = [time[0], time[1], all, all];
    head.iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))?;
    // IPv4 without options, UDP; no checksums.
    out.write_all(&[0x45, 0])?;
    out.write_all(&(all as u16).to_be_bytes())?;
    out.write_all(&[0, 0, 0, 0, 64, 17, 0, 0])?;
    out.write_all(&ADDRESS)?;
    out.write_all(&[192, 168, 1, 1])?;
    [PORT, PORT, udp, 0].iter().try_for_each(|word| out.write_all(&word.to_be_bytes()))?;
    out.write_all(payload)
}
