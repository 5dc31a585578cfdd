//! A tree in memory of older trees is the tree in new memory: to the last bit of every node, block
//! and point, whatever the workspace served before.

mod common;

use common::{Random, built_qualities, sphere};
use rayon::ThreadPoolBuilder;
use raywright_bvh::{
    Aabb, Accuracy, BoxBvh, BuildError, BuildParams, BuildWorkspace, Bvh, Collapse, LeafFormat,
    TriangleMesh, Vec3,
};

/// Any quality, width, leaf size, leaf format and accuracy.
fn random_params(random: &mut Random) -> BuildParams {
    let mut draw = |n: usize| random.bits() as usize % n;
    let qualities = built_qualities();
    let mut params = BuildParams::default();
    params.quality = qualities[draw(qualities.len())];
    params.branching_factor = 2 + draw(15) as u32;
    params.max_leaf_size = 1 + draw(12) as u32;
    params.max_depth = 64;
    params.split_budget = 1.5;
    if draw(2) == 0 {
        params.collapse = Collapse::LeastCost;
    }
    if draw(2) == 0 {
        params.leaf_format = LeafFormat::Compact;
    }
    if draw(2) == 0 {
        params.accuracy = Accuracy::Robust;
    }
    params
}

/// All that is in a tree, memory of no use included.
fn contents(tree: &impl std::fmt::Debug) -> String {
    format!("{tree:?}")
}

#[test]
fn recycled_memory_changes_no_bit() {
    let mut random = Random(1);
    let meshes = [sphere(2), sphere(9), sphere(40)];
    for threads in [1, 3] {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut workspace = BuildWorkspace::default();
            for _ in 0..150 {
                let meshes: Vec<&TriangleMesh> = (0..random.bits() % 3)
                    .map(|_| &meshes[random.bits() as usize % 3])
                    .collect();
                let params = random_params(&mut random);
                let tree = Bvh::build_in(&meshes, &params, &mut workspace).unwrap();
                let fresh = Bvh::build(&meshes, &params).unwrap();
                assert!(contents(&tree) == contents(&fresh), "{params:?}");
                // Now and then a tree is kept, or built by one that fails.
                match random.bits() % 8 {
                    0 => drop(tree),
                    1 => {
                        tree.clone().recycle(&mut workspace);
                        assert!(contents(&tree) == contents(&fresh));
                    }
                    2 => {
                        tree.recycle(&mut workspace);
                        let outside = Vec3::splat(1e35);
                        let outside = TriangleMesh::new(vec![outside; 3], vec![[0, 1, 2]]).unwrap();
                        let got = Bvh::build_in(&[&outside], &params, &mut workspace);
                        assert!(matches!(got, Err(BuildError::CoordinateRange { .. })));
                    }
                    _ => tree.recycle(&mut workspace),
                }
            }
        });
    }
}

#[test]
fn trees_over_boxes_and_over_triangles_share_a_workspace() {
    let mut random = Random(2);
    let mesh = sphere(9);
    let mut workspace = BuildWorkspace::default();
    for _ in 0..100 {
        let boxes: Vec<Aabb> = (0..random.bits() % 300)
            .map(|_| {
                let min = random.vector();
                let max = min + Vec3::splat(random.unit());
                Aabb { min, max }
            })
            .collect();
        let params = random_params(&mut random);
        let tree = BoxBvh::build(&boxes, &params, &mut workspace).unwrap();
        let fresh = BoxBvh::build(&boxes, &params, &mut BuildWorkspace::default()).unwrap();
        assert!(contents(&tree) == contents(&fresh), "{params:?}");
        tree.recycle(&mut workspace);
        let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        let fresh = Bvh::build(&[&mesh], &params).unwrap();
        assert!(contents(&tree) == contents(&fresh), "{params:?}");
        tree.recycle(&mut workspace);
    }
}

/// A tree that is refitted before it is given up: its memory is like that of any other.
#[test]
fn refitted_trees_can_be_recycled() {
    let mesh = sphere(9);
    let vertices = mesh
        .vertices()
        .iter()
        .map(|&v| v * Vec3::new(2.0, 1.0, 0.5));
    let moved = TriangleMesh::new(vertices.collect(), mesh.triangles().to_vec()).unwrap();
    for leaf_format in [LeafFormat::Edges, LeafFormat::Compact] {
        let mut params = BuildParams::default();
        params.leaf_format = leaf_format;
        let mut workspace = BuildWorkspace::default();
        let mut tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        tree.refit(&[&moved]).unwrap();
        tree.recycle(&mut workspace);
        let tree = Bvh::build_in(&[&mesh], &params, &mut workspace).unwrap();
        let fresh = Bvh::build(&[&mesh], &params).unwrap();
        assert!(contents(&tree) == contents(&fresh));
    }
}
