//! Raw voxels with a description: a JSON file of the format `raywright-raw-1`, or [`RawLayout`].
//!
//! ```json
//! { "format": "raywright-raw-1", "file": "lung.raw.gz", "compression": "gzip", "type": "u8",
//!   "endian": "little", "dims": [256, 256, 133], "spacing": [1.4, 1.4, 2.5], "slope": 1,
//!   "intercept": 0, "origin": [0, 0, 0], "order": "x fastest", "bytes_uncompressed": 8716288 }
//! ```
//!
//! `format`, `file`, `type` and `dims` must be there, `endian` for types of several bytes; names
//! that are unknown are refused, since a later version may mean something by them.

use std::{io::Read, path::Path};

use glam::DVec3;
use serde::Deserialize;

use super::{
    Endian, Format, HeaderError, LoadError, LoadOptions, Loaded, Place, Placement, PlacementSource,
    VoxelType, Warning,
    error::quote,
    io_fault,
    layout::{Layout, Parts, assemble, data_fault},
    source::{Body, Folder, companion},
};
use crate::grid::Orientation;

/// Bytes of a description at most.
const MAX_DESCRIPTION: u64 = 1 << 20;

/// The description of raw voxels that come without any.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RawLayout {
    /// Voxels along x (fastest), y, z.
    pub dims: [u64; 3],
    /// The type of the numbers.
    pub voxel_type: VoxelType,
    /// The order of bytes; needed if a number has several.
    pub endian: Option<Endian>,
    /// Distances between voxels. Default 1.
    pub spacing: [f64; 3],
    /// Bytes before the first voxel, after decompression. Default 0.
    pub byte_skip: u64,
    /// Value = number · slope + intercept. Default 1.
    pub slope: f64,
    /// The value of the number 0. Default 0.
    pub intercept: f64,
}

impl RawLayout {
    /// A grid of `dims` numbers, 1 apart.
    #[must_use]
    pub fn new(dims: [u64; 3], voxel_type: VoxelType) -> Self {
        Self {
            dims,
            voxel_type,
            endian: None,
            spacing: [1.0; 3],
            byte_skip: 0,
            slope: 1.0,
            intercept: 0.0,
        }
    }

    /// The same with an order of bytes.
    #[must_use]
    pub fn with_endian(self, endian: Endian) -> Self {
        Self {
            endian: Some(endian),
            ..self
        }
    }

    /// The same with other distances.
    #[must_use]
    pub fn with_spacing(self, spacing: [f64; 3]) -> Self {
        Self { spacing, ..self }
    }

    /// The same with bytes before the first voxel.
    #[must_use]
    pub fn with_byte_skip(self, byte_skip: u64) -> Self {
        Self { byte_skip, ..self }
    }

    /// The same with another scaling.
    #[must_use]
    pub fn with_scale(self, slope: f64, intercept: f64) -> Self {
        Self {
            slope,
            intercept,
            ..self
        }
    }

    fn layout(&self) -> Layout {
        Layout {
            dims: self.dims,
            spacing: self.spacing,
            voxel_type: self.voxel_type,
            endian: self.endian,
            slope: self.slope,
            intercept: self.intercept,
            placements: Vec::new(),
        }
    }
}

/// The JSON file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    format: String,
    file: String,
    #[serde(default)]
    compression: Compression,
    #[serde(rename = "type")]
    voxel_type: String,
    endian: Option<Endian>,
    dims: [u64; 3],
    #[serde(default = "ones")]
    spacing: [f64; 3],
    origin: Option<[f64; 3]>,
    order: Option<String>,
    #[serde(default = "one")]
    slope: f64,
    #[serde(default)]
    intercept: f64,
    bytes_uncompressed: Option<u64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Compression {
    #[default]
    None,
    Gzip,
}

fn one() -> f64 {
    1.0
}

fn ones() -> [f64; 3] {
    [1.0; 3]
}

impl Description {
    fn parse(bytes: &[u8], max_voxels: u64) -> Result<(Self, Layout, Vec<Warning>), HeaderError> {
        let description: Self = serde_json::from_slice(bytes)?;
        let refused = |field, found: &str, expected| HeaderError::Value {
            place: Place::Nowhere,
            field,
            found: quote(found.as_bytes()),
            expected,
        };
        if description.format != "raywright-raw-1" {
            let found = &description.format;
            return Err(refused("format", found, "`raywright-raw-1`"));
        }
        if let Some(order) = description.order.as_ref().filter(|o| *o != "x fastest") {
            return Err(refused("order", order, "`x fastest`"));
        }
        let name = &description.voxel_type;
        let voxel_type = name.parse().map_err(|_| HeaderError::VoxelType {
            place: Place::Nowhere,
            name: quote(name.as_bytes()),
        })?;
        if description.dims.contains(&0) {
            return Err(refused("dims", "0", "sizes of at least 1"));
        }
        let mut warnings = Vec::new();
        let mut placements = Vec::new();
        if let Some(origin) = description.origin {
            let origin = DVec3::from_array(origin).as_vec3();
            if origin.is_finite() {
                placements.push(Placement {
                    source: PlacementSource::Description,
                    space: String::new(),
                    orientation: Orientation {
                        origin,
                        ..Orientation::default()
                    },
                });
            } else {
                let source = PlacementSource::Description;
                warnings.push(Warning::PlacementUnusable { source });
            }
        }
        let layout = Layout {
            dims: description.dims,
            spacing: description.spacing,
            voxel_type,
            endian: description.endian,
            slope: description.slope,
            intercept: description.intercept,
            placements,
        };
        let expected = layout.bytes(max_voxels)?;
        match description.bytes_uncompressed {
            Some(given) if given != expected => Err(HeaderError::Bytes { given, expected }),
            _ => Ok((description, layout, warnings)),
        }
    }
}

/// Loads voxels that a JSON file describes.
pub(super) fn load_json(
    folder: &dyn Folder,
    name: &Path,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let header = folder.shown(name);
    let header_fault = |source| LoadError::Header {
        path: header.clone(),
        source,
    };
    let stream = folder.open(name).map_err(io_fault(header.clone()))?;
    let mut bytes = Vec::new();
    let mut limited = stream.take(MAX_DESCRIPTION + 1);
    let read = limited.read_to_end(&mut bytes);
    read.map_err(io_fault(header.clone()))?;
    if bytes.len() as u64 > MAX_DESCRIPTION {
        return Err(header_fault(HeaderError::TooLong {
            line: 1,
            limit: MAX_DESCRIPTION as usize,
        }));
    }
    let parsed = Description::parse(&bytes, options.max_voxels);
    let (description, layout, warnings) = parsed.map_err(header_fault)?;
    let file = companion(name, &header, &description.file, options.companions)?;
    let data = folder.shown(&file);
    let stream = folder.open(&file).map_err(io_fault(data.clone()))?;
    let parts = Parts {
        format: Format::Raw,
        layout,
        header: &header,
        data: &data,
        body: match description.compression {
            Compression::None => Body::Plain(stream),
            Compression::Gzip => Body::gzip(stream),
        },
        warnings,
    };
    assemble(parts, options)
}

/// Loads voxels that the caller describes.
pub(super) fn load_described(
    folder: &dyn Folder,
    name: &Path,
    raw: &RawLayout,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let path = folder.shown(name);
    let layout = raw.layout();
    let bytes = layout.bytes(options.max_voxels);
    let bytes = bytes.map_err(|source| LoadError::Header {
        path: path.clone(),
        source,
    })?;
    let stream = folder.open(name).map_err(io_fault(path.clone()))?;
    let zipped = name
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let mut body = if zipped {
        Body::gzip(stream)
    } else {
        Body::Plain(stream)
    };
    let skipped = body.skip(raw.byte_skip);
    let skipped = skipped.map_err(|source| data_fault(&path, source))?;
    if skipped < raw.byte_skip {
        let expected = bytes.saturating_add(raw.byte_skip);
        let short = super::DataError::Short {
            expected,
            found: skipped,
        };
        return Err(data_fault(&path, short));
    }
    let parts = Parts {
        format: Format::Raw,
        layout,
        header: &path,
        data: &path,
        body,
        warnings: Vec::new(),
    };
    assemble(parts, options)
}
