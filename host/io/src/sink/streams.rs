//! Where messages go, and what they contain.

use std::net::SocketAddr;
use std::path::PathBuf;

/// Where messages go: to a file, to viewers, to both or nowhere.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StreamTargets {
    /// An MCAP file.
    pub mcap: Option<PathBuf>,
    /// Address of this machine to which viewers connect.
    pub live: Option<SocketAddr>,
    /// When messages are sent to viewers.
    pub pace: Pace,
}

impl StreamTargets {
    /// Whether messages go nowhere.
    pub fn is_empty(&self) -> bool {
        self.mcap.is_none() && self.live.is_none()
    }
}

/// When messages are sent to viewers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// At their times, as stamped in the recording.
    #[default]
    Recorded,
    /// Immediately.
    AtOnce,
}

/// What the messages of a stream contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The flow of every sweep.
    Flow,
    /// The flow of every sweep and the objects in it.
    FlowAndObjects,
    /// The objects in every sweep, and the returns of each.
    Objects,
    /// The returns of every sweep.
    Clouds,
}
