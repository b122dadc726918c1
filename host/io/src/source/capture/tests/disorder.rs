//! Captures in other encapsulations, mixed, cut and damaged.

use super::*;

/// The same sweeps in any encapsulation.
#[test]
fn fragments_and_pcapng() {
    let packets = turns(0..200);
    let whole = from_one(&packets);
    let (_folder, capture) = made(&whole);
    let expected: Vec<_> = sweeps(&mut capture.unwrap()).into_iter().map(|s| s.points).collect();
    assert_eq!(expected.len(), 2);
    let folder = Temp::new();
    let path = folder.write("made.pcapng", pcapng(&whole));
    let ground = OpenOptions { ground_m: Some(-2.0), ..options() };
    let mut capture = Capture::open(&path, &ground).unwrap();
    assert_eq!(capture.overview.epoch_ns / 1_000_000_000, 1_700_000_000);
    assert_eq!(sweeps(&mut capture)[0].points, expected[0]);
    // In two parts, mixed with those of neighbours, the last part first.
    let mut parts = Vec::new();
    for (n, frame) in whole.iter().enumerate() {
        let (head, payload) = frame.split_at(34);
        let part = |offset: usize, length: usize| {
            let mut part = head.to_vec();
            let more = if offset + length < payload.len() { 0x2000 } else { 0 };
            part[16..18].copy_from_slice(&(20 + length as u16).to_be_bytes());
            part[18..20].copy_from_slice(&(n as u16).to_be_bytes());
            part[20..22].copy_from_slice(&(more | (offset / 8) as u16).to_be_bytes());
            part.extend(&payload[offset..offset + length]);
            part
        };
        parts.extend([part(800, payload.len() - 800), part(0, 800)]);
    }
    parts.chunks_exact_mut(4).for_each(|four| four.swap(1, 2));
    let (_folder, capture) = made(&parts);
    let mut capture = capture.unwrap();
    assert_eq!(sweeps(&mut capture)[0].points, expected[0]);
    // If one part is missing, its packet is missing.
    parts.remove(250);
    let (_folder, capture) = made(&parts);
    let found = sweeps(&mut capture.unwrap());
    assert_eq!(found[0].points, expected[0]);
    assert_eq!(found[1].points.len(), expected[1].len() - 12 * 32);
}

/// Revolutions with packets that are repeated, late or missing, and one foreign datagram.
pub(super) fn mixed() -> Vec<Vec<u8>> {
    let mut packets = turns(0..750);
    packets.drain(475..575);
    packets.drain(285..390);
    packets.insert(121, packets[120].clone());
    packets.swap(200, 201);
    packets.insert(50, b"something else".to_vec());
    packets
}

/// Packets that are repeated, late or missing, and foreign datagrams.
#[test]
fn disorder() {
    let packets = mixed();
    let (_folder, capture) = made(&from_one(&packets));
    let mut capture = capture.unwrap();
    let notes = capture.notes().join("\n");
    assert!(notes.contains("late firings (24)"), "{notes}");
    // Revolutions begin at packets 37.5, 112.5, ...: parts of those at 262.5 and 337.5 are there,
    // nothing of the one at 487.5.
    assert_eq!(capture.overview.frames, [0, 1, 2, 3, 4, 5, 7, 8]);
    let mut sweep = SweepData::default();
    capture.read(6, &mut sweep).unwrap();
    assert_eq!(sweep.dropped.sweeps_before, 1);
}

#[test]
fn several_sensors() {
    let packets = turns(0..300);
    let other = packets.iter().map(|packet| frame([10, 0, 0, 8], packet));
    let frames: Vec<_> = from_one(&packets).into_iter().chain(other).collect();
    let (folder, refused) = made(&frames);
    let what = refused.err().unwrap().to_string();
    assert!(what.contains("several sensors, choose one with --topic: 10.0.0.9:2368"), "{what}");
    let path = folder.path().join("made.pcap");
    let choose =
        |topic: &str| OpenOptions { ground_m: Some(-2.0), topics: vec![topic.into()], ..options() };
    assert_eq!(Capture::open(&path, &choose("10.0.0.8:2368")).unwrap().len(), 3);
    let what = Capture::open(&path, &choose("x")).err().unwrap().to_string();
    assert!(what.contains("no sensor sends as x; available: 10.0.0.9:2368 (VLP-16"), "{what}");
}

#[test]
fn mistakes() {
    let what = wrong(&packets("empty_pcap.pcap"));
    assert!(what.contains("among 0 datagrams of at most 0 bytes, and Ouster's need"), "{what}");
    let folder = Temp::new();
    let path = folder.write("x.pcap", b"no capture at all, whatever its name says");
    assert!(wrong(&path).contains("not a pcap or pcapng file"), "{}", wrong(&path));
    // The metadata of another sensor, and none at all.
    let capture = fs::read(packets("OS-1-128_v2.3.0_1024x10_lb_n3.pcap")).unwrap();
    let path = folder.write("y.pcap", &capture);
    assert!(wrong(&path).contains("Ouster's need the sensor's metadata"), "{}", wrong(&path));
    for (json, expected) in [
        ("{", "EOF"),
        ("{}", "no numbers in `beam_altitude_angles`"),
        (r#"{"beam_altitude_angles": [1], "beam_azimuth_angles": []}"#, "1 beam_altitude_angles"),
    ] {
        folder.write("y.json", json);
        assert!(wrong(&path).contains(expected), "{}", wrong(&path));
    }
    // Cut off: what is complete is read.
    let own = fs::read_to_string(packets("OS-1-128_v2.3.0_1024x10.json")).unwrap();
    folder.write("y.json", &own);
    folder.write("y.pcap", &capture[..capture.len() * 3 / 4]);
    let source = opened(&path);
    assert_eq!(source.len(), 2);
    assert!(source.notes().join("\n").contains("the file ends within a frame"));
    // A clock that is set back by 100 s, within a revolution.
    let mut packets = turns(0..375);
    for packet in &mut packets[..150] {
        let us = u32::from_le_bytes(packet[1200..1204].try_into().unwrap());
        packet[1200..1204].copy_from_slice(&(us + 100_000_000).to_le_bytes());
    }
    let (_folder, capture) = made(&from_one(&packets));
    let capture = capture.unwrap();
    let notes = capture.notes().join("\n");
    assert!(notes.contains("the sensor's clock was set, one revolution is assumed there: 1 times"));
    let stamps_s = &capture.overview.track.stamps_s;
    assert!(stamps_s.windows(2).all(|pair| (0.01..0.11).contains(&(pair[1] - pair[0]))));
    assert_eq!(Format::Pcap, crate::source::recognise(&path).unwrap().0);
}

/// Whatever a file contains, there is an error or there are sweeps.
#[test]
fn damaged_captures() {
    let folder = Temp::new();
    let json = fs::read_to_string(packets("crc_test.json")).unwrap();
    folder.write("x.json", json);
    let real = fs::read(packets("crc_test.pcap")).unwrap();
    let made = pcapng(&from_one(&turns(0..160)));
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % below
    };
    let mut outcomes = [0; 2];
    for (n, file) in [&real[..], &made].into_iter().cycle().take(300).enumerate() {
        let mut bytes = file[..file.len().min(100_000)].to_vec();
        for _ in 0..1 + n % 7 {
            let reach = if n % 3 == 0 { 200 } else { bytes.len() };
            let at = random(reach);
            bytes[at] = random(256) as u8;
        }
        let path = folder.write("x.pcap", &bytes);
        let source = Capture::open(&path, &OpenOptions { ground_m: Some(-1.0), ..options() });
        outcomes[usize::from(source.is_ok())] += 1;
        let mut sweep = SweepData::default();
        if let Ok(mut source) = source {
            (0..source.len()).for_each(|n| {
                let _ = source.read(n, &mut sweep);
            });
        }
    }
    assert!(outcomes.iter().all(|count| *count > 20), "{outcomes:?}");
}
