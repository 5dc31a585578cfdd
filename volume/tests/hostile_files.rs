//! No bytes make a reader panic or take memory that is not there. The long form of this is the
//! example `fuzz_readers`, which runs for as long as wanted and watches the memory.

mod files;

use std::path::Path;

use files::{Files, Nifti, nrrd_header, one, seeds};
use proptest::prelude::*;
use raywright_volume::{
    View,
    load::{Endian, LoadOptions, RawLayout, VoxelType, read_volume},
};

const READERS: [&str; 3] = ["nrrd", "nifti", "raw"];

fn options() -> LoadOptions {
    LoadOptions::default().with_max_voxels(1 << 20)
}

/// Reads, and looks at what was accepted.
fn read(files: &Files, name: &str) {
    if let Ok(loaded) = read_volume(files, name, &options()) {
        let volume = loaded.volume;
        let [x, y, z] = volume.dims();
        assert_eq!(x * y * z, volume.voxels().len());
        assert!(volume.range().iter().all(|value| value.is_finite()));
        assert!(volume.extent().is_finite());
        let orientation = volume.orientation();
        assert!(orientation.origin.is_finite());
        for axis in orientation.axes {
            assert!((axis.length() - 1.0).abs() < 1e-4, "{axis}");
        }
        for warning in loaded.warnings {
            assert!(warning.to_string().len() < 500);
        }
    }
}

#[test]
fn all_seeds_are_valid() {
    for reader in READERS {
        for (files, name) in seeds(reader) {
            read_volume(&files, &name, &options()).expect("a valid file");
        }
    }
    for (files, name) in seeds("view") {
        View::parse(&files[&name], Path::new(&name)).expect("a valid view");
    }
}

#[test]
fn every_file_cut_at_every_byte() {
    for (files, name) in READERS.iter().flat_map(|reader| seeds(reader)) {
        for (cut, bytes) in &files {
            for end in 0..bytes.len() {
                let mut files = files.clone();
                files.insert(cut.clone(), bytes[..end].to_vec());
                read(&files, &name);
                // Whatever holds voxels must be whole.
                if !(cut.ends_with(".nhdr") || cut.ends_with(".hdr")) {
                    assert!(
                        read_volume(&files, &name, &options()).is_err(),
                        "{name}: {cut} cut at {end}"
                    );
                }
            }
        }
    }
}

#[test]
fn every_bit_flipped() {
    for (files, name) in READERS.iter().flat_map(|reader| seeds(reader)) {
        for (changed, bytes) in &files {
            for bit in 0..8 * bytes.len() {
                let mut files = files.clone();
                let bytes = files.get_mut(changed).expect("a file");
                bytes[bit / 8] ^= 1 << (bit % 8);
                read(&files, &name);
            }
        }
    }
    for (files, name) in seeds("view") {
        for bit in 0..8 * files[&name].len() {
            let mut bytes = files[&name].clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            let _ = View::parse(&bytes, Path::new(&name));
        }
    }
}

/// The other order of bytes gives other sizes or types; either fits or is refused.
#[test]
fn the_wrong_order_of_bytes() {
    for version in [1, 2] {
        let mut bytes = Nifti::new(version, false).file();
        bytes[..4].reverse();
        read(&one("a.nii", bytes), "a.nii");
    }
}

#[test]
fn headers_that_are_huge() {
    let lines = "key:=value\n# comment\nunknown: field\n".repeat(100_000);
    let header = nrrd_header("uchar", "raw", &lines) + "\n";
    let bytes = [header.as_bytes(), &[1; 12]].concat();
    let loaded = read_volume(&one("a.nrrd", bytes), "a.nrrd", &options()).expect("a volume");
    assert_eq!(loaded.warnings.len(), 1);
    let vectors = format!("space directions: {}\n", "(1,0,0)".repeat(8000));
    let header = nrrd_header("uchar", "raw", &vectors) + "\n";
    read(&one("a.nrrd", header), "a.nrrd");
}

#[test]
fn voxels_all_nan_or_of_all_bits() {
    for voxel_type in VoxelType::ALL {
        for byte in [0x7f, 0xff, 0x80, 0x00] {
            for endian in [Endian::Little, Endian::Big] {
                let raw = RawLayout::new([2, 2, 2], voxel_type)
                    .with_endian(endian)
                    .with_scale(f64::from(f32::MAX), -1.0);
                let bytes = vec![byte; 8 * voxel_type.bytes() as usize];
                let options = options().with_raw(raw);
                if let Ok(loaded) = read_volume(&one("a", bytes), "a", &options) {
                    assert!(loaded.volume.range().iter().all(|value| value.is_finite()));
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        for name in ["a.nrrd", "a.nii", "a.nii.gz", "a.hdr", "a.json"] {
            read(&one(name, bytes.clone()), name);
        }
        let _ = View::parse(&bytes, Path::new("a.view.json"));
    }

    #[test]
    fn random_bytes_behind_a_valid_start(bytes in prop::collection::vec(any::<u8>(), 0..1000)) {
        let header = [b"NRRD0004\n", &bytes[..]].concat();
        read(&one("a.nrrd", header), "a.nrrd");
        for big in [false, true] {
            let start = Nifti::new(1, big);
            let mut header = start.bytes[..4].to_vec();
            header.extend(&bytes);
            header.resize(352, 0);
            header[344..348].copy_from_slice(b"n+1\0");
            read(&one("a.nii", header), "a.nii");
        }
    }

    #[test]
    fn sizes_that_lie(sizes in prop::array::uniform3(any::<u64>()), shift in 0_u32..64) {
        let [x, y, z] = sizes.map(|size| size >> shift);
        for encoding in ["raw", "gzip"] {
            let header = nrrd_header("double", encoding, "\n")
                .replace("3 2 2", &format!("{x} {y} {z}"));
            let bytes = [header.as_bytes(), &files::gzip(&[0; 96])].concat();
            read(&one("a.nrrd", bytes), "a.nrrd");
        }
        let mut nifti = Nifti::new(2, false);
        nifti.dim(1, x as i64).dim(2, y as i64).dim(3, z as i64);
        read(&one("a.nii", nifti.file()), "a.nii");
        let raw = RawLayout::new([x, y, z], VoxelType::U8).with_byte_skip(x);
        let options = options().with_raw(raw);
        let _ = read_volume(&one("a", vec![0; 100]), "a", &options);
    }

    #[test]
    fn numbers_in_every_field(values in prop::array::uniform24(any::<f64>())) {
        let lines = format!(
            "spacings: {} {} {}\nspace directions: ({},{},{}) ({},{},{}) ({},{},{})\n\
             space origin: ({},{},{})\n\n",
            values[0], values[1], values[2], values[3], values[4], values[5], values[6],
            values[7], values[8], values[9], values[10], values[11], values[12], values[13],
            values[14],
        );
        let bytes = [nrrd_header("uchar", "raw", &lines).as_bytes(), &[0; 12]].concat();
        read(&one("a.nrrd", bytes), "a.nrrd");
        for (version, big) in [(1, false), (2, true)] {
            let mut nifti = Nifti::new(version, big);
            for (index, &value) in values.iter().take(4).enumerate() {
                nifti.pixdim(index, value);
            }
            nifti.scale(values[4], values[5]);
            nifti.qform(1, values[6..12].try_into().expect("six"));
            nifti.sform(1, values[12..24].try_into().expect("twelve"));
            read(&one("a.nii", nifti.file()), "a.nii");
        }
    }
}
