//! Portable float map: f32 without loss in the simplest of formats.
//!
//! Source: Debevec, HDRShop; the same layout as the `portable anymap` family:
//!
//! ```text
//! PF              three channels; Pf: one, read as grey
//! width height
//! scale           negative: little endian; positive: big endian
//! samples         f32, rows from bottom to top, one byte of white space after the scale
//! ```
//!
//! The absolute value of the scale multiplies the samples. Written files have the scale −1.0.
//!
//! Invariants: reading what was written gives the same bits; memory is taken only after the size in
//! the header has been found to agree with the length of the file.

use std::path::Path;

use super::{ImageError, read_bytes, replace_file};
use crate::film::{FilmError, check_size};
use crate::image::Image;

/// Longest number accepted in a header, bytes. An f32 written out in full has less than 50.
const MAX_FIELD: usize = 64;

/// What is wrong with the bytes of a PFM file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PfmError {
    /// The file does not begin with `PF` or `Pf` and white space.
    #[error("not a PFM file: it begins with {found:?} instead of \"PF\" or \"Pf\"")]
    Magic {
        /// The first bytes.
        found: String,
    },
    /// A number of the header is missing or is not one.
    #[error("PFM header: {field} is {found:?}, which is no valid number for it")]
    Field {
        /// `width`, `height` or `scale`.
        field: &'static str,
        /// What stands there.
        found: String,
    },
    /// The size is not permitted.
    #[error("PFM header: {0}")]
    Size(#[from] FilmError),
    /// The file is shorter or longer than its header says.
    #[error("PFM file of {found} bytes: its header describes {expected}")]
    Length {
        /// Bytes that header and samples of that size take.
        expected: u64,
        /// Bytes of the file.
        found: u64,
    },
}

/// Writes `image` as three-channel little-endian PFM.
///
/// # Errors
///
/// If the file cannot be written.
pub fn write_pfm(path: impl AsRef<Path>, image: &Image) -> Result<(), ImageError> {
    replace_file(path.as_ref(), &encode(image))
}

/// Reads a PFM file of either byte order, with three channels or one.
///
/// # Errors
///
/// If the file cannot be read, or is no PFM file: [`PfmError`] says where it departs from one.
pub fn read_pfm(path: impl AsRef<Path>) -> Result<Image, ImageError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    decode(&bytes).map_err(|source| ImageError::Pfm {
        path: path.to_owned(),
        source,
    })
}

fn encode(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width(), image.height()).into_bytes();
    bytes.reserve_exact(size_of_val(image.pixels()));
    for row in image.pixels().chunks(image.width() as usize).rev() {
        bytes.extend(
            row.as_flattened()
                .iter()
                .flat_map(|sample| sample.to_le_bytes()),
        );
    }
    bytes
}

fn decode(bytes: &[u8]) -> Result<Image, PfmError> {
    let mut header = Header { bytes, at: 0 };
    let channels = match header.token() {
        b"PF" => 3,
        b"Pf" => 1,
        other => return Err(PfmError::Magic { found: text(other) }),
    };
    let width: u32 = header.number("width")?;
    let height: u32 = header.number("height")?;
    let scale: f32 = header.number("scale")?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(PfmError::Field {
            field: "scale",
            found: scale.to_string(),
        });
    }
    let samples = check_size(width, height)? * channels;
    // The one byte of white space that ends the header. If it is missing, so are the samples.
    let start = header.at + 1;
    let expected = start as u64 + samples as u64 * size_of::<f32>() as u64;
    if bytes.len() as u64 != expected {
        return Err(PfmError::Length {
            expected,
            found: bytes.len() as u64,
        });
    }
    let from_bytes = if scale < 0.0 {
        f32::from_le_bytes
    } else {
        f32::from_be_bytes
    };
    let unit = scale.abs();
    let (quadruples, _) = bytes[start..].as_chunks::<4>();
    let mut image = Image::new(width, height)?;
    let rows = image.pixels_mut().chunks_mut(width as usize).rev();
    for (row, stored) in rows.zip(quadruples.chunks(width as usize * channels)) {
        for (pixel, stored) in row.iter_mut().zip(stored.chunks(channels)) {
            let channel = |index: usize| from_bytes(stored[index % channels]) * unit;
            *pixel = [channel(0), channel(1), channel(2)];
        }
    }
    Ok(image)
}

/// The part of a header that has not been read yet.
struct Header<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Header<'a> {
    /// The bytes up to the next white space, after any white space before them; empty at the end.
    fn token(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let start = rest
            .iter()
            .take_while(|byte| byte.is_ascii_whitespace())
            .count();
        let length = rest[start..]
            .iter()
            .take_while(|byte| !byte.is_ascii_whitespace())
            .count();
        self.at += start + length;
        &rest[start..start + length]
    }

    fn number<T: std::str::FromStr>(&mut self, field: &'static str) -> Result<T, PfmError> {
        let token = self.token();
        let short = Some(token).filter(|token| token.len() <= MAX_FIELD);
        short
            .and_then(|token| str::from_utf8(token).ok())
            .and_then(|token| token.parse().ok())
            .ok_or_else(|| PfmError::Field {
                field,
                found: text(token),
            })
    }
}

/// The beginning of `bytes` for an error message.
fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_FIELD)]).into_owned()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A file of `header` and the samples 1, 2, 3, … in the byte order given.
    fn file(header: &str, samples: u32, to_bytes: fn(f32) -> [u8; 4]) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.extend((1..=samples).flat_map(|value| to_bytes(value as f32)));
        bytes
    }

    #[test]
    fn golden_bytes() {
        let mut image = Image::new(1, 2).unwrap();
        image.set(0, 0, [1.0, 0.5, -2.0]);
        let mut expected = b"PF\n1 2\n-1.0\n".to_vec();
        // The lower row comes first.
        expected.extend([0; 12]);
        expected.extend([0, 0, 0x80, 0x3f, 0, 0, 0, 0x3f, 0, 0, 0, 0xc0]);
        assert_eq!(encode(&image), expected);
    }

    #[test]
    fn both_byte_orders() {
        let little = decode(&file("PF\n1 2\n-1.0\n", 6, f32::to_le_bytes)).unwrap();
        let big = decode(&file("PF 1\t2  1\n", 6, f32::to_be_bytes)).unwrap();
        assert_eq!(little.pixels(), [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]]);
        assert_eq!(big, little);
    }

    #[test]
    fn one_channel_is_grey() {
        let image = decode(&file("Pf\n2 1\n-1\n", 2, f32::to_le_bytes)).unwrap();
        assert_eq!(image.pixels(), [[1.0; 3], [2.0; 3]]);
    }

    #[test]
    fn scale_multiplies_the_samples() {
        let image = decode(&file("Pf\n2 1\n2.5\n", 2, f32::to_be_bytes)).unwrap();
        assert_eq!(image.pixels(), [[2.5; 3], [5.0; 3]]);
    }

    #[test]
    fn headers_that_are_none() {
        for (header, found) in [("", ""), ("P6\n1 1\n", "P6"), ("PFx 1", "PFx")] {
            let found = found.to_string();
            assert_eq!(decode(header.as_bytes()), Err(PfmError::Magic { found }));
        }
        let long = "9".repeat(70);
        let cases = [
            ("PF".to_string(), "width", ""),
            ("PF\nx 1\n-1\n".to_string(), "width", "x"),
            ("PF\n-1 1\n-1\n".to_string(), "width", "-1"),
            (format!("PF\n{long} 1\n-1\n"), "width", &long[..MAX_FIELD]),
            ("PF\n1\n".to_string(), "height", ""),
            ("PF\n1 99999999999\n".to_string(), "height", "99999999999"),
            ("PF\n1 1\nlittle\n".to_string(), "scale", "little"),
            ("PF\n1 1\n0\n".to_string(), "scale", "0"),
            ("PF\n1 1\nnan\n".to_string(), "scale", "NaN"),
        ];
        for (header, field, found) in cases {
            let found = found.to_string();
            assert_eq!(
                decode(header.as_bytes()),
                Err(PfmError::Field { field, found })
            );
        }
    }

    #[test]
    fn sizes_that_are_not_permitted() {
        let error = FilmError::Side {
            width: 0,
            height: 1,
        };
        assert_eq!(decode(b"PF\n0 1\n-1\n"), Err(PfmError::Size(error)));
        let error = FilmError::TooManyPixels {
            width: 65536,
            height: 65536,
        };
        assert_eq!(decode(b"PF\n65536 65536\n-1\n"), Err(PfmError::Size(error)));
    }

    #[test]
    fn length_must_be_that_of_the_header() {
        let whole = file("PF\n2 2\n-1.0\n", 12, f32::to_le_bytes);
        let (expected, found) = (whole.len() as u64, whole.len() as u64 + 1);
        let longer = [&whole[..], &[0]].concat();
        assert_eq!(decode(&longer), Err(PfmError::Length { expected, found }));
        for found in 11..expected {
            let truncated = &whole[..found as usize];
            assert_eq!(decode(truncated), Err(PfmError::Length { expected, found }));
        }
        // The largest picture permitted, in a file of a few bytes: refused before it is allocated.
        let huge = b"PF\n65536 4096\n-1\n";
        let expected = huge.len() as u64 + 65536 * 4096 * 12;
        assert_eq!(
            decode(huge),
            Err(PfmError::Length {
                expected,
                found: huge.len() as u64
            })
        );
    }

    proptest! {
        #[test]
        fn any_bytes_give_a_picture_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(decode(&bytes).is_err() || bytes.starts_with(b"P"));
        }

        #[test]
        fn any_bytes_after_the_magic(
            grey in any::<bool>(),
            header in "[ \n0-9.e+-]{0,24}",
            samples in prop::collection::vec(any::<u8>(), 0..64),
        ) {
            let magic = if grey { "Pf\n" } else { "PF\n" };
            let bytes = [magic.as_bytes(), header.as_bytes(), &samples].concat();
            if let Ok(image) = decode(&bytes) {
                prop_assert!(image.pixels().len() * 4 < bytes.len());
            }
        }

        #[test]
        fn a_damaged_file_gives_a_picture_or_an_error(
            at in 0usize..60,
            byte in any::<u8>(),
            length in 0usize..=60,
        ) {
            let mut bytes = file("PF\n2 2\n-1.0\n", 12, f32::to_le_bytes);
            prop_assert_eq!(bytes.len(), 60);
            bytes[at] = byte;
            bytes.truncate(length);
            if let Ok(image) = decode(&bytes) {
                prop_assert!(image.pixels().len() * 4 < bytes.len());
            }
        }

        #[test]
        fn round_trip(width in 1u32..9, height in 1u32..9, bits in prop::collection::vec(any::<u32>(), 192)) {
            let mut image = Image::new(width, height).unwrap();
            for (pixel, bits) in image.pixels_mut().iter_mut().zip(bits.as_chunks::<3>().0) {
                *pixel = bits.map(f32::from_bits);
            }
            let back = decode(&encode(&image)).unwrap();
            prop_assert_eq!((back.width(), back.height()), (width, height));
            for (found, expected) in
                back.pixels().as_flattened().iter().zip(image.pixels().as_flattened())
            {
                let both_nan = found.is_nan() && expected.is_nan();
                prop_assert!(both_nan || found.to_bits() == expected.to_bits());
            }
        }
    }
}
