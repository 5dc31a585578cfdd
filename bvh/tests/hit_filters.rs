//! Hits that a caller's function takes, against asking about the hit of every triangle: the same
//! bits, for every accuracy, width, leaf format and instruction set.

mod common;

use std::collections::HashMap;

use common::{Random, bits, built_qualities, sphere};
use proptest::prelude::*;
use raywright_bvh::{
    Accuracy, BuildParams, Bvh, Hit, Isa, LeafFormat, Quality, Ray, TriangleMesh, Vec3, reference,
};

const ACCURACIES: [Accuracy; 2] = [Accuracy::Fast, Accuracy::Robust];

/// Trees of every kind that has a kernel of its own, by every instruction set of this machine.
fn trees(meshes: &[&TriangleMesh], quality: Quality, accuracy: Accuracy) -> Vec<Bvh> {
    let mut trees = Vec::new();
    for branching_factor in [2, 4, 8, 16] {
        for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
            let mut params = BuildParams::default();
            params.quality = quality;
            params.branching_factor = branching_factor;
            params.leaf_format = leaf_format;
            params.accuracy = accuracy;
            let tree = Bvh::build(meshes, &params).unwrap();
            trees.extend(
                Isa::ALL
                    .into_iter()
                    .filter_map(|isa| tree.clone().with_isa(isa)),
            );
        }
    }
    trees
}

/// Keeps two of three triangles, by a hash of their ids.
fn by_ids(hit: &Hit) -> bool {
    let hash = (hit.geometry_id * 97 + hit.primitive_id).wrapping_mul(0x9e37_79b9) >> 16;
    !hash.is_multiple_of(3)
}

/// Keeps a corner of each triangle.
fn by_weights(hit: &Hit) -> bool {
    hit.u + hit.v <= 0.4
}

/// Keeps slices of space.
fn by_distance(hit: &Hit) -> bool {
    (hit.t * 8.0) as u32 % 2 == 1
}

/// Keeps what bits say that have nothing to do with geometry: any other bit is another answer.
fn by_bits(hit: &Hit) -> bool {
    (hit.t.to_bits() ^ hit.u.to_bits() ^ hit.v.to_bits()).is_multiple_of(3)
}

type Accept = fn(&Hit) -> bool;
const FILTERS: [Accept; 6] = [
    |_| true,
    |_| false,
    by_ids,
    by_weights,
    by_distance,
    by_bits,
];

/// How many rays a filter gave another hit than the closest.
fn check(meshes: &[&TriangleMesh], quality: Quality, rays: &[Ray]) -> Result<usize, TestCaseError> {
    let mut others = 0;
    for accuracy in ACCURACIES {
        let trees = trees(meshes, quality, accuracy);
        for ray in rays {
            let closest = reference::closest_hit(meshes, ray, accuracy).unwrap();
            for (number, accept) in FILTERS.into_iter().enumerate() {
                let expected = reference::closest_hit_where(meshes, ray, accuracy, accept).unwrap();
                others += usize::from(expected.is_some() && expected != closest);
                for tree in &trees {
                    let context = format!("{} {number} {:?} {ray:?}", tree.isa(), tree.params());
                    let got = tree.closest_hit_where(ray, accept);
                    prop_assert_eq!(bits(got), bits(expected), "{}", context);
                    let any = tree.any_hit_where(ray, accept);
                    prop_assert_eq!(any, expected.is_some(), "{}", context);
                }
            }
        }
    }
    Ok(others)
}

fn soup(random: &mut Random, triangles: u32, size: f32) -> TriangleMesh {
    let corners = (0..triangles).flat_map(|_| {
        let centre = random.vector();
        [(); 3].map(|()| centre + random.vector() * size)
    });
    let corners = corners.collect();
    let triangles = (0..triangles).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    TriangleMesh::new(corners, triangles.collect()).unwrap()
}

#[test]
fn every_quality_and_kernel_asks_about_the_same_hits() {
    let mut random = Random(3);
    let (first, second) = (soup(&mut random, 300, 0.5), soup(&mut random, 40, 1.0));
    let rays: Vec<_> = (0..100)
        .map(|_| Ray::new(random.vector() * 2.0, random.vector()))
        .collect();
    for quality in built_qualities() {
        let others = check(&[&first, &second], quality, &rays).unwrap();
        assert!(others > 50, "{quality:?}: {others}");
    }
}

#[test]
fn accepting_all_is_the_closest_hit() {
    let mesh = sphere(20);
    let mut random = Random(8);
    for accuracy in ACCURACIES {
        for tree in trees(&[&mesh, &mesh], Quality::BinnedSah, accuracy) {
            for _ in 0..200 {
                let ray = Ray::new(random.vector() * 2.0, random.vector());
                let all = tree.closest_hit_where(&ray, |_| true);
                assert_eq!(bits(all), bits(tree.closest_hit(&ray)));
                assert_eq!(tree.any_hit_where(&ray, |_| true), tree.any_hit(&ray));
            }
        }
    }
}

/// What `accept` is told is what the trees would give, and nothing outside the ray's interval.
#[test]
fn accept_sees_hits_of_the_ray() {
    let mesh = sphere(12);
    let mut random = Random(9);
    let mut asked = 0;
    for tree in trees(&[&mesh], Quality::BinnedSah, Accuracy::Robust) {
        for _ in 0..200 {
            let ray = Ray::new(random.vector() * 2.0, random.vector()).with_range(0.2, 3.0);
            // By passing one triangle after the other, all hits come in order.
            let mut seen: HashMap<u32, Hit> = HashMap::new();
            while let Some(hit) =
                tree.closest_hit_where(&ray, |hit| !seen.contains_key(&hit.primitive_id))
            {
                seen.insert(hit.primitive_id, hit);
            }
            assert!(!tree.any_hit_where(&ray, |hit| {
                asked += 1;
                assert_eq!(Some(hit), seen.get(&hit.primitive_id));
                false
            }));
        }
    }
    assert!(asked > 500, "{asked}");
}

#[test]
fn equal_distances_go_to_the_lowest_ids_that_are_taken() {
    let corners = [
        Vec3::new(-1.0, -1.0, -1.0),
        Vec3::new(1.0, -1.0, -1.0),
        Vec3::new(0.0, 1.0, -1.0),
    ];
    let mesh = TriangleMesh::new(corners.to_vec(), vec![[0, 1, 2]; 40]).unwrap();
    for accuracy in ACCURACIES {
        for tree in trees(&[&mesh, &mesh], Quality::BinnedSah, accuracy) {
            let ray = Ray::new(Vec3::ZERO, -Vec3::Z);
            for (geometry, primitive) in [(0, 0), (0, 17), (1, 5)] {
                let accept =
                    |hit: &Hit| (hit.geometry_id, hit.primitive_id) >= (geometry, primitive);
                let hit = tree.closest_hit_where(&ray, accept).unwrap();
                assert_eq!((hit.geometry_id, hit.primitive_id), (geometry, primitive));
            }
        }
    }
}

#[test]
fn rays_that_can_hit_nothing_ask_nothing() {
    let mesh = sphere(6);
    let tree = Bvh::build(&[&mesh], &BuildParams::default()).unwrap();
    for ray in [
        Ray::new(Vec3::NAN, Vec3::X),
        Ray::new(Vec3::ZERO, Vec3::ZERO),
        Ray::new(Vec3::ZERO, Vec3::X).with_range(2.0, 1.0),
        Ray::new(Vec3::ZERO, Vec3::X).with_range(2.0, 3.0),
    ] {
        let accept = |hit: &Hit| panic!("{hit:?}");
        assert_eq!(tree.closest_hit_where(&ray, accept), None);
        assert!(!tree.any_hit_where(&ray, accept));
    }
}

fn lattice() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-3i8..=3).prop_map(|v| Vec3::from(v.map(f32::from)))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Degenerate, coplanar and equal triangles, and rays through their corners and edges.
    #[test]
    fn lattice_triangles_and_lattice_rays(
        corners in prop::collection::vec(prop::array::uniform3(lattice()), 0..150),
        rays in prop::collection::vec((lattice(), lattice()), 12),
        quality in prop::sample::select(vec![Quality::Morton, Quality::BinnedSah]),
    ) {
        let triangles = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        let mesh = TriangleMesh::new(corners.concat(), triangles.collect()).unwrap();
        let rays: Vec<_> = rays.iter().map(|&(o, d)| Ray::new(o, d)).collect();
        check(&[&mesh], quality, &rays)?;
    }
}
