//! NIfTI-1 and NIfTI-2 files: single files, and pairs of header and image, plain or gzipped.
//!
//! R. Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004, and its header
//! `nifti1.h`; for version 2 `nifti2.h`. A single file is header, extensions, voxels; which byte
//! order it has is seen in its first number, the size of the header.
//!
//! Whether a file is compressed is seen in its bytes, not in its name: those of gzip begin no header.

mod header;
mod placement;

use std::{
    io,
    path::{Path, PathBuf},
};

use self::header::{Header, LARGEST};
use super::{
    DataError, Format, HeaderError, LoadError, LoadOptions, Loaded, Place, Warning, io_fault,
    layout::{Parts, assemble, data_fault},
    source::{Body, Folder},
};

pub(super) fn load(
    folder: &dyn Folder,
    name: &Path,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    // A pair is loaded by either of its names.
    let name = match sibling(name, ".img", ".hdr") {
        Some(names) => first_there(folder, &names).unwrap_or_else(|| name.into()),
        None => name.into(),
    };
    let shown = folder.shown(&name);
    let header_fault = |source: HeaderError| LoadError::Header {
        path: shown.clone(),
        source,
    };
    let open = |name: &Path| {
        let stream = folder.open(name)?;
        Body::sniffed(stream)
    };
    let mut body = open(&name).map_err(io_fault(shown.clone()))?;
    let mut bytes = [0; LARGEST];
    let mut read = |range: std::ops::Range<usize>| body.read_up_to(&mut bytes[range]);
    let mut found = read(0..4).map_err(|source| data_fault(&shown, source))?;
    let version = header::version(&bytes[..found]).map_err(header_fault)?;
    let mut read = |range: std::ops::Range<usize>| body.read_up_to(&mut bytes[range]);
    found += read(4..version.size).map_err(|source| data_fault(&shown, source))?;
    if found < version.size {
        return Err(header_fault(HeaderError::Truncated {
            expected: version.size,
            found,
        }));
    }
    let header = Header::parse(&bytes[..version.size], version).map_err(header_fault)?;
    let expected = header.layout.bytes(options.max_voxels);
    let expected = expected.map_err(header_fault)?;
    let mut warnings = header.warnings;

    let mut data = shown.clone();
    let skip = if header.single {
        // Behind the header are four bytes that tell of extensions.
        let least = version.size as u64 + 4;
        let start = offset(header.data_offset, least, &mut warnings).map_err(header_fault)?;
        start - version.size as u64
    } else {
        let names = sibling(&name, ".hdr", ".img").ok_or_else(|| {
            header_fault(HeaderError::Value {
                place: Place::Nowhere,
                field: "magic",
                found: "of a pair".into(),
                expected: "that of a single file, or the name NAME.hdr beside NAME.img,",
            })
        })?;
        let image = first_there(folder, &names).ok_or_else(|| {
            let wanted = names.first().cloned().unwrap_or_else(|| name.clone());
            io_fault(folder.shown(&wanted))(io::ErrorKind::NotFound.into())
        })?;
        data = folder.shown(&image);
        body = open(&image).map_err(io_fault(data.clone()))?;
        offset(header.data_offset, 0, &mut warnings).map_err(header_fault)?
    };
    let short = |found| DataError::Short { expected, found };
    let fault = |source| data_fault(&data, source);
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
        format: if version.size == 348 {
            Format::Nifti1
        } else {
            Format::Nifti2
        },
        layout: header.layout,
        header: &shown,
        data: &data,
        body,
        warnings,
    };
    assemble(parts, options)
}

/// The first byte of the voxels: not before `least`.
fn offset(given: f64, least: u64, warnings: &mut Vec<Warning>) -> Result<u64, HeaderError> {
    if given.fract() != 0.0 || !given.is_finite() {
        return Err(HeaderError::Value {
            place: Place::Nowhere,
            field: "vox_offset",
            found: format!("{given:?}"),
            expected: "a whole number",
        });
    }
    if given < least as f64 {
        let used = least;
        warnings.push(Warning::DataOffset { given, used });
        return Ok(least);
    }
    // Saturates, and no file is so long.
    Ok(given as u64)
}

/// The names, plain and compressed, of the other file of a pair.
fn sibling(name: &Path, from: &str, to: &str) -> Option<Vec<PathBuf>> {
    let text = name.to_str()?;
    let lower = text.to_ascii_lowercase();
    let stem = lower.strip_suffix(".gz").unwrap_or(&lower);
    let stem = &text[..stem.strip_suffix(from)?.len()];
    let mut names = Vec::new();
    for ending in [to.to_owned(), to.to_ascii_uppercase()] {
        names.push(format!("{stem}{ending}").into());
        names.push(format!("{stem}{ending}.gz").into());
    }
    Some(names)
}

fn first_there(folder: &dyn Folder, names: &[PathBuf]) -> Option<PathBuf> {
    names.iter().find(|name| folder.open(name).is_ok()).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_pairs() {
        let names = |name: &str| sibling(Path::new(name), ".hdr", ".img");
        let found = names("a.b/C.HDR.gz").unwrap();
        assert_eq!(
            found[..2],
            [PathBuf::from("a.b/C.img"), "a.b/C.img.gz".into()]
        );
        assert_eq!(names("a.nii"), None);
    }

    #[test]
    fn offsets() {
        let mut warnings = Vec::new();
        let mut of = |given, least| offset(given, least, &mut warnings).ok();
        assert_eq!(of(352.0, 352), Some(352));
        assert_eq!(of(416.0, 352), Some(416));
        assert_eq!(of(0.0, 0), Some(0));
        assert_eq!(of(1e30, 0), Some(u64::MAX));
        for bad in [352.5, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(of(bad, 352), None);
        }
        assert_eq!(of(-1.0, 0), Some(0));
        assert_eq!(of(348.0, 352), Some(352));
        assert_eq!(warnings.len(), 2);
    }
}
