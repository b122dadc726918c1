//! Output as datagrams: a small format for programs that react to moving objects.
//!
//! Little-endian. A datagram has a header of 24 bytes and records of one kind:
//!
//! | byte | type | content |
//! |--:|---|---|
//! | 0 | 4 bytes | `RWF2` |
//! | 4 | u16 | kind of the records: 0 sweep, 1 column, 2 tracklet, 3 object |
//! | 6 | u16 | number of records in this datagram |
//! | 8 | u16 | number of this datagram among those of its kind and sweep |
//! | 10 | u16 | number of such datagrams |
//! | 12 | u32 | number of the sweep, in whose frame positions and axes are given |
//! | 16 | u64 | stamp of the sweep since 1970, ns |
//!
//! | kind | bytes | record |
//! |---|--:|---|
//! | sweep | 96 | f64 x, y, z and quaternion x, y, z, w of the vehicle in the world; then 1. |
//! | column | 32 | f32 x, y, velocity x, y over ground, its covariance xx, xy, yy, P(moves) |
//! | tracklet | 32 | f32 x, y, velocity x, y over ground, turn rate; then 2. |
//! | object | 84 | u32 number, observations, class; f32 the class's share of the returns; then 3. |
//!
//! 1. f32 time since the sweep before, s (0: no flow), latency from the last packet, ms; u64 sweeps
//!    dropped so far; u32 columns, tracklets, objects sent, and 0; u64 stamp of the sweep before,
//!    ns
//! 2. u32 observations; f32 standard deviation of the speed, P(moves)
//! 3. f32 P(moves) (NaN: unknown), time when last seen relative to the stamp (s, below 0 if not
//!    seen in the sweep), x, y, z of the centre of its box, heading (rad), length, width, height,
//!    velocity x, y over ground (0 if stationary), turn rate, covariance xx, xy, yy of its
//!    position, variances of its heading and speed
//!
//! Columns are the moving ones of the sweep before, objects all of that sweep (`--objects`),
//! tracklets the moving ones of the sweep; m, m/s, rad/s along the vehicle's axes. Classes:
//! 0 ground, 1 structure, 2 vegetation, 3 pole, 4 car, 5 large vehicle, 6 person, 7 two-wheeler,
//! 255 none. Every sweep ends with a datagram of kind 0.

use std::net::{SocketAddr, UdpSocket};

use glam::DVec3;
use raywake_core::encoder::ColumnClass;
use raywake_core::output::{ColumnFlow, TrackletState};
use raywake_core::pose::Pose;
use raywake_io::Error;
use raywake_objects::front_end::StateVariances;
use raywake_objects::tracked::TrackedObject;
use raywake_objects::wrap_angle;

const MAGIC: &[u8; 4] = b"RWF2";
const HEAD: usize = 24;
/// Maximum bytes of records in a datagram, which then fits an Ethernet frame.
const ROOM: usize = 1280;
/// Bytes of a column or tracklet, and of an object.
const RECORD: usize = 32;
const OBJECT: usize = 84;

/// Kinds of records.
#[derive(Clone, Copy)]
enum RecordKind {
    Sweep = 0,
    Column = 1,
    Tracklet = 2,
    Object = 3,
}

/// A sweep to send.
#[derive(Clone, Copy, Debug)]
pub struct SentSweep {
    pub number: u64,
    pub stamp_ns: u64,
    pub pose: Pose,
}

/// Other facts sent about a sweep.
#[derive(Clone, Copy, Debug)]
pub struct SweepFacts {
    /// Time since the sweep before, s; 0 if there is no flow.
    pub dt_s: f64,
    pub latency_ms: f64,
    /// Sweeps dropped so far.
    pub left_out: u64,
    /// Numbers of columns, tracklets and objects sent.
    pub sent: [usize; 3],
    /// Stamp of the sweep before, ns.
    pub before_ns: u64,
}

/// A socket to send datagrams from, and the current datagram.
pub struct FlowStream {
    socket: UdpSocket,
    to: SocketAddr,
    datagram: heapless::Vec<u8, { HEAD + ROOM }>,
    unsent: u64,
}

impl FlowStream {
    /// Opens a socket. Fails if the system has none.
    pub fn to(to: SocketAddr) -> Result<FlowStream, Error> {
        let any: SocketAddr = match to {
            SocketAddr::V4(_) => ([0; 4], 0).into(),
            SocketAddr::V6(_) => ([0; 16], 0).into(),
        };
        let open = || {
            let socket = UdpSocket::bind(any)?;
            socket.set_nonblocking(true).map(|()| socket)
        };
        let socket =
            open().map_err(|e: std::io::Error| Error::Usage(format!("--send {to}: {e}")))?;
        Ok(FlowStream { socket, to, datagram: heapless::Vec::new(), unsent: 0 })
    }

    /// Number of datagrams that the system did not accept.
    pub fn unsent(&self) -> u64 {
        self.unsent
    }

    /// Sends columns of a sweep. Returns how many.
    pub fn columns<'a>(
        &mut self,
        sweep: &SentSweep,
        columns: impl Iterator<Item = &'a ColumnFlow> + Clone,
    ) -> usize {
        self.all((RecordKind::Column, RECORD), sweep, columns, |this, column| {
            this.floats(&column.position_vehicle_m);
            this.floats(&sweep.pose.along_axes(column.velocity_world_mps));
            this.floats(&turned_covariance(&sweep.pose, column.covariance));
            this.floats(&[column.probability]);
        })
    }

    /// Sends tracklets of a sweep. Returns how many.
    pub fn tracklets(
        &mut self,
        sweep: &SentSweep,
        tracklets: impl Iterator<Item = TrackletState> + Clone,
    ) -> usize {
        self.all((RecordKind::Tracklet, RECORD), sweep, tracklets, |this, tracklet| {
            this.floats(&tracklet.position_vehicle_m);
            this.floats(&sweep.pose.along_axes(tracklet.velocity_world_mps));
            this.floats(&[tracklet.turn_rate_radps]);
            this.bytes(&tracklet.age.to_le_bytes());
            this.floats(&[tracklet.covariance[3][3].max(0.0).sqrt(), tracklet.probability]);
        })
    }

    /// Sends objects of a sweep; `stamp_s` is its stamp on the objects' time scale, s. Returns how
    /// many.
    pub fn objects<'a>(
        &mut self,
        sweep: &SentSweep,
        stamp_s: f64,
        objects: impl Iterator<Item = &'a TrackedObject> + Clone,
    ) -> usize {
        let vehicle = sweep.pose.inverse();
        self.all((RecordKind::Object, OBJECT), sweep, objects, |this, object| {
            let (class, share) = object.class.unzip();
            [object.id, object.observations, ColumnClass::number(class).into()]
                .iter()
                .for_each(|number| this.bytes(&number.to_le_bytes()));
            this.floats(&[share.unwrap_or(0.0), object.p_moves.unwrap_or(f32::NAN)]);
            this.floats(&[(object.time_s - stamp_s) as f32]);
            let centre = vehicle.transform(DVec3::from(object.centre));
            this.floats(&centre.to_array().map(|v| v as f32));
            let heading = object.heading - sweep.pose.yaw_rad();
            this.floats(&[wrap_angle(heading) as f32]);
            this.floats(&object.size);
            let velocity = object.velocity.unwrap_or_default().map(|v| v as f32);
            this.floats(&sweep.pose.along_axes(velocity));
            let StateVariances { position: [xx, xy, yy, _], heading, speed, .. } = object.variances;
            this.floats(&[object.turn_rate as f32]);
            this.floats(&turned_covariance(&sweep.pose, [xx, xy, yy]));
            this.floats(&[heading, speed]);
        })
    }

    /// Sends the record of a sweep, after all its others.
    pub fn sweep(&mut self, sweep: &SentSweep, facts: &SweepFacts) {
        self.begin(RecordKind::Sweep, sweep, [0, 1, 1]);
        let (place, turned) = (sweep.pose.translation, sweep.pose.rotation);
        [place.x, place.y, place.z, turned.x, turned.y, turned.z, turned.w]
            .iter()
            .for_each(|number| self.bytes(&number.to_le_bytes()));
        self.floats(&[facts.dt_s as f32, facts.latency_ms as f32]);
        self.bytes(&facts.left_out.to_le_bytes());
        let sent = facts.sent.iter().chain(&[0]);
        sent.for_each(|count| self.bytes(&(*count as u32).to_le_bytes()));
        self.bytes(&facts.before_ns.to_le_bytes());
        self.finish();
    }

    /// Sends records of one kind and size, as many per datagram as fit. Returns how many.
    fn all<R>(
        &mut self,
        (kind, bytes): (RecordKind, usize),
        sweep: &SentSweep,
        records: impl Iterator<Item = R> + Clone,
        write: impl Fn(&mut FlowStream, R),
    ) -> usize {
        let count = records.clone().count();
        let most = ROOM / bytes;
        let parts = count.div_ceil(most);
        for (n, record) in records.enumerate() {
            if n % most == 0 {
                self.begin(kind, sweep, [n / most, parts, (count - n).min(most)]);
            }
            write(self, record);
            if n % most == most - 1 || n + 1 == count {
                self.finish();
            }
        }
        count
    }

    fn begin(&mut self, kind: RecordKind, sweep: &SentSweep, [part, parts, records]: [usize; 3]) {
        self.datagram.clear();
        self.bytes(MAGIC);
        let head = [kind as usize, records, part, parts];
        head.iter().for_each(|word| self.bytes(&(*word as u16).to_le_bytes()));
        self.bytes(&(sweep.number as u32).to_le_bytes());
        self.bytes(&sweep.stamp_ns.to_le_bytes());
    }

    fn finish(&mut self) {
        let sent = self.socket.send_to(&self.datagram, self.to).is_ok();
        self.unsent += u64::from(!sent);
    }

    fn bytes(&mut self, bytes: &[u8]) {
        // The number of records was chosen to fit.
        let _ = self.datagram.extend_from_slice(bytes);
    }

    fn floats(&mut self, numbers: &[f32]) {
        numbers.iter().for_each(|number| self.bytes(&number.to_le_bytes()));
    }
}

/// Rotates a planar covariance (xx, xy, yy) from the world's to the vehicle's axes.
fn turned_covariance(pose: &Pose, [xx, xy, yy]: [f32; 3]) -> [f32; 3] {
    let (sin, cos) = libm::sincosf(pose.yaw_rad() as f32);
    let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
    let turned = cs * (yy - xx) + (cc - ss) * xy;
    [cc * xx + 2.0 * cs * xy + ss * yy, turned, ss * xx - 2.0 * cs * xy + cc * yy]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn float(bytes: &[u8], at: usize) -> f32 {
        f32::from_le_bytes(bytes[at..][..4].try_into().unwrap())
    }

    fn word(bytes: &[u8], at: usize) -> u16 {
        u16::from_le_bytes(bytes[at..][..2].try_into().unwrap())
    }

    /// Checked against the table above.
    #[test]
    fn what_is_sent() {
        let here = UdpSocket::bind("127.0.0.1:0").unwrap();
        let mut stream = FlowStream::to(here.local_addr().unwrap()).unwrap();
        let column = ColumnFlow {
            position_vehicle_m: [3.0, 4.0],
            velocity_world_mps: [1.0, 0.0],
            covariance: [4.0, 0.0, 1.0],
            probability: 0.75,
            ..ColumnFlow::default()
        };
        let mut tracklet = TrackletState { age: 7, probability: 0.5, ..TrackletState::default() };
        tracklet.covariance[3][3] = 0.25;
        // It faces along y.
        let pose = Pose::planar(1.0, 2.0, 0.0, std::f64::consts::FRAC_PI_2);
        let sweeps = [8, 9].map(|number| SentSweep { number, stamp_ns: 100 + number, pose });
        let columns = vec![column; 41];
        let sent = [
            stream.columns(&sweeps[0], columns.iter()),
            stream.tracklets(&sweeps[1], std::iter::once(tracklet)),
            stream.objects(&sweeps[0], 20.0, [object(5)].repeat(16).iter()),
        ];
        let facts = SweepFacts { dt_s: 0.1, latency_ms: 12.5, left_out: 3, sent, before_ns: 108 };
        stream.sweep(&sweeps[1], &facts);
        let mut got = Vec::new();
        for _ in 0..6 {
            let mut datagram = vec![0; 2000];
            let length = here.recv(&mut datagram).unwrap();
            datagram.truncate(length);
            assert_eq!(&datagram[..4], b"RWF2");
            got.push(datagram);
        }
        got.rotate_right(1);
        let heads: Vec<_> = got.iter().map(|d| [4, 6, 8, 10].map(|at| word(d, at))).collect();
        assert_eq!(heads[..4], [[0, 1, 0, 1], [1, 40, 0, 2], [1, 1, 1, 2], [2, 1, 0, 1]]);
        assert_eq!(heads[4..], [[3, 15, 0, 2], [3, 1, 1, 2]]);
        let lengths: Vec<usize> = got.iter().map(Vec::len).collect();
        assert_eq!(lengths, [24 + 96, 24 + 40 * 32, 56, 56, 24 + 15 * 84, 24 + 84]);
        assert_eq!(
            [&got[0], &got[1], &got[3]].map(|d| (d[12], d[16])),
            [(9, 109), (8, 108), (9, 109)]
        );
        assert_eq!(f64::from_le_bytes(got[0][24..32].try_into().unwrap()), 1.0);
        assert_eq!((float(&got[0], 80), float(&got[0], 84)), (0.1, 12.5));
        assert_eq!([88, 96, 100, 104, 108, 112].map(|at| got[0][at]), [3, 41, 1, 16, 0, 108]);
        let numbers: Vec<f32> = (0..8).map(|n| float(&got[2], 24 + 4 * n)).collect();
        for (number, expected) in numbers.iter().zip([3.0, 4.0, 0.0, -1.0, 1.0, 0.0, 4.0, 0.75]) {
            assert!((number - expected).abs() < 1e-6, "{numbers:?}");
        }
        assert_eq!((got[3][44], float(&got[3], 48), float(&got[3], 52)), (7, 0.5, 0.5));
        check_object(&got[5][24..]);
        assert_eq!(stream.unsent(), 0);
    }

    fn object(id: u32) -> TrackedObject {
        TrackedObject {
            id,
            observations: 9,
            time_s: 19.5,
            centre: [1.0, 5.0, 0.5],
            heading: std::f64::consts::PI,
            size: [4.0, 2.0, 1.5],
            velocity: Some([-3.0, 0.0]),
            turn_rate: 0.25,
            variances: StateVariances {
                position: [4.0, 0.0, 1.0, 9.0],
                heading: 0.5,
                speed: 0.75,
                turn_rate: 0.125,
            },
            p_moves: None,
            class: Some((ColumnClass::Car, 0.75)),
        }
    }

    /// Checks that object, seen from a vehicle at (1, 2) that faces along y.
    fn check_object(bytes: &[u8]) {
        let numbers = [0, 4, 8].map(|at| u32::from_le_bytes(bytes[at..][..4].try_into().unwrap()));
        assert_eq!(numbers, [5, 9, 4]);
        assert!(float(bytes, 16).is_nan());
        let numbers: Vec<f32> = (0..15).map(|n| float(bytes, 20 + 4 * n)).collect();
        let quarter = std::f32::consts::FRAC_PI_2;
        #[rustfmt::skip]
        let expected = [
            -0.5, 3.0, 0.0, 0.5, quarter, 4.0, 2.0, 1.5, 0.0, 3.0, 0.25, 1.0, 0.0, 4.0, 0.5,
        ];
        for (number, expected) in numbers.iter().zip(expected) {
            assert!((number - expected).abs() < 1e-6, "{numbers:?}");
        }
        assert_eq!((float(bytes, 12), float(bytes, 80)), (0.75, 0.75));
    }
}
