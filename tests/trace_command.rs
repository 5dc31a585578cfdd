//! `raywright trace`: rays of others, and hits as the library tells them.

#![cfg(feature = "cli")]

use std::{fs, path::Path, process::Command};

use raywright::{
    bvh::{Accuracy, BuildParams, Ray},
    tracer::{World, generate},
};

fn trace(folder: &Path, args: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_raywright"))
        .arg("trace")
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// Rays through the built-in room in all directions, one of them broken, some with an interval.
fn rays() -> Vec<Ray> {
    let mut rays: Vec<Ray> = (0..500)
        .map(|i| {
            let turn = i as f32 * 2.399_963;
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let r = (1.0 - z * z).sqrt();
            let origin = [0.1 * turn.sin(), 1.0 + 0.2 * z, 0.1 * turn.cos()];
            let ray = Ray::new(origin, [r * turn.cos(), r * turn.sin(), z]);
            ray.with_range(0.0, if i % 3 == 0 { 1.5 } else { f32::INFINITY })
        })
        .collect();
    rays.push(Ray::new([f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0]));
    rays
}

fn row(ray: &Ray) -> Vec<f32> {
    let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
    [&origin[..], &direction, &[ray.t_min, ray.t_max]].concat()
}

fn csv(rays: &[Ray]) -> String {
    let line = |ray| {
        let numbers: Vec<String> = row(ray).iter().map(ToString::to_string).collect();
        numbers.join(",") + "\n"
    };
    rays.iter().map(line).collect()
}

/// As `numpy.save` writes an array of f4 in two dimensions.
fn npy(rays: &[Ray]) -> Vec<u8> {
    let header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, 8), }}",
        rays.len()
    );
    let header = format!("{header:<117}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(rays.iter().flat_map(row).flat_map(f32::to_le_bytes));
    bytes
}

#[test]
fn hits_are_those_of_the_library_to_the_last_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let rays = rays();
    fs::write(folder.path().join("rays.csv"), csv(&rays)).expect("a file");
    fs::write(folder.path().join("rays.npy"), npy(&rays)).expect("a file");
    let world = World::new(generate::by_name("interior").expect("built in"));
    for (accuracy, name, input) in [
        (Accuracy::Fast, "fast", "rays.csv"),
        (Accuracy::Robust, "robust", "rays.npy"),
    ] {
        let mut params = BuildParams::default();
        params.branching_factor = 4;
        params.accuracy = accuracy;
        let tree = world.build_tree(&params, &mut Default::default()).unwrap();
        let set = format!("accuracy={name}");
        let common = [
            "interior",
            "--rays",
            input,
            "-D",
            "branching_factor=4",
            "-D",
        ];
        let (code, said, errors) = trace(folder.path(), &[&common[..], &[&set]].concat());
        assert_eq!(code, Some(0), "{errors}");
        let expected: Vec<_> = rays.iter().map(|ray| tree.closest_hit(ray)).collect();
        let count = expected.iter().flatten().count();
        assert!(count > 200 && count < rays.len(), "{count}");
        assert!(said.contains(&format!("{count} of 501 rays hit")), "{said}");
        let hits = fs::read_to_string(folder.path().join("hits.csv")).expect("hits");
        let lines: Vec<&str> = hits.lines().collect();
        assert_eq!(lines.len(), rays.len() + 1);
        for (line, expected) in lines[1..].iter().zip(&expected) {
            let Some(hit) = expected else {
                assert_eq!(*line, "inf,0,0,-1,-1");
                continue;
            };
            let fields: Vec<&str> = line.split(',').collect();
            let numbers: Vec<f32> = fields[..3].iter().map(|f| f.parse().unwrap()).collect();
            assert_eq!(numbers, [hit.t, hit.u, hit.v]);
            let ids = [hit.geometry_id, hit.primitive_id].map(|id| id.to_string());
            assert_eq!(fields[3..], ids);
        }
        let any = ["--any", "-o", "any.npy"];
        let (code, _, errors) = trace(folder.path(), &[&common[..], &[&set], &any].concat());
        assert_eq!(code, Some(0), "{errors}");
        let bytes = fs::read(folder.path().join("any.npy")).expect("hits");
        let values: Vec<f64> = bytes[bytes.len() - 8 * rays.len()..]
            .chunks_exact(8)
            .map(|value| f64::from_le_bytes(value.try_into().unwrap()))
            .collect();
        let expected: Vec<f64> = expected
            .iter()
            .map(|hit| f64::from(u8::from(hit.is_some())))
            .collect();
        assert_eq!(values, expected);
    }
}

#[test]
fn bad_input_is_told_before_anything_is_built() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("rays.csv"), "0,0,0,1,0,0\n1,2,3\n").expect("a file");
    fs::write(folder.path().join("rays.txt"), "").expect("a file");
    for (args, said) in [
        (&["no.obj", "--rays", "rays.csv"][..], "rays.csv"),
        (&["no.obj", "--rays", "none.csv"], "none.csv"),
        (&["no.obj", "--rays", "rays.txt"], "neither .csv nor .npy"),
        (
            &["interior", "--rays", "rays.csv", "-o", "hits"],
            "neither .csv nor .npy",
        ),
        (
            &["interior", "--rays", "rays.csv", "-D", "accuracy=x"],
            "accuracy",
        ),
        (&["interior"], "--rays"),
    ] {
        let (code, _, errors) = trace(folder.path(), args);
        assert_eq!(code, Some(2), "{errors}");
        assert!(
            errors.contains(said) && !errors.contains("panicked"),
            "{errors}"
        );
    }
}
