//! One test per row of section 1.4 of `design/parameters.md`: values for which Embree's builder has no
//! defined meaning, does something odd, or crashes. Here each is a typed error or has the meaning
//! that the test's name tells.

mod common;

use common::{and_variants, built_qualities, contents, primitives, sphere};
use raywright_bvh::{
    Aabb, BuildError, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Corners, Hierarchy,
    LeafReference, ParameterFault, Quality, Rounding, TriangleMesh, Vec3,
};

/// Every built quality with both roundings; Morton order with and without rotations, binned ones collapsed in both ways.
fn all_params() -> Vec<BuildParams> {
    let mut all = Vec::new();
    for quality in built_qualities() {
        for rounding in [Rounding::Exact, Rounding::Embree] {
            let mut params = BuildParams::default();
            params.quality = quality;
            params.rounding = rounding;
            all.push(params);
        }
    }
    and_variants(all)
}

fn hierarchy(
    primitives: &[BuildPrimitive],
    corners: Option<&Corners<'_>>,
    params: &BuildParams,
) -> Result<Hierarchy, BuildError> {
    Hierarchy::build(primitives, corners, params, &mut BuildWorkspace::default())
}

/// The tree over a sphere of 3 120 triangles, which spatial splits may cut.
fn over_sphere(params: &BuildParams) -> Result<Hierarchy, BuildError> {
    let mesh = sphere(28);
    let corners: &Corners<'_> = &|leaf: LeafReference| mesh.corners(leaf.primitive_id);
    hierarchy(&primitives(&mesh), Some(corners), params)
}

/// All qualities refuse a value as outside the range of one parameter, for a tree of any size.
fn refused(name: &str, change: impl Fn(&mut BuildParams)) {
    for mut params in all_params() {
        change(&mut params);
        for got in [over_sphere(&params), hierarchy(&[], None, &params)] {
            let Err(BuildError::Parameters(faults)) = got else {
                panic!("{params:?} is built");
            };
            let named = matches!(
                faults[..],
                [ParameterFault::OutOfRange { name: fault, .. }] if fault == name
            );
            assert!(named, "{name}: {faults:?}");
        }
    }
}

/// Each reference once or, in parts, more often; leaves and depth within their limits.
fn assert_whole(tree: &Hierarchy, count: u32, params: &BuildParams) {
    let mut ids: Vec<u32> = Vec::new();
    for (level, _, leaf) in contents(tree) {
        assert!(leaf.len() <= params.max_leaf_size as usize, "{params:?}");
        assert!(level <= params.max_depth as usize, "{params:?}");
        ids.extend(leaf.iter().map(|reference| reference.primitive_id));
    }
    ids.sort_unstable();
    ids.dedup();
    assert!(ids.into_iter().eq(0..count), "{params:?}");
}

#[test]
fn no_primitives_are_an_empty_tree() {
    for params in all_params() {
        let tree = hierarchy(&[], None, &params).unwrap();
        assert!(tree.root().is_none());
        assert_eq!(tree.stats(&params).leaves, 0);
        assert!(Bvh::build(&[], &params).unwrap().bounds().is_empty());
    }
}

#[test]
fn max_leaf_size_0_is_refused() {
    refused("max_leaf_size", |params| params.max_leaf_size = 0);
    refused("max_leaf_size", |params| params.max_leaf_size = 65);
}

#[test]
fn min_leaf_size_0_is_refused() {
    refused("min_leaf_size", |params| params.min_leaf_size = 0);
}

#[test]
fn every_quality_has_16_children_and_no_more() {
    for branching_factor in 9..=16 {
        for mut params in all_params() {
            params.branching_factor = branching_factor;
            let tree = over_sphere(&params).unwrap();
            assert_whole(&tree, 3024, &params);
            let root = tree.root().unwrap();
            assert_eq!(
                root.children().len(),
                branching_factor as usize,
                "{params:?}"
            );
        }
    }
    refused("branching_factor", |params| params.branching_factor = 17);
    refused("branching_factor", |params| {
        params.branching_factor = u32::MAX
    });
}

#[test]
fn branching_factor_0_and_1_are_refused() {
    refused("branching_factor", |params| params.branching_factor = 0);
    refused("branching_factor", |params| params.branching_factor = 1);
}

#[test]
fn leaves_of_more_than_32_are_built_by_every_quality() {
    for mut params in all_params() {
        (params.min_leaf_size, params.max_leaf_size) = (64, 64);
        let tree = over_sphere(&params).unwrap();
        assert_whole(&tree, 3024, &params);
        let stats = tree.stats(&params);
        assert!(stats.largest_leaf > 32, "{params:?} {}", stats.largest_leaf);
    }
}

#[test]
fn block_size_0_and_beyond_32_is_refused() {
    for size in [0, 33, 1 << 31, u32::MAX] {
        refused("sah_block_size", |params| params.sah_block_size = size);
    }
}

#[test]
fn too_small_a_depth_is_an_error_that_tells_what_is_needed() {
    for mut params in all_params() {
        (
            params.branching_factor,
            params.max_leaf_size,
            params.min_leaf_size,
        ) = (2, 4, 1);
        // 2^9 · 4 = 2048 < 3024: ten levels of nodes and one of leaves.
        for max_depth in [1, 4, 9, 10] {
            params.max_depth = max_depth;
            let Err(BuildError::DepthLimit {
                max_depth: limit,
                needed,
            }) = over_sphere(&params)
            else {
                panic!("{params:?} is built");
            };
            assert_eq!(limit, max_depth);
            assert!(needed > max_depth && needed <= 11, "{needed} {params:?}");
        }
        params.max_depth = 64;
        assert_whole(&over_sphere(&params).unwrap(), 3024, &params);
    }
}

#[test]
fn max_depth_0_is_refused_and_1_is_a_leaf() {
    refused("max_depth", |params| params.max_depth = 0);
    refused("max_depth", |params| params.max_depth = 65);
    let few = primitives(&sphere(2));
    for mut params in all_params() {
        params.max_depth = 1;
        let tree = hierarchy(&few, None, &params).unwrap();
        assert_eq!(tree.root().unwrap().leaf().unwrap().len(), few.len());
    }
}

#[test]
fn costs_that_are_negative_or_not_finite_are_refused() {
    for cost in [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -1.0,
        -1e-30,
        1001.0,
    ] {
        refused("traversal_cost", |params| params.traversal_cost = cost);
        refused("intersection_cost", |params| {
            params.intersection_cost = cost
        });
    }
}

#[test]
fn qualities_are_words_and_nothing_else() {
    for text in ["3", "7", "", "Morton", "low", "binned_sah"] {
        let error = BuildParams::default().set("quality", text).unwrap_err();
        let told = matches!(
            &error,
            ParameterFault::NotUnderstood {
                name: "quality",
                ..
            }
        );
        assert!(told, "{error}");
    }
}

#[test]
fn room_for_fewer_references_than_primitives_cannot_be_asked_for() {
    for budget in [0.0, 0.99, -1.0, f32::NAN, f32::INFINITY, 9.0] {
        refused("split_budget", |params| params.split_budget = budget);
    }
}

#[test]
fn splits_that_cannot_be_made_build_what_binned_sah_builds() {
    let mesh = sphere(28);
    let corners: &Corners<'_> = &|leaf: LeafReference| mesh.corners(leaf.primitive_id);
    for rounding in [Rounding::Exact, Rounding::Embree] {
        let mut params = BuildParams::default();
        params.rounding = rounding;
        let mut splits = params;
        (splits.quality, splits.split_budget) = (Quality::SpatialSplits, 2.0);
        let mut all = primitives(&mesh);
        let expected = contents(&hierarchy(&all, None, &params).unwrap());
        let is_binned = |tree: Hierarchy| contents(&tree) == expected;
        // Nothing to cut with; nothing is the same if it can be cut.
        assert!(is_binned(hierarchy(&all, None, &splits).unwrap()));
        assert!(!is_binned(hierarchy(&all, Some(corners), &splits).unwrap()));
        // No room.
        let mut no_room = splits;
        no_room.split_budget = 1.0;
        assert!(is_binned(hierarchy(&all, Some(corners), &no_room).unwrap()));
        // One geometry id that leaves no room for a budget.
        for id in [1 << 27, u32::MAX] {
            all[1000].geometry_id = id;
            let expected = contents(&hierarchy(&all, None, &params).unwrap());
            let got = contents(&hierarchy(&all, Some(corners), &splits).unwrap());
            assert!(got == expected, "{id}");
            let ids = got.iter().flat_map(|(_, _, leaf)| leaf);
            assert!(ids.clone().any(|reference| reference.geometry_id == id));
        }
        all[1000].geometry_id = (1 << 27) - 1;
        assert!(!is_binned(hierarchy(&all, Some(corners), &splits).unwrap()));
    }
}

#[test]
fn boxes_that_are_none_give_a_tree_over_all_references() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let good = primitives(&sphere(12));
    let bad = [
        Aabb {
            min: Vec3::splat(nan),
            max: Vec3::splat(nan),
        },
        Aabb {
            min: Vec3::new(0.0, nan, 0.0),
            max: Vec3::ONE,
        },
        Aabb {
            min: Vec3::splat(-inf),
            max: Vec3::splat(inf),
        },
        Aabb {
            min: Vec3::splat(inf),
            max: Vec3::splat(inf),
        },
        Aabb {
            min: Vec3::ONE,
            max: -Vec3::ONE,
        },
        Aabb::EMPTY,
        Aabb {
            min: Vec3::splat(f32::MIN),
            max: Vec3::splat(f32::MAX),
        },
    ];
    for params in all_params() {
        for bounds in bad {
            // One, every third, all.
            for step in [good.len(), 3, 1] {
                let mut all = good.clone();
                for primitive in all.iter_mut().step_by(step) {
                    primitive.bounds = bounds;
                }
                let tree = hierarchy(&all, None, &params).unwrap();
                assert_whole(&tree, all.len() as u32, &params);
                let stats = tree.stats(&params);
                assert_eq!(stats.references, all.len());
            }
        }
    }
}

/// The mesh times a power of two.
fn times(mesh: &TriangleMesh, factor: f32) -> TriangleMesh {
    let vertices = mesh.vertices().iter().map(|&v| v * factor).collect();
    TriangleMesh::new(vertices, mesh.triangles().to_vec()).unwrap()
}

#[test]
fn huge_and_tiny_coordinates_lose_no_quality() {
    let mesh = sphere(28);
    for params in all_params() {
        let expected = Bvh::build(&[&mesh], &params).unwrap().stats();
        for exponent in [-99, -66, 66, 99] {
            let scaled = times(&mesh, 2f32.powi(exponent));
            let stats = Bvh::build(&[&scaled], &params).unwrap().stats();
            assert_eq!(stats, expected, "2^{exponent} {params:?}");
        }
        // Not a power of two: other roundings, the same quality.
        for factor in [1e30, 1e-30] {
            let stats = Bvh::build(&[&times(&mesh, factor)], &params)
                .unwrap()
                .stats();
            let ratio = stats.sah_cost / expected.sah_cost;
            assert!(
                (0.97..1.03).contains(&ratio),
                "{factor}: {ratio} {params:?}"
            );
        }
    }
}

#[test]
fn intersection_for_nothing_makes_leaves_as_large_as_they_may_be() {
    for quality in [Quality::BinnedSah, Quality::SpatialSplits] {
        for traversal_cost in [0.0, 1.0] {
            let mut params = BuildParams::embree_api_default();
            params.quality = quality;
            params.traversal_cost = traversal_cost;
            params.intersection_cost = 0.0;
            let tree = over_sphere(&params).unwrap();
            assert_whole(&tree, 3024, &params);
            // Every node with at most max_leaf_size references is a leaf.
            let mut stack = vec![tree.root().unwrap()];
            while let Some(node) = stack.pop() {
                if node.leaf().is_none() {
                    let mut references = 0;
                    let mut below: Vec<_> = node.children().collect();
                    while let Some(node) = below.pop() {
                        references += node.leaf().map_or(0, <[_]>::len);
                        below.extend(node.children());
                    }
                    assert!(references > params.max_leaf_size as usize, "{params:?}");
                    stack.extend(node.children());
                }
            }
        }
    }
}
