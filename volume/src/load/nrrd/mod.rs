//! NRRD files, "nearly raw raster data".
//!
//! Teem, "Definition of NRRD File Format" (teem.sourceforge.net/nrrd/format.html), versions 1 to 5.
//! A header of text lines ends with an empty line; voxels follow, or lie in a file that the header
//! names. `line skip` counts lines of that file as stored, `byte skip` bytes after decompression;
//! a byte skip of −1 means that the voxels are the last bytes there are.
//!
//! Supported: encodings `raw` and `gzip`, one data file, single numbers on three axes.

mod header;
mod lines;
mod values;

use std::{io::BufRead, path::Path};

use self::header::{Encoding, Header};
use super::{
    DataError, Format, HeaderError, LoadError, LoadOptions, Loaded, io_fault,
    layout::{Parts, assemble, data_fault},
    source::{Body, Folder, Stream, companion},
};

/// Bytes that may lie before voxels of which only the end is known, after decompression.
const MAX_SKIP: u64 = 1 << 34;

pub(super) fn load(
    folder: &dyn Folder,
    name: &Path,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let shown = folder.shown(name);
    let header_fault = |source: HeaderError| LoadError::Header {
        path: shown.clone(),
        source,
    };
    let mut stream = folder.open(name).map_err(io_fault(shown.clone()))?;
    let length = stream.left();
    let read = lines::read(&mut stream).map_err(io_fault(shown.clone()))?;
    let lines = read.map_err(header_fault)?;
    let header = Header::parse(&lines).map_err(header_fault)?;
    let expected = header.layout.bytes(options.max_voxels);
    let expected = expected.map_err(header_fault)?;

    // Where the bytes are: behind the header, or at the start of another file.
    let (file, start) = match &header.data_file {
        Some(file) => (companion(name, &shown, file, options.companions)?, 0),
        None if lines.ended => (name.into(), length - stream.left()),
        None => {
            return Err(header_fault(HeaderError::NoEnd { line: lines.count }));
        }
    };
    let data = folder.shown(&file);
    let fault = |source| data_fault(&data, source);
    let short = |found| DataError::Short { expected, found };
    let open = || -> Result<Body<'_>, LoadError> {
        let mut stream = folder.open(&file).map_err(io_fault(data.clone()))?;
        let passed = pass_to(&mut stream, start, header.line_skip);
        if !passed.map_err(io_fault(data.clone()))? {
            return Err(fault(short(0)));
        }
        Ok(match header.encoding {
            Encoding::Raw => Body::Plain(stream),
            Encoding::Gzip => Body::gzip(stream),
        })
    };
    let mut body = open()?;
    let skip = match (header.byte_skip, body.left()) {
        (Some(skip), _) => skip,
        (None, Some(left)) => left
            .checked_sub(expected)
            .ok_or_else(|| fault(short(left)))?,
        (None, None) => {
            let limit = expected.saturating_add(MAX_SKIP);
            let all = open()?.skip(limit).map_err(fault)?;
            if all == limit {
                return Err(fault(DataError::TooLarge { limit }));
            }
            all.checked_sub(expected).ok_or_else(|| fault(short(all)))?
        }
    };
    // Before anything is read of a file that is too short for it.
    if let Some(left) = body
        .left()
        .filter(|&left| left.saturating_sub(skip) < expected)
    {
        return Err(fault(short(left.saturating_sub(skip))));
    }
    if body.skip(skip).map_err(fault)? < skip {
        return Err(fault(short(0)));
    }
    let parts = Parts {
        format: Format::Nrrd,
        layout: header.layout,
        header: &shown,
        data: &data,
        body,
        warnings: header.warnings,
    };
    assemble(parts, options)
}

/// Passes over bytes and then lines; whether there were so many.
fn pass_to(stream: &mut Stream<'_>, mut bytes: u64, lines: u64) -> std::io::Result<bool> {
    while bytes > 0 {
        let found = stream.fill_buf()?.len();
        if found == 0 {
            return Ok(false);
        }
        let passed = bytes.min(found as u64);
        stream.consume(passed as usize);
        bytes -= passed;
    }
    for _ in 0..lines {
        if stream.skip_until(b'\n')? == 0 {
            return Ok(false);
        }
    }
    Ok(true)
}
