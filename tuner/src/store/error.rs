//! What can go wrong with a store. Damaged bytes are no error: see [`Damage`](super::Damage).

use std::io;
use std::path::{Path, PathBuf};

use super::WriterId;

/// Why something could not be stored or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// A writer, in this process or another one, has the log open.
    #[error("{} is in use by another writer", path.display())]
    InUse {
        /// The log.
        path: PathBuf,
    },
    /// The file is of a later format version than this program knows.
    #[error("{}: format version {version} is newer than {newest}", path.display())]
    NewerVersion {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: u32,
        /// The newest known version.
        newest: u32,
    },
    /// The file is no log: neither its header nor any record of it is good. It is left alone.
    #[error("{} is not a log of the store", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
    },
    /// A writer id is the name of a file.
    #[error("{id:?} cannot be a writer id: 1 to 64 of a-z, 0-9, '-' and '_'")]
    BadWriterId {
        /// What was given.
        id: String,
    },
    /// JSON has no word for infinite numbers and NaN.
    #[error("{name} must be finite, not {value}")]
    NotFinite {
        /// Which number.
        name: String,
        /// Its value.
        value: f64,
    },
    /// A cost must be finite and at least 0.
    #[error("a cost must be finite and at least 0, not {cost}")]
    BadCost {
        /// The refused cost.
        cost: f64,
    },
    /// The record would not be read back as it is: an additional field has the name of a regular
    /// one, or the JSON is nested too deeply.
    #[error("the record would not be read back as it is")]
    NotRepresentable,
    /// The record is too long.
    #[error("a record of {bytes} bytes is longer than {max}")]
    TooLong {
        /// Bytes of its payload.
        bytes: usize,
        /// How many there may be.
        max: usize,
    },
    /// The writer has used up its sequence numbers.
    #[error("writer {writer} has no sequence number left")]
    SequenceExhausted {
        /// The writer.
        writer: WriterId,
    },
}

impl StoreError {
    /// Gives an error of the operating system its file.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> StoreError {
        let path = path.to_owned();
        move |source| StoreError::Io { path, source }
    }
}
