//! Synthetic packets and calibrations of an HDL-64E.

use super::live::{LiveSensor, SensorModel};
use super::*;

/// Elevation of all lasers but the first, degrees.
const DOWN: f64 = -10.0;

/// The calibration of a laser, with the names and units of the file.
fn laser(id: usize, values: [f64; 7]) -> String {
    let names = ["rot", "vert", "dist", "dist", "dist", "vertOffset", "horizOffset"];
    let ends = ["", "", "", "X", "Y", "", ""];
    let each = names.iter().zip(ends).zip(values);
    let tags: String = each
        .map(|((name, end), value)| {
            let tag = format!("{name}Correction{end}_");
            format!("<{tag}>{value}</{tag}>")
        })
        .collect();
    format!("<item><px><id_>{id}</id_>{tags}</px></item>")
}

/// A calibration: the first laser is one of a real sensor, the others need no corrections.
fn calibration() -> String {
    let first = laser(0, [-4.98, -7.16, 110.0, 113.0, 112.0, 21.5, 2.6]);
    let others: String =
        (1..64).map(|id| laser(id, [0.0, DOWN, 0.0, 0.0, 0.0, 0.0, 0.0])).collect();
    format!(
        "<?xml version=\"1.0\"?>\n<!DOCTYPE boost_serialization>\n<boost_serialization>\
         <DB><distLSB_>0.2</distLSB_><points_>{first}{others}</points_></DB></boost_serialization>"
    )
}

/// A packet that sees something 10 m away all around; `n` counts packets, 300 per revolution.
fn packet(n: u32) -> Vec<u8> {
    let mut packet = Vec::new();
    for block in 0..BLOCKS as u32 {
        packet.extend(if block % 2 == 0 { [0xff, 0xee] } else { [0xff, 0xdd] });
        packet.extend((((n * 6 + block / 2) * 20 % 36_000) as u16).to_le_bytes());
        (0..32).for_each(|_| packet.extend([0x88, 0x13, 51]));
    }
    packet.extend((n * 288).to_le_bytes());
    // This byte is one of its settings: it must not be taken for the number of a VLP-16.
    packet.extend([0x37, 0x22]);
    packet
}

fn packets(dual: bool) -> Vec<Vec<u8>> {
    let mut packets: Vec<Vec<u8>> = (0..700).map(packet).collect();
    for pair in packets.iter_mut().filter(|_| dual).flat_map(|p| p[..1200].chunks_mut(400)) {
        let azimuth = pair[2..4].to_vec();
        [202, 302].iter().for_each(|at| pair[*at..at + 2].copy_from_slice(&azimuth));
    }
    packets
}

/// A file of packets, 300 per revolution, and the sensor's calibration.
pub(crate) fn calibrated(count: usize) -> [Vec<u8>; 2] {
    [pcap(&from_one(&packets(false)[..count])), calibration().into_bytes()]
}

fn recorded(folder: &Temp, packets: &[Vec<u8>]) -> PathBuf {
    folder.write("made.pcap", pcap(&from_one(packets)))
}

fn floor() -> OpenOptions {
    OpenOptions { ground_m: Some(-2.0), ..options() }
}

/// The manual's formulas, evaluated by another program.
#[test]
fn places() {
    let folder = Temp::new();
    let path = folder.write("db.xml", calibration());
    let sensor = Hdl64::read(&path).unwrap();
    for (distance, azimuth, expected) in [
        (5000_u16, 0_u16, [11.012829858, -0.935230677, -1.171701344]),
        (5000, 9000, [-0.934276231, -11.019208644, -1.172787388]),
        (12000, 21550, [-18.984219303, 16.172612725, -2.915808693]),
    ] {
        let mut packet = packet(0);
        packet[2..4].copy_from_slice(&azimuth.to_le_bytes());
        packet[4..6].copy_from_slice(&distance.to_le_bytes());
        let mut points = Vec::new();
        sensor.returns(&packet, 0, 0, &mut points);
        assert_eq!(points.len(), 64);
        let off = [0, 1, 2].map(|a| (f64::from(points[0].position[a]) - expected[a]).abs());
        assert!(off.iter().all(|m| *m < 2e-6), "{:?} is off by {off:?} m", points[0]);
    }
}

#[test]
fn turns_of_an_hdl_64e() {
    let folder = Temp::new();
    folder.write("made.xml", calibration());
    let mut capture = Capture::open(&recorded(&folder, &packets(false)), &floor()).unwrap();
    assert!(capture.describe().contains("HDL-64E 10.0.0.9:2368"), "{}", capture.describe());
    let all = sweeps(&mut capture);
    assert_eq!((all.len(), all[0].points.len()), (1, 300 * 6 * 64));
    // From the rear, clockwise; the second laser needs no correction.
    let at = |n: usize| all[0].points[64 * n + 1].position.map(f64::from);
    let (along, z) = (10.0 * DOWN.to_radians().cos(), 10.0 * DOWN.to_radians().sin());
    for (n, [x, y]) in [(0, [-along, 0.0]), (450, [0.0, along]), (900, [along, 0.0])] {
        let off = [at(n)[0] - x, at(n)[1] - y, at(n)[2] - z];
        assert!(off.iter().all(|m| m.abs() < 1e-5), "{n}: {:?}", at(n));
    }
    let last = all[0].points.last().unwrap().offset_s;
    assert!((last - 1799.0 * 48e-6).abs() < 1e-6, "{last}");
}

/// Of two returns of a beam, the first one sent is used.
#[test]
fn two_returns_of_a_beam() {
    let folder = Temp::new();
    folder.write("made.xml", calibration());
    let mut capture = Capture::open(&recorded(&folder, &packets(true)), &floor()).unwrap();
    let all = sweeps(&mut capture);
    assert_eq!(all[0].points.len(), 300 * 3 * 64);
    let offsets_us = [0, 1, 2].map(|n| (all[0].points[64 * n].offset_s * 1e6).round());
    assert_eq!(offsets_us, [0.0, 48.0, 96.0]);
}

#[test]
fn invalid_calibrations() {
    let folder = Temp::new();
    let path = recorded(&folder, &packets(false)[..10]);
    assert!(wrong(&path).contains("an HDL-64E's its calibration (NAME.xml)"), "{}", wrong(&path));
    let own = calibration();
    for (from, to, expected) in [
        ("<id_>63</id_>", "<id_>62</id_>", "two lasers have id_ 62"),
        ("<id_>63</id_>", "<id_>64</id_>", "laser id_ 64 is out of range"),
        ("<id_>63</id_>", "<id_>-1</id_>", "`-1` is not a valid number"),
        (&laser(63, [0.0, DOWN, 0.0, 0.0, 0.0, 0.0, 0.0]), "", "the one with id_ 63 is missing"),
        (">-4.98<", ">NaN<", "laser with id_ 0: rotCorrection_: NaN is beyond 360"),
        (">110<", ">11000<", "distCorrection_: 11000 is beyond 1000"),
        (">0.2<", ">20<", "distLSB_: a unit of 0.2 m"),
        (">0.2<", ">two<", "distLSB_: `two` is not a valid number"),
        ("<!DOCTYPE boost_serialization>", "<!ENTITY a \"b\">", "defines entities"),
        ("<DB>", "<DB xmlns:a=\"b\">", "has namespaces"),
        ("</DB>", "", "not valid XML"),
    ] {
        assert!(own.contains(from), "{from}");
        folder.write("made.xml", own.replace(from, to));
        assert!(wrong(&path).contains(expected), "{}", wrong(&path));
    }
}

/// Older files have neither the unit nor near distances.
#[test]
fn first_sensors() {
    let folder = Temp::new();
    let mut own = calibration().replace("<distLSB_>0.2</distLSB_>", "");
    for tag in ["distCorrectionX_", "distCorrectionY_"] {
        while let Some(at) = own.find(&format!("<{tag}>")) {
            let end = own.find(&format!("</{tag}>")).unwrap() + tag.len() + 3;
            own.replace_range(at..end, "");
        }
    }
    let sensor = Hdl64::read(&folder.write("db.xml", own)).unwrap();
    let mut points = Vec::new();
    sensor.returns(&packet(0), 0, 0, &mut points);
    let reach = |p: [f32; 3]| p.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
    // The distance correction, 1.10 m, and offsets at right angles to the beam.
    let expected = 11.1_f64.powi(2) + 0.215_f64.powi(2) + 0.026_f64.powi(2);
    assert!((reach(points[0].position) - expected).abs() < 1e-3, "{:?}", points[0]);
}

#[test]
fn live() {
    let folder = Temp::new();
    let path = folder.write("db.xml", calibration());
    let sensor = LiveSensor::of(SensorModel::Hdl64e, Some(&path)).unwrap();
    let (sweeps, counts) = arriving::assembled(&sensor, &packets(false));
    assert_eq!((counts.packets, counts.foreign, counts.missing), (700, 0, 0));
    assert_eq!(sweeps.last().unwrap().points.len(), 300 * 6 * 64);
    arriving::corrupt(&sensor, &packets(false));
    let (_, counts) = arriving::assembled(&sensor, &turns(0..10));
    assert_eq!((counts.packets, counts.foreign), (0, 10));
    let missing = LiveSensor::of(SensorModel::Hdl64e, None).err().unwrap().to_string();
    assert!(missing.contains("need --metadata, the db.xml"), "{missing}");
}
