//! Where messages go, and what they are of.

use std::net::SocketAddr;
use std::path::PathBuf;

/// Where messages go: to a file, to viewers, to both or nowhere.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StreamTargets {
    /// An MCAP file.
    pub mcap: Option<PathBuf>,
    /// Address of this machine at which viewers connect.
    pub live: Option<SocketAddr>,
    /// When viewers are sent a message.
    pub pace: Pace,
}

impl StreamTargets {
    /// Whether they go nowhere.
    pub fn is_empty(&self) -> bool {
        self.mcap.is_none() && self.live.is_none()
    }
}

/// When viewers are sent a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// When it is time for it, as the stamps of a recording have it.
    #[default]
    Recorded,
    /// At once.
    AtOnce,
}

/// What the messages of a stream are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// The flow of every sweep.
    Flow,
    /// The flow of every sweep and the objects in it.
    FlowAndObjects,
    /// The objects in every sweep, and whose returns are which.
    Objects,
    /// The returns of every sweep.
    Clouds,
}
