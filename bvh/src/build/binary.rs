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

/// Which binary tree a test wants.
#[cfg(test)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Neighbours, drawn at random, are united again and again.
    Random,
    /// Every right child is a leaf.
    Chain,
}

/// A binary tree over leaves of one or two references in random boxes: the root, the records, the
/// references.
#[cfg(test)]
pub(crate) fn random_tree(
    leaves: usize,
    seed: u64,
    shape: Shape,
) -> (Record, Vec<Record>, Vec<super::LeafReference>) {
    let mut state = seed;
    // Knuth's linear congruential generator.
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut references = Vec::new();
    let mut trees = Vec::new();
    for _ in 0..leaves {
        let corner = glam::Vec3::from([random(), random(), random()]);
        let size = glam::Vec3::from([random(), random(), random()]) * 0.2;
        let bounds = Bounds::of_aabb(&crate::Aabb {
            min: corner,
            max: corner + size,
        });
        let (first, count) = (references.len(), 1 + usize::from(random() < 0.5));
        references.extend((0..count).map(|place| super::LeafReference {
            geometry_id: 0,
            primitive_id: (first + place) as u32,
        }));
        trees.push(Record::leaf(&bounds, first, count));
    }
    let mut records = Vec::new();
    while trees.len() > 1 {
        let place = match shape {
            Shape::Random => (random() * (trees.len() - 1) as f32) as usize,
            Shape::Chain => 0,
        };
        let children = [trees.remove(place), trees[place]];
        trees[place] = Record::inner_around(records.len(), &children);
        records.extend(children);
    }
    (trees[0], records, references)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loaded_and_sorted_trees_are_in_preorder() {
        for (leaves, shape) in [
            (1, Shape::Random),
            (2, Shape::Random),
            (99, Shape::Random),
            (50, Shape::Chain),
        ] {
            let (root, records, _) = random_tree(leaves, 1, shape);
            let mut tree = BinaryTree::default();
            tree.load(&records, &root);
            assert_eq!(tree.nodes.len(), 2 * leaves - 1);
            let before: Vec<_> = tree.nodes.iter().map(|n| (n.parent, n.below)).collect();
            for (index, node) in (0..).zip(&tree.nodes) {
                if let Below::Children([left, right]) = node.below {
                    assert_eq!(left, index + 1);
                    assert!(right > left);
                    assert_eq!(tree.nodes[left as usize].parent, index);
                    assert_eq!(tree.nodes[right as usize].parent, index);
                }
            }
            tree.sort();
            let after: Vec<_> = tree.nodes.iter().map(|n| (n.parent, n.below)).collect();
            assert_eq!(before, after);
        }
    }
}
