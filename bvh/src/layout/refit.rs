//! New boxes for an old tree, from the leaves up.
//!
//! Nodes lie so that children come after their parent, hence one way back through the array meets
//! all children first. Slots are put in ascending order of area again and the orders of the octants
//! are found anew: those are what keeps traversal fast, not what makes it right.
//!
//! Invariants: a box encloses the whole of every triangle below it, also of those of which the
//! builder put parts into several leaves, since nobody knows where the parts went; blocks are
//! those that a build would make of the same triangles in the same leaves; nothing here can fail,
//! so that a tree is never left half done.

use super::{
    block::{BLOCK_SIZE, Block, BlockOf, Primitives},
    node::{ChildRef, Node, half_area, ranks},
    tree::Tree,
    triangles::Triangles,
};
use crate::{bounds::Aabb, build::tasks};

/// So many blocks are worth a task.
const BLOCKS_PER_PIECE: usize = tasks::PIECE_SIZE / BLOCK_SIZE;

impl<const N: usize, const W: usize, B: Block> Tree<N, W, B> {
    /// Moves the tree to other vertices of the same number of triangles in each mesh.
    pub(crate) fn refit<'t>(&mut self, triangles: &Triangles<'t>)
    where
        B: BlockOf<Triangles<'t>>,
    {
        if B::INDEXED && !self.nodes.is_empty() {
            self.points.clear();
            self.points.reserve_exact(triangles.point_count());
            self.points.extend(triangles.points());
        }
        let mut block_bounds = vec![Aabb::EMPTY; self.blocks.len()];
        refit_blocks(&mut self.blocks, &mut block_bounds, triangles);
        let mut node_bounds = vec![Aabb::EMPTY; self.nodes.len()];
        for index in (0..self.nodes.len()).rev() {
            let mut children = [(Aabb::EMPTY, ChildRef::inner(0)); N];
            let mut area = [f32::INFINITY; N];
            let mut count = 0;
            for (_, child) in self.children(index as u32) {
                let bounds = if child.is_leaf() {
                    let own = block_bounds[child.blocks()].iter();
                    own.fold(Aabb::EMPTY, |all, &bounds| all.union(bounds))
                } else {
                    let ChildRef(node) = child;
                    node_bounds[node as usize]
                };
                node_bounds[index] = node_bounds[index].union(bounds);
                children[count] = (bounds, child);
                area[count] = half_area(&bounds);
                count += 1;
            }
            let mut ordered = children;
            for (&child, &place) in children[..count].iter().zip(&ranks(&area)) {
                ordered[place as usize] = child;
            }
            self.nodes[index] = Node::new(&ordered[..count]);
        }
    }
}

/// Rewrites blocks and finds the box of each.
fn refit_blocks<'t, B: BlockOf<Triangles<'t>>>(
    blocks: &mut [B],
    bounds: &mut [Aabb],
    triangles: &Triangles<'t>,
) {
    if blocks.len() > BLOCKS_PER_PIECE {
        let middle = blocks.len() / 2;
        let (left, right) = blocks.split_at_mut(middle);
        let (left_bounds, right_bounds) = bounds.split_at_mut(middle);
        tasks::join(
            || refit_blocks(left, left_bounds, triangles),
            || refit_blocks(right, right_bounds, triangles),
        );
        return;
    }
    for (block, bounds) in blocks.iter_mut().zip(bounds) {
        let mut leaves = [Default::default(); BLOCK_SIZE];
        let count = block.len();
        for (leaf, &id) in leaves.iter_mut().zip(&block.ids()[..count]) {
            *leaf = triangles.locate(id);
        }
        let leaves = &leaves[..count];
        *bounds = leaves.iter().fold(Aabb::EMPTY, |all, &leaf| {
            triangles
                .corners(leaf)
                .into_iter()
                .fold(all, Aabb::extended_by)
        });
        *block = B::new(leaves, triangles);
    }
}
