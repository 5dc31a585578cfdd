//! A tree as plain data, whoever built it, and where two trees differ first.
//!
//! Invariant: children, and primitives within a leaf, keep the order of their builder. Boxes are
//! compared as numbers, so that −0 and +0 are equal.

use std::fmt;

use raywright_bvh::{Aabb, Hierarchy, HierarchyNode, LeafReference};

/// A tree; `None` if it was built over nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// The root.
    pub root: Option<Node>,
}

/// A node or leaf.
#[derive(Clone, Debug, PartialEq)]
pub enum Node {
    /// The primitives of a leaf.
    Leaf(Vec<LeafReference>),
    /// The children of an inner node, each with the box that its builder gave it.
    Inner(Vec<(Aabb, Node)>),
}

/// Where two trees differ first, in depth-first order.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// The number of the child at each level below the root.
    pub path: Vec<usize>,
    /// What differs there; the left tree is named first.
    pub what: String,
}

impl Tree {
    /// A copy of a tree of ours.
    #[must_use]
    pub fn of(hierarchy: &Hierarchy) -> Self {
        Self {
            root: hierarchy.root().map(|root| Node::of(&root)),
        }
    }

    /// Where this tree and another differ first; `None` if they are equal.
    #[must_use]
    pub fn first_difference(&self, other: &Self) -> Option<Difference> {
        let mut path = Vec::new();
        let what = match (&self.root, &other.root) {
            (Some(left), Some(right)) => left.first_difference(right, &mut path)?,
            (None, None) => return None,
            (left, right) => format!("{} against {}", summary(left), summary(right)),
        };
        Some(Difference { path, what })
    }
}

impl Node {
    fn of(node: &HierarchyNode<'_>) -> Self {
        match node.leaf() {
            Some(references) => Self::Leaf(references.to_vec()),
            None => Self::Inner(
                node.children()
                    .map(|child| (child.bounds(), Self::of(&child)))
                    .collect(),
            ),
        }
    }

    /// References in all leaves at and below it.
    #[must_use]
    pub fn references(&self) -> usize {
        match self {
            Self::Leaf(references) => references.len(),
            Self::Inner(children) => children.iter().map(|(_, child)| child.references()).sum(),
        }
    }

    fn first_difference(&self, other: &Self, path: &mut Vec<usize>) -> Option<String> {
        let (left, right) = match (self, other) {
            (Self::Inner(left), Self::Inner(right)) if left.len() == right.len() => (left, right),
            (Self::Leaf(left), Self::Leaf(right)) if left == right => return None,
            _ => return Some(format!("{self} against {other}")),
        };
        // All boxes of a node first: they are decided before what is below.
        for (slot, ((a, _), (b, _))) in left.iter().zip(right).enumerate() {
            if a != b {
                return Some(format!(
                    "box of child {slot}: {} against {}; {self} against {other}",
                    box_text(a),
                    box_text(b)
                ));
            }
        }
        for (slot, ((_, a), (_, b))) in left.iter().zip(right).enumerate() {
            path.push(slot);
            if let Some(what) = a.first_difference(b, path) {
                return Some(what);
            }
            path.pop();
        }
        None
    }
}

impl fmt::Display for Node {
    /// One line: a leaf with its first primitives, or a node with the sizes of its children.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 8;
        match self {
            Self::Leaf(references) => {
                write!(f, "leaf of {}:", references.len())?;
                for r in references.iter().take(SHOWN) {
                    write!(f, " {}:{}", r.geometry_id, r.primitive_id)?;
                }
                f.write_str(if references.len() > SHOWN { " …" } else { "" })
            }
            Self::Inner(children) => {
                write!(f, "node of {} children with", children.len())?;
                for (_, child) in children {
                    write!(f, " {}", child.references())?;
                }
                f.write_str(" references")
            }
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("at root")?;
        for slot in &self.path {
            write!(f, ".{slot}")?;
        }
        write!(f, ": {}", self.what)
    }
}

fn summary(node: &Option<Node>) -> String {
    node.as_ref()
        .map_or_else(|| "nothing".into(), ToString::to_string)
}

/// A box with all digits.
fn box_text(b: &Aabb) -> String {
    format!("{:?}..{:?}", b.min.to_array(), b.max.to_array())
}

#[cfg(test)]
mod tests {
    use raywright_bvh::{BuildParams, BuildPrimitive, Vec3};

    use super::*;

    fn leaf(ids: &[u32]) -> Node {
        let reference = |&primitive_id: &u32| LeafReference {
            geometry_id: 0,
            primitive_id,
        };
        Node::Leaf(ids.iter().map(reference).collect())
    }

    fn inner(children: Vec<Node>) -> Tree {
        let bounds = Aabb {
            min: Vec3::ZERO,
            max: Vec3::ONE,
        };
        let children = children.into_iter().map(|child| (bounds, child)).collect();
        Tree {
            root: Some(Node::Inner(children)),
        }
    }

    #[test]
    fn the_first_difference_has_a_path() {
        let left = inner(vec![leaf(&[0]), leaf(&[1, 2])]);
        assert_eq!(left.first_difference(&left.clone()), None);
        let other = inner(vec![leaf(&[0]), leaf(&[2, 1])]);
        let difference = left.first_difference(&other).expect("a difference");
        assert_eq!(difference.path, [1]);
        assert!(difference.to_string().starts_with("at root.1: leaf of 2:"));
        assert!(left.first_difference(&Tree::default()).is_some());
    }

    #[test]
    fn a_copy_of_a_hierarchy_has_its_leaves() {
        let primitives: Vec<BuildPrimitive> = (0..9)
            .map(|i| BuildPrimitive {
                bounds: Aabb {
                    min: Vec3::splat(i as f32),
                    max: Vec3::splat(i as f32 + 0.5),
                },
                geometry_id: 0,
                primitive_id: i,
            })
            .collect();
        let mut params = BuildParams::embree_api_default();
        params.max_leaf_size = 1;
        let hierarchy = Hierarchy::build(&primitives, None, &params, &mut Default::default());
        let tree = Tree::of(&hierarchy.expect("a tree"));
        assert_eq!(tree.root.expect("a root").references(), 9);
    }
}
