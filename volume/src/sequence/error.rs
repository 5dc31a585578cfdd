//! Why there is no sequence.

use std::{io, path::PathBuf};

use raywright_imaging::CameraError;

/// Why there is no sequence, or no moment in it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// The file could not be read or written.
    #[error("cannot access {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// More bytes than any sequence has.
    #[error("{}: larger than the limit of {limit} bytes", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit.
        limit: u64,
    },
    /// The text is not JSON of the right form, or a transfer function in it is none.
    #[error("no sequence")]
    Json(#[from] serde_json::Error),
    /// The format is another.
    #[error("the format is `{format}`, not `{}`", super::FORMAT)]
    Format {
        /// The format.
        format: String,
    },
    /// A number has no meaning.
    #[error("{name} is {value}, allowed is {allowed}")]
    OutOfRange {
        /// Which number.
        name: &'static str,
        /// The number.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A list that needs a key has none.
    #[error("`{list}` has no key")]
    NoKey {
        /// The list.
        list: &'static str,
    },
    /// The time of a key is not within the sequence.
    #[error("`{list}`, key {index}: its time {t} is not within 0 to {duration_s} seconds")]
    KeyTime {
        /// The list.
        list: &'static str,
        /// The number of the key, from 0.
        index: usize,
        /// Its time.
        t: f64,
        /// The end of the sequence.
        duration_s: f64,
    },
    /// The keys of a list do not ascend in time.
    #[error("`{list}`, key {index}: its time {t} is below {previous} of the key before")]
    NotSorted {
        /// The list.
        list: &'static str,
        /// The number of the key, from 0.
        index: usize,
        /// Its time.
        t: f64,
        /// The time before.
        previous: f64,
    },
    /// A key of a list has a number without meaning.
    #[error("`{list}`, key {index}: {name} is {value}, allowed is {allowed}")]
    Key {
        /// The list.
        list: &'static str,
        /// The number of the key, from 0.
        index: usize,
        /// Which number.
        name: &'static str,
        /// The number.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A key of the camera describes no view.
    #[error("`camera`, key {index}")]
    Camera {
        /// The number of the key, from 0.
        index: usize,
        /// Why not.
        source: CameraError,
    },
    /// Between two keys the camera describes no view.
    #[error("no view at {time} seconds")]
    NoView {
        /// The time.
        time: f64,
        /// Why not.
        source: CameraError,
    },
    /// A time is not a number.
    #[error("a time of {time} seconds: it must be a number")]
    Time {
        /// The time.
        time: f64,
    },
}
