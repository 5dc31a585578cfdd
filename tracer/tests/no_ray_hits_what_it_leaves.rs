//! Rays that start from a hit do not find the triangle that was hit again, whichever test is used:
//! on the way to any side, and at flat angles, where errors of distances are largest. Checked on a
//! generated room and on real scenes, whose long thin triangles are what small examples lack.

use std::path::Path;

use raywright_tracer::bvh::{Accuracy, BuildParams, Bvh, Ray, TriangleMesh, Vec3};
use raywright_tracer::load::load_scene;
use raywright_tracer::{Scene, Surface, generate};

const RAYS: usize = 30_000;

/// Vectors of the cube -1..1 from a 64-bit Weyl sequence, mixed (SplitMix64).
struct Vectors(u64);

impl Vectors {
    fn number(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 23) as f32 - 1.0
    }

    fn next(&mut self) -> Vec3 {
        Vec3::from_array(std::array::from_fn(|_| self.number()))
    }
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
    let mut vectors = Vectors(1);
    let [mut found, mut sent] = [0; 2];
    for _ in 0..RAYS {
        let ray = Ray::new(centre + half * vectors.next(), vectors.next());
        let Some(hit) = tree.closest_hit(&ray) else {
            continue;
        };
        let mesh = meshes[hit.geometry_id as usize];
        let surface = Surface::of_hit(mesh, &hit);
        let any = vectors.next();
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
        assert!(sent > RAYS, "{name}: only {sent} rays");
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
