//! A tree as the kernels read it.

use super::{
    block::{Block, Point},
    node::{ChildRef, Node},
    spares::{Part, Spares},
};

/// Nodes depth first, the root first; an empty scene has no node. Coordinates are scaled by the
/// power of two that the tree's owner keeps.
#[derive(Clone, Debug)]
pub(crate) struct Tree<const N: usize, const W: usize, B> {
    pub(crate) nodes: Vec<Node<N, W>>,
    pub(crate) blocks: Vec<B>,
    /// What the blocks refer to; empty for blocks that hold their triangles themselves.
    pub(crate) points: Vec<Point>,
}

impl<const N: usize, const W: usize, B: Block> Tree<N, W, B> {
    /// The children in use of a node, with their slots.
    pub(crate) fn children(&self, node: u32) -> impl Iterator<Item = (usize, ChildRef)> {
        let node = &self.nodes[node as usize];
        (0..N)
            .filter(|&slot| !node.child_bounds(slot).is_empty())
            .map(|slot| (slot, ChildRef(node.children[slot])))
    }

    /// Gives up the tree for its memory.
    pub(crate) fn recycle(self, spares: &mut Spares)
    where
        Node<N, W>: Part,
        B: Part,
    {
        spares.keep(self.nodes);
        spares.keep(self.blocks);
        spares.keep(self.points);
    }

    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.blocks[..]) + size_of_val(&self.points[..])
    }
}
