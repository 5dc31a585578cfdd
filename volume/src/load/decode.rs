//! Bytes of a file to voxels in memory.
//!
//! Idea: numbers are converted while they are read, a buffer at a time. Integers with sign become
//! such without by an offset, which is the smallest value if that is negative and 0 otherwise: the
//! value range stays near 0, where the slope rounds least. What has 32 bits or more becomes `f32`,
//! and every number that changes by it is counted.
//!
//! Invariants: memory is asked for after its bytes have been read, or when the file is known to
//! hold them; at most one byte more than announced is read, so that a small file that unpacks to
//! terabytes costs its announced size at most.

use std::io::Read;

use super::{DataError, Endian, VoxelType, Warning, source::Body};
use crate::grid::Voxels;

/// Bytes read at a time: a multiple of the size of every type.
const BUFFER: usize = 1 << 16;

/// Voxels, and what stored number the raw value 0 stands for.
#[derive(Debug)]
pub(super) struct Decoded {
    pub(super) voxels: Voxels,
    pub(super) offset: f64,
}

/// Reads `count` numbers, and looks whether there are more.
pub(super) fn decode(
    body: &mut Body<'_>,
    count: u64,
    voxel_type: VoxelType,
    endian: Endian,
    warnings: &mut Vec<Warning>,
) -> Result<Decoded, DataError> {
    let expected = count * voxel_type.bytes();
    if let Some(found) = body.left().filter(|&found| found < expected) {
        return Err(DataError::Short { expected, found });
    }
    let bits = if endian == Endian::Little { 0 } else { 1 };
    let mut inexact = 0_usize;
    let mut too_large = 0_usize;
    // Exact or counted.
    let mut round = |wide: f64| {
        let narrow = wide as f32;
        if narrow.is_infinite() && wide.is_finite() {
            too_large += 1;
        } else if f64::from(narrow) != wide && !wide.is_nan() {
            inexact += 1;
        }
        narrow
    };
    macro_rules! number {
        ($type:ty, $bytes:expr) => {
            [<$type>::from_le_bytes, <$type>::from_be_bytes][bits]($bytes)
        };
    }
    let (voxels, offset) = match voxel_type {
        VoxelType::U8 => (Voxels::U8(read(body, count, |[byte]| byte)?), 0.0),
        VoxelType::I8 => {
            let mut values = read(body, count, |[byte]| byte ^ 0x80)?;
            let base = values.iter().copied().fold(0x80, u8::min);
            values.iter_mut().for_each(|value| *value -= base);
            (Voxels::U8(values), f64::from(base) - 128.0)
        }
        VoxelType::U16 => (Voxels::U16(read(body, count, |b| number!(u16, b))?), 0.0),
        VoxelType::I16 => {
            let mut values = read(body, count, |b| number!(u16, b) ^ 0x8000)?;
            let base = values.iter().copied().fold(0x8000, u16::min);
            values.iter_mut().for_each(|value| *value -= base);
            (Voxels::U16(values), f64::from(base) - 32768.0)
        }
        VoxelType::U32 => (
            Voxels::F32(read(body, count, |b| round(number!(u32, b).into()))?),
            0.0,
        ),
        VoxelType::I32 => (
            Voxels::F32(read(body, count, |b| round(number!(i32, b).into()))?),
            0.0,
        ),
        VoxelType::F32 => (Voxels::F32(read(body, count, |b| number!(f32, b))?), 0.0),
        VoxelType::F64 => (
            Voxels::F32(read(body, count, |b| round(number!(f64, b)))?),
            0.0,
        ),
    };
    if inexact > 0 {
        warnings.push(Warning::Rounded {
            count: inexact,
            from: voxel_type,
        });
    }
    if too_large > 0 {
        warnings.push(Warning::TooLarge { count: too_large });
    }
    end(body, warnings)?;
    Ok(Decoded { voxels, offset })
}

/// Reads `count` numbers of `N` bytes.
fn read<T, const N: usize>(
    body: &mut Body<'_>,
    count: u64,
    mut convert: impl FnMut([u8; N]) -> T,
) -> Result<Vec<T>, DataError> {
    let expected = count * N as u64;
    let no_memory = |_| DataError::OutOfMemory {
        bytes: count.saturating_mul(size_of::<T>() as u64),
    };
    let mut values = Vec::new();
    if body.left().is_some_and(|left| left >= expected) {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        values.try_reserve_exact(count).map_err(no_memory)?;
    }
    let mut buffer = [0; BUFFER];
    let mut left = expected;
    while left > 0 {
        let wanted = left.min(BUFFER as u64) as usize;
        let found = body.read_up_to(&mut buffer[..wanted])?;
        let (numbers, _) = buffer[..found].as_chunks::<N>();
        values.try_reserve(numbers.len()).map_err(no_memory)?;
        values.extend(numbers.iter().map(|bytes| convert(*bytes)));
        left -= found as u64;
        if found < wanted {
            let found = expected - left;
            return Err(DataError::Short { expected, found });
        }
    }
    Ok(values)
}

/// Looks behind the voxels.
fn end(body: &mut Body<'_>, warnings: &mut Vec<Warning>) -> Result<(), DataError> {
    let left = body.left();
    // The checksum of gzip data is compared by this too.
    let more = match body.read(&mut [0]) {
        Ok(more) => more,
        Err(error) => return Err(body.fault(error)),
    };
    if more > 0 {
        warnings.push(Warning::ExtraData { bytes: left });
    }
    if body.garbage() {
        warnings.push(Warning::GzipGarbage);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, path::Path};

    use super::{super::source::Folder, *};

    fn decoded(
        bytes: &[u8],
        count: u64,
        voxel_type: VoxelType,
        endian: Endian,
    ) -> (Result<Decoded, DataError>, Vec<Warning>) {
        let files = BTreeMap::from([("v".to_owned(), bytes.to_vec())]);
        let mut body = Body::Plain(files.open(Path::new("v")).unwrap());
        let mut warnings = Vec::new();
        let result = decode(&mut body, count, voxel_type, endian, &mut warnings);
        (result, warnings)
    }

    /// The numbers of a type with their values, in both orders of bytes.
    macro_rules! there_and_back {
        ($variant:ident, $values:expr) => {
            for endian in [Endian::Little, Endian::Big] {
                let values = $values;
                let bytes: Vec<u8> = values
                    .iter()
                    .flat_map(|v| match endian {
                        Endian::Little => v.to_le_bytes(),
                        Endian::Big => v.to_be_bytes(),
                    })
                    .collect();
                let count = values.len() as u64;
                let (result, warnings) = decoded(&bytes, count, VoxelType::$variant, endian);
                let result = result.unwrap();
                for (index, value) in values.iter().enumerate() {
                    let voxels = result.voxels.slice(result.voxels.len());
                    let got = f64::from(voxels.get(index)) + result.offset;
                    assert_eq!(got, f64::from(*value), "{:?}", VoxelType::$variant);
                }
                assert_eq!(warnings, []);
            }
        };
    }

    #[test]
    fn every_type_in_both_orders() {
        there_and_back!(U8, [0_u8, 1, 255]);
        there_and_back!(I8, [0_i8, -128, 127, -1]);
        there_and_back!(I8, [5_i8, 127]);
        there_and_back!(U16, [0_u16, 258, 65535]);
        // -(-32768) and -1024 as numbers without sign are faults others had.
        there_and_back!(I16, [-32768_i16, 32767, -1024, 0]);
        there_and_back!(I16, [-1024_i16, 3071]);
        there_and_back!(I16, [3_i16, 32767]);
        there_and_back!(U32, [0_u32, 1 << 31, 16_777_216]);
        there_and_back!(I32, [i32::MIN, -1, 16_777_216]);
        there_and_back!(F32, [0.5_f32, -1e30, 1e-40]);
        there_and_back!(F64, [0.5_f64, -1024.0, 0.0]);
    }

    #[test]
    fn offsets_are_no_larger_than_needed() {
        let bytes =
            |values: &[i16]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
        for (values, offset) in [
            (&[7, 9][..], 0.0),
            (&[-1024, 9], -1024.0),
            (&[-32768, 0], -32768.0),
        ] {
            let count = values.len() as u64;
            let (result, _) = decoded(&bytes(values), count, VoxelType::I16, Endian::Little);
            assert_eq!(result.unwrap().offset, offset);
        }
    }

    #[test]
    fn what_single_precision_cannot_hold_is_counted() {
        let bytes: Vec<u8> = [16_777_217_u32, 16_777_216, u32::MAX]
            .iter()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let (_, warnings) = decoded(&bytes, 3, VoxelType::U32, Endian::Little);
        let rounded = |count, from| Warning::Rounded { count, from };
        assert_eq!(warnings, [rounded(2, VoxelType::U32)]);
        let bytes: Vec<u8> = [0.1, 1e300, f64::NAN, f64::INFINITY, 0.5]
            .iter()
            .flat_map(|v: &f64| v.to_be_bytes())
            .collect();
        let (_, warnings) = decoded(&bytes, 5, VoxelType::F64, Endian::Big);
        assert_eq!(
            warnings,
            [rounded(1, VoxelType::F64), Warning::TooLarge { count: 1 }]
        );
    }

    #[test]
    fn too_few_and_too_many_bytes() {
        let (result, _) = decoded(&[0; 7], 4, VoxelType::U16, Endian::Little);
        assert!(matches!(
            result,
            Err(DataError::Short {
                expected: 8,
                found: 7
            })
        ));
        let (result, warnings) = decoded(&[0; 11], 4, VoxelType::U16, Endian::Little);
        assert!(result.is_ok());
        assert_eq!(warnings, [Warning::ExtraData { bytes: Some(3) }]);
    }
}
