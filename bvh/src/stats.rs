//! What a tree is like: counts, depth, cost, bytes.
//!
//! The surface area heuristic in Embree's units, in f64 from the stored boxes, R the root box:
//! expected node visits Σ A(inner)/A(R), expected primitives Σ A(leaf)·n/A(R), expected blocks
//! Σ A(leaf)·⌈n/b⌉/A(R). See MacDonald, Booth, *Heuristics for Ray Tracing Using Space
//! Subdivision*, 1990.

use crate::{
    bounds::Aabb,
    layout::{node::ChildRef, tree::Tree, triangles::Block},
    params::BuildParams,
};

/// Figures of a tree. The root is level 1; leaves count as a level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TreeStats {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References to primitives in all leaves.
    pub references: usize,
    /// Levels on the longest way from the root to a leaf, both included.
    pub depth: usize,
    /// Largest number of references in a leaf.
    pub largest_leaf: usize,
    /// Children over all slots for children.
    pub node_fill: f64,
    /// Expected visits of inner nodes by a random line that meets the root box.
    pub sah_nodes: f64,
    /// Expected tests of single primitives by such a line.
    pub sah_primitives: f64,
    /// Expected tests of blocks of `sah_block_size` primitives by such a line.
    pub sah_blocks: f64,
    /// `traversal_cost · sah_nodes + intersection_cost · sah_blocks`.
    pub sah_cost: f64,
    /// Bytes of nodes, leaves and, where leaves refer to them, vertices.
    pub bytes: usize,
}

impl TreeStats {
    pub(crate) fn of<const N: usize, const W: usize, B: Block>(
        tree: &Tree<N, W, B>,
        params: &BuildParams,
    ) -> Self {
        let mut stats = Self {
            bytes: tree.bytes(),
            ..Self::default()
        };
        let Some(root) = tree.nodes.first() else {
            return stats;
        };
        let root_bounds = (0..N).fold(Aabb::EMPTY, |all, slot| all.union(root.child_bounds(slot)));
        let root_area = half_area(&root_bounds);
        // A flat or pointlike scene has no area to be relative to; every visit is then certain.
        let share = |bounds: &Aabb| {
            if root_area > 0.0 {
                half_area(bounds) / root_area
            } else {
                1.0
            }
        };
        let block_shift = params.sah_block_shift();
        let mut children_in_use = 0;
        let mut stack = vec![(0_u32, root_bounds, 1_usize)];
        while let Some((index, bounds, level)) = stack.pop() {
            // A tree that is one leaf has a node above it for traversal alone.
            let is_wrapper = tree.nodes.len() == 1 && tree.children(0).count() == 1;
            let child_level = if is_wrapper { 1 } else { level + 1 };
            if !is_wrapper {
                stats.nodes += 1;
                stats.sah_nodes += share(&bounds);
            }
            for (slot, child) in tree.children(index) {
                children_in_use += 1;
                let bounds = tree.nodes[index as usize].child_bounds(slot);
                if child.is_leaf() {
                    let size = tree.blocks[child.blocks()]
                        .iter()
                        .map(Block::len)
                        .sum::<usize>();
                    stats.leaves += 1;
                    stats.references += size;
                    stats.depth = stats.depth.max(child_level);
                    stats.largest_leaf = stats.largest_leaf.max(size);
                    stats.sah_primitives += share(&bounds) * size as f64;
                    stats.sah_blocks += share(&bounds) * size.div_ceil(1 << block_shift) as f64;
                } else {
                    let ChildRef(node) = child;
                    stack.push((node, bounds, child_level));
                }
            }
        }
        stats.node_fill = children_in_use as f64 / (N * tree.nodes.len()) as f64;
        stats.sah_cost = f64::from(params.traversal_cost) * stats.sah_nodes
            + f64::from(params.intersection_cost) * stats.sah_blocks;
        stats
    }
}

fn half_area(bounds: &Aabb) -> f64 {
    if bounds.is_empty() {
        return 0.0;
    }
    let d = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    d.x * (d.y + d.z) + d.y * d.z
}
