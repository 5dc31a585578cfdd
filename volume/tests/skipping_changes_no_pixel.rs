//! Every way to leave out empty space, against taking every sample of the box: the same picture to the
//! last bit, on real volumes, in every instruction set. Skipped where the data is not there.

use std::path::PathBuf;

use raywright_bvh::{BuildWorkspace, Isa};
use raywright_volume::{
    CastOptions, EnclosureKind, EnclosureParams, LoadOptions, Raycaster, Skipping,
    TransferFunction, View, load_volume, transfer::ControlPoint,
};

const SIZE: [u32; 2] = [160, 160];

/// Opaque between two of the values that voxels have, and nowhere else: only interpolation sees it.
fn between_voxels([low, high]: [f32; 2]) -> TransferFunction {
    let middle = (low + (high - low) * 0.4).floor() + 0.5;
    let width = (high - low) * 2e-3;
    let point = |value: f32, opacity: f32| ControlPoint {
        value,
        colour: [1.0, 0.7, 0.2],
        opacity,
    };
    let points = vec![
        point(middle - width, 0.0),
        point(middle, 0.8),
        point(middle + width, 0.0),
    ];
    TransferFunction::new(points).expect("three points")
}

#[test]
fn three_volumes_three_functions_and_every_kernel() {
    let shared = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/volumes");
    let mut compared = 0;
    for file in ["head_ct_be.nii.gz", "isabel.nrrd", "nuclei.nhdr"] {
        let path = shared.join(file);
        if !path.exists() {
            println!("skipped: {} is not there", path.display());
            return;
        }
        let volume = load_volume(&path, &LoadOptions::default())
            .expect("a volume")
            .volume;
        let mut view = View::read(&View::path_for(&path)).expect("a view");
        let functions = &mut view.transfer_functions;
        functions.insert("narrow".into(), between_voxels(volume.range()));
        assert_eq!(functions.len(), 3);
        let caster = Raycaster::new(&volume).expect("a volume of usual size");
        for (name, function) in functions {
            let mut prepared = caster.prepare(function);
            for (camera_name, camera) in &view.cameras {
                let mut options = CastOptions::default();
                options.isa = Isa::Portable;
                options.skipping = Skipping::None;
                let whole = prepared.render(*camera, SIZE, &options).expect("a picture");
                assert!(
                    whole.opacity.iter().any(|&o| o > 0.0),
                    "{file} {name}: black"
                );
                for way in [
                    None,
                    Some(EnclosureKind::Hull),
                    Some(EnclosureKind::Segments),
                ] {
                    options.skipping = match way {
                        None => Skipping::Distance,
                        Some(kind) => {
                            let mut params = EnclosureParams::new(kind);
                            params.block_edge = 8;
                            prepared
                                .enclose(&params, &mut BuildWorkspace::default())
                                .expect("an enclosure");
                            Skipping::Enclosure
                        }
                    };
                    for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                        options.isa = isa;
                        let picture = prepared.render(*camera, SIZE, &options).expect("a picture");
                        let what = format!("{file} {name} {camera_name} {way:?} {isa}");
                        assert_eq!(picture.image, whole.image, "{what}");
                        assert_eq!(picture.opacity, whole.opacity, "{what}");
                        assert_eq!(picture.end, whole.end, "{what}");
                        assert!(picture.work.samples <= whole.work.samples, "{what}");
                        compared += 1;
                    }
                }
            }
        }
    }
    assert!(compared >= 3 * 3 * 2 * 3);
}
