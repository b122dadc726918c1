//! Sends a capture's packets again, as if the sensor were there.

use std::net::{SocketAddr, UdpSocket};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use super::datagrams::{Datagrams, Sender};
use super::live::LiveSensor;
use super::streams;
use crate::Error;

/// Longest pause that is kept: a longer one is a gap in the capture.
const PAUSE_MAX: Duration = Duration::from_secs(1);

/// A capture that can be sent again.
pub struct Replay {
    path: PathBuf,
    datagrams: Datagrams,
    sender: Sender,
    sensor: LiveSensor,
}

impl Replay {
    /// Opens a capture. Fails in the same cases as opening it as a recording; `topic` is its
    /// sensor, as `ADDRESS:PORT`, if it has several.
    pub fn open(path: &Path, topic: Option<&str>) -> Result<Replay, Error> {
        let datagrams = Datagrams::open(path)?;
        let (all, _) = streams::streams(path, &datagrams)?;
        let asked: Vec<String> = topic.into_iter().map(String::from).collect();
        let stream = streams::choose(path, all, &asked)?;
        let sensor = LiveSensor(stream.sensor);
        Ok(Replay { path: path.to_path_buf(), datagrams, sender: stream.sender, sensor })
    }

    /// The sensor.
    pub fn sensor(&self) -> &LiveSensor {
        &self.sensor
    }

    /// Sends everything that the sensor sent, at the pace of the capture times `speed`, until
    /// `stop` returns true. Returns the number of datagrams sent. Fails if the capture cannot be
    /// read; datagrams that the system does not send are lost, as on a wire.
    pub fn send(&self, to: SocketAddr, speed: f64, stop: impl Fn() -> bool) -> Result<u64, Error> {
        let any = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(any).map_err(Error::reading(&self.path))?;
        let (mut sent, mut due, mut before_ns) = (0, Instant::now(), None);
        self.datagrams.each(0, |datagram| {
            if datagram.sender != self.sender {
                return ControlFlow::Continue(());
            }
            let pause_ns = datagram.time_ns.saturating_sub(before_ns.unwrap_or(datagram.time_ns));
            before_ns = Some(datagram.time_ns);
            due += Duration::from_nanos(pause_ns).min(PAUSE_MAX).div_f64(speed);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            sent += u64::from(socket.send_to(datagram.payload, to).is_ok());
            if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })?;
        Ok(sent)
    }
}
