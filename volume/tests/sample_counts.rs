//! Samples of real volumes, counted and estimated, against the counts of another caster
//! (`samples.csv` of the shared reference data). Skipped where the data is not there.

use std::{fs, path::PathBuf};

use raywright_volume::{
    CastOptions, EstimateMethod, Estimator, LoadOptions, Raycaster, View, Volume, load_volume,
};

fn shared() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data")
}

/// The rows of the reference: volume, transfer function, camera, step, then counts.
fn rows() -> Option<Vec<Vec<String>>> {
    let path = shared().join("volume-reference/samples.csv");
    let Ok(text) = fs::read_to_string(&path) else {
        println!("skipped: {} is not there", path.display());
        return None;
    };
    let mut lines = text.lines();
    let head = lines.next()?;
    assert!(head.starts_with("volume,tf,camera,step_voxels,rays_hit,in_box,in_hull16"));
    assert!(head.contains(",hull16_until_0.98,blocks8_until_0.98,blocks4_until_0.98,"));
    Some(
        lines
            .map(|line| line.split(',').map(str::to_owned).collect())
            .collect(),
    )
}

fn number(row: &[String], column: usize) -> f64 {
    row[column].parse().expect("a number")
}

fn load(file: &str) -> (Volume, View) {
    let path = shared().join("volumes").join(file);
    let loaded = load_volume(&path, &LoadOptions::default()).expect("a volume");
    (
        loaded.volume,
        View::read(&View::path_for(&path)).expect("a view"),
    )
}

const SIZE: [u32; 2] = [512, 512];

#[test]
fn as_many_samples_as_another_caster_takes() {
    let Some(rows) = rows() else { return };
    let mut compared = 0;
    for (name, file) in [
        ("head_ct_be", "head_ct_be.nii.gz"),
        ("isabel", "isabel.nrrd"),
        ("fingers", "fingers.nrrd"),
    ] {
        let (volume, view) = load(file);
        let caster = Raycaster::new(&volume).expect("a volume of usual size");
        for row in rows.iter().filter(|row| row[0] == name) {
            let mut options = CastOptions::default();
            options.step = number(row, 3) as f32;
            let picture = caster
                .render(
                    &view.transfer_functions[&row[1]],
                    view.cameras[&row[2]],
                    SIZE,
                    &options,
                )
                .expect("a picture");
            // Contraction was allowed there, and tables had other sizes: rays end a sample sooner
            // or later, and a block with hardly anything in it is empty or not. Ours also takes up to
            // five samples beyond such a block, which has four at the shortest.
            let ratio = picture.work.samples as f64 / number(row, 13);
            assert!((0.99..1.3).contains(&ratio), "{row:?}: {ratio}");
            compared += 1;
        }
    }
    assert_eq!(compared, 24);
}

#[test]
fn estimates_are_near_the_counts() {
    let Some(rows) = rows() else { return };
    let mut compared = 0;
    for file in [
        "stent.nrrd",
        "chest.nii.gz",
        "head_mr.nii.gz",
        "lung.json",
        "head_ct_be.nii.gz",
        "nuclei.nhdr",
        "fingers.nrrd",
        "isabel.nrrd",
        "tomo.nrrd",
    ] {
        let (volume, view) = load(file);
        let estimator = Estimator::new(&volume);
        let name = file.split('.').next().expect("a name");
        for row in rows.iter().filter(|row| row[0] == name) {
            let mut options = CastOptions::default();
            options.step = number(row, 3) as f32;
            let ratio = |method| {
                let (function, camera) =
                    (&view.transfer_functions[&row[1]], &view.cameras[&row[2]]);
                let prepared = estimator.prepare(function, method);
                let estimate = prepared.estimate(camera, SIZE, &options, 0);
                estimate.expect("an estimate").samples() / number(row, 11)
            };
            for method in [EstimateMethod::CubeRoot, EstimateMethod::MeanExtinction] {
                assert!(
                    (0.82..1.12).contains(&ratio(method)),
                    "{row:?} {method:?}: {}",
                    ratio(method)
                );
            }
            // Bins of equal size take the smallest opacities for a thirtieth.
            if row[..3] == ["chest", "dense", "close"] {
                assert!(ratio(EstimateMethod::PaperLinear) < 0.6);
            }
            compared += 1;
        }
    }
    assert_eq!(compared, 72);
}
