//! A folder of logs, one per writer, read as one set of records.
//!
//! Invariants: reading needs no lock and changes nothing; what changes files takes the locks of
//! all of them first, and either has them all or does nothing; a file is replaced whole, by
//! writing a new one, forcing it to the disk, and renaming it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::body::{Body, Note};
use super::entry::Entry;
use super::lock::Lock;
use super::log::{self, LogFile};
use super::report::FileReport;
use super::{MachineId, Records, Stamp, StoreError, SyncPolicy, Writer, WriterId};

/// Who gets the imported records that do not say who wrote them.
const NOBODY: &str = "unstamped";

/// A folder of logs.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// What a store holds, and the state of its files.
#[derive(Debug)]
#[non_exhaustive]
pub struct Contents {
    /// The records of all files.
    pub records: Records,
    /// The files, damage included.
    pub files: Vec<FileReport>,
    /// Files of a later format version, which were not read.
    pub newer: Vec<PathBuf>,
}

/// What a change of files did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Changed {
    /// Files that were replaced.
    pub files: usize,
    /// Bytes of those files before.
    pub bytes_before: u64,
    /// Bytes of those files after.
    pub bytes_after: u64,
    /// Records that were removed, by [`Store::prune`] only.
    pub removed: usize,
}

impl Store {
    /// The store in `folder`, which is created if there is none.
    ///
    /// # Errors
    ///
    /// If it cannot be created.
    pub fn open(folder: impl Into<PathBuf>) -> Result<Store, StoreError> {
        let folder = folder.into();
        fs::create_dir_all(&folder).map_err(StoreError::io(&folder))?;
        Ok(Store { folder })
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The log of a writer, whether it exists or not.
    pub fn log_of(&self, writer: &WriterId) -> PathBuf {
        self.folder.join(format!("{writer}.log"))
    }

    /// Opens the log of a writer to append to it. A damaged tail is cut off.
    ///
    /// # Errors
    ///
    /// If the log is in use, of a later version, or no log at all; if the system refuses.
    pub fn writer(&self, id: &WriterId, policy: SyncPolicy) -> Result<Writer, StoreError> {
        Writer::open(self.log_of(id), id.clone(), policy)
    }

    /// Reads all logs, also while others write. A record that is not written whole is not seen.
    ///
    /// # Errors
    ///
    /// If the system refuses. Neither damage nor a file of a later version is an error.
    pub fn read(&self) -> Result<Contents, StoreError> {
        let mut contents = Contents {
            records: Records::default(),
            files: Vec::new(),
            newer: Vec::new(),
        };
        for path in self.logs()? {
            match LogFile::read(&path) {
                Ok(log) => {
                    contents.files.push(FileReport::of(&log));
                    contents.records.add(log);
                }
                Err(StoreError::NewerVersion { path, .. }) => contents.newer.push(path),
                Err(error) => return Err(error),
            }
        }
        Ok(contents)
    }

    /// Takes over all records of `others`, into one log per writer. Doing it again changes no file.
    ///
    /// # Errors
    ///
    /// If a log to be changed is in use or of a later version; if the system refuses.
    pub fn import(&self, others: &Records) -> Result<Changed, StoreError> {
        let (by_writer, unstamped) = others.by_writer();
        let mut incoming = Vec::new();
        for (writer, records) in by_writer {
            incoming.push((self.log_of(writer), records));
        }
        if !unstamped.is_empty() {
            let path = self.log_of(&WriterId::new(NOBODY)?);
            match incoming.iter_mut().find(|(known, _)| *known == path) {
                Some((_, records)) => *records = records.clone().merge(unstamped),
                None => incoming.push((path, unstamped)),
            }
        }
        let locks = lock_all(incoming.iter().map(|(path, _)| path))?;
        let mut changed = Changed::default();
        for (path, records) in incoming {
            let before = read_if_there(&path)?;
            let log = LogFile::own(&path, &before)?;
            // A damaged tail stays for the next writer, who must know which numbers it held.
            let tail = match log.has_nothing() {
                true => 0,
                false => log.tail_bytes() as usize,
            };
            let tail = before[before.len() - tail..].to_vec();
            let mut held = Records::default();
            held.add(log);
            let merged = held.clone().merge(records);
            if merged.frames().ne(held.frames()) {
                changed.replace(&path, &before, &merged, &tail)?;
            }
        }
        drop(locks);
        Ok(changed)
    }

    /// Rewrites every log without damage and repetitions, in the order of the sequence numbers.
    /// Good records stay as they are, byte for byte, known or not. Where a damaged tail goes, a
    /// note of `time` stays.
    ///
    /// # Errors
    ///
    /// If a log is in use; if the system refuses; if `time` is not finite. Files of a later version
    /// are left alone.
    pub fn compact(&self, time: f64) -> Result<Changed, StoreError> {
        let logs = self.logs()?;
        let locks = lock_all(&logs)?;
        let changed = rewrite(&logs, time, |_| false);
        drop(locks);
        changed
    }

    /// Removes the description, the trials and the outcomes of a machine (not of its aliases), and
    /// leaves a note of `time` in each log that had some. A merge with a copy that still has the
    /// records brings them back.
    ///
    /// # Errors
    ///
    /// If a log is in use; if the system refuses; if `time` is not finite. Files of a later version
    /// are left alone.
    pub fn prune(&self, machine: &MachineId, time: f64) -> Result<Changed, StoreError> {
        let logs = self.logs()?;
        let locks = lock_all(&logs)?;
        // Outcomes name their trial, which may be in another log.
        let all = self.read()?.records;
        let changed = rewrite(&logs, time, |entry| match entry.body() {
            Body::Machine(described) => described.id == *machine,
            Body::TrialOpen(open) => open.machine == *machine,
            Body::Outcome(outcome) => match all.get(&outcome.trial).map(Entry::body) {
                Some(Body::TrialOpen(open)) => open.machine == *machine,
                _ => false,
            },
            _ => false,
        });
        drop(locks);
        changed
    }

    /// The logs in the folder, sorted.
    fn logs(&self) -> Result<Vec<PathBuf>, StoreError> {
        let mut logs = Vec::new();
        let items = fs::read_dir(&self.folder).map_err(StoreError::io(&self.folder))?;
        for item in items {
            let path = item.map_err(StoreError::io(&self.folder))?.path();
            if path.extension().is_some_and(|extension| extension == "log") && path.is_file() {
                logs.push(path);
            }
        }
        logs.sort();
        Ok(logs)
    }
}

impl Changed {
    /// Puts `records` and `tail` into the file at `path`, unless that is what it holds.
    fn replace(
        &mut self,
        path: &Path,
        before: &[u8],
        records: &Records,
        tail: &[u8],
    ) -> Result<(), StoreError> {
        let mut after = log::bytes_of(records.frames());
        after.extend(tail);
        if after != before {
            log::replace(path, &after)?;
            self.files += 1;
            self.bytes_before += before.len() as u64;
            self.bytes_after += after.len() as u64;
        }
        Ok(())
    }
}

/// Rewrites the logs without the records that are to be removed. The caller holds the locks.
///
/// Where records or a damaged tail go, a note keeps their numbers from being used again.
fn rewrite(
    logs: &[PathBuf],
    time: f64,
    mut is_removed: impl FnMut(&Entry) -> bool,
) -> Result<Changed, StoreError> {
    if !time.is_finite() {
        let name = "time".to_owned();
        return Err(StoreError::NotFinite { name, value: time });
    }
    let mut changed = Changed::default();
    for path in logs {
        let before = fs::read(path).map_err(StoreError::io(path))?;
        let log = match LogFile::of_bytes(path, &before) {
            Ok(log) => log,
            Err(StoreError::NewerVersion { .. }) => continue,
            Err(error) => return Err(error),
        };
        // What has no header and no record is somebody else's file, or one being created.
        if log.has_nothing() {
            continue;
        }
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let writer = stem.and_then(|stem| WriterId::new(stem).ok());
        let next = writer.and_then(|writer| {
            let sequence = log.next_sequence(&writer)?;
            Some(Stamp { writer, sequence })
        });
        let tail = log.tail_bytes();
        let mut records = Records::default();
        records.add(log);
        let held = records.len();
        records.retain(|entry| !is_removed(entry));
        let removed = held - records.len();
        if let Some(stamp) = next
            && (removed > 0 || tail > 0)
        {
            let text = format!("removed {removed} records and {tail} damaged bytes at the end");
            records.insert(Entry::new(stamp, time, Note::new(&text).into())?);
        }
        changed.replace(path, &before, &records, &[])?;
        changed.removed += removed;
    }
    Ok(changed)
}

fn lock_all<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<Vec<Lock>, StoreError> {
    paths.into_iter().map(|path| Lock::take(path)).collect()
}

fn read_if_there(path: &Path) -> Result<Vec<u8>, StoreError> {
    match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        read => read.map_err(StoreError::io(path)),
    }
}
