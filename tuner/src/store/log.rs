//! One log file: reading it, and putting a new one into its place.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::entry::Entry;
use super::frame::{self, Damage, FORMAT_VERSION, Frame, Header, OVERHEAD_BYTES};
use super::{StoreError, WriterId};

/// A record in its file.
#[derive(Debug)]
#[non_exhaustive]
pub struct LogRecord {
    /// Of its first byte, from the beginning of the file.
    pub offset: u64,
    /// Its length in the file.
    pub bytes: u64,
    /// What it says, or its bytes if it does not say who wrote it.
    pub(crate) content: Result<Entry, Frame>,
}

impl LogRecord {
    /// What it says. `None` if its bytes are good but do not name a writer, a sequence number and
    /// a time; such a record is kept, and no more.
    pub fn entry(&self) -> Option<&Entry> {
        self.content.as_ref().ok()
    }

    /// Number of its kind.
    pub fn kind(&self) -> u32 {
        match &self.content {
            Ok(entry) => entry.kind(),
            Err(frame) => frame.kind,
        }
    }
}

/// The content of one log file.
#[derive(Debug)]
#[non_exhaustive]
pub struct LogFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its length.
    pub bytes: u64,
    /// Version in its header; `None` if the header is missing or damaged.
    pub version: Option<u32>,
    /// The good records in the order of the file.
    pub records: Vec<LogRecord>,
    /// Everything else, in the order of the file.
    pub damage: Vec<Damage>,
}

impl LogFile {
    /// Reads a file that may be damaged, and may be written to at this moment.
    ///
    /// # Errors
    ///
    /// If the file cannot be read or is of a later format version. Damage is no error.
    pub fn read(path: &Path) -> Result<LogFile, StoreError> {
        let bytes = fs::read(path).map_err(StoreError::io(path))?;
        LogFile::of_bytes(path, &bytes)
    }

    pub(crate) fn of_bytes(path: &Path, bytes: &[u8]) -> Result<LogFile, StoreError> {
        let version = match frame::read_header(bytes) {
            Header::Version(version) if version > FORMAT_VERSION => {
                return Err(StoreError::NewerVersion {
                    path: path.to_owned(),
                    version,
                    newest: FORMAT_VERSION,
                });
            }
            Header::Version(version) => Some(version),
            Header::Unfinished | Header::Damaged => None,
        };
        let scan = frame::scan(bytes);
        let records = scan.found.into_iter().map(|found| LogRecord {
            offset: found.range.start as u64,
            bytes: found.range.len() as u64,
            content: Entry::read(found.frame),
        });
        Ok(LogFile {
            path: path.to_owned(),
            bytes: bytes.len() as u64,
            version,
            records: records.collect(),
            damage: scan.damage,
        })
    }

    /// Like [`LogFile::of_bytes`], for somebody who is going to write to the file: refuses what is
    /// no log. A file whose creation was cut short is one: part of a header, or zeros, which some
    /// file systems leave after a loss of power.
    pub(crate) fn own(path: &Path, bytes: &[u8]) -> Result<LogFile, StoreError> {
        let log = LogFile::of_bytes(path, bytes)?;
        let is_unborn =
            frame::read_header(bytes) == Header::Unfinished || bytes.iter().all(|&byte| byte == 0);
        match log.has_nothing() && !is_unborn {
            true => Err(StoreError::NotALog {
                path: path.to_owned(),
            }),
            false => Ok(log),
        }
    }

    /// Whether the file has neither a good header nor a good record.
    pub(crate) fn has_nothing(&self) -> bool {
        self.version.is_none() && self.records.is_empty()
    }

    /// The entries in the order of the file.
    pub fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.records.iter().filter_map(LogRecord::entry)
    }

    /// Bytes behind the last good record.
    pub(crate) fn tail_bytes(&self) -> u64 {
        let last = self.damage.last();
        let tail = last.filter(|damage| damage.offset + damage.bytes == self.bytes);
        tail.map_or(0, |damage| damage.bytes)
    }

    /// The first number that a writer has certainly not used; `None` if all are used up. The tail
    /// may have held records that somebody has seen: as many as its bytes suffice for, since no
    /// record is shorter than what is around its payload.
    pub(crate) fn next_sequence(&self, writer: &WriterId) -> Option<u64> {
        let stamps = self.entries().map(Entry::stamp);
        let own = stamps.filter(|stamp| stamp.writer == *writer);
        let first = match own.map(|stamp| stamp.sequence).max() {
            Some(last) => last.checked_add(1)?,
            None => 0,
        };
        first.checked_add(self.tail_bytes() / OVERHEAD_BYTES as u64)
    }
}

/// The bytes of a log with these records.
pub(crate) fn bytes_of<'a>(frames: impl IntoIterator<Item = &'a Frame>) -> Vec<u8> {
    let mut bytes = frame::header().to_vec();
    for frame in frames {
        frame.write_to(&mut bytes);
    }
    bytes
}

/// Puts a file with content `bytes` at `path`: whoever opens it, before, while, or after a crash,
/// finds the old content or the new one. The caller holds the lock.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    let fresh = path.with_extension("log.new");
    let mut file = File::create(&fresh).map_err(StoreError::io(&fresh))?;
    file.write_all(bytes).map_err(StoreError::io(&fresh))?;
    file.sync_all().map_err(StoreError::io(&fresh))?;
    drop(file);
    fs::rename(&fresh, path).map_err(StoreError::io(path))?;
    sync_folder_of(path)
}

/// Makes a created or renamed file survive a loss of power.
pub(crate) fn sync_folder_of(path: &Path) -> Result<(), StoreError> {
    // Elsewhere a folder cannot be opened as a file, and its entries are written in order.
    if cfg!(unix)
        && let Some(folder) = path.parent()
    {
        let opened = File::open(folder).map_err(StoreError::io(folder))?;
        opened.sync_all().map_err(StoreError::io(folder))?;
    }
    Ok(())
}
