//! Packets of Velodyne's VLP-16 (Puck), Puck Hi-Res, VLP-32C and HDL-32E.
//!
//! A packet has 1206 bytes: twelve blocks of a flag, an azimuth and 32 measurements of a distance
//! and a reflectivity, then the time in µs since the full hour, the return mode and the model
//! (VLP-16 user manual 63-9243, section 9; VLP-32C 63-9325; HDL-32E 63-9113). Azimuths are
//! clockwise seen from above, starting straight ahead.

use std::f64::consts::TAU;

use raywake_core::sweep::Point;

use super::firing::{Firing, REFLECTIVITY_MAX, TURN};

/// Bytes of a packet.
pub(super) const PACKET: usize = 1206;
/// Blocks of a packet.
pub(super) const BLOCKS: usize = 12;
const BLOCK: usize = 100;
/// Measurements of a block, the bytes before them and the bytes of each.
pub(super) const MEASUREMENTS: usize = 32;
const BLOCK_HEAD: usize = 4;
const MEASUREMENT: usize = 3;
/// First bytes of a block, and of a block of an HDL-64E's lower lasers.
const FLAG: [u8; 2] = [0xff, 0xee];
const LOWER: [u8; 2] = [0xff, 0xdd];
/// Offset of the return mode, and its value if blocks come in pairs: the last returns, then the
/// strongest.
const RETURNS_AT: usize = 1204;
const DUAL: u8 = 0x39;
const MODEL_AT: usize = 1205;
const TIME_AT: usize = 1200;
/// Azimuths of a revolution, in 0.01°.
pub(super) const AZIMUTHS: u32 = 36_000;
const NS_OF_US: u64 = 1000;
/// Its clock wraps at this, ns: an hour.
pub(super) const CLOCK_NS: u64 = 3_600_000_000_000;

/// Model numbers in packets.
pub(super) const VLP_16: u8 = 0x22;
pub(super) const PUCK_HI_RES: u8 = 0x24;
pub(super) const HDL_32E: u8 = 0x21;
pub(super) const VLP_32C: u8 = 0x28;
/// Longest revolution, ns: five a second.
pub(super) const PERIOD_MAX_NS: f64 = 2e8;

/// The fixed properties of a model.
struct Model {
    /// Its number in packets.
    code: u8,
    name: &'static str,
    /// Elevation of every laser, and how far its azimuth is beyond the block's, degrees.
    lasers: &'static [[f64; 2]],
    /// Unit of distances, m.
    unit_m: f64,
    /// Distance from the axis to the point through which all beams pass, m: a beam that points down
    /// leaves the axis higher by this times the tangent.
    focus_m: f64,
    /// Time between firings of all lasers, and between two lasers or pairs of them, ns.
    cycle_ns: f64,
    laser_ns: f64,
    /// Lasers that fire at once.
    together: usize,
}

/// Angles from the manuals, focus distances from the envelope drawings (86-0101, 86-0129, 86-0106
/// and that of the VLP-32C).
static MODELS: [Model; 4] = [
    Model {
        code: VLP_16,
        name: "VLP-16",
        lasers: &straight([
            -15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0,
            15.0,
        ]),
        unit_m: 0.002,
        focus_m: 0.04191,
        cycle_ns: 55_296.0,
        laser_ns: 2304.0,
        together: 1,
    },
    Model {
        code: PUCK_HI_RES,
        name: "Puck Hi-Res",
        lasers: &straight([
            -10.0, 0.667, -8.667, 2.0, -7.333, 3.333, -6.0, 4.667, -4.667, 6.0, -3.333, 7.333,
            -2.0, 8.667, -0.667, 10.0,
        ]),
        unit_m: 0.002,
        focus_m: 0.04191,
        cycle_ns: 55_296.0,
        laser_ns: 2304.0,
        together: 1,
    },
    Model {
        code: HDL_32E,
        name: "HDL-32E",
        lasers: &straight([
            -30.67, -9.33, -29.33, -8.0, -28.0, -6.67, -26.67, -5.33, -25.33, -4.0, -24.0, -2.67,
            -22.67, -1.33, -21.33, 0.0, -20.0, 1.33, -18.67, 2.67, -17.33, 4.0, -16.0, 5.33,
            -14.67, 6.67, -13.33, 8.0, -12.0, 9.33, -10.67, 10.67,
        ]),
        unit_m: 0.002,
        focus_m: 0.02883,
        cycle_ns: 46_080.0,
        laser_ns: 1152.0,
        together: 1,
    },
    Model {
        code: VLP_32C,
        name: "VLP-32C",
        lasers: &[
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
        ],
        unit_m: 0.004,
        focus_m: 0.0424,
        cycle_ns: 55_296.0,
        laser_ns: 2304.0,
        together: 2,
    },
];

/// Lasers one above another.
const fn straight<const N: usize>(elevations: [f64; N]) -> [[f64; 2]; N] {
    let mut lasers = [[0.0; 2]; N];
    let mut n = 0;
    while n < N {
        lasers[n][0] = elevations[n];
        n += 1;
    }
    lasers
}

/// A laser of a sensor.
struct Laser {
    /// Cosine and sine of its elevation.
    elevation: [f64; 2],
    /// Its azimuth relative to the block's, rad.
    azimuth: f64,
    /// Where its beam leaves the axis, m.
    height_m: f64,
}

impl Laser {
    /// Position of a return at a range, m, and an azimuth of the block, rad.
    fn place(&self, range_m: f64, azimuth: f64) -> [f32; 3] {
        let (angle, [cos, sin]) = (azimuth + self.azimuth, self.elevation);
        let along = range_m * cos;
        let place = [along * libm::cos(angle), -along * libm::sin(angle), range_m * sin];
        [place[0], place[1], place[2] + self.height_m].map(|v| v as f32)
    }
}

/// A sensor.
pub(super) struct Velodyne {
    model: &'static Model,
    lasers: Vec<Laser>,
}

impl Velodyne {
    /// The sensor that sent a packet; `None` if its model is unknown.
    pub fn of(packet: &[u8]) -> Option<Velodyne> {
        let code = *packet.get(MODEL_AT)?;
        Velodyne::coded(code).filter(|sensor| sensor.recognises(packet))
    }

    /// The sensor whose packets have this number; `None` if no model has it.
    pub fn coded(code: u8) -> Option<Velodyne> {
        let model = MODELS.iter().find(|model| model.code == code)?;
        let laser = |[elevation, azimuth]: &[f64; 2]| {
            let angle = elevation.to_radians();
            Laser {
                elevation: [libm::cos(angle), libm::sin(angle)],
                azimuth: azimuth.to_radians(),
                height_m: -model.focus_m * libm::tan(angle),
            }
        };
        Some(Velodyne { model, lasers: model.lasers.iter().map(laser).collect() })
    }

    /// Maximum number of returns in a revolution: at the slowest speed.
    pub fn returns_max(&self) -> usize {
        let cycles = (PERIOD_MAX_NS / self.model.cycle_ns) as usize;
        cycles * self.lasers.len() + BLOCKS * MEASUREMENTS
    }

    /// Time from the first firing of a packet to that of the next, ns.
    pub fn packet_ns(&self, packet: &[u8]) -> f64 {
        let blocks = if is_dual(packet) { BLOCKS / 2 } else { BLOCKS };
        (blocks * MEASUREMENTS / self.lasers.len()) as f64 * self.model.cycle_ns
    }

    pub fn name(&self) -> &'static str {
        self.model.name
    }

    /// Elevation and azimuth of its lasers, degrees.
    #[cfg(test)]
    pub fn angles(&self) -> &'static [[f64; 2]] {
        self.model.lasers
    }

    /// Whether a packet is of this model.
    pub fn recognises(&self, packet: &[u8]) -> bool {
        has_model_code(packet, self.model.code)
    }

    /// Time and azimuth of a block. `None` if the block is damaged, or the first of a pair.
    pub fn firing(&self, packet: &[u8], block: usize) -> Option<Firing> {
        let azimuth = azimuth(packet, block).filter(|_| !is_dual(packet) || block % 2 == 1)?;
        let clock_ns = clock_ns(packet)? + self.block_ns(packet, block) as u64;
        Some(Firing { clock_ns: clock_ns % CLOCK_NS, angle: angle(azimuth), frame: None })
    }

    /// Adds the returns of a block, in the sensor's frame: x ahead, y to the left, z up.
    pub fn returns(&self, packet: &[u8], block: usize, offset_ns: i64, into: &mut Vec<Point>) {
        let Some(block) = LaserBlock::of(packet, block).filter(|b| !b.is_lower) else { return };
        let per_ns = turning(packet, self.block_ns(packet, BLOCKS - 1));
        for (n, (distance, reflectivity)) in block.measurements() {
            let lasers = self.lasers.len();
            let laser = &self.lasers[n % lasers];
            let order = (n % lasers / self.model.together) as f64;
            let later_ns = (n / lasers) as f64 * self.model.cycle_ns + order * self.model.laser_ns;
            let azimuths = f64::from(block.azimuth) + per_ns * later_ns;
            let range_m = f64::from(distance) * self.model.unit_m;
            into.push(Point {
                position: laser.place(range_m, azimuths / f64::from(AZIMUTHS) * TAU),
                intensity: f32::from(reflectivity) / REFLECTIVITY_MAX,
                offset_s: ((offset_ns as f64 + later_ns) * 1e-9) as f32,
                sensor: 0,
            });
        }
    }

    /// Time from the packet's first firing to a block's, ns.
    fn block_ns(&self, packet: &[u8], block: usize) -> f64 {
        let cycles = MEASUREMENTS / self.lasers.len();
        let before = if is_dual(packet) { block / 2 } else { block };
        (before * cycles) as f64 * self.model.cycle_ns
    }
}

fn has_model_code(packet: &[u8], code: u8) -> bool {
    let whole = packet.len() == PACKET && packet.starts_with(&FLAG);
    // In packets of an HDL-64E this byte is something else.
    whole && packet[MODEL_AT] == code && !packet[BLOCK..].starts_with(&LOWER)
}

fn is_dual(packet: &[u8]) -> bool {
    packet[RETURNS_AT] == DUAL
}

/// The azimuth of a block, unless it is damaged or of lower lasers.
fn azimuth(packet: &[u8], block: usize) -> Option<u32> {
    let block = LaserBlock::of(packet, block)?;
    (!block.is_lower).then_some(block.azimuth)
}

/// A block of a packet.
pub(super) struct LaserBlock<'a> {
    pub azimuth: u32,
    /// Whether it is of the lower lasers of an HDL-64E.
    pub is_lower: bool,
    bytes: &'a [u8],
}

impl LaserBlock<'_> {
    /// Reads a block; `None` if there is none, or it is damaged.
    pub fn of(packet: &[u8], block: usize) -> Option<LaserBlock<'_>> {
        let bytes = packet.get(block * BLOCK..)?.get(..BLOCK)?;
        let azimuth = u32::from(u16::from_le_bytes([bytes[2], bytes[3]]));
        let is_lower = bytes.starts_with(&LOWER);
        let sound = (is_lower || bytes.starts_with(&FLAG)) && azimuth < AZIMUTHS;
        sound.then_some(LaserBlock { azimuth, is_lower, bytes })
    }

    /// Distances and reflectivities of its returns, each with its index in the block.
    pub fn measurements(&self) -> impl Iterator<Item = (usize, (u16, u8))> {
        let each = self.bytes[BLOCK_HEAD..].chunks_exact(MEASUREMENT);
        let each = each.map(|m| (u16::from_le_bytes([m[0], m[1]]), m[2]));
        each.enumerate().filter(|(_, (distance, _))| *distance > 0)
    }
}

/// Time of a packet's first firing by the sensor's clock, ns.
pub(super) fn clock_ns(packet: &[u8]) -> Option<u64> {
    let us = packet.get(TIME_AT..TIME_AT + 4)?.try_into().ok()?;
    Some(u64::from(u32::from_le_bytes(us)) * NS_OF_US)
}

/// An azimuth counted from the rear, where a revolution begins, so that the area ahead is seen in
/// one go.
pub(super) fn angle(azimuth: u32) -> u16 {
    let turned = (u64::from(azimuth + AZIMUTHS / 2) % u64::from(AZIMUTHS)) * TURN;
    (turned / u64::from(AZIMUTHS)) as u16
}

/// How fast it rotates within a packet, azimuths per ns; `span_ns` is the time from the first block
/// to the last.
fn turning(packet: &[u8], span_ns: f64) -> f64 {
    let (Some(first), Some(last)) = (azimuth(packet, 0), azimuth(packet, BLOCKS - 1)) else {
        return 0.0;
    };
    f64::from((last + AZIMUTHS - first) % AZIMUTHS) / span_ns
}
