//! Messages to an MCAP file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};

use super::Topic;
use crate::Error;
use crate::sink::atomic::Partial;

/// A file being written; it takes its name when it is finished.
pub(super) struct MessageFile {
    writer: Writer<BufWriter<File>>,
    partial: Partial,
    /// A channel for each topic.
    channels: Vec<u16>,
    sequence: u32,
}

impl MessageFile {
    /// Creates a file. Fails with the system's reason if it cannot be written.
    pub fn create(path: &Path, topics: &[Topic]) -> Result<MessageFile, Error> {
        let (partial, file) = Partial::create(path)?;
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("raywake ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4));
        let begin = || -> mcap::McapResult<_> {
            let mut writer = options.create(file)?;
            let mut channel = |(topic, schema): &Topic| {
                let text = schema.text();
                let schema = writer.add_schema(schema.name, "ros2msg", text.as_bytes())?;
                writer.add_channel(schema, topic, "cdr", &BTreeMap::new())
            };
            let channels = topics.iter().map(&mut channel).collect::<Result<_, _>>()?;
            Ok((writer, channels))
        };
        let (writer, channels) = begin().map_err(|e| because(&partial, e))?;
        Ok(MessageFile { writer, partial, channels, sequence: 0 })
    }

    /// Appends a message to a topic.
    pub fn write(&mut self, topic: usize, time_ns: u64, message: &[u8]) -> Result<(), Error> {
        let header = MessageHeader {
            channel_id: self.channels[topic],
            sequence: self.sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let written = self.writer.write_to_known_channel(&header, message);
        written.map_err(|e| because(&self.partial, e))
    }

    /// Completes the file.
    pub fn finish(mut self) -> Result<(), Error> {
        self.writer.finish().map_err(|e| because(&self.partial, e))?;
        self.partial.keep()
    }

    /// Keeps what has been written, without an index. Returns where it is.
    pub fn keep_incomplete(self) -> Result<PathBuf, Error> {
        // This tries to complete the file.
        drop(self.writer);
        self.partial.keep_incomplete()
    }
}

/// An error in writing a file, with the system's reason if it has one.
fn because(partial: &Partial, e: McapError) -> Error {
    match e {
        McapError::Io(e) => partial.error(e),
        e => partial.error(e),
    }
}
