//! Image files: PNG to look at, PFM and EXR to keep every bit.
//!
//! Invariants: a file appears complete or not at all, since it is written under another name in
//! the same folder and then renamed; no reader panics on any bytes, and none allocates for a
//! picture larger than [`Film::new`](crate::Film::new) permits.

mod exr;
mod pfm;
mod png;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

pub use self::exr::{read_exr, write_exr};
pub use self::pfm::{PfmError, read_pfm, write_pfm};
pub use self::png::write_png;
use crate::film::FilmError;
use crate::image::Image;
use crate::tone::Display;

/// Endings of file names that [`write_image`] knows.
pub const KNOWN_EXTENSIONS: [&str; 3] = ["png", "exr", "pfm"];

/// Why an image file was not written or not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file or its folder is not accessible.
    #[error("{}: {source}", path.display())]
    Io {
        /// The image file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The ending of the name names no format that can be written.
    #[error("{}: the format is chosen by the ending, one of {KNOWN_EXTENSIONS:?}", path.display())]
    UnknownExtension {
        /// The image file.
        path: PathBuf,
    },
    /// The bytes are not a PFM picture.
    #[error("{}: {source}", path.display())]
    Pfm {
        /// The image file.
        path: PathBuf,
        /// What is wrong with them.
        source: PfmError,
    },
    /// The bytes are not an EXR picture with full-resolution channels R, G and B, or such a
    /// picture could not be encoded.
    #[error("{}: {source}", path.display())]
    Exr {
        /// The image file.
        path: PathBuf,
        /// What the codec said.
        source: ::exr::error::Error,
    },
    /// The picture could not be encoded as PNG.
    #[error("{}: {source}", path.display())]
    Png {
        /// The image file.
        path: PathBuf,
        /// What the codec said.
        source: ::image::ImageError,
    },
    /// The picture in the file is of a size that is not permitted.
    #[error("{}: {source}", path.display())]
    Size {
        /// The image file.
        path: PathBuf,
        /// Which limit is passed.
        source: FilmError,
    },
    /// Two layers of one file differ in size.
    #[error(
        "{}: standard error of {}x{} pixels for a picture of {}x{}",
        path.display(), standard_error[0], standard_error[1], colour[0], colour[1]
    )]
    LayerSizes {
        /// The image file.
        path: PathBuf,
        /// Width and height of the picture.
        colour: [u32; 2],
        /// Width and height of its standard error.
        standard_error: [u32; 2],
    },
}

/// Writes `image` in the format that the ending of `path` names, in upper or lower case: `png`
/// (as [`Display::default`] shows it), `exr` or `pfm`.
///
/// # Errors
///
/// [`ImageError::UnknownExtension`] for any other ending, otherwise as the writer of the format.
pub fn write_image(path: impl AsRef<Path>, image: &Image) -> Result<(), ImageError> {
    let path = path.as_ref();
    let extension = path.extension().map(|ending| ending.to_ascii_lowercase());
    match extension.as_ref().and_then(|ending| ending.to_str()) {
        Some("png") => write_png(path, image, &Display::default()),
        Some("exr") => write_exr(path, image, None),
        Some("pfm") => write_pfm(path, image),
        _ => Err(ImageError::UnknownExtension {
            path: path.to_owned(),
        }),
    }
}

/// All bytes of a file.
fn read_bytes(path: &Path) -> Result<Vec<u8>, ImageError> {
    fs::read(path).map_err(|source| ImageError::Io {
        path: path.to_owned(),
        source,
    })
}

/// Puts `bytes` at `path`, whole or not at all: whoever reads the file meanwhile, or after a loss
/// of power, finds the old content or the new one.
fn replace_file(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    static WRITES: AtomicU64 = AtomicU64::new(0);
    let write = WRITES.fetch_add(1, Ordering::Relaxed);
    // In the same folder, hence on the same file system: only there a rename is one step.
    let temporary = path.with_file_name(format!(".raywright-{}-{write}.tmp", process::id()));
    write_and_rename(&temporary, path, bytes).map_err(|source| ImageError::Io {
        path: path.to_owned(),
        source,
    })
}

fn write_and_rename(temporary: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(temporary)?;
    let renamed = file
        .write_all(bytes)
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(temporary, path));
    if renamed.is_err() {
        // Whether or not the remains can be removed, the first error is the one to report.
        let _ = fs::remove_file(temporary);
    }
    renamed
}
