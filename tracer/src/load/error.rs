//! Why a scene file was refused: what was wrong, and where.
//!
//! Two layers: [`ParseError`] is what a parser can find in bytes; [`LoadError`] adds the path and
//! what can go wrong before a parser sees them.

use std::io;
use std::path::PathBuf;

use super::KNOWN_ENDINGS;

/// Why [`load_scene`](super::load_scene) gave no scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file could not be read.
    #[error("cannot read {}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The name does not end as any of [`KNOWN_ENDINGS`].
    #[error("{}: unknown scene format; known endings are {}", path.display(), KNOWN_ENDINGS.join(", "))]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// A compressed file ends before its data does.
    #[error("{}: the gzip data ends too early; the file is incomplete", path.display())]
    TruncatedGzip {
        /// The file.
        path: PathBuf,
    },
    /// A compressed file is damaged, is no gzip file, or is followed by something else.
    #[error("{}: not valid gzip data", path.display())]
    Gzip {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        source: io::Error,
    },
    /// More bytes, after decompression, than the limit.
    #[error("{}: larger than the limit of {limit} bytes", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit in bytes.
        limit: u64,
    },
    /// The text was read and refused.
    #[error("{}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// What was wrong, and in which line.
        source: ParseError,
    },
}

/// What a parser refused. Lines count from 1; a statement that is continued over several lines is
/// known by its first.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParseError {
    /// A statement cannot be read.
    #[error("line {line}: {fault}")]
    Syntax {
        /// The line.
        line: usize,
        /// What is wrong with it.
        fault: SyntaxFault,
    },
    /// A face uses index 0; indices count from 1, or from -1 backwards.
    #[error("line {line}: {kind} index 0; indices count from 1")]
    ZeroIndex {
        /// The line.
        line: usize,
        /// Which list the index is for.
        kind: IndexKind,
    },
    /// A face uses an element that is not there, or not yet.
    #[error("line {line}: {kind} index {index}, but the lines before define {count}")]
    IndexOutOfRange {
        /// The line.
        line: usize,
        /// Which list the index is for.
        kind: IndexKind,
        /// The index as written.
        index: i64,
        /// How many elements the list has at this line.
        count: usize,
    },
    /// Not one face in the file.
    #[error("no faces in the file")]
    NoFaces,
    /// There are faces, but every triangle was dropped.
    #[error(
        "no triangle can be used: {degenerate} of zero area, {non_finite} with coordinates that are \
         not finite"
    )]
    NoUsableTriangles {
        /// Triangles of zero area.
        degenerate: usize,
        /// Triangles with a corner that is not finite.
        non_finite: usize,
    },
    /// More triangles than the limit.
    #[error("line {line}: more than the limit of {limit} triangles")]
    TooManyTriangles {
        /// The line with the first triangle too many.
        line: usize,
        /// The limit.
        limit: usize,
    },
}

/// What is wrong with a statement. Tokens are shortened to 60 characters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SyntaxFault {
    /// A number was expected.
    #[error("`{token}` is not a number")]
    NotANumber {
        /// What is there.
        token: String,
    },
    /// A face corner was expected: `a`, `a/b`, `a//c` or `a/b/c`.
    #[error("`{token}` is not a face corner (a, a/b, a//c or a/b/c with whole numbers)")]
    NotACorner {
        /// What is there.
        token: String,
    },
    /// A vertex has too few numbers, or as many as no known form has.
    #[error("`{keyword}` with {count} numbers; allowed are {allowed}")]
    NumberCount {
        /// The statement.
        keyword: &'static str,
        /// How many numbers it has.
        count: usize,
        /// How many it may have.
        allowed: &'static str,
    },
    /// A face needs three corners.
    #[error("face with {count} corners; at least 3 are needed")]
    TooFewCorners {
        /// How many it has.
        count: usize,
    },
}

/// The list that a face index refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexKind {
    /// `v`
    Position,
    /// `vt`
    TextureCoordinate,
    /// `vn`
    Normal,
}

impl std::fmt::Display for IndexKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Position => "vertex",
            Self::TextureCoordinate => "texture coordinate",
            Self::Normal => "normal",
        })
    }
}

/// The longest piece of a file that an error or a warning quotes.
const EXCERPT_CHARS: usize = 60;

/// The beginning of `token` as text: a line without an end must not become a message without one.
pub(super) fn excerpt(token: &[u8]) -> String {
    // Four bytes are the most that a UTF-8 character takes.
    let head = &token[..token.len().min(4 * EXCERPT_CHARS)];
    let text = String::from_utf8_lossy(head);
    if head.len() < token.len() || text.chars().count() > EXCERPT_CHARS {
        text.chars().take(EXCERPT_CHARS - 1).chain(['…']).collect()
    } else {
        text.into_owned()
    }
}
