//! Rays that start from a hit do not find the triangle that was hit again, whichever test is used:
//! on the way to any side, and at flat angles, where errors of distances are largest. Checked on a
//! generated room and on real scenes, whose long thin triangles are what small examples lack.

use std::path::Path;

use raywright_tracer::bvh::{Accuracy, BuildParams, Bvh, Ray, TriangleMesh, Vec3};
use raywright_tracer::imaging::PixelSampler;
use raywright_tracer::load::load_scene;
use raywright_tracer::{Scene, Surface, generate};

const RAYS: u32 = 30_000;

/// The vector of a number in the cube -1..1.
fn vector(numbers: &PixelSampler, number: u32) -> Vec3 {
    let component = |axis| numbers.uniform(3 * number + axis);
    Vec3::new(component(0), component(1), component(2)) * 2.0 - 1.0
}

/// How many rays hit what they leave, and how many were sent.
fn self_hits(scene: &Scene, accuracy: Accuracy) -> [usize; 2] {
    let meshes: Vec<&TriangleMesh> = scene.meshes.iter().map(|mesh| &mesh.triangles).collect();
    let mut params = BuildParams::default();
    params.accuracy = accuracy;
    let tree = Bvh::build(&meshes, &params).unwrap();
    let bounds = scene.bounds();
    let (centre, half) = (
        bounds.min.midpoint(bounds.max),
        (bounds.max - bounds.min) * 0.5,
    );
    let [mut found, mut sent] = [0; 2];
    for ray in 0..RAYS {
        let numbers = PixelSampler::new(1, 0, 0, ray);
        let ray = Ray::new(centre + half * vector(&numbers, 0), vector(&numbers, 1));
        let Some(hit) = tree.closest_hit(&ray) else {
            continue;
        };
        let mesh = meshes[hit.geometry_id as usize];
        let surface = Surface::of_hit(mesh, &hit);
        let any = vector(&numbers, 2);
        let flat = any.reject_from(surface.normal_towards(any)) + surface.normal * 1e-3;
        for direction in [any, flat] {
            let again = tree.closest_hit(&surface.ray_towards(direction));
            sent += 1;
            found += usize::from(again.is_some_and(|again| {
                (again.geometry_id, again.primitive_id) == (hit.geometry_id, hit.primitive_id)
            }));
        }
    }
    [found, sent]
}

fn check(name: &str, scene: &Scene) {
    for accuracy in [Accuracy::Fast, Accuracy::Robust] {
        let [found, sent] = self_hits(scene, accuracy);
        assert!(sent > RAYS as usize, "{name}: only {sent} rays");
        assert_eq!(
            found, 0,
            "{name}, {accuracy:?}: of {sent} rays so many hit what they leave"
        );
    }
}

#[test]
fn in_a_generated_room() {
    check("interior", &generate::interior(4));
}

#[test]
fn in_real_scenes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/scenes");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return;
    }
    for name in ["fireplace_room", "sponza"] {
        let path = folder.join(name).join(format!("{name}.obj.gz"));
        let loaded = load_scene(&path).unwrap_or_else(|error| panic!("{error}"));
        check(name, &loaded.scene);
    }
}
