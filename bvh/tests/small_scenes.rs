//! Everything that builds or traces, once, over a dozen triangles and boxes: little enough for Miri, which interprets
//! it (`tools/miri`). On a machine's own instructions other tests say more.

mod common;

use common::{Random, bits, built_qualities, sphere};
use raywright_bvh::{
    Aabb, Accuracy, BoxBvh, BuildParams, BuildWorkspace, Bvh, Dynamics, Isa, LeafFormat, Ray,
    Rounding, TriangleMesh, Vec3, reference,
};

/// Every quality, with nodes of every width and leaves of every kind that has a kernel, and either
/// way of rounding.
fn all_params() -> Vec<BuildParams> {
    let mut params = BuildParams::default();
    params.min_leaf_size = 1;
    params.max_leaf_size = 2;
    params.rotations = 2;
    params.dynamics = Dynamics::Dynamic;
    let mut all = vec![];
    for quality in built_qualities() {
        params.quality = quality;
        for branching_factor in [2, 4, 8, 16] {
            params.branching_factor = branching_factor;
            for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
                params.leaf_format = leaf_format;
                for accuracy in [Accuracy::Fast, Accuracy::Robust] {
                    params.accuracy = accuracy;
                    params.rounding = match params.rounding {
                        Rounding::Exact => Rounding::Embree,
                        Rounding::Embree => Rounding::Exact,
                    };
                    all.push(params);
                }
            }
        }
    }
    // Miri takes seconds for each. No cycle of the loops above has this length.
    all.into_iter()
        .step_by(if cfg!(miri) { 7 } else { 1 })
        .collect()
}

fn rays() -> Vec<Ray> {
    let mut random = Random(3);
    let outside = Vec3::new(0.1, -0.2, 4.0);
    let mut rays: Vec<Ray> = (0..3)
        .map(|_| Ray::new(outside, random.vector() * 0.7 - outside))
        .collect();
    rays.push(Ray::new([0.05, 0.0, 0.0], [0.0, -0.0, 1.0]));
    rays
}

#[test]
fn every_tree_gives_the_hits_of_the_slow_twin() {
    let ball = sphere(2);
    let others = [
        [0.0, 0.0, 0.0],
        [1.5, 0.3, 0.2],
        [0.1, 1.5, -0.4],
        [0.9, 0.8, 1.3],
    ];
    let pyramid = TriangleMesh::new(
        others.map(Vec3::from).to_vec(),
        vec![[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]],
    );
    let meshes = [&ball, &pyramid.unwrap()];
    let mut workspace = BuildWorkspace::default();
    for params in all_params() {
        let tree = Bvh::build_in(&meshes, &params, &mut workspace).unwrap();
        let mut tree = tree.with_isa(Isa::Portable).unwrap();
        for is_refitted in [false, true] {
            if is_refitted {
                tree.refit(&meshes).unwrap();
            }
            for ray in rays() {
                let expected = reference::closest_hit(&meshes, &ray, params.accuracy).unwrap();
                let hit = tree.closest_hit(&ray);
                assert_eq!(bits(hit), bits(expected), "{params:?} {ray:?}");
                assert_eq!(tree.any_hit(&ray), expected.is_some());
            }
        }
        tree.recycle(&mut workspace);
    }
}

#[test]
fn every_tree_over_boxes_gives_the_intervals_of_the_slow_twin() {
    let mut random = Random(5);
    let boxes: Vec<Aabb> = (0..12)
        .map(|_| {
            let (a, b) = (random.vector(), random.vector());
            Aabb::EMPTY.extended_by(a).extended_by(a + b * 0.5)
        })
        .collect();
    let mut workspace = BuildWorkspace::default();
    let mut hits = vec![];
    for params in all_params() {
        let tree = BoxBvh::build(&boxes, &params, &mut workspace).unwrap();
        let tree = tree.with_isa(Isa::Portable).unwrap();
        for ray in rays() {
            let expected = reference::box_intervals(&boxes, &ray).unwrap();
            tree.intervals(&ray, &mut hits);
            assert_eq!(hits, expected, "{params:?} {ray:?}");
            assert_eq!(tree.closest_hit(&ray), expected.first().copied());
            assert_eq!(tree.any_hit(&ray), !expected.is_empty());
        }
        tree.recycle(&mut workspace);
    }
}
