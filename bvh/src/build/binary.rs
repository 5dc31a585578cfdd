//! A binary tree that can be changed: one cache line per node, with links in both directions.
//!
//! Invariants: node 0 is the root; an inner node has two children that name it as their parent, and
//! its box and area are those of the union of its children; after [`BinaryTree::load`] and
//! [`BinaryTree::sort`] the nodes are in preorder, so that the left child of node i is i + 1, every
//! subtree is a range of nodes, and it begins with its root.

use super::{
    primitive::Bounds,
    record::{Kind, Record},
};

/// The root.
pub(crate) const ROOT: u32 = 0;

/// A node: a box, the half area of the box, and links.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Node {
    /// The free lanes are 0: numbers of any other kind there make arithmetic slow.
    pub(crate) bounds: Bounds,
    pub(crate) area: f32,
    /// The root is its own parent.
    pub(crate) parent: u32,
    pub(crate) below: Below,
}

/// What is behind a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Below {
    Children([u32; 2]),
    Leaf {
        /// Place of the first primitive among the leaf references.
        first: u32,
        count: u32,
    },
}

impl Node {
    fn of(record: &Record, parent: u32) -> Self {
        let bounds = Bounds::of_aabb(&record.bounds());
        Self {
            bounds,
            area: bounds.half_area(),
            parent,
            below: match record.kind {
                Kind::Leaf => Below::Leaf {
                    first: record.first,
                    count: record.count,
                },
                Kind::Inner => Below::Children([record.first, record.first + 1]),
            },
        }
    }
}

/// The tree and the memory that its changes need.
#[derive(Debug, Default)]
pub(crate) struct BinaryTree {
    pub(crate) nodes: Vec<Node>,
    sorted: Vec<Node>,
    /// A place to go on from, and the node above it.
    stack: Vec<(u32, u32)>,
}

impl BinaryTree {
    pub(crate) fn bytes(&self) -> usize {
        (self.nodes.capacity() + self.sorted.capacity()) * size_of::<Node>()
            + self.stack.capacity() * size_of::<(u32, u32)>()
    }

    /// Takes over a tree of records, each inner one of which has two children.
    pub(crate) fn load(&mut self, records: &[Record], root: &Record) {
        self.nodes.clear();
        self.stack.clear();
        let mut next = Some((*root, ROOT));
        while let Some((record, parent)) = next {
            let index = self.nodes.len() as u32;
            let mut node = Node::of(&record, parent);
            self.link(parent, index);
            next = if let Below::Children([left, right]) = &mut node.below {
                self.stack.push((*right, index));
                let left = std::mem::replace(left, index + 1);
                Some((records[left as usize], index))
            } else {
                self.stack
                    .pop()
                    .map(|(record, parent)| (records[record as usize], parent))
            };
            self.nodes.push(node);
        }
    }

    /// Names node `index` as the right child of `parent`, if it is not the left one.
    fn link(&mut self, parent: u32, index: u32) {
        if index > parent + 1 {
            let node = &mut self.nodes[parent as usize];
            if let Below::Children([_, right]) = &mut node.below {
                *right = index;
            }
        }
    }

    /// Brings the nodes into preorder.
    pub(crate) fn sort(&mut self) {
        std::mem::swap(&mut self.nodes, &mut self.sorted);
        self.nodes.clear();
        self.stack.clear();
        let mut next = Some((ROOT, ROOT));
        while let Some((old, parent)) = next {
            let index = self.nodes.len() as u32;
            let mut node = self.sorted[old as usize];
            node.parent = parent;
            self.link(parent, index);
            next = if let Below::Children([left, right]) = &mut node.below {
                self.stack.push((*right, index));
                Some((std::mem::replace(left, index + 1), index))
            } else {
                self.stack.pop()
            };
            self.nodes.push(node);
        }
    }
}
