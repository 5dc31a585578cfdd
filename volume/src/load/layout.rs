//! What every format comes down to: sizes, spacing, type, scaling, place, and a stream of bytes.

use std::path::Path;

use glam::DVec3;

use super::{
    DataError, Endian, Format, HeaderError, LoadError, LoadOptions, Loaded, MissingValues,
    Placement, SourceFacts, VoxelType, Warning, decode::decode, source::Body,
};
use crate::grid::{ValueScale, Volume, Voxels};

/// The description of a volume.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) dims: [u64; 3],
    pub(super) spacing: [f64; 3],
    pub(super) voxel_type: VoxelType,
    /// `None` where the header does not say.
    pub(super) endian: Option<Endian>,
    pub(super) slope: f64,
    pub(super) intercept: f64,
    /// The first is used.
    pub(super) placements: Vec<Placement>,
}

/// What goes together from all formats to a volume.
pub(super) struct Parts<'a> {
    pub(super) format: Format,
    pub(super) layout: Layout,
    /// The header, for messages.
    pub(super) header: &'a Path,
    /// The file with the voxels, for messages.
    pub(super) data: &'a Path,
    pub(super) body: Body<'a>,
    pub(super) warnings: Vec<Warning>,
}

impl Layout {
    /// The number of voxels, if it is permitted.
    pub(super) fn voxels(&self, limit: u64) -> Result<u64, HeaderError> {
        let dims = self.dims;
        let count = dims.iter().try_fold(1_u64, |n, &size| n.checked_mul(size));
        // Bytes in memory must be countable too.
        let permitted = limit.min(isize::MAX as u64 / 8);
        match count {
            Some(count) if count <= permitted => Ok(count),
            _ => Err(HeaderError::TooManyVoxels { dims, limit }),
        }
    }

    /// Bytes of the voxels as the file stores them.
    pub(super) fn bytes(&self, limit: u64) -> Result<u64, HeaderError> {
        Ok(self.voxels(limit)? * self.voxel_type.bytes())
    }

    /// The order of bytes, which only a type of several bytes needs.
    pub(super) fn order(&self) -> Result<Endian, HeaderError> {
        match self.endian {
            Some(endian) => Ok(endian),
            None if self.voxel_type.bytes() == 1 => Ok(Endian::Little),
            None => Err(HeaderError::NoEndian {
                voxel_type: self.voxel_type,
            }),
        }
    }
}

/// Reads the voxels and makes the volume.
pub(super) fn assemble(parts: Parts<'_>, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let Parts {
        format,
        layout,
        header,
        data,
        mut body,
        mut warnings,
    } = parts;
    let header_fault = |source| LoadError::Header {
        path: header.into(),
        source,
    };
    let limit = options.max_voxels;
    let count = layout.voxels(limit).map_err(header_fault)?;
    let data_bytes = layout.bytes(limit).map_err(header_fault)?;
    let endian = layout.order().map_err(header_fault)?;
    let spacing = usable_spacing(layout.spacing, &mut warnings);
    let compressed = matches!(body, Body::Gzip(_));
    let decoded = decode(&mut body, count, layout.voxel_type, endian, &mut warnings);
    let decoded = decoded.map_err(|source| LoadError::Data {
        path: data.into(),
        source,
    })?;
    let scale = usable_scale(
        layout.slope,
        layout.intercept,
        decoded.offset,
        &mut warnings,
    );
    let mut voxels = decoded.voxels;
    if let (MissingValues::Fill(value), Voxels::F32(values)) = (options.missing, &mut voxels) {
        let raw = (value - scale.intercept) / scale.slope;
        for voxel in values.iter_mut().filter(|voxel| voxel.is_nan()) {
            *voxel = raw;
        }
    }
    // Their product fits, and none is 0, so that each of them does.
    let dims = layout.dims.map(|size| size as usize);
    let volume = Volume::new(dims, spacing, voxels, scale).map_err(|source| LoadError::Grid {
        path: header.into(),
        source,
    })?;
    if volume.missing() > 0 {
        warnings.push(Warning::Missing {
            count: volume.missing(),
        });
    }
    // Those that only became infinite in single precision have been told.
    let told = warnings.iter().find_map(|warning| match warning {
        Warning::TooLarge { count } => Some(*count),
        _ => None,
    });
    let infinite = volume.clamped().saturating_sub(told.unwrap_or(0));
    if infinite > 0 {
        warnings.push(Warning::Infinite { count: infinite });
    }
    let orientation = layout.placements.first().map(|first| first.orientation);
    Ok(Loaded {
        volume: volume.with_orientation(orientation.unwrap_or_default()),
        warnings,
        source: SourceFacts {
            format,
            voxel_type: layout.voxel_type,
            endian: (layout.voxel_type.bytes() > 1).then_some(endian),
            compressed,
            data_bytes,
            placements: layout.placements,
        },
    })
}

/// Distances without sign; 1 for those that are none.
pub(super) fn usable_spacing(spacing: [f64; 3], warnings: &mut Vec<Warning>) -> [f32; 3] {
    /// Beyond these the corner of a large grid, or the square of a length, leaves single precision.
    const USABLE: std::ops::RangeInclusive<f64> = 1e-15..=1e15;
    std::array::from_fn(|axis| {
        let given = spacing[axis];
        if USABLE.contains(&given.abs()) {
            given.abs() as f32
        } else {
            warnings.push(Warning::Spacing { axis, given });
            1.0
        }
    })
}

/// The direction of a vector of any length but 0: scaled first, since the square of a tiny or huge
/// length has lost its digits or left the range.
pub(super) fn direction(vector: DVec3) -> Option<DVec3> {
    let largest = vector.abs().max_element();
    let usable = largest > 0.0 && vector.is_finite();
    usable.then(|| (vector / largest).normalize())
}

/// The scaling of raw values, none if that of the file is none: a slope of 0 means so in NIfTI, and
/// NaN or infinite ones occur.
fn usable_scale(
    slope: f64,
    intercept: f64,
    offset: f64,
    warnings: &mut Vec<Warning>,
) -> ValueScale {
    let of = |slope: f64, intercept: f64| ValueScale {
        slope: slope as f32,
        intercept: (intercept + offset * slope) as f32,
    };
    if slope == 0.0 {
        return of(1.0, 0.0);
    }
    let scale = of(slope, intercept);
    if scale.slope != 0.0 && scale.slope.is_finite() && scale.intercept.is_finite() {
        return scale;
    }
    warnings.push(Warning::ScaleIgnored { slope, intercept });
    of(1.0, 0.0)
}

/// A stream error of a header file.
pub(super) fn data_fault(path: &Path, source: DataError) -> LoadError {
    LoadError::Data {
        path: path.into(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spacings() {
        let mut warnings = Vec::new();
        let used = usable_spacing([-2.0, 0.0, f64::NAN], &mut warnings);
        assert_eq!((used, warnings.len()), ([2.0, 1.0, 1.0], 2));
        let used = usable_spacing([f64::INFINITY, 1e300, 1e-300], &mut warnings);
        assert_eq!((used, warnings.len()), ([1.0; 3], 5));
    }

    #[test]
    fn directions_of_any_length() {
        for length in [5e-324, 1e-162, 1e-300, 1.0, 1e300, f64::MAX] {
            let found = direction(DVec3::new(0.0, -length, length * 0.0));
            assert_eq!(found, Some(DVec3::NEG_Y), "{length}");
        }
        let slanted = direction(DVec3::splat(3e-162)).unwrap();
        assert!((slanted.length() - 1.0).abs() < 1e-15);
        for none in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert_eq!(direction(none), None);
        }
    }

    #[test]
    fn scales() {
        let scale = |slope, intercept, offset| {
            let mut warnings = Vec::new();
            let scale = usable_scale(slope, intercept, offset, &mut warnings);
            (scale.slope, scale.intercept, warnings.len())
        };
        assert_eq!(scale(0.0, 7.0, 0.0), (1.0, 0.0, 0));
        assert_eq!(scale(0.0, 7.0, -128.0), (1.0, -128.0, 0));
        assert_eq!(scale(-2.0, 1.0, -128.0), (-2.0, 257.0, 0));
        for slope in [f64::NAN, f64::INFINITY, 1e-300, 1e300] {
            assert_eq!(scale(slope, 7.0, 0.0), (1.0, 0.0, 1), "{slope}");
        }
        assert_eq!(scale(2.0, f64::NAN, 0.0), (1.0, 0.0, 1));
    }

    #[test]
    fn products_that_overflow() {
        let layout = |dims| Layout {
            dims,
            spacing: [1.0; 3],
            voxel_type: VoxelType::F64,
            endian: None,
            slope: 1.0,
            intercept: 0.0,
            placements: Vec::new(),
        };
        assert_eq!(layout([3, 4, 5]).bytes(60), Ok(480));
        for dims in [[3, 4, 6], [u64::MAX, u64::MAX, 1], [1 << 32, 1 << 32, 1]] {
            assert!(matches!(
                layout(dims).bytes(60),
                Err(HeaderError::TooManyVoxels { limit: 60, .. })
            ));
        }
        assert!(layout([u64::MAX / 2, 1, 1]).bytes(u64::MAX).is_err());
    }
}
