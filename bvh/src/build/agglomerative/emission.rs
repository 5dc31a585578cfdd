//! From the binary tree of clusters to wide nodes and leaves.

use std::ops::Range;

use super::{
    super::{
        LeafReference,
        control::BuildControl,
        primitive::Bounds,
        record::Record,
        recursion::{MAX_CHILDREN, depth_error, levels_below},
    },
    Below, Model, Node,
};
use crate::error::BuildError;

/// What is needed to write the wide tree.
pub(super) struct Emission<'a> {
    pub(super) control: &'a BuildControl,
    pub(super) model: Model,
    pub(super) nodes: &'a [Node],
    pub(super) ids: &'a [LeafReference],
    /// Memory for the first clusters of a subtree.
    pub(super) order: &'a mut [u32],
    pub(super) leaves: &'a mut [LeafReference],
    pub(super) used_leaves: usize,
    pub(super) records: &'a mut Vec<Record>,
}

impl Emission<'_> {
    pub(super) fn node(&mut self, index: u32, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let node = &self.nodes[index as usize];
        self.control.check_range(node.summary.references as usize)?;
        let Below::Children(children) = node.below else {
            return self.by_number(index, level);
        };
        let levels = levels_below(params, node.summary.clusters as usize);
        if node.summary.is_leaf() || level + levels >= params.max_depth {
            return self.by_number(index, level);
        }
        let (nodes, len) = self.opened(children);
        let first = self.take_records(len);
        for (place, &child) in (first..).zip(&nodes[..len]) {
            self.records[place] = self.node(child, level + 1)?;
        }
        let bounds = Bounds::of_aabb(&node.bounds);
        let records = &self.records[first..first + len];
        Ok(Record::inner(&bounds, first, records))
    }

    /// Replaces nodes by their children, the largest first, until a wide node is full.
    fn opened(&self, children: [u32; 2]) -> ([u32; MAX_CHILDREN], usize) {
        // What does not open has an area below all others.
        let area = |index: u32| {
            let summary = &self.nodes[index as usize].summary;
            if summary.is_leaf() {
                -1.0
            } else {
                summary.area
            }
        };
        let (mut nodes, mut areas) = ([0; MAX_CHILDREN], [-1.0; MAX_CHILDREN]);
        nodes[..2].copy_from_slice(&children);
        areas[..2].copy_from_slice(&children.map(area));
        let mut len = 2;
        while len < self.model.params.branching_factor as usize {
            // Ties keep the older child.
            let mut largest = 0;
            for place in 1..len {
                if areas[place] > areas[largest] {
                    largest = place;
                }
            }
            let opened = &self.nodes[nodes[largest] as usize];
            let Below::Children([left, right]) = opened.below else {
                break;
            };
            if opened.summary.is_leaf() {
                break;
            }
            (nodes[largest], nodes[len]) = (left, right);
            (areas[largest], areas[len]) = (area(left), area(right));
            len += 1;
        }
        (nodes, len)
    }

    fn take_records(&mut self, count: usize) -> usize {
        let first = self.records.len();
        self.records.resize(first + count, Record::UNUSED);
        first
    }

    /// A leaf, or a tree of which, for lack of levels, only numbers of references decide.
    fn by_number(&mut self, index: u32, level: u32) -> Result<Record, BuildError> {
        let clusters = self.nodes[index as usize].summary.clusters as usize;
        // Each node stands where its clusters begin until it is replaced by its children.
        self.order[0] = index;
        let mut place = 0;
        while place < clusters {
            match self.nodes[self.order[place] as usize].below {
                Below::Cluster { .. } => place += 1,
                Below::Children([left, right]) => {
                    let middle = self.nodes[left as usize].summary.clusters as usize;
                    self.order[place] = left;
                    self.order[place + middle] = right;
                }
            }
        }
        self.halves(0..clusters, level)
    }

    /// The tree over a range of [`Self::order`], halved again and again.
    fn halves(&mut self, range: Range<usize>, level: u32) -> Result<Record, BuildError> {
        let params = &self.model.params;
        let (width, max_leaf_size) = (params.branching_factor as usize, params.max_leaf_size);
        let references = self.references(&range);
        self.control.check_range(references as usize)?;
        if level > params.max_depth {
            return Err(depth_error(params, references as usize, level));
        }
        if references <= max_leaf_size {
            return Ok(self.leaf(range));
        }
        let mut parts = [const { (0..0, 0) }; MAX_CHILDREN];
        parts[0] = (range, references);
        let mut len = 1;
        while len < width {
            // No cluster is too large, so that what is too large has two or more.
            let Some(most) = (0..len)
                .filter(|&part| parts[part].1 > max_leaf_size)
                .max_by_key(|&part| parts[part].0.len())
            else {
                break;
            };
            let (Range { start, end }, all) = parts[most].clone();
            let middle = start.midpoint(end);
            let left = self.references(&(start..middle));
            parts[most] = (start..middle, left);
            parts[len] = (middle..end, all - left);
            len += 1;
        }
        let first = self.take_records(len);
        for (place, (part, _)) in (first..).zip(parts).take(len) {
            self.records[place] = self.halves(part, level + 1)?;
        }
        let records = &self.records[first..first + len];
        Ok(Record::inner_around(first, records))
    }

    /// How many references a range of [`Self::order`] has.
    fn references(&self, range: &Range<usize>) -> u32 {
        let of = |&cluster: &u32| self.nodes[cluster as usize].summary.references;
        self.order[range.clone()].iter().map(of).sum()
    }

    fn leaf(&mut self, range: Range<usize>) -> Record {
        let mut bounds = Bounds::EMPTY;
        let begin = self.used_leaves;
        for &cluster in &self.order[range] {
            let node = &self.nodes[cluster as usize];
            bounds.extend(&Bounds::of_aabb(&node.bounds));
            if let Below::Cluster { first } = node.below {
                let count = node.summary.references as usize;
                self.leaves[self.used_leaves..][..count]
                    .copy_from_slice(&self.ids[first as usize..][..count]);
                self.used_leaves += count;
            }
        }
        let leaf = &mut self.leaves[begin..self.used_leaves];
        leaf.sort_unstable_by_key(|leaf| {
            u64::from(leaf.primitive_id) << 32 | u64::from(leaf.geometry_id)
        });
        Record::leaf(&bounds, begin, leaf.len())
    }
}
