//! Messages to connected viewers: Foxglove's protocol over a websocket.

use std::net::SocketAddr;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use foxglove::{
    ChannelBuilder, Context, PartialMetadata, RawChannel, WebSocketServer, WebSocketServerHandle,
};

use super::super::streams::Pace;
use super::Topic;
use crate::Error;

/// Longest wait before a message, s: playback goes on where the times of a recording jump.
const WAIT_MAX_S: f64 = 1.0;
/// Wait before the first message, as a viewer subscribes to one topic after another, and after the
/// last one, as closing drops what has not been sent yet.
const GRACE: Duration = Duration::from_millis(200);

/// A server that plays messages at the pace of their times. Topics nobody watches are not sent.
pub(super) struct LiveServer {
    server: WebSocketServerHandle,
    /// Connects server and channels, which hold it weakly.
    _context: Arc<Context>,
    channels: Vec<Arc<RawChannel>>,
    pace: Pace,
    /// When the last message was sent, and its time, ns.
    last: Option<(Instant, u64)>,
}

impl LiveServer {
    /// Starts listening. Fails if the address is not available.
    pub fn start(address: SocketAddr, pace: Pace, topics: &[Topic]) -> Result<LiveServer, Error> {
        let failed = |e| Error::Unsupported(format!("--live {address}: {e}"));
        let context = Context::new();
        let channel = |(topic, schema): &Topic| {
            let text = schema.text().into_bytes();
            let schema = foxglove::Schema::new(schema.name, "ros2msg", text);
            let channel = ChannelBuilder::new(*topic).context(&context).schema(schema);
            channel.message_encoding("cdr").build_raw()
        };
        let channels = topics.iter().map(channel).collect::<Result<_, _>>().map_err(failed)?;
        let server = WebSocketServer::new().name("raywake").context(&context);
        let server = server.bind(address.ip().to_string(), address.port());
        let server = server.start_blocking().map_err(failed)?;
        Ok(LiveServer { server, _context: context, channels, pace, last: None })
    }

    /// Whether a viewer has subscribed to a topic.
    pub fn has_viewer(&self) -> bool {
        self.channels.iter().any(|channel| channel.has_sinks())
    }

    /// Sends a message of a topic when it is due.
    pub fn write(&mut self, topic: usize, time_ns: u64, message: &[u8]) {
        if self.pace == Pace::Recorded {
            self.wait(time_ns);
        }
        self.channels[topic].log_with_meta(message, PartialMetadata::with_log_time(time_ns));
    }

    /// Waits until a message is due.
    fn wait(&mut self, time_ns: u64) {
        if self.last.is_none() {
            thread::sleep(GRACE);
        }
        if let Some((sent, last_ns)) = self.last {
            let apart_s = time_ns.saturating_sub(last_ns) as f64 * 1e-9;
            let due = sent + Duration::from_secs_f64(apart_s.min(WAIT_MAX_S));
            thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        if self.last.is_none_or(|(_, last_ns)| last_ns != time_ns) {
            self.last = Some((Instant::now(), time_ns));
        }
    }

    /// Closes the connections after giving the last messages time to be sent.
    pub fn finish(self) {
        thread::sleep(GRACE);
        self.server.stop().wait_blocking();
    }
}
