//! The wrapper of Embree, where the library is: its trees are the golden ones, its hits are ours,
//! its refusals are errors.

use std::path::Path;

use raywright_bvh::{BuildParams, Bvh, Isa, Ray, TriangleMesh, Vec3};
use raywright_validation::{
    Tree, TriangleSet,
    embree::{BuildArguments, BuildQuality, Device, Embree, EmbreeError, EmbreeHit, SceneSettings},
    golden::{self, Outcome},
    random::RandomBuild,
};

/// A device; says so if there is no library.
fn device() -> Option<Device> {
    match Embree::find() {
        Ok(embree) => Some(embree.device(1).expect("a device")),
        Err(error @ EmbreeError::NotFound { .. }) => {
            eprintln!("skipped: {error}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn set(name: &str) -> TriangleSet {
    golden::procedural(name).expect("a set")
}

fn arguments(quality: BuildQuality, n: usize) -> BuildArguments {
    let params = BuildParams::embree_api_default();
    let arguments = BuildArguments::of(&params, n).expect("a quality of Embree's");
    BuildArguments {
        quality,
        capacity: if quality == BuildQuality::High {
            2 * n
        } else {
            n
        },
        ..arguments
    }
}

/// Hashes of `sets.jsonl`, cases 0, 28, 76 of uniform1000: these need no data.
#[test]
fn trees_are_the_golden_ones() {
    let Some(device) = device() else { return };
    let set = set("uniform1000");
    let corners = |reference| set.corners(reference);
    for (quality, expected) in [
        (BuildQuality::Low, 0xde55_97d1_34ef_fe4b_u64),
        (BuildQuality::Medium, 0xbbe1_4fdc_cc38_0d4e),
        (BuildQuality::High, 0xfa59_6651_ec80_ebea),
    ] {
        let arguments = arguments(quality, set.triangles.len());
        let built = device.build(&set.primitives(), Some(&corners), &arguments);
        let tree = built.expect("built").tree().expect("a whole tree");
        let hash = golden::ordered(&tree.root.expect("a root"));
        assert_eq!(hash, expected, "{quality:?}");
    }
}

#[test]
fn what_embree_refuses_is_an_error() {
    let Some(device) = device() else { return };
    let set = set("uniform1000");
    let refused = |change: fn(&mut BuildArguments)| {
        let mut arguments = arguments(BuildQuality::Medium, set.triangles.len());
        change(&mut arguments);
        device.build(&set.primitives(), None, &arguments).err()
    };
    let error = refused(|a| a.branching_factor = 17).expect("an error");
    assert!(matches!(error, EmbreeError::Refused { code: 1 }), "{error}");
    let error = refused(|a| (a.max_depth, a.max_leaf_size) = (8, 1)).expect("an error");
    assert!(matches!(error, EmbreeError::Refused { code: 1 }), "{error}");
    let error = refused(|a| a.sah_block_size = 0).expect("an error");
    assert!(matches!(error, EmbreeError::Crashes { .. }), "{error}");
    assert!(refused(|_| {}).is_none(), "errors do not stay");
}

#[test]
fn high_without_corners_is_medium() {
    let Some(device) = device() else { return };
    let set = set("diagonals500");
    let tree = |quality| -> Tree {
        let arguments = arguments(quality, set.triangles.len());
        let built = device.build(&set.primitives(), None, &arguments);
        built.expect("built").tree().expect("a whole tree")
    };
    assert_eq!(tree(BuildQuality::High), tree(BuildQuality::Medium));
}

/// Rays through a set of triangles, from all sides.
fn rays() -> impl Iterator<Item = Ray> {
    (0..2000_u32).map(|i| {
        let number = |k: u32| (i * 7919 + k * 104_729) % 1009;
        let point = |k: u32| Vec3::from_array([0, 1, 2].map(|a| number(k + a) as f32 / 1009.0));
        let origin = point(0) * 3.0 - Vec3::ONE;
        Ray::new(origin, point(3) - origin)
    })
}

#[test]
fn hits_are_ours() {
    let Some(device) = device() else { return };
    let set = set("uniform1000");
    let vertices: Vec<Vec3> = set.triangles.iter().flatten().copied().collect();
    let indices = (0..set.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let mesh = TriangleMesh::new(vertices, indices.collect()).expect("a mesh");
    let ours = Bvh::build(&[&mesh], &BuildParams::default()).expect("a tree");
    for quality in [BuildQuality::Low, BuildQuality::Medium, BuildQuality::High] {
        let settings = SceneSettings::of_quality(quality);
        let scene = device.scene(&[&mesh], &settings).expect("a scene");
        let scene = scene.commit().expect("committed");
        let mut hits = 0;
        for ray in rays() {
            let (ours, theirs) = (ours.closest_hit(&ray), scene.closest_hit(&ray));
            assert_eq!(scene.any_hit(&ray), theirs.is_some(), "{ray:?}");
            match (ours, theirs) {
                (Some(a), Some(b)) => {
                    hits += 1;
                    assert_eq!(a.primitive_id, b.primitive_id, "{ray:?}");
                    assert!((a.t - b.t).abs() <= 1e-5 * a.t, "{} {}", a.t, b.t);
                    assert!((a.u - b.u).abs() + (a.v - b.v).abs() < 1e-3, "{a:?} {b:?}");
                }
                (None, None) => {}
                (a, b) => panic!("{ray:?}: {a:?} against {b:?}"),
            }
        }
        assert!(hits > 500, "{hits} hits");
    }
}

/// Also of a packet that is not full.
#[test]
fn packets_and_narrow_instructions_have_the_hits_of_single_rays() {
    let Some(device) = device() else { return };
    let embree = Embree::find().expect("found before");
    let narrow = embree.device_held_to(1, Isa::Avx2).expect("a device");
    assert_ne!(narrow.instruction_set(), "AVX-512");
    let set = set("uniform1000");
    let vertices: Vec<Vec3> = set.triangles.iter().flatten().copied().collect();
    let indices = (0..set.triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let mesh = TriangleMesh::new(vertices, indices.collect()).expect("a mesh");
    let settings = SceneSettings::of_quality(BuildQuality::Medium);
    let rays: Vec<Ray> = rays().take(1997).collect();
    let (mut hits, mut are_hit) = (Vec::new(), Vec::new());
    let same = |a: Option<EmbreeHit>, b: Option<EmbreeHit>| match (a, b) {
        (Some(a), Some(b)) => (a.t - b.t).abs() <= 1e-5 * a.t,
        (a, b) => a == b,
    };
    let scene = device.scene(&[&mesh], &settings).expect("a scene");
    let scene = scene.commit().expect("committed");
    let expected: Vec<_> = rays.iter().map(|ray| scene.closest_hit(ray)).collect();
    scene.closest_hits(&rays, &mut hits);
    scene.any_hits(&rays, &mut are_hit);
    assert_eq!((hits.len(), are_hit.len()), (rays.len(), rays.len()));
    let narrow = narrow.scene(&[&mesh], &settings).expect("a scene");
    let narrow = narrow.commit().expect("committed");
    for (i, ray) in rays.iter().enumerate() {
        assert!(same(expected[i], hits[i]), "{ray:?}");
        assert!(same(expected[i], narrow.closest_hit(ray)), "{ray:?}");
        assert_eq!(are_hit[i], expected[i].is_some(), "{ray:?}");
    }
}

#[test]
fn a_library_that_is_not_there_is_an_error() {
    let error = Embree::load(Path::new("no-such-library")).expect_err("no library");
    assert!(matches!(error, EmbreeError::NotEmbree { .. }), "{error}");
}

/// Thousands more: `cargo run --release -p raywright-validation -- trees --random`.
#[test]
fn random_builds_are_equal() {
    let Some(device) = device() else { return };
    let mut workspace = Default::default();
    let mut equal = 0;
    for seed in 0..200 {
        let build = RandomBuild::new(seed, &[]);
        match build.compare(&device, &mut workspace) {
            (Outcome::Equal, _) => equal += 1,
            (Outcome::Skipped(why), _) => eprintln!("skipped: seed {seed}: {why}"),
            (outcome, details) => panic!("{build}\n{outcome:?} {details:?}"),
        }
    }
    assert!(equal > 150, "{equal} were compared");
}
