//! From a binary tree to one of wide nodes and larger leaves, at the least cost by the surface area
//! heuristic that any such tree has: Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on
//! GPUs Through Compressed Wide BVHs*, 2017, section 3.
//!
//! C(n, i), the least cost of the primitives below n as at most i trees, follows from those of the
//! children l and r, w being the branching factor and A the half area:
//!
//! * leaf(n) = A(n) · (intersection cost · blocks of n + traversal cost · [`LEAF_VISIT`])
//! * C(n, 1) = min(leaf(n), A(n) · traversal cost · [`NODE_VISIT`] + min over k of C(l, k) +
//!   C(r, w − k))
//! * C(n, i) = min(C(n, i − 1), min over k of C(l, k) + C(r, i − k))
//!
//! They are found from the leaves up; the choices are found again from the root down. Invariants:
//! the references below a node stay together; at most `max_leaf_size` of them make a leaf, and
//! `min_leaf_size` or fewer always do; no level is deeper than `max_depth`: where all levels that are
//! left are needed for it and the binary tree might not fit, its leaves are halved by number.

use super::{
    BuildWorkspace, LeafReference,
    binary::{Below, BinaryTree, ROOT},
    primitive::Bounds,
    record::Record,
    recursion::{MAX_CHILDREN, depth_error, levels_below},
};
use crate::{error::BuildError, params::BuildParams};

/// What a visit costs, in traversal costs: our nodes take about twice as long as a block of four
/// triangles, and it is not free to come to a leaf either. Against 1 and 0, rays on Sponza and
/// Conference are 3 % faster.
const NODE_VISIT: f32 = 2.0;
const LEAF_VISIT: f32 = 1.0;

/// The memory of a collapse.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    extents: Vec<Extent>,
    /// C(n, 1), C(n, 2) … C(n, w − 1) of all nodes.
    costs: Vec<f32>,
    /// The leaf references in the order of the binary tree.
    leaves: Vec<LeafReference>,
    /// Binary leaves that are halved by number.
    halved: Vec<u32>,
}

impl Memory {
    pub(crate) fn bytes(&self) -> usize {
        self.extents.capacity() * size_of::<Extent>()
            + self.costs.capacity() * size_of::<f32>()
            + self.leaves.capacity() * size_of::<LeafReference>()
            + self.halved.capacity() * size_of::<u32>()
    }
}

/// What is below a binary node.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// Place of the first reference in [`Memory::leaves`].
    first: u32,
    references: u32,
    /// Nodes of the subtree, which is a range of nodes.
    nodes: u32,
    /// Levels that its wide tree has at most.
    levels: u32,
}

/// Collapses the tree in `workspace.binary`, which is in preorder and the leaves of which have at
/// most `max_leaf_size` references. Returns the new root.
pub(crate) fn collapse(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Record, BuildError> {
    let params = params.canonical();
    let model = Model {
        width: params.branching_factor as usize,
        block_shift: params.sah_block_shift(),
        params,
    };
    let Memory {
        extents,
        costs,
        leaves,
        halved,
    } = &mut workspace.collapse;
    in_order_of_the_tree(&workspace.binary, &workspace.leaves, leaves);
    workspace.leaves[..leaves.len()].copy_from_slice(leaves);
    model.measure(&workspace.binary, extents, costs);
    let most = 2 * leaves.len() - 2;
    // A build leaves enough; trees of other origin might not.
    if workspace.records.len() < most {
        workspace.records.resize(most, Record::UNUSED);
    }
    halved.clear();
    let mut emission = Emission {
        model,
        tree: &workspace.binary,
        extents,
        costs,
        leaves: &mut workspace.leaves,
        records: &mut workspace.records,
        used: 0,
        halved,
    };
    emission.subtree(ROOT, 1)
}

/// Copies the references of the leaves in the order of the nodes.
fn in_order_of_the_tree(tree: &BinaryTree, from: &[LeafReference], to: &mut Vec<LeafReference>) {
    to.clear();
    for node in &tree.nodes {
        if let Below::Leaf { first, count } = node.below {
            to.extend_from_slice(&from[first as usize..][..count as usize]);
        }
    }
}

/// Parameters in the form in which costs need them.
struct Model {
    params: BuildParams,
    width: usize,
    block_shift: u32,
}

impl Model {
    fn leaf_cost(&self, area: f32, references: u32) -> f32 {
        let blocks = (references + (1 << self.block_shift) - 1) >> self.block_shift;
        let visit = LEAF_VISIT * self.params.traversal_cost;
        area * (self.params.intersection_cost * blocks as f32 + visit)
    }

    /// The costs C(n, 1) … of a node.
    fn costs<'a>(&self, costs: &'a [f32], node: u32) -> &'a [f32] {
        let places = self.width - 1;
        &costs[node as usize * places..][..places]
    }

    /// The least cost of two subtrees as `trees` ≥ 2 trees together, and how many of them the left
    /// one becomes.
    fn divided(&self, left: &[f32], right: &[f32], trees: usize) -> (f32, usize) {
        let mut best = (left[0] + right[trees - 2], 1);
        for of_left in 2..trees {
            let cost = left[of_left - 1] + right[trees - 1 - of_left];
            if cost < best.0 {
                best = (cost, of_left);
            }
        }
        best
    }

    /// Whether a subtree of so many references becomes a leaf, if the alternative costs so much.
    /// Written so that costs that are not numbers never forbid or demand what limits do.
    fn is_leaf(&self, area: f32, references: u32, otherwise: f32) -> bool {
        references <= self.params.min_leaf_size
            || references <= self.params.max_leaf_size
                && self.leaf_cost(area, references) <= otherwise
    }

    fn node_cost(&self, area: f32, left: &[f32], right: &[f32]) -> f32 {
        NODE_VISIT * self.params.traversal_cost * area + self.divided(left, right, self.width).0
    }

    /// Fills in extents and costs.
    fn measure(&self, tree: &BinaryTree, extents: &mut Vec<Extent>, costs: &mut Vec<f32>) {
        let (n, places) = (tree.nodes.len(), self.width - 1);
        let unknown = Extent {
            first: 0,
            references: 0,
            nodes: 1,
            levels: 1,
        };
        extents.clear();
        extents.resize(n, unknown);
        costs.resize(n * places, 0.0);
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            let (own, later) = costs[index * places..].split_at_mut(places);
            let Below::Children([left, right]) = node.below else {
                if let Below::Leaf { count, .. } = node.below {
                    extents[index].references = count;
                    own.fill(self.leaf_cost(node.area, count));
                }
                continue;
            };
            let (l, r) = (extents[left as usize], extents[right as usize]);
            let references = l.references + r.references;
            extents[index] = Extent {
                references,
                nodes: 1 + l.nodes + r.nodes,
                levels: 1 + l.levels.max(r.levels),
                ..unknown
            };
            if references <= self.params.min_leaf_size {
                extents[index].levels = 1;
                own.fill(self.leaf_cost(node.area, references));
                continue;
            }
            let child = |child: u32| &later[(child as usize - index - 1) * places..][..places];
            let (l, r) = (child(left), child(right));
            own[0] = self.node_cost(node.area, l, r);
            if self.is_leaf(node.area, references, own[0]) {
                own[0] = self.leaf_cost(node.area, references);
            }
            for trees in 2..=places {
                let (cost, _) = self.divided(l, r, trees);
                let fewer = own[trees - 2];
                own[trees - 1] = if cost < fewer { cost } else { fewer };
            }
        }
        let mut next = 0;
        for (extent, node) in extents.iter_mut().zip(&tree.nodes) {
            extent.first = next;
            if let Below::Leaf { count, .. } = node.below {
                next += count;
            }
        }
    }
}

/// What is needed to write the wide tree.
struct Emission<'a> {
    model: Model,
    tree: &'a BinaryTree,
    extents: &'a [Extent],
    costs: &'a [f32],
    leaves: &'a mut [LeafReference],
    records: &'a mut [Record],
    /// Records that are taken.
    used: usize,
    halved: &'a mut Vec<u32>,
}

/// The nodes that become the children of a wide node.
#[derive(Default)]
struct Children {
    nodes: [u32; MAX_CHILDREN],
    len: usize,
}

impl Emission<'_> {
    fn subtree(&mut self, index: u32, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let (node, extent) = (
            &self.tree.nodes[index as usize],
            self.extents[index as usize],
        );
        let Below::Children([left, right]) = node.below else {
            return Ok(self.leaf(&node.bounds, extent.first, extent.references));
        };
        let (l, r) = (
            self.model.costs(self.costs, left),
            self.model.costs(self.costs, right),
        );
        let node_cost = self.model.node_cost(node.area, l, r);
        if self.model.is_leaf(node.area, extent.references, node_cost) {
            return Ok(self.leaf(&node.bounds, extent.first, extent.references));
        }
        let leaves = extent.nodes.div_ceil(2) as usize;
        if level + levels_below(params, leaves) >= params.max_depth
            && level + extent.levels > params.max_depth + 1
        {
            let begin = self.halved.len();
            let subtree = index..index + extent.nodes;
            let is_leaf =
                |&index: &u32| matches!(self.tree.nodes[index as usize].below, Below::Leaf { .. });
            self.halved.extend(subtree.filter(is_leaf));
            let record = self.halves(begin..self.halved.len(), level);
            self.halved.truncate(begin);
            return record;
        }
        let mut children = Children::default();
        let (_, of_left) = self.model.divided(l, r, self.model.width);
        self.gather(left, of_left, &mut children);
        self.gather(right, self.model.width - of_left, &mut children);
        let first = self.take_records(children.len);
        for (place, &child) in (first..).zip(&children.nodes[..children.len]) {
            self.records[place] = self.subtree(child, level + 1)?;
        }
        Ok(Record::inner_around(
            first,
            &self.records[first..first + children.len],
        ))
    }

    /// Adds what a node as at most `trees` trees consists of. Calls itself less than
    /// [`MAX_CHILDREN`] times deep, since both sides get fewer trees.
    fn gather(&self, index: u32, mut trees: usize, children: &mut Children) {
        let node = &self.tree.nodes[index as usize];
        let divisible = self.extents[index as usize].references > self.model.params.min_leaf_size;
        if let (Below::Children([left, right]), true) = (node.below, divisible) {
            let own = self.model.costs(self.costs, index);
            let (l, r) = (
                self.model.costs(self.costs, left),
                self.model.costs(self.costs, right),
            );
            while trees > 1 {
                let (cost, of_left) = self.model.divided(l, r, trees);
                if cost < own[trees - 2] {
                    self.gather(left, of_left, children);
                    self.gather(right, trees - of_left, children);
                    return;
                }
                trees -= 1;
            }
        }
        children.nodes[children.len] = index;
        children.len += 1;
    }

    fn take_records(&mut self, count: usize) -> usize {
        let first = self.used;
        self.used += count;
        first
    }

    /// A leaf: sorted, and what was cut and came together again stored once.
    fn leaf(&mut self, bounds: &Bounds, first: u32, count: u32) -> Record {
        let leaf = &mut self.leaves[first as usize..][..count as usize];
        leaf.sort_unstable_by_key(|leaf| (leaf.primitive_id, leaf.geometry_id));
        let mut distinct = 1;
        for place in 1..leaf.len() {
            if leaf[place] != leaf[distinct - 1] {
                leaf[distinct] = leaf[place];
                distinct += 1;
            }
        }
        Record::leaf(bounds, first as usize, distinct)
    }

    /// The tree over a range of [`Self::halved`], halved by number again and again.
    fn halves(&mut self, range: std::ops::Range<usize>, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let (max_leaf_size, width) = (params.max_leaf_size, self.model.width);
        let references = self.references(&range);
        if level > params.max_depth {
            return Err(depth_error(params, references as usize, level));
        }
        if references <= max_leaf_size {
            let mut bounds = Bounds::EMPTY;
            for &index in &self.halved[range.clone()] {
                bounds.extend(&self.tree.nodes[index as usize].bounds);
            }
            let first = self.extents[self.halved[range.start] as usize].first;
            return Ok(self.leaf(&bounds, first, references));
        }
        let mut parts = [const { 0..0 }; MAX_CHILDREN];
        parts[0] = range;
        let mut len = 1;
        while len < width {
            // No leaf of the binary tree is too large, so that what is too large has two or more.
            let too_large = |part: &usize| self.references(&parts[*part]) > max_leaf_size;
            let Some(most) = (0..len)
                .filter(too_large)
                .max_by_key(|&part| parts[part].len())
            else {
                break;
            };
            let std::ops::Range { start, end } = parts[most];
            let middle = start.midpoint(end);
            parts[most] = start..middle;
            parts[len] = middle..end;
            len += 1;
        }
        let first = self.take_records(len);
        for (place, part) in (first..).zip(parts).take(len) {
            self.records[place] = self.halves(part, level + 1)?;
        }
        Ok(Record::inner_around(
            first,
            &self.records[first..first + len],
        ))
    }

    /// How many references a range of [`Self::halved`] has.
    fn references(&self, range: &std::ops::Range<usize>) -> u32 {
        let [first, last] =
            [range.start, range.end - 1].map(|place| self.extents[self.halved[place] as usize]);
        last.first + last.references - first.first
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{binary::random_tree, record::Kind},
        *,
    };
    use crate::build::binary::Shape;

    fn params(width: u32, min_leaf_size: u32, max_leaf_size: u32) -> BuildParams {
        BuildParams {
            branching_factor: width,
            sah_block_size: 2,
            min_leaf_size,
            max_leaf_size,
            traversal_cost: 0.7,
            intersection_cost: 1.3,
            max_depth: 64,
            ..BuildParams::default()
        }
    }

    fn collapse_records(
        workspace: &mut BuildWorkspace,
        root: &Record,
        params: &BuildParams,
    ) -> Result<Record, BuildError> {
        workspace.binary.load(&workspace.records, root);
        collapse(workspace, params)
    }

    /// All ways to divide what is below a node into at most `most` subtrees.
    fn divisions(
        tree: &BinaryTree,
        sizes: &[u32],
        node: u32,
        min: u32,
        most: usize,
    ) -> Vec<Vec<u32>> {
        let mut all = vec![vec![node]];
        if let (Below::Children([left, right]), true) =
            (tree.nodes[node as usize].below, sizes[node as usize] > min)
        {
            for l in divisions(tree, sizes, left, min, most) {
                for r in divisions(tree, sizes, right, min, most) {
                    if l.len() + r.len() <= most {
                        all.push([l.as_slice(), r.as_slice()].concat());
                    }
                }
            }
        }
        all
    }

    fn sizes(tree: &BinaryTree) -> Vec<u32> {
        let mut sizes = vec![0; tree.nodes.len()];
        for (index, node) in tree.nodes.iter().enumerate().rev() {
            sizes[index] = match node.below {
                Below::Leaf { count, .. } => count,
                Below::Children([l, r]) => sizes[l as usize] + sizes[r as usize],
            };
        }
        sizes
    }

    fn leaf_cost(area: f32, size: u32, params: &BuildParams) -> f64 {
        let blocks = size.div_ceil(params.sah_block_size);
        f64::from(area)
            * (f64::from(params.intersection_cost) * f64::from(blocks)
                + f64::from(LEAF_VISIT) * f64::from(params.traversal_cost))
    }

    /// The least cost of all collapses, found by trying each.
    fn exhaustive(tree: &BinaryTree, sizes: &[u32], node: u32, params: &BuildParams) -> f64 {
        let (own, size) = (&tree.nodes[node as usize], sizes[node as usize]);
        let leaf = leaf_cost(own.area, size, params);
        let Below::Children([left, right]) = own.below else {
            return leaf;
        };
        let (min, width) = (params.min_leaf_size, params.branching_factor as usize);
        if size <= min {
            return leaf;
        }
        let mut best = if size <= params.max_leaf_size {
            leaf
        } else {
            f64::INFINITY
        };
        for l in divisions(tree, sizes, left, min, width - 1) {
            for r in divisions(tree, sizes, right, min, width - l.len()) {
                let children = l.iter().chain(&r);
                let cost: f64 = children.map(|&c| exhaustive(tree, sizes, c, params)).sum();
                best = best.min(f64::from(NODE_VISIT * own.area * params.traversal_cost) + cost);
            }
        }
        best
    }

    /// The cost of a tree of records; checks limits and collects the leaves.
    fn cost(
        workspace: &BuildWorkspace,
        record: &Record,
        params: &BuildParams,
        level: u32,
        leaves: &mut Vec<LeafReference>,
    ) -> f64 {
        assert!(level <= params.max_depth);
        let area = Bounds::of_aabb(&record.bounds()).half_area();
        match record.kind {
            Kind::Leaf => {
                let leaf = &workspace.leaves[record.range()];
                assert!(leaf.len() <= params.max_leaf_size as usize);
                assert!(leaf.is_sorted_by_key(|l| (l.primitive_id, l.geometry_id)));
                leaves.extend(leaf);
                leaf_cost(area, record.count, params)
            }
            Kind::Inner => {
                assert!((2..=params.branching_factor).contains(&record.count));
                let children = &workspace.records[record.range()];
                assert_eq!(
                    record.nodes,
                    1 + children.iter().map(|c| c.nodes).sum::<u32>()
                );
                let below: f64 = children
                    .iter()
                    .map(|child| cost(workspace, child, params, level + 1, leaves))
                    .sum();
                f64::from(NODE_VISIT * area * params.traversal_cost) + below
            }
        }
    }

    fn workspace(leaves: usize, seed: u64, shape: Shape) -> (BuildWorkspace, Record) {
        let mut workspace = BuildWorkspace::default();
        let (root, records, references) = random_tree(leaves, seed, shape);
        workspace.records = records;
        workspace.leaves = references;
        (workspace, root)
    }

    fn check(
        workspace: &BuildWorkspace,
        root: &Record,
        params: &BuildParams,
        before: &[LeafReference],
    ) -> f64 {
        let mut after = Vec::new();
        let cost = cost(workspace, root, params, 1, &mut after);
        let mut before = before.to_vec();
        before.sort();
        after.sort();
        assert_eq!(before, after);
        cost
    }

    #[test]
    fn no_collapse_costs_less() {
        for seed in 0..300 {
            let leaves = 1 + seed as usize % 7;
            let (width, min, max) = (
                2 + seed as u32 % 5,
                1 + seed as u32 % 3,
                3 + seed as u32 % 4,
            );
            let params = params(width, min, max);
            let (mut workspace, root) = workspace(leaves, seed, Shape::Random);
            let before = workspace.leaves.clone();
            let mut tree = BinaryTree::default();
            tree.load(&workspace.records, &root);
            let expected = exhaustive(&tree, &sizes(&tree), ROOT, &params);
            let root = collapse_records(&mut workspace, &root, &params).unwrap();
            let got = check(&workspace, &root, &params, &before);
            assert!(
                (got / expected - 1.0).abs() < 1e-5,
                "{seed}: {got} {expected}"
            );
        }
    }

    #[test]
    fn chains_are_kept_within_the_depth_or_refused() {
        for (leaves, shape) in [(3000, Shape::Chain), (700, Shape::Random)] {
            for width in [2, 3, 8, 16] {
                for max_depth in [1, 2, 4, 9, 12, 40] {
                    let params = BuildParams {
                        max_depth,
                        ..params(width, 1, 8)
                    };
                    let (mut workspace, root) = workspace(leaves, 7, shape);
                    let before = workspace.leaves.clone();
                    match collapse_records(&mut workspace, &root, &params) {
                        Ok(root) => {
                            check(&workspace, &root, &params, &before);
                        }
                        Err(BuildError::DepthLimit { needed, .. }) => {
                            assert!(needed > max_depth);
                            assert!(width.pow(max_depth.min(6) - 1) < leaves as u32);
                        }
                        Err(error) => panic!("{error}"),
                    }
                }
            }
        }
    }

    #[test]
    fn what_was_cut_and_comes_together_is_stored_once() {
        let (mut workspace, root) = workspace(4, 3, Shape::Random);
        let twice = workspace.leaves[0];
        workspace.leaves.fill(twice);
        let root = collapse_records(&mut workspace, &root, &params(8, 64, 64)).unwrap();
        assert_eq!((root.kind, root.count, root.blocks), (Kind::Leaf, 1, 1));
        assert_eq!(workspace.leaves[0], twice);
    }

    #[test]
    fn boxes_without_finite_areas_are_collapsed_all_the_same() {
        for value in [f32::NAN, f32::INFINITY, f32::MAX] {
            for width in [2, 8] {
                let params = params(width, 1, 4);
                let (mut workspace, mut root) = workspace(100, 5, Shape::Random);
                let before = workspace.leaves.clone();
                root.upper = [value; 3];
                for record in &mut workspace.records {
                    record.upper = [value; 3];
                }
                let root = collapse_records(&mut workspace, &root, &params).unwrap();
                check(&workspace, &root, &params, &before);
            }
        }
    }
}
