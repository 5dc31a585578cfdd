//! Raw voxels with a description, missing and infinite values, and files on disk.

mod files;

use std::{fs, path::Path};

use files::{Files, gzip, one, seeds};
use raywright_volume::load::{
    Endian, LoadError, LoadOptions, Loaded, MissingValues, RawLayout, VoxelType, Warning,
    load_volume, read_volume,
};

fn described(bytes: &[u8], raw: RawLayout) -> Result<Loaded, LoadError> {
    let options = LoadOptions::default().with_raw(raw);
    read_volume(&one("a.dat", bytes), "a.dat", &options)
}

fn message(result: Result<Loaded, LoadError>) -> String {
    let error = result.expect_err("refused");
    let cause = std::error::Error::source(&error).map(ToString::to_string);
    format!("{error}: {}", cause.unwrap_or_default())
}

#[test]
fn voxels_that_the_caller_describes() {
    let bytes = [&b"head"[..], &[0, 1, 0, 2, 0, 3, 0xff, 0xff]].concat();
    let raw = RawLayout::new([2, 2, 1], VoxelType::I16)
        .with_endian(Endian::Big)
        .with_spacing([0.5, 1.0, 2.0])
        .with_byte_skip(4)
        .with_scale(2.0, 10.0);
    let loaded = described(&bytes, raw.clone()).unwrap();
    assert_eq!(loaded.volume.range(), [8.0, 16.0]);
    assert_eq!(loaded.volume.spacing(), [0.5, 1.0, 2.0]);
    let zipped = one("a.RAW.GZ", gzip(&bytes));
    let options = LoadOptions::default().with_raw(raw.clone());
    assert!(read_volume(&zipped, "a.RAW.GZ", &options).is_ok());
    assert!(described(&bytes[..11], raw.clone()).is_err());
    assert!(described(&bytes[..3], raw.clone()).is_err());
    let no_order = RawLayout::new([2, 2, 1], VoxelType::I16);
    assert!(message(described(&bytes, no_order)).contains("order of the bytes"));
    assert!(described(&bytes, RawLayout::new([0, 2, 1], VoxelType::U8)).is_err());
    assert!(described(&bytes, RawLayout::new([u64::MAX; 3], VoxelType::U8)).is_err());
    assert!(described(&bytes, raw.with_byte_skip(u64::MAX)).is_err());
}

#[test]
fn descriptions_that_are_refused() {
    let (files, name) = seeds("raw").remove(0);
    let good = String::from_utf8(files["a.json"].clone()).expect("text");
    let with = |text: String| {
        let mut files: Files = files.clone();
        files.insert("a.json".into(), text.into());
        read_volume(&files, &name, &LoadOptions::default())
    };
    let loaded = with(good.clone()).unwrap();
    assert_eq!(loaded.volume.spacing(), [1.0, 2.0, 3.0]);
    assert_eq!(loaded.volume.orientation().origin.z, 1.0);
    assert_eq!(loaded.volume.range(), [1.0, 12.0]);
    assert_eq!(loaded.warnings, [Warning::Missing { count: 1 }]);
    for (from, to, expected) in [
        ("raywright-raw-1", "raywright-raw-2", "raywright-raw-1"),
        ("\"f32\"", "\"f16\"", "f16"),
        ("\"f32\"", "7", "line 1"),
        ("\"little\"", "\"middle\"", "middle"),
        ("\"endian\": \"little\",", "", "order of the bytes"),
        ("[3, 2, 2]", "[3, 2]", "line 2"),
        ("[3, 2, 2]", "[3, 2, -2]", "line 2"),
        ("[3, 2, 2]", "[3, 0, 2]", "dims"),
        ("[3, 2, 2]", "[3, 2, 2.5]", "line 2"),
        ("[3, 2, 2]", "[99999999999, 99999999999, 2]", "limit"),
        ("x fastest", "z fastest", "x fastest"),
        ("\"none\"", "\"zstd\"", "zstd"),
        ("48", "47", "47 bytes are announced"),
        ("slope", "slop", "slop"),
        ("a.raw", "../a.raw", "not below the folder"),
        ("a.raw", "b.raw", "b.raw"),
        ("{", "", "line 1"),
    ] {
        assert!(good.contains(from), "{from}");
        let text = message(with(good.replacen(from, to, 1)));
        assert!(text.contains(expected), "{to}: {text}");
    }
    assert!(message(with(" ".repeat(1 << 21))).contains("more than"));
}

#[test]
fn missing_and_infinite_values() {
    let values = [
        1.0_f32,
        f32::NAN,
        f32::INFINITY,
        3.0,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let raw = RawLayout::new([6, 1, 1], VoxelType::F32)
        .with_endian(Endian::Little)
        .with_scale(-2.0, 1.0);
    let loaded = described(&bytes, raw.clone()).unwrap();
    assert_eq!(
        loaded.warnings,
        [
            Warning::Missing { count: 2 },
            Warning::Infinite { count: 2 }
        ]
    );
    assert_eq!(loaded.volume.range(), [-5.0, -1.0]);
    assert!(loaded.volume.value([1, 0, 0]).is_nan());
    let options = LoadOptions::default()
        .with_raw(raw)
        .with_missing(MissingValues::Fill(-3.0));
    let filled = read_volume(&one("a", bytes), "a", &options).unwrap();
    assert_eq!(filled.warnings, [Warning::Infinite { count: 2 }]);
    assert_eq!(filled.volume.value([1, 0, 0]), -3.0);
    assert_eq!(filled.volume.missing(), 0);

    let nothing: Vec<u8> = [f32::NAN; 6].iter().flat_map(|v| v.to_le_bytes()).collect();
    let raw = RawLayout::new([6, 1, 1], VoxelType::F32).with_endian(Endian::Little);
    let loaded = described(&nothing, raw).unwrap();
    assert_eq!(
        (loaded.volume.missing(), loaded.volume.range()),
        (6, [0.0, 0.0])
    );
}

#[test]
fn a_constant_volume() {
    let loaded = described(&[7; 8], RawLayout::new([2, 2, 2], VoxelType::U8)).unwrap();
    assert_eq!(loaded.volume.range(), [7.0, 7.0]);
}

#[test]
fn files_on_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    let options = LoadOptions::default();
    for reader in ["nrrd", "nifti", "raw"] {
        for (files, name) in seeds(reader) {
            for (name, bytes) in &files {
                fs::write(folder.path().join(name), bytes).expect("a file");
            }
            let loaded = load_volume(&folder.path().join(&name), &options);
            assert_eq!(
                loaded.expect("a volume").volume.dims(),
                read_volume(&files, &name, &options)
                    .expect("a volume")
                    .volume
                    .dims()
            );
        }
    }
    let refused = |name: &str| load_volume(&folder.path().join(name), &options).unwrap_err();
    assert!(matches!(refused("absent.nrrd"), LoadError::Io { .. }));
    assert!(matches!(refused("a.vti"), LoadError::UnknownFormat { .. }));
    assert!(matches!(refused("a.raw"), LoadError::NotDescribed { .. }));
    fs::create_dir(folder.path().join("d.nii")).expect("a folder");
    assert!(matches!(refused("d.nii"), LoadError::Io { .. }));
    let nowhere = load_volume(Path::new("/"), &options);
    assert!(matches!(nowhere, Err(LoadError::UnknownFormat { .. })));
}

/// A pipe has no length and may never end.
#[cfg(unix)]
#[test]
fn devices_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("zero.nii");
    std::os::unix::fs::symlink("/dev/zero", &path).expect("a link");
    let result = load_volume(&path, &LoadOptions::default());
    assert!(matches!(result, Err(LoadError::Io { .. })));
}
