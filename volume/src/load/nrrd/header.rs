//! What an NRRD header means.
//!
//! Distances between voxels are the lengths of `space directions` where there are any, otherwise
//! `spacings`, otherwise 1. The definition wants `dimension` before fields that are per axis; any
//! order is accepted.

use glam::DVec3;

use super::{
    super::{
        HeaderError, Place, Placement, PlacementSource, Warning,
        error::quote,
        layout::{Layout, direction as unit},
        voxel_type::Endian,
    },
    lines::{Field, Lines},
};
use crate::grid::Orientation;

/// Axes that the definition permits.
const MAX_AXES: usize = 16;

/// How voxels are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Raw,
    Gzip,
}

/// A header.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) layout: Layout,
    pub(super) encoding: Encoding,
    /// The file with the voxels, if it is another.
    pub(super) data_file: Option<String>,
    pub(super) line_skip: u64,
    /// `None`: the voxels are the last bytes.
    pub(super) byte_skip: Option<u64>,
    pub(super) warnings: Vec<Warning>,
}

impl Header {
    pub(super) fn parse(lines: &Lines) -> Result<Self, HeaderError> {
        let required = |name| {
            lines
                .field(name)
                .ok_or(HeaderError::Missing { field: name })
        };
        let mut warnings = Vec::new();
        if let Some((count, line, example)) = lines.unknown.clone() {
            warnings.push(Warning::UnknownFields {
                count,
                line,
                example,
            });
        }
        let (axes, dims) = sizes(required("dimension")?, required("sizes")?)?;
        if let Some(kinds) = lines.field("kinds") {
            check_kinds(kinds)?;
        }
        let voxel_type = required("type")?.voxel_type()?;
        let encoding = encoding(required("encoding")?)?;
        let endian = lines.field("endian").map(endian).transpose()?;
        if endian.is_none() && voxel_type.bytes() > 1 {
            return Err(HeaderError::NoEndian { voxel_type });
        }
        let byte_skip = match lines.field("byte skip") {
            None => Some(0),
            Some(field) => match field.number::<i64>(BYTE_SKIP)? {
                -1 => None,
                skip => Some(skip.try_into().map_err(|_| field.refused(BYTE_SKIP))?),
            },
        };
        let (spacing, placements) = space(lines, axes, &mut warnings)?;
        Ok(Self {
            layout: Layout {
                dims,
                spacing,
                voxel_type,
                endian,
                slope: 1.0,
                intercept: 0.0,
                placements,
            },
            encoding,
            data_file: lines.field("data file").map(data_file).transpose()?,
            line_skip: match lines.field("line skip") {
                None => 0,
                Some(field) => field.number("a number of lines")?,
            },
            byte_skip,
            warnings,
        })
    }
}

const BYTE_SKIP: &str = "a number of bytes, or -1,";

/// The number of axes, and the sizes of three.
fn sizes(dimension: &Field, sizes: &Field) -> Result<(usize, [u64; 3]), HeaderError> {
    const AXES: &str = "a number of axes from 1 to 16";
    let axes: usize = dimension.number(AXES)?;
    if !(1..=MAX_AXES).contains(&axes) {
        return Err(dimension.refused(AXES));
    }
    const SIZES: &str = "a size of at least 1 for each axis";
    let all: Vec<u64> = sizes.numbers(axes, SIZES)?;
    if all.contains(&0) {
        return Err(sizes.refused(SIZES));
    }
    match all[..] {
        [x, y, z, ref others @ ..] if others.iter().all(|&size| size == 1) => Ok((axes, [x, y, z])),
        _ => Err(HeaderError::Axes {
            place: Place::Line(sizes.line),
            found: format!("sizes {}", quote(&sizes.value)),
        }),
    }
}

/// Refuses axes along which the numbers of one value lie.
fn check_kinds(kinds: &Field) -> Result<(), HeaderError> {
    const PLAIN: [&str; 5] = ["domain", "space", "time", "none", "???"];
    let lower = kinds.lower();
    let first = lower.split_ascii_whitespace().take(3);
    match first.into_iter().find(|kind| !PLAIN.contains(kind)) {
        None => Ok(()),
        Some(kind) => Err(HeaderError::VoxelType {
            place: Place::Line(kinds.line),
            name: quote(kind.as_bytes()),
        }),
    }
}

fn encoding(field: &Field) -> Result<Encoding, HeaderError> {
    match field.lower().as_str() {
        "raw" => Ok(Encoding::Raw),
        "gz" | "gzip" => Ok(Encoding::Gzip),
        _ => Err(HeaderError::Unsupported {
            place: Place::Line(field.line),
            what: format!("the encoding `{}`", quote(&field.value)),
            supported: "supported are raw and gzip",
        }),
    }
}

fn endian(field: &Field) -> Result<Endian, HeaderError> {
    let endian = field.lower().parse();
    endian.map_err(|_| field.refused("little or big"))
}

/// The name of the one file; lists of files are refused.
fn data_file(field: &Field) -> Result<String, HeaderError> {
    let text = str::from_utf8(&field.value).map_err(|_| field.refused("a file name in UTF-8"))?;
    if text.is_empty() {
        return Err(field.refused("a file name"));
    }
    let mut words = text.split_ascii_whitespace();
    let first = words.next().unwrap_or("");
    // As Teem decides: several words of which the first is a format for numbers.
    let several = first == "LIST" || (first.contains('%') && words.next().is_some());
    if several {
        return Err(HeaderError::Unsupported {
            place: Place::Line(field.line),
            what: format!("a volume in several files (`{}`)", quote(&field.value)),
            supported: "join them to one file",
        });
    }
    Ok(text.into())
}

/// Distances between voxels and the place of the grid.
fn space(
    lines: &Lines,
    axes: usize,
    warnings: &mut Vec<Warning>,
) -> Result<([f64; 3], Vec<Placement>), HeaderError> {
    let mut spacing = [1.0; 3];
    if let Some(field) = lines.field("spacings") {
        let all: Vec<f64> = field.numbers(axes, "a number for each axis")?;
        spacing.copy_from_slice(&all[..3]);
    }
    let origin = match lines.field("space origin") {
        None => Some(DVec3::ZERO),
        Some(field) => match &field.vectors(1)?[..] {
            [Some(origin)] => three(origin),
            _ => return Err(field.refused("one vector")),
        },
    };
    let mut directions = Some([DVec3::X, DVec3::Y, DVec3::Z]);
    if let Some(field) = lines.field("space directions") {
        let all = field.vectors(MAX_AXES)?;
        if all.len() != axes {
            return Err(field.refused("a vector or `none` for each axis"));
        }
        let mut given = [None; 3];
        for axis in 0..3 {
            let Some(direction) = &all[axis] else {
                continue;
            };
            spacing[axis] = direction.iter().map(|c| c * c).sum::<f64>().sqrt();
            let direction = three(direction).and_then(unit);
            given[axis] = direction;
        }
        directions = match given {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        };
    } else if lines.field("space origin").is_none() {
        return Ok((spacing, Vec::new()));
    }
    let (Some(axes), Some(origin)) = (directions, origin) else {
        let source = PlacementSource::SpaceDirections;
        warnings.push(Warning::PlacementUnusable { source });
        return Ok((spacing, Vec::new()));
    };
    let space = lines.field("space").map(Field::lower);
    let placement = Placement {
        source: PlacementSource::SpaceDirections,
        space: quote(space.unwrap_or_default().as_bytes()),
        orientation: Orientation {
            axes: axes.map(|axis| axis.as_vec3()),
            origin: origin.as_vec3(),
        },
    };
    Ok((spacing, vec![placement]))
}

/// A vector of three numbers that single precision can hold.
fn three(numbers: &[f64]) -> Option<DVec3> {
    match *numbers {
        [x, y, z] => Some(DVec3::new(x, y, z)).filter(|v| v.as_vec3().is_finite()),
        _ => None,
    }
}
