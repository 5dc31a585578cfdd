//! Built-in scenes: made by formula, so that the program shows and measures something without a
//! file.
//!
//! Invariants: each scene has a camera, materials and lights; the same arguments give the same
//! bits on every machine (seeded integer hashes, no ambient randomness; angles are evaluated in
//! `f64`, so that the last bit of a mathematics library is rounded away); no triangle is without
//! area, and every winding is counter-clockwise seen from the air.
//!
//! The two are opposites for a tree builder: [`interior`] has few huge and many tiny triangles in
//! all directions, [`voxel_terrain`] equal ones on the axes.

mod furniture;
mod interior;
mod noise;
mod shapes;
mod voxel_terrain;

pub use interior::{DEFAULT_DETAIL, interior};
pub use voxel_terrain::{DEFAULT_SIZE, voxel_terrain};

use crate::scene::Scene;

/// The names that [`by_name`] knows.
pub const NAMES: &[&str] = &["interior", "voxel-terrain"];

/// The built-in scene of that name at its default size.
#[must_use]
pub fn by_name(name: &str) -> Option<Scene> {
    match name {
        "interior" => Some(interior(DEFAULT_DETAIL)),
        "voxel-terrain" => Some(voxel_terrain(DEFAULT_SIZE)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::ops::RangeInclusive;

    use raywright_bvh::Vec3;

    use super::*;

    /// FNV-1a over all vertices, indices and material numbers.
    fn fingerprint(scene: &Scene) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |word: u32| {
            for byte in word.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for mesh in &scene.meshes {
            add(mesh.material as u32);
            for vertex in mesh.triangles.vertices() {
                vertex.to_array().into_iter().for_each(|c| add(c.to_bits()));
            }
            for triangle in mesh.triangles.triangles() {
                triangle.iter().for_each(|&index| add(index));
            }
        }
        hash
    }

    fn bounds(scene: &Scene) -> (Vec3, Vec3) {
        let vertices = scene.meshes.iter().flat_map(|m| m.triangles.vertices());
        vertices.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), v| {
            (min.min(*v), max.max(*v))
        })
    }

    fn assert_sound(scene: &Scene, triangles: RangeInclusive<usize>) {
        let count = scene.triangle_count();
        assert!(triangles.contains(&count), "{count} triangles");
        for mesh in &scene.meshes {
            assert!(mesh.material < scene.materials.len(), "{}", mesh.name);
            assert!(!mesh.triangles.triangles().is_empty(), "{}", mesh.name);
            assert!(
                mesh.triangles.vertices().iter().all(|v| v.is_finite()),
                "{}",
                mesh.name
            );
            for i in 0..mesh.triangles.triangles().len() as u32 {
                let [a, b, c] = mesh.triangles.corners(i).map(Vec3::as_dvec3);
                assert!(
                    (b - a).cross(c - a) != glam::DVec3::ZERO,
                    "{} {i}: {a} {b} {c}",
                    mesh.name
                );
            }
        }
        for material in &scene.materials {
            let valid = material.diffuse.cmpge(Vec3::ZERO) & material.diffuse.cmple(Vec3::ONE);
            assert!(valid.all(), "{}", material.name);
        }
        scene.camera.expect("a camera").validate().unwrap();
        assert!(!scene.lights.is_empty());
        assert!(scene.materials.iter().any(|m| m.is_emissive()));
    }

    #[test]
    fn every_name_has_a_scene_and_no_other() {
        for name in NAMES {
            assert!(by_name(name).is_some(), "{name}");
        }
        assert_eq!(by_name("Interior"), None);
    }

    #[test]
    fn interior_is_sound() {
        let scene = interior(DEFAULT_DETAIL);
        assert_sound(&scene, 180_000..=240_000);
        let (min, max) = bounds(&scene);
        assert!(min.cmpge(Vec3::new(-4.5, -0.1, -3.1)).all(), "{min}");
        assert!(max.cmple(Vec3::new(4.1, 3.1, 3.1)).all(), "{max}");
        assert_sound(&interior(1), 3_000..=30_000);
    }

    #[test]
    fn interior_has_large_and_small_triangles() {
        let scene = interior(DEFAULT_DETAIL);
        let mut areas: Vec<f32> = scene
            .meshes
            .iter()
            .flat_map(|mesh| {
                (0..mesh.triangles.triangles().len() as u32).map(|i| {
                    let [a, b, c] = mesh.triangles.corners(i);
                    0.5 * (b - a).cross(c - a).length()
                })
            })
            .collect();
        areas.sort_by(f32::total_cmp);
        let (median, largest) = (areas[areas.len() / 2], areas[areas.len() - 1]);
        assert!(largest / median > 1e4, "{largest} / {median}");
    }

    #[test]
    fn voxel_terrain_is_sound() {
        let scene = voxel_terrain(DEFAULT_SIZE);
        assert_sound(&scene, 270_000..=340_000);
        for mesh in &scene.meshes {
            let whole = |v: &Vec3| *v == v.round();
            assert!(mesh.triangles.vertices().iter().all(whole), "{}", mesh.name);
        }
        assert_sound(&voxel_terrain(16), 1_500..=20_000);
    }

    /// What was measured on a scene holds for these bits: a scene is changed on purpose or not at
    /// all, and is the same on every machine.
    #[test]
    fn scenes_are_the_same_everywhere() {
        assert_eq!(fingerprint(&interior(4)), 897_593_624_614_163_686);
        assert_eq!(fingerprint(&voxel_terrain(32)), 17_436_385_073_359_228_384);
    }
}
