//! Rotations of Morton trees move subtrees and nothing else: the tree stays a tree over the same
//! leaves, within its depth, and never costs more.

mod common;

use std::collections::HashMap;

use common::{built_qualities, contents, pool, primitives, sphere};
use proptest::prelude::*;
use raywright_bvh::{
    Aabb, BuildParams, BuildPrimitive, BuildWorkspace, Hierarchy, HierarchyNode, Quality, Vec3,
};

fn build(primitives: &[BuildPrimitive], params: &BuildParams) -> Hierarchy {
    Hierarchy::build(primitives, None, params, &mut BuildWorkspace::default()).unwrap()
}

/// Leaves with their boxes, in any order.
fn leaves(tree: &Hierarchy) -> HashMap<Vec<(u32, u32)>, [u32; 6]> {
    let leaves = contents(tree)
        .into_iter()
        .filter(|(.., ids)| !ids.is_empty());
    let leaves = leaves.map(|(_, bounds, ids)| {
        let ids = ids.iter().map(|id| (id.geometry_id, id.primitive_id));
        (ids.collect(), bounds)
    });
    leaves.collect()
}

/// Each node has the box of its children, and not too many of them.
fn assert_boxes(node: HierarchyNode<'_>, params: &BuildParams) {
    if node.leaf().is_some() {
        return;
    }
    let children = node.children();
    assert!((2..=params.branching_factor as usize).contains(&children.len()));
    let all = children.fold(Aabb::EMPTY, |all, child| all.union(child.bounds()));
    assert_eq!(node.bounds(), all);
    node.children()
        .for_each(|child| assert_boxes(child, params));
}

fn assert_only_moved(primitives: &[BuildPrimitive], rotated: &BuildParams) {
    let mut plain = *rotated;
    plain.rotations = 0;
    let (before, after) = (build(primitives, &plain), build(primitives, rotated));
    assert_eq!(leaves(&before), leaves(&after));
    if let Some(root) = after.root() {
        assert_boxes(root, rotated);
    }
    let (before, after) = (before.stats(rotated), after.stats(rotated));
    assert_eq!((after.nodes, after.leaves), (before.nodes, before.leaves));
    assert_eq!(after.references, primitives.len());
    assert!(after.depth <= rotated.max_depth as usize, "{rotated:?}");
    // Areas are compared in f32 and summed here in f64.
    assert!(
        after.sah_nodes <= before.sah_nodes * (1.0 + 1e-6),
        "{} {} {rotated:?}",
        before.sah_nodes,
        after.sah_nodes
    );
}

fn boxes(most: usize) -> impl Strategy<Value = Vec<BuildPrimitive>> {
    let corner = prop::array::uniform3(-1f32..1.0);
    let size = (prop::array::uniform3(0f32..1.0), 0i32..12);
    prop::collection::vec((corner, size), 1..most).prop_map(|boxes| {
        let primitives = boxes.into_iter().zip(0..);
        let primitives = primitives.map(|((min, (size, exponent)), primitive_id)| {
            let min = Vec3::from(min);
            let max = min + Vec3::from(size) * 0.5f32.powi(exponent);
            BuildPrimitive {
                bounds: Aabb { min, max },
                geometry_id: 0,
                primitive_id,
            }
        });
        primitives.collect()
    })
}

proptest! {
    #[test]
    fn subtrees_move_and_nothing_else(
        primitives in boxes(600),
        branching_factor in 2u32..=16,
        max_depth in 12u32..=64,
        min_leaf_size in 1u32..=4,
        rotations in 1u32..=16,
    ) {
        let mut params = BuildParams::embree_mesh_morton();
        params.branching_factor = branching_factor;
        params.max_depth = max_depth;
        params.min_leaf_size = min_leaf_size;
        params.rotations = rotations;
        assert_only_moved(&primitives, &params);
    }
}

/// Small boxes in lumps whose sizes differ widely: deep trees with much to rotate.
fn lumps(count: u32) -> Vec<BuildPrimitive> {
    let mut random = common::Random(4);
    let primitives = (0..count).map(|primitive_id| {
        let size = 0.5f32.powi((random.bits() % 20) as i32);
        let min = random.vector() * size;
        let max = min + random.vector().abs() * size;
        BuildPrimitive {
            bounds: Aabb { min, max },
            geometry_id: 0,
            primitive_id,
        }
    });
    primitives.collect()
}

#[test]
fn no_leaf_leaves_the_limit_of_depth() {
    let primitives = lumps(3000);
    for branching_factor in [2, 4, 8, 16] {
        let mut params = BuildParams::embree_mesh_morton();
        params.branching_factor = branching_factor;
        params.rotations = 16;
        params.max_depth = 64;
        let free = build(&primitives, &params).stats(&params).depth as u32;
        params.rotations = 0;
        let plain = build(&primitives, &params).stats(&params).depth as u32;
        assert!(free > plain, "{branching_factor}: rotations make it deeper");
        params.rotations = 16;
        for max_depth in plain..=free + 8 {
            params.max_depth = max_depth;
            let mut workspace = BuildWorkspace::default();
            if Hierarchy::build(&primitives, None, &params, &mut workspace).is_ok() {
                assert_only_moved(&primitives, &params);
            }
        }
    }
}

#[test]
fn every_number_of_threads_rotates_alike() {
    let primitives = lumps(40_000);
    for branching_factor in [2, 4, 8, 16] {
        for rotations in [1, 3] {
            let mut params = BuildParams::embree_mesh_morton();
            params.branching_factor = branching_factor;
            params.rotations = rotations;
            let on =
                |threads| pool(threads, 1 << 20).install(|| contents(&build(&primitives, &params)));
            let one = on(1);
            assert!(one == on(2) && one == on(5), "{params:?}");
        }
    }
}

#[test]
fn rotated_trees_cost_less_and_a_workspace_forgets_the_last_tree() {
    let primitives = lumps(10_000);
    let mut workspace = BuildWorkspace::default();
    for branching_factor in [2, 4, 8, 16] {
        let mut params = BuildParams::embree_mesh_morton();
        params.branching_factor = branching_factor;
        let costs = [0, 1, 4].map(|rotations| {
            params.rotations = rotations;
            let tree = Hierarchy::build(&primitives, None, &params, &mut workspace).unwrap();
            assert!(contents(&tree) == contents(&build(&primitives, &params)));
            tree.stats(&params).sah_nodes
        });
        assert!(costs[0] > costs[1] && costs[1] >= costs[2], "{costs:?}");
    }
}

#[test]
fn other_qualities_are_left_alone() {
    let primitives = primitives(&sphere(12));
    for quality in built_qualities() {
        let mut params = BuildParams::default();
        params.quality = quality;
        params.branching_factor = 4;
        let plain = contents(&build(&primitives, &params));
        params.rotations = 16;
        let same = plain == contents(&build(&primitives, &params));
        assert_eq!(same, quality != Quality::Morton, "{quality:?}");
    }
}
