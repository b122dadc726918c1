//! Messages to viewers that connect: the protocol of Foxglove, over a websocket.

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

/// The longest wait for the time of a message, s: where times of a recording jump, it goes on.
const WAIT_MAX_S: f64 = 1.0;
/// Before the first message, as a viewer asks for one topic after the other, and after the last
/// one, as closing drops what is still to be sent.
const GRACE: Duration = Duration::from_millis(200);

/// A server that plays messages at the pace of their times. What nobody sees is not sent.
pub(super) struct LiveServer {
    server: WebSocketServerHandle,
    /// What connects them: channels and server hold it weakly.
    _context: Arc<Context>,
    channels: Vec<Arc<RawChannel>>,
    pace: Pace,
    /// When the last message was sent, and its time, ns.
    last: Option<(Instant, u64)>,
}

impl LiveServer {
    /// Begins to listen. Fails where the address is not to be had.
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

    /// Whether a viewer has asked for a topic.
    pub fn is_watched(&self) -> bool {
        self.channels.iter().any(|channel| channel.has_sinks())
    }

    /// Sends a message of a topic when it is time for it.
    pub fn write(&mut self, topic: usize, time_ns: u64, message: &[u8]) {
        if self.pace == Pace::Recorded {
            self.wait(time_ns);
        }
        self.channels[topic].log_with_meta(message, PartialMetadata::with_log_time(time_ns));
    }

    /// Waits until it is time for a message.
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

    /// Closes the connections, after what was sent last.
    pub fn finish(self) {
        thread::sleep(GRACE);
        self.server.stop().wait_blocking();
    }
}
