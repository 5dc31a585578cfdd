//! Volume files: bytes in, [`Volume`] and warnings out.
//!
//! Idea: each format is a parser of a header, which gives the same few numbers; what is around them
//! is shared: files and gzip, conversion of voxels, limits, the rule for companion files.
//!
//! Invariants: no input makes a loader panic; every refusal is a [`LoadError`] with the file and,
//! where there is one, the line or byte; whatever was replaced or lost in an accepted file is a
//! [`Warning`]; nothing that a header says makes memory be asked for before a file of that size, or
//! so much decompressed data, has been seen; the same bytes always give the same volume.
//!
//! Formats: NRRD (attached and detached headers, raw and gzip), NIfTI-1 and NIfTI-2 (single files
//! and pairs, plain or gzipped), raw voxels with a description in JSON or in [`RawLayout`].
//!
//! The readers are our own. There is no crate for NRRD alone; the crate `nifti` reads NIfTI-1 only
//! and takes the memory that a header asks for before it looks at the file.

mod decode;
mod error;
mod layout;
mod nifti;
mod nrrd;
mod raw;
mod source;
mod voxel_type;
mod warning;

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

pub use error::{DataError, HeaderError, LoadError, Place};
pub use raw::RawLayout;
pub use voxel_type::{Endian, UnknownName, VoxelType};
pub use warning::Warning;

use self::source::{Disk, Folder};
use crate::grid::{Orientation, Volume};

/// The file name endings that [`load_volume`] knows; compared without regard to case. `.raw` needs
/// [`LoadOptions::raw`].
pub const KNOWN_ENDINGS: &[&str] = &[
    ".nrrd", ".nhdr", ".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz", ".json", ".raw",
    ".raw.gz",
];

/// A volume as read from a file, and what is to know about the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The volume.
    pub volume: Volume,
    /// What was replaced or lost.
    pub warnings: Vec<Warning>,
    /// How the file stores it.
    pub source: SourceFacts,
}

/// How a file stores a volume.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SourceFacts {
    /// The format.
    pub format: Format,
    /// The type of its numbers.
    pub voxel_type: VoxelType,
    /// The order of bytes, where a number has several.
    pub endian: Option<Endian>,
    /// Whether the voxels are compressed.
    pub compressed: bool,
    /// Bytes of the voxels without compression.
    pub data_bytes: u64,
    /// Where the file places the grid in space: the one that is used, then others.
    pub placements: Vec<Placement>,
}

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// NRRD.
    Nrrd,
    /// NIfTI-1.
    Nifti1,
    /// NIfTI-2.
    Nifti2,
    /// Raw voxels.
    Raw,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Nrrd => "NRRD",
            Self::Nifti1 => "NIfTI-1",
            Self::Nifti2 => "NIfTI-2",
            Self::Raw => "raw",
        })
    }
}

/// The part of a file that places the grid in space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PlacementSource {
    /// Directions and origin of an NRRD header.
    SpaceDirections,
    /// The quaternion of a NIfTI header.
    Qform,
    /// The matrix of a NIfTI header.
    Sform,
    /// The origin in a JSON description.
    Description,
}

impl fmt::Display for PlacementSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SpaceDirections => "the space directions",
            Self::Qform => "the qform",
            Self::Sform => "the sform",
            Self::Description => "the description",
        })
    }
}

/// A place of the grid in space.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Placement {
    /// Which part of the file says so.
    pub source: PlacementSource,
    /// The name of the space, as the format calls it; empty if it has none.
    pub space: String,
    /// Axes and origin in that space.
    pub orientation: Orientation,
}

/// Where a header may say that its voxels are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompanionFiles {
    /// In the folder of the header or below.
    #[default]
    BelowFolder,
    /// Anywhere: for headers that are trusted.
    Anywhere,
}

/// What becomes of voxels without a value (NaN).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MissingValues {
    /// They stay NaN, and what touches them is transparent.
    #[default]
    Transparent,
    /// They get this value.
    Fill(f32),
}

/// How to load.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LoadOptions {
    /// Voxels at most. Default 2^36.
    pub max_voxels: u64,
    /// Where the voxels of a detached header may be.
    pub companions: CompanionFiles,
    /// What becomes of NaN.
    pub missing: MissingValues,
    /// The description of raw voxels, where no file has it.
    pub raw: Option<RawLayout>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            max_voxels: 1 << 36,
            companions: CompanionFiles::default(),
            missing: MissingValues::default(),
            raw: None,
        }
    }
}

impl LoadOptions {
    /// The same with another number of voxels at most.
    #[must_use]
    pub fn with_max_voxels(self, max_voxels: u64) -> Self {
        Self { max_voxels, ..self }
    }

    /// The same with another rule for companion files.
    #[must_use]
    pub fn with_companions(self, companions: CompanionFiles) -> Self {
        Self { companions, ..self }
    }

    /// The same with another fate of missing values.
    #[must_use]
    pub fn with_missing(self, missing: MissingValues) -> Self {
        Self { missing, ..self }
    }

    /// The same with a description of raw voxels; a file of any name is read by it.
    #[must_use]
    pub fn with_raw(self, raw: RawLayout) -> Self {
        Self {
            raw: Some(raw),
            ..self
        }
    }
}

/// Loads the volume file at `path`; its name chooses the format.
///
/// ```no_run
/// use raywright_volume::load::{LoadOptions, load_volume};
///
/// let loaded = load_volume("head.nii.gz".as_ref(), &LoadOptions::default())?;
/// for warning in &loaded.warnings {
///     eprintln!("{warning}");
/// }
/// # Ok::<(), raywright_volume::load::LoadError>(())
/// ```
///
/// # Errors
/// See [`LoadError`].
pub fn load_volume(path: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    match path.file_name() {
        Some(name) => load(&Disk(folder), Path::new(name), options),
        None => Err(LoadError::UnknownFormat { path: path.into() }),
    }
}

/// Loads a volume from files in memory, as [`load_volume`] does from a folder with these files.
///
/// # Errors
/// See [`LoadError`].
pub fn read_volume(
    files: &BTreeMap<String, Vec<u8>>,
    name: &str,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    load(files, Path::new(name), options)
}

fn load(folder: &dyn Folder, name: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let lower = name.to_string_lossy().to_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| lower.ends_with(ending));
    if let Some(raw) = &options.raw {
        raw::load_described(folder, name, raw, options)
    } else if ends(&[".nrrd", ".nhdr"]) {
        nrrd::load(folder, name, options)
    } else if ends(&[".nii", ".nii.gz", ".hdr", ".hdr.gz", ".img", ".img.gz"]) {
        nifti::load(folder, name, options)
    } else if ends(&[".json"]) {
        raw::load_json(folder, name, options)
    } else if ends(&[".raw", ".raw.gz"]) {
        Err(LoadError::NotDescribed {
            path: folder.shown(name),
        })
    } else {
        Err(LoadError::UnknownFormat {
            path: folder.shown(name),
        })
    }
}

/// What the system says of a file.
fn io_fault(path: PathBuf) -> impl FnOnce(std::io::Error) -> LoadError {
    move |source| LoadError::Io { path, source }
}
