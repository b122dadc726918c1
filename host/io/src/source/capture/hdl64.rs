//! Packets of Velodyne's HDL-64E, S2 and S3.
//!
//! They are laid out like those of Velodyne's other sensors, but a firing is two blocks: one of the
//! 32 upper lasers (flag `ff ee`) and one of the lower (`ff dd`); if a sensor reports two returns
//! of each beam, two more of the same azimuth follow. The directions of the lasers and the
//! corrections of their distances are measured for each sensor and come with it, as `db.xml`
//! (HDL-64E S2 manual, 63-HDL64ES2, appendix F, whose formulas are used here).

use std::f64::consts::TAU;
use std::path::Path;
use std::str::FromStr;

use raywake_core::sweep::Point;
use roxmltree::{Document, Node};

use super::firing::{Firing, REFLECTIVITY_MAX};
use super::velodyne::{self, BLOCKS, LaserBlock, MEASUREMENTS, PERIOD_MAX_NS};
use crate::Error;
use crate::source::boost;

/// Lasers of a sensor, half of them in each block.
pub(super) const LASERS: usize = 2 * MEASUREMENTS;
/// Firings of a packet, two blocks each.
pub(super) const FIRINGS: usize = BLOCKS / 2;
/// Time from one firing to the next, ns: 1.33 million returns a second.
const FIRING_NS: u64 = 48_000;
/// Metres per unit of length of the file.
const METRES: f64 = 0.01;
/// Distances along x and y at which the near correction was measured, m; the far one, at 25.04 m.
const NEAR_M: [f64; 2] = [2.40, 1.93];
const FAR_M: f64 = 25.04;
/// Unit of distances, m, and its accepted range.
const UNIT_M: f64 = 0.002;
const UNITS_M: std::ops::RangeInclusive<f64> = 0.0005..=0.02;
/// Largest accepted correction, m.
const CORRECTION_MAX_M: f64 = 10.0;

/// The calibration of a laser.
#[derive(Clone, Copy, Default)]
struct CalibratedLaser {
    /// How far its azimuth is beyond the block's, rad, counter-clockwise.
    azimuth: f64,
    /// Cosine and sine of its elevation.
    elevation: [f64; 2],
    /// Correction of far distances, m.
    far_m: f64,
    /// Corrections of near distances along x and y, m.
    near_m: [f64; 2],
    /// Its position above the axis and beside it, m.
    offset_m: [f64; 2],
}

/// A sensor.
pub(super) struct Hdl64 {
    lasers: [CalibratedLaser; LASERS],
    unit_m: f64,
}

impl CalibratedLaser {
    /// Position of a return at a distance, m, with an azimuth of the block, rad: x ahead, y to the
    /// left.
    fn place(&self, distance_m: f64, azimuth: f64) -> [f32; 3] {
        let ([cos, sin], [up, beside]) = (self.elevation, self.offset_m);
        let angle = azimuth - self.azimuth;
        // Axes as in the manual: x to the right, y ahead.
        let (right, ahead) = (libm::sin(angle), libm::cos(angle));
        let along = |distance: f64| {
            let flat = distance * cos - up * sin;
            [flat * right - beside * ahead, flat * ahead + beside * right]
        };
        let far = distance_m + self.far_m;
        let corrected = [0, 1].map(|a| {
            let from_near = (along(far)[a].abs() - NEAR_M[a]) / (FAR_M - NEAR_M[a]);
            distance_m + self.near_m[a] + (self.far_m - self.near_m[a]) * from_near
        });
        let [x, y] = [along(corrected[0])[0], along(corrected[1])[1]];
        [y, -x, corrected[1] * sin + up * cos].map(|v| v as f32)
    }
}

impl Hdl64 {
    pub const NAME: &'static str = "HDL-64E";

    /// Reads a sensor from its calibration. Fails if it is another sensor's, or makes no sense.
    pub fn read(path: &Path) -> Result<Hdl64, Error> {
        let wrong = |what: String| Error::input(path, "", what);
        boost::read(path, |document| Hdl64::of(document).map_err(wrong))
    }

    fn of(document: &Document) -> Result<Hdl64, String> {
        let root = document.root_element();
        let unit_m = unit_m(child(root, "DB").unwrap_or(root))?;
        let mut lasers = [None; LASERS];
        for node in document.descendants().filter(|node| node.has_tag_name("px")) {
            let id: usize = number(node, "id_")?;
            let place = lasers.get_mut(id).ok_or(format!("laser id_ {id} is out of range"))?;
            let laser = laser(node).map_err(|what| format!("laser with id_ {id}: {what}"))?;
            if place.replace(laser).is_some() {
                return Err(format!("two lasers have id_ {id}"));
            }
        }
        let missing = lasers.iter().position(Option::is_none);
        missing.map_or(Ok(()), |id| {
            Err(format!("of {LASERS} lasers the one with id_ {id} is missing"))
        })?;
        Ok(Hdl64 { lasers: lasers.map(Option::unwrap_or_default), unit_m })
    }

    /// Maximum number of returns in a revolution: at the slowest speed.
    pub fn returns_max(&self) -> usize {
        ((PERIOD_MAX_NS / FIRING_NS as f64) as usize + FIRINGS) * LASERS
    }

    /// Time from the first firing of a packet to that of the next, ns.
    pub fn packet_ns(&self, packet: &[u8]) -> f64 {
        since_first_ns(packet, FIRINGS) as f64
    }

    /// Whether a packet is from such a sensor: it has blocks of lower lasers.
    pub fn recognises(&self, packet: &[u8]) -> bool {
        packet.len() == velodyne::PACKET
            && (0..2).any(|n| LaserBlock::of(packet, n).is_some_and(|block| block.is_lower))
    }

    /// Time and azimuth of a firing; `None` if it is damaged, or the second of a pair.
    pub fn firing(&self, packet: &[u8], firing: usize) -> Option<Firing> {
        let block = LaserBlock::of(packet, 2 * firing)
            .filter(|_| !is_dual(packet) || firing.is_multiple_of(2))?;
        let clock_ns = velodyne::clock_ns(packet)? + since_first_ns(packet, firing);
        let angle = velodyne::angle(block.azimuth);
        Some(Firing { clock_ns: clock_ns % velodyne::CLOCK_NS, angle, frame: None })
    }

    /// Adds the returns of a firing, in the sensor's frame: x ahead, y to the left, z up.
    pub fn returns(&self, packet: &[u8], firing: usize, offset_ns: i64, into: &mut Vec<Point>) {
        for block in (0..2).filter_map(|n| LaserBlock::of(packet, 2 * firing + n)) {
            let azimuth = f64::from(block.azimuth) / f64::from(velodyne::AZIMUTHS) * TAU;
            let lasers = &self.lasers[if block.is_lower { MEASUREMENTS } else { 0 }..];
            into.extend(block.measurements().map(|(n, (distance, reflectivity))| Point {
                position: lasers[n].place(f64::from(distance) * self.unit_m, azimuth),
                intensity: f32::from(reflectivity) / REFLECTIVITY_MAX,
                offset_s: (offset_ns as f64 * 1e-9) as f32,
                sensor: 0,
            }));
        }
    }
}

/// Whether firings come in pairs: no byte says so, but otherwise a rotating sensor never has the
/// same azimuth for two of them.
fn is_dual(packet: &[u8]) -> bool {
    let azimuth = |firing: usize| LaserBlock::of(packet, 2 * firing).map(|block| block.azimuth);
    azimuth(0).is_some() && azimuth(0) == azimuth(1)
}

/// Time from the first firing to another, ns.
fn since_first_ns(packet: &[u8], firing: usize) -> u64 {
    let before = if is_dual(packet) { firing / 2 } else { firing };
    before as u64 * FIRING_NS
}

fn child<'a>(of: Node<'a, 'a>, name: &str) -> Result<Node<'a, 'a>, String> {
    of.children().find(|node| node.has_tag_name(name)).ok_or(format!("no element {name}"))
}

fn number<T: FromStr>(of: Node, name: &str) -> Result<T, String> {
    let text = child(of, name)?.text().unwrap_or_default().trim();
    text.parse().map_err(|_| format!("{name}: `{text}` is not a valid number"))
}

fn unit_m(of: Node) -> Result<f64, String> {
    // Older files leave it out.
    let unit_m = match child(of, "distLSB_") {
        Ok(_) => number::<f64>(of, "distLSB_")? * METRES,
        Err(_) => UNIT_M,
    };
    let believed = UNITS_M.contains(&unit_m);
    believed.then_some(unit_m).ok_or(format!("distLSB_: a unit of {unit_m} m is out of range"))
}

fn laser(of: Node) -> Result<CalibratedLaser, String> {
    let within = |name, most: f64| match number::<f64>(of, name)? {
        number if number.abs() <= most => Ok(number),
        number => Err(format!("{name}: {number} is beyond {most}")),
    };
    let angle = |name| within(name, 360.0).map(f64::to_radians);
    let metres = |name| within(name, CORRECTION_MAX_M / METRES).map(|cm| cm * METRES);
    let elevation = angle("vertCorrection_")?;
    let far_m = metres("distCorrection_")?;
    // For the first sensors it was only measured far off.
    let near = |name| child(of, name).map_or(Ok(far_m), |_| metres(name));
    Ok(CalibratedLaser {
        azimuth: angle("rotCorrection_")?,
        elevation: [libm::cos(elevation), libm::sin(elevation)],
        far_m,
        near_m: [near("distCorrectionX_")?, near("distCorrectionY_")?],
        offset_m: [metres("vertOffsetCorrection_")?, metres("horizOffsetCorrection_")?],
    })
}
