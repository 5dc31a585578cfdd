//! What the NIfTI reader makes of headers, row by row of the design's table of inputs. Everything
//! is tried in both versions and both orders of bytes.

mod files;

use files::{Nifti, gzip, one};
use raywright_volume::{
    grid::VoxelSlice,
    load::{
        DataError, Endian, Format, HeaderError, LoadError, LoadOptions, Loaded, PlacementSource,
        Warning, read_volume,
    },
};

const KINDS: [(u8, bool); 4] = [(1, false), (1, true), (2, false), (2, true)];

fn read(bytes: Vec<u8>) -> Result<Loaded, LoadError> {
    read_volume(&one("a.nii", bytes), "a.nii", &LoadOptions::default())
}

/// Loads the standard file, changed by `change`, in all kinds.
fn all(change: impl Fn(&mut Nifti) -> &mut Nifti) -> Vec<Result<Loaded, LoadError>> {
    let kinds = KINDS.iter().map(|&(version, big)| {
        let mut nifti = Nifti::new(version, big);
        change(&mut nifti);
        read(nifti.file())
    });
    kinds.collect()
}

fn header_error(result: Result<Loaded, LoadError>) -> HeaderError {
    match result {
        Err(LoadError::Header { source, .. }) => source,
        other => panic!("{other:?}"),
    }
}

#[test]
fn both_versions_orders_and_compressions() {
    for (version, big) in KINDS {
        let nifti = Nifti::new(version, big);
        for (name, bytes) in [
            ("a.nii", nifti.file()),
            ("a.nii.gz", gzip(&nifti.file())),
            // The name does not matter.
            ("a.nii", gzip(&nifti.file())),
            ("A.NII.GZ", nifti.file()),
        ] {
            let loaded = read_volume(&one(name, bytes), name, &LoadOptions::default()).unwrap();
            assert_eq!(loaded.volume.dims(), [3, 2, 2]);
            assert_eq!(loaded.volume.spacing(), [1.0, 2.0, 3.0]);
            assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
            assert_eq!(loaded.volume.value([1, 0, 1]), 2.0);
            assert_eq!(loaded.warnings, []);
            let endian = if big { Endian::Big } else { Endian::Little };
            assert_eq!(loaded.source.endian, Some(endian));
            let format = if version == 1 {
                Format::Nifti1
            } else {
                Format::Nifti2
            };
            assert_eq!(loaded.source.format, format);
        }
    }
}

#[test]
fn pairs_by_either_name() {
    for (image, stored) in [("a.img", false), ("a.img.gz", true)] {
        let mut header = Nifti::new(1, false);
        header.bytes[344..348].copy_from_slice(b"ni1\0");
        let voxels = header.file().split_off(352);
        let mut files = one("a.hdr", header.vox_offset(0.0).bytes[..348].to_vec());
        files.insert(image.into(), if stored { gzip(&voxels) } else { voxels });
        for name in ["a.hdr", image] {
            let loaded = read_volume(&files, name, &LoadOptions::default()).unwrap();
            assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
        }
        // Half of a pair under the name of a single file.
        let header = files["a.hdr"].clone();
        assert!(header_error(read(header)).to_string().contains("NAME.img"));
        files.remove(image);
        let alone = read_volume(&files, "a.hdr", &LoadOptions::default());
        let Err(LoadError::Io { path, .. }) = alone else {
            panic!("{alone:?}");
        };
        assert_eq!(path.to_string_lossy(), "a.img");
    }
}

#[test]
fn sizes_that_cannot_be() {
    for (index, value) in [(0, 0), (0, 8), (0, -1), (1, 0), (2, -3)] {
        for result in all(|nifti| nifti.dim(index, value)) {
            assert!(matches!(
                header_error(result),
                HeaderError::Value { field: "dim", .. }
            ));
        }
    }
    for result in all(|nifti| nifti.dim(0, 2)) {
        assert!(matches!(header_error(result), HeaderError::Axes { .. }));
    }
    for result in all(|nifti| nifti.dim(0, 4).dim(4, 5)) {
        assert!(matches!(header_error(result), HeaderError::Axes { .. }));
    }
    for result in all(|nifti| nifti.dim(0, 5).dim(4, 1).dim(5, 1)) {
        assert_eq!(result.unwrap().volume.dims(), [3, 2, 2]);
    }
    let mut huge = Nifti::new(2, false);
    for axis in 1..=3 {
        huge.dim(axis, i64::MAX);
    }
    assert!(matches!(
        header_error(read(huge.file())),
        HeaderError::TooManyVoxels { .. }
    ));
    for result in all(|nifti| nifti.dim(1, 30_000)) {
        assert!(matches!(
            result,
            Err(LoadError::Data {
                source: DataError::Short {
                    expected: 240_000,
                    found: 24
                },
                ..
            })
        ));
    }
}

#[test]
fn types_that_are_no_single_number_are_named() {
    for (code, name) in [
        (1, "binary"),
        (32, "complex64"),
        (128, "RGB24"),
        (1024, "int64"),
        (2304, "RGBA32"),
        (77, "unknown (code 77)"),
    ] {
        for result in all(|nifti| nifti.datatype(code, 8)) {
            let text = header_error(result).to_string();
            assert!(text.contains(name), "{text}");
        }
    }
    for result in all(|nifti| nifti.datatype(4, 32)) {
        let warnings = result.unwrap().warnings;
        assert!(matches!(warnings[..], [Warning::Bits { given: 32, .. }]));
    }
}

/// layerfMRI/LAYNII#26, JuliaNeuroscience/NIfTI.jl#14, nipreps/fmriprep#2507: a slope of 0 or NaN
/// is no factor.
#[test]
fn slopes_that_are_none() {
    for result in all(|nifti| nifti.scale(0.0, 7.0)) {
        let loaded = result.unwrap();
        assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
        assert_eq!(loaded.warnings, []);
    }
    for (slope, intercept) in [(f64::NAN, 0.0), (f64::INFINITY, 1.0), (2.0, f64::NAN)] {
        for result in all(|nifti| nifti.scale(slope, intercept)) {
            let loaded = result.unwrap();
            assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
            assert!(matches!(
                loaded.warnings[..],
                [Warning::ScaleIgnored { .. }]
            ));
        }
    }
}

#[test]
fn a_negative_slope_reverses_the_range() {
    for result in all(|nifti| nifti.scale(-2.0, 1.0)) {
        let volume = result.unwrap().volume;
        assert_eq!(volume.range(), [-11.0, 11.0]);
        assert_eq!(volume.value([0, 0, 0]), 11.0);
    }
}

/// nipreps/mriqc#1315: 16 bits with a slope that leads beyond 16 bits.
#[test]
fn values_beyond_the_stored_type() {
    for (version, big) in KINDS {
        let mut nifti = Nifti::new(version, big);
        nifti.scale(45.075, 0.0);
        let numbers = [0_i16, 3232, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10];
        let bytes: Vec<u8> = numbers
            .iter()
            .flat_map(|v| {
                if big {
                    v.to_be_bytes()
                } else {
                    v.to_le_bytes()
                }
            })
            .collect();
        let volume = read(nifti.with(&bytes)).unwrap().volume;
        assert!((volume.range()[1] - 145_682.4).abs() < 0.1);
        // nipy/nibabel#1001: the stored numbers are kept.
        assert!(matches!(volume.voxels(), VoxelSlice::U16(values) if values[1] == 3232));
    }
}

#[test]
fn voxels_that_begin_inside_the_header() {
    for offset in [0.0, 100.0, -5.0] {
        for result in all(|nifti| nifti.vox_offset(offset)) {
            let loaded = result.unwrap();
            assert_eq!(loaded.volume.range(), [-5.0, 6.0]);
            assert!(matches!(loaded.warnings[..], [Warning::DataOffset { .. }]));
        }
    }
    for offset in [352.5, f64::NAN, f64::INFINITY] {
        let mut nifti = Nifti::new(1, true);
        let error = header_error(read(nifti.vox_offset(offset).file()));
        assert!(matches!(
            error,
            HeaderError::Value {
                field: "vox_offset",
                ..
            }
        ));
    }
    for result in all(|nifti| nifti.vox_offset(1e15)) {
        assert!(matches!(
            result,
            Err(LoadError::Data {
                source: DataError::Short { .. },
                ..
            })
        ));
    }
    // Extensions lie between.
    let mut nifti = Nifti::new(1, false);
    let file = nifti.vox_offset(368.0).file();
    let with_extension = [&file[..352], &[9; 16], &file[352..]].concat();
    assert_eq!(read(with_extension).unwrap().volume.range(), [-5.0, 6.0]);
}

#[test]
fn distances_that_cannot_be() {
    for result in all(|nifti| nifti.pixdim(1, -2.5).pixdim(2, 0.0).pixdim(3, f64::NAN)) {
        let loaded = result.unwrap();
        assert_eq!(loaded.volume.spacing(), [2.5, 1.0, 1.0]);
        assert_eq!(loaded.warnings.len(), 2);
    }
}

#[test]
fn what_is_no_nifti() {
    for bytes in [&b""[..], b"\x5c", b"hello world, this is text", &[0; 400]] {
        header_error(read(bytes.to_vec()));
    }
    for (version, big) in KINDS {
        let mut nifti = Nifti::new(version, big);
        let magic = if version == 1 { 344 } else { 4 };
        nifti.bytes[magic] = b'x';
        assert!(matches!(
            header_error(read(nifti.file())),
            HeaderError::Magic { .. }
        ));
    }
}

#[test]
fn qform_and_sform() {
    // A half turn about z: (i, j, k) points to (−x, −y, z).
    for result in all(|nifti| nifti.qform(1, [0.0, 0.0, 1.0, 10.0, 20.0, 30.0])) {
        let loaded = result.unwrap();
        let orientation = loaded.volume.orientation();
        assert!((orientation.axes[0] + glam::Vec3::X).length() < 1e-6);
        assert!((orientation.axes[2] - glam::Vec3::Z).length() < 1e-6);
        assert_eq!(orientation.origin.to_array(), [10.0, 20.0, 30.0]);
        let placement = &loaded.source.placements[0];
        assert_eq!(
            (placement.source, &*placement.space),
            (PlacementSource::Qform, "scanner")
        );
    }
    // A negative pixdim[0] turns the third axis round.
    for result in all(|nifti| nifti.pixdim(0, -1.0).qform(1, [0.0; 6])) {
        let axes = result.unwrap().volume.orientation().axes;
        assert_eq!(
            axes.map(|a| a.to_array()),
            [[1., 0., 0.], [0., 1., 0.], [0., 0., -1.]]
        );
    }
    let rows = [0., 2., 0., 7., 1., 0., 0., 8., 0., 0., 3., 9.];
    for result in all(|nifti| nifti.sform(4, rows)) {
        let loaded = result.unwrap();
        let orientation = loaded.volume.orientation();
        assert_eq!(orientation.axes[0].to_array(), [0.0, 1.0, 0.0]);
        assert_eq!(orientation.origin.to_array(), [7.0, 8.0, 9.0]);
        assert_eq!(loaded.warnings, []);
        assert_eq!(loaded.source.placements[0].space, "mni 152");
    }
}

/// nipreps/fmriprep#2281: both are kept, and the one that is used is named.
#[test]
fn qform_and_sform_that_disagree() {
    let rows = [1., 0., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0.];
    for result in all(|nifti| nifti.sform(1, rows).qform(1, [0.0; 6])) {
        let loaded = result.unwrap();
        assert_eq!(
            (loaded.source.placements.len(), loaded.warnings.len()),
            (2, 0)
        );
    }
    for result in all(|nifti| nifti.sform(1, rows).qform(1, [1., 0., 0., 0., 0., 0.])) {
        let loaded = result.unwrap();
        let expected = Warning::PlacementsDisagree {
            used: PlacementSource::Sform,
            other: PlacementSource::Qform,
        };
        assert_eq!(loaded.warnings, [expected]);
        assert_eq!(loaded.volume.orientation().axes[1], glam::Vec3::Y);
    }
    let longer = [5., 0., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0.];
    for result in all(|nifti| nifti.sform(1, longer)) {
        let loaded = result.unwrap();
        assert!(matches!(
            loaded.warnings[..],
            [Warning::PlacementSpacing { .. }]
        ));
        assert_eq!(loaded.volume.spacing(), [1.0, 2.0, 3.0]);
    }
}

/// MRtrix3/mrtrix3#1324: rounding makes the quaternion longer than 1.
#[test]
fn quaternions_and_matrices_at_the_limit() {
    for result in all(|nifti| nifti.qform(1, [0.0, 1.000_01, 0.0, 0.0, 0.0, 0.0])) {
        let loaded = result.unwrap();
        let axes = loaded.volume.orientation().axes;
        assert!((axes[0] + glam::Vec3::X).length() < 1e-6, "{axes:?}");
        assert_eq!(loaded.warnings, []);
    }
    let flat = [1., 1., 0., 0., 0., 0., 0., 0., 0., 0., 1., 0.];
    for result in all(|nifti| nifti.sform(1, flat).qform(1, [f64::NAN; 6])) {
        let loaded = result.unwrap();
        let unusable = |source| Warning::PlacementUnusable { source };
        assert!(loaded.warnings.contains(&unusable(PlacementSource::Sform)));
        assert!(loaded.warnings.contains(&unusable(PlacementSource::Qform)));
        assert_eq!(loaded.volume.orientation(), Default::default());
    }
}
