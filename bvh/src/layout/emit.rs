//! From records to nodes and blocks of primitives.
//!
//! Nodes are laid out depth first, children in ascending order of area; each subtree knows how
//! many nodes and blocks it needs, so that threads fill disjoint slices.

use super::{
    block::{BLOCK_SIZE, BlockOf, Primitives},
    node::{ChildRef, Node, half_area, ranks},
    spares::{Part, Spares},
    tree::Tree,
};
use crate::{
    bounds::Aabb,
    build::{
        LeafReference,
        record::{Kind, Record},
        tasks,
    },
    error::BuildError,
    simd::{prefetch, stack::MAX_LEVELS},
};

/// Where the parts of a finished build are found.
pub(crate) struct Source<'a, P> {
    pub(crate) root: Option<Record>,
    pub(crate) records: &'a [Record],
    pub(crate) leaves: &'a [LeafReference],
    pub(crate) primitives: P,
}

/// Every so many records begin another cache line, or nearly so.
const RECORDS_PER_LINE: usize = 64 / size_of::<Record>();

/// The part of the arrays that a subtree fills.
struct Slots<'a, const N: usize, const W: usize, B> {
    nodes: &'a mut [Node<N, W>],
    blocks: &'a mut [B],
    first_node: u32,
    first_block: u32,
    /// Level of the subtree, the root being level 1.
    level: usize,
}

impl<P: Primitives> Source<'_, P> {
    /// The tree of a build, in spare memory where there is some.
    ///
    /// # Errors
    /// [`BuildError::TreeTooLarge`] if references cannot number its parts.
    pub(crate) fn emit<const N: usize, const W: usize, B: BlockOf<P> + Part>(
        &self,
        spares: &mut Spares,
    ) -> Result<Tree<N, W, B>, BuildError>
    where
        Node<N, W>: Part,
    {
        let mut tree = Tree {
            nodes: vec![],
            blocks: vec![],
            points: vec![],
        };
        let Some(root) = &self.root else {
            return Ok(tree);
        };
        let (nodes, blocks) = (root.nodes as usize, root.blocks as usize);
        check_count("nodes", nodes, ChildRef::NODE_LIMIT)?;
        check_count("blocks of primitives", blocks, ChildRef::BLOCK_LIMIT)?;
        // A tree that is a single leaf gets a node above it, so that traversal starts the same way.
        // Subtrees fill their parts of both arrays whole, since the counts of a record are those of
        // its children: nothing of an older tree is left.
        tree.nodes = spares.take_filled(nodes.max(1), Node::default());
        tree.blocks = spares.take_filled(blocks, B::new(&[], &self.primitives));
        if B::INDEXED {
            tree.points = spares.take_empty(self.primitives.point_count());
            tree.points.extend(self.primitives.points());
        }
        let slots = Slots {
            nodes: &mut tree.nodes,
            blocks: &mut tree.blocks,
            first_node: 0,
            first_block: 0,
            level: 1,
        };
        match root.kind {
            Kind::Inner => self.child(root, slots),
            Kind::Leaf => self.children(std::slice::from_ref(root), slots),
        }
        Ok(tree)
    }

    fn children<const N: usize, const W: usize, B: BlockOf<P>>(
        &self,
        children: &[Record],
        slots: Slots<'_, N, W, B>,
    ) {
        // The stack of a traversal has room for so many levels and no more.
        assert!(slots.level < MAX_LEVELS, "the builder keeps max_depth");
        // What is read below and in the children lies all over memory: it is asked for in rounds,
        // so that the ways to it overlap.
        for child in children {
            match child.kind {
                Kind::Inner => {
                    let records = &self.records[child.range()];
                    records.iter().step_by(RECORDS_PER_LINE).for_each(prefetch);
                }
                Kind::Leaf => self.leaves[child.range()]
                    .iter()
                    .for_each(|&leaf| self.primitives.prefetch_ids(leaf)),
            }
        }
        let mut area = [f32::INFINITY; N];
        for (area, child) in area.iter_mut().zip(children) {
            *area = half_area(&child.bounds());
        }
        let mut order = [0; N];
        for (child, &place) in ranks(&area).iter().enumerate() {
            order[place as usize] = child;
        }
        let order = &order[..children.len()];
        let (own, mut nodes) = slots
            .nodes
            .split_first_mut()
            .expect("a subtree has room for its node");
        let mut node_children = [(Aabb::EMPTY, ChildRef::inner(0)); N];
        let (mut node, mut block) = (slots.first_node + 1, slots.first_block);
        for (own, &index) in node_children.iter_mut().zip(order) {
            let child = &children[index];
            let reference = match child.kind {
                Kind::Inner => ChildRef::inner(node),
                Kind::Leaf => ChildRef::leaf(block, child.blocks),
            };
            *own = (child.bounds(), reference);
            node += child.nodes;
            block += child.blocks;
        }
        *own = Node::new(&node_children[..children.len()]);
        if !B::INDEXED {
            for child in children.iter().filter(|child| child.kind == Kind::Leaf) {
                for &leaf in &self.leaves[child.range()] {
                    self.primitives.prefetch(leaf);
                }
            }
        }
        let parallel = slots.blocks.len() * BLOCK_SIZE >= tasks::TASK_SIZE;
        let mut jobs: [Option<(&Record, Slots<'_, N, W, B>)>; N] = [const { None }; N];
        let (mut blocks, mut node, mut block) =
            (slots.blocks, slots.first_node + 1, slots.first_block);
        for (job, &index) in jobs.iter_mut().zip(order) {
            let child = &children[index];
            let (child_nodes, other_nodes) = nodes.split_at_mut(child.nodes as usize);
            let (child_blocks, other_blocks) = blocks.split_at_mut(child.blocks as usize);
            (nodes, blocks) = (other_nodes, other_blocks);
            let child_slots = Slots {
                nodes: child_nodes,
                blocks: child_blocks,
                first_node: node,
                first_block: block,
                level: slots.level + 1,
            };
            node += child.nodes;
            block += child.blocks;
            if parallel {
                *job = Some((child, child_slots));
            } else {
                self.child(child, child_slots);
            }
        }
        if parallel {
            self.run(&mut jobs[..children.len()]);
        }
    }

    fn child<const N: usize, const W: usize, B: BlockOf<P>>(
        &self,
        record: &Record,
        slots: Slots<'_, N, W, B>,
    ) {
        match record.kind {
            Kind::Inner => self.children(&self.records[record.range()], slots),
            Kind::Leaf => self.leaf(record, slots.blocks),
        }
    }

    /// Fills subtrees at the same time.
    fn run<const N: usize, const W: usize, B: BlockOf<P>>(
        &self,
        jobs: &mut [Option<(&Record, Slots<'_, N, W, B>)>],
    ) {
        if let [job] = jobs {
            if let Some((record, slots)) = job.take() {
                self.child(record, slots);
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

    fn leaf<B: BlockOf<P>>(&self, record: &Record, blocks: &mut [B]) {
        let leaves = self.leaves[record.range()].chunks(BLOCK_SIZE);
        for (block, leaves) in blocks.iter_mut().zip(leaves) {
            *block = B::new(leaves, &self.primitives);
        }
    }
}

fn check_count(parts: &'static str, count: usize, limit: usize) -> Result<(), BuildError> {
    if count <= limit {
        Ok(())
    } else {
        Err(BuildError::TreeTooLarge {
            parts,
            count,
            limit,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::triangles::{EdgeBlock, Triangles};

    /// The error of a tree that claims so many parts; nothing is allocated for it.
    fn error_of(nodes: u32, blocks: u32) -> Option<BuildError> {
        let source = Source {
            root: Some(Record {
                nodes,
                blocks,
                ..Record::UNUSED
            }),
            records: &[],
            leaves: &[],
            primitives: Triangles {
                meshes: &[],
                first_ids: &[],
                first_points: &[],
                scale: 1.0,
            },
        };
        source.emit::<8, 8, EdgeBlock>(&mut Spares::default()).err()
    }

    #[test]
    fn parts_that_cannot_be_numbered_are_an_error() {
        let too_large = |parts, count, limit| {
            Some(BuildError::TreeTooLarge {
                parts,
                count,
                limit,
            })
        };
        let (nodes, blocks) = (1 << 31, 1 << 27);
        assert_eq!(
            error_of(nodes + 1, 1),
            too_large("nodes", (1 << 31) + 1, 1 << 31)
        );
        assert_eq!(
            error_of(1, blocks + 1),
            too_large("blocks of primitives", (1 << 27) + 1, 1 << 27)
        );
    }
}
