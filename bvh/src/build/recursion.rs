//! Top-down construction of a tree with up to N children per node, by the rules of Embree 4's
//! builder for medium quality: when a range becomes a leaf, which child is divided next, how the
//! depth limit is kept.
//!
//! Invariants: the tree is a function of the references and the parameters, not of threads; every
//! reference is in exactly one leaf; no leaf has more than `max_leaf_size` references; no level is
//! deeper than `max_depth`, the root being level 1.

use super::{
    BuildWorkspace, LeafReference,
    binning::{Split, find_split},
    partition,
    primitive::{PrimitiveRef, RangeBounds},
    record::Record,
    tasks,
};
use crate::{error::BuildError, layout::triangles::BLOCK_SIZE, params::BuildParams};

/// Levels kept free below a tree built by costs, in which oversized ranges are halved.
const RESERVED_LEVELS: u32 = 8;

/// The most children that a node can have.
const MAX_CHILDREN: usize = 16;

/// Builds the records of a tree over `workspace.references`. Returns the root.
pub(crate) fn build(
    workspace: &mut BuildWorkspace,
    params: &BuildParams,
) -> Result<Option<Record>, BuildError> {
    let n = workspace.references.len();
    if n == 0 {
        return Ok(None);
    }
    workspace.scratch.resize(n, workspace.references[0]);
    workspace.leaves.resize(n, LeafReference::default());
    workspace.records.resize(2 * n - 2, Record::UNUSED);
    let bounds = tasks::map_merge(&workspace.references, &RangeBounds::of, &RangeBounds::merge);
    let builder = Builder {
        params: params.canonical(),
        block_shift: params.sah_block_shift(),
    };
    let root = Range {
        references: &mut workspace.references,
        scratch: &mut workspace.scratch,
        leaves: &mut workspace.leaves,
        begin: 0,
        bounds,
    };
    builder
        .subtree(
            root,
            Slots {
                records: &mut workspace.records,
                begin: 0,
            },
            1,
        )
        .map(Some)
}

/// A range of references, with all that belongs to it alone.
struct Range<'a> {
    references: &'a mut [PrimitiveRef],
    /// As long as `references`; large partitions go back and forth between the two.
    scratch: &'a mut [PrimitiveRef],
    leaves: &'a mut [LeafReference],
    /// Place of the first reference among all.
    begin: usize,
    bounds: RangeBounds,
}

/// The part of the record array that belongs to a subtree.
struct Slots<'a> {
    records: &'a mut [Record],
    begin: usize,
}

impl<'a> Range<'a> {
    fn len(&self) -> usize {
        self.references.len()
    }

    fn sort(&mut self) {
        self.references.sort_unstable_by_key(PrimitiveRef::sort_key);
    }

    fn split_at(self, middle: usize, bounds: [RangeBounds; 2]) -> [Self; 2] {
        let (references, references_right) = self.references.split_at_mut(middle);
        let (scratch, scratch_right) = self.scratch.split_at_mut(middle);
        let (leaves, leaves_right) = self.leaves.split_at_mut(middle);
        let begin = self.begin;
        let [left, right] = bounds;
        [
            Self {
                references,
                scratch,
                leaves,
                begin,
                bounds: left,
            },
            Self {
                references: references_right,
                scratch: scratch_right,
                leaves: leaves_right,
                begin: begin + middle,
                bounds: right,
            },
        ]
    }

    /// Halves the range where it stands. The middle is taken of the absolute places, as Embree
    /// does, so that the parity of the first place matters.
    fn halve(self) -> [Self; 2] {
        let middle = (2 * self.begin + self.len()) / 2 - self.begin;
        let (left, right) = self.references.split_at(middle);
        let bounds = [RangeBounds::of(left), RangeBounds::of(right)];
        self.split_at(middle, bounds)
    }

    /// Divides the range by a plane, or halves it in sorted order if there is none.
    fn divide(mut self, split: Option<Split>) -> [Self; 2] {
        let Some(split) = split else {
            self.sort();
            return self.halve();
        };
        let partition = if tasks::in_pieces(self.len()) {
            let partition = partition::into_buffer(self.references, self.scratch, &split);
            std::mem::swap(&mut self.references, &mut self.scratch);
            partition
        } else {
            partition::in_place(self.references, &split)
        };
        self.split_at(partition.left, partition.bounds)
    }
}

struct Builder {
    params: BuildParams,
    block_shift: u32,
}

impl Builder {
    fn find_split(&self, range: &Range<'_>) -> Option<Split> {
        find_split(range.references, &range.bounds, self.block_shift)
    }

    fn blocks(&self, n: usize) -> f32 {
        ((n as u32 + (1 << self.block_shift) - 1) >> self.block_shift) as f32
    }

    /// Whether a leaf costs no more than dividing. A NaN on either side (a cost of 0 times the
    /// infinite cost of a missing plane) means that it does.
    fn leaf_is_cheap(&self, range: &Range<'_>, split: Option<&Split>) -> bool {
        let area = range.bounds.geometry.half_area();
        let sah = split.map_or(f32::INFINITY, |split| split.sah);
        let leaf_cost = self.params.intersection_cost * (area * self.blocks(range.len()));
        let split_cost = self.params.traversal_cost * area + self.params.intersection_cost * sah;
        leaf_cost <= split_cost
    }

    /// The subtree over a range at a level, the root being level 1.
    fn subtree(
        &self,
        mut range: Range<'_>,
        slots: Slots<'_>,
        level: u32,
    ) -> Result<Record, BuildError> {
        let n = range.len();
        let at_limit = level + RESERVED_LEVELS >= self.params.max_depth;
        if n <= self.params.min_leaf_size as usize || at_limit {
            range.sort();
            return self.leaf_phase(range, slots, level);
        }
        let split = self.find_split(&range);
        if n <= self.params.max_leaf_size as usize && self.leaf_is_cheap(&range, split.as_ref()) {
            range.sort();
            return self.leaf_phase(range, slots, level);
        }
        let bounds = range.bounds;
        let mut children = Children::new(range.divide(split));
        while children.len() < self.params.branching_factor as usize {
            // The largest box first; ties keep the older child.
            let Some(largest) = children.best(
                |c| c.len() > self.params.min_leaf_size as usize,
                |c| c.bounds.geometry.half_area(),
            ) else {
                break;
            };
            let child = children.take(largest);
            let split = self.find_split(&child);
            let [left, right] = child.divide(split);
            children.put(largest, left);
            children.push(right);
        }
        children.sort_by_descending_size();
        self.node(&bounds, children, slots, level, Self::subtree)
    }

    /// Leaves, and halving without regard to cost where too many references are left. The
    /// references of the range are sorted.
    fn leaf_phase(
        &self,
        range: Range<'_>,
        slots: Slots<'_>,
        level: u32,
    ) -> Result<Record, BuildError> {
        let n = range.len();
        let max_leaf_size = self.params.max_leaf_size as usize;
        if level > self.params.max_depth {
            return Err(self.depth_error(n, level));
        }
        if n <= max_leaf_size {
            for (leaf, reference) in range.leaves.iter_mut().zip(&*range.references) {
                *leaf = reference.leaf_reference();
            }
            let blocks = n.div_ceil(BLOCK_SIZE) as u32;
            return Ok(Record::leaf(&range.bounds.geometry, range.begin, n, blocks));
        }
        let bounds = range.bounds;
        let mut children = Children::new(range.halve());
        while children.len() < self.params.branching_factor as usize {
            let Some(largest) = children.best(|c| c.len() > max_leaf_size, |c| c.len() as f32)
            else {
                break;
            };
            let [left, right] = children.take(largest).halve();
            children.put_last_at(largest);
            children.push(left);
            children.push(right);
        }
        self.node(&bounds, children, slots, level, Self::leaf_phase)
    }

    /// Builds the children, at the same time where they are large, and records their node.
    fn node(
        &self,
        bounds: &RangeBounds,
        children: Children<'_>,
        slots: Slots<'_>,
        level: u32,
        build: fn(&Self, Range<'_>, Slots<'_>, u32) -> Result<Record, BuildError>,
    ) -> Result<Record, BuildError> {
        let (own, mut rest) = slots.records.split_at_mut(children.len());
        let mut rest_begin = slots.begin + own.len();
        let mut jobs: [Option<(Range<'_>, Slots<'_>)>; MAX_CHILDREN] =
            [const { None }; MAX_CHILDREN];
        for (job, range) in jobs.iter_mut().zip(children.into_iter()) {
            let needed = 2 * range.len() - 2;
            let (records, others) = rest.split_at_mut(needed);
            *job = Some((
                range,
                Slots {
                    records,
                    begin: rest_begin,
                },
            ));
            rest = others;
            rest_begin += needed;
        }
        let count = own.len();
        self.run(&mut jobs[..count], own, level + 1, build)?;
        Ok(Record::inner(&bounds.geometry, slots.begin, own))
    }

    fn run(
        &self,
        jobs: &mut [Option<(Range<'_>, Slots<'_>)>],
        records: &mut [Record],
        level: u32,
        build: fn(&Self, Range<'_>, Slots<'_>, u32) -> Result<Record, BuildError>,
    ) -> Result<(), BuildError> {
        if let ([job], [record]) = (&mut *jobs, &mut *records) {
            if let Some((range, slots)) = job.take() {
                *record = build(self, range, slots, level)?;
            }
            return Ok(());
        }
        let middle = jobs.len() / 2;
        let (jobs_a, jobs_b) = jobs.split_at_mut(middle);
        let (records_a, records_b) = records.split_at_mut(middle);
        let size: usize = jobs_a
            .iter()
            .chain(&*jobs_b)
            .flatten()
            .map(|(range, _)| range.len())
            .sum();
        if size < tasks::TASK_SIZE {
            self.run(jobs_a, records_a, level, build)?;
            return self.run(jobs_b, records_b, level, build);
        }
        let (a, b) = tasks::join(
            || self.run(jobs_a, records_a, level, build),
            || self.run(jobs_b, records_b, level, build),
        );
        a.and(b)
    }

    fn depth_error(&self, n: usize, level: u32) -> BuildError {
        let mut needed = level;
        let mut capacity = u64::from(self.params.max_leaf_size);
        while capacity < n as u64 {
            capacity *= u64::from(self.params.branching_factor);
            needed += 1;
        }
        BuildError::DepthLimit {
            max_depth: self.params.max_depth,
            needed,
        }
    }
}

/// The children of the node that is being made: at most [`MAX_CHILDREN`], without allocation.
struct Children<'a> {
    ranges: [Option<Range<'a>>; MAX_CHILDREN],
    len: usize,
}

impl<'a> Children<'a> {
    fn new([left, right]: [Range<'a>; 2]) -> Self {
        let mut children = Self {
            ranges: [const { None }; MAX_CHILDREN],
            len: 0,
        };
        children.push(left);
        children.push(right);
        children
    }

    fn len(&self) -> usize {
        self.len
    }

    fn push(&mut self, range: Range<'a>) {
        self.ranges[self.len] = Some(range);
        self.len += 1;
    }

    /// The child with the largest value among those that qualify; ties keep the first.
    fn best(
        &self,
        qualifies: impl Fn(&Range<'a>) -> bool,
        value: impl Fn(&Range<'a>) -> f32,
    ) -> Option<usize> {
        let mut best: Option<(usize, f32)> = None;
        for (index, range) in self.ranges.iter().enumerate() {
            if let Some(range) = range.as_ref().filter(|range| qualifies(range)) {
                let value = value(range);
                if best.is_none_or(|(_, other)| value > other) {
                    best = Some((index, value));
                }
            }
        }
        best.map(|(index, _)| index)
    }

    /// Takes a child out; its place must be filled again.
    fn take(&mut self, index: usize) -> Range<'a> {
        self.ranges[index]
            .take()
            .expect("`best` names a child that is there")
    }

    fn put(&mut self, index: usize, range: Range<'a>) {
        self.ranges[index] = Some(range);
    }

    /// Moves the last child into the empty place `index` (which may be the last itself).
    fn put_last_at(&mut self, index: usize) {
        self.len -= 1;
        if index != self.len {
            self.ranges[index] = self.ranges[self.len].take();
        }
    }

    fn sort_by_descending_size(&mut self) {
        self.ranges[..self.len]
            .sort_by_key(|range| std::cmp::Reverse(range.as_ref().map_or(0, Range::len)));
    }

    fn into_iter(self) -> impl Iterator<Item = Range<'a>> {
        self.ranges.into_iter().flatten()
    }
}
