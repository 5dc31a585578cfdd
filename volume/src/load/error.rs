//! Why a file gave no volume: what was wrong, and where.
//!
//! Three layers: [`HeaderError`] is what a description can get wrong, [`DataError`] what the voxels
//! behind it can; [`LoadError`] adds the path and what can go wrong before either is seen.

use std::{fmt, io, path::PathBuf};

use super::{KNOWN_ENDINGS, VoxelType};
use crate::grid::GridError;

/// Why [`load_volume`](super::load_volume) gave no volume.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A file could not be read.
    #[error("cannot read {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The name does not end as any of [`KNOWN_ENDINGS`].
    #[error("{}: unknown volume format; known endings are {}", path.display(), KNOWN_ENDINGS.join(", "))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Bytes without any description.
    #[error("{}: raw voxels need a description: their dimensions and their type", path.display())]
    NotDescribed {
        /// The file.
        path: PathBuf,
    },
    /// A header names a file that lies elsewhere.
    #[error("{}: its voxels are in `{name}`, which is not below the folder of the header", path.display())]
    OutsideFolder {
        /// The header.
        path: PathBuf,
        /// The file it names, shortened.
        name: String,
    },
    /// The description was read and refused.
    #[error("{}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// What was wrong.
        source: HeaderError,
    },
    /// The voxels do not fit their description.
    #[error("{}", path.display())]
    Data {
        /// The file with the voxels.
        path: PathBuf,
        /// What was wrong.
        source: DataError,
    },
    /// The numbers of the description make no grid.
    #[error("{}", path.display())]
    Grid {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: GridError,
    },
}

/// A place in a header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line, from 1.
    Line(usize),
    /// A byte, from 0.
    Byte(usize),
    /// There is none: options, or a value of a JSON object.
    Nowhere,
}

impl fmt::Display for Place {
    /// With a colon and a blank behind it, where there is a place.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}: "),
            Self::Byte(byte) => write!(f, "byte {byte}: "),
            Self::Nowhere => Ok(()),
        }
    }
}

/// What was refused in a description. Quotations are shortened to 60 characters.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeaderError {
    /// It does not begin as the format says.
    #[error("not a {format} file: it begins with `{found}`")]
    Magic {
        /// The format that the name promises.
        format: &'static str,
        /// What is there.
        found: String,
    },
    /// The header ends too early.
    #[error("the header ends after {found} bytes; {expected} are needed")]
    Truncated {
        /// Bytes needed.
        expected: usize,
        /// Bytes found.
        found: usize,
    },
    /// The file ends before the empty line that ends the header.
    #[error("line {line}: the file ends before the empty line that ends the header")]
    NoEnd {
        /// The last line.
        line: usize,
    },
    /// A line, or the header as a whole, is too long.
    #[error("line {line}: more than {limit} bytes without an end")]
    TooLong {
        /// The line.
        line: usize,
        /// The limit.
        limit: usize,
    },
    /// A field that must be there is not.
    #[error("the field `{field}` is missing")]
    Missing {
        /// Its name.
        field: &'static str,
    },
    /// A field is given twice.
    #[error("line {line}: `{field}` is given again, first in line {first}")]
    Duplicate {
        /// The second line.
        line: usize,
        /// The first line.
        first: usize,
        /// Its name.
        field: &'static str,
    },
    /// A line is no field, key and value, or comment.
    #[error("line {line}: `{found}` is no field (name: value)")]
    NoField {
        /// The line.
        line: usize,
        /// What is there.
        found: String,
    },
    /// A value cannot be used.
    #[error("{place}`{field}` is `{found}`; {expected} expected")]
    Value {
        /// Where.
        place: Place,
        /// The field.
        field: &'static str,
        /// What is there.
        found: String,
        /// What could be.
        expected: &'static str,
    },
    /// A type that is not supported, or a value that is no single number.
    #[error(
        "{place}voxels of type {name} are not supported; supported are single numbers: u8, i8, u16, i16, u32, i32, f32, f64"
    )]
    VoxelType {
        /// Where.
        place: Place,
        /// The type, by its name in the format.
        name: String,
    },
    /// Another number of axes.
    #[error("{place}the grid has {found}, but 3 axes are supported (further ones of size 1)")]
    Axes {
        /// Where.
        place: Place,
        /// Its axes.
        found: String,
    },
    /// A way of storing voxels that is not supported.
    #[error("{place}{what} is not supported; {supported}")]
    Unsupported {
        /// Where.
        place: Place,
        /// What.
        what: String,
        /// What is.
        supported: &'static str,
    },
    /// Nothing says which byte of a number comes first.
    #[error(
        "the order of the bytes is not given, which {voxel_type} needs (`endian`: little or big)"
    )]
    NoEndian {
        /// The type.
        voxel_type: VoxelType,
    },
    /// More voxels than permitted.
    #[error("{} x {} x {} voxels are more than the limit of {limit}", dims[0], dims[1], dims[2])]
    TooManyVoxels {
        /// The sizes.
        dims: [u64; 3],
        /// The limit.
        limit: u64,
    },
    /// Two descriptions of the number of bytes differ.
    #[error("{given} bytes are announced, but dimensions and type make {expected}")]
    Bytes {
        /// What is written.
        given: u64,
        /// What follows.
        expected: u64,
    },
    /// The text is not JSON, or not of the right form.
    #[error("line {line}, column {column}: {message}")]
    Json {
        /// The line, from 1.
        line: usize,
        /// The column, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
}

impl From<serde_json::Error> for HeaderError {
    fn from(error: serde_json::Error) -> Self {
        let text = error.to_string();
        // The place has fields of its own.
        let message = text.split(" at line ").next().unwrap_or(&text);
        Self::Json {
            line: error.line(),
            column: error.column(),
            message: excerpt(message.as_bytes(), 200),
        }
    }
}

/// What was wrong with the voxels themselves.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// There are fewer bytes than the header says.
    #[error(
        "{expected} bytes of voxels are needed, {found} are there; the file is incomplete, or its header wrong"
    )]
    Short {
        /// Bytes needed.
        expected: u64,
        /// Bytes found.
        found: u64,
    },
    /// Compressed data end before their end.
    #[error("the gzip data end too early; the file is incomplete")]
    TruncatedGzip,
    /// Compressed data are damaged, or are no gzip data.
    #[error("not valid gzip data")]
    Gzip {
        /// What the decoder said.
        source: io::Error,
    },
    /// The system gives no memory for the volume.
    #[error("no memory for {bytes} bytes")]
    OutOfMemory {
        /// How much was asked for.
        bytes: u64,
    },
    /// More is to be skipped than the limit.
    #[error("more than the limit of {limit} bytes after decompression")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// The file could not be read.
    #[error("cannot be read")]
    Io {
        /// What the operating system said.
        source: io::Error,
    },
}

/// The longest piece of a file that an error or a warning quotes, in characters.
pub(super) const EXCERPT_CHARS: usize = 60;

/// The beginning of `bytes` as text: a line without an end must not become a message without one.
pub(super) fn excerpt(bytes: &[u8], chars: usize) -> String {
    // Four bytes are the most that a UTF-8 character takes.
    let head = &bytes[..bytes.len().min(4 * chars)];
    let text = String::from_utf8_lossy(head);
    let printable = text.chars().map(|c| if c.is_control() { '·' } else { c });
    if head.len() < bytes.len() || text.chars().count() > chars {
        printable.take(chars - 1).chain(['…']).collect()
    } else {
        printable.collect()
    }
}

/// [`excerpt`] of the usual length.
pub(super) fn quote(bytes: &[u8]) -> String {
    excerpt(bytes, EXCERPT_CHARS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotations_are_short_and_printable() {
        assert_eq!(quote(b"a\tb\0"), "a·b·");
        assert_eq!(quote(&[0xff; 1 << 20]).chars().count(), EXCERPT_CHARS);
        assert_eq!(quote(&[b'x'; 60]), "x".repeat(60));
    }

    #[test]
    fn places_are_told() {
        let error = |place| HeaderError::Value {
            place,
            field: "dim",
            found: "-1".into(),
            expected: "a size",
        };
        assert_eq!(
            error(Place::Byte(42)).to_string(),
            "byte 42: `dim` is `-1`; a size expected"
        );
        assert_eq!(
            error(Place::Nowhere).to_string(),
            "`dim` is `-1`; a size expected"
        );
    }
}
