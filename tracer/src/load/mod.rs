//! Scene files: bytes in, [`Scene`] and counted warnings out.
//!
//! Idea: each format is one parser that works on a byte slice, asks for other files through a
//! function it is given, and reads no clock and no disk itself; this file holds what is around
//! them: the choice by file name, the disk, gzip, size limits, and the rule for companion files.
//!
//! Invariants: no input makes a loader panic; every refusal is a [`LoadError`] with the file and,
//! where one exists, the line; whatever was left out of an accepted file is a [`Warning`] with a
//! count; the same bytes always give the same scene.
//!
//! Formats: Wavefront OBJ with MTL, plain or gzipped.

mod error;
mod groups;
mod index;
mod mtl;
mod number;
mod obj;
mod polygon;
mod text;
mod warning;

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Component, Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

pub use error::{IndexKind, LoadError, ParseError, SyntaxFault};
pub use obj::read_obj;
pub use warning::{Warning, WarningKind};

use crate::scene::Scene;

/// The file name endings that [`load_scene`] knows; compared without regard to case.
pub const KNOWN_ENDINGS: &[&str] = &[".obj", ".obj.gz"];

/// A scene as read from a file, and what was left out of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene. Formats without cameras and lights leave those empty.
    pub scene: Scene,
    /// What was left out or changed, at most one value per [`WarningKind`], in the order of that
    /// enum.
    pub warnings: Vec<Warning>,
}

/// What a file may cost at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// Bytes of the scene file after decompression, and again of all its material libraries
    /// together; libraries beyond that count as missing. Default 4 GiB.
    pub max_bytes: u64,
    /// Triangles of the scene. Default 2^28, half of what a tree can number.
    pub max_triangles: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_bytes: 4 << 30,
            max_triangles: 1 << 28,
        }
    }
}

impl Limits {
    /// The same limits with another number of bytes.
    #[must_use]
    pub fn with_max_bytes(self, max_bytes: u64) -> Self {
        Self { max_bytes, ..self }
    }

    /// The same limits with another number of triangles.
    #[must_use]
    pub fn with_max_triangles(self, max_triangles: usize) -> Self {
        Self {
            max_triangles,
            ..self
        }
    }
}

/// Loads the scene file at `path` within the default [`Limits`]; its name chooses the format.
///
/// # Errors
/// See [`LoadError`].
pub fn load_scene(path: &Path) -> Result<Loaded, LoadError> {
    load_scene_within(path, &Limits::default())
}

/// [`load_scene`] with other limits.
///
/// # Errors
/// See [`LoadError`].
pub fn load_scene_within(path: &Path, limits: &Limits) -> Result<Loaded, LoadError> {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    let bytes = if name.ends_with(".obj") {
        read_plain(path, limits.max_bytes)?
    } else if name.ends_with(".obj.gz") {
        read_gzip(path, limits.max_bytes)?
    } else {
        return Err(LoadError::UnknownFormat { path: path.into() });
    };

    let folder = path.parent().unwrap_or(Path::new(""));
    let mut resolve = |name: &str| read_companion(folder, name, limits.max_bytes);
    let (mut loaded, textures) =
        obj::parse(&bytes, &mut resolve, limits).map_err(|source| LoadError::Parse {
            path: path.into(),
            source,
        })?;
    obj::report_textures(&mut loaded, &textures, |name| {
        companion(folder, name).is_some()
    });
    Ok(loaded)
}

fn read_plain(path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
    let io_error = |source| LoadError::Io {
        path: path.into(),
        source,
    };
    let file = File::open(path).map_err(io_error)?;
    read_limited(file, limit)
        .map_err(io_error)?
        .ok_or_else(|| LoadError::TooLarge {
            path: path.into(),
            limit,
        })
}

fn read_gzip(path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
    let io_error = |source| LoadError::Io {
        path: path.into(),
        source,
    };
    let mut file = BufReader::with_capacity(1 << 16, File::open(path).map_err(io_error)?);
    // What the disk says is told apart from what the decoder says by reading a byte first: a
    // folder or an unreadable file is no gzip error.
    file.fill_buf().map_err(io_error)?;
    match read_limited(MultiGzDecoder::new(file), limit) {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(LoadError::TooLarge {
            path: path.into(),
            limit,
        }),
        Err(source) if source.kind() == io::ErrorKind::UnexpectedEof => {
            Err(LoadError::TruncatedGzip { path: path.into() })
        }
        Err(source) => Err(LoadError::Gzip {
            path: path.into(),
            source,
        }),
    }
}

/// Everything in `source`, or `None` if that is more than `limit` bytes. At most one byte beyond
/// the limit is read, so that a small file that unpacks to terabytes ends here.
fn read_limited(source: impl Read, limit: u64) -> io::Result<Option<Vec<u8>>> {
    let mut bytes = Vec::new();
    source
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    Ok((bytes.len() as u64 <= limit).then_some(bytes))
}

fn read_companion(folder: &Path, name: &str, limit: u64) -> io::Result<Vec<u8>> {
    let path = companion(folder, name).ok_or(io::ErrorKind::NotFound)?;
    read_limited(File::open(path)?, limit)?.ok_or_else(|| io::ErrorKind::FileTooLarge.into())
}

/// The regular file that `name` in a scene file means, if there is one.
///
/// Windows separators are accepted. A scene file is not trusted to name a file outside its own
/// folder: of absolute names and names with `..`, and of names that lead to no file, only the last
/// part is used. That also finds the libraries of exporters that write the author's full path.
fn companion(folder: &Path, name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let whole = Path::new(&name);
    let stays_inside = whole
        .components()
        .all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    let last = whole.file_name().map(Path::new);
    [Some(whole).filter(|_| stays_inside), last]
        .into_iter()
        .flatten()
        .map(|relative| folder.join(relative))
        .find(|path| fs::metadata(path).is_ok_and(|found| found.is_file()))
}
