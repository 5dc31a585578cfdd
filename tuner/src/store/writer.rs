//! Appending to the log of one writer.
//!
//! Invariants: [`Writer::append`] returns after the operating system has taken the whole record;
//! sequence numbers only increase, also over damage and restarts; nobody else writes to the file
//! as long as the writer lives.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use super::body::Body;
use super::entry::Entry;
use super::frame::{self, Damage, OVERHEAD_BYTES};
use super::lock::Lock;
use super::log::{LogFile, sync_folder_of};
use super::{Stamp, StoreError, WriterId};

/// When records are forced from the caches of the operating system to the disk. A crash of the
/// program alone loses nothing in either case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SyncPolicy {
    /// Before [`Writer::append`] returns.
    EachRecord,
    /// After every so many records, and when the writer is closed.
    Every(NonZeroU32),
    /// When the writer is closed.
    #[default]
    OnClose,
}

/// The one who appends to a log.
#[derive(Debug)]
pub struct Writer {
    id: WriterId,
    path: PathBuf,
    file: File,
    policy: SyncPolicy,
    recovered: Vec<Damage>,
    /// End of the last whole record.
    end: u64,
    /// Whether something may lie behind `end`.
    torn: bool,
    next_sequence: Option<u64>,
    unsynced: u32,
    // Declared last, so that it is given back after the file is closed.
    _lock: Lock,
}

impl Writer {
    /// Opens the log at `path`, or creates it, and cuts off a damaged tail.
    pub(crate) fn open(
        path: PathBuf,
        id: WriterId,
        policy: SyncPolicy,
    ) -> Result<Writer, StoreError> {
        let lock = Lock::take(&path)?;
        let mut options = OpenOptions::new();
        let opened = options.read(true).write(true).create(true).truncate(false);
        let mut file = opened.open(&path).map_err(StoreError::io(&path))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)
            .map_err(StoreError::io(&path))?;
        let log = LogFile::own(&path, &bytes)?;
        let is_new = log.has_nothing();
        let tail_bytes = log.tail_bytes();
        let next_sequence = log.next_sequence(&id);
        let mut writer = Writer {
            id,
            file,
            policy,
            recovered: log.damage,
            end: log.bytes - tail_bytes,
            torn: tail_bytes > 0,
            next_sequence,
            unsynced: 0,
            _lock: lock,
            path,
        };
        if is_new {
            writer.end = 0;
            writer.torn = true;
            writer.write(&frame::header())?;
            writer.sync()?;
            sync_folder_of(&writer.path)?;
        } else {
            writer.cut()?;
        }
        Ok(writer)
    }

    /// Who writes.
    pub fn id(&self) -> &WriterId {
        &self.id
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The damage that was found when the log was opened. If the last of it reached the end of the
    /// file, it has been cut off.
    pub fn recovered(&self) -> &[Damage] {
        &self.recovered
    }

    /// Appends a record; it was written at `time`, seconds since 1970-01-01 00:00 UTC. When this
    /// returns, the record survives the end of the program; whether it survives a loss of power is
    /// a matter of the [`SyncPolicy`].
    ///
    /// # Errors
    ///
    /// For numbers that are not finite, costs below 0, records that are too long or would not be
    /// read back equal: nothing is written. If the operating system refuses: the record may or may
    /// not be there, and the writer can be used on.
    pub fn append(&mut self, time: f64, body: impl Into<Body>) -> Result<Stamp, StoreError> {
        let exhausted = || StoreError::SequenceExhausted {
            writer: self.id.clone(),
        };
        let stamp = Stamp {
            writer: self.id.clone(),
            sequence: self.next_sequence.ok_or_else(exhausted)?,
        };
        let entry = Entry::new(stamp.clone(), time, body.into())?;
        let mut bytes = Vec::with_capacity(entry.frame().payload.len() + OVERHEAD_BYTES);
        entry.frame().write_to(&mut bytes);
        // Even if writing fails a reader may have seen the record, so its number is used up.
        self.next_sequence = stamp.sequence.checked_add(1);
        self.write(&bytes)?;
        self.unsynced = self.unsynced.saturating_add(1);
        let due = match self.policy {
            SyncPolicy::EachRecord => true,
            SyncPolicy::Every(records) => self.unsynced >= records.get(),
            SyncPolicy::OnClose => false,
        };
        if due {
            self.sync()?;
        }
        Ok(stamp)
    }

    /// Forces everything that was appended to the disk.
    ///
    /// # Errors
    ///
    /// If the operating system refuses.
    pub fn sync(&mut self) -> Result<(), StoreError> {
        self.file.sync_data().map_err(StoreError::io(&self.path))?;
        self.unsynced = 0;
        Ok(())
    }

    /// Forces everything to the disk and lets others write. Dropping the writer does the same, but
    /// cannot say what went wrong.
    ///
    /// # Errors
    ///
    /// If the operating system refuses.
    pub fn close(mut self) -> Result<(), StoreError> {
        self.sync()
    }

    /// Writes `bytes` behind the last whole record.
    fn write(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        if self.torn {
            self.cut()?;
        }
        // Until all of it is written, what lies behind `end` is to be cut off.
        self.torn = true;
        if let Err(source) = self.file.write_all(bytes) {
            // A full disk takes part of a record. If it cannot be cut off now, then before the
            // next one; if that never happens, readers skip it.
            let _ = self.cut();
            return Err(StoreError::io(&self.path)(source));
        }
        self.torn = false;
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// Cuts off what lies behind the last whole record, and goes there.
    fn cut(&mut self) -> Result<(), StoreError> {
        let cut = match self.torn {
            true => self.file.set_len(self.end),
            false => Ok(()),
        };
        let there = cut.and_then(|()| self.file.seek(SeekFrom::Start(self.end)));
        there.map_err(StoreError::io(&self.path))?;
        self.torn = false;
        Ok(())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if self.unsynced > 0 {
            // There is nobody to tell; `close` is for those who want to know.
            let _ = self.sync();
        }
    }
}
