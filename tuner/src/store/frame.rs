//! The bytes of a log: how records are framed, found, and found again behind damage.
//!
//! ```text
//! header   8 bytes "raywtune", u32 format version, u32 CRC32C of these 12 bytes
//! record   4 bytes FF "RW" FE, u32 length, u32 kind, payload, u32 CRC32C(length, kind, payload)
//! payload  `length` bytes of UTF-8: one JSON object and a line feed
//! ```
//!
//! All integers are little-endian. CRC32C is the checksum of iSCSI (RFC 3720, section 12.1).
//!
//! Each record begins with a magic number whose first byte, FF, occurs in no UTF-8 text. So no
//! payload contains the beginning of a record, and after damage the next FF that starts a whole
//! record with a good checksum is a record. A payload with an FF in it is refused before its
//! checksum is computed; that bounds the work of a scan by a small multiple of the file's size,
//! whatever the bytes are.
//!
//! Invariants: [`scan`] returns records in the order of the file; records and damage together
//! cover the file behind its header without gap or overlap; nothing is allocated that is longer
//! than the file.

use std::ops::Range;

use crc::{CRC_32_ISCSI, Crc};

/// The format version that is written, and the newest that is read.
pub const FORMAT_VERSION: u32 = 1;

/// Longest payload that is written or believed, bytes.
pub const MAX_PAYLOAD_BYTES: usize = 1 << 24;

/// Bytes of the file header.
pub(crate) const HEADER_BYTES: usize = 16;

/// Bytes of a record beside its payload.
pub(crate) const OVERHEAD_BYTES: usize = 16;

const FILE_MAGIC: [u8; 8] = *b"raywtune";
const RECORD_MAGIC: [u8; 4] = [0xff, b'R', b'W', 0xfe];
const CRC32C: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Where in its file damage lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DamagePlace {
    /// At the beginning: the file header is not the one that was written.
    Head,
    /// Between good records.
    Middle,
    /// Behind the last good record. While a writer lives this may be a record that is being
    /// written.
    Tail,
}

/// Bytes of a file that belong to no good record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Damage {
    /// Of the first such byte, from the beginning of the file.
    pub offset: u64,
    /// How many there are.
    pub bytes: u64,
    /// Where they lie.
    pub place: DamagePlace,
}

/// One record as bytes: kind and payload.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Frame {
    pub(crate) kind: u32,
    pub(crate) payload: Vec<u8>,
}

impl Frame {
    /// Appends the whole record to `bytes`.
    pub(crate) fn write_to(&self, bytes: &mut Vec<u8>) {
        debug_assert!(self.payload.len() <= MAX_PAYLOAD_BYTES);
        bytes.extend(RECORD_MAGIC);
        let summed = bytes.len();
        // The cast is exact: the length is at most `MAX_PAYLOAD_BYTES`.
        bytes.extend((self.payload.len() as u32).to_le_bytes());
        bytes.extend(self.kind.to_le_bytes());
        bytes.extend(&self.payload);
        let checksum = CRC32C.checksum(&bytes[summed..]);
        bytes.extend(checksum.to_le_bytes());
    }
}

/// The beginning of every file of this version.
pub(crate) fn header() -> [u8; HEADER_BYTES] {
    header_of(FORMAT_VERSION)
}

fn header_of(version: u32) -> [u8; HEADER_BYTES] {
    let mut bytes = [0; HEADER_BYTES];
    bytes[..8].copy_from_slice(&FILE_MAGIC);
    bytes[8..12].copy_from_slice(&version.to_le_bytes());
    let checksum = CRC32C.checksum(&bytes[..12]);
    bytes[12..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// What the beginning of a file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Header {
    /// Written whole, by this format version.
    Version(u32),
    /// The file is empty, or ends within what would be the header of this version.
    Unfinished,
    /// Something else.
    Damaged,
}

/// Reads the header of a file.
pub(crate) fn read_header(bytes: &[u8]) -> Header {
    let Some(head) = bytes.get(..HEADER_BYTES) else {
        return match header().starts_with(bytes) {
            true => Header::Unfinished,
            false => Header::Damaged,
        };
    };
    match read_u32(head, 8) {
        Some(version) if head == header_of(version) => Header::Version(version),
        _ => Header::Damaged,
    }
}

/// A good record of a file.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) range: Range<usize>,
    pub(crate) frame: Frame,
}

/// The good records of a file, and the rest.
#[derive(Debug)]
pub(crate) struct Scan {
    pub(crate) found: Vec<Found>,
    pub(crate) damage: Vec<Damage>,
    /// End of the last good record, or of a good header, or 0.
    pub(crate) good_end: usize,
}

/// Finds the good records of a file with any content.
pub(crate) fn scan(bytes: &[u8]) -> Scan {
    let start = match read_header(bytes) {
        Header::Version(_) => HEADER_BYTES,
        Header::Unfinished | Header::Damaged => 0,
    };
    let mut scan = Scan {
        found: Vec::new(),
        damage: Vec::new(),
        good_end: start,
    };
    let mut position = Some(start);
    while let Some(at) = position {
        position = match read_frame(bytes, at) {
            Some(found) => {
                scan.note_damage(at, DamagePlace::Middle);
                scan.good_end = found.range.end;
                scan.found.push(found);
                Some(scan.good_end)
            }
            None => next_magic(bytes, at + 1),
        };
    }
    scan.note_damage(bytes.len(), DamagePlace::Tail);
    scan
}

impl Scan {
    /// Notes the bytes between the last good record and `end`, if there are any.
    fn note_damage(&mut self, end: usize, place: DamagePlace) {
        if end > self.good_end {
            self.damage.push(Damage {
                offset: self.good_end as u64,
                bytes: (end - self.good_end) as u64,
                place: match self.good_end {
                    0 => DamagePlace::Head,
                    _ => place,
                },
            });
        }
    }
}

/// The record at `at`, if there is a whole and good one.
fn read_frame(bytes: &[u8], at: usize) -> Option<Found> {
    let record = bytes.get(at..)?;
    if !record.starts_with(&RECORD_MAGIC) {
        return None;
    }
    let length = usize::try_from(read_u32(record, 4)?).ok()?;
    if length > MAX_PAYLOAD_BYTES {
        return None;
    }
    let payload = record.get(12..12 + length)?;
    let checksum = read_u32(record, 12 + length)?;
    if payload.contains(&RECORD_MAGIC[0]) || CRC32C.checksum(&record[4..12 + length]) != checksum {
        return None;
    }
    Some(Found {
        range: at..at + length + OVERHEAD_BYTES,
        frame: Frame {
            kind: read_u32(record, 8)?,
            payload: payload.to_vec(),
        },
    })
}

/// Position of the first record magic at or behind `from`.
fn next_magic(bytes: &[u8], from: usize) -> Option<usize> {
    let rest = bytes.get(from..)?;
    let mut windows = rest.windows(RECORD_MAGIC.len());
    Some(from + windows.position(|window| window == RECORD_MAGIC)?)
}

fn read_u32(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checksum_is_that_of_the_standard() {
        // RFC 3720, section B.4: 32 bytes of zeros.
        assert_eq!(CRC32C.checksum(&[0; 32]), 0x8a91_36aa);
    }

    #[test]
    fn records_and_damage_cover_the_file() {
        let mut bytes = header().to_vec();
        let frame = |text: &str| Frame {
            kind: 7,
            payload: text.as_bytes().to_vec(),
        };
        frame("{}\n").write_to(&mut bytes);
        bytes.extend(b"noise");
        bytes.extend(RECORD_MAGIC);
        frame("{\"a\":1}\n").write_to(&mut bytes);
        bytes.extend(RECORD_MAGIC);
        let scan = scan(&bytes);
        assert_eq!(scan.found.len(), 2);
        let damage: Vec<_> = scan.damage.iter().map(|d| (d.bytes, d.place)).collect();
        assert_eq!(damage, [(9, DamagePlace::Middle), (4, DamagePlace::Tail)]);
        let good: usize = scan.found.iter().map(|found| found.range.len()).sum();
        assert_eq!(HEADER_BYTES + good + 13, bytes.len());
    }

    #[test]
    fn length_beyond_the_file_is_not_believed() {
        let mut bytes = header().to_vec();
        bytes.extend(RECORD_MAGIC);
        bytes.extend(u32::MAX.to_le_bytes());
        bytes.extend([0; 64]);
        assert!(scan(&bytes).found.is_empty());
    }

    #[test]
    fn a_scan_of_magic_numbers_alone_ends_soon() {
        // Each announces a payload up to the end of the file; a naive scan is quadratic.
        let mut bytes = header().to_vec();
        for left in (0..200_000u32).rev() {
            bytes.extend(RECORD_MAGIC);
            bytes.extend((left.saturating_mul(8)).min(1 << 20).to_le_bytes());
        }
        assert!(scan(&bytes).found.is_empty());
    }
}
