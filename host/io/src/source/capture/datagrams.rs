//! UDP datagrams of a capture of network traffic: `.pcap` and `.pcapng`, with fragments
//! reassembled.

use std::collections::VecDeque;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::net::IpAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use etherparse::defrag::IpDefragPool;
use etherparse::err::packet::SliceError;
use etherparse::{EtherType, NetSlice, SlicedPacket, TransportSlice, UdpSlice, ip_number};
use pcap_parser::pcapng::Block;
use pcap_parser::{Linktype, PcapBlockOwned, PcapError, create_reader};

use crate::Error;
use crate::source::whole;

/// Bytes of a capture that are held in memory: more than any frame has.
const BUFFER: usize = 1 << 20;
/// A datagram whose fragments are spread over more than this many fragments is lost. The largest of
/// a sensor has 17.
const FRAGMENTS_HELD: usize = 256;
/// Maximum accepted number of interfaces.
const INTERFACES_MAX: usize = 1 << 10;
/// Bytes in front of a frame on a loopback interface.
const LOOPBACK: usize = 4;
const NS_OF_S: u64 = 1_000_000_000;
const US_OF_S: u64 = 1_000_000;

/// A sender: its address, and the port to which it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sender {
    pub address: IpAddr,
    pub port: u16,
}

impl std::fmt::Display for Sender {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.address, self.port)
    }
}

/// A datagram.
pub(super) struct Datagram<'a> {
    pub sender: Sender,
    pub payload: &'a [u8],
    /// Byte of the file at which its last frame begins.
    pub place: u64,
    /// Byte from which all of its frames can be found.
    pub from: u64,
    /// Capture time, ns since 1970.
    pub time_ns: u64,
}

/// An interface on which frames were captured.
#[derive(Clone, Copy)]
struct Interface {
    link: Linktype,
    /// Units of time in a second.
    resolution: u64,
}

/// What was left out while reading.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrameCounts {
    /// Frames shorter than what was sent, or damaged.
    pub cut: u64,
    /// Frames of unknown link types.
    pub unknown_link: u64,
    /// The last frame is cut off by the end of the file.
    pub ends_early: bool,
}

/// A capture from which datagrams are read, starting at any place.
pub(super) struct Datagrams {
    path: PathBuf,
    /// What a reader must see before it can continue from any other place.
    preamble: Vec<u8>,
}

impl Datagrams {
    /// Opens a file. Fails if it is not a capture.
    pub fn open(path: &Path) -> Result<Datagrams, Error> {
        let mut datagrams = Datagrams { path: path.to_path_buf(), preamble: Vec::new() };
        let mut ranges = Vec::new();
        datagrams.blocks(0, |place, size, block| match block {
            PcapBlockOwned::LegacyHeader(_)
            | PcapBlockOwned::NG(Block::SectionHeader(_) | Block::InterfaceDescription(_)) => {
                ranges.push((place, size));
                Ok(ControlFlow::Continue(()))
            }
            _ if ranges.len() > INTERFACES_MAX => Err("too many interfaces".into()),
            _ => Ok(ControlFlow::Break(())),
        })?;
        let (mut file, _) = whole::open(path)?;
        for (place, size) in ranges {
            let mut bytes = vec![0; size];
            file.seek(SeekFrom::Start(place)).map_err(Error::reading(path))?;
            file.read_exact(&mut bytes).map_err(Error::reading(path))?;
            datagrams.preamble.extend(bytes);
        }
        Ok(datagrams)
    }

    /// Calls `visit` with the datagrams from a byte of the file on (0, or [`Datagram::from`]) until
    /// it breaks.
    pub fn each(
        &self,
        from: u64,
        mut visit: impl FnMut(Datagram) -> ControlFlow<()>,
    ) -> Result<FrameCounts, Error> {
        let (mut frames, mut counts) = (Frames::default(), FrameCounts::default());
        counts.ends_early = self.blocks(from, |place, _, block| {
            let frame = frames.open(block)?;
            let datagram = |frame| frames.datagram(&frame, place, &mut counts, &mut visit);
            Ok(frame.map_or(ControlFlow::Continue(()), datagram))
        })?;
        Ok(counts)
    }

    /// Calls `visit` with place, size and content of the blocks from a byte on until it breaks; the
    /// preamble comes first. Returns whether the file ends within a block.
    fn blocks(
        &self,
        from: u64,
        mut visit: impl FnMut(u64, usize, &PcapBlockOwned) -> Result<ControlFlow<()>, String>,
    ) -> Result<bool, Error> {
        let before = if from == 0 { &[][..] } else { &self.preamble };
        let (mut file, _) = whole::open(&self.path)?;
        file.seek(SeekFrom::Start(from)).map_err(Error::reading(&self.path))?;
        let wrong =
            |place: u64, what: String| Error::input(&self.path, format!("byte {place}"), what);
        let mut reader = create_reader(BUFFER, Cursor::new(before).chain(file))
            .map_err(|_| wrong(0, "not a pcap or pcapng file".into()))?;
        // Meaningless for blocks of the preamble.
        let mut place = from.wrapping_sub(before.len() as u64);
        loop {
            match reader.next() {
                Ok((size, block)) => {
                    if visit(place, size, &block).map_err(|what| wrong(place, what))?.is_break() {
                        return Ok(false);
                    }
                    reader.consume(size);
                    place = place.wrapping_add(size as u64);
                }
                Err(PcapError::Eof) => return Ok(false),
                Err(PcapError::UnexpectedEof) => return Ok(true),
                Err(PcapError::Incomplete(_)) => {
                    reader.refill().map_err(|e| wrong(place, damage(&e)))?;
                }
                Err(e) => return Err(wrong(place, damage(&e))),
            }
        }
    }
}

/// Describes what is wrong with a file.
fn damage(error: &PcapError<&[u8]>) -> String {
    match error {
        PcapError::BufferTooSmall => format!("a frame longer than {BUFFER} bytes"),
        PcapError::ReadError => "cannot be read".into(),
        _ => "damaged: no frame begins here".into(),
    }
}

/// A captured frame.
struct CapturedFrame<'a> {
    link: Linktype,
    /// Since 1970, ns.
    time_ns: u64,
    bytes: &'a [u8],
}

/// Turns frames into datagrams.
#[derive(Default)]
struct Frames {
    interfaces: Vec<Interface>,
    /// Incomplete datagrams, with the place of the last fragment of each.
    pool: IpDefragPool<u64>,
    /// Places of the most recent fragments.
    fragments: VecDeque<u64>,
}

impl Frames {
    /// The frame of a block; `None` if it has none.
    fn open<'a>(&mut self, block: &'a PcapBlockOwned) -> Result<Option<CapturedFrame<'a>>, String> {
        match block {
            PcapBlockOwned::LegacyHeader(header) => {
                let fine = header.is_nanosecond_precision();
                let resolution = if fine { NS_OF_S } else { US_OF_S };
                self.interfaces = vec![Interface { link: header.network, resolution }];
            }
            PcapBlockOwned::NG(Block::SectionHeader(_)) if !self.interfaces.is_empty() => {
                return Err("a second section, which is not supported: split the file".into());
            }
            PcapBlockOwned::NG(Block::InterfaceDescription(interface)) => {
                let resolution = interface.ts_resolution().unwrap_or(US_OF_S);
                self.interfaces.push(Interface { link: interface.linktype, resolution });
            }
            PcapBlockOwned::Legacy(frame) => {
                let second = self.interface(0)?.resolution;
                let units = u64::from(frame.ts_sec) * second + u64::from(frame.ts_usec);
                return self.frame(0, units, frame.data).map(Some);
            }
            PcapBlockOwned::NG(Block::EnhancedPacket(frame)) => {
                let units = u64::from(frame.ts_high) << 32 | u64::from(frame.ts_low);
                let data = &frame.data[..frame.data.len().min(frame.caplen as usize)];
                return self.frame(frame.if_id, units, data).map(Some);
            }
            PcapBlockOwned::NG(Block::SimplePacket(frame)) => {
                return self.frame(0, 0, frame.data).map(Some);
            }
            PcapBlockOwned::NG(_) => {}
        }
        Ok(None)
    }

    fn interface(&self, number: u32) -> Result<Interface, String> {
        let found = self.interfaces.get(number as usize).copied();
        found
            .ok_or_else(|| format!("a frame of interface {number}, which the file does not define"))
    }

    fn frame<'a>(
        &self,
        interface: u32,
        units: u64,
        bytes: &'a [u8],
    ) -> Result<CapturedFrame<'a>, String> {
        let Interface { link, resolution } = self.interface(interface)?;
        let time_ns = u128::from(units) * u128::from(NS_OF_S) / u128::from(resolution);
        Ok(CapturedFrame { link, time_ns: time_ns as u64, bytes })
    }

    /// Passes on the datagram that a frame at a place holds or completes.
    fn datagram(
        &mut self,
        frame: &CapturedFrame,
        place: u64,
        counts: &mut FrameCounts,
        visit: &mut impl FnMut(Datagram) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let packet = match slice(frame.link, frame.bytes) {
            Some(Ok(packet)) => packet,
            Some(Err(_)) => {
                counts.cut += 1;
                return ControlFlow::Continue(());
            }
            None => {
                counts.unknown_link += 1;
                return ControlFlow::Continue(());
            }
        };
        let Some(address) = source(&packet) else { return ControlFlow::Continue(()) };
        let mut show = |from: u64, udp: &UdpSlice| {
            let sender = Sender { address, port: udp.destination_port() };
            visit(Datagram { sender, payload: udp.payload(), place, from, time_ns: frame.time_ns })
        };
        if packet.is_ip_payload_fragmented() {
            return self.fragment(&packet, place, counts, &mut show);
        }
        match &packet.transport {
            Some(TransportSlice::Udp(udp)) => show(place, udp),
            _ => ControlFlow::Continue(()),
        }
    }

    /// Passes on the datagram that a fragment completes, with the place from which all of it can be
    /// found.
    fn fragment(
        &mut self,
        packet: &SlicedPacket,
        place: u64,
        counts: &mut FrameCounts,
        show: &mut impl FnMut(u64, &UdpSlice) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.fragments.push_back(place);
        if self.fragments.len() > FRAGMENTS_HELD {
            self.fragments.pop_front();
        }
        let from = self.fragments[0];
        self.pool.retain(|last| *last >= from);
        let whole = self.pool.process_sliced_packet(packet, place, ());
        counts.cut += u64::from(whole.is_err());
        let Ok(Some(whole)) = whole else { return ControlFlow::Continue(()) };
        let is_udp = whole.ip_number == ip_number::UDP;
        let udp = UdpSlice::from_slice(&whole.payload).ok().filter(|_| is_udp);
        let flow = udp.map_or(ControlFlow::Continue(()), |udp| show(from, &udp));
        self.pool.return_buf(whole);
        flow
    }
}

/// The headers of a frame; `None` if the link type is unknown.
fn slice(link: Linktype, frame: &[u8]) -> Option<Result<SlicedPacket<'_>, SliceError>> {
    Some(match link {
        Linktype::ETHERNET => SlicedPacket::from_ethernet(frame),
        Linktype::LINUX_SLL => SlicedPacket::from_linux_sll(frame),
        Linktype::LINUX_SLL2 => {
            // The protocol, 18 further bytes, then the packet.
            let (head, packet) = frame.split_at_checked(20)?;
            SlicedPacket::from_ether_type(EtherType(u16::from_be_bytes([head[0], head[1]])), packet)
        }
        Linktype::RAW | Linktype::IPV4 | Linktype::IPV6 => SlicedPacket::from_ip(frame),
        Linktype::NULL | Linktype::LOOP => SlicedPacket::from_ip(frame.get(LOOPBACK..)?),
        _ => return None,
    })
}

fn source(packet: &SlicedPacket) -> Option<IpAddr> {
    match packet.net.as_ref()? {
        NetSlice::Ipv4(ip) => Some(ip.header().source_addr().into()),
        NetSlice::Ipv6(ip) => Some(ip.header().source_addr().into()),
        NetSlice::Arp(_) => None,
    }
}
