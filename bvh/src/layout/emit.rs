//! From records to nodes and triangle blocks.
//!
//! Nodes are laid out depth first, children in ascending order of area; each subtree knows how
//! many nodes and blocks it needs, so that threads fill disjoint slices.

use glam::Vec3;

use super::{
    node::{ChildRef, Node},
    tree::Tree,
    triangles::{BLOCK_SIZE, TriangleBlock},
};
use crate::{
    bounds::Aabb,
    build::{
        LeafReference,
        record::{Kind, Record},
        tasks,
    },
};

/// Where the parts of a finished build are found.
pub(crate) struct Source<'a, F> {
    pub(crate) records: &'a [Record],
    pub(crate) leaves: &'a [LeafReference],
    /// Number over all meshes and scaled corners of a triangle.
    pub(crate) triangle: F,
}

/// The part of the arrays that a subtree fills.
struct Slots<'a, const N: usize, const W: usize> {
    nodes: &'a mut [Node<N, W>],
    blocks: &'a mut [TriangleBlock],
    first_node: u32,
    first_block: u32,
}

/// Refills `tree` from the records below `root`.
pub(crate) fn emit<const N: usize, const W: usize, F>(
    tree: &mut Tree<N, W>,
    root: Option<&Record>,
    source: &Source<'_, F>,
) where
    F: Fn(LeafReference) -> (u32, [Vec3; 3]) + Sync,
{
    tree.nodes.clear();
    tree.blocks.clear();
    let Some(root) = root else { return };
    // A tree that is a single leaf gets a node above it, so that traversal starts the same way.
    tree.nodes
        .resize(root.nodes.max(1) as usize, Node::default());
    tree.blocks
        .resize(root.blocks as usize, TriangleBlock::default());
    let slots = Slots {
        nodes: &mut tree.nodes,
        blocks: &mut tree.blocks,
        first_node: 0,
        first_block: 0,
    };
    match root.kind {
        Kind::Inner => source.node(root, slots),
        Kind::Leaf => source.children(std::slice::from_ref(root), slots),
    }
}

impl<F: Fn(LeafReference) -> (u32, [Vec3; 3]) + Sync> Source<'_, F> {
    fn node<const N: usize, const W: usize>(&self, record: &Record, slots: Slots<'_, N, W>) {
        let first = record.first as usize;
        self.children(&self.records[first..first + record.count as usize], slots);
    }

    fn children<const N: usize, const W: usize>(
        &self,
        children: &[Record],
        slots: Slots<'_, N, W>,
    ) {
        let mut order: [usize; N] = std::array::from_fn(|i| i);
        let order = &mut order[..children.len()];
        let area = |&i: &usize| half_area(&children[i].bounds());
        order.sort_by(|a, b| area(a).total_cmp(&area(b)));
        let mut node_children = [(Aabb::EMPTY, ChildRef::inner(0)); N];
        let mut jobs: [Option<(&Record, Slots<'_, N, W>)>; N] = [const { None }; N];
        let (own, mut nodes) = slots
            .nodes
            .split_first_mut()
            .expect("a subtree has room for its node");
        let (mut blocks, mut node, mut block) =
            (slots.blocks, slots.first_node + 1, slots.first_block);
        for (slot, &index) in order.iter().enumerate() {
            let child = &children[index];
            let reference = match child.kind {
                Kind::Inner => ChildRef::inner(node),
                Kind::Leaf => ChildRef::leaf(block, child.blocks),
            };
            node_children[slot] = (child.bounds(), reference);
            let (child_nodes, other_nodes) = nodes.split_at_mut(child.nodes as usize);
            let (child_blocks, other_blocks) = blocks.split_at_mut(child.blocks as usize);
            jobs[slot] = Some((
                child,
                Slots {
                    nodes: child_nodes,
                    blocks: child_blocks,
                    first_node: node,
                    first_block: block,
                },
            ));
            (nodes, blocks) = (other_nodes, other_blocks);
            node += child.nodes;
            block += child.blocks;
        }
        *own = Node::new(&node_children[..order.len()]);
        self.run(&mut jobs[..order.len()]);
    }

    fn run<const N: usize, const W: usize>(&self, jobs: &mut [Option<(&Record, Slots<'_, N, W>)>]) {
        if let [job] = jobs {
            match job.take() {
                Some((record, slots)) if record.kind == Kind::Inner => self.node(record, slots),
                Some((record, slots)) => self.leaf(record, slots.blocks),
                None => {}
            }
            return;
        }
        let size: usize = jobs
            .iter()
            .flatten()
            .map(|(_, slots)| slots.blocks.len() * BLOCK_SIZE)
            .sum();
        let (a, b) = jobs.split_at_mut(jobs.len() / 2);
        if size < tasks::TASK_SIZE {
            self.run(a);
            self.run(b);
        } else {
            tasks::join(|| self.run(a), || self.run(b));
        }
    }

    fn leaf(&self, record: &Record, blocks: &mut [TriangleBlock]) {
        let first = record.first as usize;
        let leaves = &self.leaves[first..first + record.count as usize];
        for (block, leaves) in blocks.iter_mut().zip(leaves.chunks(BLOCK_SIZE)) {
            for (lane, &leaf) in leaves.iter().enumerate() {
                let (id, corners) = (self.triangle)(leaf);
                block.set(lane, id, corners);
            }
        }
    }
}

fn half_area(bounds: &Aabb) -> f32 {
    let d = bounds.max - bounds.min;
    d.x * (d.y + d.z) + d.y * d.z
}
