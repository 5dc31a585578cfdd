//! What a tree is like: counts, depth, fill, cost, overlap, bytes.
//!
//! The surface area heuristic in Embree's units, in f64 from the stored boxes, R the root box:
//! expected node visits Σ A(inner)/A(R), expected primitives Σ A(leaf)·n/A(R), expected blocks
//! Σ A(leaf)·⌈n/b⌉/A(R). See MacDonald, Booth, *Heuristics for Ray Tracing Using Space
//! Subdivision*, 1990.
//!
//! Overlap is that of Beckmann, Kriegel, Schneider, Seeger, *The R\*-tree*, 1990, section 4.1
//! (summed over the pairs of children of a node), by half area instead of volume, since a line meets
//! a convex body in proportion to its area: Σ over inner nodes Σ i < j of A(child i ∩ child j)/A(R).
//! It is the number of pairs of siblings that a random line is expected to find overlapping on its
//! way, whatever order it visits them in. A node has at most 16 children, hence at most 120 pairs.

use crate::{
    bounds::Aabb,
    build::{LeafReference, record::Record},
    layout::{
        block::{BLOCK_SIZE, Block},
        node::ChildRef,
        tree::Tree,
    },
    params::BuildParams,
};

/// Figures of a tree. The root is level 1; leaves count as a level. Half areas are relative to that
/// of the root box; in a scene without area (points, or a line), each counts as 1.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct TreeStats {
    /// Inner nodes.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References to primitives in all leaves.
    pub references: usize,
    /// References over the primitives that they refer to: 1 unless primitives were cut; 0 if there
    /// are none.
    pub duplication: f64,
    /// Levels on the longest way from the root to a leaf, both included.
    pub depth: usize,
    /// Largest number of references in a leaf.
    pub largest_leaf: usize,
    /// How many leaves have so many references as the place says, up to `largest_leaf`.
    pub leaf_sizes: Vec<usize>,
    /// Children over all slots for children; 0 if there are none.
    pub node_fill: f64,
    /// References over all lanes of the blocks of four in which leaves hold them; 0 if there are
    /// none.
    pub leaf_fill: f64,
    /// Half areas that two children of a node have in common, summed over all pairs of children of
    /// all inner nodes. Boxes that touch have the face in common.
    pub overlap: f64,
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
        let mut ids = Vec::with_capacity(tree.blocks.len() * BLOCK_SIZE);
        for block in &tree.blocks {
            ids.extend(block.ids()[..block.len()].iter().map(|&id| u64::from(id)));
        }
        let sums = Sums::of(tree, params);
        sums.stats(params, N * tree.nodes.len(), distinct(ids), tree.bytes())
    }

    /// The same of a tree without a layout: slots for children are `branching_factor` per node,
    /// bytes those of the records.
    pub(crate) fn of_records(
        root: Option<&Record>,
        records: &[Record],
        leaves: &[LeafReference],
        params: &BuildParams,
    ) -> Self {
        let mut sums = Sums::new(root.map_or(Aabb::EMPTY, Record::bounds), params);
        let mut ids = Vec::new();
        let mut stack: Vec<(&Record, usize)> = root.map(|root| (root, 1)).into_iter().collect();
        let mut boxes = Vec::new();
        while let Some((record, level)) = stack.pop() {
            if record.is_leaf() {
                sums.leaf(&record.bounds(), record.range().len(), level);
                let own = leaves[record.range()].iter();
                ids.extend(
                    own.map(|id| u64::from(id.geometry_id) << 32 | u64::from(id.primitive_id)),
                );
            } else {
                let children = &records[record.range()];
                boxes.clear();
                boxes.extend(children.iter().map(Record::bounds));
                sums.inner(&record.bounds(), &boxes);
                stack.extend(children.iter().map(|child| (child, level + 1)));
            }
        }
        let slots = params.branching_factor as usize * sums.nodes;
        let bytes = size_of_val(records) + size_of_val(leaves);
        sums.stats(params, slots, distinct(ids), bytes)
    }
}

/// Expected cost of a random line, as [`TreeStats::sah_cost`].
pub(crate) fn sah_cost<const N: usize, const W: usize, B: Block>(
    tree: &Tree<N, W, B>,
    params: &BuildParams,
) -> f64 {
    Sums::of(tree, params).sah_cost(params)
}

fn distinct(mut ids: Vec<u64>) -> usize {
    ids.sort_unstable();
    ids.dedup();
    ids.len()
}

/// What is summed up on the way through a tree.
struct Sums {
    root_area: f64,
    block_shift: u32,
    nodes: usize,
    children: usize,
    blocks: usize,
    depth: usize,
    leaf_sizes: Vec<usize>,
    overlap: f64,
    sah_nodes: f64,
    sah_primitives: f64,
    sah_blocks: f64,
}

impl Sums {
    fn new(root: Aabb, params: &BuildParams) -> Self {
        Self {
            root_area: half_area(&root),
            block_shift: params.sah_block_shift(),
            nodes: 0,
            children: 0,
            blocks: 0,
            depth: 0,
            leaf_sizes: vec![],
            overlap: 0.0,
            sah_nodes: 0.0,
            sah_primitives: 0.0,
            sah_blocks: 0.0,
        }
    }

    fn of<const N: usize, const W: usize, B: Block>(
        tree: &Tree<N, W, B>,
        params: &BuildParams,
    ) -> Self {
        let Some(root) = tree.nodes.first() else {
            return Self::new(Aabb::EMPTY, params);
        };
        let root_bounds = (0..N).fold(Aabb::EMPTY, |all, slot| all.union(root.child_bounds(slot)));
        let mut sums = Self::new(root_bounds, params);
        // A tree that is one leaf has a node above it for traversal alone.
        let is_wrapper = tree.nodes.len() == 1 && tree.children(0).count() == 1;
        let mut stack = vec![(0_u32, root_bounds, usize::from(!is_wrapper))];
        let mut boxes = Vec::with_capacity(N);
        while let Some((index, bounds, level)) = stack.pop() {
            boxes.clear();
            for (slot, child) in tree.children(index) {
                let bounds = tree.nodes[index as usize].child_bounds(slot);
                boxes.push(bounds);
                if child.is_leaf() {
                    let blocks = tree.blocks[child.blocks()].iter();
                    sums.leaf(&bounds, blocks.map(Block::len).sum(), level + 1);
                } else {
                    let ChildRef(node) = child;
                    stack.push((node, bounds, level + 1));
                }
            }
            if is_wrapper {
                sums.children += 1;
            } else {
                sums.inner(&bounds, &boxes);
            }
        }
        sums
    }

    /// Half area relative to the root's. A flat or pointlike scene has no area to be relative to;
    /// every visit is then certain.
    fn share(&self, bounds: &Aabb) -> f64 {
        if self.root_area > 0.0 {
            half_area(bounds) / self.root_area
        } else {
            1.0
        }
    }

    fn inner(&mut self, bounds: &Aabb, children: &[Aabb]) {
        self.nodes += 1;
        self.children += children.len();
        self.sah_nodes += self.share(bounds);
        for (index, a) in children.iter().enumerate() {
            for b in &children[..index] {
                let common = a.intersection(*b);
                if !common.is_empty() {
                    self.overlap += self.share(&common);
                }
            }
        }
    }

    fn leaf(&mut self, bounds: &Aabb, size: usize, level: usize) {
        if self.leaf_sizes.len() <= size {
            self.leaf_sizes.resize(size + 1, 0);
        }
        self.leaf_sizes[size] += 1;
        self.blocks += size.div_ceil(BLOCK_SIZE);
        self.depth = self.depth.max(level);
        let share = self.share(bounds);
        self.sah_primitives += share * size as f64;
        self.sah_blocks += share * size.div_ceil(1 << self.block_shift) as f64;
    }

    fn sah_cost(&self, params: &BuildParams) -> f64 {
        f64::from(params.traversal_cost) * self.sah_nodes
            + f64::from(params.intersection_cost) * self.sah_blocks
    }

    fn stats(
        self,
        params: &BuildParams,
        slots: usize,
        primitives: usize,
        bytes: usize,
    ) -> TreeStats {
        let references = self
            .leaf_sizes
            .iter()
            .enumerate()
            .map(|(n, &k)| n * k)
            .sum();
        TreeStats {
            nodes: self.nodes,
            leaves: self.leaf_sizes.iter().sum(),
            references,
            duplication: ratio(references, primitives),
            depth: self.depth,
            largest_leaf: self.leaf_sizes.len().saturating_sub(1),
            node_fill: ratio(self.children, slots),
            leaf_fill: ratio(references, BLOCK_SIZE * self.blocks),
            overlap: self.overlap,
            sah_nodes: self.sah_nodes,
            sah_primitives: self.sah_primitives,
            sah_blocks: self.sah_blocks,
            sah_cost: self.sah_cost(params),
            leaf_sizes: self.leaf_sizes,
            bytes,
        }
    }
}

/// 0 of nothing.
fn ratio(part: usize, whole: usize) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}

fn half_area(bounds: &Aabb) -> f64 {
    if bounds.is_empty() {
        return 0.0;
    }
    let d = bounds.max.as_dvec3() - bounds.min.as_dvec3();
    d.x * (d.y + d.z) + d.y * d.z
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::{
        Aabb, BuildParams, BuildPrimitive, BuildWorkspace, Bvh, Hierarchy, Quality, TriangleMesh,
    };

    /// Boxes of the given size in a row, 1 apart.
    fn row(count: u32, size: f32) -> Vec<BuildPrimitive> {
        (0..count)
            .map(|i| BuildPrimitive {
                bounds: Aabb {
                    min: Vec3::new(i as f32, 0.0, 0.0),
                    max: Vec3::new(i as f32 + size, 1.0, 1.0),
                },
                geometry_id: 0,
                primitive_id: i,
            })
            .collect()
    }

    fn binary_down_to_one() -> BuildParams {
        BuildParams {
            min_leaf_size: 1,
            max_leaf_size: 1,
            ..BuildParams::embree_api_default()
        }
    }

    fn hierarchy(primitives: &[BuildPrimitive], params: &BuildParams) -> Hierarchy {
        Hierarchy::build(primitives, None, params, &mut BuildWorkspace::default()).unwrap()
    }

    #[test]
    fn four_boxes_by_hand() {
        let params = binary_down_to_one();
        // Unit cubes that touch: the root is 4 long (half area 9), two nodes of 2 (half area 5)
        // and four leaves (half area 3); each inner node's children share a face of area 1.
        let stats = hierarchy(&row(4, 1.0), &params).stats(&params);
        assert_eq!((stats.nodes, stats.leaves, stats.depth), (3, 4, 3));
        assert_eq!(stats.leaf_sizes, [0, 4]);
        assert_eq!((stats.node_fill, stats.leaf_fill), (1.0, 0.25));
        assert_eq!((stats.references, stats.duplication), (4, 1.0));
        assert!((stats.sah_nodes - 19.0 / 9.0).abs() < 1e-12);
        assert!((stats.sah_primitives - 12.0 / 9.0).abs() < 1e-12);
        assert!((stats.overlap - 3.0 / 9.0).abs() < 1e-12);
        // Apart from each other they have nothing in common.
        assert_eq!(hierarchy(&row(4, 0.5), &params).stats(&params).overlap, 0.0);
        // Boxes 1.5 long reach 0.5 into the next: 2 of half area 1 + 2 · 0.5 in each pair of
        // leaves and 2 in the root, whose half area is 1 + 2 · 4.5.
        let stats = hierarchy(&row(4, 1.5), &params).stats(&params);
        assert!(
            (stats.overlap - 3.0 * 2.0 / 10.0).abs() < 1e-12,
            "{stats:?}"
        );
    }

    #[test]
    fn nothing_and_one_leaf() {
        let params = BuildParams::default();
        let stats = hierarchy(&[], &params).stats(&params);
        assert_eq!(stats, crate::TreeStats::default());
        let stats = hierarchy(&row(3, 1.0), &params).stats(&params);
        assert_eq!((stats.nodes, stats.leaves, stats.depth), (0, 1, 1));
        assert_eq!(stats.leaf_sizes, [0, 0, 0, 1]);
        assert_eq!((stats.leaf_fill, stats.node_fill), (0.75, 0.0));
    }

    #[test]
    fn a_tree_with_layout_has_the_figures_of_its_hierarchy() {
        let vertices: Vec<Vec3> = (0..3000u32)
            .map(|i| {
                let hash = |k: u32| (i.wrapping_mul(k) >> 12) as f32 / (1 << 20) as f32;
                Vec3::new(
                    hash(2_654_435_769),
                    hash(2_246_822_519),
                    hash(3_266_489_917),
                )
            })
            .collect();
        let triangles = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        let primitives: Vec<_> = (0..1000)
            .map(|primitive_id| BuildPrimitive {
                bounds: mesh
                    .corners(primitive_id)
                    .into_iter()
                    .fold(Aabb::EMPTY, Aabb::extended_by),
                geometry_id: 0,
                primitive_id,
            })
            .collect();
        for quality in [Quality::Morton, Quality::BinnedSah, Quality::SpatialSplits] {
            let params = BuildParams {
                quality,
                split_budget: 2.0,
                ..BuildParams::default()
            };
            let corners = |leaf: crate::LeafReference| mesh.corners(leaf.primitive_id);
            let mut workspace = BuildWorkspace::default();
            let without_layout =
                Hierarchy::build(&primitives, Some(&corners), &params, &mut workspace)
                    .unwrap()
                    .stats(&params);
            let stats = Bvh::build(&[&mesh], &params).unwrap().stats();
            let whole = |s: &crate::TreeStats| (s.nodes, s.leaf_sizes.clone(), s.depth);
            assert_eq!(whole(&stats), whole(&without_layout));
            assert_eq!(stats.duplication, without_layout.duplication);
            assert_eq!(stats.leaf_fill, without_layout.leaf_fill);
            // Nodes without their children's sum of areas differ by rounding alone.
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b;
            assert!(near(stats.overlap, without_layout.overlap));
            assert!(near(stats.sah_cost, without_layout.sah_cost));
            let is_cut = quality == Quality::SpatialSplits;
            assert_eq!(stats.duplication > 1.0, is_cut, "{}", stats.duplication);
        }
    }
}
