//! The header of a NIfTI file: 348 bytes of version 1, 540 of version 2.
//!
//! Offsets of fields are those of `nifti1.h` and `nifti2.h`; version 2 has the same fields, wider
//! and in another order.

use super::{
    super::{Endian, HeaderError, Place, VoxelType, Warning, error::quote, layout::Layout},
    placement,
};

/// Bytes of the larger header.
pub(super) const LARGEST: usize = 540;

/// Which header, in which order of bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Version {
    /// Bytes: 348 or 540.
    pub(super) size: usize,
    pub(super) endian: Endian,
}

/// Where the fields of a version are.
pub(super) struct Places {
    magic: usize,
    datatype: usize,
    bitpix: usize,
    dim: usize,
    pixdim: usize,
    vox_offset: usize,
    scl_slope: usize,
    scl_inter: usize,
    pub(super) qform_code: usize,
    pub(super) sform_code: usize,
    pub(super) quatern: usize,
    pub(super) srow: usize,
}

const VERSION_1: Places = Places {
    magic: 344,
    datatype: 70,
    bitpix: 72,
    dim: 40,
    pixdim: 76,
    vox_offset: 108,
    scl_slope: 112,
    scl_inter: 116,
    qform_code: 252,
    sform_code: 254,
    quatern: 256,
    srow: 280,
};

const VERSION_2: Places = Places {
    magic: 4,
    datatype: 12,
    bitpix: 14,
    dim: 16,
    pixdim: 104,
    vox_offset: 168,
    scl_slope: 176,
    scl_inter: 184,
    qform_code: 344,
    sform_code: 348,
    quatern: 352,
    srow: 400,
};

/// The fields of a header.
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
    version: Version,
    pub(super) places: &'static Places,
}

impl Fields<'_> {
    /// `N` bytes, the lowest first; zeros where there are none, which does not occur.
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let found = self.bytes.get(at..).and_then(|rest| rest.first_chunk());
        let mut bytes = found.copied().unwrap_or([0; N]);
        if self.version.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn wide(&self) -> bool {
        self.version.size == LARGEST
    }

    /// An integer of 16 bits in both versions.
    fn short(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    /// An integer of 16 or 32 bits.
    pub(super) fn code(&self, at: usize) -> i32 {
        if self.wide() {
            i32::from_le_bytes(self.bytes(at))
        } else {
            self.short(at).into()
        }
    }

    /// Bytes from one size to the next.
    fn dim_stride(&self) -> usize {
        if self.wide() { 8 } else { 2 }
    }

    /// A size.
    fn dim(&self, index: usize) -> i64 {
        let at = self.places.dim + index * self.dim_stride();
        if self.wide() {
            i64::from_le_bytes(self.bytes(at))
        } else {
            self.short(at).into()
        }
    }

    /// The number at a place of a list of floating-point numbers.
    pub(super) fn real(&self, list: usize, index: usize) -> f64 {
        if self.wide() {
            f64::from_le_bytes(self.bytes(list + 8 * index))
        } else {
            f32::from_le_bytes(self.bytes(list + 4 * index)).into()
        }
    }

    /// Distance between voxels, as given.
    pub(super) fn pixdim(&self, index: usize) -> f64 {
        self.real(self.places.pixdim, index)
    }
}

/// What the first four bytes tell.
pub(super) fn version(first: &[u8]) -> Result<Version, HeaderError> {
    let Some(bytes) = first.first_chunk::<4>() else {
        return Err(HeaderError::Truncated {
            expected: 348,
            found: first.len(),
        });
    };
    let (little, big) = (i32::from_le_bytes(*bytes), i32::from_be_bytes(*bytes));
    for (number, endian) in [(little, Endian::Little), (big, Endian::Big)] {
        if let 348 | 540 = number {
            let size = number as usize;
            return Ok(Version { size, endian });
        }
    }
    Err(HeaderError::Magic {
        format: "NIfTI",
        found: quote(bytes),
    })
}

/// A header.
pub(super) struct Header {
    pub(super) layout: Layout,
    /// Whether the voxels are in the same file.
    pub(super) single: bool,
    /// Where they begin.
    pub(super) data_offset: f64,
    pub(super) warnings: Vec<Warning>,
}

impl Header {
    /// `bytes`: as many as the version has.
    pub(super) fn parse(bytes: &[u8], version: Version) -> Result<Self, HeaderError> {
        let wide = version.size == LARGEST;
        let places = if wide { &VERSION_2 } else { &VERSION_1 };
        let fields = Fields {
            bytes,
            version,
            places,
        };
        let magic = bytes.get(places.magic..places.magic + if wide { 8 } else { 4 });
        let single = match magic {
            Some(b"n+1\0" | b"n+2\0\r\n\x1a\n") => true,
            Some(b"ni1\0" | b"ni2\0\r\n\x1a\n") => false,
            found => {
                return Err(HeaderError::Magic {
                    format: "NIfTI",
                    found: quote(found.unwrap_or_default()),
                });
            }
        };
        let dims = dims(&fields)?;
        let voxel_type = voxel_type(&fields)?;
        let mut warnings = Vec::new();
        let bits = fields.short(places.bitpix);
        if u64::try_from(bits).ok() != Some(voxel_type.bytes() * 8) {
            warnings.push(Warning::Bits {
                given: bits.into(),
                voxel_type,
            });
        }
        let spacing = [1, 2, 3].map(|axis| fields.pixdim(axis));
        let placements = placement::of(&fields, spacing, &mut warnings);
        let slope = fields.real(places.scl_slope, 0);
        let data_offset = if wide {
            // To the next number with a fraction of 53 bits; no file is so long that it matters.
            i64::from_le_bytes(fields.bytes(places.vox_offset)) as f64
        } else {
            fields.real(places.vox_offset, 0)
        };
        Ok(Self {
            layout: Layout {
                dims,
                spacing,
                voxel_type,
                endian: Some(version.endian),
                slope,
                intercept: fields.real(places.scl_inter, 0),
                placements,
            },
            single,
            data_offset,
            warnings,
        })
    }
}

/// Sizes of three axes; further ones may be there with size 1.
fn dims(fields: &Fields<'_>) -> Result<[u64; 3], HeaderError> {
    let axes = fields.dim(0);
    let refused = |index: usize, expected| HeaderError::Value {
        place: Place::Byte(fields.places.dim + index * fields.dim_stride()),
        field: "dim",
        found: fields.dim(index).to_string(),
        expected,
    };
    if !(1..=7).contains(&axes) {
        return Err(refused(0, "a number of axes from 1 to 7"));
    }
    let mut sizes = [0; 7];
    for index in 1..=axes as usize {
        let size = u64::try_from(fields.dim(index)).unwrap_or(0);
        if size == 0 {
            return Err(refused(index, "a size of at least 1"));
        }
        sizes[index - 1] = size;
    }
    match sizes[..axes as usize] {
        [x, y, z, ref others @ ..] if others.iter().all(|&size| size == 1) => Ok([x, y, z]),
        ref all => Err(HeaderError::Axes {
            place: Place::Byte(fields.places.dim),
            found: format!("sizes {all:?}"),
        }),
    }
}

fn voxel_type(fields: &Fields<'_>) -> Result<VoxelType, HeaderError> {
    let code = fields.short(fields.places.datatype);
    let name = match code {
        2 => return Ok(VoxelType::U8),
        4 => return Ok(VoxelType::I16),
        8 => return Ok(VoxelType::I32),
        16 => return Ok(VoxelType::F32),
        64 => return Ok(VoxelType::F64),
        256 => return Ok(VoxelType::I8),
        512 => return Ok(VoxelType::U16),
        768 => return Ok(VoxelType::U32),
        1 => "binary (1 bit)",
        32 => "complex64",
        128 => "RGB24",
        1024 => "int64",
        1280 => "uint64",
        1536 => "float128",
        1792 => "complex128",
        2048 => "complex256",
        2304 => "RGBA32",
        _ => "unknown",
    };
    Err(HeaderError::VoxelType {
        place: Place::Byte(fields.places.datatype),
        name: format!("{name} (code {code})"),
    })
}
