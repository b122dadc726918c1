//! MCAP files: a sequence of records, most of them in chunks. They are read in pieces, never whole.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::parse_record;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::Error;
use crate::source::decoder::guarded;
use crate::source::whole::{self, unpacked_max};

/// Maximum length of a record, bytes; a chunk may be longer, as it is read in pieces.
const RECORD_MAX: u64 = 256 << 20;

/// The first bytes of a file.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Bytes before the content of a record: its kind and length.
const HEAD: u64 = 9;

/// Where a message is in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    /// First byte of the record itself, or of the chunk that contains it.
    pub record: u64,
    /// Number of records before it there.
    pub before: u32,
}

/// Maximum number of bytes read at once.
const PIECE: usize = 1 << 20;

/// An open file.
pub(super) struct BagFile {
    pub path: PathBuf,
    file: File,
    /// Its length, bytes.
    length: u64,
    /// Bytes of the records that the current call has read.
    unpacked: u64,
    open: Option<OpenRecord>,
}

/// A record of the file being read: the record itself, or those in it.
struct OpenRecord {
    reader: LinearReader,
    /// Place of the next record in it.
    next: Place,
    /// Bytes of it that have not been read from the file.
    left: u64,
}

/// How a walk through a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileEnd {
    Whole,
    /// Cut off in the record that begins at this byte.
    Cut(u64),
}

impl BagFile {
    /// Opens a file. Fails if it cannot be read or is not an MCAP file.
    pub fn open(path: &Path) -> Result<BagFile, Error> {
        let (mut file, length) = whole::open(path)?;
        let mut magic = [0; MAGIC.len()];
        let read = file.read_exact(&mut magic);
        if read.is_err() || magic != MAGIC {
            return Err(Error::input(path, "byte 0", "not an MCAP file"));
        }
        Ok(BagFile { path: path.to_path_buf(), file, length, unpacked: 0, open: None })
    }

    /// Passes every schema, channel and message to `each`, in file order.
    ///
    /// Fails if the file cannot be read or is damaged; a file that is cut off is read up to that
    /// point.
    pub fn walk(
        &mut self,
        mut each: impl FnMut(Place, Record) -> Result<(), Error>,
    ) -> Result<FileEnd, Error> {
        self.unpacked = 0;
        let mut at = MAGIC.len() as u64;
        while at < self.length {
            let Some((kind, length)) = self.head(at)? else { return Ok(FileEnd::Cut(at)) };
            match kind {
                op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK => {
                    self.begin(at, length)?;
                    while let Some((place, record)) = self.next()? {
                        each(place, record)?;
                    }
                }
                op::DATA_END | op::FOOTER => return Ok(FileEnd::Whole),
                _ => {}
            }
            let next = at.saturating_add(HEAD).saturating_add(length);
            if next > self.length {
                return Ok(FileEnd::Cut(at));
            }
            at = next;
        }
        Ok(FileEnd::Cut(self.length))
    }

    /// Bytes of the message at a place. Fast if it follows the one read before.
    pub fn message(&mut self, wanted: Place) -> Result<Vec<u8>, Error> {
        self.unpacked = 0;
        let gone = "the message that was here is gone: has the file changed?";
        let follows = |open: &OpenRecord| {
            open.next.record == wanted.record && open.next.before <= wanted.before
        };
        if !self.open.as_ref().is_some_and(follows) {
            let head = self.head(wanted.record)?;
            let (_, length) = head.ok_or_else(|| self.wrong(wanted.record, gone))?;
            self.begin(wanted.record, length)?;
        }
        while let Some((place, record)) = self.next()? {
            match record {
                Record::Message { data, .. } if place == wanted => return Ok(data.into_owned()),
                _ => {}
            }
        }
        Err(self.wrong(wanted.record, gone))
    }

    /// Kind and length of the record at a byte; `None` if the file ends in its head.
    fn head(&mut self, at: u64) -> Result<Option<(u8, u64)>, Error> {
        let mut head = [0; HEAD as usize];
        if at + HEAD > self.length {
            return Ok(None);
        }
        let read =
            self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut head));
        read.map_err(Error::reading(&self.path))?;
        let [kind, length @ ..] = head;
        Ok(Some((kind, u64::from_le_bytes(length))))
    }

    /// Starts reading the record at a byte, whose content has this length.
    fn begin(&mut self, record: u64, length: u64) -> Result<(), Error> {
        self.file.seek(SeekFrom::Start(record)).map_err(Error::reading(&self.path))?;
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(unpacked_max(self.length).min(RECORD_MAX) as usize);
        let reader = LinearReader::new_with_options(options);
        let left = HEAD.saturating_add(length);
        self.open = Some(OpenRecord { reader, next: Place { record, before: 0 }, left });
        Ok(())
    }

    /// The next record in the open one; `None` after its end, and if the file is cut off in it.
    fn next(&mut self) -> Result<Option<(Place, Record<'static>)>, Error> {
        let most = unpacked_max(self.length);
        let Some(OpenRecord { reader, next, left }) = &mut self.open else { return Ok(None) };
        let damaged =
            |what: String| Error::input(&self.path, format!("byte {}", next.record), what);
        while let Some(event) = guarded(&self.path, || reader.next_event())? {
            match event.map_err(|e| damaged(e.to_string()))? {
                LinearReadEvent::Record { data, opcode } => {
                    let place = *next;
                    next.before += 1;
                    self.unpacked += HEAD + data.len() as u64;
                    if self.unpacked > most {
                        return Err(damaged(format!("unpacks to more than {most} bytes")));
                    }
                    if [op::SCHEMA, op::CHANNEL, op::MESSAGE].contains(&opcode) {
                        let record = parse_record(opcode, data);
                        let record = record.map_err(|e| damaged(e.to_string()))?;
                        return Ok(Some((place, record.into_owned())));
                    }
                }
                LinearReadEvent::ReadRequest(wanted) => {
                    let wanted = wanted.min(PIECE).min(usize::try_from(*left).unwrap_or(PIECE));
                    let read = self.file.read(reader.insert(wanted));
                    let read = read.map_err(Error::reading(&self.path))?;
                    if read == 0 && *left > 0 {
                        break;
                    }
                    // Zero bytes tell the reader that the record has ended.
                    reader.notify_read(read);
                    *left -= read as u64;
                }
            }
        }
        self.open = None;
        Ok(None)
    }

    fn wrong(&self, at: u64, what: impl Into<String>) -> Error {
        Error::input(&self.path, format!("byte {at}"), what)
    }
}
