//! Counts and costs of a tree as the golden lines state them.
//!
//! Costs are expected counts for a random line that meets the root box (surface area heuristic):
//! sums of A(node)/A(root) in f64, A(b) = dx·(dy+dz) + dy·dz of the differences in f64. They agree
//! if their relative difference is at most 10⁻⁹, since the files have twelve digits.

use std::collections::BTreeMap;

use raywright_bvh::Aabb;
use serde::Deserialize;

use super::{hash, lines::hex};
use crate::tree::{Node, Tree};

const COST_TOLERANCE: f64 = 1e-9;

/// Counts, costs and hashes of a tree.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
pub struct Figures {
    /// Inner nodes.
    pub inner: usize,
    /// Leaves.
    pub leaves: usize,
    /// References in all leaves.
    pub refs: usize,
    /// Nodes on the longest way from root to leaf, both counted.
    pub depth: usize,
    /// Σ A(inner)/A(root); absent if the root has no area.
    pub sah_trav: Option<f64>,
    /// Σ A(leaf)·size/A(root).
    pub sah_prim: Option<f64>,
    /// Σ A(leaf)·⌈size/2^s⌉/A(root), s = ⌊log2 of the block size⌋.
    pub sah_block: Option<f64>,
    /// Pairs of leaf size and number of such leaves, ascending.
    pub leaf_hist: Vec<(usize, usize)>,
    /// Pairs of child count and number of such nodes, ascending.
    pub arity_hist: Vec<(usize, usize)>,
    /// The hash with order.
    #[serde(deserialize_with = "hex")]
    pub hash: u64,
    /// The hash without order.
    #[serde(deserialize_with = "hex")]
    pub hash_unordered: u64,
}

#[derive(Default)]
struct Sums {
    depth: usize,
    trav: f64,
    prim: f64,
    block: f64,
    leaf_hist: BTreeMap<usize, usize>,
    arity_hist: BTreeMap<usize, usize>,
}

impl Figures {
    /// The figures of a tree over primitives in the box `root`; `sah_block_size` as in the
    /// parameters of the build.
    #[must_use]
    pub fn of(tree: &Tree, root: &Aabb, sah_block_size: u32) -> Self {
        let Some(node) = &tree.root else {
            return Self::default();
        };
        let mut sums = Sums::default();
        sums.add(node, root, 1, sah_block_size.max(1).ilog2());
        let root_area = half_area(root);
        let share = |sum: f64| (root_area > 0.0).then(|| sum / root_area);
        Self {
            inner: sums.arity_hist.values().sum(),
            leaves: sums.leaf_hist.values().sum(),
            refs: sums.leaf_hist.iter().map(|(size, n)| size * n).sum(),
            depth: sums.depth,
            sah_trav: share(sums.trav),
            sah_prim: share(sums.prim),
            sah_block: share(sums.block),
            leaf_hist: sums.leaf_hist.into_iter().collect(),
            arity_hist: sums.arity_hist.into_iter().collect(),
            hash: hash::ordered(node),
            hash_unordered: hash::unordered(node),
        }
    }

    /// Blocks of `size` primitives in all leaves.
    #[must_use]
    pub fn blocks(&self, size: usize) -> usize {
        let blocks = |(leaf, n): &(usize, usize)| leaf.div_ceil(size) * n;
        self.leaf_hist.iter().map(blocks).sum()
    }

    /// The names of the figures that differ from `expected`, hashes left aside, with both values.
    #[must_use]
    pub fn differences(&self, expected: &Self) -> Vec<String> {
        let mut found = Vec::new();
        let mut check = |name: &str, equal: bool, got: String, expected: String| {
            if !equal {
                found.push(format!("{name} {got}, expected {expected}"));
            }
        };
        for (name, got, expected) in [
            ("inner", self.inner, expected.inner),
            ("leaves", self.leaves, expected.leaves),
            ("refs", self.refs, expected.refs),
            ("depth", self.depth, expected.depth),
        ] {
            check(name, got == expected, got.to_string(), expected.to_string());
        }
        for (name, got, expected) in [
            ("sah_trav", self.sah_trav, expected.sah_trav),
            ("sah_prim", self.sah_prim, expected.sah_prim),
            ("sah_block", self.sah_block, expected.sah_block),
        ] {
            let equal = match (got, expected) {
                (Some(a), Some(b)) => (a - b).abs() <= COST_TOLERANCE * b.abs(),
                (a, b) => a == b,
            };
            check(name, equal, format!("{got:?}"), format!("{expected:?}"));
        }
        for (name, got, expected) in [
            ("leaf_hist", &self.leaf_hist, &expected.leaf_hist),
            ("arity_hist", &self.arity_hist, &expected.arity_hist),
        ] {
            let equal = got == expected;
            check(name, equal, format!("{got:?}"), format!("{expected:?}"));
        }
        found
    }
}

impl Sums {
    fn add(&mut self, node: &Node, bounds: &Aabb, level: usize, block_shift: u32) {
        let area = half_area(bounds);
        self.depth = self.depth.max(level);
        match node {
            Node::Leaf(references) => {
                let size = references.len();
                self.prim += area * size as f64;
                self.block += area * size.div_ceil(1 << block_shift) as f64;
                *self.leaf_hist.entry(size).or_default() += 1;
            }
            Node::Inner(children) => {
                self.trav += area;
                *self.arity_hist.entry(children.len()).or_default() += 1;
                for (bounds, child) in children {
                    self.add(child, bounds, level + 1, block_shift);
                }
            }
        }
    }
}

/// Half the surface area in f64; 0 for an empty box.
fn half_area(bounds: &Aabb) -> f64 {
    if bounds.is_empty() {
        return 0.0;
    }
    let [x, y, z] = [0, 1, 2].map(|k| f64::from(bounds.max[k]) - f64::from(bounds.min[k]));
    x * (y + z) + y * z
}

#[cfg(test)]
mod tests {
    use raywright_bvh::{LeafReference, Vec3};

    use super::*;

    fn cube(side: f32) -> Aabb {
        Aabb {
            min: Vec3::ZERO,
            max: Vec3::splat(side),
        }
    }

    #[test]
    fn costs_are_areas_over_the_root_area() {
        let leaf = |n| Node::Leaf(vec![LeafReference::default(); n]);
        let tree = Tree {
            root: Some(Node::Inner(vec![
                (cube(2.0), leaf(5)),
                (cube(1.0), leaf(1)),
            ])),
        };
        let figures = Figures::of(&tree, &cube(2.0), 4);
        assert_eq!((figures.inner, figures.leaves, figures.depth), (1, 2, 2));
        assert_eq!(figures.sah_trav, Some(1.0));
        assert_eq!(figures.sah_prim, Some(5.25));
        assert_eq!(figures.sah_block, Some(2.25));
        assert_eq!(figures.blocks(4), 3);
        let mut other = figures.clone();
        other.sah_prim = Some(5.25 * (1.0 + 1e-8));
        other.refs += 1;
        assert_eq!(figures.differences(&other).len(), 2);
    }

    #[test]
    fn a_root_without_area_has_no_costs() {
        let tree = Tree {
            root: Some(Node::Leaf(vec![LeafReference::default()])),
        };
        assert_eq!(Figures::of(&tree, &cube(0.0), 1).sah_prim, None);
    }
}
