//! Trees from the bottom up: Meister, Bittner, *Parallel Locally-Ordered Clustering for Bounding
//! Volume Hierarchy Construction*, 2018.
//!
//! Clusters, at first one or a few primitives each, lie along a Morton curve of 63 bits. Each looks
//! among the [`rounds::RADIUS`] clusters on either side for the one with which its box would be
//! smallest; two that choose each other become one, in the place of the first; and so on until one
//! is left.
//!
//! Two things make it fast. Neighbours along the curve that would be in one leaf anyway are united
//! before the first round, so that there is less than half a cluster per primitive. And leaves are
//! chosen while clusters merge, by the surface area heuristic: of the costs of a leaf and of a node
//! with the best trees below it. Wide nodes are then filled from the root down, the child with the
//! largest box being the first to be replaced by its own two.
//!
//! Invariants: the tree does not depend on threads. Every round merges one cluster in
//! [`rounds::LEAST_SHARE`] or more, except among the last [`rounds::FREE_BELOW`], so that time is
//! bounded for any input. An inner node stands behind the first clusters and in front of the inner
//! nodes below it. No leaf and no level is beyond its limit: a subtree that might else become too
//! deep is halved by the number of its clusters.

mod emission;
mod groups;
mod places;
mod rounds;

use super::{BuildWorkspace, LeafReference, primitive::Bounds, record::Record};
use crate::{bounds::Aabb, error::BuildError, params::BuildParams, simd::Isa};
use emission::Emission;
use places::Place;
use rounds::Piece;

/// Clusters that are looked at together, in memory of the innermost cache.
const BLOCK: usize = 256;

/// A node of the binary tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    below: Below,
    summary: Summary,
}

#[derive(Clone, Copy, Debug)]
enum Below {
    Children([u32; 2]),
    /// A cluster of the first round: a range of references along the curve.
    Cluster {
        first: u32,
    },
}

/// What is known of a subtree.
#[derive(Clone, Copy, Debug)]
struct Summary {
    area: f32,
    /// Least cost of what is below as at most `branching_factor` trees, and of how many. A single
    /// one is a leaf.
    cost: f32,
    trees: u32,
    /// How many references and how many first clusters are below.
    references: u32,
    clusters: u32,
}

impl Summary {
    const NONE: Self = Self {
        area: 0.0,
        cost: 0.0,
        trees: 1,
        references: 0,
        clusters: 1,
    };

    fn is_leaf(&self) -> bool {
        self.trees == 1
    }
}

impl Node {
    const UNUSED: Self = Self {
        bounds: Aabb::EMPTY,
        below: Below::Cluster { first: 0 },
        summary: Summary::NONE,
    };
}

/// The memory of a build.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    places: Vec<Place>,
    places_scratch: Vec<Place>,
    /// The ids of the references along the curve.
    ids: Vec<LeafReference>,
    clusters: Vec<Cluster>,
    /// The clusters of the next round.
    merged: Vec<Cluster>,
    /// Which other cluster each chose, as a distance along the curve; 0 is none.
    choices: Vec<i8>,
    /// What happens to each piece of the clusters in a round.
    pieces: Vec<Piece>,
    nodes: Vec<Node>,
    /// The first clusters in the order of the tree.
    order: Vec<u32>,
}

impl Memory {
    pub(crate) fn bytes(&self) -> usize {
        (self.places.capacity() + self.places_scratch.capacity()) * size_of::<Place>()
            + self.ids.capacity() * size_of::<LeafReference>()
            + (self.clusters.capacity() + self.merged.capacity()) * size_of::<Cluster>()
            + self.choices.capacity()
            + self.pieces.capacity() * size_of::<Piece>()
            + self.nodes.capacity() * size_of::<Node>()
            + self.order.capacity() * size_of::<u32>()
    }
}

/// A subtree that waits for others, with all that merging needs to know.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    /// The free lanes are 0.
    bounds: Bounds,
    node: u32,
    summary: Summary,
}

impl Cluster {
    const NONE: Self = Self {
        bounds: Bounds::EMPTY,
        node: 0,
        summary: Summary::NONE,
    };
}

/// Builds the records of a tree over `workspace.references`, of which there is at least one.
/// Returns the root.
pub(crate) fn build(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Record, BuildError> {
    let n = workspace.references.len();
    let model = Model::new(params);
    let (memory, control) = (&mut workspace.agglomerative, &workspace.control);
    places::encode(&workspace.references, &mut memory.places, control)?;
    places::sort(&mut memory.places, &mut memory.places_scratch, control)?;
    let isa = Isa::best();
    groups::first_clusters(&model, &workspace.references, isa, memory, control)?;
    rounds::merge_all(&model, isa, memory, control)?;
    workspace.leaves.resize(n, LeafReference::default());
    workspace.records.clear();
    // The root stands behind the first clusters, or is the only one of them.
    let clusters = memory.order.len();
    let root = if clusters > 1 { clusters } else { 0 };
    let mut emission = Emission {
        control,
        model,
        nodes: &memory.nodes,
        ids: &memory.ids,
        order: &mut memory.order,
        leaves: &mut workspace.leaves,
        used_leaves: 0,
        records: &mut workspace.records,
    };
    emission.node(root as u32, 1)
}

/// Parameters in the form in which costs need them.
struct Model {
    params: BuildParams,
    block_shift: u32,
}

impl Model {
    fn new(params: &BuildParams) -> Self {
        Self {
            params: params.canonical(),
            block_shift: params.sah_block_shift(),
        }
    }

    fn leaf_cost(&self, area: f32, references: u32) -> f32 {
        let blocks = (references + (1 << self.block_shift) - 1) >> self.block_shift;
        self.params.intersection_cost * (area * blocks as f32)
    }

    /// A cluster of the first round.
    fn first(&self, area: f32, references: u32) -> Summary {
        Summary {
            area,
            cost: self.leaf_cost(area, references),
            references,
            ..Summary::NONE
        }
    }

    /// Two clusters as one. If they do not become a leaf, what is below is as many trees as fit
    /// into one node of the wide tree.
    fn merged(&self, area: f32, left: &Summary, right: &Summary) -> Summary {
        let params = &self.params;
        let references = left.references + right.references;
        let closed = |side: &Summary| match side.trees {
            1 => side.cost,
            _ => params.traversal_cost * side.area + side.cost,
        };
        let (mut cost, mut trees) = (left.cost + right.cost, left.trees + right.trees);
        if trees > params.branching_factor {
            (cost, trees) = (closed(left) + closed(right), 2);
        }
        let leaf_cost = self.leaf_cost(area, references);
        // Written so that costs that are not numbers never forbid or demand what limits do.
        if references <= params.min_leaf_size
            || references <= params.max_leaf_size
                && leaf_cost <= params.traversal_cost * area + cost
        {
            (cost, trees) = (leaf_cost, 1);
        }
        Summary {
            area,
            cost,
            trees,
            references,
            clusters: left.clusters + right.clusters,
        }
    }
}

/// The half area of a box, given by its lower and its negated upper sides: the signs of the negated
/// lengths cancel out.
#[inline(always)]
fn half_area([a, b, c, d, e, f]: [f32; 6]) -> f32 {
    let (x, y, z) = (a + d, b + e, c + f);
    x * (y + z) + y * z
}

/// The lesser of two; the second if one is not a number. One instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{BuildPrimitive, Hierarchy, HierarchyNode, Quality};

    fn params() -> BuildParams {
        BuildParams {
            quality: Quality::Agglomerative,
            ..BuildParams::embree_scene_medium()
        }
    }

    fn primitives(boxes: impl Iterator<Item = (Vec3, Vec3)>) -> Vec<BuildPrimitive> {
        (0..)
            .zip(boxes)
            .map(|(primitive_id, (min, max))| BuildPrimitive {
                bounds: Aabb { min, max },
                geometry_id: primitive_id % 3,
                primitive_id,
            })
            .collect()
    }

    /// Numbers in 0..1 without a pattern.
    fn noise(n: usize) -> Vec<f32> {
        let mut state = 1_u32;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                let mixed = (state >> (state >> 28)) ^ state;
                (mixed.wrapping_mul(277_803_737) >> 8) as f32 / (1 << 24) as f32
            })
            .collect()
    }

    fn scattered(n: usize) -> Vec<BuildPrimitive> {
        let numbers = noise(6 * n);
        primitives(numbers.chunks_exact(6).map(|c| {
            let corner = Vec3::new(c[0], c[1], c[2] * c[2]);
            (corner, corner + Vec3::new(c[3], c[4], c[5]) * 0.01)
        }))
    }

    /// Checks a tree and returns its depth.
    fn check(tree: &Hierarchy, primitives: &[BuildPrimitive], params: &BuildParams) -> u32 {
        fn walk(
            node: HierarchyNode<'_>,
            primitives: &[BuildPrimitive],
            params: &BuildParams,
            seen: &mut [bool],
        ) -> u32 {
            if let Some(leaf) = node.leaf() {
                assert!((1..=params.max_leaf_size as usize).contains(&leaf.len()));
                assert!(leaf.is_sorted_by_key(|leaf| (leaf.primitive_id, leaf.geometry_id)));
                let mut bounds = Aabb::EMPTY;
                for reference in leaf {
                    let id = reference.primitive_id as usize;
                    assert_eq!(reference.geometry_id, primitives[id].geometry_id);
                    assert!(!std::mem::replace(&mut seen[id], true), "{id} twice");
                    bounds = bounds.union(primitives[id].bounds);
                }
                assert_eq!(node.bounds(), bounds);
                return 1;
            }
            assert!((2..=params.branching_factor as usize).contains(&node.children().len()));
            let bounds = node
                .children()
                .fold(Aabb::EMPTY, |all, child| all.union(child.bounds()));
            assert_eq!(node.bounds(), bounds);
            let depth = |child| walk(child, primitives, params, seen);
            1 + node.children().map(depth).max().unwrap_or(0)
        }
        let mut seen = vec![false; primitives.len()];
        let root = tree.root().expect("there are primitives");
        let depth = walk(root, primitives, params, &mut seen);
        assert!(depth <= params.max_depth);
        assert!(seen.into_iter().all(|seen| seen));
        depth
    }

    #[test]
    fn trees_over_anything_hold_every_primitive_once_in_exact_boxes() {
        let zero = Vec3::ZERO;
        let line = |n: usize| (0..n).map(|i| (Vec3::X * i as f32, Vec3::X * (i + 1) as f32));
        let sizes = |n: usize| (1..=n).map(|i| (Vec3::splat(-(i as f32)), Vec3::splat(i as f32)));
        let powers = (0..=20).map(|e| Vec3::splat(2_f32.powi(e)));
        let mut workspace = BuildWorkspace::default();
        for input in [
            scattered(1),
            scattered(2),
            scattered(3),
            scattered(5000),
            primitives((0..10_000).map(|_| (zero, Vec3::ONE))),
            primitives((0..10_000).map(|_| (zero, zero))),
            primitives(line(10_000)),
            primitives(line(300).map(|(a, _)| (a, a))),
            primitives(powers.map(|corner| (-corner, corner))),
            primitives(sizes(20_000)),
            primitives(sizes(20_000).map(|(_, corner)| (zero, corner))),
            primitives((0..100).map(|_| (Vec3::splat(-1e30), Vec3::splat(1e30)))),
        ] {
            for (branching_factor, min_leaf_size, max_leaf_size, max_depth) in [
                (2, 1, 1, 64),
                (2, 1, 8, 32),
                (3, 4, 4, 17),
                (4, 64, 64, 20),
                (8, 4, 28, 40),
                (8, 5, 7, 9),
                (16, 1, 28, 5),
            ] {
                let params = BuildParams {
                    branching_factor,
                    min_leaf_size,
                    max_leaf_size,
                    max_depth,
                    ..params()
                };
                let tree = Hierarchy::build(&input, None, &params, &mut workspace);
                check(&tree.expect("fits"), &input, &params);
            }
        }
    }

    #[test]
    fn threads_do_not_change_the_tree() {
        let input = scattered(100_000);
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().expect("threads");
            pool.install(|| {
                let tree =
                    Hierarchy::build(&input, None, &params(), &mut BuildWorkspace::default())
                        .expect("fits");
                check(&tree, &input, &params());
                format!("{tree:?}")
            })
        };
        let one = build(1);
        assert!(one == build(2));
        assert!(one == build(8));
    }

    #[test]
    fn a_second_build_allocates_nothing_and_is_the_same() {
        let input = scattered(3000);
        let mut workspace = BuildWorkspace::default();
        let mut build = || {
            let tree = Hierarchy::build(&input, None, &params(), &mut workspace).expect("fits");
            (format!("{tree:?}"), workspace.bytes())
        };
        assert_eq!(build(), build());
    }

    #[test]
    fn too_few_levels_are_an_error() {
        let params = BuildParams {
            max_depth: 2,
            ..params()
        };
        let result = Hierarchy::build(
            &scattered(1000),
            None,
            &params,
            &mut BuildWorkspace::default(),
        );
        assert!(matches!(result, Err(BuildError::DepthLimit { .. })));
    }

    #[test]
    fn a_small_stack_suffices() {
        let sizes = (1..=100_000).map(|i| (Vec3::ZERO, Vec3::splat(i as f32)));
        let input = primitives(sizes);
        let build = move || {
            let params = BuildParams {
                branching_factor: 2,
                max_depth: 64,
                ..params()
            };
            Hierarchy::build(&input, None, &params, &mut BuildWorkspace::default()).is_ok()
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .stack_size(128 << 10);
        assert!(pool.build().expect("threads").install(build));
    }
}
