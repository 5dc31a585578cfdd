//! Binary trees that are collapsed at least cost, optimised or not: any input, any number of threads, no memory beyond the first build.

use raywright_bvh::{
    Aabb, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Collapse, Corners, Hierarchy,
    HierarchyNode, LeafReference, Quality, TriangleMesh, Vec3,
};

/// Every quality whose nodes are made by the same collapse of a binary tree that may have cuts.
fn every_way() -> [BuildParams; 3] {
    [
        Quality::Optimized,
        Quality::BinnedSah,
        Quality::SpatialSplits,
    ]
    .map(|quality| {
        let mut params = BuildParams::default();
        params.quality = quality;
        params.collapse = Collapse::LeastCost;
        params
    })
}

type Triangle = [Vec3; 3];

fn build(
    triangles: &[Triangle],
    params: &BuildParams,
    workspace: &mut BuildWorkspace,
) -> Hierarchy {
    let primitives: Vec<_> = (0..)
        .zip(triangles)
        .map(|(primitive_id, corners)| BuildPrimitive {
            bounds: corners.iter().copied().fold(Aabb::EMPTY, Aabb::extended_by),
            geometry_id: 0,
            primitive_id,
        })
        .collect();
    let corners = |leaf: LeafReference| triangles[leaf.primitive_id as usize];
    let corners: &Corners<'_> = &corners;
    Hierarchy::build(&primitives, Some(corners), params, workspace).unwrap()
}

/// All boxes and leaves in order.
fn walk(node: HierarchyNode<'_>, level: u32, all: &mut Vec<(u32, [u32; 6], Vec<LeafReference>)>) {
    let Aabb { min, max } = node.bounds();
    let corners = [min.x, min.y, min.z, max.x, max.y, max.z].map(f32::to_bits);
    all.push((level, corners, node.leaf().unwrap_or_default().to_vec()));
    for child in node.children() {
        walk(child, level + 1, all);
    }
}

fn walked(tree: &Hierarchy) -> Vec<(u32, [u32; 6], Vec<LeafReference>)> {
    let mut all = Vec::new();
    walk(tree.root().unwrap(), 1, &mut all);
    all
}

/// Triangles in a cube, some of them long.
fn soup(count: usize) -> Vec<Triangle> {
    let mut state = 1_u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut vector = move |size: f32| Vec3::from([random(), random(), random()]) * size;
    (0..count)
        .map(|index| {
            let (corner, size) = (vector(1.0), if index % 8 == 0 { 1.0 } else { 0.02 });
            [corner, corner + vector(size), corner + vector(size)]
        })
        .collect()
}

#[test]
fn degenerate_inputs_give_trees_that_hold_everything() {
    let unit = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let inputs: [Vec<Triangle>; 7] = [
        soup(1),
        soup(2),
        soup(3),
        vec![unit; 10_000],
        (0..=20)
            .map(|e| [Vec3::NEG_ONE, Vec3::ONE, Vec3::X].map(|v| v * 2f32.powi(e)))
            .collect(),
        (0..1000)
            .map(|i| [0.0, 0.5, 1.0].map(|x| Vec3::X * (x + i as f32)))
            .collect(),
        (0..1000)
            .map(|i| [Vec3::splat((i % 7) as f32); 3])
            .collect(),
    ];
    for triangles in inputs {
        let widths = [2, 8, 16].into_iter();
        for (branching_factor, mut params) in widths.flat_map(|w| every_way().map(|p| (w, p))) {
            params.branching_factor = branching_factor;
            let tree = build(&triangles, &params, &mut BuildWorkspace::default());
            let mut found = vec![false; triangles.len()];
            for (level, _, leaf) in walked(&tree) {
                assert!(level <= params.max_depth);
                assert!(leaf.len() <= params.max_leaf_size as usize);
                assert!(leaf.is_sorted_by(|a, b| a.primitive_id < b.primitive_id));
                leaf.iter()
                    .for_each(|l| found[l.primitive_id as usize] = true);
            }
            assert!(found.into_iter().all(|found| found));
        }
    }
}

/// Without corners, and with a budget of one, nothing is cut.
#[test]
fn nothing_is_cut_without_corners_or_budget() {
    let triangles = soup(2000);
    let references = |params: &BuildParams| {
        let tree = build(&triangles, params, &mut BuildWorkspace::default());
        walked(&tree).iter().map(|node| node.2.len()).sum::<usize>()
    };
    for params in every_way() {
        let mut whole = params;
        whole.split_budget = 1.0;
        assert_eq!(references(&whole), 2000);
        let cuts = params.quality != Quality::BinnedSah;
        assert_eq!(references(&params) > 2000, cuts, "{params:?}");
    }
}

/// What the collapse minimises, by its own measure: a node costs two traversal costs and a leaf one beside its blocks.
fn cost(tree: &Hierarchy, params: &BuildParams) -> f64 {
    fn below(node: HierarchyNode<'_>, params: &BuildParams) -> f64 {
        let size = node.bounds().max - node.bounds().min;
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        let own = match node.leaf() {
            Some(leaf) => {
                let blocks = leaf.len().div_ceil(params.sah_block_size as usize);
                params.traversal_cost + params.intersection_cost * blocks as f32
            }
            None => 2.0 * params.traversal_cost,
        };
        let children = node.children().map(|child| below(child, params));
        f64::from(area * own) + children.sum::<f64>()
    }
    below(tree.root().unwrap(), params)
}

#[test]
fn a_collapse_at_least_cost_costs_less_than_dividing_the_largest_child() {
    let triangles = soup(5000);
    let cost = |quality, collapse, width| {
        let mut params = BuildParams::least_cost(width);
        params.quality = quality;
        params.collapse = collapse;
        let tree = build(&triangles, &params, &mut BuildWorkspace::default());
        cost(&tree, &params)
    };
    use Collapse::{LargestFirst, LeastCost};
    for width in [2, 4, 8, 16] {
        for quality in [Quality::BinnedSah, Quality::SpatialSplits] {
            let least = cost(quality, LeastCost, width);
            assert!(least < 0.99 * cost(quality, LargestFirst, width));
        }
    }
}

#[test]
fn rays_visit_fewer_nodes_than_in_trees_that_are_not_optimised() {
    let triangles = soup(5000);
    let mesh = TriangleMesh::new(
        triangles.concat(),
        (0..5000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    )
    .unwrap();
    let nodes = |quality| {
        let mut params = BuildParams::default();
        params.quality = quality;
        Bvh::build(&[&mesh], &params).unwrap().stats().sah_nodes
    };
    let optimized = nodes(Quality::Optimized);
    assert!(optimized < nodes(Quality::SpatialSplits));
    assert!(optimized < nodes(Quality::BinnedSah));
}

#[test]
fn a_second_build_takes_no_more_memory() {
    let triangles = soup(5000);
    for params in every_way() {
        let mut workspace = BuildWorkspace::default();
        let first = walked(&build(&triangles, &params, &mut workspace));
        let bytes = workspace.bytes();
        for _ in 0..2 {
            let again = walked(&build(&triangles, &params, &mut workspace));
            assert_eq!(first, again);
            assert_eq!(workspace.bytes(), bytes);
        }
    }
}

#[cfg(feature = "parallel")]
#[test]
fn threads_do_not_change_the_tree() {
    let triangles = soup(60_000);
    let tree = |threads, params: &BuildParams| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| walked(&build(&triangles, params, &mut BuildWorkspace::default())))
    };
    for params in every_way() {
        let one = tree(1, &params);
        for threads in [2, 8] {
            assert!(one == tree(threads, &params), "{threads} threads");
        }
    }
}
