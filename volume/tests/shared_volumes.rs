//! The nine volumes of the shared data load with the figures of their table, and their views fit.
//! Where the shared data are absent, the tests say so and pass.

use std::path::PathBuf;

use raywright_volume::{
    Statistics, View,
    load::{Endian, Format, LoadOptions, PlacementSource, VoxelType, load_volume},
};

/// The folder, if it is there.
fn folder() -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/volumes");
    let there = path.is_dir();
    if !there {
        eprintln!("skipped: {} is absent", path.display());
    }
    there.then_some(path)
}

struct Row {
    file: &'static str,
    format: Format,
    voxel_type: VoxelType,
    dims: [usize; 3],
    spacing: [f32; 3],
    range: [f32; 2],
    /// With the digits that the table has.
    mean: &'static str,
}

fn row(
    file: &'static str,
    format: Format,
    voxel_type: VoxelType,
    dims: [usize; 3],
    spacing: [f32; 3],
    range: [f32; 2],
    mean: &'static str,
) -> Row {
    Row {
        file,
        format,
        voxel_type,
        dims,
        spacing,
        range,
        mean,
    }
}

fn table() -> [Row; 9] {
    use Format::{Nifti1, Nrrd, Raw};
    use VoxelType::{F32, I8, I16, U8, U16};
    [
        row(
            "stent.nrrd",
            Nrrd,
            I16,
            [128, 128, 256],
            [1.0; 3],
            [0.0, 2000.0],
            "35.4",
        ),
        row(
            "chest.nii.gz",
            Nifti1,
            U16,
            [256, 256, 275],
            [1.5625, 1.5625, 1.0],
            [-1000.0, 1880.0],
            "-620.1",
        ),
        row(
            "head_mr.nii.gz",
            Nifti1,
            U8,
            [301, 370, 316],
            [0.5; 3],
            [0.0, 130.0],
            "34.72",
        ),
        row(
            "lung.json",
            Raw,
            U8,
            [256, 256, 133],
            [1.40625, 1.40625, 2.5],
            [0.0, 255.0],
            "7.055",
        ),
        row(
            "head_ct_be.nii.gz",
            Nifti1,
            I16,
            [64, 64, 93],
            [3.2, 3.2, 1.5],
            [0.0, 3926.0],
            "507.7",
        ),
        row(
            "nuclei.nhdr",
            Nrrd,
            U16,
            [256, 256, 60],
            [0.26, 0.26, 0.29],
            [0.0, 65535.0],
            "7015",
        ),
        row(
            "fingers.nrrd",
            Nrrd,
            F32,
            [64; 3],
            [1.0; 3],
            [0.0, 110.958],
            "13.25",
        ),
        row(
            "isabel.nrrd",
            Nrrd,
            F32,
            [125, 125, 25],
            [4.00803, 4.00803, 4.04082],
            [0.0, 78.6594],
            "11.79",
        ),
        row(
            "tomo.nrrd",
            Nrrd,
            I8,
            [135, 135, 101],
            [1.0; 3],
            [-64.0, 95.0],
            "-0.002096",
        ),
    ]
}

/// Half of the last digit of a decimal.
fn half_digit(text: &str) -> f64 {
    let digits = text
        .split_once('.')
        .map_or(0, |(_, fraction)| fraction.len());
    0.5 * 10_f64.powi(-(digits as i32)) * 1.000_001
}

#[test]
fn all_load_with_the_figures_of_the_table() {
    let Some(folder) = folder() else { return };
    for row in table() {
        let name = row.file;
        let loaded = load_volume(&folder.join(name), &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|error| panic!("{name}: {error:?}"));
        assert_eq!(loaded.warnings, [], "{name}");
        assert_eq!(loaded.source.format, row.format, "{name}");
        assert_eq!(loaded.source.voxel_type, row.voxel_type, "{name}");
        assert!(loaded.source.compressed, "{name}");
        let volume = &loaded.volume;
        assert_eq!(volume.dims(), row.dims, "{name}");
        for (got, expected) in volume.spacing().iter().zip(row.spacing) {
            assert!((got - expected).abs() < 1e-5, "{name}: spacing {got}");
        }
        for (got, expected) in volume.range().iter().zip(row.range) {
            assert!(
                (got - expected).abs() <= 1e-6 * expected.abs() * 5.0,
                "{name}: range {got}"
            );
        }
        let expected: f64 = row.mean.parse().expect("a number");
        let mean = Statistics::of(volume).mean;
        assert!(
            (mean - expected).abs() <= half_digit(row.mean),
            "{name}: mean {mean}"
        );
        assert_eq!((volume.missing(), volume.clamped()), (0, 0), "{name}");
    }
}

#[test]
fn what_their_headers_say_besides() {
    let Some(folder) = folder() else { return };
    let facts = |name: &str| {
        let loaded = load_volume(&folder.join(name), &LoadOptions::default());
        loaded.expect("a volume").source
    };
    let head = facts("head_ct_be.nii.gz");
    assert_eq!((head.endian, head.placements.len()), (Some(Endian::Big), 0));
    assert_eq!(facts("stent.nrrd").endian, Some(Endian::Little));
    assert_eq!(facts("tomo.nrrd").endian, None);
    let lung = facts("lung.json");
    assert_eq!(lung.data_bytes, 8_716_288);
    assert_eq!(lung.placements[0].source, PlacementSource::Description);
}

#[test]
fn their_views_are_read_and_fit() {
    let Some(folder) = folder() else { return };
    for row in table() {
        let path = View::path_for(&folder.join(row.file));
        let view = View::read(&path).unwrap_or_else(|error| panic!("{error:?}"));
        let names: Vec<_> = view.transfer_functions.keys().collect();
        assert_eq!(names, ["dense", "sparse"], "{}", row.file);
        let names: Vec<_> = view.cameras.keys().collect();
        assert_eq!(names, ["close", "overview"], "{}", row.file);
        for camera in view.cameras.values() {
            camera.projection(512, 512).expect("a view");
        }
        for function in view.transfer_functions.values() {
            let last = function.points().last().expect("points").value;
            assert!((last - row.range[1]).abs() < 1.0, "{}", row.file);
        }
    }
}
