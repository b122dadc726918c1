//! What the sensors of a capture sent, and where their sweeps begin.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use super::datagrams::{Datagram, Datagrams, FrameCounts, Sender};
use super::firing::Firing;
use super::hdl64::Hdl64;
use super::ouster::Ouster;
use super::sensor::{Order, Sensor};
use super::velodyne::Velodyne;
use crate::Error;
use crate::source::beside::companion_file;

/// A revolution at an end of the capture is left out if it has a smaller share of the fullest one's
/// firings.
const WHOLE_MIN: f64 = 0.9;
/// Maximum number of sensors distinguished in a capture.
const CAPTURE_SENSORS_MAX: usize = 16;

/// Where a sweep begins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// Byte from which its first packet can be read.
    pub from: u64,
    /// Place of that packet, and number of the sweep's first firing in it.
    pub place: u64,
    pub firing: usize,
    pub clock_ns: u64,
    pub angle: u16,
    /// When that packet was captured.
    pub time_ns: u64,
    /// Number of its firings.
    pub firings: u64,
}

impl Cut {
    fn at(datagram: &Datagram, number: usize, firing: &Firing) -> Cut {
        let Datagram { from, place, time_ns, .. } = *datagram;
        let Firing { clock_ns, angle, .. } = *firing;
        Cut { from, place, firing: number, clock_ns, angle, time_ns, firings: 0 }
    }

    /// After all others.
    pub const END: Cut =
        Cut { from: 0, place: u64::MAX, firing: 0, clock_ns: 0, angle: 0, time_ns: 0, firings: 0 };
}

/// What one sensor sent.
pub(super) struct Stream {
    pub sender: Sender,
    pub sensor: Sensor,
    cuts: Vec<Cut>,
    last: Option<Firing>,
    packets: u64,
    /// Packets with a wrong checksum, and late firings.
    unsound: u64,
    late: u64,
}

impl Stream {
    fn new(sender: Sender, sensor: Sensor) -> Stream {
        Stream { sender, sensor, cuts: Vec::new(), last: None, packets: 0, unsound: 0, late: 0 }
    }

    fn take(&mut self, datagram: &Datagram) {
        self.packets += 1;
        if !self.sensor.has_valid_checksum(datagram.payload) {
            self.unsound += 1;
            return;
        }
        let sensor = self.sensor.clone();
        for (number, firing) in sensor.firings(datagram.payload) {
            match sensor.order(&firing, self.last.as_ref()) {
                Order::Late => {
                    self.late += 1;
                    continue;
                }
                Order::Begins => self.cuts.push(Cut::at(datagram, number, &firing)),
                Order::GoesOn => {}
            }
            self.last = Some(firing);
            if let Some(cut) = self.cuts.last_mut() {
                cut.firings += 1;
            }
        }
    }

    /// Where each sweep and the next one begin, without incomplete revolutions at the ends.
    pub fn sweeps(&mut self, notes: &mut Vec<String>) -> Vec<[Cut; 2]> {
        let most = self.cuts.iter().map(|cut| cut.firings).max().unwrap_or(0) as f64;
        let part = |cut: &&Cut| (cut.firings as f64) < WHOLE_MIN * most;
        let mut cuts = std::mem::take(&mut self.cuts);
        cuts.push(Cut::END);
        let sweeps = cuts.len() - 1;
        let last = cuts[..sweeps].last().filter(part).map_or(sweeps, |_| sweeps - 1);
        let first = usize::from(cuts[..last].first().filter(part).is_some());
        if sweeps > last - first {
            let left_out = sweeps + first - last;
            notes.push(format!("left out: incomplete revolutions at the ends ({left_out})"));
        }
        let few = cuts[first..last].iter().filter(part).count();
        if few > 0 {
            notes.push(format!("sweeps missing more than a tenth of their packets: {few}"));
        }
        cuts[first..=last].windows(2).map(|pair| [pair[0], pair[1]]).collect()
    }
}

/// Streams of a capture that is being read.
struct Streams {
    all: Vec<Stream>,
    /// Sensors described by files next to the capture.
    described: Vec<Sensor>,
    /// Number of datagrams, and bytes of the largest one.
    seen: u64,
    largest: usize,
}

impl Streams {
    fn take(&mut self, datagram: &Datagram) {
        let Datagram { sender, payload, .. } = *datagram;
        self.seen += 1;
        self.largest = self.largest.max(payload.len());
        let known = |s: &Stream| s.sender == sender && s.sensor.recognises(payload);
        let known = self.all.iter().position(known).or_else(|| self.find(sender, payload));
        if let Some(n) = known {
            self.all[n].take(datagram);
        }
    }

    /// Begins the stream of a sensor that is seen for the first time.
    fn find(&mut self, sender: Sender, packet: &[u8]) -> Option<usize> {
        let velodyne = Velodyne::of(packet).map(|sensor| Sensor::Velodyne(Arc::new(sensor)));
        let described = || self.described.iter().find(|sensor| sensor.recognises(packet)).cloned();
        let sensor = velodyne.or_else(described)?;
        let room = self.all.len() < CAPTURE_SENSORS_MAX;
        room.then(|| self.all.push(Stream::new(sender, sensor)))?;
        Some(self.all.len() - 1)
    }

    /// The error that no sensor was found.
    fn none(&self, path: &Path) -> Error {
        let Streams { described, seen, largest, .. } = self;
        let others = match described.first() {
            Some(described) => {
                format!("nor of the {} described by a file next to it", described.name())
            }
            None => "and Ouster's need the sensor's metadata (NAME.json next to NAME.pcap), an \
                     HDL-64E's its calibration (NAME.xml)"
                .into(),
        };
        let what = format!(
            "no packets of a VLP-16, VLP-32C or HDL-32E among {seen} datagrams of at most \
             {largest} bytes, {others}"
        );
        Error::input(path, "", what)
    }
}

/// What all sensors of a capture sent, and what was left out. Fails if none sent anything.
pub(super) fn streams(
    path: &Path,
    datagrams: &Datagrams,
) -> Result<(Vec<Stream>, FrameCounts), Error> {
    let (described, unread) = described(path)?;
    let mut streams = Streams { all: Vec::new(), described, seen: 0, largest: 0 };
    let counts = datagrams.each(0, |datagram| {
        streams.take(&datagram);
        ControlFlow::Continue(())
    })?;
    streams.all.retain(|stream| !stream.cuts.is_empty());
    if streams.all.is_empty() {
        return Err(unread.unwrap_or_else(|| streams.none(path)));
    }
    Ok((streams.all, counts))
}

/// Notes on a stream for the user.
pub(super) fn notes(stream: &Stream, counts: &FrameCounts) -> Vec<String> {
    let all = [
        (format!("packets with a wrong checksum, of {}", stream.packets), stream.unsound),
        ("late firings".into(), stream.late),
        ("truncated or damaged frames".into(), counts.cut),
        ("frames of unknown link types".into(), counts.unknown_link),
    ];
    let nonzero = all.into_iter().filter(|(_, count)| *count > 0);
    let mut notes: Vec<String> =
        nonzero.map(|(what, count)| format!("left out: {what} ({count})")).collect();
    if counts.ends_early {
        notes.push("the file ends within a frame".into());
    }
    notes
}

/// The requested stream, or the only one.
pub(super) fn choose(
    path: &Path,
    mut streams: Vec<Stream>,
    asked: &[String],
) -> Result<Stream, Error> {
    let of = |s: &Stream| format!("{} ({}, {} packets)", s.sender, s.sensor.name(), s.packets);
    let listed: Vec<String> = streams.iter().map(of).collect();
    let listed = listed.join(", ");
    let wrong = |what: String| Err(Error::input(path, "", what));
    match asked {
        [] if streams.len() == 1 => Ok(streams.remove(0)),
        [] => wrong(format!("several sensors, choose one with --topic: {listed}")),
        [one] => match streams.iter().position(|s| s.sender.to_string() == *one) {
            Some(n) => Ok(streams.swap_remove(n)),
            None => wrong(format!("no sensor sends as {one}; available: {listed}")),
        },
        _ => wrong("only one sensor of a capture can be read, several are requested".into()),
    }
}

/// Sensors described by files next to a capture, and the error of a file that cannot be read: next
/// to another Velodyne's capture, a file of that name is something else.
fn described(path: &Path) -> Result<(Vec<Sensor>, Option<Error>), Error> {
    let json = companion_file(path, "json")?.map(|path| Ouster::read(&path).map(Arc::new));
    let xml = companion_file(path, "xml")?.map(|path| Hdl64::read(&path).map(Arc::new));
    let both = [json.map(|o| o.map(Sensor::Ouster)), xml.map(|h| h.map(Sensor::Hdl64))];
    let (mut described, mut unread) = (Vec::new(), None);
    for one in both.into_iter().flatten() {
        match one {
            Ok(sensor) => described.push(sensor),
            Err(e) => unread = Some(e),
        }
    }
    Ok((described, unread))
}
