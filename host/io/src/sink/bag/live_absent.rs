//! Stand-in for [`LiveServer`] in builds without viewers; never constructed.

use std::net::SocketAddr;

use super::super::streams::Pace;
use super::Topic;
use crate::Error;

/// A server that cannot exist.
pub(super) enum NoServer {}

pub(super) use NoServer as LiveServer;

impl NoServer {
    /// Fails with [`Error::Unsupported`].
    pub fn start(_: SocketAddr, _: Pace, _: &[Topic]) -> Result<NoServer, Error> {
        Err(Error::missing_feature("--live", "live"))
    }

    /// Never called.
    pub fn has_viewer(&self) -> bool {
        match *self {}
    }

    /// Never called.
    pub fn write(&mut self, _: usize, _: u64, _: &[u8]) {
        match *self {}
    }

    /// Never called.
    pub fn finish(self) {
        match self {}
    }
}
