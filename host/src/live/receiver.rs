//! The thread that receives a sensor's packets. It allocates nothing.

use std::fs;
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use raywake_io::Error;
use raywake_io::source::capture::assembly::{Assembler, LiveSweep, PacketCounts};
use raywake_io::source::capture::live::LiveSensor;
use socket2::SockRef;

use super::handover::Handover;

/// More than the largest datagram, bytes.
const DATAGRAM: usize = 1 << 16;
/// Size of the receive buffer requested from the system, bytes: two sweeps of the largest sensor
/// (OS1-128, 2048 columns).
const RECEIVE_BUFFER_BYTES: usize = 8 << 20;
/// How often to check whether to stop.
const POLL: Duration = Duration::from_millis(50);

/// A receiver's state as seen by other threads.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReceiverState {
    pub counts: PacketCounts,
    /// Address of the sensor.
    pub sender: Option<IpAddr>,
    /// Time of the first stamp since 1970, ns.
    pub epoch_ns: u64,
}

/// A socket that receives packets.
pub struct Receiver {
    socket: UdpSocket,
    address: SocketAddr,
    sensor: LiveSensor,
    state: Mutex<ReceiverState>,
}

/// Opens a socket. Fails if the address is unavailable.
pub fn bind(address: SocketAddr, option: &str) -> Result<UdpSocket, Error> {
    let open = || {
        let socket = UdpSocket::bind(address)?;
        socket.set_read_timeout(Some(POLL))?;
        Ok(socket)
    };
    open().map_err(|e: std::io::Error| Error::Usage(format!("--{option} {address}: {e}")))
}

/// Now, ns since 1970.
fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as u64)
}

/// Pauses after an error, except a timeout or interruption; errors concern single datagrams, which
/// are lost.
fn pause(e: &std::io::Error) {
    if !matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) {
        // If the network is down, the error comes at once, again and again.
        std::thread::sleep(POLL);
    }
}

/// Passes every datagram to `take` until `stop`.
pub fn for_each_datagram(
    socket: &UdpSocket,
    stop: &AtomicBool,
    mut take: impl FnMut(&[u8], SocketAddr),
) {
    let mut datagram = [0; DATAGRAM];
    while !stop.load(Ordering::Relaxed) {
        match socket.recv_from(&mut datagram) {
            Ok((length, from)) => take(&datagram[..length], from),
            Err(e) => pause(&e),
        }
    }
}

impl Receiver {
    /// Opens a socket for a sensor. Fails if the address is unavailable.
    pub fn bind(address: SocketAddr, sensor: LiveSensor) -> Result<Receiver, Error> {
        let socket = bind(address, "listen")?;
        // The system grants as much as it allows.
        let _ = SockRef::from(&socket).set_recv_buffer_size(RECEIVE_BUFFER_BYTES);
        let address = socket.local_addr().unwrap_or(address);
        Ok(Receiver { socket, address, sensor, state: Mutex::default() })
    }

    /// The address it listens on.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The sensor.
    pub fn sensor(&self) -> &LiveSensor {
        &self.sensor
    }

    /// The current state.
    pub fn state(&self) -> ReceiverState {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Size of the receive buffer, bytes.
    pub fn held(&self) -> usize {
        SockRef::from(&self.socket).recv_buffer_size().unwrap_or(0)
    }

    /// A note for the user if the receive buffer is small.
    pub fn note(&self) -> Option<String> {
        let held = self.held();
        (held < RECEIVE_BUFFER_BYTES).then(|| {
            format!(
                "the receive buffer holds {held} bytes, {RECEIVE_BUFFER_BYTES} were requested: \
                 sysctl net.core.rmem_max={RECEIVE_BUFFER_BYTES} allows them"
            )
        })
    }

    /// Receives packets and passes on the sweeps until `stop`. The sender of the first valid packet
    /// is taken as the sensor; datagrams from others are foreign.
    pub fn run(&self, sweeps: &Handover<LiveSweep>, stop: &AtomicBool) {
        let (mut assembler, mut sender) = (Assembler::new(self.sensor.clone()), None);
        raywake_alloc_guard::watch("receiver", || {
            for_each_datagram(&self.socket, stop, |datagram, from| {
                let (arrived, now_ns) = (Instant::now(), now_ns());
                let known = *sender.get_or_insert(from.ip()) == from.ip();
                match known {
                    true => assembler.take(datagram, arrived, now_ns, |sweep| sweeps.put(sweep)),
                    false => assembler.foreign(),
                }
                let counts = assembler.counts();
                // A sender whose first datagram was not a valid packet is not the sensor.
                sender = sender.filter(|_| counts.packets > 0);
                let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
                *state = ReceiverState { counts, sender, epoch_ns: assembler.epoch_ns() };
            });
        });
        sweeps.close();
    }

    /// Number of datagrams that the system dropped because they were not fetched in time; `None` if
    /// unknown.
    pub fn overflowed(&self) -> Option<u64> {
        let table = match self.address.is_ipv4() {
            true => "/proc/net/udp",
            false => "/proc/net/udp6",
        };
        overflowed(&fs::read_to_string(table).ok()?, self.address.port())
    }
}

/// The last column of a local port's row in Linux's socket table.
fn overflowed(table: &str, port: u16) -> Option<u64> {
    let end = format!(":{port:04X}");
    let is_mine = |row: &&str| row.split_whitespace().nth(1).is_some_and(|at| at.ends_with(&end));
    let drops = |row: &str| row.split_whitespace().last()?.parse::<u64>().ok();
    table.lines().skip(1).filter(is_mine).map(drops).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raywake_io::source::capture::live::SensorModel;

    #[test]
    fn socket_statistics_of_linux() {
        let table = "   sl  local_address rem_address   st tx rx tr tm retr uid timeout inode ref \
                     pointer drops\n\
                     1: 0100007F:0940 00000000:0000 07 0:0 00:0 00 0 0 42 2 0000 17\n\
                     2: 0100007F:0941 00000000:0000 07 0:0 00:0 00 0 0 43 2 0000 0\n";
        assert_eq!([2368, 2369].map(|port| overflowed(table, port)), [Some(17), Some(0)]);
    }

    #[test]
    fn an_address_can_be_bound_only_once() {
        let sensor = LiveSensor::of(SensorModel::Vlp16, None).unwrap();
        let first = Receiver::bind("127.0.0.1:0".parse().unwrap(), sensor.clone()).unwrap();
        let error = Receiver::bind(first.address(), sensor).err().unwrap();
        assert!(error.to_string().starts_with("--listen 127.0.0.1:"), "{error}");
        assert!(first.held() > 0 && first.overflowed() == Some(0));
    }
}
